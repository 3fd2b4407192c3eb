//! The runs of every row: the cells that lie in the set.

use super::slab_edge;
use crate::certify::radians;
use crate::shape::{Binds, ConvexPart, Planar, Ready, SuccessSet, is_whole_circle};
use crate::table::{Cells, Run};
use rayon::prelude::*;

/// The runs of each row of a slab.
pub type Rows = Vec<Vec<Run>>;

/// Distance that runs keep from a curved border, metres: covers the rounding of the computation.
const CLEARANCE: f64 = 1e-8;

/// Largest distance by which an edge on a border may seem to be outside of it, metres: half of the proof's allowance.
const ROUNDING: f64 = 5e-12;

/// Number of sampled poses along x, y and yaw that choose the parts of a non-convex set.
const LOOKS: [u32; 3] = [24, 24, 12];
/// Largest number of parts in which cells are searched.
const MOST_PARTS: usize = 96;

/// Returns the runs of every slab, in order.
pub(super) fn of_set(set: &SuccessSet, cells: &Cells, progress: &(dyn Fn() + Sync)) -> Vec<Rows> {
    let parts = super::parts::covering(set, super::parts::ranges(cells), LOOKS, MOST_PARTS);
    (0..cells.slabs)
        .into_par_iter()
        .map(|k| {
            let mut rows: Rows = vec![Vec::new(); usize::from(cells.rows)];
            for part in &parts {
                for (row, run) in rows.iter_mut().zip(of_slab(part, cells, k)) {
                    row.extend(run);
                }
            }
            rows.iter_mut().for_each(unite);
            progress();
            rows
        })
        .collect()
}

/// Replaces the runs of a row by their union in order.
fn unite(runs: &mut Vec<Run>) {
    runs.sort_unstable_by_key(|run| (run.first, run.last));
    runs.dedup_by(|next, known| {
        let joins = u32::from(next.first) <= u32::from(known.last) + 1;
        if joins {
            known.last = known.last.max(next.last);
        }
        joins
    });
}

/// The first and the last edge of cells on a line of constant y that lie in a set; none if the first is beyond the last.
type Edges = [u16; 2];

/// No edge of a line.
const NONE: Edges = [u16::MAX, 0];

fn intersect(a: Edges, b: Edges) -> Edges {
    [a[0].max(b[0]), a[1].min(b[1])]
}

/// Returns the run of each row of a slab of a convex set.
fn of_slab(part: &ConvexPart, cells: &Cells, k: u16) -> impl Iterator<Item = Option<Run>> {
    let yaw = [slab_edge(cells, k), slab_edge(cells, k + 1)].map(radians);
    let slab = Slab::of(cells);
    let mut lines = if part.boxes().count() == part.constraints().count() {
        vec![[0, cells.columns]; slab.lines()]
    } else {
        slab.edges(part, yaw)
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
        // Edges on the border except for their rounding count as inside.
        let within = |from: f64, [lo, hi]: [f64; 2], last: u16| {
            let first = libm::ceil((lo - ROUNDING - from) / slab.step);
            let end = libm::floor((hi + ROUNDING - from) / slab.step);
            if turned && end >= 0.0 {
                [first as u16, (end as u16).min(last)]
            } else {
                NONE
            }
        };
        let across = within(slab.y_lo, shape.y, cells.rows);
        let along = within(slab.x_lo, shape.x, cells.columns);
        for (j, line) in (0..).zip(&mut lines) {
            let holds = across[0] <= j && j <= across[1];
            *line = if holds { intersect(*line, along) } else { NONE };
        }
    }
    (0..usize::from(cells.rows)).map(move |j| {
        let [first, end] = intersect(lines[j], lines[j + 1]);
        let last = end.wrapping_sub(1);
        (first < end).then_some(Run { first, last })
    })
}

/// The edges of the cells in metres, goal frame.
struct Slab<'a> {
    cells: &'a Cells,
    x_lo: f64,
    y_lo: f64,
    step: f64,
}

/// Number of places from one edge to the next at which a line is tried: as many as a table can have rows. Then a set that widens from row to row
/// has a cell before the places miss it.
const PLACES: u32 = 32_768;

impl<'a> Slab<'a> {
    fn of(cells: &'a Cells) -> Self {
        Self {
            cells,
            x_lo: f64::from(cells.x_lo_um) * 1e-6,
            y_lo: f64::from(cells.y_lo_um) * 1e-6,
            step: f64::from(cells.step_um) * 1e-6,
        }
    }

    /// Returns the number of lines of constant y: the edges of all rows.
    fn lines(&self) -> usize {
        usize::from(self.cells.rows) + 1
    }

