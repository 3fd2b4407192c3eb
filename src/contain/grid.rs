//! A pose-set against a grid: the plainest test that works, and the one that facets are compared with.
//!
//! For each slab of headings that the set can touch, the part of the set in the slab has a box along x and y, rounded up. The box must lie in
//! covered cells: in every row that it touches, one run must cover all of its columns. A set that leans is smaller than its boxes, so this test denies
//! more than facets do.
//!
//! Slabs are widened by [`SLACK_Q24`], and boxes on each side by [`SLACK_UM`]. A pose of the true set in a slab then has a neighbour in the
//! integer set, within the widened slab and box. The walk is about that neighbour.

use super::support::{held, reach};
use super::{SLACK_Q24, SLACK_UM};
use crate::num::Divisor;
use crate::set::{Extent, Growth, SqrtFactor, broad_um};
use crate::table::{Cells, Grid, Slab};

/// The largest yaw offset of an ellipsoid that is walked, 2^-24 turn: one turn.
const WIDEST_Q24: i64 = 1 << 24;
/// Half a turn, 2^-24 turn: from this on, a cylinder has every heading.
const HALF_TURN_Q24: i64 = 1 << 23;
const TURN: i64 = 1 << 32;

/// The reason why a walk does not show that a set is covered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// A cell that the set may touch is not covered.
    NotCovered,
    /// The walk reached its limit of runs. The result for the set is unknown.
    TooCostly,
}

/// A pose-set in the goal's axes: an ellipsoid, or a point, moved by a disc and a turn.
struct Walked {
    factor: Option<SqrtFactor>,
    /// The radius of the disc, micrometres.
    radius: i64,
    /// The turn beyond that of the ellipsoid, 2^-24 turn.
    swing: i64,
    /// The largest yaw offset, 2^-24 turn.
    yaw: i64,
}

/// Upper bounds of a set's reach from the estimate within a slab, micrometres.
struct Reach {
    left: i64,
    right: i64,
    bottom: i64,
    top: i64,
}

impl Walked {
    fn of(extent: Extent) -> Self {
        match extent {
            Extent::Gaussian(factor) => Self::grown(factor, Growth::NONE),
            Extent::Grown { factor, by } => Self::grown(factor, by),
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => Self::cylinder(translation_um.into(), yaw_q24.into()),
        }
    }

    fn cylinder(radius: i64, yaw: i64) -> Self {
        let yaw = yaw.min(HALF_TURN_Q24);
        Self {
            factor: None,
            radius,
            swing: yaw,
            yaw,
        }
    }

    fn grown(factor: SqrtFactor, by: Growth) -> Self {
        let radius = i64::from(by.translation_um());
        let swing = i64::from(by.yaw_q24());
        let yaw = i64::from(factor.yaw).wrapping_add(swing);
        if yaw > WIDEST_Q24 {
            // It has every heading, with the places of several of its offsets: those of the cylinder that contains it are walked.
            return Self::cylinder(radius.wrapping_add(broad_um(&factor).into()), yaw);
        }
        Self {
            factor: Some(factor),
            radius,
            swing,
            yaw,
        }
    }

    /// Returns the reach of the set for yaw offsets in a window.
    fn reach(&self, [low, high]: [i64; 2]) -> Reach {
        let along = |row: Option<[i32; 3]>| {
            let most = row.zip(self.factor).map_or(0, |(row, factor)| {
                let yaw = i64::from(factor.yaw);
                // Before the movement's turn.
                let part = [low.wrapping_sub(self.swing), high.wrapping_add(self.swing)]
                    .map(|v| v.max(yaw.wrapping_neg()).min(yaw));
                reach(row, factor.yaw, held(row, factor.yaw, part))
            });
            most.wrapping_add(self.radius)
        };
        let x = self.factor.map(|factor| factor.x);
        let y = self.factor.map(|factor| factor.y);
        let opposite = |row: Option<[i32; 3]>| row.map(|row| row.map(i32::wrapping_neg));
        Reach {
            left: along(opposite(x)),
            right: along(x),
            bottom: along(opposite(y)),
            top: along(y),
        }
    }
}

