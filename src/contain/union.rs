//! Tests if several pieces of a facet layout contain a pose-set together, although no single piece contains it.
//!
//! A set lies in the union of pieces if the poses of it that are beyond a facet of one piece lie in the others. So for
//! one piece, the one in which the estimate lies deepest, each facet that does not hold cuts off a *cap* of the set.
//! Another piece must contain that cap, except for a cap of the cap, which a third piece must contain.
//!
//! A facet `a . P <= b` holds on a cap, the poses of the set with `a1 . P > b1`, if for some `beta` in `[0, 1]`
//!
//! `(1 - beta) a . P + beta a1 . P <= (1 - beta) b + beta b1`
//!
//! holds on the whole set (weak duality; for any beta this is an upper bound, and at a single heading the best beta makes it
//! exact). Both sides are sums of terms that [`super::slab`] bounds slab by slab, so the numbers of two facets
//! are added up for each slab ([`Section::weighed`]), with a beta of the slab's own. For beta = 0 the facet holds on the whole slab,
//! and for beta = 1 the slab has no pose in the cap.
//! In a cap of a cap, one of three such sums must hold: of the facet and either of the others, or of these two.
//!
//! # Cost
//! The search takes at most [`MOST_UNION_STEPS`] steps, and up to three more in its last slab. A test of a section or of a sum on a
//! slab is a step, and the choice of a piece for a pose is one or more ([`Facets::steps_of_choice`]). A slab is first tested with the
//! facet alone, because most facets hold on the whole set. Its halves are tested with the sums alone, because the best sum decides at
//! least as well, apart from rounding. Sets that barely fit need the most steps. If no steps remain, the set is denied.
//!
//! If pieces have arcs, the headings of the set are cut at the ends of these arcs.
//!
//! # Rounding
//! A sum with weights `1 - beta` and `beta` has each error at most as large as the larger one of its two facets: the roundings to
//! the nearest, and the clearance of the proof of a table (it raises both b). Adding up rounds each number to the nearest unit
//! ([`rounding_of_a_sum`]). The bounds only require that the numbers of a facet's section are linear in its normal, its offset and
//! its point.

use super::facets::{middle_of, next_of};
use super::placed::{ARC_SLACK, ONE_TURN, Placed};
use super::slab::{DEEPEST, Root, Section, Slab, U, Width};
use crate::num::{Divisor, product, sqrt_ceil};
use crate::pose::Pose;
use crate::table::parts;
use crate::table::{Axes, Facet, Facets, MOST_UNION_STEPS, Piece};

/// Returns the most by which rounding in a weighted sum of two sections can lower a bound, extent units.
pub(super) const fn rounding_of_a_sum(turns: bool) -> i32 {
    if turns { 2 } else { 1 }
}
/// Fraction bits of a weight.
const WEIGHT_BITS: u32 = 12;
/// An upper limit of lambda times a square of 25 bits, in [`Section::weight`]; two of them fit into 31 bits.
const FAR: i32 = 1 << 29;
/// A pose farther than this outside of every piece is outside of the union: length units, times 2^28.
const OUTSIDE: i64 = -(4 << 28);
/// A pose that is farther than this on an axis is treated as at this coordinate by the choice of a piece: length units times 2^14. A
/// choice is no proof. Points and offsets of a table have 16 bits, so that few poses in it are farther.
const FARTHEST: i64 = 7 << 27;
// From the farthest point to the farthest pose, in any direction, is less than 2^31.
const _: () = assert!(2 * (FARTHEST + (1 << 29)) * (FARTHEST + (1 << 29)) < 1 << 62);
/// Largest number of facets that a pose is beyond, in the search, when another piece must contain it.
const MOST_BEYOND: usize = 2;
/// Largest number of ends of arcs among the headings of a set. With more, the set is denied.
const MOST_CUTS: usize = 6;

/// Returns `true` if the pieces together contain every pose of the set; `false` if that is not shown.
#[inline(never)]
pub(super) fn covers(facets: &Facets<'_>, placed: &Placed) -> bool {
    search(facets, placed) == Some(Ok(()))
}

