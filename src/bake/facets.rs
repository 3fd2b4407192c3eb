//! Convex pieces with tilted facets, one a slab, in overlapping layers.
//!
//! At a heading, the border of a set is walked around from an inner point and cut into edges: one a
//! plane, several chords a curved constraint. Over a slab each edge becomes one facet: its normal is
//! that of the middle, its tilt follows the edge's ends, its offset is the smallest that holds at all
//! headings looked at, less what can happen between them.

use super::lines::Node;
use super::{BakeError, slab_start};
use crate::contain::facet_slack_q14;
use crate::shape::{Shape, SuccessSet};
use crate::table::{Cells, Facet, LARGEST_STRIDE};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::vec;
use std::vec::Vec;

/// The layers of a table before they are bytes.
#[derive(Clone, Debug)]
pub struct FacetLayers {
    /// Exponent of the length unit.
    pub length_shift: u8,
    /// Exponent of the yaw unit.
    pub yaw_shift: u8,
    /// The layers, group by group, coarse to fine.
    pub layers: Vec<PieceLayer>,
}

/// One layer.
#[derive(Clone, Debug)]
pub struct PieceLayer {
    /// The group it belongs to.
    pub group: u8,
    /// Yaw units from slab to slab.
    pub stride: u16,
    /// The facets of each slab; none where the slab holds nothing.
    pub pieces: Vec<Vec<Facet>>,
}

/// Directions in which the border is looked at.
const DIRECTIONS: usize = 180;
/// How far a chord may lie inside of its arc, metres.
const SAGITTA: f64 = 0.01;
/// Most chords of one arc.
const MOST_CHORDS: f64 = 6.0;

/// Constraint, occurrence, chord.
type Label = (usize, usize, usize);

/// An edge's ends at an offset of the yaw from the slab's middle, radians.
type Seen = (f64, [[f64; 2]; 2]);

/// An edge of the border at a heading.
#[derive(Clone, Copy, Debug)]
struct Edge {
    label: Label,
    ends: [[f64; 2]; 2],
}

/// The facet layers of a set, the slabs of `left_out` (layer, slab) empty.
pub(super) fn of_set(
    set: &SuccessSet,
    cells: &Cells,
    step_deg: f64,
    left_out: &BTreeSet<(u8, u16)>,
    progress: &(dyn Fn() + Sync),
) -> Result<FacetLayers, BakeError> {
    if cells.is_whole_circle() {
        return Err(BakeError::NoPieces(
            "the table's yaw range is the whole circle",
        ));
    }
    let corner = |v: [i32; 2]| f64::from(v[0].abs().max(v[1].abs()));
    let reach = libm::hypot(
        corner([cells.x_lo_um, cells.x_hi_um()]),
        corner([cells.y_lo_um, cells.y_hi_um()]),
    );
    let length_shift = (0..=12u8)
        .find(|k| reach / f64::from(1u32 << k) < 32_000.0)
        .ok_or(BakeError::NoPieces("the table reaches too far"))?;
    // Widths: the step and its doublings.
    let fine = (step_deg / 2.0 / 360.0 * 4_294_967_296.0).max(2.0);
    let doublings = 3u32;
    let yaw_shift = (0..=24u8)
        .find(|j| {
            let unit = f64::from(1u32 << j);
            libm::floor(fine / unit) * f64::from(1u32 << (doublings - 1))
                <= f64::from(LARGEST_STRIDE)
        })
        .ok_or(BakeError::NoPieces("the yaw step is too wide"))?;
    let unit = 1u64 << yaw_shift;
    let finest = ((fine / unit as f64) as u64).max(1);
    let mut layers = Vec::new();
    let groups: &[(u8, u32)] = match &set.shape {
        Shape::Visibility(_) => &[(0, doublings), (1, 1)],
        Shape::Box(_) | Shape::Footprint(_) => &[(0, doublings)],
    };
    let units = Units {
        length_shift,
        yaw_shift,
    };
    for &(group, count) in groups {
        let widest = if group == 0 {
            finest << (count - 1)
        } else {
            u64::from(LARGEST_STRIDE)
        };
        let mut slabs = cells
            .yaw_span
            .div_ceil(widest * unit)
            .saturating_sub(1)
            .max(1);
        for layer in 0..count {
            let stride = widest >> layer;
            if layer > 0 {
                slabs = 2 * slabs + 1;
            }
            let slabs = u16::try_from(slabs).map_err(|_| BakeError::NoPieces("too many slabs"))?;
            let number = layers.len() as u8;
            let pieces = (0..slabs)
                .into_par_iter()
                .map(|slab| {
                    if left_out.contains(&(number, slab)) {
                        return Vec::new();
                    }
                    piece(set, cells, units, group, slab, stride)
                })
                .collect();
            layers.push(PieceLayer {
                group,
                stride: stride as u16,
                pieces,
            });
        }
    }
    progress();
    Ok(FacetLayers {
        length_shift,
        yaw_shift,
        layers,
    })
}

