//! Figs. 1 to 4 of the paper by the pictures of any site. The example `paper_figures` draws them as the paper has them.

use super::chain::chain_picture;
use super::hall::success_of;
use super::ingredients::radians;
use super::placement::placement_picture;
use super::study::{CHAIN, CaseStudy, DOCK, PARK, PoseSetSpec, SEE, StudyError};
use super::subject::Subject;
use super::tag_places::SIGMA;
use super::task_plan::task_plan;
use super::task_sections::task_sections;
use posegate_place::Cost;

/// Returns the figures: file names, and SVG texts.
///
/// # Errors
/// [`StudyError`] if the study does not have a task or its chain.
pub fn figures(study: &CaseStudy) -> Result<Vec<(&'static str, String)>, StudyError> {
    let [one, two] = [PoseSetSpec::ONE_METRE, PoseSetSpec::TWO_METRES];
    let sections = |task, known: [PoseSetSpec; 2]| {
        Ok::<_, StudyError>(task_sections(&subject(study, task, &known)?)?)
    };
    let report = study.chain()?;
    let success = |name: &str| success_of(&study.site, name);
    let chain = chain_picture(CHAIN, &report, &success, Some(&study.site));
    // A title begins with the figure's number.
    let figure = |number: u8, title: &str, picture: String| {
        picture.replace(&format!(">{title}"), &format!(">Fig. {number}: {title}"))
    };
    let plan = |task, known: &[PoseSetSpec]| {
        Ok::<_, StudyError>(task_plan(&subject(study, task, known)?)?)
    };
    let title = format!("Fig. 4: from a bad place to the best (sigma {SIGMA} m, 1°; none in (b))");
    let places = placement_picture(&title, &Cost::default().definition(), &study.places);
    let [set, floor] = ["Success set", "Floor plan"];
    let parked = sections(PARK, [PoseSetSpec::TEN_CENTIMETRES, one])?;
    let docked = sections(DOCK, [PoseSetSpec::FIVE_CENTIMETRES, one])?;
    let seen = sections(SEE, [one, two])?;
    Ok(vec![
        ("fig1-parking.svg", figure(1, set, parked)),
        ("fig1-plan.svg", figure(1, floor, plan(PARK, &[one])?)),
        ("fig2-chain.svg", figure(2, "Chain", chain)),
        ("fig3-sections.svg", figure(3, set, seen)),
        ("fig3-docking.svg", figure(3, set, docked)),
        ("fig3-plan.svg", figure(3, floor, plan(SEE, &[one])?)),
        ("fig4-placement.svg", places),
    ])
}

/// Returns a task with its proven table, and with pose-sets about its goal.
fn subject<'s>(
    study: &'s CaseStudy,
    task: &'s str,
    known: &[PoseSetSpec],
) -> Result<Subject<'s>, StudyError> {
    let mut subject = Subject::new(&study.site, task)?;
    let (goal, table) = (radians(subject.goal()), study.table(task)?);
    let sets = known.iter();
    subject.beliefs = sets
        .map(|known| known.about(goal, table.radius_squared()))
        .collect();
    subject.table = Some(table);
    Ok(subject)
}
