//! Sequences of tasks: what is known after each step, how much room each has, and the chance that one fails.
//!
//! No heap: steps are borrowed, what is found of them is kept in a [`heapless::Vec`] of the caller's size.
//!
//! # What is assumed of the estimate
//! The paper lets each task begin with the estimate at its goal ([`StartAssumption::AtGoal`]). A controller's estimate is
//! not there: after a localization it is the observation, which lies within `r_l` of a pose that lies anywhere in
//! the set before, and after a drive where the controller's tolerance leaves it. [`StartAssumption::General`] follows that:
//! besides what is known about the estimate it keeps where the estimate may be, and a task's room is what is left
//! of its success set for *every* such estimate.
//!
//! # What a success means
//! With a chance of at least `1 - risk` the true pose is in every task's success set when the task begins, and
//! a gate permits it there. The risk is the sum of what each set that a task relied on leaves out, never a
//! product of what may depend on each other.

use heapless::Vec;

use crate::contain::{Cause, Decision, Margin};
use crate::pose::Pose;
use crate::set::PoseSet;
use crate::table::Table;
use crate::task::{Cylinder, MotionUpdate, PoseErrorSet, Risk};

/// Where the estimate is when a task begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StartAssumption {
    /// At the task's goal: the paper's assumption, not the gate's.
    AtGoal,
    /// Wherever the steps before may have left it.
    General,
}

/// One step of a chain.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Step<'a> {
    /// A task that leaves the knowledge as it is.
    Work(&'a Table<'a>),
    /// A task after which the estimate is the observation.
    Localization {
        /// Its success set.
        table: &'a Table<'a>,
        /// r_l.
        bound: Cylinder,
        /// That an observation is farther off than r_l.
        risk: Risk,
    },
    /// A drive.
    Navigation(&'a MotionUpdate),
}

/// What is known before a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BeliefState {
    /// Where the estimate is meant to be, world frame.
    pub pose: Pose,
    /// How far from there it may be.
    pub spread: Cylinder,
    /// What is known about it.
    pub knowledge: PoseErrorSet,
}

impl BeliefState {
    /// The set that a task's success set must hold.
    #[must_use]
    pub fn set(&self) -> Option<PoseSet> {
        self.knowledge.about(self.pose, self.spread)
    }
}

/// Why a step fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Failure {
    /// The set before it is not proven inside the task's success set.
    NotContained(Cause),
    /// The drive may begin farther from its path than the path's growth allows for.
    StartTooFar,
    /// What is known is beyond the numbers: 268 m and more, or sets of two radii.
    BeyondNumbers,
}

impl Failure {
    /// Returns the failure's name in snake case, as JSON writes it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotContained(Cause::TooLarge) => "pose_set_too_large",
            Self::NotContained(Cause::OffTable) => "outside_table",
            Self::NotContained(Cause::NotContained) => "not_contained",
            Self::StartTooFar => "start_too_far",
            Self::BeyondNumbers => "beyond_numbers",
        }
    }
}

/// What was found of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StepEvaluation {
    /// Of a task: how much room its set has; zero where it is outside.
    pub margin: Option<Margin>,
    /// Why it fails, if it does.
    pub failure: Option<Failure>,
    /// The chance that this step adds.
    pub risk: Risk,
}

/// What was found of a chain of up to `N` steps.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct Evaluation<const N: usize> {
    /// What was found of each step. What follows a step that fails holds as if it had not.
    pub steps: Vec<StepEvaluation, N>,
    /// What is known after the last step.
    pub after: BeliefState,
    /// The chance that the chain fails although no step does.
    pub risk: Risk,
}

impl<const N: usize> Evaluation<N> {
    /// The first step that fails, and why.
    #[must_use]
    pub fn first_failure(&self) -> Option<(usize, Failure)> {
        let mut steps = self.steps.iter().enumerate();
        steps.find_map(|(index, found)| Some((index, found.failure?)))
    }
}

/// Decides about a set, with its margin: [`crate::contain::decide_with_margin`], or what is sharper.
pub type ContainmentFn = fn(&Table<'_>, &PoseSet) -> (Decision, Margin);

/// Evaluates a chain; `None` where it has more than `N` steps.
///
/// Cost: a decision a task ([`Table::worst_case`]) and about 1,000 instructions (M4F) a drive; `./ci.sh planning`
/// counts a chain of eight.
pub fn evaluate<'a, const N: usize>(
    start: BeliefState,
    steps: impl IntoIterator<Item = Step<'a>>,
    assume: StartAssumption,
    judge: ContainmentFn,
) -> Option<Evaluation<N>> {
    let mut found = Vec::new();
    let mut at = start;
    let mut risk = Risk::NONE;
    for step in steps {
        let of_step = take(&mut at, &step, assume, judge);
        risk = risk.plus(of_step.risk);
        found.push(of_step).ok()?;
    }
    Some(Evaluation {
        steps: found,
        after: at,
        risk,
    })
}

/// Takes one step: what is found of it, and what is known after it.
pub fn take(
    at: &mut BeliefState,
    step: &Step<'_>,
    assume: StartAssumption,
    judge: ContainmentFn,
) -> StepEvaluation {
    match step {
        Step::Work(table) => task(at, table, assume, judge),
        Step::Localization { table, bound, risk } => {
            let mut found = task(at, table, assume, judge);
            found.risk = found.risk.plus(*risk);
            // The observation is within the bound of the truth, and the truth anywhere in the set.
            let everywhere = at
                .knowledge
                .enclosing()
                .and_then(|error| error.plus(at.spread)?.plus(*bound));
            match everywhere {
                Some(spread) => at.spread = spread,
                None => found.failure = found.failure.or(Some(Failure::BeyondNumbers)),
            }
            at.knowledge = PoseErrorSet::bounded(*bound);
            found
        }
        Step::Navigation(growth) => {
            let begins = assume == StartAssumption::AtGoal || growth.begins_at(at.pose, at.spread);
            let after = growth.after(&at.knowledge);
            at.pose = growth.to();
            at.spread = match assume {
                StartAssumption::AtGoal => Cylinder::POINT,
                StartAssumption::General => growth.within().end,
            };
            let failure = match after {
                Some(after) => {
                    at.knowledge = after;
                    (!begins).then_some(Failure::StartTooFar)
                }
                None => Some(Failure::BeyondNumbers),
            };
            StepEvaluation {
                margin: None,
                failure,
                risk: Risk::NONE,
            }
        }
    }
}

fn task(
    at: &mut BeliefState,
    table: &Table<'_>,
    assume: StartAssumption,
    judge: ContainmentFn,
) -> StepEvaluation {
    if assume == StartAssumption::AtGoal {
        at.pose = table.goal().pose;
        at.spread = Cylinder::POINT;
    }
    let risk = at.knowledge.risk();
    let Some(set) = at.set() else {
        return StepEvaluation {
            margin: Some(Margin::default()),
            failure: Some(Failure::BeyondNumbers),
            risk,
        };
    };
    let (decision, margin) = judge(table, &set);
    StepEvaluation {
        margin: Some(margin),
        failure: match decision {
            Decision::Inside => None,
            Decision::Outside(cause) => Some(Failure::NotContained(cause)),
        },
        risk,
    }
}
