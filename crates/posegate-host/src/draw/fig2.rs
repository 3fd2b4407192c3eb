//! Fig. 2 of the paper: a look at the tag makes docking certain, step by step.

use super::chain::chain_picture;
use super::study::{CHAIN, CaseStudy, StudyError};
use crate::plan::evaluate;
use posegate::chain::StartAssumption;

/// Draws the pose-sets before the look and after it, with each task's success set: each task begins with the estimate at its
/// goal, as in the paper.
///
/// # Errors
/// [`StudyError::Chain`] if the chain cannot be evaluated.
pub fn fig2_chain(study: &CaseStudy) -> Result<String, StudyError> {
    let fault = |error: &dyn std::fmt::Display| StudyError::Chain(error.to_string());
    let site = &study.site;
    let chain = site.chain(CHAIN).map_err(|error| fault(&error))?;
    let report =
        evaluate(site, CHAIN, chain, StartAssumption::AtGoal).map_err(|error| fault(&error))?;
    let success = |name: &str| site.tasks.get(name).map(|task| &task.success);
    Ok(chain_picture(CHAIN, &report, &success, None))
}
