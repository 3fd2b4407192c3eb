//! Views of tags and their outcomes: detected or not, with which error.

use super::LearnError;
use super::draw::{Digesting, Kept};
use super::runs::Runs;
use super::sheet::{Column, Line, Sheet};
use crate::input::Limit;
use std::io::Read;

const NEEDED: [&str; 6] = [
    "d_m",
    "phi_deg",
    "psi_deg",
    "detected",
    "err_translation_m",
    "err_yaw_rad",
];
/// The errors of the detector's second pose of the tag.
const SECOND: [&str; 2] = ["second_err_translation_m", "second_err_yaw_rad"];
const PLACE: [&str; 3] = ["d_m", "phi_deg", "psi_deg"];

/// One view of a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// `[d, phi, psi]` of the true pose. d is the distance from camera to tag, metres, above 0. phi is the angle
    /// between the optical axis and the ray to the tag, psi that between the tag's normal and the ray to the camera:
    /// degrees, 0 to 180.
    pub at: [f64; 3],
    /// The magnitudes of the errors of the position, metres, and of the yaw, radians; `None` if the tag was
    /// not detected. If the detector gave two poses: those of the pose with the smaller yaw error.
    pub errors: Option<[f64; 2]>,
}

/// The rows of a file of detections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Detections {
    /// The rows in the file's order.
    pub rows: Vec<Detection>,
    /// The runs: rows of one run depend on each other.
    pub runs: Runs,
    /// The times of the rows, seconds; empty if the file has none.
    pub times: Vec<f64>,
    /// SHA-256 of the file.
    pub sha256: [u8; 32],
    /// The number of rows in the file if only some rows were drawn; else `None`.
    pub drawn_of: Option<u64>,
    /// `true` if the errors are those of the better one of both poses that a detector gives of a tag.
    pub of_better_pose: bool,
}

/// The most rows that [`Detections::draw`] keeps.
pub const DRAWN: usize = 200_000;

impl Detections {
    /// Reads `d_m, phi_deg, psi_deg, detected, err_translation_m, err_yaw_rad`; the errors are empty if `detected` is
    /// 0. Rows with the same text in the column `run` depend on each other. Without that column, consecutive rows at
    /// video rate by `t_s` (seconds) are split into runs at gaps ([`Runs::of_times`]).
    ///
    /// The columns `second_err_translation_m, second_err_yaw_rad` are the errors of the second pose that fits a tag's
    /// image, empty if the detector gave one pose. A row then has the errors of the pose with the smaller yaw error.
    /// The bounds are valid for that pose, in a gate that uses both poses as hypotheses.
    ///
    /// # Errors
    /// A missing column; the first invalid field, with its line and column; a file without rows.
    pub fn read(bytes: &[u8], file: &str) -> Result<Self, LearnError> {
        Self::drawn(bytes, file, usize::MAX, 0)
    }

    /// Reads like [`Detections::read`], from a file of any length, which is read once. If there are more than
    /// [`DRAWN`] rows without `run` and `t_s`, this number is drawn at random, by their positions in the file and the
    /// seed: memory does not grow with the file. The guarantees are those for the drawn rows. Every row of the file
    /// is checked. All rows with `run` or `t_s` are kept, so such a file may have 256 MiB.
    ///
    /// # Errors
    /// As [`Detections::read`]; a line of more than a MiB; a file with `run` or `t_s` that is too long.
    pub fn draw(reader: impl Read, file: &str, seed: u64) -> Result<Self, LearnError> {
        Self::drawn(reader, file, DRAWN, seed)
    }

