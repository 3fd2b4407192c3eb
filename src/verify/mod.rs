//! Proves the bytes of a table.
//!
//! [`verify`] reads the bytes as the firmware does ([`crate::table`]), and proves every run inside the
//! success set of the site with outward-rounded intervals ([`crate::certify`]). It computes no border as
//! the baker does: [`crate::bake`] searches the borders on plain floats, this module
//! encloses the definition of the set. What both use: that definition and the choice of its parts ([`crate::shape`]; a wrong choice
//! costs area), which the reference cases and the tests' oracle check independently; the cosine and sine of the goal; and the clearance that baking
//! leaves to the rounding of the estimate, whose row of the error budget a search measures.
//!
//! ```
//! use posegate::bake::{BakeInput, Extent, Layout, Step, TableSpec};
//! use posegate::shape::{BoxSet, PoseDeg, Shape, SuccessSet};
//! use posegate::verify::{ExpectedTable, VerifyError, build, verify};
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
//! // Baked and proven: only such bytes belong into flash.
//! let (bytes, proof) = build(&order, &|| ())?;
//! assert!(proof.corners > 0);
//!
//! // The same bytes do not prove a smaller set.
//! let mut smaller = success.clone();
//! smaller.shape = Shape::Box(BoxSet { x: [-0.07, 0.07], y: [-0.06, 0.06], yaw_deg: [-4.0, 4.0] });
//! let claim = ExpectedTable { task: "dock", success: &smaller, epsilon: 0.99 };
//! assert!(matches!(verify(&bytes, &claim, &|| ()), Err(VerifyError::Facet(_))));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod coverage;
mod facets;
mod sight;
#[cfg(test)]
mod tests;
mod volume;

pub use self::coverage::{Coverage, GroupCoverage, coverage};
pub use self::facets::UnprovenFacet;
pub use self::volume::{Volume, volume};

use crate::bake::{self, BakeError, BakeInput, Effort, FacetPlan, Layout};
use crate::certify::{Block, Interval, Prover, goal_cos_sin};
use crate::confidence::core_radius;
use crate::num::BinaryAngle;
use crate::shape::SuccessSet;
use crate::table::{Cells, Run, Table, TableError};
use rayon::prelude::*;

/// The task and site that a table must match.
#[derive(Clone, Copy, Debug)]
pub struct ExpectedTable<'a> {
    /// The task's name.
    pub task: &'a str,
    /// The task's success set and goal.
    pub success: &'a SuccessSet,
    /// The site's confidence, in (0, 1).
    pub epsilon: f64,
}

/// A table that has been proven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Proof {
    /// Runs of cells that were proven inside.
    pub runs: u64,
    /// Cells in the proven runs.
    pub cells: u64,
    /// Corners of facet pieces that were proven inside or cut off.
    pub corners: u64,
}

/// The first place where a table could not be proven.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "cell (slab {slab}, row {row}, column {column}) about ({:.6} m, {:.6} m, {:.6} deg) in the goal frame",
    pose[0], pose[1], pose[2].to_degrees()
)]
pub struct Unproven {
    /// Number of the yaw slab, from 0.
    pub slab: u16,
    /// Number of the row along y, from 0.
    pub row: u16,
    /// First column whose cell is not proven by itself; the run's first column if each cell is.
    pub column: u16,
    /// Middle of the first unproven cell, in the goal frame: m, m, rad.
    pub pose: [f64; 3],
}

/// Why a table is not proven.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// The bytes are not a table.
    #[error("the bytes are not a table: {0}")]
    Table(TableError),
    /// A header field differs from the site.
    #[error("the table's {field} is {found}, the site's is {expected}")]
    Header {
        /// Name of the field.
        field: &'static str,
        /// Value in the table.
        found: String,
        /// Value from the site.
        expected: String,
    },
    /// Facets and cells. The cells are not used, but they were by older versions.
    #[error("the table has both facets and cells: build it again, so that it has one of them")]
    BothLayouts,
    /// A cell that is not proven inside.
    #[error("{0} is not proven inside the success set")]
    Cell(Unproven),
    /// A facet that is not proven.
    #[error("{0} is not proven: its piece is not inside the success set")]
    Facet(UnprovenFacet),
}

