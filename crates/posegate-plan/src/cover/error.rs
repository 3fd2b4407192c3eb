//! Errors of a cover.

use crate::PlanError;

/// The reason why no cover is searched or found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CoverError {
    /// The site has no candidates.
    #[error(
        "the site has no candidates: add [candidate.NAME] tables, written like tags, or [candidates.NAME] tables with `wall`, `every` and `z`"
    )]
    NoCandidates,
    /// The site does not define the looks at candidates.
    #[error(
        "the site does not say from where a candidate is seen: add [planner] look = {{...}} and r = [[...]]"
    )]
    NoLook,
    /// The site has no work task.
    #[error("the site has no work task")]
    NoWork,
    /// A work task without a start: neither `from` nor --from is given.
    #[error("task `{0}` has no start: add `from = \"CHAIN\"` to the task, or pass --from CHAIN")]
    NoStart(String),
    /// The chain does not exist.
    #[error("the site has no chain `{0}`")]
    NoChain(String),
    /// A candidate is on a keep-out.
    #[error(
        "the candidate `{candidate}` is on a keep-out of wall `{wall}`, where no tag may be mounted: remove the candidate or the keep-out"
    )]
    KeepOut {
        /// The candidate's name.
        candidate: String,
        /// The wall's name.
        wall: String,
    },
    /// All ids of a family are in use.
    #[error(
        "no id is left for the candidate `{0}`: all tags of its family are mounted or chosen already; choose a larger family"
    )]
    NoNumber(String),
    /// The bound is above the cost. This is an internal error.
    #[error(
        "internal error: the bound {bound} is above the cost {cost} of a valid choice; please report this site"
    )]
    Bound {
        /// The computed bound.
        bound: f64,
        /// The cost of the choice.
        cost: f64,
    },
    /// A number that is out of range.
    #[error("{0}")]
    Number(String),
    /// A plan could not be made.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The solver of integer programs failed.
    #[error("the integer program was not solved: {0}; try the greedy method")]
    Solver(String),
}
