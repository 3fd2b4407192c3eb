//! Trajectories in the formats of public data: TUM, EuRoC and KITTI.
//!
//! ```
//! use posegate_replay::trajectories::read;
//!
//! // EuRoC: nanoseconds, and the quaternion with w first. A time that is there twice is used once.
//! let text = b"#timestamp, p_x\n1500000000,1,2,0,1,0,0,0\n1500000000,1,2,0,1,0,0,0\n";
//! let found = read(text, "data.csv", None)?;
//! assert_eq!((found.poses[0].t_s, found.poses[0].level(), found.duplicates), (1.5, [1.0, 2.0, 0.0], 1));
//! # Ok::<(), posegate_replay::tum::TumError>(())
//! ```

use super::recording::{Exact, Format, format_of};
use super::tum::{NANOSECONDS, Stamped, TumError, fault, fields, numbers};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// The largest difference of a quaternion's length from 1, and of a rotation's entries: files are rounded to a few decimals.
const ROUNDED: f64 = 1e-3;

/// A trajectory, in order of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Poses {
    /// The poses; each is later than the one before.
    pub poses: Vec<Stamped>,
    /// The number of poses that were left out because the one before has the same time.
    pub duplicates: u64,
}

/// A text with its name for errors.
pub type Named<'a> = (&'a [u8], &'a str);

/// A pose as written: the time (s), the position (m) and the quaternion w, x, y, z, with the characters at which the time and the
/// orientation begin.
struct Line {
    t_s: f64,
    position: [f64; 3],
    wxyz: [f64; 4],
    places: [usize; 2],
}

/// Reads a trajectory; `file` names it in errors. `times` is the file with the times of a KITTI trajectory, one in each line. Comments may
/// have any encoding.
///
/// # Errors
/// A line with another number of fields than the format has, a field that is not a finite number, an orientation that is no rotation
/// (within 1e-3), a time before the previous one, no pose at all, or a KITTI trajectory without as many times.
pub fn read(text: &[u8], file: &str, times: Option<Named<'_>>) -> Result<Poses, TumError> {
    let format = format_of(text);
    let mut times = match (format, times) {
        (Format::Kitti, Some((text, file))) => Some((seconds(text, file)?.into_iter(), file)),
        (Format::Kitti, None) => {
            return Err(fault(
                file,
                1,
                1,
                "a trajectory of KITTI, which has no times".into(),
                "a file with one time in each line: --times FILE",
            ));
        }
        _ => None,
    };
    let mut found = Poses {
        poses: Vec::new(),
        duplicates: 0,
    };
    let mut last = 0;
    let mut columns = EurocColumns {
        is_seconds: format == Format::Euroc && has_decimal_times(text),
        w_is_last: None,
    };
    for (index, line) in lines(text).enumerate() {
        last = index + 1;
        let line = match format {
            Format::Kitti => {
                let Some(mut pose) = kitti(&line, file, last)? else {
                    continue;
                };
                let next = times.as_mut().and_then(|(times, _)| times.next());
                pose.t_s = next.ok_or_else(|| {
                    fault(
                        file,
                        last,
                        1,
                        "no time is left for this pose".into(),
                        "as many times as poses",
                    )
                })?;
                pose
            }
            Format::Euroc => {
                // A header, with or without the sign of a comment.
                let is_first = found.poses.is_empty();
                if is_first && line.starts_with(|first: char| first == '#' || first.is_alphabetic())
                {
                    columns.read_header(&line, file, last)?;
                    continue;
                }
                match euroc(&line, file, last, &columns)? {
                    Some(pose) => pose,
                    None => continue,
                }
            }
            _ => match tum(&line, file, last)? {
                Some(pose) => pose,
                None => continue,
            },
        };
        found.push(&line, file, last)?;
    }
    if found.poses.is_empty() {
        return Err(fault(
            file,
            last.max(1),
            1,
            "no pose".into(),
            "lines of timestamp tx ty tz qx qy qz qw",
        ));
    }
    if let Some((mut times, of)) = times
        && times.next().is_some()
    {
        let message = format!("more times than {file} has poses");
        return Err(fault(of, 1, 1, message, "as many times as poses"));
    }
    Ok(found)
}

