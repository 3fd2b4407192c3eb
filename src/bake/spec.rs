//! The extent, resolution and layouts of a table.

use super::{BakeError, LARGEST_TABLE};
use crate::num::BinaryAngle;
use crate::shape::{is_arc, is_whole_circle};
use crate::table::{Cells, LARGEST_REACH_UM};

/// The part of the goal frame that a table covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// `[lo, hi]`, metres, goal frame.
    pub x: [f64; 2],
    /// `[lo, hi]`, metres, goal frame.
    pub y: [f64; 2],
    /// `[lo, hi]`, degrees: an arc, `lo < hi <= lo + 360`.
    pub yaw_deg: [f64; 2],
}

/// The edges of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Along x and y, metres.
    pub xy: f64,
    /// In yaw, degrees.
    pub yaw_deg: f64,
}

/// The layout of a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Facets, in several pieces if the set is not convex.
    #[default]
    Facets,
    /// A grid of cells.
    Grid,
}

/// Largest number of rows of a table: bit 15 of the count is a flag.
const MOST_ROWS: f64 = 32_767.0;

/// The extent of a table, its resolution, and its layouts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableSpec {
    /// The covered part of the goal frame.
    pub extent: Extent,
    /// The size of a cell.
    pub step: Step,
    /// The layouts.
    pub layout: Layout,
}

impl TableSpec {
    /// Returns the cells of a table: the extent in micrometres and binary angles.
    ///
    /// The cell's edge is the nearest whole number of micrometres. Cells start at the extent's lower corner
    /// (rounded into the extent) and continue until they cover it. The yaw range (rounded into the extent) is
    /// cut into equal slabs no wider than the step.
    ///
    /// # Errors
    /// [`BakeError::TooLarge`] or [`BakeError::TooFar`] with the numbers, or [`BakeError::BadExtent`] if the extent is
    /// empty or a step is not above zero.
    pub fn cells(&self) -> Result<Cells, BakeError> {
        let Extent { x, y, yaw_deg } = self.extent;
        let step_um = libm::round(self.step.xy * 1e6).max(1.0);
        let ordered = |[lo, hi]: [f64; 2]| lo < hi && lo.is_finite() && hi.is_finite();
        let usable = ordered(x)
            && ordered(y)
            && ordered(yaw_deg)
            && is_arc(yaw_deg)
            && self.step.xy > 0.0
            && self.step.yaw_deg > 0.0;
        if !usable {
            return Err(BakeError::BadExtent);
        }
        let reach = f64::from(LARGEST_REACH_UM);
        let along = |[lo, hi]: [f64; 2], what, most| -> Result<(i32, u16), BakeError> {
            let low = inwards_up(lo * 1e6);
            let count = libm::ceil((hi * 1e6 - low) / step_um - 1e-6).max(1.0);
            if low < -reach || low + count * step_um > reach {
                return Err(BakeError::TooFar {
                    what,
                    metres: low.abs().max((low + count * step_um).abs()) * 1e-6,
                    limit: reach * 1e-6,
                });
            }
            Ok((low as i32, counted(count, what, most)?))
        };
        let (x_lo_um, columns) = along(x, "cells along x", f64::from(u16::MAX))?;
        let (y_lo_um, rows) = along(y, "rows along y", MOST_ROWS)?;
        let turn = 4_294_967_296.0;
        let units = |deg: f64| deg / 360.0 * turn;
        let whole = is_whole_circle(yaw_deg);
        let low = inwards_up(units(yaw_deg[0]));
        let high = if whole {
            low + turn
        } else {
            -inwards_up(-units(yaw_deg[1]))
        };
        let width_deg = yaw_deg[1] - yaw_deg[0];
        let slabs = libm::ceil(width_deg / self.step.yaw_deg - 1e-9).max(1.0);
        let slabs = counted(slabs, "slabs in yaw", f64::from(u16::MAX))?;
        // At least one run per row, two or four bytes each.
        let least = f64::from(rows) * f64::from(slabs) * if columns > 255 { 4.0 } else { 2.0 };
        if least > LARGEST_TABLE as f64 {
            let limit = LARGEST_TABLE as f64;
            return Err(BakeError::too_large("bytes", least, limit));
        }
        let span = high - low;
        if !(span >= f64::from(slabs)) {
            return Err(BakeError::BadExtent);
        }
        Ok(Cells {
            x_lo_um,
            y_lo_um,
            step_um: step_um as i32,
            columns,
            rows,
            yaw_lo: BinaryAngle(low.rem_euclid(turn) as u32),
            yaw_span: span as u64,
            slabs,
        })
    }
}

/// Rounds up, but keeps a number that is whole except for its rounding.
fn inwards_up(value: f64) -> f64 {
    let nearest = libm::round(value);
    if (value - nearest).abs() < 1e-3 {
        nearest
    } else {
        libm::ceil(value)
    }
}

fn counted(count: f64, what: &'static str, most: f64) -> Result<u16, BakeError> {
    if count <= most {
        Ok(count as u16)
    } else {
        Err(BakeError::too_large(what, count, most))
    }
}
