//! True poses over time, with interpolation.

use super::tum::Stamped;
use std::collections::VecDeque;

/// The result of looking up the true pose at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TruthLookup {
    /// x, y (m), yaw (rad).
    Pose([f64; 3]),
    /// Not yet known: poses up to that time may still come.
    NotYet,
    /// No true pose is near enough.
    None,
}

/// True poses in order of time, of which the last `most` are kept.
#[derive(Clone, Debug)]
pub struct Trajectory {
    poses: VecDeque<(f64, [f64; 3])>,
    most: usize,
    gap_s: f64,
    complete: bool,
    left_out: u64,
    taken: u64,
    largest_gap_s: f64,
}

impl Trajectory {
    /// Returns an empty trajectory that keeps `most` poses. It does not interpolate between poses that are more
    /// than `gap_s` seconds apart.
    #[must_use]
    pub const fn new(most: usize, gap_s: f64) -> Self {
        Self {
            poses: VecDeque::new(),
            most,
            gap_s,
            complete: false,
            left_out: 0,
            taken: 0,
            largest_gap_s: 0.0,
        }
    }

    /// Returns a complete trajectory.
    #[must_use]
    pub fn of(poses: &[Stamped], gap_s: f64) -> Self {
        let mut track = Self::new(poses.len(), gap_s);
        for pose in poses {
            track.push(pose.t_s, pose.level());
        }
        track.complete();
        track
    }

    /// Adds a pose: x, y (m), yaw (rad). A pose that is not finite, or not later than the last, is left out and counted.
    pub fn push(&mut self, t_s: f64, pose: [f64; 3]) {
        let later = self.poses.back().is_none_or(|(last, _)| t_s > *last);
        if !(later && t_s.is_finite() && pose.iter().all(|value| value.is_finite())) {
            self.left_out += 1;
            return;
        }
        self.taken += 1;
        if let Some((last, _)) = self.poses.back() {
            self.largest_gap_s = self.largest_gap_s.max(t_s - last);
        }
        if self.poses.len() >= self.most {
            self.poses.pop_front();
        }
        self.poses.push_back((t_s, pose));
    }

    /// Marks the trajectory as complete: no more poses will come.
    pub const fn complete(&mut self) {
        self.complete = true;
    }

    /// Returns the number of poses that were added.
    #[must_use]
    pub const fn taken(&self) -> u64 {
        self.taken
    }

    /// Returns the longest time between two poses, seconds.
    #[must_use]
    pub const fn largest_gap_s(&self) -> f64 {
        self.largest_gap_s
    }

    /// Returns `true` if poses at that time may have been added and dropped since.
    #[must_use]
    pub fn has_forgotten(&self, t_s: f64) -> bool {
        let first = self.poses.front();
        self.taken > self.poses.len() as u64 && first.is_some_and(|(first, _)| t_s < *first)
    }

    /// Returns the number of poses that were left out.
    #[must_use]
    pub const fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Returns the pose at a time, interpolated between its neighbours. The heading follows the shorter arc.
    #[must_use]
    pub fn at(&self, t_s: f64) -> TruthLookup {
        if !t_s.is_finite() {
            return TruthLookup::None;
        }
        let after = self.poses.partition_point(|(time, _)| *time < t_s);
        let Some((later, next)) = self.poses.get(after) else {
            return if self.complete {
                TruthLookup::None
            } else {
                TruthLookup::NotYet
            };
        };
        if *later == t_s {
            return TruthLookup::Pose(*next);
        }
        let Some((earlier, pose)) = after.checked_sub(1).and_then(|k| self.poses.get(k)) else {
            return TruthLookup::None;
        };
        if !(later - earlier <= self.gap_s) {
            return TruthLookup::None;
        }
        let share = (t_s - earlier) / (later - earlier);
        let turn = next[2] - pose[2];
        let turn = libm::atan2(libm::sin(turn), libm::cos(turn));
        TruthLookup::Pose([
            pose[0] + share * (next[0] - pose[0]),
            pose[1] + share * (next[1] - pose[1]),
            pose[2] + share * turn,
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pose_between_two_poses_is_interpolated() {
        let mut track = Trajectory::new(3, 1.0);
        assert_eq!(track.at(0.0), TruthLookup::NotYet);
        track.push(1.0, [0.0, 2.0, 3.1]);
        track.push(2.0, [1.0, 4.0, -3.1]);
        let TruthLookup::Pose([x, y, yaw]) = track.at(1.5) else {
            panic!("a pose");
        };
        assert!((x, y) == (0.5, 3.0));
        // Across the half turn, not back through zero.
        assert!((yaw - core::f64::consts::PI).abs() < 1e-12, "{yaw}");
        assert_eq!(track.at(2.0), TruthLookup::Pose([1.0, 4.0, -3.1]));
        assert_eq!(track.at(0.5), TruthLookup::None);
        assert_eq!(track.at(2.5), TruthLookup::NotYet);
        track.push(4.0, [0.0; 3]);
        assert_eq!(track.at(3.0), TruthLookup::None, "a gap of 2 s");
        track.complete();
        assert_eq!(track.at(4.5), TruthLookup::None);
        assert_eq!(track.at(f64::NAN), TruthLookup::None);
    }

    #[test]
    fn poses_that_are_not_later_are_counted_as_left_out() {
        let mut track = Trajectory::new(2, 1.0);
        for (t_s, x) in [
            (1.0, 0.0),
            (1.0, 1.0),
            (0.5, 1.0),
            (1.5, f64::NAN),
            (f64::NAN, 0.0),
        ] {
            track.push(t_s, [x, 0.0, 0.0]);
        }
        assert_eq!(track.left_out(), 4);
        track.push(1.5, [1.0, 0.0, 0.0]);
        track.push(2.0, [2.0, 0.0, 0.0]);
        // The first pose was dropped.
        assert_eq!(track.at(1.2), TruthLookup::None);
    }
}