impl Poses {
    /// Adds the pose of a line, unless the pose before has the same time.
    fn push(&mut self, line: &Line, file: &str, number: usize) -> Result<(), TumError> {
        let Line {
            t_s,
            position,
            wxyz: [w, x, y, z],
            places: [of_time, of_turn],
        } = *line;
        if let Some(before) = self.poses.last().map(|pose| pose.t_s)
            && !(t_s > before)
        {
            if t_s == before {
                self.duplicates += 1;
                return Ok(());
            }
            let message = format!("the time {t_s} is before the {before} of the pose before");
            let expected = "times that increase: sort the file";
            return Err(fault(file, number, of_time, message, expected));
        }
        let quaternion = Quaternion::new(w, x, y, z);
        let length = quaternion.norm();
        if !((length - 1.0).abs() <= ROUNDED) {
            let message = format!("the quaternion's length is {length}");
            let expected = "1, in the order qx qy qz qw (EuRoC: qw qx qy qz)";
            return Err(fault(file, number, of_turn, message, expected));
        }
        self.poses.push(Stamped {
            t_s,
            position: Vector3::from(position),
            rotation: UnitQuaternion::from_quaternion(quaternion),
        });
        Ok(())
    }
}

/// Returns the lines; bytes that are not UTF-8 are replaced.
fn lines(text: &[u8]) -> impl Iterator<Item = std::borrow::Cow<'_, str>> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let ended = text.split_inclusive(|byte| *byte == b'\n');
    ended.map(|line| String::from_utf8_lossy(line.trim_ascii_end()))
}

fn finite(
    numbers: &[f64],
    fields: &[(usize, &str)],
    file: &str,
    number: usize,
) -> Result<(), TumError> {
    let bad = numbers
        .iter()
        .zip(fields)
        .find(|(value, _)| !value.is_finite());
    match bad {
        None => Ok(()),
        Some((_, (place, field))) => {
            let message = format!("`{field}`");
            Err(fault(
                file,
                number,
                *place,
                message,
                "a finite decimal number",
            ))
        }
    }
}

fn tum(line: &str, file: &str, number: usize) -> Result<Option<Line>, TumError> {
    let Some((all, places)) = numbers(line, file, number)? else {
        return Ok(None);
    };
    finite(&all, &fields(line), file, number)?;
    let [t_s, x, y, z, qx, qy, qz, qw] = all;
    Ok(Some(Line {
        t_s,
        position: [x, y, z],
        wxyz: [qw, qx, qy, qz],
        places: [places[0], places[4]],
    }))
}

/// What a EuRoC trajectory says of its columns.
struct EurocColumns {
    /// Times are seconds, not nanoseconds.
    is_seconds: bool,
    /// The order of the quaternion's parts, if a header names it.
    w_is_last: Option<bool>,
}

impl EurocColumns {
    fn read_header(&mut self, line: &str, file: &str, number: usize) -> Result<(), TumError> {
        let order = |parts| names_quaternion(line, parts);
        if order("xyzw") || order("wxyz") {
            self.w_is_last = Some(order("xyzw"));
        }
        let time = line.split(',').next().unwrap_or_default();
        let unit = time
            .split_once(['[', '('])
            .and_then(|(_, rest)| rest.split([']', ')']).next());
        match unit.map(str::trim) {
            _ if !line.contains(',') => {}
            Some("s" | "sec" | "seconds") => self.is_seconds = true,
            Some("us" | "usec" | "ms" | "msec") => {
                let message = format!("`{}`", time.trim());
                let expected = "times in nanoseconds or in seconds: [ns] or [s]";
                return Err(fault(file, number, 1, message, expected));
            }
            _ => {}
        }
        Ok(())
    }
}

