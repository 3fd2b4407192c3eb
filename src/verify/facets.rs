//! The proof of a facet layout.
//!
//! What must lie in the success set is, for every heading of a piece's arc, the polygon that its
//! facets leave at that heading; the set (convex at a fixed heading) holds it when it holds its
//! corners. A corner is where two facets meet: for every pair, and over the whole arc, either some
//! other facet cuts the meeting point off, or the point is proven inside. Facets turn with the
//! heading, and so meeting points move: values and slopes are enclosed, and the arc is halved where
//! that is not sharp enough. Two facets that turn against each other are parallel at some heading and
//! meet at infinity there, so meeting points are kept as `(X, Y, W)`, the point being `(X, Y) / W`.
//! Every offset is raised by what the decision's rounding can do
//! ([`crate::contain::facet_clearance_q14`]).

use crate::certify::{Interval, Prover, Slope};
use crate::contain::facet_clearance_q14;
use crate::shape::{Planar, Scalar, SuccessSet};
use crate::table::{Axes, Facet, Facets};
use rayon::prelude::*;
use std::vec::Vec;

/// A facet that is not proven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnprovenFacet {
    /// The piece.
    pub piece: usize,
    /// The frame of the piece.
    pub frame: usize,
    /// The facet of the frame.
    pub facet: usize,
}

/// Halvings of a part of an arc before a corner counts as not proven.
const DEEPEST: u32 = 14;
/// An arc is looked at in parts of at most this width: about 2.8 degrees.
const PART: i64 = 1 << 25;

/// A facet with the numbers of its frame: metres, world axes about the goal.
struct Line {
    at: UnprovenFacet,
    axes: Axes,
    integers: [i64; 2],
    normal: [f64; 2],
    b: Interval,
    point: [Interval; 2],
}

/// A facet at a heading: `x nx + y ny <= b`.
#[derive(Clone, Copy)]
struct HalfPlane {
    normal: [Slope; 2],
    b: Slope,
}

/// Proves every piece; how many corners were looked at.
///
/// # Errors
/// The first facet that could not be proven.
pub(super) fn facets(
    layout: &Facets<'_>,
    success: &SuccessSet,
    progress: &(dyn Fn() + Sync),
) -> Result<u64, UnprovenFacet> {
    let prover = Prover::new(success);
    let mut parts = Vec::new();
    let mut pieces = Vec::new();
    for (number, piece) in layout.pieces().enumerate() {
        pieces.push(lines(layout, number));
        let from = i64::from(piece.from);
        let to = from
            + if piece.is_whole_circle() {
                1 << 32
            } else {
                i64::from(piece.width)
            };
        let first = UnprovenFacet {
            piece: number,
            frame: 0,
            facet: 0,
        };
        if !prover.arc_holds([from, to]) {
            return Err(first);
        }
        let count = ((to - from + PART - 1) / PART).max(1);
        parts.extend((0..count).map(|i| {
            let end = |i: i64| from + ((to - from) as i128 * i as i128 / count as i128) as i64;
            (number, [end(i), end(i + 1)])
        }));
    }
    let proven: Vec<Result<u64, UnprovenFacet>> = parts
        .into_par_iter()
        .map(|(piece, range)| {
            let proof = Polygon {
                success,
                prover: &prover,
                lines: &pieces[piece],
            };
            let corners = proof.hold(range);
            progress();
            corners
        })
        .collect();
    proven.into_iter().sum()
}

fn lines(layout: &Facets<'_>, number: usize) -> Vec<Line> {
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

/// A piece's polygon, which changes with the heading.
struct Polygon<'a> {
    success: &'a SuccessSet,
    prover: &'a Prover<'a>,
    lines: &'a [Line],
}

/// The lines over a range of headings, and at its middle.
struct Sight {
    offset: Interval,
    whole: Interval,
    middle: Interval,
    over: Vec<HalfPlane>,
    mid: Vec<HalfPlane>,
}

/// A value over a range, from its enclosure there and the mean value form.
fn sharp(over: Slope, mid: Slope, offset: Interval) -> Interval {
    let mean = mid.value + over.by_yaw * offset;
    Interval {
        lo: over.value.lo.max(mean.lo),
        hi: over.value.hi.min(mean.hi),
    }
}

