//! Success sets to tables.
//!
//! What is baked here is clever and is not trusted: [`crate::verify`] proves the bytes, on a code
//! path of its own, and a table that it cannot prove is not written.

use crate::certify::goal_cos_sin;
use crate::num::BinaryAngle;
use crate::shape::SuccessSet;
use crate::table::Cells;

pub use self::export::{Language, source};
pub use self::extent::{extent, wide_extent};
pub use self::facets::{Effort, FacetPlan, FramePlan, PiecePlan};
pub use self::runs::Rows;
pub use self::sight::sight_record;
pub use self::spec::{Extent, Layout, Step, TableSpec};
pub use self::write::{LARGEST_TABLE, write, write_layouts};

mod border;
mod export;
mod extent;
mod facets;
mod frames;
mod lines;
mod parts;
mod runs;
mod sight;
mod spec;
mod write;

/// What a table is made of, besides its cells.
#[derive(Clone, Debug)]
pub struct BakeInput<'a> {
    /// The task's name, at most 32 bytes.
    pub task: &'a str,
    /// The success set and its goal.
    pub success: &'a SuccessSet,
    /// What to cover.
    pub spec: TableSpec,
    /// The site's confidence.
    pub epsilon: f64,
    /// SHA-256 of the site file.
    pub site_digest: [u8; 32],
}

/// Why no table is made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The extent is empty or not finite, or a step is not above zero.
    #[error("the table's extent is empty or its steps are not above zero")]
    BadExtent,
    /// A count that the format does not hold.
    #[error("the table is too large for its format: {count} {what}, at most {limit}")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// How many.
        count: f64,
        /// How many there may be.
        limit: f64,
    },
    /// The extent reaches too far from the goal.
    #[error(
        "the table reaches too far for its format: {what} up to {metres} m from the goal, at most {limit} m"
    )]
    TooFar {
        /// Which cells.
        what: &'static str,
        /// How far.
        metres: f64,
        /// How far they may reach.
        limit: f64,
    },
    /// The set or the table does not suit facets.
    #[error("no facets: {0}; use layout = \"grid\" or \"auto\"")]
    NoPieces(&'static str),
    /// A task name that the header does not hold.
    #[error("the task name {0:?} is empty or longer than 32 bytes")]
    Name(String),
    /// The goal is farther from the origin than the core's numbers reach.
    #[error("the goal ({x} m, {y} m) is more than 2000 m from the origin of the world")]
    Goal {
        /// Metres.
        x: f64,
        /// Metres.
        y: f64,
    },
    /// The confidence has no radius that the core takes.
    #[error("epsilon = {0} has no radius that the gate takes (0.2 and above, below 1)")]
    Epsilon(f64),
    /// No cell lies in the set.
    #[error(
        "no cell of {cells} lies inside the success set: {}", missing(*.nearest)
    )]
    Empty {
        /// How many cells were tried.
        cells: u64,
        /// Of the poses that were looked at the one that lacks least.
        nearest: Nearest,
    },
}

/// A pose, and what it lacks of a success set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// In the world: m, m, rad.
    pub pose: [f64; 3],
    /// The constraint that it is farthest from.
    pub constraint: &'static str,
    /// Its slack there, roughly metres or radians: below 0 where the pose is outside.
    pub slack: f64,
}

fn missing(nearest: Nearest) -> String {
    let Nearest {
        pose: [x, y, yaw],
        constraint,
        slack,
    } = nearest;
    let place = std::format!("({x:.3} m, {y:.3} m, {:.2} deg)", yaw.to_degrees());
    if slack < 0.0 {
        std::format!(
            "`{constraint}` empties it, by {:.4} (m or rad) where least is missing, at {place}",
            -slack
        )
    } else {
        std::format!("it is smaller than the cells, about {place}; use finer steps")
    }
}

fn empty(order: &BakeInput<'_>, cells: &Cells) -> BakeError {
    BakeError::Empty {
        cells: u64::from(cells.columns) * u64::from(cells.rows) * u64::from(cells.slabs),
        nearest: parts::nearest(order.success, parts::ranges(cells)),
    }
}

/// Bakes the grid table of an order. `progress` is told of every slab that is done.
///
/// Deterministic: the same bytes at any number of threads.
///
/// # Errors
/// [`BakeError`], with the numbers.
pub fn grid(order: &BakeInput<'_>, progress: &(dyn Fn() + Sync)) -> Result<Vec<u8>, BakeError> {
    let cells = check(order)?;
    let rows = runs::of_set(order.success, &cells, progress);
    if rows.iter().flatten().all(runs::Row::is_empty) {
        return Err(empty(order, &cells));
    }
    write_layouts(order, &cells, Some(&rows), None)
}

