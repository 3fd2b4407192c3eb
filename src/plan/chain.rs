//! A hand-made chain of the site file, step by step.

use std::borrow::ToOwned;
use std::string::String;
use std::vec::Vec;

use nalgebra::Matrix3;

use super::{Belief, PlanError, Rooms};
use crate::chain::{Assume, Failure, Standing, Step, take};
use crate::confidence::core_radius;
use crate::contain::{Decision, Margin, examine};
use crate::num::BinaryAngle;
use crate::pose::Pose;
use crate::set::{Estimate, Impossible, PoseSet};
use crate::shape::{PoseDeg, Tolerance};
use crate::site::{ChainStart, ChainStep, DriveModel, Known, Site, SiteChain, TaskKind};
use crate::table::Table;
use crate::task::{Cylinder, Growth, Knowledge, Leg, Risk, Within};

/// What kind of step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepKind {
    /// A work task.
    Work,
    /// A localization task.
    Localization,
    /// A drive.
    Navigation,
}

/// What was found of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepReport {
    /// What kind of step.
    pub kind: StepKind,
    /// The task's name; none of a drive.
    pub task: Option<String>,
    /// What was known before it.
    pub before: Belief,
    /// What is known after it.
    pub after: Belief,
    /// What was known before it, in the core's integers.
    pub standing: Standing,
    /// How much room a task's set has.
    pub margin: Option<Margin>,
    /// Why it fails, if it does.
    pub failure: Option<Failure>,
    /// The chance that it adds.
    pub risk: f64,
}

/// What was found of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainReport {
    /// What was assumed of the estimate.
    pub assume: Assume,
    /// What was found of each step; what follows one that fails holds as if it had not.
    pub steps: Vec<StepReport>,
    /// The chance that the chain fails although no step does.
    pub risk: f64,
}

impl ChainReport {
    /// Whether no step fails.
    #[must_use]
    pub fn succeeds(&self) -> bool {
        self.first_failure().is_none()
    }

    /// The first step that fails, and why.
    #[must_use]
    pub fn first_failure(&self) -> Option<(usize, Failure)> {
        let mut steps = self.steps.iter().enumerate();
        steps.find_map(|(index, step)| Some((index, step.failure?)))
    }
}

/// Evaluates a chain of a site file on proven tables, which are made.
///
/// Decisions are those of [`crate::chain`], with sharp margins ([`examine`]).
///
/// # Errors
/// [`PlanError`].
pub fn evaluate(
    site: &Site,
    name: &str,
    chain: &SiteChain,
    assume: Assume,
    rooms: &mut Rooms<'_>,
) -> Result<ChainReport, PlanError> {
    if chain.steps.is_empty() {
        return Err(PlanError::NoSteps(name.to_owned()));
    }
    for step in &chain.steps {
        if let ChainStep::Task(name) = step {
            rooms.make(name)?;
        }
    }
    let epsilon = match chain.start.known {
        Known::Gaussian { epsilon, .. } => epsilon,
        Known::Bounded { .. } => site.epsilon,
    };
    let mut walk = Walk::start(&chain.start, epsilon, site.navigation.controller, assume)?;
    let mut steps = Vec::new();
    for (index, step) in chain.steps.iter().enumerate() {
        let report = match step {
            ChainStep::Task(name) => {
                let Some(bytes) = rooms.bytes(name) else {
                    continue;
                };
                let Some(task) = site.tasks.get(name) else {
                    continue;
                };
                let bound = task
                    .error_bound
                    .map(|bound| [bound.translation, bound.yaw_deg.to_radians()]);
                let doubt = task.error_bound.map_or(0.0, |bound| 1.0 - bound.coverage);
                let report = walk.task(name, task.kind, bound, doubt, bytes)?;
                if let Some(bound) = task.error_bound
                    && !fits(bytes, &walk.standing)
                {
                    return Err(PlanError::BoundTooLarge {
                        task: name.clone(),
                        translation: bound.translation,
                        yaw_deg: bound.yaw_deg,
                    });
                }
                report
            }
            ChainStep::Navigate { from, legs, model } => {
                walk.drive(from, legs, model)
                    .map_err(|cause| PlanError::Drive {
                        step: index + 1,
                        cause,
                    })?
            }
        };
        steps.push(report);
    }
    let risk = steps.iter().map(|step| step.risk).sum();
    Ok(ChainReport {
        assume,
        steps,
        risk,
    })
}

