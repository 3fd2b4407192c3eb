//! The proof of a facet layout.
//!
//! For every heading of a piece's arc, the polygon that its facets bound at that heading must lie in the success set.
//! The set (convex at a fixed heading) contains the polygon if it contains its corners. (If the set is not convex, one
//! convex part of it must contain the piece: the part with the largest slack at the piece's corners is used.) A corner
//! is the intersection of two facets. For every pair, and over the whole arc, either some other facet cuts the
//! intersection off, or the point is proven inside. Facets turn with the heading, so intersections move: values and
//! slopes are enclosed, and the arc is halved where that is not sharp enough. Two facets that turn relative to each
//! other are parallel at some heading and intersect at infinity there. Intersections are therefore kept as `(X, Y, W)`,
//! the point being `(X, Y) / W`. Every offset is increased by the bound of the decision's rounding error
//! ([`crate::contain::facet_clearance_q14`]).

use crate::certify::{Interval, PartProver, Prover, Slope, goal_cos_sin, sharp};
use crate::contain::facet_clearance_q14;
use crate::shape::{ALL, NONE, Planar, Scalar, Selection, SuccessSet};
use crate::table::{Axes, Facet, Facets};
use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, Ordering};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::rc::Rc;

/// A facet that is not proven.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, thiserror::Error)]
#[error("facet {facet} of frame {frame} of piece {piece}")]
pub struct UnprovenFacet {
    /// Index of the piece.
    pub piece: usize,
    /// Index of the frame in the piece.
    pub frame: usize,
    /// Index of the facet in the frame.
    pub facet: usize,
}

/// Largest number of halvings of a part of an arc before a corner counts as not proven: down to two units. Near a
/// heading at which two facets are parallel their intersection diverges, so narrow ranges are needed there.
const DEEPEST: u32 = 24;
/// An arc is proven in parts of at most this width: about 2.8 degrees.
const PART: i64 = 1 << 25;

/// A facet with the numbers of its frame: metres, world axes about the goal.
pub(super) struct Line {
    at: UnprovenFacet,
    axes: Axes,
    integers: [i64; 2],
    normal: [f64; 2],
    b: Interval,
    point: [Interval; 2],
}

/// A facet at a heading: `x nx + y ny <= b`.
#[derive(Clone, Copy)]
pub(super) struct HalfPlane<S> {
    pub normal: [S; 2],
    pub b: S,
}

/// Returns those of some pieces that are not proven, in order, and how many corners were proven.
pub(super) fn unproven(
    layout: &Facets<'_>,
    success: &SuccessSet,
    among: &[usize],
) -> (Vec<usize>, u64) {
    let (mut pieces, mut corners) = (Vec::new(), 0);
    for part in each(layout, success, &|piece| among.contains(&piece), &|| ()) {
        match part {
            Ok(proven) => corners += proven,
            Err(facet) => pieces.push(facet.piece),
        }
    }
    pieces.sort_unstable();
    pieces.dedup();
    (pieces, corners)
}

/// Proves every piece; returns the number of corners evaluated.
///
/// # Errors
/// [`UnprovenFacet`]: the first facet that could not be proven.
pub(super) fn facets(
    layout: &Facets<'_>,
    success: &SuccessSet,
    progress: &(dyn Fn() + Sync),
) -> Result<u64, UnprovenFacet> {
    each(layout, success, &|_| true, progress).into_iter().sum()
}

