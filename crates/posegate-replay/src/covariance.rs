//! A covariance as CSV: three rows of three numbers without a header.

use super::LogError;
use super::estimates::ANY_NUMBER;
use posegate_files::sheet::{Records, SheetError, SheetFault, settings};
use std::io::Read;

/// Reads the covariance of (x, y, yaw), m and rad, by rows; `file` names it in errors. Lines that begin with `#`
/// are comments. The function does not check whether the matrix is a covariance.
///
/// # Errors
/// The first [`LogError`].
pub fn covariance(input: impl Read, file: &str) -> Result<[[f64; 3]; 3], LogError> {
    const NAMES: [[&str; 3]; 3] = [
        ["cov_xx", "cov_xy", "cov_xyaw"],
        ["cov_yx", "cov_yy", "cov_yyaw"],
        ["cov_yawx", "cov_yawy", "cov_yawyaw"],
    ];
    let mut settings = settings();
    settings.comment(Some(b'#'));
    let mut records = Records::new(&settings, input, file);
    let mut rows = [[0.0; 3]; 3];
    let mut count = 0;
    let mut last = 0;
    while let Some((record, line)) = records.next_record()? {
        if record.iter().all(|text| text.trim().is_empty()) {
            continue;
        }
        let shape = |what: &'static str, found: usize| LogError::Shape {
            file: file.into(),
            line,
            what,
            found,
        };
        let Some((row, names)) = rows.get_mut(count).zip(NAMES.get(count)) else {
            return Err(shape("rows", count + 1));
        };
        if record.len() != 3 {
            return Err(shape("numbers in each row", record.len()));
        }
        for (column, (entry, name)) in row.iter_mut().zip(names).enumerate() {
            let text = record.get(column).unwrap_or("").trim();
            let text = text.trim_start_matches('\u{feff}');
            *entry = text.parse().map_err(|_| {
                let fault = SheetFault::Field {
                    text: text.into(),
                    name: (*name).into(),
                    expected: ANY_NUMBER.into(),
                };
                SheetError::new(file, line, Some(column + 1), fault)
            })?;
        }
        (count, last) = (count + 1, line);
    }
    if count < 3 {
        return Err(LogError::Shape {
            file: file.into(),
            line: last.max(1),
            what: "rows",
            found: count,
        });
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<[[f64; 3]; 3], std::string::String> {
        covariance(text.as_bytes(), "p.csv").map_err(|error| error.to_string())
    }

    #[test]
    fn covariance_needs_three_rows_of_three_numbers() {
        let rows = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9e-3]];
        assert_eq!(read("1,2,3\n4,5,6\n7,8,9e-3\n"), Ok(rows));
        assert_eq!(
            read("\u{feff}1, 2 ,3\r\n# P\r\n\r\n4,5,6\r\n7,8,9e-3"),
            Ok(rows)
        );
        for (text, start) in [
            ("1,2,3\n4,5,6\n", "p.csv:2: 2 rows"),
            ("", "p.csv:1: 0 rows"),
            ("1,2\n3,4\n", "p.csv:1: 2 numbers"),
            ("1,2,3\n4,5,6\n7,8,9\n1,1,1\n", "p.csv:4: 4 rows"),
            (
                "x,y,yaw\n1,2,3\n4,5,6\n7,8,9\n",
                "p.csv:1:1: `x` in `cov_xx`",
            ),
            ("1,2,3\n4,,6\n7,8,9\n", "p.csv:2:2: `` in `cov_yy`"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.starts_with(start), "{error}");
        }
        assert!(read("nan,2,3\n4,5,6\n7,8,9\n").unwrap()[0][0].is_nan());
    }
}