/// Returns a pose of the set for which the search found no piece: relative to the estimate, in world axes: um, um, 2^-24 turn. `None`
/// for a layout of one piece and a set that is covered or too wide. For reports.
#[inline(never)]
pub(super) fn witness(facets: &Facets<'_>, placed: &Placed) -> Option<[i64; 3]> {
    search(facets, placed)?.err()
}

/// Returns the depth of a pose in the piece where it is deepest: length units times 2^28, below zero outside of every piece. A radian from the
/// end of a piece's arc of headings counts as a metre. A pose beyond [`FARTHEST`] is treated as at it. For reports.
pub(super) fn depth(facets: &Facets<'_>, pose: Pose, goal: Pose) -> i64 {
    let unit = u32::from(facets.unit());
    let fine = |at: i32, goal: i32| {
        let offset = i64::from(at).wrapping_sub(i64::from(goal));
        offset.wrapping_shl(14).wrapping_shr(unit)
    };
    let at = At {
        x: fine(pose.x_um, goal.x_um),
        y: fine(pose.y_um, goal.y_um),
        u: 0,
    };
    let above_goal = pose.yaw.minus(goal.yaw).0;
    let turn = pose.yaw.cos_sin_q30();
    let mut most = i64::MIN;
    for piece in facets.pieces() {
        let in_arc = depth_in_arc(&piece, above_goal, unit);
        if in_arc > most
            && let Some(depth) = depth_in(&piece, at, turn, most)
        {
            most = depth.min(in_arc);
        }
    }
    most
}

/// Returns the depth of a heading, 2^-32 turn above the goal's, in a piece's arc, as [`depth`]; below zero within [`ARC_SLACK`] of its ends.
fn depth_in_arc(piece: &Piece<'_>, above_goal: u32, unit: u32) -> i64 {
    if piece.is_whole_circle() {
        return i64::MAX;
    }
    let above = i64::from(above_goal.wrapping_sub(piece.from));
    let width = i64::from(piece.width);
    let beyond = above.wrapping_sub(width);
    // Outside of the arc the nearer end counts.
    let depth = if beyond <= 0 {
        above.min(beyond.wrapping_neg())
    } else {
        beyond.min((1i64 << 32).wrapping_sub(above)).wrapping_neg()
    };
    // 2 pi 10^6 2^28 / 2^32.
    depth
        .wrapping_sub(ARC_SLACK.into())
        .wrapping_mul(392_699)
        .wrapping_shr(unit)
}

/// Returns `Ok` if the pieces together contain the set, or the offset of a pose for which no piece was found. `None` without a
/// search: the layout has one piece, or the set is far too wide.
fn search(facets: &Facets<'_>, placed: &Placed) -> Option<Result<(), [i64; 3]>> {
    if !parts::UNIONS {
        return None;
    }
    facets.pieces().nth(1).filter(|_| placed.yaw <= ONE_TURN)?;
    let mut search = Search {
        placed,
        facets,
        range: [-(1 << U), 1 << U],
        steps: MOST_UNION_STEPS,
        choice: facets.steps_of_choice(),
        lost: At { x: 0, y: 0, u: 0 },
    };
    search.lost = search.centre(0);
    let mut from = -(1 << U);
    let is_covered = search.cuts().is_some_and(|cuts| {
        cuts.ends().all(|to| {
            search.range = [from, to];
            from = to;
            search.is_covered()
        })
    });
    let lost = search.lost;
    Some(if is_covered {
        Ok(())
    } else {
        Err(placed.offset_of([lost.x, lost.y], lost.u))
    })
}

/// Ends of arcs among the headings of a set, ascending, u times 2^15.
struct Cuts {
    ends: [i32; MOST_CUTS],
    count: usize,
}

impl Cuts {
    /// Adds an end between -1 and 1. Returns `false` if there are too many.
    fn add(&mut self, mut end: i32) -> bool {
        if end.unsigned_abs() >= 1 << U || self.ends().any(|known| known == end) {
            return true;
        }
        for known in self.ends.iter_mut().take(self.count) {
            if end < *known {
                core::mem::swap(known, &mut end);
            }
        }
        self.ends.get_mut(self.count).is_some_and(|free| {
            *free = end;
            self.count = self.count.wrapping_add(1);
            true
        })
    }

