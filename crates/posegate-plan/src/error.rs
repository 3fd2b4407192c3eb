//! Errors of planning and of the evaluation of chains.

use posegate::bake::BakeError;
use posegate::set::InputError;
use posegate::task::GrowthError;
use posegate::verify::BuildError;

/// The reason why a chain is not evaluated, or a plan is not made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A task's success set has no table.
    #[error("task `{task}`: {cause}")]
    Table {
        /// The task's name.
        task: String,
        /// The reason.
        cause: BuildError,
    },
    /// A task's success set is unbounded, and the site gives no extent for its table.
    #[error("task `{0}`: its success set has no bound; give it a `table` with an `extent`")]
    Unbounded(String),
    /// The error bound of a localization task does not fit into the task's own success set.
    #[error(
        "task `{task}`: its error_bound ({translation} m, {yaw_deg} deg) does not fit into its own success set: \
         make the bound smaller or the set larger"
    )]
    BoundTooLarge {
        /// The task's name.
        task: String,
        /// Metres.
        translation: f64,
        /// Degrees.
        yaw_deg: f64,
    },
    /// The site has no localization task.
    #[error(
        "the site has no localization task{}: a plan has nothing to look at; add a task with kind = \"localization\", or [planner] look = {{...}}",
        if *.0 == 0 { " and no tag" } else { ", though it has tags" }
    )]
    NoLooks(usize),
    /// The task does not exist, or is not a work task.
    #[error("the site has no work task `{0}`")]
    NoWork(String),
    /// A drive's cost is not a number, or names a place that does not exist.
    #[error("costs: {0}")]
    Costs(String),
    /// A plan contains a drive, but there is no drive model. This is an internal error.
    #[error("internal error: a plan contains a drive, but there is no drive model")]
    NoModel,
    /// A chain without steps.
    #[error("chain `{0}` has no steps; write `steps = [{{ task = NAME }}, ...]`")]
    NoSteps(String),
    /// A confidence for which the core has no radius.
    #[error("epsilon = {0} has no radius that the gate takes (0.2 and above, below 1)")]
    Epsilon(f64),
    /// The chain does not exist.
    #[error("the site has no chain `{0}`")]
    NoChain(String),
    /// The start's uncertainty is not a valid pose-set.
    #[error("the start is not a valid pose-set: {0}")]
    Start(InputError),
    /// The start's bound is 268 m or more.
    #[error("the start's bound is 268 m or more")]
    StartTooWide,
    /// The uncertainty after a drive cannot be computed.
    #[error(
        "step {step}: cannot compute the uncertainty after the drive: {cause}; paths must be shorter than 1073 m, and within 2000 m of the origin"
    )]
    Drive {
        /// The step's number, from 1.
        step: usize,
        /// The reason.
        cause: GrowthError,
    },
}

impl PlanError {
    /// Returns `true` if the error means that a look succeeds from no pose.
    pub(super) const fn is_empty_look(&self) -> bool {
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
