//! Decides on many pose-sets against one table: [`decide_many`], on all cores, and [`Filter`], one set after the other.
//!
//! The decisions equal those of [`super::decide`], bit for bit. A filter in floats permits a set if the integer code is certain to permit
//! it. It leaves every other set to the integer code, so it adds no way to be permitted.
//!
//! ```
//! use posegate::contain::{Cause, Decision, many::decide_many};
//! use posegate::set::InputError;
//! use posegate::table::Table;
//!
//! // The dock's success set is 8 cm, 6 cm and 4 degrees about (0, 0, 0).
//! let table = Table::parse(include_bytes!("../../examples/tables/dock.posegate"))?;
//! let poses = [[0.0, 0.0, 0.0], [0.07, 0.0, 0.0], [f64::NAN, 0.0, 0.0]];
//! let covariance = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-5]];
//! let found = decide_many(&table, table.radius_squared(), &poses, &[covariance; 3]);
//! assert_eq!(found[0], Ok(Decision::Inside));
//! assert_eq!(found[1], Ok(Decision::Outside(Cause::NotContained)));
//! assert_eq!(found[2], Err(InputError::EstimateNotFinite));
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! # Why the answers are the same
//! The numbers of the filter have 53 bits, and its lengths are in micrometres. Its own roundings stay below 2^-20 um, and each
//! comparison below has a slack of at least 1 um.
//!
//! **Valid input** (`many/spread.rs`). The filter takes estimates within the limits of [`PoseSet::gaussian`], symmetric matrices,
//! standard deviations within stated limits, and a determinant that is at least 5e-6 of the product of the variances. The test
//! of the integer code accepts from 1.2e-6 on.
//!
//! **Inside** (`many/facets.rs`). The bound of one slab of `contain::slab` is evaluated for every facet of one piece, with every number
//! rounded against acceptance by more than in the integer code: the factor's excess by the table in `set::covariance`, the estimate by
//! [`super::facet_clearance_q14`] and one length unit, all else by 44 extent units. If it accepts a set, so does the integer code.

use rayon::prelude::*;
use std::vec::Vec;

use super::{Decision, decide};
use crate::set::{Estimate, InputError, PoseSet, RadiusSquared};
use crate::table::Table;

use self::facets::Layout;
use self::spread::Spread;

mod angle;
mod facets;
mod spread;
#[cfg(test)]
mod tests;

/// Smallest number of sets per task of a thread. This number or fewer need no threads.
const CHUNK: usize = 4096;

/// Decides on many Gaussian pose-sets, on all cores. Each answer is that of [`PoseSet::gaussian`] and [`decide`].
///
/// `poses` are x, y, yaw in metres and radians, `covariances` their matrices by rows. The number of answers is the length
/// of the shorter slice.
#[must_use]
pub fn decide_many(
    table: &Table<'_>,
    radius_squared: RadiusSquared,
    poses: &[[f64; 3]],
    covariances: &[[[f64; 3]; 3]],
) -> Vec<Result<Decision, InputError>> {
    let filter = Filter::new(table, radius_squared);
    let decide = |(pose, covariance): (&[f64; 3], _)| filter.decide(*pose, covariance);
    if poses.len() <= CHUNK {
        return poses.iter().zip(covariances).map(decide).collect();
    }
    let rows = poses.par_iter().zip(covariances);
    rows.with_min_len(CHUNK).map(decide).collect()
}

/// A table prepared for many decisions.
#[derive(Clone, Debug)]
pub struct Filter<'a> {
    table: Table<'a>,
    radius_squared: RadiusSquared,
    layout: Option<Layout>,
}

impl<'a> Filter<'a> {
    /// Prepares a table for Gaussian pose-sets of one radius.
    #[must_use]
    pub fn new(table: &Table<'a>, radius_squared: RadiusSquared) -> Self {
        Self {
            table: *table,
            radius_squared,
            layout: table.facets().map(Layout::new),
        }
    }

    /// Decides on one Gaussian pose-set, as [`PoseSet::gaussian`] and [`decide`] do.
    ///
    /// # Errors
    /// Those of [`PoseSet::gaussian`].
    #[inline]
    pub fn decide(
        &self,
        pose: [f64; 3],
        covariance: &[[f64; 3]; 3],
    ) -> Result<Decision, InputError> {
        if self.is_certain(pose, covariance) {
            return Ok(Decision::Inside);
        }
        self.decide_by_integers(pose, covariance)
    }

    /// Returns `true` if the filter is certain that the integer code permits the set. [`Filter::decide`] uses the integer code in all other
    /// cases.
    #[inline]
    #[must_use]
    pub fn is_certain(&self, pose: [f64; 3], covariance: &[[f64; 3]; 3]) -> bool {
        let goal = self.table.goal().pose;
        self.layout.as_ref().is_some_and(|layout| {
            Spread::new(pose, covariance, self.radius_squared, goal)
                .is_some_and(|spread| layout.contains(&spread))
        })
    }

    #[inline(never)]
    fn decide_by_integers(
        &self,
        [x_m, y_m, yaw_rad]: [f64; 3],
        covariance: &[[f64; 3]; 3],
    ) -> Result<Decision, InputError> {
        let estimate = Estimate { x_m, y_m, yaw_rad };
        let set = PoseSet::gaussian(estimate, *covariance, self.radius_squared)?;
        Ok(decide(&self.table, &set))
    }
}