/// Whether what a localization leaves would fit into its own success set where the set before did: about its
/// goal, if that is in the set at all.
fn fits(bytes: &[u8], after: &Standing) -> bool {
    let Ok(table) = Table::parse(bytes) else {
        return true;
    };
    let goal = table.goal().pose;
    let Some(smallest) = Knowledge::bounded(Cylinder::POINT).about(goal, Cylinder::POINT) else {
        return true;
    };
    if crate::contain::decide(&table, &smallest) != Decision::Inside {
        return true;
    }
    let set = after.knowledge.about(goal, Cylinder::POINT);
    set.is_some_and(|set| crate::contain::decide(&table, &set) == Decision::Inside)
}

/// A chain under way: the core's integers and the floats beside them.
pub(super) struct Walk {
    pub standing: Standing,
    pub belief: Belief,
    epsilon: f64,
    controller: Tolerance,
    assume: Assume,
}

impl Walk {
    pub fn start(
        start: &ChainStart,
        epsilon: f64,
        controller: Tolerance,
        assume: Assume,
    ) -> Result<Self, PlanError> {
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

    pub fn task(
        &mut self,
        name: &str,
        kind: TaskKind,
        bound: Option<[f64; 2]>,
        doubt: f64,
        bytes: &[u8],
    ) -> Result<StepReport, PlanError> {
        let table = Table::parse(bytes).map_err(|error| PlanError::Table {
            task: name.to_owned(),
            cause: crate::verify::VerifyError::Table(error).into(),
        })?;
        if self.assume == Assume::AtGoal {
            let goal = table.goal().pose;
            self.belief.pose = [
                f64::from(goal.x_um) * 1e-6,
                f64::from(goal.y_um) * 1e-6,
                radians(goal.yaw),
            ];
            self.belief.spread = [0.0, 0.0];
        }
        let (step, kind) = match (kind, bound) {
            (TaskKind::Localization, Some([translation, yaw])) => {
                let bound = Cylinder::new(translation, yaw).ok_or(PlanError::StartTooWide)?;
                let step = Step::Localization {
                    table: &table,
                    bound,
                    risk: Risk::beyond(1.0 - doubt).ok_or(PlanError::Epsilon(1.0 - doubt))?,
                };
                (step, StepKind::Localization)
            }
            _ => (Step::Work(&table), StepKind::Work),
        };
        let before = self.belief.clone();
        let standing = self.standing;
        let found = take(&mut self.standing, &step, self.assume, sharply);
        if let Some(bound) = bound {
            self.belief = self.belief.localized(bound);
        }
        Ok(StepReport {
            kind,
            task: Some(name.to_owned()),
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
    ) -> Result<StepReport, crate::task::GrowthError> {
        let begin = crate::set::pose_of(*from).map_err(crate::task::GrowthError::Pose)?;
        let within = match self.assume {
            Assume::AtGoal => Within::default(),
            Assume::General => Within {
                // A place that is met exactly may seem off by a rounding.
                start: Growth::off(begin, self.standing.pose, self.standing.spread)
                    .and_then(|off| off.plus(Cylinder::from_um_q24(2, 1)?))
                    .ok_or(crate::task::GrowthError::TooLarge)?,
                end: Cylinder::new(
                    self.controller.translation,
                    self.controller.turn_deg.to_radians(),
                )
                .ok_or(crate::task::GrowthError::TooLarge)?,
            },
        };
        let growth = match model {
            DriveModel::Bounded(drift) => Growth::bounded(from, legs, drift, within)?,
            DriveModel::Gaussian(odometry) => {
                let radius = core_radius(self.epsilon).ok_or(crate::task::GrowthError::TooLarge)?;
                let risk = Risk::beyond(self.epsilon).ok_or(crate::task::GrowthError::TooLarge)?;
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
    crate::set::pose_of(Estimate { x_m, y_m, yaw_rad })
}

fn radians(angle: BinaryAngle) -> f64 {
    f64::from(angle.signed()) / 4_294_967_296.0 * core::f64::consts::TAU
}

fn wrapped(angle: f64) -> f64 {
    use core::f64::consts::{PI, TAU};
    angle - TAU * libm::floor((angle + PI) / TAU)
}
