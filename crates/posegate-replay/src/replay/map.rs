//! A share of a replay's estimates for a map: few enough to draw, and from the whole recording.

use super::Row;
use posegate::gate::Verdict;
use posegate::set::Uncertainty;

/// The most estimates that are kept.
const MOST: usize = 512;

/// An estimate as a map shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapPose {
    /// The estimated pose in the world: x, y (m), yaw (rad).
    pub pose: [f64; 3],
    /// The uncertainty that the gate was given, a covariance with its inflation; `None` if the source reports none.
    pub spread: Option<Uncertainty>,
    /// The verdict on this estimate alone.
    pub verdict: Verdict,
}

/// Every n-th estimate: n is the smallest power of two with which at most 512 are kept.
#[derive(Clone, Debug, Default)]
pub struct Map {
    /// The number of halvings so far.
    halved: u32,
    poses: Vec<(u64, MapPose)>,
}

impl Map {
    /// Takes an estimate. One in another frame, or without finite numbers, has no place on the map.
    pub(super) fn note(&mut self, row: &Row, inflation: f64) {
        let is_kept = |index: u64, halved: u32| index.trailing_zeros() >= halved;
        let has_place = row.in_world && row.pose.iter().all(|number| number.is_finite());
        if !(has_place && is_kept(row.index, self.halved)) {
            return;
        }
        let spread = row.spread.map(|spread| match spread {
            Uncertainty::Gaussian(covariance) => {
                Uncertainty::Gaussian(covariance.map(|row| row.map(|entry| entry * inflation)))
            }
            bounded => bounded,
        });
        let shown = MapPose {
            pose: row.pose,
            spread,
            verdict: row.verdict,
        };
        self.poses.push((row.index, shown));
        if self.poses.len() > MOST {
            self.halved += 1;
            let halved = self.halved;
            self.poses.retain(|(index, _)| is_kept(*index, halved));
        }
    }

    /// Yields the estimates, in the order of the recording.
    pub fn poses(&self) -> impl Iterator<Item = &MapPose> {
        self.poses.iter().map(|(_, pose)| pose)
    }

    /// Returns of how many estimates one is kept.
    #[must_use]
    pub const fn every(&self) -> u64 {
        1 << self.halved
    }
}
