//! Bakes success sets into tables.
//!
//! The code here is complex and is not trusted: [`crate::verify`] proves the bytes with separate
//! code, and a table that it cannot prove is not written.
//!
//! ```
//! use posegate::bake::{BakeInput, Extent, Layout, Step, TableSpec, table};
//! use posegate::shape::{BoxSet, PoseDeg, Shape, SuccessSet};
//! use posegate::table::Table;
//!
//! let success = SuccessSet {
//!     goal: PoseDeg { x: 0.0, y: 0.0, yaw_deg: 0.0 },
//!     shape: Shape::Box(BoxSet {
//!         x: [-0.08, 0.08],
//!         y: [-0.06, 0.06],
//!         yaw_deg: [-4.0, 4.0],
//!     }),
//! };
//! let order = BakeInput {
//!     task: "dock",
//!     success: &success,
//!     spec: TableSpec {
//!         extent: Extent { x: [-0.1, 0.1], y: [-0.1, 0.1], yaw_deg: [-5.0, 5.0] },
//!         step: Step { xy: 0.005, yaw_deg: 0.5 },
//!         layout: Layout::Facets,
//!     },
//!     epsilon: 0.99,
//! };
//! let bytes = table(&order, &|| ())?;
//! let read = Table::parse(&bytes)?;
//! // A box has facets. Nothing has been proven yet.
//! assert!(read.facets().is_some() && read.grid().is_none());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::certify::goal_cos_sin;
use crate::num::BinaryAngle;
use crate::shape::SuccessSet;
use crate::table::Cells;

pub use self::export::{Language, source};
pub use self::extent::{extent, wide_extent};
pub use self::facets::{Effort, FacetPlan, FramePlan, Keep, PiecePlan};
pub(crate) use self::parts::ranges;
pub use self::runs::Rows;
pub use self::sight::sight_record;
pub use self::spec::{Extent, Layout, Step, TableSpec};
pub use self::write::{LARGEST_TABLE, write_facets, write_grid};

mod border;
mod export;
mod extent;
mod facets;
mod frames;
mod parts;
mod runs;
mod sight;
mod spec;
mod write;

/// The inputs of a table, except its cells.
#[derive(Clone, Debug)]
pub struct BakeInput<'a> {
    /// The task's name, at most 32 bytes.
    pub task: &'a str,
    /// The success set and its goal.
    pub success: &'a SuccessSet,
    /// Extent, step and layouts.
    pub spec: TableSpec,
    /// The site's confidence, in (0, 1).
    pub epsilon: f64,
}

/// Why no table is made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The extent is empty or not finite, or a step is not above zero.
    #[error("the table's extent is empty or its steps are not above zero")]
    BadExtent,
    /// A count that exceeds a limit of the format.
    #[error("the table is too large for its format: {count} {what}, at most {limit}")]
    TooLarge {
        /// Name of the counted items.
        what: &'static str,
        /// Their number.
        count: f64,
        /// Their largest number.
        limit: f64,
    },
    /// The extent reaches too far from the goal.
    #[error(
        "the table reaches too far for its format: {what} up to {metres} m from the goal, at most {limit} m"
    )]
    TooFar {
        /// Name of the cells.
        what: &'static str,
        /// Their distance, metres.
        metres: f64,
        /// The largest distance, metres.
        limit: f64,
    },
    /// The set or the table cannot be expressed as facets; the text is the reason.
    #[error("no facets: {0}; use layout = \"grid\"")]
    NoPieces(&'static str),
    /// A task name that does not fit into the header.
    #[error("the task name {0:?} is empty or longer than 32 bytes")]
    Name(String),
    /// The goal is farther from the origin than the core's number range.
    #[error("the goal ({x} m, {y} m) is more than 2000 m from the origin of the world")]
    Goal {
        /// Metres.
        x: f64,
        /// Metres.
        y: f64,
    },
    /// The confidence has no radius in the core's range.
    #[error("epsilon = {0} has no radius that the gate takes (0.2 and above, below 1)")]
    Epsilon(f64),
    /// No cell lies in the set.
    #[error("{}", missing(*.cells, *.nearest))]
    Empty {
        /// Number of cells tried.
        cells: u64,
        /// The sampled pose that violates the set least.
        nearest: Nearest,
    },
}

