//! How much larger a set could be, as a by-product of deciding: what the nearest facet leaves.
//!
//! At scale l a facet needs at most `l A + l^2 E + l^3 R` of what its estimate has to spare: A the
//! extent along the normal, E the bend, R the rest. With any upper bound L of l, `s / (A + L E + L^2 R)`
//! is a scale at which it holds; `L = s / A` is one. (One part of R, `3/8 f^3 |D|`, grows as l^4; it is less
//! than an eighth of E at l = 1, and E, which is all of f |D|, is more than the bend by a half.) A, E and R are the frame's own bounds for all
//! normals, so only the nearest facet of each frame counts, and the result is a lower bound.

use super::compact::Compact;
use super::frame::Seen;
use crate::set::Turn;
use crate::table::Piece;

/// What is told along the way of a decision.
pub(super) trait Watch {
    /// `turns`: whether the layout has levers.
    fn piece(&mut self, piece: &Piece<'_>, set: &Compact<'_>, turns: bool);
    fn facet(&mut self, spare: i32);
    fn frame(&mut self, seen: &Seen, extent: i32);
}

/// Nobody asks.
pub(super) struct Unwatched;

impl Watch for Unwatched {
    #[inline(always)]
    fn piece(&mut self, _: &Piece<'_>, _: &Compact<'_>, _: bool) {}
    #[inline(always)]
    fn facet(&mut self, _: i32) {}
    #[inline(always)]
    fn frame(&mut self, _: &Seen, _: i32) {}
}

/// Scales are told up to 2^11.
const MOST_Q10: u32 = 1 << 21;
const ONE_Q10: u32 = 1 << 10;

/// The nearest facet.
pub(super) struct Nearest {
    /// The smallest amount to spare in the frame.
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

    /// The lower bound, at least 1: the decision itself says so.
    pub fn margin_q10(&self) -> u32 {
        self.scale_q10.max(ONE_Q10)
    }
}

impl Watch for Nearest {
    fn piece(&mut self, piece: &Piece<'_>, set: &Compact<'_>, turns: bool) {
        let turn = &set.common.turn;
        // A piece before may have failed half-way.
        self.least = i32::MAX;
        // The bounds of a frame hold up to half a radian; without levers there are none.
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
            // How often 2^-10 of the reach, rounded up, fits in the room.
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
    fn frame(&mut self, seen: &Seen, extent: i32) {
        let scale = scale_q10(self.least, extent.unsigned_abs(), seen);
        self.scale_q10 = self.scale_q10.min(scale);
        self.least = i32::MAX;
    }
}

/// A scale at which a facet holds, unit 2^-10, rounded down; at most [`MOST_Q10`].
#[inline(never)]
fn scale_q10(spare: i32, extent: u32, seen: &Seen) -> u32 {
    // 2^21 * 2^10 fits.
    let spare = spare.clamp(0, 1 << 21).unsigned_abs() << 10;
    let limit = spare.checked_div(extent).unwrap_or(0);
    if seen.bend == 0 && seen.rest == 0 {
        return limit.min(MOST_Q10);
    }
    // L E and L^2 R; no more than 64 is told.
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