/// Proves a table against a site's task. Calls `progress` after every slab.
///
/// # Errors
/// [`VerifyError`] with the first difference in the header, or the first cell (in the order of slabs, rows
/// and columns) or facet that could not be proven.
pub fn verify(
    bytes: &[u8],
    claim: &ExpectedTable<'_>,
    progress: &(dyn Fn() + Sync),
) -> Result<Proof, VerifyError> {
    verify_but(bytes, claim, progress, None)
}

/// Proves a table likewise, but skips its facets if its bytes are the ones in `known`.
fn verify_but(
    bytes: &[u8],
    claim: &ExpectedTable<'_>,
    progress: &(dyn Fn() + Sync),
    known: Option<&FacetProofCache>,
) -> Result<Proof, VerifyError> {
    let table = Table::parse(bytes).map_err(VerifyError::Table)?;
    // The lengths of both layouts.
    let is_empty = |at: usize| bytes.get(at..at + 4) == Some(&[0; 4]);
    if !is_empty(72) && !is_empty(80) {
        return Err(VerifyError::BothLayouts);
    }
    header(&table, claim)?;
    sight::sight(table.sight_record(), claim.success)?;
    let proof = runs(&table, claim.success, progress).map_err(VerifyError::Cell)?;
    let corners = match (table.facets(), known) {
        (None, _) => 0,
        (_, Some(known)) if known.bytes == bytes => known.corners,
        (Some(layout), _) => {
            facets::facets(layout, claim.success, progress).map_err(VerifyError::Facet)?
        }
    };
    // Last, because the place where a table leaves the set says more than the digest of another set.
    let (found, expected) = (table.task_digest(), claim.success.digest(claim.epsilon));
    if found != expected {
        let hex = |digest: [u8; 32]| digest.iter().map(|b| format!("{b:02x}")).collect();
        return Err(differs("task digest", hex(found), hex(expected)));
    }
    Ok(Proof { corners, ..proof })
}

/// The bytes of a table with all facets proven for the order for which they were baked.
struct FacetProofCache {
    bytes: Vec<u8>,
    corners: u64,
}

/// Why no proven table is made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The order cannot be baked.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// The baked table is not proven: a cell of a set of slivers, otherwise an internal error
    /// ([`BuildError::is_internal`]).
    #[error("the table that was baked is not proven: {0}")]
    Verify(#[from] VerifyError),
}

impl BuildError {
    /// Returns `true` for an internal error: the bytes are not a table, or do not match the order.
    #[must_use]
    pub const fn is_internal(&self) -> bool {
        matches!(
            self,
            Self::Verify(VerifyError::Table(_) | VerifyError::Header { .. })
        )
    }
}

/// Bakes a table and proves it. If facets are not proven, they are moved inwards ([`Effort`]);
/// pieces that are still not proven are omitted.
///
/// # Errors
/// [`BuildError`] if the order cannot be baked, or the table is not proven.
pub fn build(
    order: &BakeInput<'_>,
    progress: &(dyn Fn() + Sync),
) -> Result<(Vec<u8>, Proof), BuildError> {
    let claim = ExpectedTable {
        task: order.task,
        success: order.success,
        epsilon: order.epsilon,
    };
    if order.spec.layout == Layout::Grid {
        let bytes = bake::grid(order, progress)?;
        let proof = verify(&bytes, &claim, progress)?;
        return Ok((bytes, proof));
    }
    let (plan, known) = proven_facets(order)?;
    progress();
    let bytes = bake::write_facets(order, &plan)?;
    // Bytes with all facets proven while they were chosen are not proven twice.
    let proof = verify_but(&bytes, &claim, progress, known.as_ref())?;
    Ok((bytes, proof))
}

/// Why there are no facets.
const NONE_IS_PROVEN: &str = "none of their pieces is proven to lie inside the success set";

