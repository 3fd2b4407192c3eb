//! Why a chain is not evaluated, or no plan made.

use posegate::bake::BakeError;
use posegate::set::InputError;
use posegate::task::GrowthError;
use posegate::verify::BuildError;

/// Why a chain is not evaluated, or no plan made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A task's success set has no table.
    #[error("task `{task}`: {cause}")]
    Table {
        /// The task.
        task: String,
        /// Why.
        cause: BuildError,
    },
    /// A task's success set has no bound, and the site says of no part of it that it is to be covered.
    #[error("task `{0}`: its success set has no bound; give it a `table` with an `extent`")]
    Unbounded(String),
    /// The error that a localization task leaves does not fit into its own success set.
    #[error(
        "task `{task}`: its error_bound ({translation} m, {yaw_deg} deg) does not fit into its own success set: \
         what it promises is less than what it needs; make the bound smaller or the set larger"
    )]
    BoundTooLarge {
        /// The task.
        task: String,
        /// Metres.
        translation: f64,
        /// Degrees.
        yaw_deg: f64,
    },
    /// Nothing to look at.
    #[error(
        "the site has no localization task{}: a plan has nothing to look at; add a task with kind = \"localization\", or [planner] look = {{...}}",
        if *.0 == 0 { " and no tag" } else { ", though it has tags" }
    )]
    NoLooks(usize),
    /// A task that is not there, or no work task.
    #[error("the site has no work task `{0}`")]
    NoWork(String),
    /// A cost of a drive that is no number, or between places that are not there.
    #[error("costs: {0}")]
    Costs(String),
    /// Nothing says how driving adds to what is unknown, and yet a plan drives: a fault of this program.
    #[error(
        "a plan drives, and nothing says how that adds to what is unknown: a fault of this program"
    )]
    NoModel,
    /// A chain without steps.
    #[error("chain `{0}` has no steps; write `steps = [{{ task = NAME }}, ...]`")]
    NoSteps(String),
    /// A confidence that has no radius.
    #[error("epsilon = {0} has no radius that the gate takes (0.2 and above, below 1)")]
    Epsilon(f64),
    /// A chain that is not there.
    #[error("the site has no chain `{0}`")]
    NoChain(String),
    /// What is known at the start is no pose-set.
    #[error("the start is no pose-set: {0:?}")]
    Start(InputError),
    /// What is known at the start is wider than 268 m.
    #[error("the start's bound is 268 m or more")]
    StartTooWide,
    /// A drive that has no growth.
    #[error(
        "step {step} has no growth: {cause:?}; paths are shorter than 1073 m, and within 2000 m of the origin"
    )]
    Drive {
        /// Which, from 1.
        step: usize,
        /// Why.
        cause: GrowthError,
    },
}

impl PlanError {
    /// Whether it says that a look succeeds from nowhere.
    pub(super) const fn is_nowhere(&self) -> bool {
        matches!(
            self,
            Self::BoundTooLarge { .. }
                | Self::Table {
                    cause: BuildError::Bake(BakeError::Empty { .. } | BakeError::NoPieces(_)),
                    ..
                }
        )
    }
}