/// Returns `true` if the first number of a line has a decimal point.
fn has_decimal_times(text: &[u8]) -> bool {
    lines(text).any(|line| {
        let time = line.split(',').next().unwrap_or_default();
        time.contains('.') && time.trim().parse::<f64>().is_ok()
    })
}

/// Returns `true` if a header names the quaternion's parts in this order. OKVIS has w last.
pub(super) fn names_quaternion(header: &str, order: &str) -> bool {
    let part = |name: &str| {
        let name = name.split('[').next().unwrap_or_default();
        name.trim()
            .chars()
            .last()
            .map(|last| last.to_ascii_lowercase())
    };
    let parts = header.split(',').skip(4).take(4).map(part);
    parts.eq(order.chars().map(Some))
}

/// Reads a line of EuRoC's ground truth: the time, the position, the quaternion with w first unless the header says otherwise; velocities
/// and biases may follow.
fn euroc(
    line: &str,
    file: &str,
    number: usize,
    columns: &EurocColumns,
) -> Result<Option<Line>, TumError> {
    let spaced = line.replace(',', " ");
    let all = fields(&spaced);
    if all.is_empty() {
        return Ok(None);
    }
    let expected = "timestamp [ns], x, y, z, qw, qx, qy, qz";
    let [time, rest @ ..] = all.as_slice() else {
        return Ok(None);
    };
    let Some(of_pose) = rest.get(..7) else {
        let message = format!("{} numbers", all.len());
        return Err(fault(
            file,
            number,
            line.chars().count() + 1,
            message,
            expected,
        ));
    };
    let wrong =
        |place: usize, field: &str| fault(file, number, place, format!("`{field}`"), expected);
    let t_s = match time.1.parse() {
        Ok(stamp) if !columns.is_seconds => Exact::seconds(stamp),
        _ if columns.is_seconds => seconds_of(time.1).ok_or_else(|| wrong(time.0, time.1))?,
        _ => return Err(wrong(time.0, time.1)),
    };
    let mut values = [0.0; 7];
    for (to, (place, field)) in values.iter_mut().zip(of_pose) {
        *to = field.parse().map_err(|_| wrong(*place, field))?;
    }
    finite(&values, of_pose, file, number)?;
    let [x, y, z, turn @ ..] = values;
    let [qx, qy, qz, qw] = turn;
    let w_is_last = match columns.w_is_last {
        Some(is_last) => is_last,
        // EuRoC's own files have nanoseconds, or velocities after the quaternion.
        None if columns.is_seconds && all.len() == 8 => {
            let message = "seconds, commas, and no header that names the quaternion's parts".into();
            let expected = "a first line with the order in the file: `#timestamp [s],x,y,z,qw,qx,qy,qz` or `#timestamp [s],x,y,z,qx,qy,qz,qw`";
            return Err(fault(file, number, 1, message, expected));
        }
        None => false,
    };
    let wxyz = if w_is_last { [qw, qx, qy, qz] } else { turn };
    Ok(Some(Line {
        t_s,
        position: [x, y, z],
        wxyz,
        places: [time.0, of_pose.get(3).map_or(1, |(place, _)| *place)],
    }))
}

/// Returns a decimal time in seconds; programs also write nanoseconds with a decimal point.
fn seconds_of(field: &str) -> Option<f64> {
    let time: f64 = field.parse().ok()?;
    let seconds = if time >= NANOSECONDS {
        time / 1e9
    } else {
        time
    };
    seconds.is_finite().then_some(seconds)
}