/// Returns facets with every piece proven, each with the least effort that suffices, without the pieces that
/// no effort proves. If all were proven at once, also returns the bytes of their table.
fn proven_facets(
    order: &BakeInput<'_>,
) -> Result<(FacetPlan, Option<FacetProofCache>), BuildError> {
    let mut plan = bake::facets(order, Effort::default())?;
    // Indices of the nonempty pieces among all pieces.
    let places: Vec<usize> = (0..plan.pieces.len())
        .filter(|number| !plan.pieces[*number].is_empty())
        .collect();
    plan.pieces.retain(|piece| !piece.is_empty());
    // Returns the unproven pieces of a selection, the layout's lever, and the proof if it is complete.
    let left = |plan: &FacetPlan, among: &dyn Fn(u16) -> Vec<usize>| {
        let bytes = bake::write_facets(order, plan)?;
        let table = Table::parse(&bytes).map_err(VerifyError::Table)?;
        let Some(layout) = table.facets() else {
            return Ok::<_, BuildError>((Vec::new(), 0, None));
        };
        let (lever, among) = (layout.lever(), among(layout.lever()));
        let (open, corners) = facets::unproven(layout, order.success, &among);
        let all = open.is_empty() && (0..layout.pieces().count()).all(|own| among.contains(&own));
        let known = all.then_some(FacetProofCache { bytes, corners });
        Ok((open, lever, known))
    };
    let mut open: Vec<usize> = (0..plan.pieces.len()).collect();
    let mut known_lever = 0;
    for effort in Effort::EACH {
        if effort != Effort::default() {
            // The same parts of the set, piece by piece.
            let other = bake::facets(order, effort)?;
            for number in &open {
                if let (Some(piece), Some(other)) = (
                    plan.pieces.get_mut(*number),
                    other.pieces.get(places[*number]),
                ) && !other.is_empty()
                {
                    piece.clone_from(other);
                }
            }
        }
        plan.fit();
        let count = plan.pieces.len();
        // A longer lever increases the rounding errors of every piece, including those already proven.
        let among = |lever: u16| {
            let again = |number: &usize| lever != known_lever || open.contains(number);
            (0..count).filter(again).collect()
        };
        let known;
        (open, known_lever, known) = left(&plan, &among)?;
        if open.is_empty() {
            if effort.inset > Effort::ROUNDING && holds_nothing(order, &plan)? {
                return Err(BakeError::NoPieces(NONE_IS_PROVEN).into());
            }
            return Ok((plan, known));
        }
    }
    let mut known = None;
    while !open.is_empty() {
        let mut number = 0;
        plan.pieces.retain(|_| {
            number += 1;
            !open.contains(&(number - 1))
        });
        if plan.pieces.is_empty() {
            return Err(BakeError::NoPieces(NONE_IS_PROVEN).into());
        }
        let all = |_| (0..plan.pieces.len()).collect();
        (open, _, known) = left(&plan, &all)?;
    }
    Ok((plan, known))
}

/// Returns `true` if a table of these facets holds no pose of the set. Facets that leave no pose are proven, too.
fn holds_nothing(order: &BakeInput<'_>, plan: &FacetPlan) -> Result<bool, BuildError> {
    let bytes = bake::write_facets(order, plan)?;
    let table = Table::parse(&bytes).map_err(VerifyError::Table)?;
    Ok(coverage(&table, order.success).share == 0.0)
}

/// Proves every run of a table inside a set.
///
/// # Errors
/// [`Unproven`] with the first cell that could not be proven.
pub fn runs(
    table: &Table<'_>,
    success: &SuccessSet,
    progress: &(dyn Fn() + Sync),
) -> Result<Proof, Unproven> {
    let cells = table.cells();
    let prover = Prover::new(success);
    let none = Proof {
        runs: 0,
        cells: 0,
        corners: 0,
    };
    let Some(grid) = table.grid() else {
        return Ok(none);
    };
    let slabs: Vec<Result<Proof, Unproven>> = (0..cells.slabs)
        .into_par_iter()
        .map(|slab| {
            let rows = grid.slab(slab);
            let mut proof = none;
            for row in rows.first_row()..rows.first_row() + rows.rows() {
                for run in rows.runs(row) {
                    if !holds(&prover, cells, slab, row, run) {
                        return Err(first_unproven(&prover, cells, slab, row, run));
                    }
                    proof.runs += 1;
                    proof.cells += u64::from(run.last - run.first) + 1;
                }
            }
            progress();
            Ok(proof)
        })
        .collect();
    slabs.into_iter().try_fold(none, |sum, slab| {
        let slab = slab?;
        Ok(Proof {
            runs: sum.runs + slab.runs,
            cells: sum.cells + slab.cells,
            corners: 0,
        })
    })
}

/// Returns `true` if a run is proven inside: as a whole, or in runs of fewer cells if it extends from one
/// part of a set into the next. (Halves of a block need not end where a part ends; cells do.)
fn holds(prover: &Prover, cells: &Cells, slab: u16, row: u16, run: Run) -> bool {
    let mut open = std::vec![run];
    while let Some(Run { first, last }) = open.pop() {
        if prover.is_inside(&block(cells, slab, row, Run { first, last })) {
            continue;
        }
        if first >= last {
            return false;
        }
        let middle = first + (last - first) / 2;
        open.push(Run {
            first: middle + 1,
            last,
        });
        open.push(Run {
            first,
            last: middle,
        });
    }
    true
}