#[derive(Clone, Copy)]
struct Units {
    length_shift: u8,
    yaw_shift: u8,
}

/// The facets of one slab that belong to a group.
fn piece(
    set: &SuccessSet,
    cells: &Cells,
    units: Units,
    group: u8,
    slab: u16,
    stride: u64,
) -> Vec<Facet> {
    let unit = 1i64 << units.yaw_shift;
    let start = slab_start(cells) + i64::from(slab) * stride as i64 * unit;
    let middle = start + stride as i64 * unit;
    let half = stride as i64 * unit;
    let radians = |fine: i64| fine as f64 / 4_294_967_296.0 * core::f64::consts::TAU;
    if let Shape::Box(shape) = &set.shape {
        let border = 1.5e-9;
        let [lo, hi] = shape.yaw_deg.map(f64::to_radians);
        let turn = core::f64::consts::TAU;
        let shift = turn * libm::round((0.5 * (lo + hi) - radians(middle)) / turn);
        let (from, to) = (
            radians(middle - half) + shift,
            radians(middle + half) + shift,
        );
        if !crate::shape::is_whole_circle(shape.yaw_deg)
            && !(from >= lo - border && to <= hi + border)
        {
            return Vec::new();
        }
    }
    let reach = super::reach(cells);
    let curvature = Node::curvature(set, reach);
    let width = 2.0 * radians(half);
    let parts = libm::ceil(width * libm::sqrt(curvature / (8.0 * 2e-4))).clamp(2.0, 60.0);
    let parts = 2 * libm::ceil(parts / 2.0) as i32;
    let dip = curvature * (width / f64::from(parts)) * (width / f64::from(parts)) / 8.0 + 2e-6;
    let yaw_at = |part: i32| radians(middle) + width * (f64::from(part) / f64::from(parts) - 0.5);
    let nodes: Vec<Node> = (0..=parts)
        .map(|part| bounded_node(set, cells, group, yaw_at(part), dip))
        .collect();
    let centre = &nodes[parts as usize / 2];
    let Some(inner) = inner_point(centre, cells) else {
        return Vec::new();
    };
    if nodes.iter().any(|node| node.slack(inner) <= 1e-4) {
        return Vec::new();
    }
    let chords = chords(centre, inner);
    let mut edges: BTreeMap<Label, Vec<Seen>> = BTreeMap::new();
    for (part, node) in nodes.iter().enumerate() {
        let offset = f64::from(part as i32) / f64::from(parts) - 0.5;
        for edge in border(node, inner, &chords) {
            edges
                .entry(edge.label)
                .or_default()
                .push((offset * width, edge.ends));
        }
    }
    let planes = centre.planes();
    let goal = set.goal.yaw_deg.to_radians();
    let mut facets = Vec::new();
    for (label, found) in &edges {
        if group == 0 && group_of(set, planes, label.0) != group {
            continue;
        }
        match facet(found, goal, units, curvature) {
            Some(facet) => facets.push(facet),
            None => return Vec::new(),
        }
    }
    let length = f64::from(1u32 << units.length_shift) * 1e-6;
    let yaw_unit = radians(unit);
    let offsets: Vec<f64> = (0..=parts)
        .map(|p| (yaw_at(p) - radians(middle)) / yaw_unit)
        .collect();
    needed(&facets, &offsets, reach / length)
}

/// The set at a heading within the table's extent.
fn bounded_node(set: &SuccessSet, cells: &Cells, group: u8, yaw: f64, dip: f64) -> Node {
    let mut node = Node::at(set, yaw, dip);
    if group == 1 {
        node.keep_standing();
    }
    let m = |um: i32| f64::from(um) * 1e-6;
    let mut bounds = vec![
        [1.0, 0.0, -m(cells.x_lo_um)],
        [-1.0, 0.0, m(cells.x_hi_um())],
        [0.0, 1.0, -m(cells.y_lo_um)],
        [0.0, -1.0, m(cells.y_hi_um())],
    ];
    if let Shape::Box(shape) = &set.shape {
        let [x, y] = [shape.x, shape.y];
        bounds = vec![
            [1.0, 0.0, -x[0].max(m(cells.x_lo_um))],
            [-1.0, 0.0, x[1].min(m(cells.x_hi_um()))],
            [0.0, 1.0, -y[0].max(m(cells.y_lo_um))],
            [0.0, -1.0, y[1].min(m(cells.y_hi_um()))],
        ];
    }
    for bound in bounds {
        node.add_plane(bound);
    }
    node
}