    /// The ends, and 1 after the last.
    fn ends(&self) -> impl Iterator<Item = i32> + '_ {
        let known = self.ends.iter().take(self.count).copied();
        known.chain(core::iter::once(1 << U))
    }
}

/// A facet with the point that it restricts.
#[derive(Clone, Copy, Debug)]
struct Bound {
    facet: Facet,
    axes: Axes,
    point: [i32; 2],
}

/// A pose: relative to the goal in world axes, length units times 2^14, and its u, 2^-15.
#[derive(Clone, Copy, Debug)]
struct At {
    x: i64,
    y: i64,
    u: i32,
}

/// A pose-set, a range of its headings, and the remaining number of slabs.
struct Search<'a> {
    placed: &'a Placed,
    facets: &'a Facets<'a>,
    /// u of the first and the last heading, 2^-15.
    range: [i32; 2],
    /// Number of steps that remain ([`MOST_UNION_STEPS`]).
    steps: u32,
    /// Number of steps of the choice of a piece.
    choice: u32,
    /// The last pose for which a piece was searched.
    lost: At,
}

impl<'a> Search<'a> {
    /// Returns `true` if the pieces together contain the set at the headings of the range.
    fn is_covered(&mut self) -> bool {
        let [from, to] = self.range;
        let at = self.centre(from.wrapping_add(to) >> 1);
        let Some((first, piece)) = self.deepest(at, &[]) else {
            return false;
        };
        self.all_of(&piece, |search, bound| match search.holds(bound, &[]) {
            Ok(()) => true,
            Err(at) => search.cap_is_covered(first, bound, at),
        })
    }

    /// Returns `true` if the other pieces contain the part of the set beyond a facet of piece number `first`; `at` is a pose there.
    #[inline(never)]
    fn cap_is_covered(&mut self, first: usize, beyond: Bound, at: At) -> bool {
        let Some((second, piece)) = self.deepest(at, &[first]) else {
            return false;
        };
        self.all_of(&piece, |search, bound| {
            match search.holds(bound, &[beyond]) {
                Ok(()) => true,
                Err(at) => search.rest_is_covered([first, second], [beyond, bound], at),
            }
        })
    }

    /// Returns `true` if one other piece contains the part of the set beyond both facets.
    #[inline(never)]
    fn rest_is_covered(
        &mut self,
        known: [usize; MOST_BEYOND],
        beyond: [Bound; MOST_BEYOND],
        at: At,
    ) -> bool {
        let Some((_, piece)) = self.deepest(at, &known) else {
            return false;
        };
        self.all_of(&piece, |search, bound| {
            let held = search.holds(bound, &beyond);
            held.map_err(|at| search.lost = at).is_ok()
        })
    }

    /// Returns `true` if `test` accepts every facet of a piece that the cheapest test does not accept for the whole set.
    fn all_of(&mut self, piece: &Piece<'_>, test: impl Fn(&mut Self, Bound) -> bool) -> bool {
        piece.frames().all(|frame| {
            frame.facets().all(|facet| {
                let bound = Bound {
                    facet,
                    axes: frame.axes,
                    point: [i32::from(frame.x), i32::from(frame.y)],
                };
                bound.holds_easily(self.placed) || test(self, bound)
            })
        })
    }

    /// Returns the centre of the set's section.
    fn centre(&self, u: i32) -> At {
        let [[fx, fy], ..] = self.placed.columns;
        let along = [fx, fy].map(|f| product(f, u) >> U);
        self.at(along, u)
    }

    /// Returns a pose at an offset from the estimate, extent units.
    fn at(&self, [x, y]: [i64; 2], u: i32) -> At {
        let [from_x, from_y] = self.placed.place.map(|v| i64::from(v) << 14);
        At {
            x: from_x.wrapping_add(x.wrapping_shl(self.placed.down)),
            y: from_y.wrapping_add(y.wrapping_shl(self.placed.down)),
            u,
        }
    }

