//! A pose-set in the small integers of a facet layout.
//!
//! Lengths of the estimate are in the layout's units of 2^k um. The extent has its own unit, 2^e um with
//! e <= k. It is chosen so that the entries, including the effect of the yaw at the longest lever, use 14
//! bits: a small set keeps its shape. Products of such numbers fit 32 bits, and so do the sums and squares that a
//! facet needs. The same instructions run on a core with 32-bit multiplication only.

use crate::pose::Pose;
use crate::set::{Common, PoseSet};
use crate::table::Facets;

/// The columns of the x and y rows of a factor, in an extent's units.
pub(super) type Columns = [[i32; 2]; 3];

/// A pose-set relative to a goal, in world axes and small integers.
#[derive(Clone, Copy, Debug)]
pub(super) struct QuantizedPoseSet<'s> {
    pub set: &'s PoseSet,
    pub common: &'s Common,
    /// x of the estimate relative to the goal, length units, to the nearest: within the layout's reach.
    pub x: i32,
    /// y, as `x`.
    pub y: i32,
    /// The estimate's heading relative to the goal's, 2^-32 turn.
    pub above_goal: u32,
    /// `k - e`: the number of bits by which the extent's unit is finer than the estimate's.
    pub finer: u32,
    /// e: the extent's unit is 2^e um.
    pub unit: u32,
    /// The right shift of products of levers and the turn's mantissa.
    pub shift: u32,
    /// Upper bound of the length of an offset in the plane, units of 2^e um: at most 2^14 + 1.
    pub broad: u32,
}

impl<'s> QuantizedPoseSet<'s> {
    /// Returns `None` if the estimate is beyond the layout's reach, or if the set does not fit its
    /// numbers: it is then far larger than the table.
    #[inline(always)]
    pub fn of(facets: &Facets<'_>, set: &'s PoseSet, goal: Pose) -> Option<Self> {
        let k = u32::from(facets.unit());
        let [x, y] = place(facets, set, goal)?;
        let common = set.common();
        // The effect of the yaw at the longest lever counts like an entry, micrometres.
        let lever = i32::from(facets.lever()).wrapping_add(1);
        let weight = common.turn.at(lever, common.turn.shift(0)).unsigned_abs();
        let largest = common.broad_um | weight.min(1 << 18).wrapping_shl(k);
        let e = 18u32.saturating_sub(largest.leading_zeros());
        let finer = k.checked_sub(e)?;
        Some(Self {
            set,
            common,
            x,
            y,
            above_goal: set.mean().yaw.minus(goal.yaw).0,
            finer,
            unit: e,
            shift: common.turn.shift(finer),
            broad: common.broad_um.wrapping_shr(e).wrapping_add(1),
        })
    }

    /// Returns the columns of a factor's x and y rows, to the nearest; at most 2^14.
    pub fn columns(&self, x: [i32; 3], y: [i32; 3]) -> Columns {
        let half = 1i32.wrapping_shl(self.unit) >> 1;
        let nearest = |v: i32| v.wrapping_add(half).wrapping_shr(self.unit);
        let [x1, x2, x3] = x.map(nearest);
        let [y1, y2, y3] = y.map(nearest);
        [[x1, y1], [x2, y2], [x3, y3]]
    }

    /// Returns the effect of the yaw at a lever, units of 2^e um.
    #[inline(always)]
    pub const fn turned(&self, lever: i32) -> i32 {
        self.common.turn.at(lever, self.shift)
    }
}

/// Returns the estimate above the goal, length units, to the nearest; `None` if it is beyond the layout's reach.
#[inline(always)]
pub(super) fn place(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> Option<[i32; 2]> {
    let k = u32::from(facets.unit());
    let half = 1i32.wrapping_shl(k) >> 1;
    let reach = u32::from(facets.reach());
    // Estimates and goals are within 2,000,000,000 um of the origin.
    let offset = |at: i32, goal: i32| {
        let offset = at.checked_sub(goal)?.checked_add(half)?.wrapping_shr(k);
        (offset.unsigned_abs() <= reach).then_some(offset)
    };
    let mean = set.mean();
    Some([offset(mean.x_um, goal.x_um)?, offset(mean.y_um, goal.y_um)?])
}
