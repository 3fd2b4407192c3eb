//! Fig. 4 of the paper: the best place of the tag, for growing uncertainty of the pose.

use super::placement::{Column, placement_picture};
use super::study::{CaseStudy, SEE, StudyError};
use crate::place::{
    Cmaes, Cost, Gaussian, Objective, PlacementProblem, PosePrior, Space, Task, place,
};
use crate::site::Site;
use posegate::shape::Tolerance;
use rayon::prelude::*;

/// Standard deviations of x and y, metres; the heading's is one degree.
pub const SIGMAS: [f64; 2] = [0.1, 0.3];

/// Search ranges of the tag: x, y, z (m) and yaw (degrees).
const FREE: [Option<[f64; 2]>; 4] = [
    Some([0.3, 7.0]),
    Some([-3.0, 3.0]),
    Some([0.0, 2.0]),
    Some([0.0, 360.0]),
];

/// Number of places evaluated by the search for an exactly known pose: each evaluation is quick.
const EVALUATIONS_EXACT: u64 = 2_000;

/// Number of places evaluated by the search for an uncertain pose: the mean is within 0.2 % of the best one known.
const EVALUATIONS: u64 = 400;

/// Returns the tag as in the study's site, at its best place for an exactly known pose, and at its best places for
/// each of [`SIGMAS`]. `progress` is called after each search.
///
/// # Errors
/// [`StudyError`] if the study lacks the task, or its tag a best place.
pub(super) fn places(site: &Site, progress: &(dyn Fn() + Sync)) -> Result<Vec<Column>, StudyError> {
    let set = site.task(SEE)?.success.clone();
    let shape = || StudyError::Shape(SEE.into());
    let tag = *set.tags().first().ok_or_else(shape)?;
    let task = Task {
        set,
        tag,
        wall: None,
        // The figure is about the planned place.
        reserve: Tolerance::NONE,
    };
    let cost = Cost::default();
    let space = Space::free(tag.pose, FREE).map_err(|_| shape())?;
    let order = |known| PlacementProblem {
        task: &task,
        known,
        cost: &cost,
        objective: Objective::Cost,
    };
    let failed = |error: crate::place::PlaceError| StudyError::Place(error.to_string());
    let belief = |sigma: f64| {
        let sigmas = [sigma, sigma, 1f64.to_radians()];
        Gaussian::of_sigmas(sigmas, site.epsilon)
            .map_err(|error| StudyError::Place(error.to_string()))
    };
    let column = |heading: String, known, placed: crate::place::Placed| Column {
        heading,
        set: task.at(placed.pose),
        belief: match known {
            PosePrior::Exactly => None,
            PosePrior::About(belief) => Some(belief),
        },
        placed,
    };
    let first = PosePrior::About(belief(SIGMAS[0])?);
    let before = || -> Result<_, StudyError> {
        let before = order(first).placed(tag.pose).map_err(failed)?;
        let heading = format!("before, sigma {} m, 1°", SIGMAS[0]);
        Ok(column(heading, first, before))
    };
    let mut cases = std::vec![("pose known exactly".to_owned(), PosePrior::Exactly)];
    for sigma in SIGMAS {
        cases.push((
            format!("sigma {sigma} m, 1°"),
            PosePrior::About(belief(sigma)?),
        ));
    }
    let best = |(heading, known)| {
        let evaluations = match known {
            PosePrior::Exactly => EVALUATIONS_EXACT,
            PosePrior::About(_) => EVALUATIONS,
        };
        let search = Cmaes::of_budget(evaluations);
        let found = place(&order(known), &space, &search, evaluations, 1, &|_| ());
        progress();
        Ok(column(heading, known, found.map_err(failed)?.best))
    };
    let (before, found): (_, Result<Vec<_>, StudyError>) =
        rayon::join(before, || cases.into_par_iter().map(best).collect());
    let mut columns = std::vec![before?];
    columns.extend(found?);
    Ok(columns)
}

/// Number of times that `places` calls `progress`.
pub(super) const STEPS: u64 = 1 + SIGMAS.len() as u64;

/// Draws Fig. 4: the tag before, and its best place for growing uncertainty.
#[must_use]
pub fn fig4_placement(study: &CaseStudy) -> String {
    let title = "Fig. 4: where the tag hangs best: the less is known of the pose, the farther";
    placement_picture(title, &study.places)
}
