//! The proof of facet layers.
//!
//! A pose-set passes when one slab of each group holds it, so what must lie in the success set is, for
//! any choice of slabs, the intersection of their pieces over the headings that they share. At each
//! heading that is a convex polygon, and the set (convex at a fixed heading) holds it when it holds
//! its corners. A corner is where two facets meet: for every pair, and over the whole range of
//! headings, either some other facet cuts the meeting point off, or the point is proven inside. Points
//! move with the heading; values and slopes are enclosed, and the range is halved where that is not
//! sharp enough. Every offset is raised by what the decision's rounding can do
//! ([`crate::contain::facet_slack_q14`]).

use crate::certify::{Interval, Prover, Slope};
use crate::contain::facet_slack_q14;
use crate::shape::{Planar, Scalar, SuccessSet};
use crate::table::{Facet, Facets, Layer, Table};
use rayon::prelude::*;
use std::vec::Vec;

/// A slab whose facets are not proven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnprovenFacet {
    /// The layer.
    pub layer: u8,
    /// The slab.
    pub slab: u16,
    /// The facet of the slab (and, from the slab's number of facets on, of the other group's).
    pub facet: usize,
}

/// Halvings of a range of headings before a corner counts as not proven.
const DEEPEST: u32 = 12;

/// A half-plane that moves with the heading: `x nx + y ny <= b + tilt (yaw - middle)`, world axes,
/// metres and radians.
struct Line {
    normal: [f64; 2],
    integers: [i64; 2],
    b: Interval,
    tilt: Interval,
    middle: Interval,
}

/// Proves every combination of slabs.
///
/// # Errors
/// A facet of every slab that could not be proven, in order.
pub(super) fn facets(
    table: &Table<'_>,
    layout: &Facets<'_>,
    success: &SuccessSet,
    progress: &(dyn Fn() + Sync),
) -> Result<u64, Vec<UnprovenFacet>> {
    let prover = Prover::new(success);
    let layers: Vec<(u8, Layer)> = (0..layout.layers()).map(|n| (n, layout.layer(n))).collect();
    let groups = layers
        .iter()
        .map(|(_, layer)| layer.group)
        .max()
        .unwrap_or(0);
    let unit = 1i64 << layout.yaw_shift();
    let start = i64::from(table.cells().yaw_lo.0);
    let range = |layer: &Layer, slab: u16| {
        let from = start + i64::from(slab) * i64::from(layer.stride) * unit;
        [from, from + 2 * i64::from(layer.stride) * unit]
    };
    let first: Vec<(u8, Layer, u16)> = layers
        .iter()
        .filter(|(_, layer)| layer.group == 0)
        .flat_map(|(n, layer)| (0..layer.slabs).map(|slab| (*n, *layer, slab)))
        .collect();
    let proven: Vec<Result<u64, UnprovenFacet>> = first
        .into_par_iter()
        .map(|(number, layer, slab)| {
            let mut lines = Vec::new();
            push_lines(layout, &layer, slab, range(&layer, slab), &mut lines);
            let failed = |facet| UnprovenFacet {
                layer: number,
                slab,
                facet,
            };
            if lines.is_empty() {
                return Ok(0);
            }
            progress();
            let own = lines.len();
            let mut corners = 0;
            if groups == 0 {
                corners +=
                    polygon(success, &prover, &lines, range(&layer, slab)).map_err(failed)?;
                return Ok(corners);
            }
            for (_, other) in layers.iter().filter(|(_, l)| l.group == 1) {
                for other_slab in 0..other.slabs {
                    let (a, b) = (range(&layer, slab), range(other, other_slab));
                    let shared = [a[0].max(b[0]), a[1].min(b[1])];
                    if shared[0] > shared[1] {
                        continue;
                    }
                    lines.truncate(own);
                    push_lines(layout, other, other_slab, b, &mut lines);
                    if lines.len() > own {
                        corners += polygon(success, &prover, &lines, shared).map_err(failed)?;
                    }
                }
            }
            Ok(corners)
        })
        .collect();
    // More than two groups is more than this proof knows.
    if groups > 1 {
        return Err(std::vec![UnprovenFacet {
            layer: 0,
            slab: 0,
            facet: 0,
        }]);
    }
    let failed: Vec<UnprovenFacet> = proven.iter().filter_map(|slab| slab.err()).collect();
    if failed.is_empty() {
        Ok(proven.into_iter().flatten().sum())
    } else {
        Err(failed)
    }
}

fn push_lines(
    layout: &Facets<'_>,
    layer: &Layer,
    slab: u16,
    [from, to]: [i64; 2],
    lines: &mut Vec<Line>,
) {
    for facet in layout.slab(layer, slab).facets() {
        lines.push(line(facet, layout, (from + to) / 2));
    }
}

fn line(facet: Facet, layout: &Facets<'_>, middle: i64) -> Line {
    let one = 16_384.0;
    // Powers of two and 1e-6: one rounding, enclosed.
    let length = Interval::point(f64::from(1u32 << layout.length_shift()))
        * Interval::point(1e6).reciprocal();
    let yaw = Interval::radians(1 << layout.yaw_shift());
    let slack = facet_slack_q14(facet, layout.length_shift(), layout.yaw_shift());
    let b = Interval::point(f64::from(facet.b) + slack as f64 / one);
    Line {
        normal: [f64::from(facet.x) / one, f64::from(facet.y) / one],
        integers: [i64::from(facet.x), i64::from(facet.y)],
        b: b * length,
        tilt: -(Interval::point(f64::from(facet.yaw) / one) * length * yaw.reciprocal()),
        middle: Interval::radians(middle),
    }
}

