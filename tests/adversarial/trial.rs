//! One decision, and the check of a permit.

use crate::oracle::{Effort, Pose, PoseSet, below, level, min_slack_over, to_goal};
use crate::stage::Stage;
use crate::tally::Tally;
use crate::voxels::Voxels;
use posegate::contain::{Cause, Decision, decide, examine};
use posegate::set::{Estimate, InputError, RadiusSquared};
use posegate::shape::Shape;
use posegate::table::Table;

/// A permit is false if the oracle's slack is below this: the rounding of the oracle.
const FALSE_BELOW: f64 = -1e-9;

/// The relative accuracy of the oracle's scales.
pub const SCALE_ERROR: f64 = 1e-9;

/// A table under test.
pub struct Trial<'a> {
    pub stage: &'a Stage,
    pub table: Table<'a>,
    /// The cells as the test reads them, if the table is a grid.
    pub voxels: Option<Voxels>,
    pub tally: Tally,
}

/// Prior knowledge about a case.
#[derive(Clone, Copy)]
pub struct PriorKnowledge {
    /// The set lies in the success set, by a scale or a border that the oracle found.
    pub inside: bool,
    /// A border is within one cell.
    pub near: bool,
}

impl Trial<'_> {
    /// Decides on a case and counts it.
    pub fn case(&mut self, estimate: Pose, set: &PoseSet, known: PriorKnowledge) {
        self.tally.cases += 1;
        self.tally.near_border += usize::from(known.near);
        let turning = matches!(self.stage.success.shape, Shape::Visibility(_)) && yaw(set) > 0.05;
        self.tally.bend_cases += usize::from(turning);
        let Ok(core) = core_set(estimate, set) else {
            self.tally.impossible += 1;
            eprintln!("impossible: {set:?}");
            return;
        };
        if decide(&self.table, &core) != Decision::Inside {
            return;
        }
        self.tally.permits += 1;
        self.tally.bend_permits += usize::from(turning);
        if !known.inside {
            self.check(estimate, set);
        }
        let mean = to_goal(self.stage.world.goal, estimate);
        let turn = self.stage.world.goal[2];
        let escape = |voxels: &Voxels| voxels.escapes(set, mean, turn);
        if let Some(pose) = self.voxels.as_ref().and_then(escape) {
            self.tally.escapes += 1;
            eprintln!(
                "ESCAPE from the cells at {pose:?}: {estimate:?} {set:?} in {:?}",
                self.stage.success
            );
        }
    }

    /// Checks a permit, and counts it as false if the set leaves the success set.
    fn check(&mut self, estimate: Pose, set: &PoseSet) {
        let world = &self.stage.world;
        if below(world, estimate, set, 1.0, FALSE_BELOW).is_none() {
            return;
        }
        let (slack, pose) = min_slack_over(world, estimate, set, 1.0, Effort::Full);
        if !(slack >= FALSE_BELOW) {
            self.tally.false_permits += 1;
            if self.tally.false_permits <= 3 {
                eprintln!(
                    "FALSE PERMIT: slack {slack:e} at {pose:?}: {estimate:?} {set:?} in {:?}",
                    self.stage.success
                );
            }
        }
    }

    /// Checks the worst pose of a denial: it is a pose of the set, and not of the part of the success set that the table's extent holds. `exact` is
    /// s* of the set.
    pub fn check_worst_pose(&mut self, estimate: Pose, set: &PoseSet, exact: f64) {
        let Ok(core) = core_set(estimate, set) else {
            return;
        };
        let found = examine(&self.table, &core);
        if found.decision != Decision::Outside(Cause::NotContained) || exact >= 1.0 {
            return;
        }
        self.tally.denials += 1;
        let Some(worst) = found.worst_pose else {
            self.tally.unnamed += 1;
            return;
        };
        let turn = std::f64::consts::TAU / 4_294_967_296.0;
        let pose = [
            f64::from(worst.x_um) * 1e-6,
            f64::from(worst.y_um) * 1e-6,
            f64::from(worst.yaw.signed()) * turn,
        ];
        let level = level(set, estimate, pose);
        // A set thinner than micrometres has no other pose than the estimate, which is rounded.
        let is_thin = worst == core.mean();
        let is_inside = self.stage.world.slack(pose) >= 0.0;
        self.tally.worst_inside += usize::from(is_inside && !is_thin);
        // Facets are tighter than their set by a sagitta: a set that leaves by little may leave the table alone. Cells do not fill their
        // set, and may end within it.
        let least = || min_slack_over(&self.stage.world, estimate, set, 1.0, Effort::Fast).0;
        let is_clear = || self.voxels.is_none() && least() < -2.0 * self.stage.cell;
        let is_wrong =
            !is_thin && (level > 1.0 || is_inside && !self.is_beyond_extent(worst) && is_clear());
        if is_wrong {
            self.tally.wrong_poses += 1;
            if self.tally.wrong_poses <= 3 {
                eprintln!(
                    "WRONG POSE {pose:?}, level {level}, inside {is_inside}, s* {exact}: {estimate:?} {set:?} in {:?}",
                    self.stage.success
                );
            }
        }
    }

    /// Returns `true` if a pose is beyond the table's extent, which may be smaller than the success set, or within a cell of its border.
    fn is_beyond_extent(&self, pose: posegate::pose::Pose) -> bool {
        let cells = self.table.cells();
        let Some(pose) = self.table.goal().pose_to_goal(pose) else {
            return true;
        };
        let step = i64::from(cells.step_um);
        let is_beyond = |at: i32, lo: i32, count: u16| {
            let at = i64::from(at) - i64::from(lo);
            at < step || at > (i64::from(count) - 1) * step
        };
        let (above, span) = (u64::from(pose.yaw.minus(cells.yaw_lo).0), cells.yaw_span);
        let slab = span / u64::from(cells.slabs);
        is_beyond(pose.x_um, cells.x_lo_um, cells.columns)
            || is_beyond(pose.y_um, cells.y_lo_um, cells.rows)
            || span < 1 << 32 && (above < slab || above > span - slab)
    }

    /// Returns `true` if the table permits. The decision is not counted.
    pub fn permits(&self, estimate: Pose, set: &PoseSet) -> bool {
        core_set(estimate, set).is_ok_and(|set| decide(&self.table, &set) == Decision::Inside)
    }
}

