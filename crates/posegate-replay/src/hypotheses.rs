//! Reports of several hypotheses: rows of one time, numbered by a column `hypothesis`.
//!
//! A particle filter may have several clusters, and a tag that is seen head-on has two poses. Such a report is
//! permitted only if the pose-set of every hypothesis is inside.

use super::{LogError, Row};
use std::ops::Range;

/// Largest number of hypotheses of a report, its own estimate included.
pub const MOST_HYPOTHESES: usize = 8;

/// Returns the rows of each report. Without a column `hypothesis` every row is a report of its own. With it a report
/// begins at each 0; the next rows are its hypotheses 1, 2 and so on, and have the same time.
///
/// # Errors
/// [`LogError::Hypothesis`] for the first row whose number or time does not continue its report, or that exceeds
/// [`MOST_HYPOTHESES`]. `file` names the input.
pub fn reports(rows: &[Row], file: &str) -> Result<Vec<Range<usize>>, LogError> {
    let mut reports: Vec<Range<usize>> = Vec::with_capacity(rows.len());
    for (index, row) in rows.iter().enumerate() {
        let wrong = |expected: String| LogError::Hypothesis {
            file: file.into(),
            line: row.line,
            found: row.hypothesis.unwrap_or_default(),
            expected,
        };
        match (row.hypothesis, reports.last_mut()) {
            (None | Some(0), _) => reports.push(index..index + 1),
            (Some(_), None) => return Err(wrong("0, the first of a report".into())),
            (Some(number), Some(report)) => {
                let first = &rows[report.start];
                let next = report.len() as u64;
                if number != next {
                    return Err(wrong(format!("{next}, or 0 for the next report")));
                }
                if report.len() >= MOST_HYPOTHESES {
                    return Err(wrong(format!(
                        "at most {MOST_HYPOTHESES} hypotheses in a report, numbered from 0"
                    )));
                }
                let times = |row: &Row| [row.t_s, row.now_s].map(|time| time.map(f64::to_bits));
                if times(row) != times(first) {
                    return Err(wrong(
                        "0, since its time is not that of the row before".into(),
                    ));
                }
                report.end = index + 1;
            }
        }
    }
    Ok(reports)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Columns, estimates};

    fn grouped(text: &str) -> Result<Vec<usize>, String> {
        let text = format!("t_s,x_m,y_m,yaw_rad,hypothesis\n{text}");
        let rows = estimates(text.as_bytes(), "log.csv", Columns::TimedPoses);
        let rows = rows.map_err(|error| error.to_string())?;
        let reports = reports(&rows, "log.csv").map_err(|error| error.to_string())?;
        Ok(reports.iter().map(ExactSizeIterator::len).collect())
    }

    #[test]
    fn numbered_rows_of_one_time_are_one_report() {
        let text = "1,0,0,0,0\n1,1,0,0,1\n2,0,0,0,0\n2,0,0,0,0\n2,1,0,0,1\n2,2,0,0,2\n";
        assert_eq!(grouped(text), Ok(vec![2, 1, 3]));
    }

    #[test]
    fn rows_that_do_not_continue_a_report_are_errors() {
        for (text, place) in [
            ("1,0,0,0,1\n", "log.csv:2"),
            ("1,0,0,0,0\n1,0,0,0,2\n", "log.csv:3"),
            ("1,0,0,0,0\n2,0,0,0,1\n", "log.csv:3"),
            ("1,0,0,0,0\n1,0,0,0,1\n1,0,0,0,1\n", "log.csv:4"),
            ("1,0,0,0,-1\n", "log.csv:2:5"),
            ("1,0,0,0,0.5\n", "log.csv:2:5"),
            ("1,0,0,0,\n", "log.csv:2:5"),
        ] {
            let error = grouped(text).expect_err(text);
            assert!(error.starts_with(place), "{error}");
        }
        let nine: String = (0..9).map(|number| format!("1,0,0,0,{number}\n")).collect();
        let error = grouped(&nine).expect_err("nine");
        assert!(
            error.starts_with("log.csv:10") && error.contains("at most 8"),
            "{error}"
        );
    }
}
