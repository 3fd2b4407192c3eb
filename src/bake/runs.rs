//! The runs of every row: the cells that lie in the set.

use super::lines::{Node, intersect, meets};
use super::slab_edge;
use crate::shape::{ConvexPart, Parts, SuccessSet, is_whole_circle};
use crate::table::{Cells, Run};
use rayon::prelude::*;

/// The runs of each row of a slab.
pub type Rows = Vec<Vec<Run>>;

/// A row of a slab: its runs, usually none or one.
#[derive(Clone, Debug, Default)]
pub(super) struct Row {
    first: Option<Run>,
    more: Vec<Run>,
}

impl<'a> IntoIterator for &'a Row {
    type Item = &'a Run;
    type IntoIter = core::iter::Chain<core::option::Iter<'a, Run>, core::slice::Iter<'a, Run>>;

    fn into_iter(self) -> Self::IntoIter {
        self.first.iter().chain(&self.more)
    }
}

impl Row {
    pub(super) const fn is_empty(&self) -> bool {
        self.first.is_none()
    }

    const fn of(first: Option<Run>) -> Self {
        Self {
            first,
            more: Vec::new(),
        }
    }

    /// Returns the union of runs as a row.
    fn union(rows: impl Iterator<Item = Run>) -> Self {
        let mut runs: Vec<Run> = rows.collect();
        runs.sort_unstable_by_key(|run| (run.first, run.last));
        let mut joined: Vec<Run> = Vec::with_capacity(runs.len());
        for run in runs {
            match joined.last_mut() {
                Some(last) if u32::from(run.first) <= u32::from(last.last) + 1 => {
                    last.last = last.last.max(run.last);
                }
                _ => joined.push(run),
            }
        }
        let mut joined = joined.into_iter();
        Self {
            first: joined.next(),
            more: joined.collect(),
        }
    }
}

/// Distance that runs keep from the computed border, metres: covers the rounding of the computation.
const CLEARANCE: f64 = 1e-8;

/// Largest distance by which an edge on a border may seem to be outside of it, metres: half of the proof's allowance.
const ROUNDING: f64 = 5e-12;

/// Number of sampled poses along x, y and yaw that choose the parts of a non-convex set.
const LOOKS: [u32; 3] = [24, 24, 12];
/// Largest number of parts in which cells are searched.
const MOST_PARTS: usize = 96;

/// Returns the runs of every slab, in order.
pub(super) fn of_set(
    set: &SuccessSet,
    cells: &Cells,
    progress: &(dyn Fn() + Sync),
) -> Vec<Vec<Row>> {
    let only = Parts::of(set).only();
    let several = if only.is_some() {
        Vec::new()
    } else {
        super::parts::covering(set, super::parts::ranges(cells), LOOKS, MOST_PARTS)
    };
    (0..cells.slabs)
        .into_par_iter()
        .map(|k| {
            let rows = match &only {
                Some(part) => of_slab(part, cells, k).map(Row::of).collect(),
                None => of_slab_in_parts(&several, cells, k),
            };
            progress();
            rows
        })
        .collect()
}

fn of_slab_in_parts(parts: &[ConvexPart], cells: &Cells, k: u16) -> Vec<Row> {
    let runs: Vec<Vec<Option<Run>>> = parts
        .iter()
        .map(|part| of_slab(part, cells, k).collect())
        .collect();
    (0..usize::from(cells.rows))
        .map(|j| Row::union(runs.iter().filter_map(|rows| rows[j])))
        .collect()
}

/// Returns the headings of a slab, rad.
fn headings(cells: &Cells, k: u16) -> [f64; 2] {
    let radians = |units: i64| units as f64 / 4_294_967_296.0 * core::f64::consts::TAU;
    [slab_edge(cells, k), slab_edge(cells, k + 1)].map(radians)
}