/// Proves every part of the arcs of the wanted pieces.
fn each(
    layout: &Facets<'_>,
    success: &SuccessSet,
    wanted: &dyn Fn(usize) -> bool,
    progress: &(dyn Fn() + Sync),
) -> Vec<Result<u64, UnprovenFacet>> {
    let prover = Prover::new(success);
    let goal = goal_cos_sin(success.goal);
    let mut parts = Vec::new();
    let mut pieces = Vec::new();
    for (number, piece) in layout.pieces().enumerate() {
        if !wanted(number) {
            pieces.push((Vec::new(), prover.part(&[])));
            continue;
        }
        let lines = lines(layout, number);
        let from = i64::from(piece.from);
        let to = from
            + if piece.is_whole_circle() {
                1 << 32
            } else {
                i64::from(piece.width)
            };
        let first = UnprovenFacet {
            piece: number,
            ..UnprovenFacet::default()
        };
        let part = prover.part(&corners(&lines, goal, [from, to]));
        let turns = part.arc_holds([from, to]);
        pieces.push((lines, part));
        if !turns {
            parts.push((number, Err(first)));
            continue;
        }
        let count = ((to - from + PART - 1) / PART).max(1);
        parts.extend((0..count).map(|i| {
            let end = |i: i64| from + ((to - from) as i128 * i as i128 / count as i128) as i64;
            (number, Ok([end(i), end(i + 1)]))
        }));
    }
    let failed: Vec<AtomicBool> = pieces.iter().map(|_| AtomicBool::new(false)).collect();
    parts
        .into_par_iter()
        .map(|(piece, range)| {
            let range = range?;
            // A piece that has failed in one part of its arc need not be evaluated in the others.
            if failed[piece].load(Ordering::Relaxed) {
                return Ok(0);
            }
            let (lines, part) = &pieces[piece];
            let proof = Polygon {
                part,
                goal,
                lines,
                sights: RefCell::default(),
            };
            let corners = proof.hold(range);
            failed[piece].fetch_or(corners.is_err(), Ordering::Relaxed);
            progress();
            corners
        })
        .collect()
}

pub(super) fn lines(layout: &Facets<'_>, number: usize) -> Vec<Line> {
    // Powers of two and 1e-6: one rounding, enclosed.
    let length =
        Interval::point(f64::from(1u32 << layout.unit())) * Interval::point(1e6).reciprocal();
    let frames = layout
        .pieces()
        .nth(number)
        .into_iter()
        .flat_map(|p| p.frames());
    let mut lines = Vec::new();
    for (frame, entry) in frames.enumerate() {
        let turns = [entry.x, entry.y] != [0, 0];
        for (facet, Facet { x, y, b }) in entry.facets().enumerate() {
            let clearance = facet_clearance_q14(
                Facet { x, y, b },
                entry.axes,
                turns,
                layout.unit(),
                layout.lever(),
            );
            let b = Interval::point(f64::from(b) + clearance as f64 / 16_384.0);
            lines.push(Line {
                at: UnprovenFacet {
                    piece: number,
                    frame,
                    facet,
                },
                axes: entry.axes,
                integers: [x, y].map(i64::from),
                normal: [x, y].map(|v| f64::from(v) / 16_384.0),
                b: b * length,
                point: [entry.x, entry.y].map(|v| Interval::point(f64::from(v)) * length),
            });
        }
    }
    lines
}

/// A piece is sampled at headings of at most this distance, about 2.8 degrees, and at 5 headings at least, to choose a part of the
/// success set for it. Some pieces have poses only at a few of their headings.
const LOOK: i64 = 1 << 25;
const LEAST_LOOKS: i64 = 4;

/// Returns corners of a piece's polygon in the goal frame at a few headings: m, m, rad. They are approximate: no proof
/// depends on them.
fn corners(lines: &[Line], goal: [Interval; 2], [from, to]: [i64; 2]) -> Vec<[f64; 3]> {
    // Metres.
    const ROUNDING: f64 = 1e-7;
    let [gc, gs] = goal.map(Interval::middle);
    let mut found = Vec::new();
    let looks = ((to - from) / LOOK + 1).max(LEAST_LOOKS);
    for look in 0..=looks {
        let units = from + (to - from) * look / looks;
        let yaw = Interval::radians(units).middle();
        let (c, s) = (libm::cos(yaw), libm::sin(yaw));
        let turn = [gc * c - gs * s, gs * c + gc * s].map(Interval::point);
        let planes: Vec<([f64; 2], f64)> = lines
            .iter()
            .map(|line| line.at(turn))
            .map(|half| (half.normal.map(Interval::middle), half.b.middle()))
            .collect();
        for (i, ([ax, ay], a)) in planes.iter().enumerate() {
            for ([bx, by], b) in &planes[i + 1..] {
                let weight = ax * by - ay * bx;
                if weight.abs() < 1e-6 {
                    continue;
                }
                let (x, y) = ((a * by - b * ay) / weight, (b * ax - a * bx) / weight);
                let within = |(n, b): &([f64; 2], f64)| n[0] * x + n[1] * y <= b + ROUNDING;
                if planes.iter().all(within) {
                    found.push([gc * x + gs * y, gc * y - gs * x, yaw]);
                }
            }
        }
    }
    found
}

