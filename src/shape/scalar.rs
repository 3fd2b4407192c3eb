//! One definition of each set, in any arithmetic.

/// A number that a success set can be written in: `f64` for membership, outward-rounded intervals
/// for proofs.
pub trait Scalar: Clone {}
