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
mod tests {
    use super::*;
    use crate::contain::exact::cases::Case;
    use crate::contain::facets::margin_q10;
    use crate::num::BinaryAngle;
    use crate::pose::Pose;
    use crate::set::{Extent, PoseSet};
    use crate::table::{Axes, Facet, Table};

    fn seen(bend: i32, rest: i32) -> FramePoints {
        FramePoints {
            axes: Axes::World,
            x: 0,
            y: 0,
            lever: [0; 2],
            rest,
            bend,
        }
    }

    #[test]
    fn scales_are_what_is_spared_for_a_facets_needs() {
        for (spare, extent, bend, rest, scale) in [
            (1000, 250, 0, 0, 4096),
            (-1, 250, 0, 0, 0),
            (1 << 22, 1 << 10, 0, 0, MOST_Q10),
            (1 << 21, 1, 0, 0, MOST_Q10),
            (1000, 0, 0, 0, 0),
            // The limit is 4: 250 + 4 (100 + 1) + 1, and 250 + 4 (4 * 100 + 1) + 1.
            (1000, 250, 100, 0, 1_024_000 / 655),
            (1000, 250, 0, 100, 1_024_000 / 1855),
            // At most 64.
            (1 << 20, 1, 1, 0, 1 << 16),
            // Values that do not fit in 16 bits, and the largest that do: half of them and one.
            (
                1 << 19,
                1 << 20,
                0,
                0xffff,
                (1 << 29) / ((1 << 20) + 16_385),
            ),
            (1 << 19, 1 << 20, 0, 0x1_0000, 0),
            (
                1 << 19,
                1 << 20,
                0xfffe,
                0,
                (1 << 29) / ((1 << 20) + 32_768),
            ),
            (1 << 19, 1 << 20, 0xffff, 0, 0),
        ] {
            let found = scale_q10(spare, extent, &seen(bend, rest));
            assert_eq!(found, scale, "{spare} {extent} {bend} {rest}");
        }
    }

    /// A disc of 100 um at the goal, 5 mm from the border.
    fn case(yaw_q24: i32) -> Case {
        let facet = Facet {
            x: 16_384,
            y: 0,
            b: 5000,
        };
        Case {
            unit: 0,
            reach: 1,
            arm: 0,
            farthest: 0,
            axes: Axes::World,
            point: [0; 2],
            facet,
            goal: Pose::default(),
            mean: Pose::default(),
            extent: Extent::Bounded {
                translation_um: 100,
                yaw_q24,
            },
        }
    }

    #[test]
    fn the_nearest_border_counts() {
        let margin = |case: Case| {
            let bytes = case.bytes();
            let table = Table::parse(&bytes).unwrap();
            margin_q10(table.facets().unwrap(), &case.set(), case.goal)
        };
        // 101 is at most 104 along a normal that is too long, and 12 are added for roundings.
        assert_eq!(margin(case(1)), Some(5000 * 1024 / 116));
        // Without a lever no turn is too large.
        assert_eq!(margin(case(1 << 20)), Some(5000 * 1024 / 116));
        // The bounds of the margin are weaker than the decision.
        assert_eq!(margin(case(1).with_b(113)), Some(1024));
        assert_eq!(margin(case(1).with_b(100)), None);
    }

    #[test]
    fn the_nearer_end_of_an_arc_counts() {
        let case = case(1 << 14);
        let bytes = case.bytes();
        let table = Table::parse(&bytes).unwrap();
        let layout = table.facets().unwrap();
        let at = |yaw: u32| {
            let mean = Pose {
                yaw: BinaryAngle(yaw),
                ..case.mean
            };
            PoseSet::of(mean, case.extent)
        };
        let told = |from: u32, width: u32, yaw: u32, turns: bool| {
            let set = at(yaw);
            let set = QuantizedPoseSet::of(layout, &set, case.goal).unwrap();
            let mut piece = layout.pieces().next().unwrap();
            (piece.from, piece.width) = (from, width);
            let mut nearest = Nearest::new();
            // As a previous piece may leave it.
            nearest.least = 1;
            nearest.piece(&piece, &set, turns);
            assert_eq!(nearest.least, i32::MAX);
            nearest.scale_q10
        };
        let scale = |from, width, yaw| told(from, width, yaw, true);
        // The reach is 2^22; 2^-10 of it is 2^12, and one more for rounding up.
        assert_eq!(scale(5, 1 << 30, 5 + (1 << 28)), ((1 << 28) - 8) / 4097);
        assert_eq!(
            scale(5, 1 << 29, 5 + (1 << 28) + 4096),
            ((1 << 28) - 4104) / 4097
        );
        assert_eq!(scale(5, 1 << 30, 5), 0);
        // Half a radian, of 6.1 mrad.
        assert_eq!(scale(5, u32::MAX, 5), (1 << 24) / 202);
        assert_eq!(told(5, u32::MAX, 5, false), MOST_Q10);
        assert_eq!(scale(5, 1 << 31, 5 + (1 << 30)), (1 << 24) / 202);
    }
}
