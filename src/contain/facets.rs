//! Tests a pose-set against the pieces of a facet layout.
//!
//! The set is inside if one piece contains it: its headings lie in the piece's arc, and its points satisfy every facet. (Or if several pieces
//! contain it together: [`super::union`].) Most facets are so far away that no pose of the set comes near them ([`Placed::enough`]). The others
//! are tested slab by slab of the set's headings ([`super::slab`]): one slab first, which is halved where its bound does not decide.

use super::placed::{Placed, Seen};
use super::slab::{DEEPEST, Section, Slab, U};
use super::union;
use crate::num::COS_SIN_ERROR_Q15;
use crate::num::wide;
use crate::pose::Pose;
use crate::set::PoseSet;
use crate::table::parts;
use crate::table::{Axes, Facet, Facets, Frame, MOST_SLABS, Piece};

/// Largest `|x| + |y|` of a normal in any axes: 2^14 sqrt(1 + 2^-7) sqrt(2).
const ALONG_AT_ANY_ANGLE: i64 = 23_262;
/// Half of [`ALONG_AT_ANY_ANGLE`], times 1.118.
const ROUNDED_AND_TURNED: i64 = 13_004;
/// Scales are reported up to 2^11.
const MOST_Q10: u32 = 1 << 21;
const ONE_Q10: u32 = 1 << 10;

/// Returns the largest error of `a . P` of a facet from rounding the estimate and its heading, in length units times
/// 2^14. The proof of a table raises every b by this value.
///
/// Estimate and goal are within 0.5 um on each axis, and their difference is rounded to the nearest 2^k um. These
/// roundings are on world axes, which a normal in robot axes can meet at any angle. A rotated point has the error of
/// cosine and sine times its length, and is rounded once more. That error rotates with the yaw offset t, which the
/// decision bounds to first order, besides its curvature: it counts `sqrt(1 + t^2)` times its length, at most 1.118 times, at any angle to the
/// normal.
#[must_use]
pub fn clearance_q14(facet: Facet, axes: Axes, turns: bool, unit: u8, lever: u16) -> i64 {
    let along = match axes {
        Axes::World => {
            i64::from(facet.x.unsigned_abs()).wrapping_add(i64::from(facet.y.unsigned_abs()))
        }
        Axes::Robot => ALONG_AT_ANY_ANGLE,
    };
    // 0.5 + 2^-k on each axis. Headings: 1.6e-9 rad at a lever of 2^15 are 2^-14.
    let estimate = (along >> 1)
        .wrapping_add(along.wrapping_shr(u32::from(unit)))
        .wrapping_add(3);
    if matches!(axes, Axes::World) && !turns {
        return estimate;
    }
    // Error * 2^-15 * 2^14 times |P|, times the normal's length.
    let lever = i64::from(lever);
    let turned = i64::from(COS_SIN_ERROR_Q15).wrapping_mul(lever.wrapping_add(lever >> 7)) >> 1;
    estimate
        .wrapping_add(turned)
        .wrapping_add(ROUNDED_AND_TURNED)
        .wrapping_add(2)
}

