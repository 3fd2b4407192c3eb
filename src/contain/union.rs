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
//! exact). Both sides are sums of terms that [`super::heading`] bounds slab by slab, so the numbers of two facets
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
//! the nearest, and the clearance of the proof of a table (it raises both b). Adding up rounds each number to
//! the nearest fine unit: at most 3.6 units of a bound (left, C, S, G and their products, and two coordinates along the
//! normal and ahead of it, 0.71 each). [`WEIGHED`] covers that at each sum. The bounds only require that the
//! numbers of a facet's section are linear in its normal, its offset and its point. Two numbers are not: the part of G in robot axes and
//! the part of `along` in world axes. They are carried separately from the sum, the latter rounded up.

use super::heading::{Root, Section, Slab, Sweep, Width};
use crate::num::{Divisor, product, sqrt_ceil, towards_zero};
use crate::parts;
use crate::pose::Pose;
use crate::set::PoseSet;
use crate::table::{Axes, Facet, Facets, MOST_UNION_STEPS, Piece};

/// Most by which rounding in a weighted sum of two sections can lower a bound, fine units.
const WEIGHED: i64 = 4;
/// Fraction bits of a weight.
const WEIGHT_BITS: u32 = 12;
/// An upper limit of lambda times a square of 25 bits, in [`Section::weight`]; two of them fit into 31 bits.
const FAR: i32 = 1 << 29;
/// Fraction bits of u.
const U: u32 = 15;
/// Largest number of halvings of the range of u.
const DEEPEST: u32 = 6;
/// A pose farther than this outside of every piece is outside of the union: length units, times 2^28.
const OUTSIDE: i64 = -(4 << 28);
/// A pose that is farther than this on an axis is treated as at this coordinate by the choice of a piece: length units times 2^14. A
/// choice is no proof. Points and offsets of a table have 16 bits, so that few poses in it are farther.
const FARTHEST: i64 = 7 << 27;
// From the farthest point to the farthest pose, in any direction, is less than 2^31.
const _: () = assert!(2 * (FARTHEST + (1 << 29)) * (FARTHEST + (1 << 29)) < 1 << 62);
/// Slack of an arc, 2^-32 turn, as for a single piece.
const ARC_SLACK: i64 = 3;
/// Largest number of facets that a pose is beyond, in the search, when another piece must contain it.
const MOST_BEYOND: usize = 2;
/// Largest number of ends of arcs among the headings of a set. With more, the set is denied.
const MOST_CUTS: usize = 6;

