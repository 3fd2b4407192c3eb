//! Containment test: is a pose-set inside the success set of a table?
//!
//! Entry points: [`decide`], [`decide_with_margin`], [`decide_with_sharp_margin`] and [`examine`].
//!
//! ```
//! use posegate::contain::{Cause, Decision, Margin, decide, decide_with_margin};
//! use posegate::set::{Estimate, PoseSet};
//! use posegate::table::Table;
//!
//! // The dock's success set is 8 cm, 6 cm and 4 degrees about (0, 0, 0).
//! let table = Table::parse(include_bytes!("../../examples/tables/dock.posegate"))?;
//! let at = |x_m| Estimate { x_m, y_m: 0.0, yaw_rad: 0.0 };
//!
//! let (decision, margin) = decide_with_margin(&table, &PoseSet::bounded(at(0.0), 0.03, 0.01)?);
//! assert_eq!(decision, Decision::Inside);
//! assert!(margin > Margin::ONE);
//!
//! // The estimate is in the success set, but the robot may be up to 3 cm away from it.
//! let outside = decide(&table, &PoseSet::bounded(at(0.06), 0.03, 0.01)?);
//! assert_eq!(outside, Decision::Outside(Cause::NotContained));
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! # What is decided
//! [`decide`] returns `Inside` only if every pose of the true pose-set lies in the pieces of the table's facets (`slab.rs`, with an error budget of
//! its own), or if the table has no facets, in its covered cells. For cells, the set is moved into the goal frame, and the slabs and rows that it can
//! touch are walked (`grid.rs`). Every limit is a comparison that must hold for acceptance, so every failure denies.
//!
//! # The error budget of cells
//! The integer set X' that is walked differs from the true set X as follows. Each line bounds the distance from a pose
//! of X to the nearest pose of X', per axis.
//!
//! | step | x, y | yaw |
//! |---|---|---|
//! | covariance to factor ([`crate::set`]): outwards, `F F' >= r2 P` | 0 | 0 |
//! | bounded extents to integers: outwards | 0 | 0 |
//! | estimate and goal to integers, move into the goal frame ([`crate::pose`]) | 2.42 um | 1.01 of 2^-32 turn |
//! | factor rotated into the goal frame: three entries per row within 1 um, times a unit vector | 1.74 um | 0 |
//! | factor times a scale (margins only), before the rotation: three entries per row within 0.5 um on each axis, rotated, times a unit vector | 1.23 um | 0 |
//! | the proof of the table treats borders of boxes as 1e-11 m and 2e-9 rad wide | 0.00 um | 1.37 of 2^-32 turn |
//! | **sum** | **5.39 um** | **0.01 of 2^-24 turn** |
//!
//! [`SLACK_UM`] and [`SLACK_Q24`] are these sums rounded up. They are applied once: boxes and slabs are widened by them. After that the walk is
//! about X' alone, and each of its steps is either exact or rounds against acceptance, as `grid.rs` states.

use crate::num::ANGLE_UNITS_PER_Q24;
use crate::pose::Pose;
use crate::set::{Extent, PoseSet, scaled_yaw};
use crate::table::{Cells, Table};

use self::grid::Stop;

pub use self::facets::clearance_q14 as facet_clearance_q14;

#[cfg(test)]
mod error_budget;
mod facets;
mod grid;
#[cfg(feature = "std")]
pub mod many;
mod placed;
pub mod second;
mod slab;
mod support;
mod touching;
mod union;
mod worst;

/// Largest distance per axis from a pose of the true set to the integer set, micrometres.
pub const SLACK_UM: i64 = 6;
/// Largest distance in yaw from a pose of the true set to the integer set, unit 2^-24 turn.
pub const SLACK_Q24: i64 = 1;

/// The answer to "is the pose-set inside the success set?".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum Decision {
    /// Every pose of the pose-set lies in the success set.
    Inside,
    /// The pose-set is not proven to be inside.
    Outside(Cause),
}

/// The cause why a pose-set is not inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Cause {
    /// The pose-set is wider than the whole table on some axis, for every estimate.
    TooLarge,
    /// The estimate itself is not on the table.
    OffTable,
    /// Some pose of the pose-set is not proven to be inside.
    NotContained,
    /// The cells were walked as far as the table's limit allows ([`Table::within`]), without an answer.
    TooCostly,
}

messages!(Cause {
    TooLarge => "the pose-set is wider than the whole table on some axis, for every estimate",
    OffTable => "the estimate is not on the table",
    NotContained => "some pose of the pose-set is not proven inside the success set",
    TooCostly => "the cells were walked as far as the limit allows, without an answer",
});