/// A pose, and its most violated constraint of a success set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// World pose: m, m, rad.
    pub pose: [f64; 3],
    /// The constraint with the least slack.
    pub constraint: &'static str,
    /// The constraint's slack there, roughly metres or radians: below 0 if the pose is outside.
    pub slack: f64,
}

impl BakeError {
    fn too_large(what: &'static str, count: f64, limit: f64) -> Self {
        Self::TooLarge { what, count, limit }
    }
}

fn missing(cells: u64, nearest: Nearest) -> String {
    let Nearest {
        pose: [x, y, yaw],
        constraint,
        slack,
    } = nearest;
    let place = std::format!("({x:.3} m, {y:.3} m, {:.2} deg)", yaw.to_degrees());
    if slack == f64::NEG_INFINITY {
        std::format!(
            "no pose of the table's extent lies inside the success set, as far as it was sampled: `{constraint}` is violated everywhere, also at {place}"
        )
    } else if slack < 0.0 {
        std::format!(
            "no pose of the table's extent lies inside the success set, as far as it was sampled: the nearest one, {place}, violates `{constraint}` by {:.4} (m or rad)",
            -slack
        )
    } else {
        std::format!(
            "no cell of {cells} lies inside the success set: it is smaller than the cells near {place}; use finer steps"
        )
    }
}

fn empty(order: &BakeInput<'_>, cells: &Cells) -> BakeError {
    BakeError::Empty {
        cells: u64::from(cells.columns) * u64::from(cells.rows) * u64::from(cells.slabs),
        nearest: parts::nearest(order.success, parts::ranges(cells)),
    }
}

/// Bakes the grid table of an order. Calls `progress` after every slab.
///
/// Deterministic: the bytes do not depend on the number of threads.
///
/// # Errors
/// [`BakeError`] if the order cannot be baked.
pub fn grid(order: &BakeInput<'_>, progress: &(dyn Fn() + Sync)) -> Result<Vec<u8>, BakeError> {
    let cells = check(order)?;
    let rows = runs::of_set(order.success, &cells, progress);
    if rows.iter().flatten().all(Vec::is_empty) {
        return Err(empty(order, &cells));
    }
    write_grid(order, &cells, &rows)
}

/// Bakes the table of an order in its layout. (For a proven table use [`crate::verify::build`].)
///
/// # Errors
/// [`BakeError`] if the order cannot be baked.
pub fn table(order: &BakeInput<'_>, progress: &(dyn Fn() + Sync)) -> Result<Vec<u8>, BakeError> {
    if order.spec.layout == Layout::Grid {
        return grid(order, progress);
    }
    let mut plan = facets(order, Effort::default())?;
    plan.pieces.retain(|piece| !piece.is_empty());
    progress();
    write_facets(order, &plan)
}

/// Returns the facets of an order's set, one piece for each of its parts. The parts are the same at every effort;
/// some pieces may be empty ([`PiecePlan::is_empty`]).
///
/// # Errors
/// [`BakeError`] if the order has no facets.
pub fn facets(order: &BakeInput<'_>, effort: Effort) -> Result<FacetPlan, BakeError> {
    facets::of_order(order, &check(order)?, effort)
}

/// Checks an order without baking it: everything that can be refused from the numbers alone.
///
/// # Errors
/// [`BakeError`] if the order is refused.
pub fn check(order: &BakeInput<'_>) -> Result<Cells, BakeError> {
    crate::confidence::core_radius(order.epsilon).ok_or(BakeError::Epsilon(order.epsilon))?;
    goal_frame(order.success)?;
    order.spec.cells()
}

/// Returns the goal as a table stores it: micrometres, binary angle, cosine and sine to 2^-30.
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

/// Returns an upper bound of a cell's distance from the goal, metres.
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

/// Returns the largest distance along an axis from the goal that a table can cover, metres.
fn reach_m() -> f64 {
    f64::from(crate::table::LARGEST_REACH_UM) * 1e-6
}

/// Returns the lower end of the slabs in the goal frame, 2^-32 turn, not wrapped.
pub(crate) fn slab_start(cells: &Cells) -> i64 {
    i64::from(cells.yaw_lo.0)
}

/// Returns edge `k` of the slabs in the goal frame, 2^-32 turn, not wrapped.
pub(crate) fn slab_edge(cells: &Cells, k: u16) -> i64 {
    i64::from(cells.yaw_lo.0) + cells.slab_edge(k)
}
