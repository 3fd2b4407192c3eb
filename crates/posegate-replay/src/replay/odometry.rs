//! The odometry of a replay: its poses become increments, which carry each fix as a controller would.

use crate::estimates::Rows;
use crate::{Columns, LogError, clock_ms};
use posegate::track::Increment;
use std::io::Read;

/// A pose of the odometry's own frame: seconds; metres, metres, radians.
pub type OdometryPose = (f64, [f64; 3]);

/// The reason why a CSV file is not an odometry.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OdometryError {
    /// The file is not a CSV of poses with times.
    #[error(transparent)]
    Rows(#[from] LogError),
    /// A number that is NaN or infinite.
    #[error(
        "{file}:{line}: `{column}` is {found}; expected a finite number: leave out rows without a pose"
    )]
    NotFinite {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// The number.
        found: f64,
    },
    /// A stamp that is not after that of the row before.
    #[error(
        "{file}:{line}: `t_s` is {found}, and {before} in the row before; expected times that increase: sort the rows by `t_s`, and keep one of equal times"
    )]
    NotLater {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u64,
        /// The stamp, seconds.
        found: f64,
        /// The stamp of the row before, seconds.
        before: f64,
    },
}

/// The extremes of an odometry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OdometryExtremes {
    /// The largest speed between two poses, m/s.
    pub speed_m_s: f64,
    /// The largest turn rate between two poses, rad/s.
    pub turn_rad_s: f64,
    /// The longest time between two poses, seconds.
    pub gap_s: f64,
}

/// Reads an odometry from a CSV with the columns `t_s, x_m, y_m, yaw_rad`; `file` names it in errors.
///
/// # Errors
/// The first [`OdometryError`].
pub fn odometry_csv(input: impl Read, file: &str) -> Result<Vec<OdometryPose>, OdometryError> {
    let rows = Rows::new(input, file, Columns::TimedPoses)?;
    rows.needs_time()?;
    let mut poses: Vec<OdometryPose> = Vec::new();
    for row in rows {
        let row = row?;
        let pose = [row.estimate.x_m, row.estimate.y_m, row.estimate.yaw_rad];
        let t_s = row.t_s.unwrap_or(f64::NAN);
        let named = ["t_s", "x_m", "y_m", "yaw_rad"].into_iter();
        let mut numbers = named.zip([t_s].into_iter().chain(pose));
        if let Some((column, found)) = numbers.find(|(_, value)| !value.is_finite()) {
            return Err(OdometryError::NotFinite {
                file: file.into(),
                line: row.line,
                column,
                found,
            });
        }
        if let Some((before, _)) = poses.last().filter(|(before, _)| t_s <= *before) {
            return Err(OdometryError::NotLater {
                file: file.into(),
                line: row.line,
                found: t_s,
                before: *before,
            });
        }
        poses.push((t_s, pose));
    }
    Ok(poses)
}

/// The poses of an odometry in the order of their stamps, and the reading position.
#[derive(Clone, Debug, Default)]
pub struct Odometry {
    poses: Vec<OdometryPose>,
    next: usize,
    /// The pose at which the newest increment ends.
    before: Option<OdometryPose>,
}

impl Odometry {
    /// Sorts recorded poses by their stamps. Poses with a number that is not finite are left out.
    #[must_use]
    pub fn new(poses: impl IntoIterator<Item = OdometryPose>) -> Self {
        let is_finite = |(t_s, pose): &OdometryPose| {
            clock_ms(*t_s).is_some() && pose.iter().all(|v| v.is_finite())
        };
        Self {
            poses: poses.into_iter().filter(is_finite).collect(),
            next: 0,
            before: None,
        }
    }