/// Reads a line of KITTI: the first three rows of a transform.
fn kitti(line: &str, file: &str, number: usize) -> Result<Option<Line>, TumError> {
    let all = fields(line);
    if all.is_empty() {
        return Ok(None);
    }
    let expected = "12 numbers: three rows of a rotation and a position";
    let mut values = Vec::new();
    for (place, field) in &all {
        let value = field.parse();
        values
            .push(value.map_err(|_| fault(file, number, *place, format!("`{field}`"), expected))?);
    }
    finite(&values, &all, file, number)?;
    let Ok([a, b, c, x, d, e, f, y, g, h, i, z]) = <[f64; 12]>::try_from(values) else {
        let message = format!("{} numbers", all.len());
        return Err(fault(file, number, 1, message, expected));
    };
    let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
    let off = (matrix * matrix.transpose() - Matrix3::identity())
        .abs()
        .max();
    if !(off <= ROUNDED && matrix.determinant() > 0.0) {
        let message = format!("its rows are no rotation: off by {off:.4}");
        return Err(fault(file, number, 1, message, "rows of a rotation matrix"));
    }
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    let wxyz = [turn.w, turn.i, turn.j, turn.k];
    Ok(Some(Line {
        t_s: 0.0,
        position: [x, y, z],
        wxyz,
        places: [1, 1],
    }))
}

