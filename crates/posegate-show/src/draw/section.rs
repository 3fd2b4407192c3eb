//! Sections of success sets and of tables at one heading.

use super::panel::{Cell, Window};
use posegate::num::BinaryAngle;
use posegate::table::{Run, Slab, Table};
use std::collections::BTreeMap;

/// Returns the border of an area as closed polygons, counter-clockwise around the inside and
/// clockwise around holes.
///
/// The area is sampled on a lattice of `spacing` metres over the window. Where it changes along an
/// edge of the lattice, the border is found by bisection. Parts thinner than the spacing may be
/// missed; corners of the border are cut by less than the spacing. Polygons that run into the
/// window's edge are closed outside of it.
#[must_use]
pub fn border(
    inside: &impl Fn([f64; 2]) -> bool,
    window: &Window,
    spacing: f64,
) -> Vec<Vec<[f64; 2]>> {
    let lattice = Lattice {
        origin: [window.x[0] - spacing, window.y[0] - spacing],
        spacing,
    };
    let count = |[lo, hi]: [f64; 2]| libm::ceil((hi - lo) / spacing) as usize + 3;
    let (columns, rows) = (count(window.x), count(window.y));
    // The outermost ring is treated as outside, so every polygon is closed.
    let ring = |i, j| i == 0 || j == 0 || i + 1 == columns || j + 1 == rows;
    let nodes: Vec<bool> = (0..rows)
        .flat_map(|j| (0..columns).map(move |i| (i, j)))
        .map(|(i, j)| !ring(i, j) && inside(lattice.node(i, j)))
        .collect();
    let node = |i: usize, j: usize| nodes[j * columns + i];
    let mut next: BTreeMap<Edge, Edge> = BTreeMap::new();
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let corners = [
                node(i, j),
                node(i + 1, j),
                node(i + 1, j + 1),
                node(i, j + 1),
            ];
            for (from, to) in crossings(corners) {
                let _ = next.insert(Edge::of_square(i, j, from), Edge::of_square(i, j, to));
            }
        }
    }
    let mut polygons = Vec::new();
    while let Some((&start, _)) = next.iter().next() {
        let mut polygon = Vec::new();
        let mut edge = start;
        while let Some(following) = next.remove(&edge) {
            polygon.push(lattice.border(edge, inside));
            edge = following;
        }
        polygons.push(simplified(&polygon, 0.02 * spacing));
    }
    polygons
}

/// An edge of the lattice: from a node along x, or along y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    i: usize,
    j: usize,
    along_y: bool,
}

impl Edge {
    /// Side 0 to 3 of a square: below, right, above, left.
    fn of_square(i: usize, j: usize, side: usize) -> Self {
        let (i, j, along_y) = match side {
            0 => (i, j, false),
            1 => (i + 1, j, true),
            2 => (i, j + 1, false),
            _ => (i, j, true),
        };
        Self { i, j, along_y }
    }
}

/// Returns the pieces of border in a square, each from side to side with the inside on its left.
///
/// Corners and sides are counted counter-clockwise: side k runs from corner k to the next. On a walk
/// around the square, the border enters on a side from outside to inside and leaves on a side from
/// inside to outside. Two diagonal inside corners get a piece each.
fn crossings(corners: [bool; 4]) -> Vec<(usize, usize)> {
    let turns = |side: usize, from: bool| corners[side] == from && corners[(side + 1) % 4] != from;
    (0..4)
        .filter(|side| turns(*side, true))
        .filter_map(|leaves| {
            // Go back along the inside corners to the side on which they began.
            let enters = (1..4)
                .map(|back| (leaves + 4 - back) % 4)
                .find(|side| turns(*side, false))?;
            Some((leaves, enters))
        })
        .collect()
}

struct Lattice {
    origin: [f64; 2],
    spacing: f64,
}

impl Lattice {
    fn node(&self, i: usize, j: usize) -> [f64; 2] {
        [
            self.origin[0] + i as f64 * self.spacing,
            self.origin[1] + j as f64 * self.spacing,
        ]
    }

