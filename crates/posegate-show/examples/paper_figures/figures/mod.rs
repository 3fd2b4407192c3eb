//! Figs. 1 to 3 of the paper, as the paper has them.

mod answers;
mod chain;
mod localization;
mod multiple;
mod parking;
mod parking_errors;
mod plan;

use posegate::shape::{Shape, Visibility};
use posegate_show::draw::study::{CaseStudy, SEE};

pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Returns the names of the figures with their SVG texts.
pub fn all(study: &CaseStudy) -> Result<[(&'static str, String); 4]> {
    Ok([
        ("paper-fig1-parking.svg", parking::fig1_parking(study)?),
        ("paper-fig2-chain.svg", chain::fig2_chain(study)?),
        (
            "paper-fig3-sections.svg",
            localization::fig3_sections(study)?,
        ),
        ("paper-fig3-plan.svg", plan::fig3_plan(study)?),
    ])
}

/// Returns the view of the tag.
fn sight(study: &CaseStudy) -> Result<&Visibility> {
    match &study.task(SEE)?.success.shape {
        Shape::Visibility(sight) => Ok(sight),
        _ => Err("the success set of the look is not a view".into()),
    }
}