/// Returns `Ok` if every pose of a set lies in a covered cell.
///
/// `mean` is the estimate relative to the cells' lower corner: micrometres, micrometres, 2^-32 turn. `extent` is in the goal's axes. The walk reads
/// at most `most_runs` runs; a row without a run counts as one.
pub(super) fn covers(
    grid: &Grid<'_>,
    cells: &Cells,
    mean: [i64; 3],
    extent: Extent,
    most_runs: u32,
) -> Result<(), Stop> {
    let set = Walked::of(extent);
    let mut left = most_runs;
    let [x, y, yaw] = mean;
    let turn = set
        .yaw
        .wrapping_add(SLACK_Q24)
        .wrapping_mul(crate::num::ANGLE_UNITS_PER_Q24);
    let (low, high) = (yaw.wrapping_sub(turn), yaw.wrapping_add(turn));
    if !cells.is_whole_circle() && (low < 0 || high.unsigned_abs() > cells.yaw_span) {
        return Err(Stop::NotCovered);
    }
    // On the whole circle the range may begin one or two turns early.
    let mut turns = (low >> 32).wrapping_mul(TURN);
    let mut k = cells.slab_of(low.wrapping_sub(turns));
    // A range of two turns and the slack may meet two slabs at both of its ends.
    for _ in 0..u32::from(cells.slabs).saturating_add(1).wrapping_mul(2) {
        let from = cells.slab_edge(k).wrapping_add(turns);
        let to = cells.slab_edge(k.saturating_add(1)).wrapping_add(turns);
        if from > high {
            return Ok(());
        }
        let window = yaw_window(from.wrapping_sub(yaw), to.wrapping_sub(yaw), set.yaw);
        if let Some(window) = window {
            box_is_covered(&grid.slab(k), cells, [x, y], &set.reach(window), &mut left)?;
        }
        k = k.saturating_add(1);
        if k >= cells.slabs {
            if !cells.is_whole_circle() {
                return Ok(());
            }
            k = 0;
            turns = turns.wrapping_add(TURN);
        }
    }
    Ok(())
}

/// Returns the widened slab relative to the estimate in units of 2^-24 turn, cut to the set, or `None`
/// if the set does not reach it.
fn yaw_window(from: i64, to: i64, yaw_q24: i64) -> Option<[i64; 2]> {
    // Shifting right rounds down; negating twice rounds up.
    let low = (from >> 8)
        .wrapping_sub(SLACK_Q24)
        .max(yaw_q24.wrapping_neg());
    let high = (to.wrapping_neg() >> 8)
        .wrapping_neg()
        .wrapping_add(SLACK_Q24)
        .min(yaw_q24);
    (low <= high).then_some([low, high])
}