/// Returns the largest yaw offset, radians.
pub fn yaw(set: &PoseSet) -> f64 {
    match set {
        PoseSet::Gaussian { cov, r2 } => (cov[2][2] * r2).sqrt(),
        PoseSet::Bounded { yaw, .. } => *yaw,
    }
}

/// Returns about the largest distance of a pose of the set from the estimate, with a radian counted as a metre.
pub fn size(set: &PoseSet) -> f64 {
    match set {
        PoseSet::Gaussian { cov, r2 } => ((cov[0][0] + cov[1][1] + cov[2][2]) * r2).sqrt(),
        PoseSet::Bounded { translation, yaw } => translation.hypot(*yaw),
    }
}

pub fn scaled(set: &PoseSet, by: f64) -> PoseSet {
    match set {
        PoseSet::Gaussian { cov, r2 } => PoseSet::Gaussian {
            cov: cov.map(|row| row.map(|v| v * by * by)),
            r2: *r2,
        },
        PoseSet::Bounded { translation, yaw } => PoseSet::Bounded {
            translation: translation * by,
            yaw: yaw * by,
        },
    }
}

pub fn core_set(
    [x_m, y_m, yaw_rad]: Pose,
    set: &PoseSet,
) -> Result<posegate::set::PoseSet, InputError> {
    let estimate = Estimate { x_m, y_m, yaw_rad };
    match set {
        PoseSet::Gaussian { cov, r2 } => {
            let radius = RadiusSquared::from_q16((r2 * 65536.0).ceil() as u32).unwrap();
            posegate::set::PoseSet::gaussian(estimate, *cov, radius)
        }
        PoseSet::Bounded { translation, yaw } => {
            posegate::set::PoseSet::bounded(estimate, *translation, *yaw)
        }
    }
}
