//! The odometry of a replay: its poses become increments, which carry each fix as a controller would.

use crate::log::clock_ms;
use posegate::track::Increment;

/// A pose of the odometry's own frame: seconds; metres, metres, radians.
pub type OdometryPose = (f64, [f64; 3]);

/// The poses of an odometry in the order of their stamps, and how far they were read.
#[derive(Clone, Debug, Default)]
pub struct Odometry {
    poses: Vec<OdometryPose>,
    next: usize,
}

impl Odometry {
    /// Takes poses as they were recorded. Poses without a finite number are left out.
    #[must_use]
    pub fn new(poses: impl IntoIterator<Item = OdometryPose>) -> Self {
        let is_whole = |(t_s, pose): &OdometryPose| {
            clock_ms(*t_s).is_some() && pose.iter().all(|v| v.is_finite())
        };
        Self {
            poses: poses.into_iter().filter(is_whole).collect(),
            next: 0,
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

    /// Returns the next increment up to a time, with its stamp in seconds. `None` in place of the increment if it is no movement of a
    /// robot: metres between two poses.
    pub(super) fn next_until(&mut self, now_s: f64) -> Option<(f64, Option<Increment>)> {
        let (t_s, pose) = *self.poses.get(self.next).filter(|(t_s, _)| *t_s <= now_s)?;
        let before = self.next.checked_sub(1).and_then(|at| self.poses.get(at));
        let [x, y, yaw] = before.map_or(pose, |(_, before)| *before);
        self.next += 1;
        let (dx, dy) = (pose[0] - x, pose[1] - y);
        let (sin, cos) = (libm::sin(yaw), libm::cos(yaw));
        let turn = pose[2] - yaw;
        let turn = libm::atan2(libm::sin(turn), libm::cos(turn));
        let (ahead, left) = (cos * dx + sin * dy, cos * dy - sin * dx);
        let stamp_ms = clock_ms(t_s)?;
        Some((t_s, Increment::of(ahead, left, turn, stamp_ms)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn increments_are_in_the_robots_axes() {
        let quarter = core::f64::consts::FRAC_PI_2;
        let mut odometry = Odometry::new([
            (1.0, [5.0, 5.0, quarter]),
            (1.02, [5.0, 5.01, quarter + 0.1]),
            (1.04, [5.0, f64::NAN, 0.0]),
            (1.06, [9.9, 5.01, quarter]),
        ]);
        assert_eq!(odometry.len(), 3);
        let still = Increment::of(0.0, 0.0, 0.0, 1_000);
        assert_eq!(odometry.next_until(1.03), Some((1.0, still)));
        let ahead = Increment::of(0.01, 0.0, 0.1, 1_020);
        assert_eq!(odometry.next_until(1.03), Some((1.02, ahead)));
        assert_eq!(odometry.next_until(1.03), None);
        // A reset of almost five metres.
        assert_eq!(odometry.next_until(2.0), Some((1.06, None)));
        assert_eq!(odometry.next_until(2.0), None);
    }
}
