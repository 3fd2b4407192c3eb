//! Estimates as CSV with a header: columns by name, in any order, others ignored.
//!
//! `t_s, x_m, y_m, yaw_rad, cov_xx, cov_xy, cov_xyaw, cov_yy, cov_yyaw, cov_yawyaw` in the world
//! frame. Optional: `now_s`, the time at which the estimate is used; `cov_yx, cov_yawx, cov_yawy`, the
//! lower half of the covariance, if a source writes it separately (default: equal to the upper half);
//! `true_x_m, true_y_m, true_yaw_rad`, the true pose (all three or none; empty if unknown); `hypothesis`, the number of the row
//! within its report ([`super::reports`]).

use posegate::set::Estimate;
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
    /// A required column is missing.
    #[error(
        "{file}:1:1: there is no column `{column}`; expected a header with {expected} (this one has {found})"
    )]
    MissingColumn {
        /// The file.
        file: String,
        /// The column.
        column: &'static str,
        /// All required columns.
        expected: String,
        /// The existing columns.
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
    /// A field is not a number.
    #[error(
        "{file}:{line}:{column}: `{found}` in `{name}` is not a number; expected a decimal number (`nan` and `inf` are numbers, and are denied)"
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
        /// The text of the field.
        found: String,
    },
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
    /// The file cannot be read, or a line has another number of fields than the header.
    #[error("{file}: {source}")]
    Csv {
        /// The file.
        file: String,
        /// The cause.
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

const TRUTH: [&str; 3] = ["true_x_m", "true_y_m", "true_yaw_rad"];

/// The index and the name of an existing column.
type Place = (usize, &'static str);

/// Reads the rows of a CSV; `file` names it in errors.
///
/// # Errors
/// The first [`LogError`].
pub fn estimates(input: impl Read, file: &str, columns: Columns) -> Result<Vec<Row>, LogError> {
    Rows::new(input, file, columns)?.collect()
}

/// An iterator over the rows of a CSV.
pub struct Rows<R: Read> {
    reader: csv::Reader<R>,
    record: csv::StringRecord,
    file: String,
    header: String,
    times: [Option<Place>; 2],
    pose: [Place; 3],
    upper: Option<[Place; 6]>,
    lower: [Option<Place>; 3],
    truth: Option<[Place; 3]>,
    hypothesis: Option<Place>,
    since_fix: Option<Place>,
}

impl<R: Read> Rows<R> {
    /// Reads the header; `file` names the input in errors.
    ///
    /// # Errors
    /// A [`LogError`] about the header.
    pub fn new(input: R, file: &str, columns: Columns) -> Result<Self, LogError> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            // Numbers need no quotes. An unclosed quote would hide the rest of the file.
            .quoting(false)
            .comment(Some(b'#'))
            .from_reader(input);
        let header = reader.headers().map_err(|source| LogError::Csv {
            file: file.into(),
            source,
        })?;
        let names: Vec<String> = header
            .iter()
            .map(|name| name.trim_start_matches('\u{feff}').into())
            .collect();
        let optional = |name: &'static str| -> Result<Option<Place>, LogError> {
            let mut places = names.iter().enumerate().filter(|(_, n)| **n == *name);
            let place = places.next().map(|(index, _)| (index, name));
            match places.next() {
                None => Ok(place),
                Some(_) => Err(LogError::RepeatedColumn {
                    file: file.into(),
                    column: name.into(),
                }),
            }
        };
        let missing = |column: &'static str, expected: &[&str]| LogError::MissingColumn {
            file: file.into(),
            column,
            expected: expected.join(", "),
            found: format!("{:?}", names.join(", ")),
        };
        let needed = |name: &'static str| {
            optional(name)?.ok_or_else(|| {
                let mut expected = POSE.to_vec();
                if columns == Columns::Estimates {
                    expected.extend(COVARIANCE);
                }
                missing(name, &expected)
            })
        };
        let timed = |name| match columns {
            Columns::Poses => Ok(None),
            _ => optional(name),
        };
        let pose = [needed(POSE[0])?, needed(POSE[1])?, needed(POSE[2])?];
        let (upper, lower) = if columns == Columns::Estimates {
            let mut places = [(0, ""); 6];
            for (place, name) in places.iter_mut().zip(COVARIANCE) {
                *place = needed(name)?;
            }
            let lower = [
                optional("cov_yx")?,
                optional("cov_yawx")?,
                optional("cov_yawy")?,
            ];
            (Some(places), lower)
        } else {
            (None, [None; 3])
        };
        let truth = match [timed(TRUTH[0])?, timed(TRUTH[1])?, timed(TRUTH[2])?] {
            [Some(x), Some(y), Some(yaw)] => Some([x, y, yaw]),
            [None, None, None] => None,
            [x, y, _] => {
                let column = match (x, y) {
                    (None, _) => TRUTH[0],
                    (_, None) => TRUTH[1],
                    _ => TRUTH[2],
                };
                return Err(missing(column, &TRUTH));
            }
        };
        let times = [timed("t_s")?, timed("now_s")?];
        let hypothesis = timed("hypothesis")?;
        let header = names.join(", ");
        Ok(Self {
            reader,
            record: csv::StringRecord::new(),
            file: file.into(),
            header,
            times,
            pose,
            upper,
            lower,
            truth,
            hypothesis,
            since_fix: None,
        })
    }

    /// Also reads the time since the last fix from a column. Returns `true` if the header has it.
    pub fn reads_since_fix(&mut self, column: &str) -> bool {
        let index = self.header.split(", ").position(|name| name == column);
        self.since_fix = index.map(|index| (index, "the time since the last fix"));
        index.is_some()
    }

    /// Requires that the header has a time column.
    ///
    /// # Errors
    /// [`LogError::MissingColumn`] if it has none.
    pub fn needs_time(&self) -> Result<(), LogError> {
        match self.times[0] {
            Some(_) => Ok(()),
            None => Err(LogError::MissingColumn {
                file: self.file.clone(),
                column: "t_s",
                expected: "t_s, the time of each estimate in seconds".into(),
                found: format!("{:?}", self.header),
            }),
        }
    }

    /// Returns `true` if the header has `now_s`.
    pub const fn has_use(&self) -> bool {
        self.times[1].is_some()
    }

    fn number(&self, (index, name): Place) -> Result<f64, LogError> {
        let text = self.record.get(index).unwrap_or("");
        text.parse::<f64>().map_err(|_| LogError::NotANumber {
            file: self.file.clone(),
            line: self.line(),
            column: index + 1,
            name,
            found: text.to_string(),
        })
    }

    fn line(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::line)
    }

    /// Returns a whole number.
    fn whole(&self, (index, name): Place) -> Result<u64, LogError> {
        let text = self.record.get(index).unwrap_or("");
        text.parse::<u64>().map_err(|_| LogError::NotANumber {
            file: self.file.clone(),
            line: self.line(),
            column: index + 1,
            name,
            found: text.to_string(),
        })
    }

    /// Returns a number, or `None` if the field is empty or its column is missing.
    fn maybe(&self, place: Option<Place>) -> Result<Option<f64>, LogError> {
        place
            .filter(|(index, _)| !self.record.get(*index).unwrap_or("").is_empty())
            .map(|place| self.number(place))
            .transpose()
    }

    fn row(&self) -> Result<Row, LogError> {
        let mut covariance = [[f64::NAN; 3]; 3];
        if let Some(upper) = self.upper {
            let mut v = [0.0; 6];
            for (value, place) in v.iter_mut().zip(upper) {
                *value = self.number(place)?;
            }
            let [xx, xy, xt, yy, yt, tt] = v;
            let yx = self.maybe(self.lower[0])?.unwrap_or(xy);
            let tx = self.maybe(self.lower[1])?.unwrap_or(xt);
            let ty = self.maybe(self.lower[2])?.unwrap_or(yt);
            covariance = [[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]];
        }
        let time = |place: Option<Place>| place.map(|place| self.number(place)).transpose();
        let truth = match self.truth {
            None => None,
            Some(places) => {
                let empty = |(index, _): &Place| self.record.get(*index).unwrap_or("").is_empty();
                if places.iter().all(empty) {
                    None
                } else {
                    let [x, y, yaw] = places;
                    Some([self.number(x)?, self.number(y)?, self.number(yaw)?])
                }
            }
        };
        Ok(Row {
            t_s: time(self.times[0])?,
            now_s: time(self.times[1])?,
            estimate: Estimate {
                x_m: self.number(self.pose[0])?,
                y_m: self.number(self.pose[1])?,
                yaw_rad: self.number(self.pose[2])?,
            },
            covariance,
            truth,
            hypothesis: self.hypothesis.map(|place| self.whole(place)).transpose()?,
            since_fix_s: self.maybe(self.since_fix)?,
            line: self.line(),
        })
    }
}

impl<R: Read> Iterator for Rows<R> {
    type Item = Result<Row, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        match self.reader.read_record(&mut self.record) {
            Ok(false) => None,
            Ok(true) => Some(self.row()),
            Err(source) => Some(Err(LogError::Csv {
                file: self.file.clone(),
                source,
            })),
        }
    }
}

/// Converts seconds to the controller's wrapping millisecond clock: `floor(1000 t) mod 2^32`. `None` if the number is
/// not finite or too large; the caller treats the stamp as stale.
#[must_use]
pub fn clock_ms(seconds: f64) -> Option<u32> {
    let ms = libm::floor(seconds * 1000.0);
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
        assert!(error.contains("line: 2"), "{error}");
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
