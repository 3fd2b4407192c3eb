//! Estimates as CSV with a header: columns by name, in any order, others ignored.
//!
//! `t_s, x_m, y_m, yaw_rad, cov_xx, cov_xy, cov_xyaw, cov_yy, cov_yyaw, cov_yawyaw` in the world
//! frame. Optional: `now_s`, the time at which the estimate is used; `cov_yx, cov_yawx, cov_yawy`,
//! the lower half of the covariance, where a source writes it apart (absent or empty: the mirror).

use crate::set::Estimate;
use std::format;
use std::io::Read;
use std::string::{String, ToString};
use std::vec::Vec;

/// Which columns are read; all others are ignored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Columns {
    /// `x_m, y_m, yaw_rad`.
    Poses,
    /// Poses, and the times where they are there.
    TimedPoses,
    /// Timed poses and the covariance.
    Estimates,
}

/// One row of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Seconds; `None` where there is no such column.
    pub t_s: Option<f64>,
    /// Seconds; when the estimate is used.
    pub now_s: Option<f64>,
    /// The estimate.
    pub estimate: Estimate,
    /// Covariance of (x, y, yaw) by rows; all NaN where it was not read.
    pub covariance: [[f64; 3]; 3],
}

/// Why a file is no recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// A column that must be there is not.
    #[error(
        "{file}:1:1: there is no column `{column}`; expected a header with {expected} (this one has {found})"
    )]
    MissingColumn {
        /// The file.
        file: String,
        /// The column.
        column: &'static str,
        /// All that are needed.
        expected: String,
        /// Those that are there.
        found: String,
    },
    /// A column appears twice.
    #[error("{file}:1:1: the column `{column}` appears twice; keep one of them")]
    RepeatedColumn {
        /// The file.
        file: String,
        /// The column.
        column: String,
    },
    /// A field that is no number.
    #[error(
        "{file}:{line}:{column}: `{found}` in `{name}` is no number; expected a decimal number (`nan` and `inf` are numbers, and are denied)"
    )]
    NotANumber {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u64,
        /// Field of the line, from 1.
        column: usize,
        /// The column's name.
        name: &'static str,
        /// What stands there.
        found: String,
    },
    /// A file of a covariance that is not three by three.
    #[error(
        "{file}:{line}: {found} {what}; expected 3 (a covariance of x, y, yaw without a header)"
    )]
    Shape {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u64,
        /// Of what there are too few or too many.
        what: &'static str,
        /// How many there are.
        found: usize,
    },
    /// The file cannot be read, or a line has another number of fields than the header.
    #[error("{file}: {source}")]
    Csv {
        /// The file.
        file: String,
        /// Why.
        source: csv::Error,
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

/// Reads the rows of a CSV; `file` names it in errors.
///
/// # Errors
/// The first [`LogError`].
pub fn estimates(input: impl Read, file: &str, columns: Columns) -> Result<Vec<Row>, LogError> {
    let failed = |source| LogError::Csv {
        file: file.into(),
        source,
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(input);
    let header = reader.headers().map_err(failed)?.clone();
    let names: Vec<&str> = header
        .iter()
        .map(|name| name.trim_start_matches('\u{feff}'))
        .collect();
    let optional = |name: &'static str| -> Result<Option<(usize, &'static str)>, LogError> {
        let mut places = names.iter().enumerate().filter(|(_, n)| **n == name);
        let place = places.next().map(|(index, _)| (index, name));
        match places.next() {
            None => Ok(place),
            Some(_) => Err(LogError::RepeatedColumn {
                file: file.into(),
                column: name.into(),
            }),
        }
    };
    let needed = |name: &'static str| {
        optional(name)?.ok_or_else(|| {
            let mut expected = POSE.to_vec();
            if columns == Columns::Estimates {
                expected.extend(COVARIANCE);
            }
            LogError::MissingColumn {
                file: file.into(),
                column: name,
                expected: expected.join(", "),
                found: format!("{:?}", names.join(", ")),
            }
        })
    };
    let times = || Ok([optional("t_s")?, optional("now_s")?]);
    let pose = [needed(POSE[0])?, needed(POSE[1])?, needed(POSE[2])?];
    let (times, upper, lower) = match columns {
        Columns::Poses => ([None; 2], None, [None; 3]),
        Columns::TimedPoses => (times()?, None, [None; 3]),
        Columns::Estimates => {
            let mut places = [(0, ""); 6];
            for (place, name) in places.iter_mut().zip(COVARIANCE) {
                *place = needed(name)?;
            }
            let lower = [
                optional("cov_yx")?,
                optional("cov_yawx")?,
                optional("cov_yawy")?,
            ];
            (times()?, Some(places), lower)
        }
    };
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(failed)?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |(index, name): (usize, &'static str)| {
            let text = record.get(index).unwrap_or("");
            text.parse::<f64>().map_err(|_| LogError::NotANumber {
                file: file.into(),
                line,
                column: index + 1,
                name,
                found: text.to_string(),
            })
        };
        let maybe = |place: Option<(usize, &'static str)>| {
            place
                .filter(|(index, _)| !record.get(*index).unwrap_or("").is_empty())
                .map(number)
                .transpose()
        };
        let mut covariance = [[f64::NAN; 3]; 3];
        if let Some(upper) = upper {
            let mut v = [0.0; 6];
            for (value, place) in v.iter_mut().zip(upper) {
                *value = number(place)?;
            }
            let [xx, xy, xt, yy, yt, tt] = v;
            let yx = maybe(lower[0])?.unwrap_or(xy);
            let tx = maybe(lower[1])?.unwrap_or(xt);
            let ty = maybe(lower[2])?.unwrap_or(yt);
            covariance = [[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]];
        }
        rows.push(Row {
            t_s: times[0].map(number).transpose()?,
            now_s: times[1].map(number).transpose()?,
            estimate: Estimate {
                x_m: number(pose[0])?,
                y_m: number(pose[1])?,
                yaw_rad: number(pose[2])?,
            },
            covariance,
        });
    }
    Ok(rows)
}

/// Seconds on the controller's wrapping millisecond clock: `floor(1000 t) mod 2^32`. `None` for what
/// is no time; such a stamp is stale.
#[must_use]
pub fn clock_ms(seconds: f64) -> Option<u32> {
    let ms = libm::floor(seconds * 1000.0);
    (ms.abs() < 9e15).then(|| ms.rem_euclid(4_294_967_296.0) as u32)
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
    fn columns_go_by_name() {
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
    fn bad_files_are_named_with_their_place() {
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
        assert!(error.contains("line: 2"), "{error}");
        assert!(read("x_m,x_m,y_m,yaw_rad\n").unwrap_err().contains("twice"));
    }

    #[test]
    fn clocks_wrap() {
        assert_eq!(clock_ms(1.2345), Some(1234));
        assert_eq!(clock_ms(4_294_967.296), Some(0));
        assert_eq!(clock_ms(-0.001), Some(u32::MAX));
        for bad in [f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(clock_ms(bad), None);
        }
    }
}