/// A factor by which a pose-set can be scaled and still be inside: a lower bound on s*, unit 2^-16.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Margin(u32);

impl Margin {
    /// The margin 1: the set is inside, and no larger scale is proven.
    pub const ONE: Self = Self(1 << 16);

    /// The largest margin that is reported: 2^15.
    pub const MOST: Self = Self(1 << 31);

    /// Returns the margin in units of 2^-16.
    #[must_use]
    pub const fn q16(self) -> u32 {
        self.0
    }

    /// Returns a margin from units of 2^-16.
    #[must_use]
    pub const fn from_q16(raw: u32) -> Self {
        Self(raw)
    }
}

/// A decision with its margin and worst pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct Examination {
    /// The decision, as [`decide`] returns it.
    pub decision: Decision,
    /// The largest scale found at which the set is inside: at least 1 with `Inside`, below 1 otherwise. Within 2^-10
    /// of the largest scale that the table allows, and at most 2^15.
    pub margin: Margin,
    /// With `Outside`: a pose of the given set, in the world frame, that the table does not cover, far outside of what it covers. `None` if none
    /// is found: then the set is denied since it is not proven to be inside. If the estimate is not on the table, or the set is thinner than some
    /// micrometres, this is the estimate to the micrometre. A table is smaller than its success set, by its extent and by its roundings: a pose beyond
    /// the table may be in the set.
    pub worst_pose: Option<Pose>,
}

/// Decides whether a pose-set lies inside a table's success set.
///
/// Uses integers only, without panic, heap or recursion. The table's facets, slabs and rows bound the loops
/// ([`Table::worst_case`]).
pub fn decide(table: &Table<'_>, set: &PoseSet) -> Decision {
    if facets_cover(table, set) {
        return Decision::Inside;
    }
    decide_on_cells(table, set)
}

/// Decides as [`decide`] does, and returns a margin at little extra cost: a lower bound, not the sharp one of
/// [`examine`]. The margin is zero if the set is outside, and [`Margin::ONE`] if only the table's cells cover it.
///
/// The bound comes from the slack at the nearest facet: on reference set A about three quarters of the largest scale
/// (`ci.sh accuracy`).
pub fn decide_with_margin(table: &Table<'_>, set: &PoseSet) -> (Decision, Margin) {
    let goal = table.goal().pose;
    let layout = table.facets();
    let margin = layout.and_then(|layout| facets::margin_q10(layout, set, goal));
    if let Some(q10) = margin {
        return (Decision::Inside, Margin(q10 << 6));
    }
    let decision = decide_on_cells(table, set);
    let inside = decision == Decision::Inside;
    (decision, if inside { Margin::ONE } else { Margin(0) })
}

/// Decides by the cells, for a set that the facets do not cover. A separate function, so that a permit by facets does
/// not need its stack.
#[inline(never)]
fn decide_on_cells(table: &Table<'_>, set: &PoseSet) -> Decision {
    match GoalFramePoseSet::on(table, set) {
        Err(cause) => Decision::Outside(cause),
        Ok(placed) => match placed.walked(table, placed.extent) {
            Ok(()) => Decision::Inside,
            Err(Stop::TooCostly) => Decision::Outside(Cause::TooCostly),
            Err(Stop::NotCovered) => Decision::Outside(Cause::NotContained),
        },
    }
}

/// Decides, and finds the margin and the worst pose by deciding at other scales.
///
/// Cost: a few dozen decisions, of which those at larger scales walk more of the table: 30 to 500 times [`decide`]
/// (`ci.sh budgets` prints both). For reports and telemetry, not for every control cycle.
pub fn examine(table: &Table<'_>, set: &PoseSet) -> Examination {
    let (decision, margin, beyond) = scales(table, set);
    let worst_pose = match (decision, beyond) {
        (Decision::Inside, _) => None,
        (_, Some((placed, scale))) => placed.worst_pose(table, scale),
        (_, None) => Some(set.mean()),
    };
    Examination {
        decision,
        margin,
        worst_pose,
    }
}

/// Decides, and returns the margin of [`examine`], which costs less without the worst pose.
pub fn decide_with_sharp_margin(table: &Table<'_>, set: &PoseSet) -> (Decision, Margin) {
    let (decision, margin, _) = scales(table, set);
    (decision, margin)
}

/// A set on a table, and a scale at which poses of it are beyond the table.
type Beyond<'s> = (GoalFramePoseSet<'s>, Margin);