impl Polygon<'_> {
    /// Proves the polygon over a range of headings above the goal's.
    fn hold(&self, range: [i64; 2]) -> Result<u64, UnprovenFacet> {
        let first = self.lines.first().map_or(
            UnprovenFacet {
                piece: 0,
                frame: 0,
                facet: 0,
            },
            |line| line.at,
        );
        let sight = self.sight(range);
        if !self.is_bounded(range, &sight, DEEPEST) {
            return Err(first);
        }
        let mut corners = 0;
        for i in 0..self.lines.len() {
            for j in i + 1..self.lines.len() {
                // Parallel at every heading: they never meet, and where they coincide the corners of
                // that edge are those with other facets.
                let (a, b) = (&self.lines[i], &self.lines[j]);
                let cross = a.integers[0] * b.integers[1] - a.integers[1] * b.integers[0];
                if a.axes == b.axes && cross == 0 {
                    continue;
                }
                if !self.corner((i, j), range, &sight, DEEPEST) {
                    return Err(self.lines[i].at);
                }
                corners += 1;
            }
        }
        Ok(corners)
    }

    fn sight(&self, range: [i64; 2]) -> Sight {
        let ends = range.map(Interval::radians);
        let whole = ends[0].hull(ends[1]);
        let middle = Interval::point(whole.middle());
        let at = |yaw| {
            let turn = self.turn(yaw);
            self.lines.iter().map(|line| line.at(turn)).collect()
        };
        Sight {
            offset: whole - middle,
            whole,
            middle,
            over: at(whole),
            mid: at(middle),
        }
    }

    /// Cosine and sine of the robot's heading in the world, from that above the goal's.
    fn turn(&self, yaw: Interval) -> [Slope; 2] {
        let [c, s] = Slope::cos_sin_deg(self.success.goal.yaw_deg);
        let [cos, sin] = Slope::cos_sin_of(yaw);
        [c * cos - s * sin, s * cos + c * sin]
    }

    /// Whether the normals leave no half of the plane free, at every heading of a range: the polygon
    /// is then bounded. Three or four of them, each less than half a turn on from the one before it,
    /// and once around, will do.
    fn is_bounded(&self, range: [i64; 2], sight: &Sight, depth: u32) -> bool {
        let cross = |i: usize, j: usize| {
            let of = |lines: &[HalfPlane]| {
                let (a, b) = (lines[i].normal, lines[j].normal);
                a[0] * b[1] - a[1] * b[0]
            };
            sharp(of(&sight.over), of(&sight.mid), sight.offset).lo > 0.0
        };
        let angle = |i: usize| {
            let [x, y] = sight.mid[i].normal.map(|v| v.value.middle());
            libm::atan2(y, x).rem_euclid(core::f64::consts::TAU)
        };
        let count = self.lines.len();
        // From each line the farthest one that is surely less than half a turn on.
        let mut at = 0;
        let mut turned = 0.0;
        for _ in 0..8 {
            if count == 0 {
                return false;
            }
            let ahead = |j: usize| (angle(j) - angle(at)).rem_euclid(core::f64::consts::TAU);
            let next = (0..count)
                .filter(|j| *j != at && cross(at, *j))
                .max_by(|a, b| ahead(*a).total_cmp(&ahead(*b)));
            let Some(next) = next else {
                break;
            };
            let closes = turned > 0.0
                && turned + core::f64::consts::PI > core::f64::consts::TAU
                && cross(at, 0);
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
        halves(range).into_iter().all(|half| {
            let sight = self.sight(half);
            self.is_bounded(half, &sight, depth - 1)
        })
    }

    /// Whether the meeting point of two facets is cut off or inside, over a range of headings.
    fn corner(&self, (i, j): (usize, usize), range: [i64; 2], sight: &Sight, depth: u32) -> bool {
        let (over, mid) = (
            meeting(&sight.over[i], &sight.over[j]),
            meeting(&sight.mid[i], &sight.mid[j]),
        );
        let weight = sharp(over[2], mid[2], sight.offset);
        // Beyond another facet: a positive distance for a positive weight, a negative one else.
        let (mut cut_above, mut cut_below) = (weight.hi <= 0.0, weight.lo >= 0.0);
        for k in (0..self.lines.len()).filter(|k| *k != i && *k != j) {
            let beyond = sharp(
                beyond(&sight.over[k], over),
                beyond(&sight.mid[k], mid),
                sight.offset,
            );
            cut_above |= beyond.lo > 0.0;
            cut_below |= beyond.hi < 0.0;
            if cut_above && cut_below {
                // A weight of zero throughout: the facets are parallel and do not meet.
                return true;
            }
        }
        if weight.lo > 0.0 || weight.hi < 0.0 {
            let over = self.prover.slacks_at(&self.planar(over, sight.whole));
            let mid = self.prover.slacks_at(&self.planar(mid, sight.middle));
            if over
                .iter()
                .zip(&mid)
                .all(|(o, m)| sharp(*o, *m, sight.offset).lo >= 0.0)
            {
                return true;
            }
        }
        if depth == 0 || range[1] - range[0] < 2 {
            return false;
        }
        halves(range).into_iter().all(|half| {
            let sight = self.sight(half);
            self.corner((i, j), half, &sight, depth - 1)
        })
    }

    /// A meeting point as a pose in the goal frame.
    fn planar(&self, [x, y, weight]: [Slope; 3], yaw: Interval) -> Planar<Slope> {
        let [c, s] = Slope::cos_sin_deg(self.success.goal.yaw_deg);
        let [cos, sin] = Slope::cos_sin_of(yaw);
        let inverse = reciprocal(weight);
        let (x, y) = (x * inverse, y * inverse);
        Planar {
            x: c * x + s * y,
            y: c * y - s * x,
            cos,
            sin,
        }
    }
}

fn halves(range: [i64; 2]) -> [[i64; 2]; 2] {
    let half = range[0] + (range[1] - range[0]) / 2;
    [[range[0], half], [half, range[1]]]
}

/// `1 / v`, of a value that is not zero.
fn reciprocal(v: Slope) -> Slope {
    let value = v.value.reciprocal();
    Slope {
        value,
        by_yaw: -(v.by_yaw * value * value),
    }
}

impl Line {
    /// The facet as a half-plane of positions at a heading (its cosine and sine in the world).
    fn at(&self, [cos, sin]: [Slope; 2]) -> HalfPlane {
        let [x, y] = self.normal.map(|v| Slope::constant(Interval::point(v)));
        let [px, py] = self.point.map(Slope::constant);
        let b = Slope::constant(self.b);
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

/// Where two lines meet: `(X, Y) / W`.
fn meeting(a: &HalfPlane, b: &HalfPlane) -> [Slope; 3] {
    let ([ax, ay], [bx, by]) = (a.normal, b.normal);
    [a.b * by - b.b * ay, b.b * ax - a.b * bx, ax * by - ay * bx]
}

/// How far a point lies beyond a line, times its weight.
fn beyond(line: &HalfPlane, [x, y, weight]: [Slope; 3]) -> Slope {
    line.normal[0] * x + line.normal[1] * y - line.b * weight
}
