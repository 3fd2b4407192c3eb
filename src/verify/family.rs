//! A family of localization tasks: how the set from which a tag is seen grows with the allowed error.

use super::{BuildError, build};
use crate::bake::{BakeInput, Layout};
use crate::shape::{ErrorLimit, Shape, SuccessSet};
use crate::table::Table;

/// One task of a family.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// The allowed error, metres.
    pub translation: f64,
    /// The allowed error, degrees.
    pub yaw_deg: f64,
    /// Proven volume of S_l(r): m^2 rad; 0 if no cell is proven.
    pub volume: f64,
}

/// Returns the proven volume of S_l(r) on an order's grid for each allowed error, in the given order. The
/// set's own limit is replaced; `None` if the set has none.
///
/// # Errors
/// [`BuildError`] if a table cannot be built, except for sets without any cell.
pub fn family(
    order: &BakeInput<'_>,
    limits: &[(f64, f64)],
    progress: &(dyn Fn() + Sync),
) -> Result<Option<Vec<Member>>, BuildError> {
    let mut members = Vec::new();
    for (translation, yaw_deg) in limits {
        let mut shape = order.success.shape.clone();
        if !replace(&mut shape, *translation, *yaw_deg) {
            return Ok(None);
        }
        let success = SuccessSet {
            goal: order.success.goal,
            shape,
        };
        let mut order = BakeInput {
            success: &success,
            ..order.clone()
        };
        order.spec.layout = Layout::Grid;
        let volume = match build(&order, progress) {
            Ok((bytes, proof)) => {
                // These bytes were just proven, so they parse.
                Table::parse(&bytes).map_or(0.0, |table| {
                    let cells = table.cells();
                    let edge = f64::from(cells.step_um) * 1e-6;
                    let slab = cells.yaw_span as f64 / f64::from(cells.slabs) / 4_294_967_296.0;
                    proof.cells as f64 * edge * edge * slab * core::f64::consts::TAU
                })
            }
            Err(BuildError::Bake(crate::bake::BakeError::Empty { .. })) => 0.0,
            Err(error) => return Err(error),
        };
        members.push(Member {
            translation: *translation,
            yaw_deg: *yaw_deg,
            volume,
        });
    }
    Ok(Some(members))
}

/// Replaces every error limit in a set; returns `true` if there was one.
fn replace(shape: &mut Shape, translation: f64, yaw_deg: f64) -> bool {
    match shape {
        Shape::Bounded { limit, .. } => {
            *limit = ErrorLimit {
                translation,
                yaw_deg,
                ..*limit
            };
            true
        }
        Shape::Any(sets) | Shape::All(sets) => {
            // All of them, not only the first.
            let mut found = false;
            for set in sets {
                found |= replace(set, translation, yaw_deg);
            }
            found
        }
        _ => false,
    }
}
