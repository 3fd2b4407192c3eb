//! Views of tags and their outcomes: detected or not, with which error.

use super::LearnError;
use super::draw::{Digesting, Kept};
use super::runs::Runs;
use super::sheet::Sheet;
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
const PLACE: [&str; 3] = ["d_m", "phi_deg", "psi_deg"];

/// One view of a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// d in metres, above 0; phi and psi in degrees, 0 to 180: computed from the truth.
    pub at: [f64; 3],
    /// The magnitudes of the errors of the position, metres, and of the yaw, radians; `None` if the tag was
    /// not detected.
    pub errors: Option<[f64; 2]>,
}

/// The rows of a file of detections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Detections {
    /// The rows in the file's order.
    pub rows: Vec<Detection>,
    /// Which rows depend on each other.
    pub runs: Runs,
    /// The times of the rows, seconds; empty if the file has none.
    pub times: Vec<f64>,
    /// SHA-256 of the file.
    pub sha256: [u8; 32],
    /// The number of rows in the file if only some of them were drawn.
    pub drawn_of: Option<u64>,
}

/// The most rows that [`Detections::draw`] keeps.
pub const DRAWN: usize = 200_000;

impl Detections {
    /// Reads `d_m, phi_deg, psi_deg, detected, err_translation_m, err_yaw_rad`; the errors are empty if
    /// `detected` is 0. Rows with the same text in the column `run` depend on each other. Without that column, rows that
    /// follow each other at video rate by `t_s` (seconds) are cut into runs at gaps ([`Runs::of_times`]).
    ///
    /// # Errors
    /// The first invalid field, with its line and column; a file without rows.
    pub fn read(bytes: &[u8], file: &str) -> Result<Self, LearnError> {
        Self::drawn(bytes, file, usize::MAX, 0)
    }

    /// Reads as [`Detections::read`], from a file of any length, which is read once. Of more than [`DRAWN`] rows without `run`
    /// and `t_s`, as many are drawn at random, by their positions in the file and the seed: memory does not grow with the file.
    /// The guarantees are those for the drawn rows. Every row of the file is checked. Rows with `run` or `t_s` are all kept, so
    /// such a file may have 256 MiB.
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
                let size = "the size of an error in metres, 0 or more";
                let translation = line.number(columns[4], |error| error >= 0.0, size)?;
                let yaw = line.number(
                    columns[5],
                    |error| libm::fabs(error) <= 7.0,
                    "an error in radians, at most a turn",
                )?;
                Some([translation, libm::fabs(yaw)])
            } else {
                for column in &columns[4..] {
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
        })
    }
}

/// Reads the places `d_m, phi_deg, psi_deg` for which a model is evaluated.
///
/// # Errors
/// The first invalid field, with its line and column.
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

fn place(
    line: &super::sheet::Line<'_>,
    columns: &[super::sheet::Column],
) -> Result<[f64; 3], LearnError> {
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

    /// A row in the file's middle that is not drawn is checked all the same, and the digest is that of the whole file.
    #[test]
    fn long_files_are_drawn_from_and_checked() {
        let row = |k: u32| format!("{},2,3,1,0.1,0.2\n", 1 + k);
        let text: String = HEADER.into();
        let text = (0..1000).fold(text, |text, k| text + &row(k));
        let drawn = |text: &str| Detections::drawn(text.as_bytes(), "d.csv", 100, 1);
        let found = drawn(&text).unwrap();
        assert_eq!((found.rows.len(), found.drawn_of), (100, Some(1000)));
        let whole = read(&text).unwrap();
        assert_eq!((found.sha256, whole.drawn_of), (whole.sha256, None));
        let kept = |k: u32| found.rows.iter().any(|row| row.at[0] == f64::from(1 + k));
        let dropped = (500..1000).find(|k| !kept(*k)).unwrap();
        let error = drawn(&text.replace(&row(dropped), "nan,2,3,1,0.1,0.2\n")).unwrap_err();
        let place = format!("d.csv:{}:1: `nan`", dropped + 2);
        assert!(error.to_string().starts_with(&place), "{error}");
        // Rows that depend on each other are all kept: a run is not thinned out.
        let runs = text
            .replace("rad\n", "rad,run\n")
            .replace("0.2\n", "0.2,a\n");
        let found = drawn(&runs).unwrap();
        assert_eq!((found.rows.len(), found.drawn_of), (1000, None));
    }

    /// Spaces around fields and a byte-order mark are not part of them.
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

    #[test]
    fn bad_rows_are_named_with_their_place() {
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