    /// Returns the piece, except those in `not`, that contains the range of headings and in which a pose is deepest. `None` if no piece
    /// contains the range, or if no steps remain.
    #[inline(never)]
    fn deepest(&mut self, at: At, not: &[usize]) -> Option<(usize, Piece<'a>)> {
        self.lost = at;
        self.steps = self.steps.checked_sub(self.choice)?;
        let turn = self.placed.heading_at(at.u).cos_sin_q30();
        let mut best = None;
        let mut most = OUTSIDE;
        for (number, piece) in (0..usize::MAX).zip(self.facets.pieces()) {
            if !not.contains(&number)
                && self.is_in_arc(&piece)
                && let Some(depth) = depth_in(&piece, at, turn, most)
            {
                (best, most) = (Some((number, piece)), depth);
            }
        }
        best
    }

    /// Returns `Ok` if a facet holds for all poses of the set within the range of headings that are beyond all facets of `beyond`. The
    /// error is a pose that may be beyond the facet.
    #[inline(never)]
    fn holds(&mut self, bound: Bound, beyond: &[Bound]) -> Result<(), At> {
        let [from, to] = self.range;
        let first = self.placed.first;
        let (mut width, mut index) = (first, 0u32);
        loop {
            let e = middle_of(index, width.depth);
            let h = width.in_u();
            let is_empty = e.wrapping_add(h) <= from || e.wrapping_sub(h) >= to;
            if !is_empty {
                if self.steps == 0 {
                    return Err(self.centre(e));
                }
                let found = self.slab_holds(bound, beyond, e, &width);
                if found != Slab::Inside {
                    let is_within = from <= e && e <= to;
                    if width.depth >= DEEPEST || is_within && found == Slab::Outside {
                        return Err(self.outermost(bound, beyond, e));
                    }
                    index = index.wrapping_mul(2);
                    width = width.halved();
                    continue;
                }
            }
            let Some(next) = next_of(&mut index, width.depth, first.depth) else {
                return Ok(());
            };
            if next != width.depth {
                width = first.halved_to(next);
            }
        }
    }

    /// As [`Search::holds`], within a slab. `Outside` if a pose of the middle section is beyond all of them, to within the weights.
    #[inline(never)]
    fn slab_holds(&mut self, bound: Bound, beyond: &[Bound], e: i32, width: &Width) -> Slab {
        let own = bound.section(self.placed, e, width);
        // Most facets hold for the whole set. In a half of the slab, the best sum decides at least as well, apart from rounding.
        if width.depth == self.placed.first.depth || beyond.is_empty() {
            let found = self.slab(&own, e, width);
            if found == Slab::Inside || beyond.is_empty() {
                return found;
            }
        }
        // The poses beyond all of them form a polygon at each heading. If the set's section, which is convex, does not meet it, two of
        // its sides show that.
        let mut found = Slab::Unsure;
        let mut first: Option<Section> = None;
        for other in beyond {
            let other = other.section(self.placed, e, width);
            found = self.sum_holds(&own, &other, e, width);
            if found == Slab::Inside
                || first
                    .is_some_and(|first| self.sum_holds(&first, &other, e, width) == Slab::Inside)
            {
                return Slab::Inside;
            }
            first = Some(other);
        }
        if found == Slab::Outside && first.is_some_and(|last| !self.is_beyond(&own, &last, e)) {
            return Slab::Unsure;
        }
        found
    }

    /// Returns the result of a slab's test of a section, which takes a step.
    fn slab(&mut self, section: &Section, e: i32, width: &Width) -> Slab {
        self.steps = self.steps.saturating_sub(1);
        section.slab(self.placed, e, width)
    }

    /// Returns `Inside` if no pose of a slab is beyond both facets, by their best weighted sum.
    #[inline(never)]
    fn sum_holds(&mut self, first: &Section, second: &Section, e: i32, width: &Width) -> Slab {
        let sum = self.sum(first, second, e, true);
        self.slab(&sum, e, width)
    }

