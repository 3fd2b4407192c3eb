//! The places of the tag in Fig. 4 of the paper: a bad place, and the best places.

use super::placement::Column;
use posegate::shape::{Pose3Deg, SuccessSet, Tolerance};
use posegate_place::{
    Cost, Gaussian, Method, Objective, PlacementProblem, PosePrior, Space, Task, place,
};
use rayon::prelude::*;

/// Standard deviation of x and y, metres; the heading's is one degree.
pub const SIGMA: f64 = 0.3;

/// The tag before the search: far from the robot, oblique, and placed so that the goal is near the border of S_l.
const START: Pose3Deg = Pose3Deg {
    x: 5.1,
    y: 2.1,
    z: 0.5,
    roll_deg: 0.0,
    pitch_deg: 0.0,
    yaw_deg: 160.0,
};

/// Search ranges of the tag: x, y, z (m) and yaw (degrees).
const FREE: [Option<[f64; 2]>; 4] = [
    Some([0.3, 7.0]),
    Some([-3.0, 3.0]),
    Some([0.0, 2.0]),
    Some([0.0, 360.0]),
];

/// Number of places evaluated by the search for an exactly known pose, whose evaluations are fast.
const EVALUATIONS_EXACT: u64 = 2_000;

/// Number of places evaluated by a search for an uncertain pose.
const EVALUATIONS: u64 = 300;

/// Returns the tag at the start, at its best place for an exactly known pose, and at two best places for an uncertain
/// pose. These have the least E\[c\], and the least E\[c\] if the complete pose-set must see the tag. `progress` is
/// called after each search.
///
/// # Errors
/// The reason if the set needs no tag, its tag cannot be moved, or the tag has no best place.
pub(super) fn places(
    set: &SuccessSet,
    epsilon: f64,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<Column>, String> {
    let set = set.clone();
    let tag = *set.tags().first().ok_or("the success set needs no tag")?;
    let task = Task {
        set,
        tag,
        wall: None,
        // The figure shows the planned place.
        reserve: Tolerance::NONE,
    };
    let cost = Cost::default();
    let space = Space::free(tag.pose, FREE).map_err(|error| error.to_string())?;
    let order = |known, objective| PlacementProblem {
        task: &task,
        known,
        cost: &cost,
        objective,
    };
    let failed = |error: posegate_place::PlaceError| error.to_string();
    let sigmas = [SIGMA, SIGMA, 1f64.to_radians()];
    let known = Gaussian::of_sigmas(sigmas, epsilon).map_err(|error| error.to_string())?;
    let known = PosePrior::About(known);
    let column = |heading: String, known, placed: posegate_place::Placed| Column {
        heading,
        set: task.at(placed.pose),
        belief: match known {
            PosePrior::Exactly => None,
            PosePrior::About(belief) => Some(belief),
        },
        placed,
    };
    let start = || -> Result<_, String> {
        let placed = order(known, Objective::Cost)
            .placed(START)
            .map_err(failed)?;
        Ok(column("(a) start".to_owned(), known, placed))
    };
    let cases = std::vec![
        (
            "(b) best, pose known exactly",
            PosePrior::Exactly,
            Objective::Cost
        ),
        ("(c) least E[c]", known, Objective::Cost),
        (
            "(d) least E[c], all of X\u{302} in S",
            known,
            Objective::ContainedCost
        ),
    ];
    let best = |(heading, known, objective): (&str, PosePrior, Objective)| {
        let evaluations = match known {
            PosePrior::Exactly => EVALUATIONS_EXACT,
            PosePrior::About(_) => EVALUATIONS,
        };
        let found = place(
            &order(known, objective),
            &space,
            Method::Bobyqa,
            evaluations,
            1,
            &|_| (),
        );
        progress();
        Ok(column(
            heading.to_owned(),
            known,
            found.map_err(failed)?.best,
        ))
    };
    let (start, found): (_, Result<Vec<_>, String>) =
        rayon::join(start, || // In sequence the searches are too slow.
            cases.into_par_iter().with_max_len(1).map(best).collect());
    let mut columns = std::vec![start?];
    columns.extend(found?);
    Ok(columns)
}

/// Number of times that `places` calls `progress`.
pub(super) const STEPS: u64 = 3;