    fn drawn(reader: impl Read, file: &str, most: usize, seed: u64) -> Result<Self, LearnError> {
        let mut digest = Digesting::new(reader);
        let mut sheet = Sheet::new(&mut digest, file)?;
        let mut columns = Vec::new();
        for name in NEEDED {
            columns.push(sheet.needed(name, &NEEDED)?);
        }
        let second = match [sheet.optional(SECOND[0])?, sheet.optional(SECOND[1])?] {
            [Some(translation), Some(yaw)] => Some([translation, yaw]),
            [None, None] => None,
            [first, _] => {
                // The other column is missing.
                let missing = SECOND[usize::from(first.is_some())];
                return Err(sheet.needed(missing, &SECOND).map_or_else(
                    |error| error,
                    |_| LearnError::Empty {
                        file: file.to_owned(),
                    },
                ));
            }
        };
        let run = sheet.optional("run")?;
        let time = sheet.optional("t_s")?;
        let dependent = run.is_some() || time.is_some();
        let (mut names, mut times) = (Vec::new(), Vec::new());
        let mut kept = Kept::new(if dependent { usize::MAX } else { most }, seed);
        while let Some(line) = sheet.line()? {
            if dependent && most != usize::MAX && line.byte() > Limit::FILE.bytes {
                return Err(line.wrong_row(format!(
                    "more than {} MiB of rows with a `run` or a `t_s`; give fewer runs",
                    Limit::FILE.bytes >> 20
                )));
            }
            let at = place(&line, &columns)?;
            if let Some(run) = run {
                names.push(line.name(run, "the name of a drive, a video or an approach")?);
            }
            if let Some(time) = time {
                times.push(line.number(time, |_| true, "a time in seconds")?);
            }
            let errors = if line.flag(columns[3])? {
                let first = errors(&line, [columns[4], columns[5]])?;
                let one =
                    |[a, b]: [Column; 2]| line.empty(a, "").is_ok() && line.empty(b, "").is_ok();
                match second.filter(|columns| !one(*columns)) {
                    Some(columns) => {
                        let second = errors(&line, columns)?;
                        Some(if second[1] < first[1] { second } else { first })
                    }
                    None => Some(first),
                }
            } else {
                for column in columns[4..].iter().chain(second.iter().flatten()) {
                    line.empty(*column, "the row's `detected` is 0")?;
                }
                None
            };
            kept.push(Detection { at, errors });
        }
        drop(sheet);
        let (rows, drawn_of) = kept.rows();
        if rows.is_empty() {
            return Err(LearnError::Empty {
                file: file.to_owned(),
            });
        }
        let runs = match run {
            Some(_) => Runs::of_names(names.iter().map(String::as_str)),
            None => Runs::of_times(&times),
        };
        Ok(Self {
            rows,
            runs,
            times,
            sha256: digest.sha256(),
            drawn_of,
            of_better_pose: second.is_some(),
        })
    }
}

/// Returns the magnitudes of a pose's errors, metres and radians.
fn errors(line: &Line<'_>, [translation, yaw]: [Column; 2]) -> Result<[f64; 2], LearnError> {
    let translation = line.number(
        translation,
        |error| error >= 0.0,
        "the size of an error in metres, 0 or more",
    )?;
    let yaw = line.number(
        yaw,
        |error| libm::fabs(error) <= 7.0,
        "an error in radians, at most a turn",
    )?;
    Ok([translation, libm::fabs(yaw)])
}

/// Reads the places `d_m, phi_deg, psi_deg` for which a model is evaluated ([`Detection::at`]).
///
/// # Errors
/// A missing column; the first invalid field, with its line and column.
pub fn places(bytes: &[u8], file: &str) -> Result<Vec<[f64; 3]>, LearnError> {
    let mut sheet = Sheet::new(bytes, file)?;
    let mut columns = Vec::new();
    for name in PLACE {
        columns.push(sheet.needed(name, &PLACE)?);
    }
    let mut rows = Vec::new();
    while let Some(line) = sheet.line()? {
        rows.push(place(&line, &columns)?);
    }
    Ok(rows)
}

fn place(line: &Line<'_>, columns: &[Column]) -> Result<[f64; 3], LearnError> {
    let angle = |angle: f64| (0.0..=180.0).contains(&angle);
    Ok([
        line.number(columns[0], |d| d > 0.0, "a distance in metres, above 0")?,
        line.number(columns[1], angle, "an angle in degrees, 0 to 180")?,
        line.number(columns[2], angle, "an angle in degrees, 0 to 180")?,
    ])
}