/// Bakes the table of an order in the layouts that it names; `auto` is facets. (Whether it is proven,
/// [`crate::verify::build`] sees to.)
///
/// # Errors
/// [`BakeError`], with the numbers.
pub fn table(order: &BakeInput<'_>, progress: &(dyn Fn() + Sync)) -> Result<Vec<u8>, BakeError> {
    if order.spec.layout == Layout::Grid {
        return grid(order, progress);
    }
    let mut plan = facets(order, Effort::default())?;
    plan.pieces.retain(|piece| !piece.is_empty());
    progress();
    table_of(order, &plan, progress)
}

/// The facets of an order's set, a piece for each of its parts: at every effort the same parts, of which some may
/// be empty ([`PiecePlan::is_empty`]).
///
/// # Errors
/// [`BakeError`], with the numbers.
pub fn facets(order: &BakeInput<'_>, effort: Effort) -> Result<FacetPlan, BakeError> {
    facets::of_order(order, &check(order)?, effort)
}

/// The bytes of a table of these facets, without a grid.
///
/// # Errors
/// [`BakeError`] for what the format does not hold.
pub fn facets_alone(order: &BakeInput<'_>, plan: &FacetPlan) -> Result<Vec<u8>, BakeError> {
    write_layouts(order, &check(order)?, None::<&[Vec<runs::Row>]>, Some(plan))
}

/// The bytes of a table of these facets, with a grid where the order asks for both.
///
/// # Errors
/// [`BakeError`], with the numbers.
pub fn table_of(
    order: &BakeInput<'_>,
    plan: &FacetPlan,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<u8>, BakeError> {
    if order.spec.layout != Layout::Both {
        return facets_alone(order, plan);
    }
    let cells = check(order)?;
    let rows = runs::of_set(order.success, &cells, progress);
    write_layouts(order, &cells, Some(&rows), Some(plan))
}

/// Checks an order without baking it: everything that can be refused from the numbers alone.
///
/// # Errors
/// [`BakeError`], with the numbers.
pub fn check(order: &BakeInput<'_>) -> Result<Cells, BakeError> {
    crate::confidence::core_radius(order.epsilon).ok_or(BakeError::Epsilon(order.epsilon))?;
    goal_frame(order.success)?;
    order.spec.cells()
}

/// The goal as a table stores it: micrometres, binary angle, cosine and sine to 2^-30.
pub(crate) fn goal_frame(set: &SuccessSet) -> Result<crate::pose::GoalFrame, BakeError> {
    let goal = set.goal;
    let um = |metres: f64| libm::round(metres * 1e6);
    if !(um(goal.x).abs() <= 2e9 && um(goal.y).abs() <= 2e9) {
        return Err(BakeError::Goal {
            x: goal.x,
            y: goal.y,
        });
    }
    let turns = goal.yaw_deg / 360.0;
    let units = libm::round((turns - libm::floor(turns)) * 4_294_967_296.0) as u64;
    let q30 = goal_cos_sin(goal).map(|v| libm::round(v.middle() * 1_073_741_824.0) as i32);
    Ok(crate::pose::GoalFrame {
        pose: crate::pose::Pose {
            x_um: um(goal.x) as i32,
            y_um: um(goal.y) as i32,
            yaw: BinaryAngle(units as u32),
        },
        cos_q30: q30[0],
        sin_q30: q30[1],
    })
}

/// How far from the goal a cell can lie, metres: an upper bound.
pub(crate) fn reach(cells: &Cells) -> f64 {
    let ends = [
        cells.x_lo_um,
        cells.x_hi_um(),
        cells.y_lo_um,
        cells.y_hi_um(),
    ];
    let farthest = ends.into_iter().map(|um| f64::from(um).abs() * 1e-6);
    farthest.fold(0.0, f64::max) * core::f64::consts::SQRT_2
}

/// How far from the goal a table can reach along an axis, metres.
fn reach_m() -> f64 {
    f64::from(crate::table::LARGEST_REACH_UM) * 1e-6
}

/// The lower end of the slabs in the goal frame, 2^-32 turn, not wrapped.
pub(crate) fn slab_start(cells: &Cells) -> i64 {
    i64::from(cells.yaw_lo.0)
}

/// Edge `k` of the slabs in the goal frame, 2^-32 turn, not wrapped.
pub(crate) fn slab_edge(cells: &Cells, k: u16) -> i64 {
    i64::from(cells.yaw_lo.0) + cells.slab_edge(k)
}