/// Returns the decision and the margin, and where to look for a worst pose: `None` at the estimate.
fn scales<'s>(table: &Table<'_>, set: &'s PoseSet) -> (Decision, Margin, Option<Beyond<'s>>) {
    let decision = decide(table, set);
    let at_estimate = (decision, Margin(0), None);
    let Some(placed) = GoalFramePoseSet::at(table, set, turned(table, set.extent())) else {
        return at_estimate;
    };
    if decision == Decision::Inside {
        let mut low = Margin::ONE;
        while low.0 < Margin::MOST.0 && placed.is_covered(table, low.doubled()) {
            low = low.doubled();
        }
        if low.0 < Margin::MOST.0 {
            low = placed.bisect(table, low, low.doubled()).0;
        }
        return (decision, low, None);
    }
    if decision == Decision::Outside(Cause::OffTable) {
        return at_estimate;
    }
    if !placed.is_covered(table, Margin(0)) || placed.is_covered(table, Margin::ONE) {
        // The estimate is outside. Or the set is too large for a table of the whole circle, of which only a rounding covers it.
        return (decision, Margin(0), Some((placed, Margin::ONE)));
    }
    // The set is outside at scale 1 by the decision; search downwards for a scale that is inside.
    let (mut low, mut high) = (Margin(Margin::ONE.0 >> 1), Margin::ONE);
    while low.0 > 8 && !placed.is_covered(table, low) {
        high = low;
        low = Margin(low.0 >> 1);
    }
    if low.0 <= 8 {
        low = Margin(0);
    }
    let (margin, high) = placed.bisect(table, low, high);
    (decision, margin, Some((placed, high)))
}

impl Margin {
    const fn doubled(self) -> Self {
        Self(self.0.saturating_mul(2))
    }
}

/// Returns `true` if the facets of a table cover a set, `false` if the table has no facets.
fn facets_cover(table: &Table<'_>, set: &PoseSet) -> bool {
    table
        .facets()
        .is_some_and(|layout| facets::covers(layout, set, table.goal().pose))
}

/// A pose-set in the goal frame of a table.
struct GoalFramePoseSet<'s> {
    /// The set in world axes.
    set: &'s PoseSet,
    /// x above the lower corner of the cells, micrometres.
    x_um: i64,
    /// y above the lower corner of the cells, micrometres.
    y_um: i64,
    /// Yaw above the lower end of the yaw range, 2^-32 turn, in `[0, 2^32)`.
    yaw: i64,
    extent: Extent,
}

impl<'s> GoalFramePoseSet<'s> {
    /// Returns the set on a table that could contain it, or the cause why the table cannot.
    fn on(table: &Table<'_>, set: &'s PoseSet) -> Result<Self, Cause> {
        let cells = table.cells();
        // The extent does not depend on the estimate, so it is checked first.
        let extent = turned(table, set.extent());
        if !fits(extent, cells) {
            return Err(Cause::TooLarge);
        }
        let placed = Self::at(table, set, extent).ok_or(Cause::OffTable)?;
        let on_table = (0..=width(cells)).contains(&placed.x_um)
            && (0..=height(cells)).contains(&placed.y_um)
            && placed.yaw.unsigned_abs() <= cells.yaw_span;
        if on_table {
            Ok(placed)
        } else {
            Err(Cause::OffTable)
        }
    }

    /// Returns the set with its rotated extent in the goal frame, or `None` if it is too far from the goal.
    fn at(table: &Table<'_>, set: &'s PoseSet, extent: Extent) -> Option<Self> {
        let cells = table.cells();
        let mean = table.goal().pose_to_goal(set.mean())?;
        Some(Self {
            set,
            x_um: i64::from(mean.x_um).wrapping_sub(i64::from(cells.x_lo_um)),
            y_um: i64::from(mean.y_um).wrapping_sub(i64::from(cells.y_lo_um)),
            yaw: i64::from(mean.yaw.minus(cells.yaw_lo).0),
            extent,
        })
    }

    /// Returns the extent times `scale`, in world axes. `None` if it is out of range.
    fn scaled(&self, scale: Margin) -> Option<Extent> {
        match self.set.extent() {
            Extent::Gaussian(factor) => factor.scaled(scale.0).map(Extent::Gaussian),
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => {
                let radius = i64::from(translation_um).wrapping_mul(scale.0.into());
                let radius = radius.wrapping_add(0xffff) >> 16;
                (radius < 1 << 29).then_some(Extent::Bounded {
                    translation_um: radius as i32,
                    yaw_q24: scaled_yaw(yaw_q24, scale.0),
                })
            }
            Extent::Grown { factor, by } => Some(Extent::Grown {
                factor: factor.scaled(scale.0)?,
                by: by.scaled(scale.0)?,
            }),
        }
    }

