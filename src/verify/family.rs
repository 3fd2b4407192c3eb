//! A family of localization tasks: how the set from which a tag is seen grows with the error that is allowed.

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
    /// What is proven inside of S_l(r): m^2 rad; 0 where no cell is.
    pub volume: f64,
}

/// The proven volume of S_l(r) on an order's grid for each allowed error, in the order given. The set's own
/// limit is replaced; `None` where the set has none.
///
/// # Errors
/// [`BuildError`] but for sets of which no cell is left.
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
                // Proven a moment ago.
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

/// Replaces the limits of every error in a set; whether there was one.
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