    /// Returns the point where the border crosses an edge.
    fn border(&self, edge: Edge, inside: &impl Fn([f64; 2]) -> bool) -> [f64; 2] {
        let a = self.node(edge.i, edge.j);
        let b = if edge.along_y {
            self.node(edge.i, edge.j + 1)
        } else {
            self.node(edge.i + 1, edge.j)
        };
        let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
        let first = inside(a);
        let (mut lo, mut hi) = (0.0, 1.0);
        for _ in 0..12 {
            let middle = 0.5 * (lo + hi);
            if inside(at(middle)) == first {
                lo = middle;
            } else {
                hi = middle;
            }
        }
        at(0.5 * (lo + hi))
    }
}

/// Returns a closed polygon without the points that lie within `tolerance` of the simplified line
/// (Douglas and Peucker).
fn simplified(polygon: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    let Some(&first) = polygon.first() else {
        return Vec::new();
    };
    let distance = |p: &[f64; 2]| libm::hypot(p[0] - first[0], p[1] - first[1]);
    let far = (0..polygon.len())
        .max_by(|a, b| distance(&polygon[*a]).total_cmp(&distance(&polygon[*b])))
        .unwrap_or(0);
    let mut closed = polygon.to_vec();
    closed.push(first);
    let mut kept = std::vec![first];
    keep(&closed[..=far], tolerance, &mut kept);
    keep(&closed[far..], tolerance, &mut kept);
    let _ = kept.pop();
    kept
}

/// Keeps the necessary points of a line after its first point; always keeps the last point.
fn keep(line: &[[f64; 2]], tolerance: f64, kept: &mut Vec<[f64; 2]>) {
    let [a, .., b] = line else {
        return;
    };
    let length = libm::hypot(b[0] - a[0], b[1] - a[1]).max(1e-12);
    let off = |p: &[f64; 2]| {
        ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])).abs() / length
    };
    let farthest = (1..line.len() - 1).max_by(|i, j| off(&line[*i]).total_cmp(&off(&line[*j])));
    match farthest {
        Some(index) if off(&line[index]) > tolerance => {
            keep(&line[..=index], tolerance, kept);
            keep(&line[index..], tolerance, kept);
        }
        _ => kept.push(*b),
    }
}

/// Returns the cells that a table covers at a heading of the goal frame, with equal rows joined.
///
/// At a heading where two slabs meet, a pose-set must lie in both, so only cells that both cover are
/// returned.
#[must_use]
pub fn covered(table: &Table<'_>, yaw_deg: f64) -> Vec<Cell> {
    let cells = table.cells();
    let (Some(grid), Some(yaw)) = (
        table.grid(),
        BinaryAngle::from_radians(yaw_deg.to_radians()),
    ) else {
        return Vec::new();
    };
    // Degrees are rarely exact binary angles: within two units of an edge counts as on the edge.
    let mut slabs: Vec<u16> = [u32::MAX - 1, 0, 2]
        .into_iter()
        .map(|off| yaw.plus(BinaryAngle(off)).minus(cells.yaw_lo).0)
        .filter(|offset| u64::from(*offset) <= cells.yaw_span)
        .map(|offset| cells.slab_of(i64::from(offset)))
        .collect();
    slabs.dedup();
    let slabs: Vec<Slab<'_>> = slabs.into_iter().map(|k| grid.slab(k)).collect();
    let Some((first, others)) = slabs.split_first() else {
        return Vec::new();
    };
    let metres = |lo_um: i32, index: usize| {
        (f64::from(lo_um) + index as f64 * f64::from(cells.step_um)) * 1e-6
    };
    let mut rectangles = Vec::new();
    let mut open: (usize, Vec<Run>) = (0, Vec::new());
    for row in 0..=cells.rows {
        // One row past the last, without runs, closes the open rectangles.
        let runs = others
            .iter()
            .fold(first.runs(row).collect(), |runs: Vec<Run>, slab| {
                common(&runs, slab.runs(row))
            });
        if runs != open.1 {
            for run in &open.1 {
                rectangles.push(Cell {
                    x: [
                        metres(cells.x_lo_um, usize::from(run.first)),
                        metres(cells.x_lo_um, usize::from(run.last) + 1),
                    ],
                    y: [open.0, usize::from(row)].map(|row| metres(cells.y_lo_um, row)),
                });
            }
            open = (usize::from(row), runs);
        }
    }
    rectangles
}