/// A piece's polygon, which changes with the heading.
struct Polygon<'a> {
    /// The part of the success set that must contain it.
    part: &'a PartProver,
    /// Cosine and sine of the goal's yaw.
    goal: [Interval; 2],
    lines: &'a [Line],
    /// Enclosures already computed, by range of headings.
    sights: RefCell<BTreeMap<[i64; 2], Rc<Sight>>>,
}

/// The lines over a range of headings, and at its middle.
struct Sight {
    offset: Interval,
    whole: Interval,
    middle: Interval,
    over: Vec<HalfPlane<Slope>>,
    mid: Vec<HalfPlane<Interval>>,
    /// The middles of `mid`: normal and b.
    plain: Vec<[f64; 3]>,
}

impl Polygon<'_> {
    /// Proves the polygon over a range of headings above the goal's.
    fn hold(&self, range: [i64; 2]) -> Result<u64, UnprovenFacet> {
        if !self.is_bounded(range, DEEPEST) {
            return Err(self.lines.first().map(|line| line.at).unwrap_or_default());
        }
        let mut corners = 0;
        for i in 0..self.lines.len() {
            for j in i + 1..self.lines.len() {
                // Parallel at every heading: they never intersect. If they coincide, the corners of that edge are those
                // with other facets.
                if self.lines[i].turns_with(&self.lines[j]) == Some(0.0) {
                    continue;
                }
                if !self.corner((i, j), range, ALL, DEEPEST) {
                    return Err(self.lines[i].at);
                }
                corners += 1;
            }
        }
        Ok(corners)
    }

    fn sight(&self, range: [i64; 2]) -> Rc<Sight> {
        if let Some(known) = self.sights.borrow().get(&range) {
            return known.clone();
        }
        let ends = range.map(Interval::radians);
        let whole = ends[0].hull(ends[1]);
        let middle = Interval::point(whole.middle());
        let turn = self.turn(Slope::cos_sin_of(whole));
        let turn_middle = self.turn(middle.cos_sin());
        let mid: Vec<_> = self.lines.iter().map(|line| line.at(turn_middle)).collect();
        let sight = Rc::new(Sight {
            offset: whole - middle,
            whole,
            middle,
            over: self.lines.iter().map(|line| line.at(turn)).collect(),
            plain: mid
                .iter()
                .map(|line| [line.normal[0], line.normal[1], line.b].map(Interval::middle))
                .collect(),
            mid,
        });
        self.sights.borrow_mut().insert(range, sight.clone());
        sight
    }

    /// Returns cosine and sine of the robot's heading in the world, from those of the heading above the goal's.
    fn turn<S: Enclosure>(&self, [cos, sin]: [S; 2]) -> [S; 2] {
        let [c, s] = self.goal.map(S::of);
        [c * cos - s * sin, s * cos + c * sin]
    }

    /// Returns `true` if the normals leave no half of the plane free at every heading of a range: the polygon is then
    /// bounded. It suffices that three or four of them go once around, each less than half a turn after the previous
    /// one.
    fn is_bounded(&self, range: [i64; 2], depth: u32) -> bool {
        let sight = self.sight(range);
        let ahead_of = |i: usize, j: usize| {
            let (over, mid) = (&sight.over, &sight.mid);
            sharp(
                cross(over[i].normal, over[j].normal),
                cross(mid[i].normal, mid[j].normal),
                sight.offset,
            )
            .lo > 0.0
        };
        let angle = |i: usize| {
            let [x, y] = sight.mid[i].normal.map(Interval::middle);
            libm::atan2(y, x).rem_euclid(core::f64::consts::TAU)
        };
        let count = self.lines.len();
        // From each line the farthest one that is certainly less than half a turn ahead.
        let mut at = 0;
        let mut turned = 0.0;
        for _ in 0..8 {
            if count == 0 {
                return false;
            }
            let ahead = |j: usize| (angle(j) - angle(at)).rem_euclid(core::f64::consts::TAU);
            let next = (0..count)
                .filter(|j| *j != at && ahead_of(at, *j))
                .max_by(|a, b| ahead(*a).total_cmp(&ahead(*b)));
            let Some(next) = next else {
                break;
            };
            let closes = turned > 0.0
                && turned + core::f64::consts::PI > core::f64::consts::TAU
                && ahead_of(at, 0);
            if closes {
                return true;
            }
            turned += ahead(next);
            at = next;
            if turned >= core::f64::consts::TAU {
                return true;
            }
        }
        if depth == 0 || range[1] - range[0] < 2 {
            return false;
        }
        halves(range)
            .into_iter()
            .all(|half| self.is_bounded(half, depth - 1))
    }

    /// Returns `true` if the intersection of two facets is proven to be cut off or inside, over a range of headings.
    /// `open` selects the set's constraints that are still to be proven.
    fn corner(
        &self,
        (i, j): (usize, usize),
        range: [i64; 2],
        mut open: Selection,
        depth: u32,
    ) -> bool {
        let sight = self.sight(range);
        let pair = [&self.lines[i], &self.lines[j]];
        let (over, mid) = (
            meeting(pair, [&sight.over[i], &sight.over[j]]),
            meeting(pair, [&sight.mid[i], &sight.mid[j]]),
        );
        let weight = sharp(over[2], mid[2], sight.offset);
        // Beyond another facet: a positive distance for a positive weight, a negative one otherwise. Only the facets
        // that cut most at the middle are evaluated.
        let point = mid.map(Interval::middle);
        let others = (0..self.lines.len()).filter(|k| *k != i && *k != j);
        let depths = others.map(|k| (about(sight.plain[k], point), k));
        let (least, most) = depths.fold(
            ((f64::INFINITY, i), (f64::NEG_INFINITY, i)),
            |(least, most), at| {
                (
                    if at.0 < least.0 { at } else { least },
                    if at.0 > most.0 { at } else { most },
                )
            },
        );
        let beyond = |k: usize| {
            sharp(
                beyond(&sight.over[k], over),
                beyond(&sight.mid[k], mid),
                sight.offset,
            )
        };
        let cut_above = weight.hi <= 0.0 || (most.0 > 0.0 && beyond(most.1).lo > 0.0);
        let cut_below = weight.lo >= 0.0 || (least.0 < 0.0 && beyond(least.1).hi < 0.0);
        if cut_above && cut_below {
            return true;
        }
        if weight.lo > 0.0 || weight.hi < 0.0 {
            let over = self.planar(over, reciprocal(over[2]), Slope::cos_sin_of(sight.whole));
            let mid_pose = self.planar(mid, mid[2].reciprocal(), sight.middle.cos_sin());
            open = self.part.unproven(&over, &mid_pose, sight.offset, open);
            if open == NONE {
                return true;
            }
            // A corner of the piece that is certainly outside: halving cannot help.
            if self.is_corner(mid, (i, j), &sight) && self.part.excludes(&mid_pose) {
                return false;
            }
        }
        if depth == 0 || range[1] - range[0] < 2 {
            return false;
        }
        halves(range)
            .into_iter()
            .all(|half| self.corner((i, j), half, open, depth - 1))
    }

    /// Returns `true` if the intersection of two facets at the middle of a range is certainly within all others.
    fn is_corner(&self, point: [Interval; 3], (i, j): (usize, usize), sight: &Sight) -> bool {
        (0..self.lines.len())
            .filter(|k| *k != i && *k != j)
            .all(|k| {
                let beyond = beyond(&sight.mid[k], point);
                if point[2].lo > 0.0 {
                    beyond.hi <= 0.0
                } else {
                    beyond.lo >= 0.0
                }
            })
    }

    /// Converts an intersection to a pose in the goal frame, given its weight's reciprocal, and the heading's cosine
    /// and sine.
    fn planar<S: Enclosure>(&self, [x, y, _]: [S; 3], inverse: S, [cos, sin]: [S; 2]) -> Planar<S> {
        let [c, s] = self.goal.map(S::of);
        let (x, y) = (x * inverse, y * inverse);
        Planar {
            x: c * x + s * y,
            y: c * y - s * x,
            cos,
            sin,
        }
    }
}