/// Which group a constraint belongs to: what turns with the robot, and what stands.
fn group_of(set: &SuccessSet, planes: usize, number: usize) -> u8 {
    match &set.shape {
        Shape::Visibility(_) => {
            let bounds = planes - 4..planes;
            let stands = bounds.contains(&number) || number > planes;
            u8::from(stands)
        }
        Shape::Box(_) | Shape::Footprint(_) => 0,
    }
}

/// The point of a lattice with the largest slack.
fn inner_point(node: &Node, cells: &Cells) -> Option<[f64; 2]> {
    let m = |lo: i32, hi: i32, part: f64| {
        (f64::from(lo) + part * (f64::from(hi) - f64::from(lo))) * 1e-6
    };
    let parts = (1..24).map(|i| f64::from(i) / 24.0);
    let points = parts.clone().flat_map(|a| {
        parts.clone().map(move |b| {
            [
                m(cells.x_lo_um, cells.x_hi_um(), a),
                m(cells.y_lo_um, cells.y_hi_um(), b),
            ]
        })
    });
    points
        .map(|point| (node.slack(point), point))
        .filter(|(slack, _)| *slack > 1e-3)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, point)| point)
}

fn at(node: &Node, inner: [f64; 2], angle: f64) -> ([f64; 2], usize) {
    let along = [libm::cos(angle), libm::sin(angle)];
    let (t, number) = node.reach(inner, along);
    ([inner[0] + t * along[0], inner[1] + t * along[1]], number)
}

/// Runs of one constraint around the border: number, first and last angle.
fn runs(node: &Node, inner: [f64; 2]) -> Vec<(usize, f64, f64)> {
    let turn = core::f64::consts::TAU;
    let angle = |i: usize| turn * i as f64 / DIRECTIONS as f64;
    let mut breaks = Vec::new();
    let mut before = at(node, inner, 0.0).1;
    for i in 1..=DIRECTIONS {
        let (mut low, high) = (angle(i - 1), angle(i));
        let last = at(node, inner, high).1;
        // Several constraints may end within one step.
        for _ in 0..6 {
            if before == last {
                break;
            }
            let mut top = high;
            let mut bottom = low;
            for _ in 0..45 {
                let middle = 0.5 * (bottom + top);
                if at(node, inner, middle).1 == before {
                    bottom = middle;
                } else {
                    top = middle;
                }
            }
            breaks.push(0.5 * (bottom + top));
            before = at(node, inner, top).1;
            low = top;
        }
        before = last;
    }
    if breaks.is_empty() {
        return vec![(before, 0.0, turn)];
    }
    (0..breaks.len())
        .map(|i| {
            let from = breaks[i];
            let to = breaks.get(i + 1).copied().unwrap_or(breaks[0] + turn);
            (at(node, inner, 0.5 * (from + to)).1, from, to)
        })
        .collect()
}

/// How many chords each run of a curved constraint wants, by number and occurrence.
fn chords(node: &Node, inner: [f64; 2]) -> BTreeMap<(usize, usize), usize> {
    let mut count = BTreeMap::new();
    let mut seen: BTreeMap<usize, usize> = BTreeMap::new();
    for (number, from, to) in runs(node, inner) {
        let occurrence = seen.entry(number).or_default();
        if number >= node.planes() {
            let (a, b) = (at(node, inner, from).0, at(node, inner, to).0);
            let length = libm::hypot(b[0] - a[0], b[1] - a[1]).max(1e-9);
            let sagitta = (1..20)
                .map(|i| {
                    let p = at(node, inner, from + (to - from) * f64::from(i) / 20.0).0;
                    ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])).abs() / length
                })
                .fold(0.0, f64::max);
            let wanted = libm::ceil(libm::sqrt(sagitta / SAGITTA)).clamp(1.0, MOST_CHORDS);
            count.insert((number, *occurrence), wanted as usize);
        }
        *occurrence += 1;
    }
    count
}

