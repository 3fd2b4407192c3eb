//! The parts that this build contains.
//!
//! An omitted part takes no flash, and only makes the gate deny more: one method less can prove that a
//! pose-set is inside. Each part is a constant, so every build compiles and checks all code, and the compiler drops
//! unreachable code.

/// Cells decide if a table has cells (feature `cells`). Without it, a table with cells alone is refused.
pub(crate) const CELLS: bool = cfg!(feature = "cells");

/// Facets on points that turn with the robot are evaluated heading by heading (feature `headings`). Without it, such facets are
/// evaluated over one slab of headings, which denies nearly every set that turns by more than half a radian. Several pieces together are always
/// evaluated heading by heading, so `unions` brings this part along.
pub(crate) const HEADINGS: bool = cfg!(any(feature = "headings", feature = "unions"));

/// Several pieces of facets may contain a pose-set together (feature `unions`). Without it, one piece must contain it.
pub(crate) const UNIONS: bool = cfg!(feature = "unions");

/// Sight records are read (feature `sight`). Without it, no table has one.
pub(crate) const SIGHT: bool = cfg!(feature = "sight");