/// Returns a digest in hexadecimal digits.
pub(super) fn hexadecimal(digest: &[u8; 32]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "d_m,phi_deg,psi_deg,detected,err_translation_m,err_yaw_rad\n";

    fn read(text: &str) -> Result<Detections, String> {
        Detections::read(text.as_bytes(), "d.csv").map_err(|error| format!("{error}"))
    }

    #[test]
    fn rows_are_read_by_name() {
        let found = read(
            "psi_deg,other,detected,d_m,phi_deg,err_yaw_rad,err_translation_m\n30,x,1,2.5,4,-0.01,0.02\n31,,0,3,5,,\n",
        )
        .unwrap();
        assert_eq!(found.rows[0].at, [2.5, 4.0, 30.0]);
        assert_eq!(found.rows[0].errors, Some([0.02, 0.01]));
        assert_eq!(found.rows[1].errors, None);
    }

    /// A row in the middle of the file that is not drawn is also checked, and the digest is that of the complete
    /// file.
    #[test]
    fn long_files_are_drawn_from_and_checked() {
        let row = |k: u32| format!("{},2,3,1,0.1,0.2\n", 1 + k);
        let text: String = HEADER.into();
        let text = (0..1000).fold(text, |text, k| text + &row(k));
        let drawn = |text: &str| Detections::drawn(text.as_bytes(), "d.csv", 100, 1);
        let found = drawn(&text).unwrap();
        assert_eq!((found.rows.len(), found.drawn_of), (100, Some(1000)));
        let complete = read(&text).unwrap();
        assert_eq!((found.sha256, complete.drawn_of), (complete.sha256, None));
        let kept = |k: u32| found.rows.iter().any(|row| row.at[0] == f64::from(1 + k));
        let dropped = (500..1000).find(|k| !kept(*k)).unwrap();
        let error = drawn(&text.replace(&row(dropped), "nan,2,3,1,0.1,0.2\n")).unwrap_err();
        let place = format!("d.csv:{}:1: `nan`", dropped + 2);
        assert!(error.to_string().starts_with(&place), "{error}");
        // All dependent rows are kept: a run is not thinned.
        let runs = text
            .replace("rad\n", "rad,run\n")
            .replace("0.2\n", "0.2,a\n");
        let found = drawn(&runs).unwrap();
        assert_eq!((found.rows.len(), found.drawn_of), (1000, None));
    }

    /// Spaces around fields and a byte order mark are ignored.
    #[test]
    fn fields_are_trimmed() {
        let header = HEADER.replace(',', " , ");
        let found = read(&format!(
            "\u{feff} {header} 2.5 ,4, 30,1 , 0.02,-0.01 \n31,0,3, 0 , ,\n"
        ));
        let found = found.unwrap();
        assert_eq!(found.rows[0].at, [2.5, 4.0, 30.0]);
        assert_eq!(found.rows[1].errors, None);
    }

    /// Both errors are those of the better pose.
    #[test]
    fn errors_are_those_of_the_better_pose() {
        let header = HEADER.replace("rad\n", "rad,second_err_translation_m,second_err_yaw_rad\n");
        let found = read(&format!(
            "{header}1,2,3,1,0.1,0.2,0.3,-0.1\n1,2,3,1,0.1,0.2,0.05,0.4\n1,2,3,1,0.1,0.2,,\n1,2,3,0,,,,\n"
        ))
        .unwrap();
        let errors: Vec<_> = found.rows.iter().map(|row| row.errors).collect();
        let first = Some([0.1, 0.2]);
        assert_eq!(errors, [Some([0.3, 0.1]), first, first, None]);
        assert!(found.of_better_pose);
        assert!(
            !read(&format!("{HEADER}1,2,3,1,0.1,0.2\n"))
                .unwrap()
                .of_better_pose
        );
        for (row, place) in [
            ("1,2,3,1,0.1,0.2,0.3,\n", "d.csv:2:8: ``"),
            ("1,2,3,1,0.1,0.2,,0.1\n", "d.csv:2:7: ``"),
            ("1,2,3,1,0.1,0.2,nan,0.1\n", "d.csv:2:7: `nan`"),
            ("1,2,3,0,,,0.1,\n", "d.csv:2:7: `0.1`"),
        ] {
            let error = read(&format!("{header}{row}")).unwrap_err();
            assert!(error.starts_with(place), "{row}: {error}");
        }
        let half = header.replace(",second_err_yaw_rad", "");
        let error = read(&half).unwrap_err();
        assert!(
            error.starts_with("d.csv:1:1: there is no column `second_err_yaw_rad`"),
            "{error}"
        );
        let half = header.replace(",second_err_translation_m", "");
        let error = read(&half).unwrap_err();
        assert!(
            error.starts_with("d.csv:1:1: there is no column `second_err_translation_m`"),
            "{error}"
        );
    }

    #[test]
    fn errors_state_file_line_and_column() {
        let good = "1,2,3,1,0.1,0.2\n";
        for (row, place) in [
            ("nan,2,3,1,0.1,0.2\n", "d.csv:3:1: `nan` in `d_m`"),
            ("-1,2,3,1,0.1,0.2\n", "d.csv:3:1: `-1`"),
            ("1,2,190,1,0.1,0.2\n", "d.csv:3:3: `190` in `psi_deg`"),
            ("1,2,3,2,0.1,0.2\n", "d.csv:3:4: `2` in `detected`"),
            ("1,2,3,yes,0.1,0.2\n", "d.csv:3:4: `yes`"),
            ("1,2,3,1,,0.2\n", "d.csv:3:5: `` in `err_translation_m`"),
            ("1,2,3,1,-0.1,0.2\n", "d.csv:3:5: `-0.1`"),
            ("1,2,3,1,0.1,inf\n", "d.csv:3:6: `inf` in `err_yaw_rad`"),
            ("1,2,3,0,0.1,\n", "d.csv:3:5: `0.1`"),
            ("1,2,3,0,,0.2\n", "d.csv:3:6: `0.2`"),
            ("1,2,3,1,0.1\n", "d.csv:3:6: 5 fields"),
        ] {
            let error = read(&format!("{HEADER}{good}{row}")).unwrap_err();
            assert!(error.starts_with(place), "{row}: {error}");
        }
        let error = read("d_m,phi_deg\n1,2\n").unwrap_err();
        assert!(
            error.starts_with("d.csv:1:1: there is no column `psi_deg`"),
            "{error}"
        );
        let error = read(&HEADER.replace("phi_deg", "d_m")).unwrap_err();
        assert!(error.starts_with("d.csv:1:2: "), "{error}");
        assert!(read(HEADER).unwrap_err().contains("no row"));
    }
}
