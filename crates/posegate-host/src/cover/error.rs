//! Why a site has no cover.

use crate::plan::PlanError;

/// Why a cover is not looked for, or not found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CoverError {
    /// Nothing to choose from.
    #[error("the site has no candidates: add [candidate.NAME] tables, written like tags")]
    NoCandidates,
    /// Nothing says how a candidate would be looked at.
    #[error(
        "nothing says from where a candidate is seen: add [planner] look = {{...}} and r = [[...]]"
    )]
    NoLook,
    /// Nothing to be served.
    #[error("the site has no work task")]
    NoWork,
    /// A work task that says nowhere what is known where the robot sets out.
    #[error(
        "task `{0}` says nowhere what is known where the robot sets out: add `from = \"CHAIN\"` to it, or give --from"
    )]
    NoStart(String),
    /// A chain that is not there.
    #[error("the site has no chain `{0}`")]
    NoChain(String),
    /// A candidate where no tag may hang.
    #[error(
        "the candidate `{candidate}` is on a keep-out of wall `{wall}`, where no tag may hang: take one of them out"
    )]
    KeepOut {
        /// The candidate.
        candidate: String,
        /// The wall.
        wall: String,
    },
    /// A family of which all tags are taken.
    #[error(
        "no number is left for the candidate `{0}`: all tags of its family hang or are chosen already; choose a larger family"
    )]
    NoNumber(String),
    /// A fault of this program.
    #[error(
        "the bound {bound} is above the cost {cost} of a choice that serves: please report this site"
    )]
    Bound {
        /// What was told to be a bound.
        bound: f64,
        /// What the choice costs.
        cost: f64,
    },
    /// A number that means nothing.
    #[error("{0}")]
    Number(String),
    /// A plan that is not made.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The solver of integer programs gave up.
    #[error("the integer program was not solved: {0}; try the greedy method")]
    Solver(String),
}