/// Returns the run of each row of a slab of a convex set.
fn of_slab(part: &ConvexPart, cells: &Cells, k: u16) -> impl Iterator<Item = Option<Run>> {
    let yaw = headings(cells, k);
    let y_at = |j: u16| f64::from(cells.y_lo_um) * 1e-6 + f64::from(j) * step(cells);
    let mut lines = if part.boxes().count() == part.constraints().count() {
        // The clearance is for curved borders; a box's border is exact.
        vec![Some([f64::NEG_INFINITY, f64::INFINITY]); usize::from(cells.rows) + 1]
    } else {
        lines_of_slab(part, cells, yaw, y_at)
    };
    for shape in part.boxes() {
        let [lo, hi] = shape.yaw_deg.map(f64::to_radians);
        let turn = core::f64::consts::TAU;
        let middle = 0.5 * (yaw[0] + yaw[1]);
        let shift = turn * libm::round((0.5 * (lo + hi) - middle) / turn);
        let whole = is_whole_circle(shape.yaw_deg);
        // A unit of 2^-32 turn, as the proof allows.
        let unit = 1.5e-9;
        let turned = whole || (yaw[0] + shift >= lo - unit && yaw[1] + shift <= hi + unit);
        for (j, line) in (0..=cells.rows).zip(&mut lines) {
            let y = y_at(j);
            let holds = turned && y >= shape.y[0] - ROUNDING && y <= shape.y[1] + ROUNDING;
            let sides = [shape.x[0] - CLEARANCE, shape.x[1] + CLEARANCE];
            *line = line
                .filter(|_| holds)
                .and_then(|line| intersect(line, sides));
        }
    }
    (0..cells.rows).map(move |j| {
        let j = usize::from(j);
        let both = lines[j]
            .zip(lines[j + 1])
            .and_then(|(a, b)| intersect(a, b));
        both.and_then(|line| run(line, cells))
    })
}

fn step(cells: &Cells) -> f64 {
    f64::from(cells.step_um) * 1e-6
}

/// Returns for each row edge the x-interval that holds at every yaw of the slab: the intersection over
/// yaw samples. The samples are so close that the change between them is below a hundredth of a cell.
fn lines_of_slab(
    part: &ConvexPart,
    cells: &Cells,
    [from, to]: [f64; 2],
    y_at: impl Fn(u16) -> f64,
) -> Vec<Option<[f64; 2]>> {
    let reach = super::reach(cells);
    let curvature = Node::curvature(part, reach);
    let wanted = 0.01 * step(cells);
    let nodes = libm::ceil((to - from) * libm::sqrt(curvature / (8.0 * wanted))).clamp(1.0, 1e4);
    let width = (to - from) / nodes;
    // A function with |g''| <= c dips below the smaller of its ends by at most c w^2 / 8.
    let dip = curvature * width * width / 8.0 + 1e-9;
    // One step wider than the cells, so that only the set ends a run.
    let x_lo = f64::from(cells.x_lo_um) * 1e-6;
    let x_hi = x_lo + f64::from(cells.columns) * step(cells);
    let x = [x_lo - step(cells), x_hi + step(cells)];
    let y = [y_at(0), y_at(cells.rows)];
    let ys: Vec<f64> = (0..=cells.rows).map(y_at).collect();
    let mut lines = vec![x; ys.len()];
    for number in 0..=(nodes as u32) {
        if !lines.iter().any(meets) {
            break;
        }
        let node = Node::at(part, from + width * f64::from(number), dip);
        node.within(x, y).draw_in(&ys, &mut lines);
    }
    lines
        .into_iter()
        .map(|line| meets(&line).then_some(line))
        .collect()
}

/// Returns the cells that lie within an interval.
fn run([lo, hi]: [f64; 2], cells: &Cells) -> Option<Run> {
    let x_lo = f64::from(cells.x_lo_um) * 1e-6;
    let last = f64::from(cells.columns);
    // Edges on the border except for their rounding count as inside.
    let first = libm::ceil((lo + CLEARANCE - x_lo - ROUNDING) / step(cells)).clamp(0.0, last);
    let end = libm::floor((hi - CLEARANCE - x_lo + ROUNDING) / step(cells)).clamp(0.0, last);
    (first < end).then_some(Run {
        first: first as u16,
        last: (end - 1.0) as u16,
    })
}