/// Returns the intersection of the runs of two rows.
fn common(runs: &[Run], other: impl Iterator<Item = Run>) -> Vec<Run> {
    other
        .flat_map(|b| {
            runs.iter().filter_map(move |a| {
                let (first, last) = (a.first.max(b.first), a.last.min(b.last));
                (first <= last).then_some(Run { first, last })
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate::shape::{BoxSet, PoseDeg, Scalar, Shape, SuccessSet};

    /// Returns the border of a set's section at a heading of the goal frame.
    fn outline(
        set: &SuccessSet,
        yaw_deg: f64,
        window: &Window,
        spacing: f64,
    ) -> Vec<Vec<[f64; 2]>> {
        let inside = |[x, y]: [f64; 2]| {
            let goal = set.goal;
            let [c, s] = f64::cos_sin_deg(goal.yaw_deg);
            let world = [
                goal.x + c * x - s * y,
                goal.y + s * x + c * y,
                (goal.yaw_deg + yaw_deg).to_radians(),
            ];
            set.membership(world).inside
        };
        border(&inside, window, spacing)
    }

    fn unit_box(goal: PoseDeg) -> SuccessSet {
        SuccessSet {
            goal,
            shape: Shape::Box(BoxSet {
                x: [-0.5, 0.5],
                y: [-0.25, 0.25],
                yaw_deg: [-4.0, 4.0],
            }),
        }
    }

    const WINDOW: Window = Window {
        x: [-1.0, 1.0],
        y: [-1.0, 1.0],
    };

    #[test]
    fn outline_is_the_border_of_the_set() {
        let goal = PoseDeg {
            x: 3.0,
            y: -2.0,
            yaw_deg: 130.0,
        };
        let outline = outline(&unit_box(goal), 3.0, &WINDOW, 0.013);
        assert_eq!(outline.len(), 1);
        // Twice the area, counter-clockwise: positive.
        let ends = outline[0].iter().cycle().skip(1);
        let doubled: f64 = outline[0]
            .iter()
            .zip(ends)
            .map(|(a, b)| a[0] * b[1] - b[0] * a[1])
            .sum();
        assert!((doubled - 1.0).abs() < 1e-3, "{doubled}");
        for [x, y] in &outline[0] {
            let off = (x.abs() - 0.5).abs().min((y.abs() - 0.25).abs());
            assert!(off < 1e-5, "{x} {y}");
        }
        assert!(outline[0].len() < 20);
    }

    #[test]
    fn empty_section_has_no_outline() {
        let goal = PoseDeg {
            x: 0.0,
            y: 0.0,
            yaw_deg: 0.0,
        };
        assert!(outline(&unit_box(goal), 5.0, &WINDOW, 0.02).is_empty());
    }

    #[test]
    fn each_diagonal_corner_has_one_piece() {
        assert_eq!(crossings([true, false, true, false]), [(0, 3), (2, 1)]);
        assert_eq!(crossings([true, true, false, false]), [(1, 3)]);
        assert!(crossings([true; 4]).is_empty() && crossings([false; 4]).is_empty());
    }

    #[test]
    fn common_runs_are_intersections() {
        let run = |first, last| Run { first, last };
        let a = [run(0, 4), run(8, 9)];
        let b = [run(3, 8)];
        assert_eq!(common(&a, b.into_iter()), [run(3, 4), run(8, 8)]);
    }
}
