//! Estimates as CSV with a header: columns by name, in any order, others ignored.
//!
//! `t_s, x_m, y_m, yaw_rad, cov_xx, cov_xy, cov_xyaw, cov_yy, cov_yyaw, cov_yawyaw` in the world
//! frame. Optional: `now_s`, the time at which the estimate is used; `cov_yx, cov_yawx, cov_yawy`, the
//! lower half of the covariance, if a source writes it separately (default: equal to the upper half);
//! `true_x_m, true_y_m, true_yaw_rad`, the true pose (all three or none; empty if unknown); `hypothesis`, the number of the row
//! within its report ([`super::reports`]).

use posegate::set::Estimate;
use posegate_files::sheet::{Column, Line, Sheet, SheetError, each, settings};
use std::io::Read;

/// The columns to read; all others are ignored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Columns {
    /// `x_m, y_m, yaw_rad`.
    Poses,
    /// Poses, and the times if their columns exist.
    TimedPoses,
    /// Timed poses and the covariance.
    Estimates,
}

/// One row of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time of the estimate, seconds; `None` if there is no such column.
    pub t_s: Option<f64>,
    /// Time at which the estimate is used, seconds; `None` if there is no such column.
    pub now_s: Option<f64>,
    /// The estimate.
    pub estimate: Estimate,
    /// Covariance of (x, y, yaw) by rows, world axes: m^2, m rad, rad^2. All NaN if it was not read.
    pub covariance: [[f64; 3]; 3],
    /// The true pose in the world (m, m, rad), if given.
    pub truth: Option<[f64; 3]>,
    /// The number of the row within its report, from 0; `None` if there is no such column.
    pub hypothesis: Option<u64>,
    /// The time since the last fix, seconds; `None` if the reader has no column for it or the field is empty.
    pub since_fix_s: Option<f64>,
    /// The row's line in the file, from 1.
    pub line: u64,
}

/// The reason why a CSV file cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// A fault of the header, a row or a field.
    #[error(transparent)]
    Sheet(#[from] SheetError),
    /// The `hypothesis` of a row does not continue its report.
    #[error("{file}:{line}: `hypothesis` is {found}; expected {expected}")]
    Hypothesis {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u64,
        /// The number of the row.
        found: u64,
        /// The expected number.
        expected: String,
    },
    /// A covariance file does not have three rows of three numbers.
    #[error(
        "{file}:{line}: {found} {what}; expected 3 (a covariance of x, y, yaw without a header)"
    )]
    Shape {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u64,
        /// `rows` or `numbers in each row`.
        what: &'static str,
        /// Their number.
        found: usize,
    },
}

const POSE: [&str; 3] = ["x_m", "y_m", "yaw_rad"];
const COVARIANCE: [&str; 6] = [
    "cov_xx",
    "cov_xy",
    "cov_xyaw",
    "cov_yy",
    "cov_yyaw",
    "cov_yawyaw",
];
const LOWER: [&str; 3] = ["cov_yx", "cov_yawx", "cov_yawy"];

const TRUTH: [&str; 3] = ["true_x_m", "true_y_m", "true_yaw_rad"];

/// A number in a recording: the gate denies one that is not finite.
pub(super) const ANY_NUMBER: &str =
    "a decimal number (`nan` and `inf` are numbers, and are denied)";

/// Reads the rows of a CSV; `file` names it in errors.
///
/// # Errors
/// The first [`LogError`].
pub fn estimates(input: impl Read, file: &str, columns: Columns) -> Result<Vec<Row>, LogError> {
    Rows::new(input, file, columns)?.collect()
}

/// An iterator over the rows of a CSV.
pub struct Rows<R: Read> {
    sheet: Sheet<R>,
    columns: Places,
}

/// The columns of a row.
struct Places {
    times: [Option<Column>; 2],
    pose: [Column; 3],
    upper: Option<[Column; 6]>,
    lower: [Option<Column>; 3],
    truth: Option<[Column; 3]>,
    hypothesis: Option<Column>,
    since_fix: Option<Column>,
}