/// Values over a range of headings, with their slopes or without.
pub(super) trait Enclosure: Scalar {
    fn of(value: Interval) -> Self;
}

impl Enclosure for Interval {
    fn of(value: Interval) -> Self {
        value
    }
}

impl Enclosure for Slope {
    fn of(value: Interval) -> Self {
        Self::constant(value)
    }
}

fn halves(range: [i64; 2]) -> [[i64; 2]; 2] {
    let half = range[0] + (range[1] - range[0]) / 2;
    [[range[0], half], [half, range[1]]]
}

/// Returns `1 / v` of a nonzero value.
fn reciprocal(v: Slope) -> Slope {
    let value = v.value.reciprocal();
    Slope {
        value,
        by_yaw: -(v.by_yaw * value * value),
    }
}

impl Line {
    /// Returns the cross product of two normals that keep their angle at every heading; `None` if they do not.
    fn turns_with(&self, other: &Self) -> Option<f64> {
        let ([ax, ay], [bx, by]) = (self.integers, other.integers);
        // Exact: below 2^30 times 2^-28.
        (self.axes == other.axes).then(|| (ax * by - ay * bx) as f64 / 268_435_456.0)
    }

    /// Returns the offset of the half-plane from a point.
    fn from<S: Enclosure>(&self, pivot: [Interval; 2], half: &HalfPlane<S>) -> S {
        let [nx, ny] = half.normal;
        let along = |[x, y]: [Interval; 2]| nx * S::of(x) + ny * S::of(y);
        match self.axes {
            Axes::Robot if self.point == pivot => S::of(self.b),
            Axes::Robot => {
                let [x, y] = self.point;
                S::of(self.b) + along([x - pivot[0], y - pivot[1]])
            }
            Axes::World => half.b - along(pivot),
        }
    }