    /// Returns `true` if a pose of a section is beyond both facets, to within the weight of their best sum there.
    #[inline(never)]
    fn is_beyond(&self, first: &Section, second: &Section, e: i32) -> bool {
        self.sum(first, second, e, false).is_outside(&self.root(e))
    }

    /// Returns the weighted sum that says most about the poses beyond both facets, over a slab or (for 0) at its middle.
    fn sum(&self, first: &Section, second: &Section, e: i32, is_slab: bool) -> Section {
        let weight = first.weight(second, self.root(e).low(), is_slab);
        first.weighed(second, weight)
    }

    /// Returns the pose of a section that is farthest beyond the facets, by the best weighted sum of the first and the last.
    #[inline(never)]
    fn outermost(&self, bound: Bound, beyond: &[Bound], e: i32) -> At {
        let width = &self.placed.first;
        let own = bound.section(self.placed, e, width);
        let section = match beyond.last() {
            Some(last) => self.sum(&own, &last.section(self.placed, e, width), e, false),
            None => own,
        };
        self.farthest(&section, e)
    }

    /// Returns `sqrt(1 - e^2)`; for a cylinder 1.
    fn root(&self, e: i32) -> Root {
        self.placed.root(e)
    }

    /// Returns the pose of a section that is farthest along its facet's normal.
    fn farthest(&self, section: &Section, e: i32) -> At {
        self.at(section.farthest(self.placed, e).map(|v| v >> U), e)
    }

    /// Returns the ends of the pieces' arcs among the set's headings; `None` if there are too many.
    fn cuts(&self) -> Option<Cuts> {
        let mut cuts = Cuts {
            ends: [0; MOST_CUTS],
            count: 0,
        };
        for piece in self
            .facets
            .pieces()
            .filter(|piece| !piece.is_whole_circle())
        {
            for [from, to] in self.arcs(&piece) {
                if !(cuts.add(from) && cuts.add(to)) {
                    return None;
                }
            }
        }
        Some(cuts)
    }

    /// Returns `true` if the headings of the range lie in a piece's arc.
    fn is_in_arc(&self, piece: &Piece<'_>) -> bool {
        if piece.is_whole_circle() {
            return true;
        }
        let reach = self.reach();
        let [first, last] = self.range.map(|u| i64::from(u).wrapping_mul(reach));
        self.turned_arcs(piece)
            .iter()
            .any(|[from, to]| from.wrapping_shl(U) <= first && last <= to.wrapping_shl(U))
    }

    /// Returns the largest heading offset, 2^-32 turn.
    fn reach(&self) -> i64 {
        (i64::from(self.placed.yaw) << 8).max(1)
    }

    /// Returns a piece's arc relative to the estimate's heading, less its slack, 2^-32 turn: as it is, and a turn below and above.
    fn turned_arcs(&self, piece: &Piece<'_>) -> [[i64; 2]; 3] {
        let from = i64::from(piece.from.wrapping_sub(self.placed.above_goal));
        let slack = i64::from(ARC_SLACK).wrapping_add(self.placed.swing());
        [-1i64, 0, -2].map(|turns| {
            let from = from.wrapping_add(turns << 32);
            let to = from.wrapping_add(i64::from(piece.width));
            [from.wrapping_add(slack), to.wrapping_sub(slack)]
        })
    }

    /// Returns a piece's arc as ranges of u, 2^-15, within the arc: as it is, and a turn below and above.
    fn arcs(&self, piece: &Piece<'_>) -> [[i32; 2]; 3] {
        let reach = Divisor::new(self.reach());
        self.turned_arcs(piece).map(|[from, to]| {
            // Towards the middle of the arc: up at its start, down at its end.
            let down = |v: i64| reach.map_or(0, |by| by.floor(v.wrapping_shl(U)));
            let up = |v: i64| down(v.wrapping_neg()).wrapping_neg();
            [up(from), down(to)].map(|v| v.clamp(-(1 << 17), 1 << 17) as i32)
        })
    }
}