impl<R: Read> Rows<R> {
    /// Reads the header; `file` names the input in errors.
    ///
    /// # Errors
    /// A [`LogError`] about the header.
    pub fn new(input: R, file: &str, columns: Columns) -> Result<Self, LogError> {
        let mut settings = settings();
        settings.comment(Some(b'#'));
        let sheet = Sheet::with(&settings, input, file)?;
        let required: &[&[&str]] = match columns {
            Columns::Estimates => &[&POSE, &COVARIANCE],
            _ => &[&POSE],
        };
        // The error of a repeated column is that of the header, as for a missing one.
        let optional = |name: &str| {
            let column = sheet.optional(name);
            column.map_err(|error| SheetError {
                column: Some(1),
                ..error
            })
        };
        let needed =
            |name: &str| optional(name)?.ok_or_else(|| sheet.missing(name, &required.concat()));
        let timed = |name: &str| match columns {
            Columns::Poses => Ok(None),
            _ => optional(name),
        };
        let pose = each(POSE, needed)?;
        let (upper, lower) = if columns == Columns::Estimates {
            (Some(each(COVARIANCE, needed)?), each(LOWER, optional)?)
        } else {
            (None, [None; 3])
        };
        let truth = match each(TRUTH, timed)? {
            [Some(x), Some(y), Some(yaw)] => Some([x, y, yaw]),
            [None, None, None] => None,
            found => {
                let missing = found.iter().position(Option::is_none).unwrap_or(0);
                return Err(sheet.missing(TRUTH[missing], &TRUTH).into());
            }
        };
        let columns = Places {
            times: each(["t_s", "now_s"], timed)?,
            pose,
            upper,
            lower,
            truth,
            hypothesis: timed("hypothesis")?,
            since_fix: None,
        };
        Ok(Self { sheet, columns })
    }

    /// Also reads the time since the last fix from a column. Returns `true` if the header has it.
    pub fn reads_since_fix(&mut self, column: &str) -> bool {
        self.columns.since_fix = self.sheet.first(column);
        self.columns.since_fix.is_some()
    }

    /// Requires that the header has a time column.
    ///
    /// # Errors
    /// [`LogError::Sheet`] if it has none.
    pub fn needs_time(&self) -> Result<(), LogError> {
        let expected = "t_s, the time of each estimate in seconds";
        let missing = || self.sheet.missing("t_s", &[expected]);
        Ok(self.columns.times[0].map(drop).ok_or_else(missing)?)
    }

    /// Returns `true` if the header has `now_s`.
    pub const fn has_use(&self) -> bool {
        self.columns.times[1].is_some()
    }
}

impl Places {
    fn row(&self, line: &Line<'_>) -> Result<Row, SheetError> {
        let number = |column| line.any_number(column, ANY_NUMBER);
        let maybe = |column| line.optional_number(column, ANY_NUMBER);
        let mut covariance = [[f64::NAN; 3]; 3];
        if let Some(upper) = self.upper {
            let [xx, xy, xt, yy, yt, tt] = each(upper, number)?;
            let [yx, tx, ty] = each(self.lower, maybe)?;
            let [yx, tx, ty] = [yx.unwrap_or(xy), tx.unwrap_or(xt), ty.unwrap_or(yt)];
            covariance = [[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]];
        }
        let is_given = |columns: &[Column; 3]| columns.iter().any(|c| !line.text(*c).is_empty());
        let truth = self.truth.filter(is_given);
        let truth = truth.map(|columns| each(columns, number)).transpose()?;
        let [t_s, now_s] = each(self.times, |column| column.map(number).transpose())?;
        let [x_m, y_m, yaw_rad] = each(self.pose, number)?;
        let hypothesis = self.hypothesis.map(|column| line.whole(column));
        Ok(Row {
            t_s,
            now_s,
            estimate: Estimate { x_m, y_m, yaw_rad },
            covariance,
            truth,
            hypothesis: hypothesis.transpose()?,
            since_fix_s: maybe(self.since_fix)?,
            line: line.number,
        })
    }
}

impl<R: Read> Iterator for Rows<R> {
    type Item = Result<Row, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        let row = match self.sheet.line() {
            Ok(line) => self.columns.row(&line?),
            Err(error) => Err(error),
        };
        Some(row.map_err(LogError::from))
    }
}

/// Converts seconds to the controller's wrapping millisecond clock: `floor(1000 t) mod 2^32`. A time that is below a
/// whole millisecond by the rounding of a float is that millisecond: decimals such as 1.001 s are not floats. `None` if the number is not finite or too large; the
/// caller treats the stamp as stale.
#[must_use]
pub fn clock_ms(seconds: f64) -> Option<u32> {
    let ms = seconds * 1000.0;
    // The decimal and the product are rounded by half a unit each; a unit is at most 2^-52 of the value.
    let ms = libm::floor(ms + libm::fabs(ms) * f64::EPSILON * 2.0);
    (ms.abs() < 9e15).then(|| ms.rem_euclid(4_294_967_296.0) as u32)
}

