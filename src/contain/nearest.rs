//! A lower bound on the factor by which a set could be larger, a by-product of the decision: it comes from
//! the nearest facet.
//!
//! At scale l a facet needs at most `l A + l^2 E + l^3 R` of the slack s of its estimate: A is the extent
//! along the normal, E the bend, R the rest. For any upper bound L of l, the facet holds at the scale
//! `s / (A + L E + L^2 R)`; `L = s / A` is such a bound. (One part of R, `3/8 f^3 |D|`, grows as l^4. It is
//! less than an eighth of E at l = 1, and E, which is the whole of f |D|, exceeds the bend by a half.) A, E
//! and R are the frame's own bounds for all normals, so only the nearest facet of each frame counts, and the
//! result is a lower bound.

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
pub(super) const ONE_Q10: u32 = 1 << 10;

/// The nearest facet.
pub(super) struct Nearest {
    /// The smallest slack in the frame.
    least: i32,
    scale_q10: u32,
}

impl Nearest {
    pub const fn new() -> Self {
        Self {
            least: i32::MAX,
            scale_q10: MOST_Q10,
        }
    }

    /// Returns the lower bound: at least 1, which the decision itself proves.
    pub fn margin_q10(&self) -> u32 {
        self.scale_q10.max(ONE_Q10)
    }
}

impl DecisionObserver for Nearest {
    fn piece(&mut self, piece: &Piece<'_>, set: &QuantizedPoseSet<'_>, turns: bool) {
        let turn = &set.common.turn;
        // A previous piece may have failed half-way.
        self.least = i32::MAX;
        // The bounds of a frame are valid up to half a radian. Without levers there are none.
        self.scale_q10 = if turns {
            (Turn::LARGEST.unsigned_abs() << 10)
                .checked_div(turn.radians_q15.unsigned_abs())
                .unwrap_or(0)
                .min(MOST_Q10)
        } else {
            MOST_Q10
        };
        if !piece.is_whole_circle() {
            let above = set.above_goal.wrapping_sub(piece.from);
            let room = above.min(piece.width.saturating_sub(above));
            // The scale is the slack divided by 2^-10 of the reach, rounded up.
            let share = (turn.reach >> 10).wrapping_add(1);
            let scale = room.saturating_sub(8).checked_div(share).unwrap_or(0);
            self.scale_q10 = self.scale_q10.min(scale);
        }
    }

    #[inline(always)]
    fn facet(&mut self, spare: i32) {
        self.least = self.least.min(spare);
    }

    #[inline(always)]
    fn frame(&mut self, seen: &FramePoints, extent: i32) {
        let scale = scale_q10(self.least, extent.unsigned_abs(), seen);
        self.scale_q10 = self.scale_q10.min(scale);
        self.least = i32::MAX;
    }
}

/// Returns a scale at which a facet holds, unit 2^-10, rounded down; at most [`MOST_Q10`].
#[inline(never)]
fn scale_q10(spare: i32, extent: u32, seen: &FramePoints) -> u32 {
    // 2^21 * 2^10 fits.
    let spare = spare.clamp(0, 1 << 21).unsigned_abs() << 10;
    let limit = spare.checked_div(extent).unwrap_or(0);
    if seen.bend == 0 && seen.rest == 0 {
        return limit.min(MOST_Q10);
    }
    // L E and L^2 R; a scale of at most 64 is reported.
    let limit = limit.min(1 << 16);
    let (bend, rest) = (seen.bend.unsigned_abs(), seen.rest.unsigned_abs());
    let up = |value: u32| (limit.wrapping_mul(value) >> 10).wrapping_add(1);
    if rest > 0xffff {
        return 0;
    }
    let more = bend.wrapping_add(up(rest));
    if more > 0xffff {
        return 0;
    }
    spare
        .checked_div(extent.wrapping_add(up(more)))
        .unwrap_or(0)
        .min(limit)
}

#[cfg(test)]
mod tests;
