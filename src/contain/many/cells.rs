//! The limits of a table's cells in floats: the cause of a denial, and places without a covered cell.

use super::spread::{Point, Spread};
use crate::contain::Cause;
use crate::table::{Cells, Grid, Table};

/// Upper bound of the integer code's rounding of a length in the goal frame, micrometres.
const LENGTH_SLACK: f64 = 4.0;
/// Upper bound of the integer code's rounding of a heading, 2^-32 turn.
const YAW_SLACK: f64 = 1_024.0;
/// A pose is in no cell if no cell is within this distance, micrometres. The integer code widens a row by 6, and the estimate is within 3.
const FREE: f64 = 12.0;
/// The same in yaw, 2^-32 turn.
const FREE_YAW: u32 = 2_048;

/// The cells of a table.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellLimits {
    cells: Cells,
    /// Cosine and sine of the goal's heading.
    facing: [f64; 2],
    width: f64,
    height: f64,
    span: f64,
    /// The squares of half the width, less and more the slack.
    half_width: [f64; 2],
    half_height: [f64; 2],
}

impl CellLimits {
    pub fn new(table: &Table<'_>) -> Self {
        let (cells, goal) = (*table.cells(), table.goal());
        let one = f64::from(1 << 30);
        let step = f64::from(cells.step_um);
        let (width, height) = (
            step * f64::from(cells.columns),
            step * f64::from(cells.rows),
        );
        let half = |width: f64| {
            let less = (width / 2.0 - LENGTH_SLACK).max(0.0);
            let more = width / 2.0 + LENGTH_SLACK;
            [less * less, more * more]
        };
        Self {
            cells,
            facing: [f64::from(goal.cos_q30) / one, f64::from(goal.sin_q30) / one],
            width,
            height,
            span: cells.yaw_span as f64,
            half_width: half(width),
            half_height: half(height),
        }
    }

    /// Returns x and y above the lower corner of the cells, and the heading above the lower end of their yaw range.
    fn place(&self, pose: &Point) -> ([f64; 2], u32) {
        let [c, s] = self.facing;
        let x = c * pose.x + s * pose.y - f64::from(self.cells.x_lo_um);
        let y = c * pose.y - s * pose.x - f64::from(self.cells.y_lo_um);
        ([x, y], pose.above_goal.wrapping_sub(self.cells.yaw_lo.0))
    }

    /// Returns the cause with which the integer code denies a set that nothing covers. `None` if a number is too near to a
    /// limit.
    pub fn cause(&self, spread: &Spread) -> Option<Cause> {
        let is_whole_circle = self.cells.is_whole_circle();
        let given = spread.given.turned(self.facing);
        let above = spread.above.turned(self.facing);
        // The larger extent must be below half the width, or the smaller one above it.
        let fits = |[least, most]: [f64; 2], [inner, outer]: [f64; 2]| {
            if most <= inner {
                Some(true)
            } else if least > outer {
                Some(false)
            } else {
                None
            }
        };
        let fits = [
            fits([given.xx, above.xx], self.half_width),
            fits([given.yy, above.yy], self.half_height),
            if is_whole_circle {
                Some(true)
            } else {
                let half = self.span / 2.0;
                let limits = [half - YAW_SLACK, half + YAW_SLACK];
                fits([spread.least_turn(), spread.largest_turn()], limits)
            },
        ];
        if fits.contains(&Some(false)) {
            return Some(Cause::TooLarge);
        }
        if fits.contains(&None) {
            return None;
        }
        let ([x, y], above) = self.place(&spread.estimate);
        let is_on = |at: f64, width: f64, slack: f64| {
            if at >= slack && at <= width - slack {
                Some(true)
            } else if at < -slack || at > width + slack {
                Some(false)
            } else {
                None
            }
        };
        let above = f64::from(above);
        let in_arc = if is_whole_circle {
            Some(true)
        } else if above > 4_294_967_295.0 - YAW_SLACK {
            None
        } else {
            is_on(above, self.span, YAW_SLACK)
        };
        let on = [
            is_on(x, self.width, LENGTH_SLACK),
            is_on(y, self.height, LENGTH_SLACK),
            in_arc,
        ];
        if on.contains(&Some(false)) {
            Some(Cause::OffTable)
        } else if on.contains(&None) {
            None
        } else {
            Some(Cause::NotContained)
        }
    }

    /// Returns `true` if no covered cell is near a pose.
    pub fn are_free(&self, grid: &Grid<'_>, pose: &Point) -> bool {
        let ([x, y], above) = self.place(pose);
        let span = self.cells.yaw_span;
        let low = u64::from(above.saturating_sub(FREE_YAW));
        let high = u64::from(above) + u64::from(FREE_YAW);
        if above < FREE_YAW || high >> 32 != 0 {
            // The ends of the circle may be neighbours.
            return false;
        }
        if low > span {
            return true;
        }
        let step = f64::from(self.cells.step_um);
        // Saturates; the cells of a table are fewer than 2^16 each way.
        let index = |at: f64| (at / step).floor() as i64;
        let [first, last] = [index(x - FREE), index(x + FREE)];
        let rows = index(y - FREE).max(0)..=index(y + FREE).min(i64::from(self.cells.rows) - 1);
        let slabs = self.cells.slab_of(low as i64)..=self.cells.slab_of(high as i64);
        let first_slab = slabs.start().saturating_sub(1);
        (first_slab..=*slabs.end()).all(|k| {
            let slab = grid.slab(k);
            rows.clone().all(|row| {
                let mut runs = slab.runs(row as u16);
                runs.all(|run| i64::from(run.last) < first || i64::from(run.first) > last)
            })
        })
    }
}