/// Converts nanoseconds to the same clock, in integers.
#[must_use]
pub const fn clock_ms_of_ns(nanoseconds: i64) -> u32 {
    nanoseconds.div_euclid(1_000_000).rem_euclid(1 << 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str =
        "yaw_rad,x_m,y_m,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,other\n";

    fn read(text: &str) -> Result<Vec<Row>, String> {
        estimates(text.as_bytes(), "log.csv", Columns::Estimates).map_err(|e| e.to_string())
    }

    #[test]
    fn columns_are_found_by_name_in_any_order() {
        let rows = read(&format!(
            "{HEADER}3,1,2,11,12,13,22,23,33,x\n nan ,1,inf,1,2,3,4,5,6,\n"
        ))
        .unwrap();
        assert_eq!(
            rows[0].estimate,
            Estimate {
                x_m: 1.0,
                y_m: 2.0,
                yaw_rad: 3.0
            }
        );
        assert_eq!(
            rows[0].covariance,
            [[11.0, 12.0, 13.0], [12.0, 22.0, 23.0], [13.0, 23.0, 33.0]]
        );
        assert!(rows[1].estimate.yaw_rad.is_nan() && rows[1].estimate.y_m.is_infinite());
        assert_eq!(rows[0].t_s, None);
    }

    #[test]
    fn errors_state_file_line_and_column() {
        let error = read("x_m,y_m\n1,2\n").unwrap_err();
        assert!(
            error.contains("log.csv:1:1") && error.contains("`yaw_rad`"),
            "{error}"
        );
        let error = read(&format!(
            "{HEADER}3,1,2,11,12,13,22,23,33,x\n3,1,two,1,2,3,4,5,6,\n"
        ))
        .unwrap_err();
        assert!(error.starts_with("log.csv:3:3: `two` in `y_m`"), "{error}");
        let error = read(&format!("{HEADER}3,1,,1,2,3,4,5,6,\n")).unwrap_err();
        assert!(error.starts_with("log.csv:2:3: ``"), "{error}");
        let error = read(&format!("{HEADER}3,1\n")).unwrap_err();
        assert!(
            error.starts_with("log.csv:2:3: 2 fields; the header has 10"),
            "{error}"
        );
        assert!(read("x_m,x_m,y_m,yaw_rad\n").unwrap_err().contains("twice"));
    }

    #[test]
    fn incomplete_truth_is_an_error() {
        let header = HEADER.replace("other", "true_yaw_rad,true_x_m,true_y_m");
        let rows = read(&format!(
            "{header}3,1,2,11,12,13,22,23,33,9,7,8\n3,1,2,11,12,13,22,23,33,,,\n"
        ))
        .unwrap();
        assert_eq!(rows[0].truth, Some([7.0, 8.0, 9.0]));
        assert_eq!(rows[1].truth, None);
        let error = read(&format!("{header}3,1,2,11,12,13,22,23,33,,7,8\n")).unwrap_err();
        assert!(error.contains("`true_yaw_rad`"), "{error}");
        let error = read(&HEADER.replace("other", "true_x_m,true_yaw_rad")).unwrap_err();
        assert!(error.contains("`true_y_m`"), "{error}");
    }

    #[test]
    fn clock_wraps_at_2_pow_32_ms() {
        assert_eq!(clock_ms(1.2345), Some(1234));
        // Half a microsecond below a millisecond is no rounding of a float.
        assert_eq!(clock_ms(1.000_999_5), Some(1000));
        for ms in (0..200_000i64).chain([1_700_000_000_001, 1_700_000_000_999]) {
            let text = format!("{}.{:03}", ms / 1_000, ms % 1_000);
            let seconds: f64 = text.parse().unwrap();
            let expected = (ms % (1 << 32)) as u32;
            assert_eq!(clock_ms(seconds), Some(expected), "{text}");
        }
        assert_eq!(clock_ms(4_294_967.296), Some(0));
        assert_eq!(clock_ms(-0.001), Some(u32::MAX));
        assert_eq!(clock_ms_of_ns(1_234_999_999), 1234);
        assert_eq!(clock_ms_of_ns(4_294_967_296_000_000), 0);
        assert_eq!(clock_ms_of_ns(-1), u32::MAX);
        for bad in [f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(clock_ms(bad), None);
        }
    }
}