    /// Returns the number of poses.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.poses.len()
    }

    /// Returns `true` if there are no poses.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// Returns the largest speed and turn rate of the robot by these poses, m/s and rad/s, and the longest time
    /// between two of them, seconds. Poses whose stamps are equal or go back are left out.
    #[must_use]
    pub fn extremes(&self) -> OdometryExtremes {
        let mut most = OdometryExtremes::default();
        for ((before_s, [x, y, yaw]), (t_s, pose)) in
            self.poses.iter().zip(self.poses.iter().skip(1))
        {
            let passed = t_s - before_s;
            if !(passed > 0.0) {
                continue;
            }
            let turn = pose[2] - yaw;
            let turn = libm::atan2(libm::sin(turn), libm::cos(turn)).abs();
            let length = libm::hypot(pose[0] - x, pose[1] - y);
            most.speed_m_s = most.speed_m_s.max(length / passed);
            most.turn_rad_s = most.turn_rad_s.max(turn / passed);
            most.gap_s = most.gap_s.max(passed);
        }
        most
    }

    /// Returns the next increment up to a time, with its stamp in seconds. The increment is `None` if it is not a
    /// plausible movement, such as metres between two poses. Of several poses in one millisecond the first one is used: the next
    /// increment contains the movement of the others.
    pub(super) fn next_until(&mut self, now_s: f64) -> Option<(f64, Option<Increment>)> {
        let of_same_ms = |(t_s, _): &OdometryPose| {
            self.before.is_some_and(|(before_s, _)| {
                *t_s > before_s && clock_ms(*t_s) == clock_ms(before_s)
            })
        };
        let rest = self.poses.get(self.next..)?;
        self.next += rest.iter().take_while(|pose| of_same_ms(pose)).count();
        let (t_s, pose) = *self.poses.get(self.next).filter(|(t_s, _)| *t_s <= now_s)?;
        let before = self.before.replace((t_s, pose));
        let [x, y, yaw] = before.map_or(pose, |(_, before)| before);
        self.next += 1;
        let (dx, dy) = (pose[0] - x, pose[1] - y);
        let (sin, cos) = (libm::sin(yaw), libm::cos(yaw));
        let turn = pose[2] - yaw;
        let turn = libm::atan2(libm::sin(turn), libm::cos(turn));
        let (ahead, left) = (cos * dx + sin * dy, cos * dy - sin * dx);
        let begins_s = before.map_or(t_s, |(before_s, _)| before_s);
        let span_ms = [clock_ms(begins_s)?, clock_ms(t_s)?];
        Some((t_s, Increment::of(ahead, left, turn, span_ms)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn increments_are_in_robot_axes() {
        let quarter = core::f64::consts::FRAC_PI_2;
        let mut odometry = Odometry::new([
            (1.0, [5.0, 5.0, quarter]),
            (1.02, [5.0, 5.01, quarter + 0.1]),
            (1.04, [5.0, f64::NAN, 0.0]),
            (1.06, [9.9, 5.01, quarter]),
        ]);
        assert_eq!(odometry.len(), 3);
        let still = Increment::of(0.0, 0.0, 0.0, [1_000; 2]);
        assert_eq!(odometry.next_until(1.03), Some((1.0, still)));
        let ahead = Increment::of(0.01, 0.0, 0.1, [1_000, 1_020]);
        assert_eq!(odometry.next_until(1.03), Some((1.02, ahead)));
        assert_eq!(odometry.next_until(1.03), None);
        // A reset of almost five metres.
        assert_eq!(odometry.next_until(2.0), Some((1.06, None)));
        assert_eq!(odometry.next_until(2.0), None);
    }

    #[test]
    fn poses_of_one_millisecond_become_one_increment() {
        let poses = (0..=40).map(|k| {
            let t_s = 1.0 + f64::from(k) * 2.5e-4;
            (t_s, [f64::from(k) * 1e-5, 0.0, 0.0])
        });
        let mut odometry = Odometry::new(poses);
        let mut spans = Vec::new();
        while let Some((_, increment)) = odometry.next_until(2.0) {
            spans.push(increment.unwrap());
        }
        let expected: Vec<Increment> = (0..=10u32)
            .map(|ms| {
                let ahead = if ms == 0 { 0.0 } else { 4e-5 };
                let begins = (1_000 + ms).saturating_sub(u32::from(ms > 0));
                Increment::of(ahead, 0.0, 0.0, [begins, 1_000 + ms]).unwrap()
            })
            .collect();
        assert_eq!(spans, expected);
        // A pose of the same time, and an earlier one, remain: they break the path.
        let mut odometry = Odometry::new([(1.0, [0.0; 3]), (1.0, [0.0; 3]), (0.9, [0.0; 3])]);
        let ends = |next: Option<(f64, Option<Increment>)>| next.map(|(t_s, _)| t_s);
        assert_eq!(ends(odometry.next_until(2.0)), Some(1.0));
        assert_eq!(ends(odometry.next_until(2.0)), Some(1.0));
        assert_eq!(ends(odometry.next_until(2.0)), Some(0.9));
    }
}