/// Returns `true` if the pieces together contain every pose of the set; `false` if that is not shown.
#[inline(never)]
pub(super) fn covers(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> bool {
    search(facets, set, goal) == Some(Ok(()))
}

/// Returns a pose of the set for which the search found no piece: relative to the estimate, in world axes: um, um, 2^-24 turn. `None`
/// for a layout of one piece and a set that is covered or too wide. For reports.
#[inline(never)]
pub(super) fn witness(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> Option<[i64; 3]> {
    search(facets, set, goal)?.err()
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
        .wrapping_sub(ARC_SLACK)
        .wrapping_mul(392_699)
        .wrapping_shr(unit)
}

/// Returns `Ok` if the pieces together contain the set, or the offset of a pose for which no piece was found. `None` without a
/// search: the layout has one piece, or the set is far too wide.
fn search(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> Option<Result<(), [i64; 3]>> {
    if !parts::UNIONS {
        return None;
    }
    facets.pieces().nth(1)?;
    let sweep = Sweep::of(facets, set, goal).filter(|sweep| sweep.yaw <= 1 << 24)?;
    let sweep = sweep.with_disc();
    let mut search = Search {
        sweep: &sweep,
        facets,
        above_goal: set.mean().yaw.minus(goal.yaw).0,
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
        Err(sweep.offset_of([lost.x, lost.y], lost.u))
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
    sweep: &'a Sweep,
    facets: &'a Facets<'a>,
    above_goal: u32,
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
            let broadly = self.sweep.broadly(&frame);
            frame.facets().all(|facet| {
                let bound = Bound {
                    facet,
                    axes: frame.axes,
                    point: [i32::from(frame.x), i32::from(frame.y)],
                };
                broadly.hold(facet) || test(self, bound)
            })
        })
    }

    /// Returns the centre of the set's section.
    fn centre(&self, u: i32) -> At {
        let [[fx, fy], ..] = self.sweep.columns;
        let moved = |at: i32, f: i32| (i64::from(at) << 14).wrapping_add(product(f, u) >> U);
        At {
            x: moved(self.sweep.x, fx),
            y: moved(self.sweep.y, fy),
            u,
        }
    }

    /// Returns the piece, except those in `not`, that contains the range of headings and in which a pose is deepest. `None` if no piece
    /// contains the range, or if no steps remain.
    #[inline(never)]
    fn deepest(&mut self, at: At, not: &[usize]) -> Option<(usize, Piece<'a>)> {
        self.lost = at;
        self.steps = self.steps.checked_sub(self.choice)?;
        let turn = self.sweep.turned_to(at.u);
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
        let sweep = self.sweep;
        let [from, to] = self.range;
        let first = sweep.first_depth();
        let (mut depth, mut index) = (first, 0u32);
        let mut width = sweep.width(depth);
        loop {
            let middle = index
                .wrapping_mul(2)
                .wrapping_add(1)
                .wrapping_mul(width.in_u.unsigned_abs());
            let e = (middle as i32).wrapping_sub(1 << U);
            let is_empty = e.wrapping_add(width.in_u) <= from || e.wrapping_sub(width.in_u) >= to;
            if !is_empty {
                if self.steps == 0 {
                    return Err(self.centre(e));
                }
                let found = self.slab_holds(bound, beyond, e, &width, depth == first);
                if found != Slab::Inside {
                    let is_within = from <= e && e <= to;
                    if depth >= DEEPEST || is_within && found == Slab::Outside {
                        return Err(self.outermost(bound, beyond, e));
                    }
                    depth = depth.wrapping_add(1);
                    index = index.wrapping_mul(2);
                    width = sweep.width(depth);
                    continue;
                }
            }
            // The next slab: up from each second half.
            let was = depth;
            while depth > first && index & 1 == 1 {
                depth = depth.wrapping_sub(1);
                index >>= 1;
            }
            index = index.wrapping_add(1);
            if index.wrapping_shr(depth) != 0 {
                return Ok(());
            }
            if depth != was {
                width = sweep.width(depth);
            }
        }
    }

    /// As [`Search::holds`], within a slab. `Outside` if a pose of the middle section is beyond all of them, to within the weights.
    #[inline(never)]
    fn slab_holds(
        &mut self,
        bound: Bound,
        beyond: &[Bound],
        e: i32,
        width: &Width,
        is_first: bool,
    ) -> Slab {
        let own = bound.section(self.sweep, e);
        // Most facets hold for the whole set. In a half of the slab, the best sum decides at least as well, apart from rounding.
        if is_first || beyond.is_empty() {
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
            let other = other.section(self.sweep, e);
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
        section.slab(self.sweep, e, width)
    }

    /// Returns `Inside` if no pose of a slab is beyond both facets, by their best weighted sum.
    #[inline(never)]
    fn sum_holds(&mut self, first: &Section, second: &Section, e: i32, width: &Width) -> Slab {
        let sum = self.sum(first, second, e, width.in_u);
        self.slab(&sum, e, width)
    }

    /// Returns `true` if a pose of a section is beyond both facets, to within the weight of their best sum there.
    #[inline(never)]
    fn is_beyond(&self, first: &Section, second: &Section, e: i32) -> bool {
        let root = if self.sweep.radius.is_some() {
            Root::CYLINDER
        } else {
            Root::of(e)
        };
        self.sum(first, second, e, 0).is_outside(&root)
    }

    /// Returns the weighted sum that says most about the poses beyond both facets, over a slab or (for 0) at its middle.
    fn sum(&self, first: &Section, second: &Section, e: i32, half: i32) -> Section {
        let weight = first.weight(second, self.sweep.turn(), self.root(e), half);
        first.weighed(second, weight)
    }

    /// Returns the pose of a section that is farthest beyond the facets, by the best weighted sum of the first and the last.
    #[inline(never)]
    fn outermost(&self, bound: Bound, beyond: &[Bound], e: i32) -> At {
        let own = bound.section(self.sweep, e);
        let section = match beyond.last() {
            Some(last) => self.sum(&own, &last.section(self.sweep, e), e, 0),
            None => own,
        };
        self.farthest(&section, e)
    }

    /// Returns `sqrt(1 - e^2)`, 2^-15; for a cylinder 1.
    fn root(&self, e: i32) -> i64 {
        if self.sweep.radius.is_some() {
            1 << U
        } else {
            i64::from(Root::of(e).low())
        }
    }

    /// Returns the pose of a section that is farthest along its facet's normal.
    fn farthest(&self, section: &Section, e: i32) -> At {
        let centre = self.centre(e);
        let [a, b] = section.along.map(i64::from);
        let length = sqrt_ceil(squares(a, b)).max(1);
        let share = |v: i64| towards_zero(v.wrapping_mul(self.root(e)), length);
        let (a, b) = (share(a), share(b));
        let [_, [x2, y2], [x3, y3]] = self.sweep.columns;
        let along = |second: i32, third: i32| {
            let sum = i64::from(second).wrapping_mul(a);
            sum.wrapping_add(i64::from(third).wrapping_mul(b)) >> U
        };
        At {
            x: centre.x.wrapping_add(along(x2, x3)),
            y: centre.y.wrapping_add(along(y2, y3)),
            u: e,
        }
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
        (i64::from(self.sweep.yaw) << 8).max(1)
    }

    /// Returns a piece's arc relative to the estimate's heading, less its slack, 2^-32 turn: as it is, and a turn below and above.
    fn turned_arcs(&self, piece: &Piece<'_>) -> [[i64; 2]; 3] {
        let from = i64::from(piece.from.wrapping_sub(self.above_goal));
        let slack = ARC_SLACK.wrapping_add(self.sweep.swing());
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
    fn section(&self, sweep: &Sweep, e: i32) -> Section {
        sweep.section(self.facet, self.axes, self.point, e)
    }
}

impl Section {
    /// Returns the section of `(1 - weight) self + weight other`, the weight in 2^-12.
    #[inline(never)]
    fn weighed(&self, other: &Self, weight: i32) -> Self {
        let own = (1i32 << WEIGHT_BITS).wrapping_sub(weight);
        let rounded = |sum: i64| sum.wrapping_add(1 << (WEIGHT_BITS - 1)) >> WEIGHT_BITS;
        let wide = |a: i64, b: i64| {
            let (own, weight) = (i64::from(own), i64::from(weight));
            rounded(a.wrapping_mul(own).wrapping_add(b.wrapping_mul(weight)))
        };
        let sum = |a: i32, b: i32| rounded(product(a, own).wrapping_add(product(b, weight))) as i32;
        let turns = self.turns || other.turns;
        // The part that does not turn, among normals that turn.
        let still = |section: &Self| {
            if section.turns || !turns {
                return i64::from(section.still);
            }
            let [a, b] = section.along.map(i64::from);
            sqrt_ceil(squares(a, b)).wrapping_add(2)
        };
        let still = match [still(self), still(other)] {
            [0, 0] => 0,
            [own, other] => wide(own, other).wrapping_add(1),
        };
        let mut numbers = self.numbers();
        for (number, other) in numbers.iter_mut().zip(other.numbers()) {
            *number = sum(*number, other);
        }
        let [c, s, g, h, g_turning, ax, ay, bx, by, nx, ny] = numbers;
        Self {
            left: wide(self.left, other.left).wrapping_sub(WEIGHED),
            c,
            s,
            g,
            h,
            g_turning,
            still: still as u32,
            along: [ax, ay],
            ahead: [bx, by],
            normal: [nx, ny],
            turns,
        }
    }

    /// Returns the numbers that are weighed in the same way.
    #[inline(always)]
    const fn numbers(&self) -> [i32; 11] {
        let ([ax, ay], [bx, by], [nx, ny]) = (self.along, self.ahead, self.normal);
        let Self {
            c,
            s,
            g,
            h,
            g_turning,
            ..
        } = *self;
        [c, s, g, h, g_turning, ax, ay, bx, by, nx, ny]
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
    /// The signs are such that `f >= 0`. Twelve bits of each vector are enough: near its least value the sum hardly depends on lambda.
    #[inline(never)]
    fn weight(&self, other: &Self, turn: i64, root: i64, half: i32) -> i32 {
        let reach = |section: &Self| {
            let [a, b] = section.along.map(|v| (product(v, root as i32) >> U) as i32);
            let slope = product(turn as i32, section.s) >> 28;
            // Halved to fit, up to an offset of 5.6 rad. Beyond, the weight can be a bad one, which costs a permit only.
            let slope = i64::from(section.g).wrapping_add(slope) >> 1;
            [(product(slope as i32, half) >> (U - 1)) as i32, a, b]
        };
        let left = other.left.wrapping_sub(i64::from(other.c));
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

fn squares(a: i64, b: i64) -> u64 {
    let (a, b) = (a.unsigned_abs(), b.unsigned_abs());
    a.wrapping_mul(a).wrapping_add(b.wrapping_mul(b))
}

#[cfg(test)]
mod tests;