/// Returns the poses that a run covers.
fn block(cells: &Cells, slab: u16, row: u16, run: Run) -> Block {
    let edge = |lo: i32, index: u32| i64::from(lo) + i64::from(index) * i64::from(cells.step_um);
    let base = i64::from(cells.yaw_lo.0);
    Block {
        x_um: [
            edge(cells.x_lo_um, u32::from(run.first)),
            edge(cells.x_lo_um, u32::from(run.last) + 1),
        ],
        y_um: [
            edge(cells.y_lo_um, u32::from(row)),
            edge(cells.y_lo_um, u32::from(row) + 1),
        ],
        yaw: [
            base + cells.slab_edge(slab),
            base + cells.slab_edge(slab + 1),
        ],
    }
}

/// Returns the first cell of a run that is not proven by itself; the run's first cell if each is proven.
fn first_unproven(prover: &Prover, cells: &Cells, slab: u16, row: u16, run: Run) -> Unproven {
    let alone = |column| {
        let cell = Run {
            first: column,
            last: column,
        };
        block(cells, slab, row, cell)
    };
    let column = (run.first..=run.last)
        .find(|column| !prover.is_inside(&alone(*column)))
        .unwrap_or(run.first);
    let cell = alone(column);
    let middle = |[lo, hi]: [i64; 2]| (lo + (hi - lo) / 2) as f64;
    Unproven {
        slab,
        row,
        column,
        pose: [
            middle(cell.x_um) * 1e-6,
            middle(cell.y_um) * 1e-6,
            f64::from(BinaryAngle(middle(cell.yaw) as i64 as u32).signed())
                * (core::f64::consts::TAU / 4_294_967_296.0),
        ],
    }
}

const fn differs(field: &'static str, found: String, expected: String) -> VerifyError {
    VerifyError::Header {
        field,
        found,
        expected,
    }
}

/// Compares the header's fields with the site's, except the digest.
fn header(table: &Table<'_>, claim: &ExpectedTable<'_>) -> Result<(), VerifyError> {
    let differs = |field, found, expected| Err(differs(field, found, expected));
    if table.task() != claim.task {
        return differs("task", table.task().into(), claim.task.into());
    }
    let radius = core_radius(claim.epsilon).map_or(0, |r| r.q16());
    if table.radius_squared().q16() != radius
        || table.epsilon().to_bits() != claim.epsilon.to_bits()
    {
        let found = format!("{} (r2 {})", table.epsilon(), table.radius_squared().q16());
        return differs("epsilon", found, format!("{} (r2 {radius})", claim.epsilon));
    }
    let stored = table.goal();
    let goal = claim.success.goal;
    // Half a micrometre, plus the rounding of the metres themselves.
    let near = |um: i32, metres: f64| (f64::from(um) - metres * 1e6).abs() <= 0.5 + 1e-6;
    if !near(stored.pose.x_um, goal.x) || !near(stored.pose.y_um, goal.y) {
        let found = format!("({} um, {} um)", stored.pose.x_um, stored.pose.y_um);
        return differs("goal", found, format!("({} m, {} m)", goal.x, goal.y));
    }
    let turns = goal.yaw_deg / 360.0 - f64::from(stored.pose.yaw.0) / 4_294_967_296.0;
    let error = (turns - libm::round(turns)).abs() * 4_294_967_296.0;
    let unit = Interval { lo: -1.0, hi: 1.0 };
    let trusted = goal_cos_sin(goal)
        .into_iter()
        .zip([stored.cos_q30, stored.sin_q30])
        .all(|(exact, q30)| {
            let scaled = exact * Interval::point(1_073_741_824.0);
            let off = scaled + Interval::point(-f64::from(q30));
            off.lo >= unit.lo && off.hi <= unit.hi
        });
    if !(error <= 0.5 + 1e-4) || !trusted {
        let found = format!(
            "{} of 2^32, cosine {}, sine {} of 2^30",
            stored.pose.yaw.0, stored.cos_q30, stored.sin_q30
        );
        return differs("goal yaw", found, format!("{} deg", goal.yaw_deg));
    }
    Ok(())
}