    /// Returns the facet as a half-plane of positions at a heading (its cosine and sine in the world).
    pub fn at<S: Enclosure>(&self, [cos, sin]: [S; 2]) -> HalfPlane<S> {
        let [x, y] = self.normal.map(|v| S::of(Interval::point(v)));
        let [px, py] = self.point.map(S::of);
        let b = S::of(self.b);
        match self.axes {
            // a . (p + R v) <= b
            Axes::World => HalfPlane {
                normal: [x, y],
                b: b - x * (cos * px - sin * py) - y * (sin * px + cos * py),
            },
            // (R a) . (p - q) <= b
            Axes::Robot => {
                let normal = [cos * x - sin * y, sin * x + cos * y];
                HalfPlane {
                    normal,
                    b: b + normal[0] * px + normal[1] * py,
                }
            }
        }
    }
}

fn cross<S: Scalar>([ax, ay]: [S; 2], [bx, by]: [S; 2]) -> S {
    ax * by - ay * bx
}

/// Returns the intersection of two lines: `(X, Y) / W`.
///
/// Relative to the point about which one of them turns. The vector to that point, which is far longer than the result,
/// then does not enter the differences.
fn meeting<S: Enclosure>(lines: [&Line; 2], [a, b]: [&HalfPlane<S>; 2]) -> [S; 3] {
    let pivot = lines
        .iter()
        .find(|line| line.axes == Axes::Robot)
        .map_or([Interval::point(0.0); 2], |line| line.point);
    let ([ax, ay], [bx, by]) = (a.normal, b.normal);
    let (p, q) = (lines[0].from(pivot, a), lines[1].from(pivot, b));
    let weight = lines[0]
        .turns_with(lines[1])
        .map_or_else(|| cross(a.normal, b.normal), |w| S::of(Interval::point(w)));
    let [cx, cy] = pivot.map(S::of);
    [
        p * by - q * ay + cx * weight,
        q * ax - p * bx + cy * weight,
        weight,
    ]
}

/// Returns how far a point lies beyond a line, times its weight.
fn beyond<S: Scalar>(line: &HalfPlane<S>, [x, y, weight]: [S; 3]) -> S {
    line.normal[0] * x + line.normal[1] * y - line.b * weight
}

/// Returns the same distance, approximately.
fn about([nx, ny, b]: [f64; 3], [x, y, weight]: [f64; 3]) -> f64 {
    nx * x + ny * y - b * weight
}