/// The edges of the border.
fn border(node: &Node, inner: [f64; 2], chords: &BTreeMap<(usize, usize), usize>) -> Vec<Edge> {
    let mut edges = Vec::new();
    let mut seen: BTreeMap<usize, usize> = BTreeMap::new();
    for (number, from, to) in runs(node, inner) {
        let occurrence = seen.entry(number).or_default();
        let parts = if number >= node.planes() {
            chords.get(&(number, *occurrence)).copied().unwrap_or(1)
        } else {
            1
        };
        let point =
            |part: usize| at(node, inner, from + (to - from) * part as f64 / parts as f64).0;
        for part in 0..parts {
            edges.push(Edge {
                label: (number, *occurrence, part),
                ends: [point(part), point(part + 1)],
            });
        }
        *occurrence += 1;
    }
    edges
}

/// The facet of an edge whose ends are known at several yaw offsets (radians from the middle).
fn facet(found: &[Seen], goal: f64, units: Units, steepest: f64) -> Option<Facet> {
    // The longest sight of it gives the best normal; near the middle if lengths are alike.
    let length =
        |ends: &[[f64; 2]; 2]| libm::hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
    let longest = found
        .iter()
        .map(|(_, ends)| length(ends))
        .fold(0.0, f64::max);
    let (_, ends) = found
        .iter()
        .filter(|(_, ends)| length(ends) >= 0.5 * longest)
        .min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    if longest < 1e-7 {
        return None;
    }
    let size = length(ends);
    let outward = [
        (ends[1][1] - ends[0][1]) / size,
        -(ends[1][0] - ends[0][0]) / size,
    ];
    let (s, c) = (libm::sin(goal), libm::cos(goal));
    let turn = |[x, y]: [f64; 2]| [c * x - s * y, s * x + c * y];
    let [nx, ny] = turn(outward).map(|v| libm::round(v * 16_384.0));
    let unit = f64::from(1u32 << units.length_shift) * 1e-6;
    let yaw_unit = f64::from(1u32 << units.yaw_shift) / 4_294_967_296.0 * core::f64::consts::TAU;
    // How far the nearer end lies out along the normal, in length units times 2^14.
    let heights: Vec<(f64, f64)> = found
        .iter()
        .map(|(offset, ends)| {
            let height = |end: [f64; 2]| {
                let [x, y] = turn(end);
                (nx * x + ny * y) / unit
            };
            (offset / yaw_unit, height(ends[0]).min(height(ends[1])))
        })
        .collect();
    let (first, last) = (heights.first()?, heights.last()?);
    let tilt = if last.0 > first.0 {
        -(last.1 - first.1) / (last.0 - first.0)
    } else {
        0.0
    };
    // No border moves faster than its farthest point; short edges can seem to.
    let steepest = libm::ceil(steepest * yaw_unit / unit * 16_384.0);
    let tilt = libm::round(tilt).clamp(-steepest, steepest);
    if !(tilt.abs() <= 32_767.0) {
        return None;
    }
    let facet = Facet {
        x: nx as i16,
        y: ny as i16,
        yaw: tilt as i16,
        b: 0,
    };
    let slack = facet_slack_q14(facet, units.length_shift, units.yaw_shift) as f64;
    let least = heights
        .iter()
        .map(|(offset, height)| height + tilt * offset)
        .fold(f64::INFINITY, f64::min);
    let b = libm::floor((least - slack) / 16_384.0);
    (b.abs() <= 32_767.0).then_some(Facet {
        b: b as i16,
        ..facet
    })
}

/// The facets that touch the piece at one of the offsets at least (yaw units).
fn needed(facets: &[Facet], offsets: &[f64], reach: f64) -> Vec<Facet> {
    let keeps = |index: usize| {
        offsets.iter().any(|offset| {
            let line = |f: &Facet| {
                let b = f64::from(f.b) * 16_384.0 - f64::from(f.yaw) * offset;
                (f64::from(f.x), f64::from(f.y), b)
            };
            let (nx, ny, b) = line(&facets[index]);
            let square = nx * nx + ny * ny;
            let point = [nx * b / square, ny * b / square];
            let along = [-ny / libm::sqrt(square), nx / libm::sqrt(square)];
            let (mut low, mut high) = (-4.0 * reach, 4.0 * reach);
            for (other, facet) in facets.iter().enumerate() {
                if other == index {
                    continue;
                }
                let (mx, my, d) = line(facet);
                let rate = mx * along[0] + my * along[1];
                let room = d - mx * point[0] - my * point[1];
                if rate > 1e-6 {
                    high = high.min(room / rate);
                } else if rate < -1e-6 {
                    low = low.max(room / rate);
                } else if room < 0.0 || (room == 0.0 && other < index) {
                    return false;
                }
            }
            high - low > 0.0
        })
    };
    (0..facets.len())
        .filter(|i| keeps(*i))
        .map(|i| facets[i])
        .collect()
}
