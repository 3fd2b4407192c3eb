//! A lower bound on the factor by which a set could be larger, a by-product of the decision: it comes from
//! the nearest facet.
//!
//! At scale l a facet needs at most `l (A + l (E + l R))` of the slack s of its estimate: A is the extent
//! along the normal, E the bend, R the rest. (One part of R, `3/8 f^3 |D|`, grows as l^4. It is
//! less than an eighth of E at l = 1, and E, which is the whole of f |D|, exceeds the bend by a half.) A, E
//! and R are the frame's own bounds for all normals, so only the nearest facet of each frame counts, and the
//! result is a lower bound.
//!
//! A division takes a controller without a divider some 200 instructions, a product one. So a product tests
//! first whether a limit lowers the scale found so far. Where it does, the facet holds at the scale
//! `s / (A + L (E + L R))` for any upper bound L of l; `L = s / A` is such a bound.

use super::compact::QuantizedPoseSet;
use super::frame::FramePoints;
use crate::set::Turn;
use crate::table::Piece;

/// Receives the intermediate results of a decision.
pub(super) trait DecisionObserver {
    /// `turns` is `true` if the layout has levers.
    fn piece(&mut self, piece: &Piece<'_>, set: &QuantizedPoseSet<'_>, turns: bool);
    fn facet(&mut self, spare: i32);
    fn frame(&mut self, seen: &FramePoints, extent: i32);
}

/// An observer that ignores everything.
pub(super) struct NoObserver;

impl DecisionObserver for NoObserver {
    #[inline(always)]
    fn piece(&mut self, _: &Piece<'_>, _: &QuantizedPoseSet<'_>, _: bool) {}
    #[inline(always)]
    fn facet(&mut self, _: i32) {}
    #[inline(always)]
    fn frame(&mut self, _: &FramePoints, _: i32) {}
}

/// Scales are reported up to 2^11.
const MOST_Q10: u32 = 1 << 21;
/// With a bend or a rest, up to 2^6.
const MOST_BENT_Q10: u32 = 1 << 16;
pub(super) const ONE_Q10: u32 = 1 << 10;

/// The nearest facet.
pub(super) struct Nearest {
    /// The smallest slack in the frame.
    least: i32,
    scale_q10: u32,
    /// Limits of the piece: its arc, and the largest turn that a frame's bounds allow.
    arc: Limit,
    turn: Limit,
}

/// An upper bound of the scale: `slack / share`, unit 2^-10. A share of zero is no bound.
struct Limit {
    slack: u32,
    share: u32,
}

impl Limit {
    const NONE: Self = Self { slack: 1, share: 0 };

    /// Returns the smaller one of a scale and this limit.
    fn lower(&self, scale_q10: u32) -> u32 {
        let needed = u64::from(self.share).wrapping_mul(u64::from(scale_q10));
        if needed <= u64::from(self.slack) {
            return scale_q10;
        }
        self.slack.checked_div(self.share).unwrap_or(0)
    }
}

impl Nearest {
    pub const fn new() -> Self {
        Self {
            least: i32::MAX,
            scale_q10: MOST_Q10,
            arc: Limit::NONE,
            turn: Limit::NONE,
        }
    }

    /// Returns the lower bound: at least 1, which the decision itself proves.
    pub fn margin_q10(&self) -> u32 {
        let scale = self.arc.lower(self.turn.lower(self.scale_q10));
        scale.max(ONE_Q10)
    }
}

impl DecisionObserver for Nearest {
    fn piece(&mut self, piece: &Piece<'_>, set: &QuantizedPoseSet<'_>, turns: bool) {
        let turn = &set.common.turn;
        // A previous piece may have failed half-way.
        *self = Self::new();
        // The bounds of a frame are valid up to half a radian. Without levers there are none.
        if turns {
            self.turn = Limit {
                slack: Turn::LARGEST.unsigned_abs() << 10,
                share: turn.radians_q15.unsigned_abs(),
            };
        }
        if !piece.is_whole_circle() {
            let above = set.above_goal.wrapping_sub(piece.from);
            let room = above.min(piece.width.saturating_sub(above));
            self.arc = Limit {
                slack: room.saturating_sub(8),
                // 2^-10 of the reach, rounded up.
                share: (turn.reach >> 10).wrapping_add(1),
            };
        }
    }

    #[inline(always)]
    fn facet(&mut self, spare: i32) {
        self.least = self.least.min(spare);
    }

    #[inline(always)]
    fn frame(&mut self, seen: &FramePoints, extent: i32) {
        let needs = Needs {
            extent: extent.unsigned_abs(),
            bend: seen.bend.unsigned_abs(),
            rest: seen.rest.unsigned_abs(),
        };
        // 2^21 * 2^10 fits.
        let spare = self.least.clamp(0, 1 << 21).unsigned_abs() << 10;
        if !needs.are_surely_met_at(self.scale_q10, spare) {
            self.scale_q10 = needs.lower(self.scale_q10, spare);
        }
        self.least = i32::MAX;
    }
}

/// What a frame's facets need at scale 1: extent, bend and rest, units of the extent.
struct Needs {
    extent: u32,
    bend: u32,
    rest: u32,
}

impl Needs {
    /// Returns `A + l (E + l R)`, rounded up, for a scale l of unit 2^-BITS. `None` if `E + l R` exceeds 16 bits.
    /// The products `l R` and `l (E + l R)`, in the scale's unit, must fit in 32 bits.
    #[inline(always)]
    fn at<const BITS: u32>(&self, scale: u32) -> Option<u32> {
        let up = |value: u32| (scale.wrapping_mul(value) >> BITS).wrapping_add(1);
        let more = self.bend.wrapping_add(up(self.rest));
        (more <= 0xffff).then(|| self.extent.wrapping_add(up(more)))
    }

    /// Returns `true` if the slack is surely enough at a scale. A quick test in 32 bits: it takes the scale rounded up to 2^-8, and
    /// shows nothing from 16 on.
    #[inline(always)]
    fn are_surely_met_at(&self, scale_q10: u32, spare_q10: u32) -> bool {
        let scale_q8 = (scale_q10 >> 2).wrapping_add(1);
        // Below 2^12 * 2^18, and then 2^12 * 2^20.
        scale_q8 <= 1 << 12
            && self.rest >> 18 == 0
            && self.at::<8>(scale_q8).is_some_and(|needs| {
                needs >> 20 == 0 && needs.wrapping_mul(scale_q8) <= spare_q10 >> 2
            })
    }

    /// Returns the smaller one of a scale and one at which the facets hold, unit 2^-10, rounded down.
    #[inline(never)]
    fn lower(&self, scale_q10: u32, spare_q10: u32) -> u32 {
        let limit = spare_q10.checked_div(self.extent).unwrap_or(0);
        let limit = limit.min(scale_q10);
        if self.bend == 0 && self.rest == 0 {
            return limit;
        }
        if self.rest > 0xffff {
            return 0;
        }
        let limit = limit.min(MOST_BENT_Q10);
        self.at::<10>(limit)
            .and_then(|needs| spare_q10.checked_div(needs))
            .unwrap_or(0)
            .min(limit)
    }
}

#[cfg(test)]
mod tests;