    /// Returns for each line the edges that lie in a part at every yaw of the slab. (Without its boxes.)
    ///
    /// They are evaluated at yaw samples that are so close that the change between them is below a hundredth of a cell. At a yaw every
    /// slack is concave in (x, y), and so is the least of them: a place inside is found by halving, then the lines on both sides of it, and on
    /// each line both ends.
    fn edges(&self, part: &ConvexPart, [from, to]: [f64; 2]) -> Vec<Edges> {
        let curvature = curvature(part, super::reach(self.cells));
        let wanted = 0.01 * self.step;
        let nodes =
            libm::ceil((to - from) * libm::sqrt(curvature / (8.0 * wanted))).clamp(1.0, 1e4);
        let width = (to - from) / nodes;
        // A function with |g''| <= c dips below the smaller of its ends by at most c w^2 / 8.
        let dip = curvature * width * width / 8.0 + 1e-9;
        let turns: Vec<[f64; 2]> = (0..=(nodes as u32))
            .map(|number| from + width * f64::from(number))
            .map(|yaw| [libm::cos(yaw), libm::sin(yaw)])
            .collect();
        // The slacks near a place of a line, moved by the clearance to a side.
        let slacks = |line: u16, place: u32, side: f64| {
            let x = self.x_lo + f64::from(place) * (self.step / f64::from(PLACES));
            let x = x + side * (CLEARANCE - ROUNDING);
            let y = self.y_lo + f64::from(line) * self.step;
            let at = turns.iter().map(move |[cos, sin]| [x, y, *cos, *sin]);
            at.map(|[x, y, cos, sin]| part.slack_without_boxes(&Planar { x, y, cos, sin }))
        };
        let least = |line: u16, place: u32| {
            let both = slacks(line, place, -1.0).chain(slacks(line, place, 1.0));
            both.fold(f64::INFINITY, f64::min) - dip
        };
        let is_clear =
            |line: u16, place: u32, side: f64| slacks(line, place, side).all(|slack| slack >= dip);
        let columns = self.cells.columns;
        let top = |line: u16| highest(u32::from(columns) * PLACES, |place| least(line, place));
        let middle = highest(self.cells.rows.into(), |line| {
            least(line as u16, top(line as u16))
        }) as u16;
        let mut edges = vec![NONE; self.lines()];
        let mut fill = |lines: &mut dyn Iterator<Item = u16>| {
            let mut place = top(middle);
            for line in lines {
                let is_inside = |place| is_clear(line, place, -1.0) && is_clear(line, place, 1.0);
                if !is_inside(place) {
                    place = top(line);
                    if !is_inside(place) {
                        return;
                    }
                }
                let clear = |edge: u16, side| is_clear(line, u32::from(edge) * PLACES, side);
                let [before, after] = [place / PLACES, place.div_ceil(PLACES)].map(|at| at as u16);
                let first = farthest(after, 0, |edge| clear(edge, -1.0));
                let last = farthest(before, columns, |edge| clear(edge, 1.0));
                edges[usize::from(line)] = [first, last];
                place = u32::from(first.midpoint(last)) * PLACES;
            }
        };
        fill(&mut (0..=middle).rev());
        fill(&mut (middle + 1..=self.cells.rows));
        edges
    }
}

/// Returns a number up to `last` at which a function that rises and then falls is at least 0; the one of its largest value if it is not.
fn highest(mut last: u32, value: impl Fn(u32) -> f64) -> u32 {
    let mut first = 0;
    while first < last {
        let middle = first.midpoint(last);
        let here = value(middle);
        if here >= 0.0 {
            return middle;
        }
        if here < value(middle + 1) {
            first = middle + 1;
        } else {
            last = middle;
        }
    }
    first
}

/// Returns the number nearest to `end` that holds, where all from there to `start` hold; `start`, which is not tried, if no other does.
fn farthest(start: u16, end: u16, holds: impl Fn(u16) -> bool) -> u16 {
    if start == end || holds(end) {
        return end;
    }
    let (mut inside, mut outside) = (start, end);
    while inside.abs_diff(outside) > 1 {
        let middle = inside.midpoint(outside);
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

/// Returns a bound on the second derivative by the yaw of every constraint, metres, for poses up to `reach` from the goal.
fn curvature(part: &ConvexPart, reach: f64) -> f64 {
    let away = |[x, y]: &[f64; 2]| libm::hypot(*x, *y);
    let of = |set: &Ready<f64>| match set {
        Ready::Box(_) | Ready::Nothing => 0.0,
        // A vertex moves on a circle.
        Ready::Footprint(shape) => shape.lever(),
        // The tag moves around the robot, the camera around the robot's centre; |r| of a point
        // on a circle of radius m has |r|'' <= m + m^2 / |r|.
        Ready::Visibility(tag) => {
            let corners = tag.corners.iter().map(|[x, y, _]| away(&[*x, *y]));
            let arm = away(&[tag.set.mount.x, tag.set.mount.y]);
            let near = tag.set.z_near.max(0.01);
            2.0 * (corners.fold(0.0, f64::max) + reach) + arm + arm * arm / near
        }
        // A point of the robot moves around its centre, a point of the goal frame around the robot.
        Ready::Side(line) => {
            let farthest = line.points.iter().map(away).fold(0.0, f64::max);
            match line.binds {
                Binds::Robot => farthest,
                Binds::Goal => farthest + reach,
            }
        }
    };
    part.ready().map(of).fold(0.0, f64::max)
}
