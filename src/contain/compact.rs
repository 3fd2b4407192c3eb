//! A pose-set in the small integers of a facet layout.
//!
//! Lengths of the estimate are in the layout's units of 2^k um. The extent has a unit of its own,
//! 2^e um with e <= k, chosen so that its entries, what the yaw does at the longest lever included,
//! use 14 bits: a small set keeps its shape. Products of such numbers fit 32 bits, and so do the sums
//! and squares that a facet needs, so the same instructions run on a core that multiplies 32 bits only.

use crate::num::{ANGLE_UNITS_PER_Q24, BinaryAngle};
use crate::pose::Pose;
use crate::set::Extent;
use crate::table::Facets;

/// A pose-set about a goal, in world axes and small integers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Compact {
    /// The estimate above the goal, length units, to the nearest: within the layout's reach.
    pub x: i32,
    /// As x.
    pub y: i32,
    /// The estimate's heading in the world, and above the goal's.
    pub heading: BinaryAngle,
    pub above_goal: BinaryAngle,
    /// The largest yaw offset, 2^-32 turn; saturated.
    pub reach: u32,
    /// The largest yaw offset in radians.
    pub turn: Turn,
    /// `k - e`: how many bits finer the extent's unit is than the estimate's.
    pub finer: u32,
    /// e: the extent's unit is 2^e um.
    pub unit: u32,
    /// The extent in the plane, units of 2^e um.
    pub shape: Shape,
}

/// The extent of a compact set in the plane.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// The columns of the factor's x and y rows, to the nearest; entries at most 2^14.
    Ellipsoid([[i32; 2]; 3]),
    /// A radius, rounded up; at most 2^14 + 1.
    Disc(i32),
}

/// A largest yaw offset in radians, and what it makes of a lever.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    mantissa: i32,
    /// A lever in length units times the mantissa, shifted down by this, is in the extent's units.
    shift: u32,
    /// The offset, 2^-15 rad, rounded up; above [`Turn::LARGEST`] where levers are not served.
    pub radians_q15: i32,
}

impl Turn {
    /// Half a radian: the bounds of [`super::frame`] hold up to here.
    pub const LARGEST: i32 = 1 << 14;

    /// Of an offset above zero, for units of an extent that are 2^finer finer.
    fn new(yaw_q24: u32) -> (u32, i32) {
        // 16 bits of it: `yaw_q24 = t 2^s`, t <= 2^16 to the nearest; times 2 pi / 8 as 51472 / 2^16.
        let s = 16i32.wrapping_sub(yaw_q24.leading_zeros() as i32);
        let t = if s > 0 {
            let half = 1u32.wrapping_shl(s.unsigned_abs()) >> 1;
            yaw_q24.wrapping_add(half).wrapping_shr(s.unsigned_abs())
        } else {
            yaw_q24.wrapping_shl(s.unsigned_abs())
        };
        // Radians: mantissa * 2^(s - 21).
        (t.wrapping_mul(51_472).wrapping_add(1 << 15) >> 16, s)
    }

    fn scaled((mantissa, s): (u32, i32), finer: u32) -> Self {
        let radians_q15 = if s > 5 {
            i32::MAX
        } else {
            // mantissa * 2^(s - 6), up.
            let by = 6i32.wrapping_sub(s).unsigned_abs().min(31);
            (mantissa.wrapping_shr(by) as i32).wrapping_add(1)
        };
        let shift = 21i32.wrapping_sub(s).wrapping_sub(finer as i32);
        Self {
            mantissa: mantissa as i32,
            shift: shift.max(1).unsigned_abs().min(31),
            radians_q15,
        }
    }

    /// The offset times a lever (length units below 2^15), in the extent's units: to within 1.1 of
    /// what it is for levers at which that is below 2^14.
    pub const fn at(self, lever: i32) -> i32 {
        // Below 2^31: 51472 * 2^15.
        let product = lever.wrapping_mul(self.mantissa);
        product
            .wrapping_shr(self.shift.wrapping_sub(1))
            .wrapping_add(1)
            >> 1
    }
}

impl Compact {
    /// `None` where the estimate is beyond the layout's reach, or the set does not fit its numbers: it is
    /// then far larger than the table.
    pub fn of(facets: &Facets<'_>, mean: Pose, goal: Pose, extent: Extent) -> Option<Self> {
        let k = u32::from(facets.unit());
        let half = 1i32.wrapping_shl(k) >> 1;
        let reach = u32::from(facets.reach());
        // Estimates and goals are within 2,000,000,000 um of the origin.
        let offset = |at: i32, goal: i32| {
            let offset = at.checked_sub(goal)?.checked_add(half)?.wrapping_shr(k);
            (offset.unsigned_abs() <= reach).then_some(offset)
        };
        let (x, y) = (offset(mean.x_um, goal.x_um)?, offset(mean.y_um, goal.y_um)?);
        let (yaw_q24, largest) = match extent {
            Extent::Gaussian(factor) => {
                let [x1, x2, x3] = factor.x.map(i32::unsigned_abs);
                let [y1, y2, y3] = factor.y.map(i32::unsigned_abs);
                // An upper bound of the magnitudes is enough.
                (factor.yaw, x1 | x2 | x3 | y1 | y2 | y3)
            }
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => (yaw_q24, translation_um.unsigned_abs()),
        };
        let yaw_q24 = yaw_q24.unsigned_abs();
        let turn = Turn::new(yaw_q24);
        // What the yaw makes of the longest lever counts like an entry, micrometres.
        let lever = i32::from(facets.lever()).wrapping_add(1);
        let weight = Turn::scaled(turn, 0).at(lever).unsigned_abs().min(1 << 18);
        let largest = largest | weight.wrapping_shl(k);
        let e = 18u32.saturating_sub(largest.leading_zeros());
        let finer = k.checked_sub(e)?;
        let unit_half = 1i32.wrapping_shl(e) >> 1;
        let nearest = |v: i32| v.wrapping_add(unit_half).wrapping_shr(e);
        let shape = match extent {
            Extent::Gaussian(factor) => {
                let [x1, x2, x3] = factor.x.map(nearest);
                let [y1, y2, y3] = factor.y.map(nearest);
                Shape::Ellipsoid([[x1, y1], [x2, y2], [x3, y3]])
            }
            Extent::Bounded { translation_um, .. } => Shape::Disc(
                nearest(translation_um)
                    .wrapping_add(1),
            ),
        };
        Some(Self {
            x,
            y,
            heading: mean.yaw,
            above_goal: mean.yaw.minus(goal.yaw),
            reach: if yaw_q24 < 1 << 24 {
                yaw_q24.wrapping_mul(ANGLE_UNITS_PER_Q24 as u32)
            } else {
                u32::MAX
            },
            turn: Turn::scaled(turn, finer),
            finer,
            unit: e,
            shape,
        })
    }
}