/// Returns `true` if one of the pieces contains every pose of the set, or several together.
#[inline(never)]
pub(super) fn covers(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> bool {
    Placed::of(facets, set, goal).is_some_and(|placed| {
        in_one_piece(facets, &placed, &mut NoObserver) || union::covers(facets, &placed)
    })
}

/// As [`covers`], and returns a lower bound on the factor by which the set could be larger, unit 2^-10. `None` if no piece contains the set.
#[inline(never)]
pub(super) fn margin_q10(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> Option<u32> {
    let placed = Placed::of(facets, set, goal)?;
    let mut nearest = Nearest {
        scale_q10: MOST_Q10,
    };
    if in_one_piece(facets, &placed, &mut nearest) {
        return Some(nearest.scale_q10.max(ONE_Q10));
    }
    union::covers(facets, &placed).then_some(ONE_Q10)
}

/// Returns `true` if one piece contains every pose of a set.
#[inline(always)]
fn in_one_piece(facets: &Facets<'_>, placed: &Placed, observer: &mut impl Observer) -> bool {
    let mut slabs = MOST_SLABS;
    for piece in facets.pieces() {
        if !placed.is_in_arc(&piece) {
            continue;
        }
        observer.piece(placed, &piece);
        let mut frames = piece.frames();
        if frames.all(|frame| holds(&frame, placed, &mut slabs, observer)) {
            return true;
        }
    }
    false
}

/// Returns `true` if every pose of the set satisfies the facets of a frame.
#[inline(always)]
fn holds(
    frame: &Frame<'_>,
    placed: &Placed,
    slabs: &mut u32,
    observer: &mut impl Observer,
) -> bool {
    let middle = placed.middle(0);
    let seen = placed.seen(frame, &middle, &placed.first);
    let enough = placed.enough(&seen);
    let mut least = i32::MAX;
    for facet in frame.facets() {
        let spare = placed.spare(facet, &seen);
        least = least.min(spare);
        if spare < enough && !holds_sharply(facet, frame, placed, &seen, slabs) {
            return false;
        }
    }
    observer.frame(least, enough);
    true
}

/// Returns `true` if every pose of the set satisfies a facet, slab by slab. `seen` is the frame's point at the estimate's heading.
#[inline(always)]
fn holds_sharply(
    facet: Facet,
    frame: &Frame<'_>,
    placed: &Placed,
    seen: &Seen,
    slabs: &mut u32,
) -> bool {
    if placed.first.depth == 0 {
        match first_slab(facet, placed, seen) {
            Slab::Inside => return true,
            Slab::Outside => return false,
            Slab::Unsure => {}
        }
    } else if placed.holds_at_any_heading(facet, seen) {
        return true;
    }
    let is_fixed = matches!(frame.axes, Axes::World) && (frame.x, frame.y) == (0, 0);
    parts::HEADINGS
        && !is_fixed
        && in_slabs(
            facet,
            frame.axes,
            [frame.x, frame.y].map(i32::from),
            placed,
            slabs,
        )
}

/// Returns the result of one slab for the whole set. A function of its own, so that its stack is free for smaller slabs.
#[inline(never)]
fn first_slab(facet: Facet, placed: &Placed, seen: &Seen) -> Slab {
    let middle = placed.middle(0);
    let section = Section::of(facet, seen, placed, &middle, &placed.first);
    section.slab(placed, 0, &placed.first)
}

/// As [`holds_sharply`], from slabs of at most half the set on.
#[inline(never)]
fn in_slabs(facet: Facet, axes: Axes, point: [i32; 2], placed: &Placed, slabs: &mut u32) -> bool {
    let first = if placed.first.depth == 0 {
        placed.first.halved()
    } else {
        placed.first
    };
    let (mut width, mut index) = (first, 0u32);
    loop {
        let Some(left) = slabs.checked_sub(1) else {
            return false;
        };
        *slabs = left;
        let middle = placed.middle(middle_of(index, width.depth));
        let seen = placed.seen_at(axes, point, &middle, &width);
        let section = Section::of(facet, &seen, placed, &middle, &width);
        match section.slab(placed, middle.e, &width) {
            Slab::Outside => return false,
            Slab::Unsure if width.depth == DEEPEST => return false,
            Slab::Unsure => {
                index = index.wrapping_mul(2);
                width = width.halved();
            }
            Slab::Inside => {
                let Some(next) = next_of(&mut index, width.depth, first.depth) else {
                    return true;
                };
                if next != width.depth {
                    width = first.halved_to(next);
                }
            }
        }
    }
}

/// Returns u of the middle of slab number `index` after `depth` halvings, 2^-15.
#[inline(always)]
pub(super) const fn middle_of(index: u32, depth: u32) -> i32 {
    let middle = index.wrapping_mul(2).wrapping_add(1);
    (middle.wrapping_shl(U.wrapping_sub(depth)) as i32).wrapping_sub(1 << U)
}

/// Moves to the slab after number `index`, up from each second half, and returns its depth; `None` after the last. `first` is the depth of the
/// first slabs.
#[inline(always)]
pub(super) fn next_of(index: &mut u32, mut depth: u32, first: u32) -> Option<u32> {
    while depth > first && *index & 1 == 1 {
        depth = depth.wrapping_sub(1);
        *index >>= 1;
    }
    *index = index.wrapping_add(1);
    (index.wrapping_shr(depth) == 0).then_some(depth)
}

/// Receives how near a set comes to the facets.
trait Observer {
    fn piece(&mut self, placed: &Placed, piece: &Piece<'_>);
    fn frame(&mut self, least: i32, enough: i32);
}

/// An observer that ignores everything.
struct NoObserver;

impl Observer for NoObserver {
    #[inline(always)]
    fn piece(&mut self, _: &Placed, _: &Piece<'_>) {}
    #[inline(always)]
    fn frame(&mut self, _: i32, _: i32) {}
}

/// A lower bound of the factor by which a set could be larger, unit 2^-10. At scale l a set moves the point of a frame by at most l times as
/// much: a facet that is `enough` times l away holds.
struct Nearest {
    scale_q10: u32,
}

impl Nearest {
    /// Lowers the scale to `slack / share`. A product tests first whether that is less: a division is slow without a divider.
    #[inline(always)]
    fn lower(&mut self, slack_q10: u32, share: u32) {
        if wide(share, self.scale_q10) > slack_q10.into() {
            self.scale_q10 = slack_q10.checked_div(share).unwrap_or(0);
        }
    }
}

impl Observer for Nearest {
    fn piece(&mut self, placed: &Placed, piece: &Piece<'_>) {
        // A previous piece may have failed half-way.
        self.scale_q10 = MOST_Q10;
        if let Some((room, reach)) = placed.room_in_arc(piece) {
            // 2^-10 of the reach, rounded up.
            self.lower(room.saturating_sub(8), (reach >> 10).wrapping_add(1));
        }
    }

    #[inline(always)]
    fn frame(&mut self, least: i32, enough: i32) {
        // 2^21 * 2^10 fits.
        let slack = least.clamp(0, 1 << 21).unsigned_abs() << 10;
        self.lower(slack, enough.unsigned_abs());
    }
}

/// Returns where a set first leaves its piece, or all of several pieces: relative to the estimate, in world axes: um, um, 2^-24 turn. For reports.
pub(super) fn witness(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> [i64; 3] {
    Placed::of(facets, set, goal).map_or([0; 3], |placed| {
        union::witness(facets, &placed)
            .unwrap_or_else(|| super::touching::farthest(facets, &placed))
    })
}
