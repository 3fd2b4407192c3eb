//! A share of a replay's estimates for a map: few enough to draw, and from the whole recording.

use super::Row;
use posegate::gate::Verdict;
use posegate::set::Uncertainty;

/// The most estimates that are kept.
const MOST: usize = 512;
/// What is farther away, metres, has no place on a map: no robot is there, and its axes would show nothing else.
const FARTHEST_M: f64 = 1e6;

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
    /// Takes an estimate, whose covariance is multiplied by `inflation`. One in another frame has no place on the map.
    pub(super) fn note(&mut self, row: &Row, inflation: f64) {
        if !row.in_world {
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
        self.keep(row.index, shown);
    }

    /// Keeps the estimate of a number, if it has a place on the map and its number is one of those that are shown.
    fn keep(&mut self, index: u64, shown: MapPose) {
        let is_shown = |index: u64, halved: u32| index.trailing_zeros() >= halved;
        // False for what is not a number.
        let has_place = shown.pose.iter().all(|number| number.abs() < FARTHEST_M);
        if !(has_place && is_shown(index, self.halved)) {
            return;
        }
        self.poses.push((index, shown));
        if self.poses.len() > MOST {
            self.halved += 1;
            let halved = self.halved;
            self.poses.retain(|(index, _)| is_shown(*index, halved));
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

#[cfg(test)]
mod tests {
    use super::*;
    use posegate::gate::Reason;

    fn at(x_m: f64) -> MapPose {
        MapPose {
            pose: [x_m, 0.0, 0.0],
            spread: None,
            verdict: Verdict::deny(Reason::NotContained),
        }
    }

    /// However long a recording is, its map has estimates from its begin to its end, at equal distances.
    #[test]
    fn a_map_has_a_share_of_the_whole_recording() {
        for (count, every) in [(512, 1), (513, 2), (100_000, 256)] {
            let mut map = Map::default();
            for index in 0..count {
                map.keep(index, at(index as f64));
            }
            assert_eq!(map.every(), every, "{count}");
            let places: Vec<u64> = map.poses().map(|pose| pose.pose[0] as u64).collect();
            let expected: Vec<u64> = (0..count).step_by(every as usize).collect();
            assert_eq!(places, expected, "{count}");
        }
    }

    #[test]
    fn what_has_no_place_is_not_on_the_map() {
        let mut map = Map::default();
        for x_m in [f64::NAN, f64::INFINITY, -1e6] {
            map.keep(0, at(x_m));
        }
        assert_eq!(map.poses().count(), 0);
    }
}
