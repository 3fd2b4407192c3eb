//! A pose-set in the small integers of a facet layout.
//!
//! Lengths of the estimate are in the layout's units of 2^k um. The factor has a unit of its own,
//! 2^e um with e <= k, chosen so that its entries use 14 bits: a small set keeps its shape. Products
//! of two such numbers fit 32 bits, and so do the sums and squares that a facet needs, so the same
//! instructions run on a core that multiplies 32 bits only.

use crate::num::ANGLE_UNITS_PER_Q24;
use crate::pose::Pose;
use crate::set::Extent;
use crate::table::{Facets, NORMAL_BITS};

/// A pose-set about a goal, in world axes and small integers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Compact {
    /// The estimate above the goal, 2^k um, to the nearest: below 2^15.
    pub x: i32,
    pub y: i32,
    /// The estimate above the lower end of the table's yaw range, yaw units, to the nearest.
    pub yaw: i32,
    /// The largest yaw offset, yaw units, rounded up.
    pub reach: i32,
    /// `k - e`: how many bits finer the factor's unit is.
    pub finer: u32,
    /// The exponents of the extent's length unit and of the layout's yaw unit.
    unit: u32,
    yaw_shift: u32,
    /// The extent, in units of 2^e um and, for yaw, of 2^(e - k) yaw units.
    pub shape: Shape,
}

/// The extent of a compact set.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// Rows of the factor: yaw, and x and y with three entries each, below 2^14.
    Ellipsoid { yaw: i32, x: [i32; 3], y: [i32; 3] },
    /// Radius and yaw, below 2^14.
    Cylinder { radius: i32, yaw: i32 },
}

/// Entries of a factor stay below this.
const ENTRY_LIMIT: u32 = 1 << 14;

impl Compact {
    /// `None` where the set does not fit the layout's numbers: it is then far larger than the table
    /// or far off it.
    pub fn of(
        facets: &Facets<'_>,
        mean: Pose,
        goal: Pose,
        yaw_lo: u32,
        extent: Extent,
    ) -> Option<Self> {
        let k = u32::from(facets.length_shift());
        let j = u32::from(facets.yaw_shift());
        let half = 1i32.wrapping_shl(k) >> 1;
        // Estimates and goals are within 2,000,000,000 um of the origin.
        let offset = |at: i32, goal: i32| {
            let offset = at.checked_sub(goal)?.checked_add(half)?.wrapping_shr(k);
            (offset.unsigned_abs() < 1 << 15).then_some(offset)
        };
        let (x, y) = (offset(mean.x_um, goal.x_um)?, offset(mean.y_um, goal.y_um)?);
        let above = mean.yaw.minus(goal.yaw).0.wrapping_sub(yaw_lo);
        let yaw = above
            .wrapping_shr(j)
            .wrapping_add(above.wrapping_shr(j.saturating_sub(1)) & u32::from(j > 0))
            as i32;
        let yaw_q24 = match extent {
            Extent::Gaussian(factor) => factor.yaw,
            Extent::Bounded { yaw_q24, .. } => yaw_q24,
        };
        // Rounded up to yaw units; at most 2^30 * 2^8.
        let units = i64::from(yaw_q24).wrapping_mul(ANGLE_UNITS_PER_Q24);
        let round_up = 1i64.wrapping_shl(j).wrapping_sub(1);
        let reach = units.wrapping_add(round_up).wrapping_shr(j).wrapping_add(1);
        let reach = i32::try_from(reach).ok().filter(|r| *r < 1 << 15)?;
        // The yaw offset weighs as much as the steepest tilt makes of it.
        let tilt = u32::from(facets.tilt());
        let weight = (reach.unsigned_abs().wrapping_mul(tilt) >> NORMAL_BITS)
            .wrapping_add(1)
            .wrapping_shl(k);
        let largest = match extent {
            Extent::Gaussian(factor) => {
                let [x1, x2, x3] = factor.x.map(i32::unsigned_abs);
                let [y1, y2, y3] = factor.y.map(i32::unsigned_abs);
                // An upper bound of the magnitudes is enough.
                x1 | x2 | x3 | y1 | y2 | y3
            }
            Extent::Bounded { translation_um, .. } => translation_um.unsigned_abs(),
        } | weight;
        let mut e = 0u32;
        let mut top = largest.wrapping_add(largest >> 10);
        while top >= ENTRY_LIMIT - 1 {
            top >>= 1;
            e = e.wrapping_add(1);
        }
        let finer = k.checked_sub(e)?;
        let unit = 1i32.wrapping_shl(e);
        let nearest = |v: i32| v.wrapping_add(unit >> 1).wrapping_shr(e);
        let up = |v: i32| v.wrapping_add(unit.wrapping_sub(1)).wrapping_shr(e);
        let yaw_entry = reach.wrapping_shl(finer);
        let shape = match extent {
            Extent::Gaussian(factor) => Shape::Ellipsoid {
                yaw: yaw_entry,
                x: factor.x.map(nearest),
                y: factor.y.map(nearest),
            },
            Extent::Bounded { translation_um, .. } => Shape::Cylinder {
                radius: up(translation_um),
                yaw: yaw_entry,
            },
        };
        Some(Self {
            x,
            y,
            yaw,
            reach,
            finer,
            unit: e,
            yaw_shift: j,
            shape,
        })
    }

    /// A length of the extent in micrometres.
    pub const fn micrometres(&self, length: i32) -> i32 {
        length.wrapping_shl(self.unit)
    }

    /// A yaw of the extent in units of 2^-24 turn.
    pub const fn q24(&self, yaw: i32) -> i32 {
        ((yaw as i64)
            .wrapping_shl(self.yaw_shift)
            .wrapping_shr(self.finer)
            >> 8) as i32
    }
}
