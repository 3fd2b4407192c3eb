//! The runs of every row: which cells lie in the set.

use super::lines::{Node, intersect, meets};
use super::slab_edge;
use crate::shape::{Shape, SuccessSet, is_whole_circle};
use crate::table::{Cells, Run};
use rayon::prelude::*;
use std::vec;
use std::vec::Vec;

/// The runs of each row of a slab.
pub type Rows = Vec<Vec<Run>>;

/// The rows of a slab of a convex set: a run each, or none.
pub(super) type ConvexRows = Vec<Option<Run>>;

/// How far runs keep from the computed border, metres: covers the rounding of the computation.
const CLEARANCE: f64 = 1e-8;

/// How far an edge may seem outside of a border that it lies on, metres: half of what the proof allows.
const ROUNDING: f64 = 5e-12;

/// The runs of every slab, in order.
pub(super) fn of_set(
    set: &SuccessSet,
    cells: &Cells,
    progress: &(dyn Fn() + Sync),
) -> Vec<ConvexRows> {
    (0..cells.slabs)
        .into_par_iter()
        .map(|k| {
            let rows = of_slab(set, cells, k);
            progress();
            rows
        })
        .collect()
}

fn of_slab(set: &SuccessSet, cells: &Cells, k: u16) -> ConvexRows {
    let from = slab_edge(cells, k);
    let to = slab_edge(cells, k + 1);
    let radians = |units: f64| units / 4_294_967_296.0 * core::f64::consts::TAU;
    let yaw = [radians(from as f64), radians(to as f64)];
    let y_at = |j: u16| f64::from(cells.y_lo_um) * 1e-6 + f64::from(j) * step(cells);
    let lines = match &set.shape {
        Shape::Box(shape) => {
            let [lo, hi] = shape.yaw_deg.map(f64::to_radians);
            let turn = core::f64::consts::TAU;
            let middle = 0.5 * (yaw[0] + yaw[1]);
            let shift = turn * libm::round((0.5 * (lo + hi) - middle) / turn);
            let whole = is_whole_circle(shape.yaw_deg);
            // A unit of 2^-32 turn, as the proof allows.
            let unit = 1.5e-9;
            let turned = whole || (yaw[0] + shift >= lo - unit && yaw[1] + shift <= hi + unit);
            (0..=cells.rows)
                .map(|j| {
                    let y = y_at(j);
                    let holds = turned && y >= shape.y[0] - ROUNDING && y <= shape.y[1] + ROUNDING;
                    // The clearance is for curved borders; a box's is exact.
                    holds.then_some([shape.x[0] - CLEARANCE, shape.x[1] + CLEARANCE])
                })
                .collect()
        }
        Shape::Footprint(_) | Shape::Visibility(_) => lines_of_slab(set, cells, yaw, y_at),
    };
    (0..cells.rows)
        .map(|j| {
            let j = usize::from(j);
            let both = lines[j]
                .zip(lines[j + 1])
                .and_then(|(a, b)| intersect(a, b));
            both.and_then(|line| run(line, cells))
        })
        .collect()
}

fn step(cells: &Cells) -> f64 {
    f64::from(cells.step_um) * 1e-6
}

/// For each row edge, the x-interval that holds at every yaw of the slab: the intersection over
/// nodes so close that what happens between them is below a hundredth of a cell.
fn lines_of_slab(
    set: &SuccessSet,
    cells: &Cells,
    [from, to]: [f64; 2],
    y_at: impl Fn(u16) -> f64,
) -> Vec<Option<[f64; 2]>> {
    let reach = super::reach(cells);
    let curvature = Node::curvature(set, reach);
    let wanted = 0.01 * step(cells);
    let parts = libm::ceil((to - from) * libm::sqrt(curvature / (8.0 * wanted))).clamp(1.0, 1e4);
    let width = (to - from) / parts;
    // A function with |g''| <= c dips below the smaller of its ends by at most c w^2 / 8.
    let dip = curvature * width * width / 8.0 + 1e-9;
    // A step wider than the cells, so that only the set ends a run.
    let x_lo = f64::from(cells.x_lo_um) * 1e-6;
    let x_hi = x_lo + f64::from(cells.columns) * step(cells);
    let x = [x_lo - step(cells), x_hi + step(cells)];
    let y = [y_at(0), y_at(cells.rows)];
    let ys: Vec<f64> = (0..=cells.rows).map(y_at).collect();
    let mut lines = vec![x; ys.len()];
    for part in 0..=(parts as u32) {
        if !lines.iter().any(meets) {
            break;
        }
        let node = Node::at(set, from + width * f64::from(part), dip);
        node.within(x, y).draw_in(&ys, &mut lines);
    }
    lines
        .into_iter()
        .map(|line| meets(&line).then_some(line))
        .collect()
}

/// The cells that lie within a line.
fn run([lo, hi]: [f64; 2], cells: &Cells) -> Option<Run> {
    let x_lo = f64::from(cells.x_lo_um) * 1e-6;
    let last = f64::from(cells.columns);
    // Edges that are the border's own but for their rounding count as inside it.
    let first = libm::ceil((lo + CLEARANCE - x_lo - ROUNDING) / step(cells)).clamp(0.0, last);
    let end = libm::floor((hi - CLEARANCE - x_lo + ROUNDING) / step(cells)).clamp(0.0, last);
    (first < end).then_some(Run {
        first: first as u16,
        last: (end - 1.0) as u16,
    })
}