/// Returns the depth of a pose in a piece: the least slack of its facets, length units times 2^28. `None` unless it is above `least`.
/// `turn` is the cosine and sine of the pose's heading, 2^-30.
#[inline(never)]
fn depth_in(piece: &Piece<'_>, at: At, [c, s]: [i32; 2], least: i64) -> Option<i64> {
    let mut depth = i64::MAX;
    for frame in piece.frames() {
        let [px, py] = [frame.x, frame.y].map(|v| i32::from(v) << 14);
        // A point is at most 2^29 from the goal on each axis, so all vectors fit into 32 bits.
        let [ax, ay] = [at.x, at.y].map(|v| v.clamp(-FARTHEST, FARTHEST) as i32);
        let turned = |x: i32, y: i32, s: i32| {
            let x_at = product(c, x).wrapping_sub(product(s, y)) >> 30;
            let y_at = product(s, x).wrapping_add(product(c, y)) >> 30;
            [x_at as i32, y_at as i32]
        };
        let [x, y] = match frame.axes {
            Axes::World => {
                let [x, y] = turned(px, py, s);
                [x.wrapping_add(ax), y.wrapping_add(ay)]
            }
            Axes::Robot => turned(ax.wrapping_sub(px), ay.wrapping_sub(py), s.wrapping_neg()),
        };
        for facet in frame.facets() {
            let along = product(facet.x.into(), x).wrapping_add(product(facet.y.into(), y));
            depth = depth.min((i64::from(facet.b) << 28).wrapping_sub(along));
            if depth <= least {
                return None;
            }
        }
    }
    Some(depth)
}

impl Bound {
    /// Returns `true` if the cheapest test accepts the bound for the whole set.
    #[inline(never)]
    fn holds_easily(&self, placed: &Placed) -> bool {
        let seen = placed.seen_at(self.axes, self.point, &placed.middle(0), &placed.first);
        placed.spare(self.facet, &seen) >= placed.enough(&seen)
            || placed.holds_at_any_heading(self.facet, &seen)
    }

    fn section(&self, placed: &Placed, e: i32, width: &Width) -> Section {
        let at = placed.middle(e);
        let seen = placed.seen_at(self.axes, self.point, &at, width);
        Section::of(self.facet, &seen, placed, &at, width)
    }
}

impl Section {
    /// Returns the section of `(1 - weight) self + weight other`, the weight in 2^-12.
    #[inline(never)]
    pub(super) fn weighed(&self, other: &Self, weight: i32) -> Self {
        let turns = self.turns || other.turns;
        let own = (1i32 << WEIGHT_BITS).wrapping_sub(weight);
        let sum = |a: i32, b: i32| product(a, own).wrapping_add(product(b, weight));
        let nearest =
            |a: i32, b: i32| (sum(a, b).wrapping_add(1 << (WEIGHT_BITS - 1)) >> WEIGHT_BITS) as i32;
        let down = |a: i32, b: i32| (sum(a, b) >> WEIGHT_BITS) as i32;
        let pair = |[a, b]: [i32; 2], [c, d]: [i32; 2]| [nearest(a, c), nearest(b, d)];
        Self {
            left: down(self.left, other.left).wrapping_sub(rounding_of_a_sum(turns)),
            c: down(self.c, other.c),
            s: nearest(self.s, other.s),
            slope: nearest(self.slope, other.slope),
            bend: nearest(self.bend, other.bend),
            along: pair(self.along, other.along),
            ahead: pair(self.ahead, other.ahead),
            normal: pair(self.normal, other.normal),
            turns,
            // The length of a sum of a fixed and a turning normal changes.
            bends: self.bends || other.bends || self.turns != other.turns,
        }
    }

