//! Trajectories in the TUM format: `timestamp tx ty tz qx qy qz qw`, `#` begins a comment. The time is in seconds; ORB-SLAM3 also writes
//! nanoseconds.
//!
//! ```
//! use posegate_replay::tum::trajectory;
//!
//! let poses = trajectory("# time, position, quaternion\n12.5 1 2 0 0 0 0 1\n", "truth.txt")?;
//! assert_eq!((poses[0].t_s, poses[0].level()), (12.5, [1.0, 2.0, 0.0]));
//!
//! let error = trajectory("12.5 1 2 0\n", "truth.txt").unwrap_err();
//! assert!(error.to_string().starts_with("truth.txt:1:"));
//! # Ok::<(), posegate_replay::tum::TumError>(())
//! ```

use nalgebra::{UnitQuaternion, Vector3};

/// A pose with its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamped {
    /// Time, seconds.
    pub t_s: f64,
    /// Position in the world, metres.
    pub position: Vector3<f64>,
    /// Rotation from the body to the world.
    pub rotation: UnitQuaternion<f64>,
}

impl Stamped {
    /// Returns the pose on the floor: x, y (m) and the yaw of `Rz(yaw) Ry(pitch) Rx(roll)` (rad).
    #[must_use]
    pub fn level(&self) -> [f64; 3] {
        let (_, _, yaw) = self.rotation.euler_angles();
        [self.position.x, self.position.y, yaw]
    }

    /// Returns the cosine of the angle between the body's z axis and the world's.
    #[must_use]
    pub fn upright(&self) -> f64 {
        (self.rotation * Vector3::z()).z
    }
}

/// A fault in a trajectory file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}:{line}:{column}: {message}; expected {expected}")]
pub struct TumError {
    /// The file's name.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Character in the line, from 1.
    pub column: usize,
    /// The fault.
    pub message: String,
    /// The expected text.
    pub expected: &'static str,
}

/// Reads a trajectory; `file` names it in errors. Numbers are separated by blanks or tabs. Of poses with the same time the first is used.
///
/// # Errors
/// A line with fewer or more than 8 numbers, a field that is not a finite number, a quaternion whose length is
/// not 1 (within 1e-3), a time before the previous one, or no pose at all.
pub fn trajectory(text: &str, file: &str) -> Result<Vec<Stamped>, TumError> {
    Ok(super::trajectories::read(text.as_bytes(), file, None)?.poses)
}

/// Times from here on are nanoseconds: those of 1973, or of the year 3 billion.
pub(super) const NANOSECONDS: f64 = 1e17;

/// Eight numbers, and the character at which each begins.
type Line = ([f64; 8], [usize; 8]);

/// Returns the numbers of a line and the character at which each begins; `None` for a line without numbers. They
/// may be NaN or infinite.
pub(super) fn numbers(line: &str, file: &str, number: usize) -> Result<Option<Line>, TumError> {
    let fields = fields(line);
    if fields.is_empty() {
        return Ok(None);
    }
    if let Some((column, field)) = fields.iter().find(|(_, field)| field.contains(',')) {
        let comma = field.chars().take_while(|letter| *letter != ',').count();
        let expected = "blanks between 8 numbers: timestamp tx ty tz qx qy qz qw; commas are EuRoC's: timestamp, x, y, z, qw, qx, qy, qz";
        return Err(fault(file, number, column + comma, "`,`".into(), expected));
    }
    if fields.len() != 8 {
        let column = fields
            .get(8)
            .map_or(line.chars().count() + 1, |(at, _)| *at);
        let message = format!("{} numbers", fields.len());
        let expected = "8: timestamp tx ty tz qx qy qz qw";
        return Err(fault(file, number, column, message, expected));
    }
    let mut numbers = [0.0; 8];
    let mut places = [0; 8];
    for ((to, place), (column, field)) in numbers.iter_mut().zip(&mut places).zip(&fields) {
        *place = *column;
        *to = field.parse().map_err(|_| {
            fault(
                file,
                number,
                *column,
                format!("`{field}`"),
                "a finite decimal number (a header begins with #)",
            )
        })?;
    }
    if numbers[0] >= NANOSECONDS {
        numbers[0] /= 1e9;
    }
    Ok(Some((numbers, places)))
}

pub(super) fn fault(
    file: &str,
    line: usize,
    column: usize,
    message: String,
    expected: &'static str,
) -> TumError {
    TumError {
        file: file.to_owned(),
        line,
        column,
        message,
        expected,
    }
}

/// Returns the fields before a comment, each with the character at which it begins.
pub(super) fn fields(line: &str) -> Vec<(usize, &str)> {
    let line = line.split('#').next().unwrap_or("");
    let mut fields = Vec::new();
    let mut start = None;
    let ends = line.char_indices().chain([(line.len(), ' ')]);
    for (column, (at, letter)) in ends.enumerate() {
        match (start, letter.is_whitespace()) {
            (None, false) => start = Some((column + 1, at)),
            (Some((column, from)), true) => {
                fields.push((column, line.get(from..at).unwrap_or("")));
                start = None;
            }
            _ => {}
        }
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_line_ends_are_ignored() {
        let text = "\u{feff}# a trajectory\r\n\r\n 1.5\t1 2 3 0 0 0.7071 0.7071 # here\r\n2.5 1 2 3 0 0 0 -1.0002";
        let poses = trajectory(text, "t.txt").unwrap();
        assert_eq!(poses.len(), 2);
        assert_eq!(poses[0].t_s, 1.5);
        let [x, y, yaw] = poses[0].level();
        assert!((x, y) == (1.0, 2.0) && (yaw - core::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((poses[1].rotation.norm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn large_times_are_nanoseconds() {
        let text = "1403636579763555584.000000 1 2 3 0 0 0 1\n";
        let found = trajectory(text, "t.txt").unwrap()[0].t_s;
        assert!((found - 1_403_636_579.763_555_6).abs() < 1e-6, "{found}");
    }

    #[test]
    fn errors_state_file_line_and_column() {
        let good = "1 0 0 0 0 0 0 1\n";
        for (text, start) in [
            ("", "t.txt:1:1: no pose"),
            ("# nothing\n", "t.txt:1:1: no pose"),
            ("2 0 0 0 0 0 0\n", "t.txt:2:14: 7 numbers"),
            ("2 0 0 0 0 0 0 1 9\n", "t.txt:2:17: 9 numbers"),
            ("2 0 zero 0 0 0 0 1\n", "t.txt:2:5: `zero`"),
            ("2 0  nan 0 0 0 0 1\n", "t.txt:2:6: `nan`"),
            ("2.5,0,0,0,0,0,0,1\n", "t.txt:2:4: `,`"),
            ("2.5 0,0,0,0,0,0,1\n", "t.txt:2:6: `,`"),
            ("0.5 0 0 0 0 0 0 1\n", "t.txt:2:1: the time 0.5 is before"),
            (
                "2 0 0 0 0 0 0 2\n",
                "t.txt:2:9: the quaternion's length is 2",
            ),
            (
                "2 0 0 0 0 0 0 0\n",
                "t.txt:2:9: the quaternion's length is 0",
            ),
        ] {
            let text = if start.contains("no pose") {
                text.to_owned()
            } else {
                format!("{good}{text}")
            };
            let error = trajectory(&text, "t.txt").unwrap_err().to_string();
            assert!(error.starts_with(start), "{error}");
        }
    }
}
