//! How much larger a set could be, as a by-product of deciding: the facet that leaves least room.
//!
//! At scale l a facet needs at most `l A + l^2 E + l^3 R` of what its estimate has to spare: A the
//! extent along the normal, E the bend, R the rest. With any upper bound L of l, `s / (A + L E + L^2 R)`
//! is a scale at which it holds; `L = s / A` is one. A is the frame's own bound for all facets but one,
//! the facet that is nearest by that bound: for it A is the exact extent. So the result is a lower
//! bound, sharp where one facet is much nearer than the others.

use super::compact::Compact;
use super::facets::{ROUNDING, extent};
use super::frame::{Ready, Seen};
use crate::set::Turn;
use crate::table::{Axes, Facet, Piece};

/// What is told along the way of a decision.
pub(super) trait Watch {
    fn piece(&mut self, piece: &Piece<'_>, set: &Compact<'_>);
    fn facet(&mut self, facet: &Facet, spare: i32);
    fn frame(&mut self, axes: Axes, seen: &Seen, extent: i32);
    fn held(&mut self, ready: &Ready<'_>);
}

/// Nobody asks.
pub(super) struct Unwatched;

impl Watch for Unwatched {
    #[inline(always)]
    fn piece(&mut self, _: &Piece<'_>, _: &Compact<'_>) {}
    #[inline(always)]
    fn facet(&mut self, _: &Facet, _: i32) {}
    #[inline(always)]
    fn frame(&mut self, _: Axes, _: &Seen, _: i32) {}
    #[inline(always)]
    fn held(&mut self, _: &Ready<'_>) {}
}

/// Scales are told up to 2^11.
const MOST_Q10: u32 = 1 << 21;
const ONE_Q10: u32 = 1 << 10;

/// The nearest facet.
pub(super) struct Nearest {
    /// The two smallest amounts to spare in the frame, and the facet of the first.
    least: i32,
    second: i32,
    facet: Facet,
    /// The facet that is nearest by its frame's bound, and its scale by that bound.
    found: Option<(Facet, Axes, Seen, i32)>,
    found_q10: u32,
    /// The smallest scale of all else.
    others_q10: u32,
}

impl Nearest {
    pub fn new() -> Self {
        Self {
            least: i32::MAX,
            second: i32::MAX,
            facet: Facet { x: 0, y: 0, b: 0 },
            found: None,
            found_q10: MOST_Q10,
            others_q10: MOST_Q10,
        }
    }

    /// The lower bound, at least 1: the decision itself says so.
    pub fn margin_q10(&self) -> u32 {
        self.found_q10.min(self.others_q10).max(ONE_Q10)
    }
}

impl Watch for Nearest {
    fn piece(&mut self, piece: &Piece<'_>, set: &Compact<'_>) {
        *self = Self::new();
        let turn = &set.common.turn;
        if !piece.is_whole_circle() {
            let above = set.above_goal.wrapping_sub(piece.from);
            let room = above.min(piece.width.saturating_sub(above));
            // Shares of 2^-10 of the reach, rounded up, that fit in the room.
            let share = (turn.reach >> 10).saturating_add(1);
            self.others_q10 = room.saturating_sub(8).checked_div(share).unwrap_or(0);
        }
        // The bounds of a frame hold up to half a radian.
        let radians = turn.radians_q15.unsigned_abs();
        let largest = (Turn::LARGEST.unsigned_abs() << 10)
            .checked_div(radians)
            .unwrap_or(0);
        self.others_q10 = self.others_q10.min(largest).min(MOST_Q10);
    }

    #[inline(always)]
    fn facet(&mut self, facet: &Facet, spare: i32) {
        if spare < self.least {
            self.second = self.least;
            self.least = spare;
            self.facet = *facet;
        } else {
            self.second = self.second.min(spare);
        }
    }

    #[inline(always)]
    fn frame(&mut self, axes: Axes, seen: &Seen, extent: i32) {
        let least = scale_q10(self.least, extent.unsigned_abs(), seen);
        let second = scale_q10(self.second, extent.unsigned_abs(), seen);
        if least < self.found_q10 {
            self.others_q10 = self.others_q10.min(self.found_q10).min(second);
            self.found_q10 = least;
            self.found = Some((self.facet, axes, *seen, self.least));
        } else {
            self.others_q10 = self.others_q10.min(least);
        }
        (self.least, self.second) = (i32::MAX, i32::MAX);
    }

    fn held(&mut self, ready: &Ready<'_>) {
        if let Some((facet, axes, seen, spare)) = &self.found {
            let extent = extent(facet, *axes, ready, seen).wrapping_add(ROUNDING as u32);
            self.found_q10 = scale_q10(*spare, extent, seen);
        }
    }
}

/// A scale at which a facet holds, unit 2^-10, rounded down; at most [`MOST_Q10`].
#[inline(always)]
fn scale_q10(spare: i32, extent: u32, seen: &Seen) -> u32 {
    // 2^21 * 2^10 fits; extents are below 2^16.
    let spare = spare.max(0).min(1 << 21).unsigned_abs() << 10;
    let limit = spare.checked_div(extent).unwrap_or(0).min(MOST_Q10);
    // L E and L^2 R: E and R are below 2^16, and grow beyond all use before this saturates.
    let up = |value: u32| (limit.saturating_mul(value) >> 10).saturating_add(1);
    let (bend, rest) = (seen.bend.unsigned_abs(), seen.rest.unsigned_abs());
    if bend == 0 && rest == 0 {
        return limit;
    }
    let more = up(bend.saturating_add(up(rest)));
    let needed = extent.saturating_add(more);
    spare.checked_div(needed).unwrap_or(0).min(MOST_Q10)
}