    /// Returns the weight of another section, 2^-12, from 0 to 1, with which the sum says most about the poses beyond the
    /// other: over a slab of half width `half`, or at its middle alone for 0. Any weight from 0 to 1 is sound.
    ///
    /// With p and q the reaches of both facets along the other two columns, f and g their changes from the middle of the slab to its
    /// end, and d the slack of the other at the middle, the largest value of `first + lambda other` over the slab is, up to a constant,
    /// `|p + lambda q| + |f + lambda g| - lambda d`. It is least at one of:
    ///
    /// - the lambda with `p + lambda q` at an angle to q whose cosine is `(d - g) / |q|`, if `f + lambda g >= 0` there;
    /// - the same with `(d + g) / |q|`, if `f + lambda g <= 0` there;
    /// - `lambda = -f / g` otherwise.
    ///
    /// The growth by a movement is left out: a set that has grown far is denied by a union sooner than needed. The signs are such that `f >= 0`. Twelve bits of each vector are enough: near its least value the sum hardly depends on lambda.
    #[inline(never)]
    fn weight(&self, other: &Self, root: i32, is_slab: bool) -> i32 {
        let reach = |section: &Self| {
            let [a, b] = section.along.map(|v| v.wrapping_mul(root) >> U);
            [if is_slab { section.slope } else { 0 }, a, b]
        };
        let left = i64::from(other.left);
        let (p, q) = (reach(self), reach(other));
        let largest = |v: [i32; 3]| v.iter().fold(1u32, |most, v| most | v.unsigned_abs());
        let far = i64::from(largest(q)) << 2;
        if left >= far {
            return 1 << WEIGHT_BITS;
        }
        if left <= far.wrapping_neg() {
            return 0;
        }
        // Each to 12 bits, with a scale of its own.
        let bits = |v: [i32; 3]| 20u32.saturating_sub(largest(v).leading_zeros());
        let (by_p, by_q) = (bits(p), bits(q));
        let left = (left >> by_q) as i32;
        let [rise, px, py] = p.map(|v| v >> by_p);
        let [slope, qx, qy] = q.map(|v| v >> by_q);
        // At the other end of the slab both slopes have the other sign.
        let (rise, slope) = if rise < 0 {
            (rise.wrapping_neg(), slope.wrapping_neg())
        } else {
            (rise, slope)
        };
        let pq = px.wrapping_mul(qx).wrapping_add(py.wrapping_mul(qy));
        let qq = qx.wrapping_mul(qx).wrapping_add(qy.wrapping_mul(qy));
        let across = px.wrapping_mul(qy).wrapping_sub(py.wrapping_mul(qx));
        // lambda |q|^2, at most [`FAR`], if the other facet has this slack.
        let best = |left: i32| {
            let open = qq.wrapping_sub(left.wrapping_mul(left));
            if open <= 0 {
                return if left < 0 { 0 } else { FAR };
            }
            let open = sqrt_ceil(open.unsigned_abs().into()) as u32;
            // 2^18 * 2^12.5.
            let sum = (across.unsigned_abs() >> 7)
                .wrapping_mul(left.unsigned_abs())
                .checked_div(open)
                .unwrap_or(0)
                .min(FAR.unsigned_abs() >> 7)
                .wrapping_shl(7) as i32;
            let sum = if left < 0 { sum.wrapping_neg() } else { sum };
            sum.wrapping_sub(pq).clamp(0, FAR)
        };
        let rises = |sum: i32| product(rise, qq).wrapping_add(product(slope, sum));
        let (mut sum, mut whole) = (best(left.wrapping_sub(slope)), qq);
        if rises(sum) < 0 {
            sum = best(left.wrapping_add(slope));
            if rises(sum) > 0 {
                (sum, whole) = (rise, slope.wrapping_neg());
            }
        }
        // lambda / (1 + lambda), with lambda in the same scale as 1.
        let apart = by_p.abs_diff(by_q).min(31);
        if by_p > by_q {
            whole = whole.wrapping_shr(apart);
        } else {
            sum = sum.wrapping_shr(apart);
        }
        let all = sum.wrapping_add(whole).unsigned_abs().max(1);
        let down = 20u32.saturating_sub(all.leading_zeros());
        sum.unsigned_abs()
            .wrapping_shr(down)
            .wrapping_shl(WEIGHT_BITS)
            .checked_div(all.wrapping_shr(down))
            .map_or(0, |share| share.min(1 << WEIGHT_BITS) as i32)
    }
}