/// Proves a moving polygon over a range of headings; the number of corners that were looked at, or
/// the facet that failed.
fn polygon(
    success: &SuccessSet,
    prover: &Prover<'_>,
    lines: &[Line],
    range: [i64; 2],
) -> Result<u64, usize> {
    if !is_bounded(lines) || !prover.arc_holds(range) {
        return Err(0);
    }
    let mut corners = 0;
    for i in 0..lines.len() {
        for j in i + 1..lines.len() {
            let [a, b] = [lines[i].integers, lines[j].integers];
            if a[0] * b[1] - a[1] * b[0] == 0 {
                continue;
            }
            if !corner(success, prover, lines, (i, j), range, DEEPEST) {
                return Err(i);
            }
            corners += 1;
        }
    }
    Ok(corners)
}

/// Whether the normals leave no half-plane free: the polygon is then bounded at every heading.
fn is_bounded(lines: &[Line]) -> bool {
    let mut normals: Vec<[i64; 2]> = lines.iter().map(|line| line.integers).collect();
    normals.sort_by(|a, b| {
        let angle = |v: &[i64; 2]| libm::atan2(v[1] as f64, v[0] as f64);
        angle(a).total_cmp(&angle(b))
    });
    let next = normals.iter().cycle().skip(1);
    normals.len() >= 3
        && normals.iter().zip(next).all(|(a, b)| {
            let cross = a[0] * b[1] - a[1] * b[0];
            let dot = a[0] * b[0] + a[1] * b[1];
            cross > 0 || (cross == 0 && dot > 0)
        })
}

/// Whether the meeting point of two facets is cut off or inside, over a range of headings.
fn corner(
    success: &SuccessSet,
    prover: &Prover<'_>,
    lines: &[Line],
    (i, j): (usize, usize),
    range: [i64; 2],
    depth: u32,
) -> bool {
    let ends = range.map(Interval::radians);
    let whole = ends[0].hull(ends[1]);
    let middle = Interval::point(whole.middle());
    let offset = whole - middle;
    let sharp = |over: Slope, mid: Slope| {
        let mean = mid.value + over.by_yaw * offset;
        Interval {
            lo: over.value.lo.max(mean.lo),
            hi: over.value.hi.min(mean.hi),
        }
    };
    let (over, mid) = (
        meeting(&lines[i], &lines[j], whole),
        meeting(&lines[i], &lines[j], middle),
    );
    let cut_off = lines.iter().enumerate().any(|(k, line)| {
        k != i && k != j && sharp(beyond(line, over, whole), beyond(line, mid, middle)).lo > 0.0
    });
    if cut_off {
        return true;
    }
    let over = prover.slacks_at(&planar(success, over, whole));
    let mid = prover.slacks_at(&planar(success, mid, middle));
    if over.iter().zip(&mid).all(|(o, m)| sharp(*o, *m).lo >= 0.0) {
        return true;
    }
    if depth == 0 || range[1] - range[0] < 2 {
        return false;
    }
    let half = range[0] + (range[1] - range[0]) / 2;
    corner(success, prover, lines, (i, j), [range[0], half], depth - 1)
        && corner(success, prover, lines, (i, j), [half, range[1]], depth - 1)
}

/// A line's offset at a heading.
fn offset_at(line: &Line, yaw: Interval) -> Slope {
    Slope {
        value: line.b + line.tilt * (yaw - line.middle),
        by_yaw: line.tilt,
    }
}

/// Where two lines meet, in world axes about the goal.
fn meeting(a: &Line, b: &Line, yaw: Interval) -> [Slope; 2] {
    // Exact: below 2^30 times 2^-28.
    let det =
        (a.integers[0] * b.integers[1] - a.integers[1] * b.integers[0]) as f64 / 268_435_456.0;
    let inverse = Slope::constant(Interval::point(det).reciprocal());
    let number = |v: f64| Slope::constant(Interval::point(v));
    let (p, q) = (offset_at(a, yaw), offset_at(b, yaw));
    [
        (p * number(b.normal[1]) - q * number(a.normal[1])) * inverse,
        (q * number(a.normal[0]) - p * number(b.normal[0])) * inverse,
    ]
}

/// How far a point lies beyond a line, positive outside.
fn beyond(line: &Line, [x, y]: [Slope; 2], yaw: Interval) -> Slope {
    let number = |v: f64| Slope::constant(Interval::point(v));
    number(line.normal[0]) * x + number(line.normal[1]) * y - offset_at(line, yaw)
}

/// A point of the world about the goal as a pose in the goal frame.
fn planar(success: &SuccessSet, [x, y]: [Slope; 2], yaw: Interval) -> Planar<Slope> {
    let [c, s] = Slope::cos_sin_deg(success.goal.yaw_deg);
    let [cos, sin] = Slope::cos_sin_of(yaw);
    Planar {
        x: c * x + s * y,
        y: c * y - s * x,
        cos,
        sin,
    }
}
