//! The volume of SE(2) that a table contains.

use super::facets::{Line, lines};
use crate::certify::{Interval, goal_cos_sin, radians};
use crate::shape::SuccessSet;
use crate::table::Table;
use rayon::prelude::*;

/// Number of headings, and of lines of constant y at each, at which facets are evaluated.
const HEADINGS: i64 = 720;
const LINES: i32 = 1_500;

/// The volumes of a table's cells and facets. The cells are summed; the facets are integrated over lines, accurate to
/// about 1 in 10,000.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Volume of the grid, m^2 rad; `None` without a grid.
    pub cells: Option<f64>,
    /// Volume of the facets, m^2 rad; `None` without facets.
    pub facets: Option<f64>,
}

/// Measures a table made for a success set.
#[must_use]
pub fn volume(table: &Table<'_>, success: &SuccessSet) -> Volume {
    Volume {
        cells: table.grid().map(|_| of_cells(table)),
        facets: table.facets().map(|_| of_facets(table, success)),
    }
}

fn of_cells(table: &Table<'_>) -> f64 {
    let cells = table.cells();
    let edge = f64::from(cells.step_um) * 1e-6;
    let slab = radians(cells.yaw_span as i64) / f64::from(cells.slabs);
    let Some(grid) = table.grid() else {
        return 0.0;
    };
    let mut count = 0u64;
    for slab in 0..cells.slabs {
        let rows = grid.slab(slab);
        for row in rows.first_row()..rows.first_row() + rows.rows() {
            for run in rows.runs(row) {
                count += u64::from(run.last - run.first) + 1;
            }
        }
    }
    count as f64 * edge * edge * slab
}

/// A piece's arc, 2^-32 turn above the goal's heading, and its lines.
struct Piece {
    from: i64,
    to: i64,
    lines: Vec<Line>,
}

fn of_facets(table: &Table<'_>, success: &SuccessSet) -> f64 {
    let Some(layout) = table.facets() else {
        return 0.0;
    };
    let pieces: Vec<Piece> = layout
        .pieces()
        .enumerate()
        .map(|(number, piece)| {
            let from = i64::from(piece.from);
            let width = if piece.is_whole_circle() {
                1 << 32
            } else {
                i64::from(piece.width)
            };
            Piece {
                from,
                to: from + width,
                lines: lines(layout, number),
            }
        })
        .collect();
    let [gc, gs] = goal_cos_sin(success.goal).map(Interval::middle);
    let cells = table.cells();
    let span = cells.yaw_span as i64;
    let start = i64::from(cells.yaw_lo.0);
    // World axes about the goal: the extent is rotated accordingly.
    let ends = [
        cells.x_lo_um,
        cells.x_hi_um(),
        cells.y_lo_um,
        cells.y_hi_um(),
    ];
    let reach = ends
        .iter()
        .map(|um| f64::from(*um).abs() * 1e-6)
        .fold(0.0, f64::max);
    let reach = reach * core::f64::consts::SQRT_2 + 0.01;
    let areas: f64 = (0..HEADINGS)
        .into_par_iter()
        .map(|h| {
            let units = start + span / HEADINGS * h + span / HEADINGS / 2;
            let yaw = radians(units);
            let (c, s) = (libm::cos(yaw), libm::sin(yaw));
            let turn = [gc * c - gs * s, gs * c + gc * s].map(Interval::point);
            let held: Vec<Vec<([f64; 2], f64)>> = pieces
                .iter()
                .filter(|piece| {
                    let above = (units - piece.from).rem_euclid(1 << 32);
                    above <= piece.to - piece.from
                })
                .map(|piece| {
                    let at = piece.lines.iter().map(|line| line.at(turn));
                    at.map(|half| (half.normal.map(Interval::middle), half.b.middle()))
                        .collect()
                })
                .collect();
            let step = 2.0 * reach / f64::from(LINES);
            (0..LINES)
                .map(|i| covered(&held, -reach + (f64::from(i) + 0.5) * step) * step)
                .sum::<f64>()
        })
        // In order, so that the sum does not depend on the threads.
        .collect::<Vec<f64>>()
        .into_iter()
        .sum();
    areas * radians(span) / HEADINGS as f64
}

/// Returns the length of a line of constant y that lies in any of some convex polygons.
fn covered(polygons: &[Vec<([f64; 2], f64)>], y: f64) -> f64 {
    let mut runs: Vec<[f64; 2]> = polygons
        .iter()
        .filter_map(|planes| {
            let (mut lo, mut hi) = (f64::NEG_INFINITY, f64::INFINITY);
            for ([nx, ny], b) in planes {
                let rest = b - ny * y;
                if *nx > 1e-12 {
                    hi = hi.min(rest / nx);
                } else if *nx < -1e-12 {
                    lo = lo.max(rest / nx);
                } else if rest < 0.0 {
                    return None;
                }
            }
            (lo < hi).then_some([lo, hi])
        })
        .collect();
    runs.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (mut sum, mut end) = (0.0, f64::NEG_INFINITY);
    for [lo, hi] in runs {
        sum += (hi - lo.max(end)).max(0.0);
        end = end.max(hi);
    }
    sum
}
