//! Steps through a chain: the core's decisions, with the belief in floats next to them.

use nalgebra::Matrix3;

use super::{BeliefStateF64, PlanError, StepKind, StepReport};
use posegate::chain::{BeliefState, StartAssumption, Step, take};
use posegate::confidence::core_radius;
use posegate::contain::decide_with_sharp_margin;
use posegate::pose::Pose;
use posegate::set::{Estimate, InputError};
use posegate::shape::{PoseDeg, Tolerance};
use posegate::table::Table;
use posegate::task::{
    Cylinder, GrowthError, Leg, MotionUpdate, PathTolerance, PoseErrorSet, Risk, wrapped,
};
use posegate_replay::coordinates;
use posegate_site::{ChainStart, DriveModel, ErrorBound, Site, StartUncertainty};

/// The state of a chain between two steps: the core's integers and the same in floats.
pub(super) struct Walk {
    pub standing: BeliefState,
    pub belief: BeliefStateF64,
    epsilon: f64,
    controller: Tolerance,
    assume: StartAssumption,
}

impl Walk {
    /// Creates the state at a start. Every later Gaussian set has the start's confidence, or the site's if the start
    /// has none.
    pub fn start(
        site: &Site,
        start: &ChainStart,
        assume: StartAssumption,
    ) -> Result<Self, PlanError> {
        let epsilon = start.epsilon(site);
        let controller = site.navigation.controller;
        let pose = world(start.pose);
        let known = &start.known;
        let knowledge = match known {
            StartUncertainty::Bounded {
                translation,
                yaw_deg,
            } => PoseErrorSet::bounded(
                Cylinder::new(*translation, yaw_deg.to_radians()).ok_or(PlanError::StartTooWide)?,
            ),
            StartUncertainty::Gaussian {
                covariance,
                epsilon,
            } => gaussian(*covariance, *epsilon)?,
        };
        let standing = BeliefState {
            pose: pose_of(pose).map_err(PlanError::Start)?,
            spread: Cylinder::new(start.spread.translation, start.spread.turn_deg.to_radians())
                .ok_or(PlanError::StartTooWide)?,
            knowledge,
        };
        Ok(Self {
            standing,
            belief: BeliefStateF64::at_start(pose, start.spread, known),
            epsilon,
            controller,
            assume,
        })
    }

    /// Evaluates a task: a localization if `bound` is given, else work.
    pub fn task(
        &mut self,
        table: &Table<'_>,
        bound: Option<ErrorBound>,
    ) -> Result<StepReport, PlanError> {
        if self.assume == StartAssumption::AtGoal {
            self.belief.pose = coordinates(table.goal().pose);
            self.belief.spread = [0.0, 0.0];
        }
        let (step, kind, doubt) = match bound {
            Some(bound) => {
                let [translation, yaw] = bound.metres_radians();
                let within = Cylinder::new(translation, yaw).ok_or(PlanError::StartTooWide)?;
                let risk = Risk::from_confidence(bound.coverage);
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
        let judge = decide_with_sharp_margin;
        let found = take(&mut self.standing, &step, self.assume, judge);
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
            StartAssumption::AtGoal => PathTolerance::default(),
            StartAssumption::General => PathTolerance {
                // A place that is reached exactly may differ by a rounding.
                start: MotionUpdate::off(begin, self.standing.pose, self.standing.spread)
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
            DriveModel::Bounded(drift) => MotionUpdate::bounded(from, legs, drift, within)?,
            DriveModel::Gaussian(odometry) => {
                let radius = core_radius(self.epsilon).ok_or(GrowthError::TooLarge)?;
                let risk = Risk::from_confidence(self.epsilon).ok_or(GrowthError::TooLarge)?;
                MotionUpdate::gaussian(from, legs, odometry, within, radius, risk)?
            }
        };
        let before = self.belief.clone();
        let standing = self.standing;
        let found = take(
            &mut self.standing,
            &Step::Navigation(&growth),
            self.assume,
            decide_with_sharp_margin,
        );
        let (off, controller) = match self.assume {
            StartAssumption::AtGoal => ([0.0, 0.0], Tolerance::NONE),
            StartAssumption::General => (
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

/// Converts a covariance for the core. A singular or zero covariance is widened by 1e-6 of its diagonal, 1 um and
/// 1 urad.
fn gaussian(covariance: [[f64; 3]; 3], epsilon: f64) -> Result<PoseErrorSet, PlanError> {
    let radius = core_radius(epsilon).ok_or(PlanError::Epsilon(epsilon))?;
    let risk = Risk::from_confidence(epsilon).ok_or(PlanError::Epsilon(epsilon))?;
    let known = PoseErrorSet::gaussian(covariance, radius, risk);
    let singular = |why: &InputError| {
        matches!(
            why,
            InputError::CovarianceZero | InputError::CovarianceNotPositiveDefinite
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
            PoseErrorSet::gaussian(wider.transpose().into(), radius, risk).map_err(PlanError::Start)
        }
        known => known.map_err(PlanError::Start),
    }
}

/// Converts a pose of the site file to metres and radians.
pub(super) fn world(pose: PoseDeg) -> [f64; 3] {
    [pose.x, pose.y, pose.yaw_deg.to_radians()]
}

fn pose_of([x_m, y_m, yaw_rad]: [f64; 3]) -> Result<Pose, InputError> {
    posegate::set::pose_of(Estimate { x_m, y_m, yaw_rad })
}
