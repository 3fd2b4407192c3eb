//! How far an estimated trajectory is from a reference, as `evo` defines it: absolute pose errors (ATE), relative
//! pose errors (RPE), their statistics, and the Correct Rate. Beside them the share of poses in a success set.

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

/// Poses of a reference and of an estimate that belong together: as many of each, in the order of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Matched {
    /// What is taken for true.
    pub reference: Vec<Stamped>,
    /// What was estimated.
    pub estimate: Vec<Stamped>,
}
