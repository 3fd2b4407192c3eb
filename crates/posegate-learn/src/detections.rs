//! Views of tags and their outcomes: detected or not, with which error.

use super::LearnError;
use super::draw::{Digesting, Kept};
use super::runs::Runs;
use posegate_files::input::Limit;
use posegate_files::sheet::{Column, Line, Sheet, SheetError, each};
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
        let [d, phi, psi, detected, first @ ..] = each(NEEDED, |name| sheet.needed(name, &NEEDED))?;
        let second = match each(SECOND, |name| sheet.optional(name))? {
            [Some(translation), Some(yaw)] => Some([translation, yaw]),
            [None, None] => None,
            [first, _] => {
                // The other column is missing.
                let missing = SECOND[usize::from(first.is_some())];
                return Err(sheet.missing(missing, &SECOND).into());
            }
        };
        let run = sheet.optional("run")?;
        let time = sheet.optional("t_s")?;
        let dependent = run.is_some() || time.is_some();
        let (mut names, mut times) = (Vec::new(), Vec::new());
        let mut kept = Kept::new(if dependent { usize::MAX } else { most }, seed);
        while let Some(line) = sheet.line()? {
            if dependent && most != usize::MAX && line.byte() > Limit::FILE.bytes {
                let what = format!(
                    "more than {} MiB of rows with a `run` or a `t_s`; give fewer runs",
                    Limit::FILE.bytes >> 20
                );
                return Err(line.wrong_row(what).into());
            }
            let at = place(&line, [d, phi, psi])?;
            if let Some(run) = run {
                let name = line.name(run, "the name of a drive, a video or an approach")?;
                names.push(name.to_owned());
            }
            if let Some(time) = time {
                times.push(line.number(time, |_| true, "a time in seconds")?);
            }
            let errors = if line.flag(detected)? {
                let first = errors(&line, first)?;
                let is_given = |column: &Column| !line.text(*column).is_empty();
                match second.filter(|columns| columns.iter().any(is_given)) {
                    Some(columns) => {
                        let second = errors(&line, columns)?;
                        Some(if second[1] < first[1] { second } else { first })
                    }
                    None => Some(first),
                }
            } else {
                for column in first.iter().chain(second.iter().flatten()) {
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
fn errors(line: &Line<'_>, [translation, yaw]: [Column; 2]) -> Result<[f64; 2], SheetError> {
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
    let columns = each(PLACE, |name| sheet.needed(name, &PLACE))?;
    let mut rows = Vec::new();
    while let Some(line) = sheet.line()? {
        rows.push(place(&line, columns)?);
    }
    Ok(rows)
}

fn place(line: &Line<'_>, [d, phi, psi]: [Column; 3]) -> Result<[f64; 3], SheetError> {
    let angle = |angle: f64| (0.0..=180.0).contains(&angle);
    Ok([
        line.number(d, |d| d > 0.0, "a distance in metres, above 0")?,
        line.number(phi, angle, "an angle in degrees, 0 to 180")?,
        line.number(psi, angle, "an angle in degrees, 0 to 180")?,
    ])
}

#[cfg(test)]
mod tests;
