//! A chain under way: the core's decisions, and what is known in floats beside them.

use nalgebra::Matrix3;

use super::{Belief, PlanError, StepKind, StepReport};
use crate::log::coordinates;
use crate::site::{ChainStart, DriveModel, ErrorBound, Known, Site};
use posegate::chain::{Assume, Standing, Step, take};
use posegate::confidence::core_radius;
use posegate::contain::{Decision, Margin, examine};
use posegate::pose::Pose;
use posegate::set::{Estimate, Impossible, PoseSet};
use posegate::shape::{PoseDeg, Tolerance};
use posegate::table::Table;
use posegate::task::{Cylinder, Growth, GrowthError, Knowledge, Leg, Risk, Within, wrapped};

/// A chain under way: the core's integers and the floats beside them.
pub(super) struct Walk {
    pub standing: Standing,
    pub belief: Belief,
    epsilon: f64,
    controller: Tolerance,
    assume: Assume,
}

impl Walk {
    /// At a start: with the start's confidence, or the site's, for every Gaussian set to come.
    pub fn start(site: &Site, start: &ChainStart, assume: Assume) -> Result<Self, PlanError> {
        let epsilon = start.epsilon(site);
        let controller = site.navigation.controller;
        let pose = world(start.pose);
        let known = &start.known;
        let knowledge = match known {
            Known::Bounded {
                translation,
                yaw_deg,
            } => Knowledge::bounded(
                Cylinder::new(*translation, yaw_deg.to_radians()).ok_or(PlanError::StartTooWide)?,
            ),
            Known::Gaussian {
                covariance,
                epsilon,
            } => gaussian(*covariance, *epsilon)?,
        };
        let standing = Standing {
            pose: pose_of(pose).map_err(PlanError::Start)?,
            spread: Cylinder::new(start.spread.translation, start.spread.turn_deg.to_radians())
                .ok_or(PlanError::StartTooWide)?,
            knowledge,
        };
        Ok(Self {
            standing,
            belief: Belief::at_start(pose, start.spread, known),
            epsilon,
            controller,
            assume,
        })
    }

    /// A task: a localization where it has a bound, else work.
    pub fn task(
        &mut self,
        table: &Table<'_>,
        bound: Option<ErrorBound>,
    ) -> Result<StepReport, PlanError> {
        if self.assume == Assume::AtGoal {
            self.belief.pose = coordinates(table.goal().pose);
            self.belief.spread = [0.0, 0.0];
        }
        let (step, kind, doubt) = match bound {
            Some(bound) => {
                let [translation, yaw] = bound.metres_radians();
                let within = Cylinder::new(translation, yaw).ok_or(PlanError::StartTooWide)?;
                let risk = Risk::beyond(bound.coverage);
                let step = Step::Localization {
                    table,
                    bound: within,
                    risk: risk.ok_or(PlanError::Epsilon(bound.coverage))?,
                };
                (step, StepKind::Localization, 1.0 - bound.coverage)
            }
            None => (Step::Work(table), StepKind::Work, 0.0),
        };
        let before = self.belief.clone();
        let standing = self.standing;
        let found = take(&mut self.standing, &step, self.assume, sharply);
        if let Some(bound) = bound {
            self.belief = self.belief.localized(bound.metres_radians());
        }
        Ok(StepReport {
            kind,
            task: Some(table.task().to_owned()),
            risk: before.risk() + doubt,
            before,
            after: self.belief.clone(),
            standing,
            margin: found.margin,
            failure: found.failure,
        })
    }

    pub fn drive(
        &mut self,
        from: &Estimate,
        legs: &[Leg],
        model: &DriveModel,
    ) -> Result<StepReport, GrowthError> {
        let begin = posegate::set::pose_of(*from).map_err(GrowthError::Pose)?;
        let within = match self.assume {
            Assume::AtGoal => Within::default(),
            Assume::General => Within {
                // A place that is met exactly may seem off by a rounding.
                start: Growth::off(begin, self.standing.pose, self.standing.spread)
                    .and_then(|off| off.plus(Cylinder::from_um_q24(2, 1)?))
                    .ok_or(GrowthError::TooLarge)?,
                end: Cylinder::new(
                    self.controller.translation,
                    self.controller.turn_deg.to_radians(),
                )
                .ok_or(GrowthError::TooLarge)?,
            },
        };
        let growth = match model {
            DriveModel::Bounded(drift) => Growth::bounded(from, legs, drift, within)?,
            DriveModel::Gaussian(odometry) => {
                let radius = core_radius(self.epsilon).ok_or(GrowthError::TooLarge)?;
                let risk = Risk::beyond(self.epsilon).ok_or(GrowthError::TooLarge)?;
                Growth::gaussian(from, legs, odometry, within, radius, risk)?
            }
        };
        let before = self.belief.clone();
        let standing = self.standing;
        let found = take(
            &mut self.standing,
            &Step::Navigation(&growth),
            self.assume,
            sharply,
        );
        let (off, controller) = match self.assume {
            Assume::AtGoal => ([0.0, 0.0], Tolerance::NONE),
            Assume::General => (
                [
                    libm::hypot(before.pose[0] - from.x_m, before.pose[1] - from.y_m)
                        + before.spread[0],
                    wrapped(before.pose[2] - from.yaw_rad).abs() + before.spread[1],
                ],
                self.controller,
            ),
        };
        self.belief = before.driven(from, legs, model, self.epsilon, off, controller);
        Ok(StepReport {
            kind: StepKind::Navigation,
            task: None,
            before,
            after: self.belief.clone(),
            standing,
            margin: None,
            failure: found.failure,
            risk: 0.0,
        })
    }
}

/// The core's answer with its sharp margin.
fn sharply(table: &Table<'_>, set: &PoseSet) -> (Decision, Margin) {
    let examination = examine(table, set);
    (examination.decision, examination.margin)
}

/// A covariance as the core takes it: one that is singular, or zero, is widened by 2^-20 of its diagonal, 1 um and
/// 1 urad.
fn gaussian(covariance: [[f64; 3]; 3], epsilon: f64) -> Result<Knowledge, PlanError> {
    let radius = core_radius(epsilon).ok_or(PlanError::Epsilon(epsilon))?;
    let risk = Risk::beyond(epsilon).ok_or(PlanError::Epsilon(epsilon))?;
    let known = Knowledge::gaussian(covariance, radius, risk);
    let singular = |why: &Impossible| {
        matches!(
            why,
            Impossible::CovarianceZero | Impossible::CovarianceNotPositiveDefinite
        )
    };
    match known {
        Err(why) if singular(&why) => {
            let wider = Matrix3::from_fn(|row, column| {
                let entry = covariance[row][column];
                if row == column {
                    entry * (1.0 + 1e-6) + 1e-12
                } else {
                    entry
                }
            });
            Knowledge::gaussian(wider.transpose().into(), radius, risk).map_err(PlanError::Start)
        }
        known => known.map_err(PlanError::Start),
    }
}

/// A pose of the site file: metres and radians.
pub(super) fn world(pose: PoseDeg) -> [f64; 3] {
    [pose.x, pose.y, pose.yaw_deg.to_radians()]
}

fn pose_of([x_m, y_m, yaw_rad]: [f64; 3]) -> Result<Pose, Impossible> {
    posegate::set::pose_of(Estimate { x_m, y_m, yaw_rad })
}