/// Reads the times of a KITTI trajectory, seconds, one in each line.
fn seconds(text: &[u8], file: &str) -> Result<Vec<f64>, TumError> {
    let mut all = Vec::new();
    for (index, line) in lines(text).enumerate() {
        let fields = fields(&line);
        let [(place, field)] = fields.as_slice() else {
            if fields.is_empty() {
                continue;
            }
            let message = format!("{} numbers", fields.len());
            return Err(fault(file, index + 1, 1, message, "one time, in seconds"));
        };
        let time = seconds_of(field);
        let message = || {
            fault(
                file,
                index + 1,
                *place,
                format!("`{field}`"),
                "one time, in seconds",
            )
        };
        all.push(time.ok_or_else(message)?);
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_give_the_same_poses() {
        let tum = "0.5 1 2 0 0 0 0.6 0.8\n1.5 3 4 0 0 0 0 1\n";
        let euroc = "#t,x\n500000000,1,2,0,0.8,0,0,0.6,0,0,0\n1500000000,3,4,0,1,0,0,0\n";
        let kitti = "0.28 -0.96 0 1 0.96 0.28 0 2 0 0 1 0\n1 0 0 3 0 1 0 4 0 0 1 0\n";
        let expected = read(tum.as_bytes(), "t", None).unwrap();
        let times: Named<'_> = (b"0.5\n1.5\n", "times");
        for (text, times) in [(euroc, None), (kitti, Some(times))] {
            let found = read(text.as_bytes(), "t", times).unwrap();
            for (a, b) in found.poses.iter().zip(&expected.poses) {
                assert_eq!(a.t_s, b.t_s);
                let apart = a.level().into_iter().zip(b.level());
                assert!(apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-12);
            }
            assert_eq!(found.poses.len(), 2);
        }
    }

    /// OKVIS writes EuRoC's columns with w last, and says so in its header.
    #[test]
    fn header_gives_the_order_of_the_quaternion() {
        let row = "1500000000, 1, 2, 0, 0, 0, 0.6, 0.8, 0, 0\n";
        for header in [
            "timestamp, p_WS_W_x, p_WS_W_y, p_WS_W_z, q_WS_x, q_WS_y, q_WS_z, q_WS_w, v_WS_W_x, v_WS_W_y\n",
            "\u{feff}#timestamp [ns],p_x [m],p_y [m],p_z [m],q_x [],q_y [],q_z [],q_w []\n",
        ] {
            let found = read(format!("{header}{row}").as_bytes(), "t", None).unwrap();
            let [x, y, yaw] = found.poses[0].level();
            assert_eq!((found.poses[0].t_s, x, y), (1.5, 1.0, 2.0));
            assert!((yaw - 2.0 * 0.6f64.asin()).abs() < 1e-12, "{yaw}");
        }
        let header = "timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n";
        let first = read(
            format!("{header}1500000000,1,2,0,0.8,0,0,0.6\n").as_bytes(),
            "t",
            None,
        );
        let [.., yaw] = first.unwrap().poses[0].level();
        assert!((yaw - 2.0 * 0.6f64.asin()).abs() < 1e-12, "{yaw}");
    }

    /// Exports of EuRoC's columns have decimal seconds; commas alone do not say which part of the quaternion is first.
    #[test]
    fn decimal_times_are_seconds() {
        let of = |text: &str| read(text.as_bytes(), "t", None).map(|found| found.poses);
        let expected = of(
            "#timestamp [ns],x,y,z,qw\n1500000000,1,2,0,0.8,0,0,0.6\n2000000000,1,2,0,1,0,0,0\n",
        )
        .unwrap();
        for text in [
            "#timestamp [s],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []\r\n1.5,1,2,0,0.8,0,0,0.6\r\n2,1,2,0,1,0,0,0\r\n",
            "\u{feff}time,tx,ty,tz,qx,qy,qz,qw\n1.5, 1, 2, 0, 0, 0, 0.6, 0.8\n2.0, 1, 2, 0, 0, 0, 0, 1\n",
            "1.50000000,1,2,0,0.8,0,0,0.6,0,0,0,0,0,0,0,0,0\n2.0,1,2,0,1,0,0,0,0,0,0,0,0,0,0,0,0\n",
        ] {
            assert_eq!(of(text).unwrap(), expected, "{text}");
        }
        let whole = of("#timestamp [s],x,y,z,qw,qx,qy,qz\n3,1,2,0,1,0,0,0\n").unwrap();
        assert_eq!(whole[0].t_s, 3.0);
        let pandas =
            of("timestamp,x,y,z,qw,qx,qy,qz\n1.4036365797635556e+18,1,2,0,1,0,0,0\n").unwrap();
        assert!((pandas[0].t_s - 1_403_636_579.763_555_6).abs() < 1e-6);
        for (text, words) in [
            ("1.5,1,2,0,0,0,0,1\n", "#timestamp [s],x,y,z,qw,qx,qy,qz"),
            (
                "#timestamp [us],x,y,z,qw,qx,qy,qz\n15,1,2,0,1,0,0,0\n",
                "nanoseconds or in seconds",
            ),
        ] {
            let error = of(text).unwrap_err().to_string();
            assert!(
                error.starts_with("t:1:1: ") && error.contains(words),
                "{error}"
            );
        }
    }

    #[test]
    fn faults_state_file_line_and_column() {
        let times: Named<'_> = (b"0\n0.1\n", "times");
        for (text, times, start) in [
            (
                "1 0 0 0 0 1 0 0 0 0 1 0\n",
                None,
                "t:1:1: a trajectory of KITTI",
            ),
            (
                "1 0 0 0 0 1 0 0 0 0 1 0\n",
                Some(times),
                "times:1:1: more times",
            ),
            (
                "2 0 0 0 0 1 0 0 0 0 1 0\n",
                Some(times),
                "t:1:1: its rows are no rotation",
            ),
            ("1 0 0 0 0 1 0 0 0 0 1 x\n", Some(times), "t:1:23: `x`"),
            (
                "1403636579763555584,0,0,0,1,0,0\n",
                None,
                "t:1:32: 7 numbers",
            ),
            (
                "1403636579763555584,0,0,0,1,0,0,nan\n",
                None,
                "t:1:33: `nan`",
            ),
            (
                "1403636579763555584,0,0,0,1,1,0,0\n",
                None,
                "t:1:27: the quaternion's length",
            ),
            (
                "5 0 0 0 0 0 0 1\n4 0 0 0 0 0 0 1\n",
                None,
                "t:2:1: the time 4 is before",
            ),
        ] {
            let error = read(text.as_bytes(), "t", times).unwrap_err().to_string();
            assert!(error.starts_with(start), "{error}");
        }
        let comment = b"# \xe9t\xe9\n5 0 0 0 0 0 0 1\n";
        assert_eq!(read(comment, "t", None).unwrap().poses.len(), 1);
    }
}