/// Returns `Ok` if a slab covers a box about the estimate.
fn box_is_covered(
    slab: &Slab<'_>,
    cells: &Cells,
    [x, y]: [i64; 2],
    reach: &Reach,
    left: &mut u32,
) -> Result<(), Stop> {
    let by_step = Divisor::new(cells.step_um.into()).ok_or(Stop::NotCovered)?;
    // From the cell with the lower end to the cell with the upper end (or that ends at it).
    let range = |at: i64, below: i64, above: i64| {
        let first = by_step.floor(at.wrapping_sub(below).wrapping_sub(SLACK_UM));
        let end = by_step.ceil(at.wrapping_add(above).wrapping_add(SLACK_UM));
        (first, end.wrapping_sub(1).max(first))
    };
    let (first, last) = range(x, reach.left, reach.right);
    let (bottom, top) = range(y, reach.bottom, reach.top);
    if bottom < 0 || top >= i64::from(cells.rows) {
        return Err(Stop::NotCovered);
    }
    for row in bottom..=top {
        let row = u16::try_from(row).map_err(|_| Stop::NotCovered)?;
        let mut is_covered = false;
        // A row without a run counts as one.
        let mut read = 0u32;
        for run in slab.runs(row) {
            *left = left.checked_sub(1).ok_or(Stop::TooCostly)?;
            read = 1;
            is_covered = i64::from(run.first) <= first && i64::from(run.last) >= last;
            if is_covered {
                break;
            }
        }
        *left = left
            .checked_sub(1u32.wrapping_sub(read))
            .ok_or(Stop::TooCostly)?;
        if !is_covered {
            return Err(Stop::NotCovered);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error_budget::Random;

    /// The robot may have turned by the movement: a part of a slab has the places of other offsets of the ellipsoid.
    #[test]
    fn a_movement_widens_the_window() {
        let mut random = Random::new(3);
        let mut wider = 0;
        for _ in 0..2_000 {
            let mut entry = |most: f64| (random.within(-1.0, 1.0) * most) as i32;
            let (x, y) = (
                [0; 3].map(|_| entry(15_000.0)),
                [0; 3].map(|_| entry(15_000.0)),
            );
            let yaw = random.log_within(10.0, 8e6) as i32;
            let factor = SqrtFactor { yaw, x, y };
            let swing = random.log_within(1.0, 4e6) as u32;
            let by = Growth::new(random.log_within(1.0, 1e4) as u32, swing);
            let set = Walked::of(Extent::Grown { factor, by });
            let whole = f64::from(yaw) + f64::from(swing);
            let mut ends = [0; 2].map(|_| (random.within(-1.0, 1.0) * whole) as i64);
            ends.sort_unstable();
            let found = set.reach(ends);
            for (row, found) in [
                (x, found.right),
                (x.map(|v| -v), found.left),
                (y, found.top),
                (y.map(|v| -v), found.bottom),
            ] {
                // Poses of the ellipsoid whose offset the movement takes into the window.
                let most = (0..=400).map(|k| {
                    let [low, high] = ends.map(|end| end as f64);
                    let offset = low + (high - low) * f64::from(k % 21) / 20.0;
                    let turn = f64::from(swing) * (f64::from(k / 21) / 9.5 - 1.0);
                    let u = (offset - turn) / f64::from(yaw);
                    if u.abs() > 1.0 {
                        return f64::MIN;
                    }
                    let [a, b, c] = row.map(f64::from);
                    a * u + b.hypot(c) * (1.0 - u * u).sqrt()
                });
                let most = most.fold(f64::MIN, f64::max) + f64::from(by.translation_um());
                assert!(
                    found as f64 >= most - 1e-6,
                    "{found} {most} {factor:?} {by:?}"
                );
            }
            let alone = Walked::of(Extent::Gaussian(factor))
                .reach(ends.map(|end| end.clamp(-i64::from(yaw), yaw.into())));
            wider += u32::from(found.right > alone.right + i64::from(by.translation_um()));
        }
        assert!(wider > 200, "{wider}");
    }

    /// The limit counts every run that is read, also within a row.
    #[test]
    fn limit_counts_the_runs_of_a_row() {
        use crate::table::{
            Table,
            tests::{Rows, table_of},
        };
        let cells = Cells {
            x_lo_um: 0,
            y_lo_um: 0,
            step_um: 1_000,
            columns: 100,
            rows: 1,
            yaw_lo: crate::num::BinaryAngle(0),
            yaw_span: 1 << 32,
            slabs: 1,
        };
        let runs = (0..33).map(|k| (3 * k, 3 * k + 1)).collect();
        let bytes = table_of(
            &cells,
            &[Rows {
                first_row: 0,
                runs: vec![runs],
            }],
            true,
        );
        let table = Table::parse(&bytes).unwrap();
        let grid = table.grid().unwrap();
        let point = Extent::Bounded {
            translation_um: 0,
            yaw_q24: 0,
        };
        // In the last run.
        let mean = [97_000, 500, 1 << 20];
        let walked = |limit| covers(grid, &cells, mean, point, limit);
        assert_eq!(walked(33), Ok(()));
        for limit in [0, 1, 32] {
            assert_eq!(walked(limit), Err(Stop::TooCostly));
        }
    }
}
