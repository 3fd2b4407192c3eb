//! Sequences of tasks: the knowledge after each step, the margin of each task, and the probability that a task fails.
//!
//! No heap: steps are borrowed, and results are kept in a [`heapless::Vec`] of the caller's size.
//!
//! ```
//! use posegate::chain::{BeliefState, StartAssumption, Step, evaluate};
//! use posegate::contain::decide_with_margin;
//! use posegate::pose::Pose;
//! use posegate::table::Table;
//! use posegate::task::{Cylinder, PoseErrorSet, Risk};
//!
//! let see_t7 = Table::parse(include_bytes!("../../examples/tables/see-t7.posegate"))?;
//! let dock = Table::parse(include_bytes!("../../examples/tables/dock.posegate"))?;
//! let cylinder = |m, rad| Cylinder::new(m, rad).expect("below 268 m");
//!
//! // The robot is at the dock to within 1 m and 2 degrees: enough to see the tag, not to dock.
//! let start = BeliefState {
//!     pose: Pose::default(),
//!     spread: Cylinder::POINT,
//!     knowledge: PoseErrorSet::bounded(cylinder(1.0, 0.035)),
//! };
//! // A look leaves an error of 4 cm and 1 degree.
//! let look = Step::Localization { table: &see_t7, bound: cylinder(0.04, 0.0175), risk: Risk::NONE };
//! let steps = [look, Step::Work(&dock)];
//!
//! let run = |steps: &[Step<'_>]| {
//!     let steps = steps.iter().copied();
//!     evaluate::<4>(start, steps, StartAssumption::AtGoal, decide_with_margin).expect("at most 4 steps")
//! };
//! assert_eq!(run(&steps).first_failure(), None);
//! assert!(run(&steps[1..]).first_failure().is_some());
//! # Ok::<(), posegate::table::TableError>(())
//! ```
//!
//! # Assumptions about the estimate
//! The paper assumes that the estimate is at the goal when a task begins ([`StartAssumption::AtGoal`]). On a controller
//! it is not. After a localization the estimate is the observation, which lies within `r_l` of a pose anywhere in the
//! previous set. After a drive it lies where the controller's tolerance leaves it. [`StartAssumption::General`] models
//! this: it also tracks where the estimate may be. A task's margin is then the slack of its success set for *every*
//! such estimate.
//!
//! # The meaning of a success
//! With a probability of at least `1 - risk` the true pose is in every task's success set when the task begins. A
//! gate permits the task there. The risk is the sum of the probabilities outside of the sets of the tasks. It is
//! never a product, because the events may depend on each other.

use heapless::Vec;

use crate::contain::{Cause, Decision, Margin};
use crate::pose::Pose;
use crate::set::PoseSet;
use crate::table::Table;
use crate::task::{Cylinder, MotionUpdate, PoseErrorSet, Risk};

/// The assumed position of the estimate when a task begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StartAssumption {
    /// At the task's goal: the paper's assumption. The gate does not assume it.
    AtGoal,
    /// At any pose that the previous steps allow.
    General,
}

/// One step of a chain.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Step<'a> {
    /// A task that does not change the knowledge.
    Work(&'a Table<'a>),
    /// A task after which the estimate is the observation.
    Localization {
        /// Its success set.
        table: &'a Table<'a>,
        /// The bound r_l of the observation's error.
        bound: Cylinder,
        /// Probability that an observation is farther off than r_l.
        risk: Risk,
    },
    /// A drive.
    Navigation(&'a MotionUpdate),
}

/// The knowledge before a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BeliefState {
    /// The planned pose of the estimate, world frame.
    pub pose: Pose,
    /// Largest distance of the estimate from `pose`.
    pub spread: Cylinder,
    /// The error of the estimate.
    pub knowledge: PoseErrorSet,
}

impl BeliefState {
    /// Returns the set that must lie in a task's success set; `None` if it is 268 m or more.
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
    /// The set before the step is not proven inside the task's success set.
    NotContained(Cause),
    /// The drive may begin outside of its path's start tolerance.
    StartTooFar,
    /// The knowledge is out of range: 268 m and more, or sets of two radii.
    BeyondNumbers,
}

impl core::fmt::Display for Failure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotContained(cause) => write!(f, "{cause}"),
            Self::StartTooFar => {
                f.write_str("the drive may begin outside of its path's start tolerance")
            }
            Self::BeyondNumbers => f.write_str(
                "the uncertainty of the pose is out of range: 268 m or more, or sets of two radii",
            ),
        }
    }
}

impl core::error::Error for Failure {}

impl Failure {
    /// Returns the failure's name in snake case, as JSON writes it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotContained(Cause::TooLarge) => "pose_set_too_large",
            Self::NotContained(Cause::OffTable) => "outside_table",
            Self::NotContained(Cause::NotContained) => "not_contained",
            Self::NotContained(Cause::TooCostly) => "too_costly",
            Self::StartTooFar => "start_too_far",
            Self::BeyondNumbers => "beyond_numbers",
        }
    }
}

/// The result of one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StepEvaluation {
    /// Margin of a task's set; zero if the set is outside. `None` for a drive.
    pub margin: Option<Margin>,
    /// The reason if the step fails.
    pub failure: Option<Failure>,
    /// The part of [`Evaluation::risk`] that this step adds.
    pub risk: Risk,
}

/// The result of a chain of up to `N` steps.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct Evaluation<const N: usize> {
    /// The result of each step. Steps after a failed step are evaluated as if it had succeeded.
    pub steps: Vec<StepEvaluation, N>,
    /// The knowledge after the last step.
    pub after: BeliefState,
    /// Probability that the chain fails although no step does.
    pub risk: Risk,
}

impl<const N: usize> Evaluation<N> {
    /// Returns the index of the first step that fails, and the reason; `None` if no step fails.
    #[must_use]
    pub fn first_failure(&self) -> Option<(usize, Failure)> {
        // A range, since `enumerate` counts with a check for overflow, which is a panic in code for size.
        let mut steps = (0..N).zip(&self.steps);
        steps.find_map(|(index, found)| Some((index, found.failure?)))
    }
}

/// Decides about a set and returns its margin: [`crate::contain::decide_with_margin`], or a sharper test.
pub type ContainmentFn = fn(&Table<'_>, &PoseSet) -> (Decision, Margin);

/// Evaluates a chain; `None` if it has more than `N` steps.
///
/// Cost: one decision per task ([`Table::worst_case`]) and about 1,000 instructions (M4F) per drive; `./ci.sh planning`
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

/// Evaluates one step and changes `at` to the knowledge after it.
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
            // The observation is within the bound of the truth, which is anywhere in the set.
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
