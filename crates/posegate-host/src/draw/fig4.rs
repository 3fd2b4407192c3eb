//! Fig. 4 of the paper: where the tag hangs best, the less is known of the pose.

use super::placement::{Column, placement_picture};
use super::study::{CaseStudy, SEE, StudyError};
use crate::place::{
    Cmaes, Cost, Gaussian, Objective, PlacementProblem, PosePrior, Space, Task, place,
};
use crate::site::Site;
use rayon::prelude::*;

/// Standard deviations of x and y, metres; of the heading it is a degree.
pub const SIGMAS: [f64; 2] = [0.1, 0.3];

/// Where the tag may hang: x, y, z (m) and yaw (degrees).
const FREE: [Option<[f64; 2]>; 4] = [
    Some([0.3, 7.0]),
    Some([-3.0, 3.0]),
    Some([0.0, 2.0]),
    Some([0.0, 360.0]),
];

/// Places that the search for a pose that is known exactly evaluates: each is quick.
const EVALUATIONS_EXACT: u64 = 2_000;

/// Places that the search for an uncertain pose evaluates: its mean is within 0.2 % of the best one known.
const EVALUATIONS: u64 = 400;

/// The tag as the study's site has it, where it is best for a pose that is known exactly, and for each of [`SIGMAS`].
/// `progress` is told of each.
///
/// # Errors
/// [`StudyError`] where the study lacks the task, or its tag a best place.
pub(super) fn places(site: &Site, progress: &(dyn Fn() + Sync)) -> Result<Vec<Column>, StudyError> {
    let set = site.task(SEE)?.success.clone();
    let shape = || StudyError::Shape(SEE.into());
    let tag = *set.tags().first().ok_or_else(shape)?;
    let task = Task {
        set,
        tag,
        wall: None,
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

/// How often `places` tells its progress.
pub(super) const STEPS: u64 = 1 + SIGMAS.len() as u64;

/// Draws Fig. 4: the tag before, and where it hangs best as less and less is known.
#[must_use]
pub fn fig4_placement(study: &CaseStudy) -> String {
    let title = "Fig. 4: where the tag hangs best: the less is known of the pose, the farther";
    placement_picture(title, &study.places)
}
