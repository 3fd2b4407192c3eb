//! The difference of an estimated trajectory from a reference, as `evo` defines it: absolute pose errors (ATE),
//! relative pose errors (RPE), their statistics, and the Correct Rate. Also the share of poses in a success set.

pub use self::align::{Align, AlignError, aligned};
pub use self::errors::{Errors, absolute, relative};
pub use self::pairs::{PairError, Pairs, associated};
pub use self::rates::{InSet, correct_rate, in_set};
pub use self::statistics::Statistics;

mod align;
mod errors;
mod pairs;
mod rates;
mod statistics;
#[cfg(test)]
mod tests;

use super::tum::Stamped;

/// Matched poses of a reference and an estimate: the same number of each, in order of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Matched {
    /// The poses that count as true.
    pub reference: Vec<Stamped>,
    /// The estimated poses.
    pub estimate: Vec<Stamped>,
}
