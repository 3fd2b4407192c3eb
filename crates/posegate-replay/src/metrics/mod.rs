//! The difference of an estimated trajectory from a reference, as `evo` defines it: absolute pose errors (ATE),
//! relative pose errors (RPE), their statistics, and the Correct Rate. Also the share of poses in a success set.
//!
//! ```
//! use posegate_replay::metrics::{absolute, associated};
//! use posegate_replay::tum::trajectory;
//!
//! let reference = trajectory("0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n", "reference.txt")?;
//! let estimate = trajectory("0 0 0.03 0 0 0 0 1\n1 1 0.04 0 0 0 0 1\n", "estimate.txt")?;
//! // Poses at most 10 ms apart are pairs.
//! let pairs = associated(&reference, &estimate, 0.01)?;
//! let [(name, ate), ..] = absolute(&pairs).statistics().expect("two pairs");
//! assert_eq!((name, ate.count), ("translation", 2));
//! assert!((ate.mean - 0.035).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
