//! Matches poses: by time, and for relative errors by distance.

use super::Matched;
use crate::tum::Stamped;

/// The reason why poses cannot be matched.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PairError {
    /// The largest difference of times is not finite, or below 0.
    #[error(
        "the largest difference of times is {0} s; expected a finite number that is not below 0"
    )]
    Difference(f64),
    /// No two times are close enough.
    #[error(
        "no pose of one has a pose of the other within {most} s: the reference is from {reference:?} s, the estimate from {estimate:?} s; expected the same clock"
    )]
    None {
        /// The largest difference, seconds.
        most: f64,
        /// First and last time.
        reference: [f64; 2],
        /// First and last time.
        estimate: [f64; 2],
    },
    /// One pair, of trajectories of which one has several poses.
    #[error("{0} pair of poses only; expected at least 2")]
    TooFew(usize),
}

/// Matches poses by time. Each pose of the shorter trajectory (of the estimate if both are equally long) gets
/// the other trajectory's pose that is nearest in time, if that is at most `most` seconds away. A pose of the
/// longer one may be used twice. Both must be in order of time.
///
/// # Errors
/// [`PairError`].
pub fn associated(
    reference: &[Stamped],
    estimate: &[Stamped],
    most: f64,
) -> Result<Matched, PairError> {
    if !(most >= 0.0 && most.is_finite()) {
        return Err(PairError::Difference(most));
    }
    let estimate_is_longer = estimate.len() > reference.len();
    let (short, long) = if estimate_is_longer {
        (reference, estimate)
    } else {
        (estimate, reference)
    };
    let (mut of_short, mut of_long) = (Vec::new(), Vec::new());
    for pose in short {
        let after = long.partition_point(|other| other.t_s < pose.t_s);
        let near = long.iter().take(after + 1).skip(after.saturating_sub(1));
        let difference = |other: &Stamped| (other.t_s - pose.t_s).abs();
        // The earlier pose wins a tie.
        let nearest = near.min_by(|a, b| difference(a).total_cmp(&difference(b)));
        if let Some(nearest) = nearest.filter(|nearest| difference(nearest) <= most) {
            of_short.push(*pose);
            of_long.push(*nearest);
        }
    }
    let (reference_matched, estimate_matched) = if estimate_is_longer {
        (of_short, of_long)
    } else {
        (of_long, of_short)
    };
    let span = |poses: &[Stamped]| {
        let at = |pose: Option<&Stamped>| pose.map_or(f64::NAN, |pose| pose.t_s);
        [at(poses.first()), at(poses.last())]
    };
    match estimate_matched.len() {
        0 => Err(PairError::None {
            most,
            reference: span(reference),
            estimate: span(estimate),
        }),
        // Both may have one pose each: then there are no relative errors.
        1 if long.len() > 1 => Err(PairError::TooFew(1)),
        _ => Ok(Matched {
            reference: reference_matched,
            estimate: estimate_matched,
        }),
    }
}

/// The pairs of poses for which relative errors are computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pairs {
    /// This many poses apart, one pair after the other: (0, n), (n, 2 n), ...
    Frames(usize),
    /// This many poses apart, from every pose: (0, n), (1, n + 1), ...
    AllFrames(usize),
    /// At least this many metres of the estimate's path apart, one pair after the other.
    Metres(f64),
}

impl Pairs {
    /// Returns the pairs of an estimate, by index.
    pub(super) fn of(&self, estimate: &[Stamped]) -> Vec<(usize, usize)> {
        let count = estimate.len();
        let chained = |ends: Vec<usize>| -> Vec<(usize, usize)> {
            ends.windows(2).map(|pair| (pair[0], pair[1])).collect()
        };
        match *self {
            Self::Frames(apart) => chained((0..count).step_by(apart.max(1)).collect()),
            Self::AllFrames(apart) => {
                let apart = apart.max(1);
                (apart..count).map(|last| (last - apart, last)).collect()
            }
            Self::Metres(apart) => {
                let mut ends = std::vec![0];
                let mut path = 0.0;
                for (index, pair) in estimate.windows(2).enumerate() {
                    path += (pair[1].position - pair[0].position).norm();
                    if path >= apart {
                        ends.push(index + 1);
                        path = 0.0;
                    }
                }
                chained(ends)
            }
        }
    }
}
