//! Detections on one side of the split, and how few of them may give a bound.

/// The smallest error that is used, metres and radians; smaller ones are replaced by it.
pub(super) const LEAST_ERROR: f64 = 1e-7;
/// The fewest rows of a cell with a bound.
pub(super) const FEWEST: f64 = 10.0;
/// The fewest runs in a region with a bound.
pub(super) const FEWEST_RUNS: f64 = 10.0;

/// A detection on one side of the split.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) at: [f64; 3],
    pub(super) errors: [f64; 2],
    pub(super) run: u32,
}
