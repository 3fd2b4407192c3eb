//! A pose-set against a grid: the walk over slabs and rows.
//!
//! For each yaw slab that the set can touch, the set is cut to the slab, and its extent along x and y
//! is computed, rounded up. Every row that the cut can touch must have a run that covers the cut's
//! extent along x. If it has none, the row gets a sharper test of the cut *within the row*
//! (`Section::fits_row`). All slabs and all rows must pass.
//!
//! Slabs are widened by [`SLACK_Q24`] and rows by [`SLACK_UM`], and the ends of runs are moved inwards
//! by [`SLACK_UM`]. A pose of the true set in a slab and row then has a neighbour in the integer set
//! within the widened slab and row. Each step is about that neighbour.

use super::section::{Offset, Section, Side, Window};
use super::{SLACK_Q24, SLACK_UM};
use crate::num::Divisor;
use crate::table::{Cells, Grid, Run, Slab};

/// The largest yaw offset of a set that is walked, 2^-24 turn: one turn.
pub(super) const WIDEST_Q24: i32 = 1 << 24;
const TURN: i64 = 1 << 32;

/// The reason why a walk does not show that a set is covered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// The offset of a pose that lies in no covered cell.
    NotCovered(Offset),
    /// The walk reached its limit of runs. The result for the set is unknown.
    TooCostly,
}

impl From<Offset> for Stop {
    fn from(offset: Offset) -> Self {
        Self::NotCovered(offset)
    }
}

/// Returns `Ok` if every pose of the set lies in a covered cell.
///
/// `mean` is the estimate relative to the cells' lower corner: micrometres, micrometres, 2^-32 turn. The walk reads at most
/// `most_runs` runs; a row without a run counts as one. The set turns by at most [`WIDEST_Q24`].
pub(super) fn covers<S: Section>(
    grid: &Grid<'_>,
    cells: &Cells,
    mean: [i64; 3],
    section: &S,
    most_runs: u32,
) -> Result<(), Stop> {
    let mut left = most_runs;
    let [x, y, yaw] = mean;
    let reach = section
        .yaw_q24()
        .wrapping_add(SLACK_Q24)
        .wrapping_mul(crate::num::ANGLE_UNITS_PER_Q24);
    let (low, high) = (yaw.wrapping_sub(reach), yaw.wrapping_add(reach));
    if !cells.is_whole_circle() {
        if low < 0 {
            return Err(section.yaw_end(false).into());
        }
        if high.unsigned_abs() > cells.yaw_span {
            return Err(section.yaw_end(true).into());
        }
    }
    let mut shared = S::Shared::default();
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
        let window = yaw_window(
            from.wrapping_sub(yaw),
            to.wrapping_sub(yaw),
            section.yaw_q24(),
        );
        if let Some(window) = window {
            covers_slab(
                &grid.slab(k),
                cells,
                [x, y],
                section,
                window,
                &mut shared,
                &mut left,
            )?;
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

fn covers_slab<S: Section>(
    slab: &Slab<'_>,
    cells: &Cells,
    [x, y]: [i64; 2],
    section: &S,
    yaw: [i64; 2],
    shared: &mut S::Shared,
    left: &mut u32,
) -> Result<(), Stop> {
    let cut = section.cut(yaw);
    let step = i64::from(cells.step_um);
    let Some(by_step) = Divisor::new(step) else {
        return Err(Offset::default().into());
    };
    let bottom = y.wrapping_sub(cut.bottom).wrapping_sub(SLACK_UM);
    let top = y.wrapping_add(cut.top).wrapping_add(SLACK_UM);
    if bottom < 0 {
        return Err(section.y_end(false, yaw).into());
    }
    if top > step.wrapping_mul(i64::from(cells.rows)) {
        return Err(section.y_end(true, yaw).into());
    }
    // Columns that a run must cover: from the column with the left end to the column with the right
    // end (or that ends at it).
    let first = by_step.floor(x.wrapping_sub(cut.left).wrapping_sub(SLACK_UM));
    let right = x.wrapping_add(cut.right).wrapping_add(SLACK_UM);
    let last = by_step.ceil(right).wrapping_sub(1);
    let first_row = by_step.floor(bottom);
    let last_row = by_step.ceil(top).wrapping_sub(1).max(first_row);
    let mut row = first_row;
    while row <= last_row {
        let low = row.wrapping_mul(step).wrapping_sub(y);
        let window = Window {
            y: [
                low.wrapping_sub(SLACK_UM),
                low.wrapping_add(step).wrapping_add(SLACK_UM),
            ],
            yaw,
        };
        let mut fits = |run: Run| {
            let (from, to) = (i64::from(run.first), i64::from(run.last));
            let left = || {
                x.wrapping_sub(from.wrapping_mul(step))
                    .wrapping_sub(SLACK_UM)
            };
            let right = || {
                to.wrapping_add(1)
                    .wrapping_mul(step)
                    .wrapping_sub(x)
                    .wrapping_sub(SLACK_UM)
            };
            if !(from <= first || section.fits_row(Side::Left, &window, left(), shared)) {
                return Err(Side::Left);
            }
            if !(to >= last || section.fits_row(Side::Right, &window, right(), shared)) {
                return Err(Side::Right);
            }
            Ok(())
        };
        let mut answer = None;
        let number = u16::try_from(row).unwrap_or(u16::MAX);
        for run in slab.runs(number) {
            *left = left.checked_sub(1).ok_or(Stop::TooCostly)?;
            let fit = fits(run);
            answer = Some(fit);
            if fit.is_ok() {
                break;
            }
        }
        match answer {
            Some(Ok(())) => {}
            Some(Err(side)) => return Err(section.row_end(side, &window).into()),
            None => {
                *left = left.checked_sub(1).ok_or(Stop::TooCostly)?;
                return Err(section.row_end(Side::Right, &window).into());
            }
        }
        row = row.wrapping_add(1);
    }
    Ok(())
}