    /// Returns `true` if the set times `scale` is covered.
    fn is_covered(&self, table: &Table<'_>, scale: Margin) -> bool {
        self.scaled(scale).is_some_and(|extent| {
            // Rotated after scaling, because a scale would multiply the rounding of the rotation. A length beyond 2^28, for which the rotation
            // rounds more, is wider than any table.
            facets_cover(table, &PoseSet::of(self.set.mean(), extent))
                || self.walked(table, turned(table, extent)).is_ok()
        })
    }

    /// Returns the offset of a pose of the set times `scale` that no facet covers, in world axes: um, um, 2^-32 turn. Zero without facets.
    fn witness(&self, table: &Table<'_>, scale: Margin) -> [i64; 3] {
        let (Some(extent), Some(layout)) = (self.scaled(scale), table.facets()) else {
            return [0; 3];
        };
        let set = PoseSet::of(self.set.mean(), extent);
        let [x, y, yaw] = facets::witness(layout, &set, table.goal().pose);
        [x, y, yaw.wrapping_mul(ANGLE_UNITS_PER_Q24)]
    }

    /// Returns `Ok` if the cells of a table without facets cover the set with an extent in the goal's axes, by a walk within the table's limit.
    fn walked(&self, table: &Table<'_>, extent: Extent) -> Result<(), Stop> {
        let grid = table.grid().ok_or(Stop::NotCovered)?;
        let mean = [self.x_um, self.y_um, self.yaw];
        grid::covers(grid, table.cells(), mean, extent, table.most_runs())
    }

    /// Narrows the interval between a scale that is covered and one that is not to 2^-10 of the larger. Returns both.
    fn bisect(&self, table: &Table<'_>, mut low: Margin, mut high: Margin) -> (Margin, Margin) {
        while high.0.saturating_sub(low.0) > (high.0 >> 10).max(1) {
            let middle = Margin(low.0.wrapping_add(high.0.wrapping_sub(low.0) >> 1));
            if self.is_covered(table, middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        (low, high)
    }
}

/// Returns the extent in the axes of a table's goal frame.
fn turned(table: &Table<'_>, extent: Extent) -> Extent {
    match extent {
        Extent::Gaussian(factor) => Extent::Gaussian(factor.to_goal(table.goal())),
        bounded @ Extent::Bounded { .. } => bounded,
        Extent::Grown { factor, by } => Extent::Grown {
            factor: factor.to_goal(table.goal()),
            by,
        },
    }
}

/// Returns the width of all cells along x, micrometres.
fn width(cells: &Cells) -> i64 {
    i64::from(cells.x_hi_um()).wrapping_sub(i64::from(cells.x_lo_um))
}

/// Returns the width of all cells along y, micrometres.
fn height(cells: &Cells) -> i64 {
    i64::from(cells.y_hi_um()).wrapping_sub(i64::from(cells.y_lo_um))
}

/// Returns `true` if a set of this extent could lie on these cells for some estimate.
#[cfg_attr(not(small_code), inline(never))]
fn fits(extent: Extent, cells: &Cells) -> bool {
    let (width, height) = (width(cells), height(cells));
    let turn = |yaw_q24: i32| {
        let whole = i64::from(yaw_q24).wrapping_mul(ANGLE_UNITS_PER_Q24.wrapping_mul(2));
        cells.is_whole_circle() || whole.unsigned_abs() <= cells.yaw_span
    };
    // No set is smaller than its ellipsoid or than its movement.
    let (factor, disc) = match extent {
        Extent::Gaussian(factor) => (Some(factor), None),
        Extent::Bounded {
            translation_um,
            yaw_q24,
        } => (None, Some((translation_um, yaw_q24))),
        Extent::Grown { factor, by } => (Some(factor), Some((by.translation_um(), by.yaw_q24()))),
    };
    let factor_fits = factor.is_none_or(|factor| {
        // (2 |row|)^2 <= width^2: at most 2^62 and 2^56.
        let within = |row: [i32; 3], width: i64| {
            support::squared_length(row).wrapping_mul(4)
                <= width.unsigned_abs().wrapping_mul(width.unsigned_abs())
        };
        within(factor.x, width) && within(factor.y, height) && turn(factor.yaw)
    });
    factor_fits
        && disc.is_none_or(|(translation_um, yaw_q24)| {
            let across = i64::from(translation_um).wrapping_mul(2);
            across <= width && across <= height && turn(yaw_q24)
        })
}

#[cfg(test)]
mod tests;
