//! The search for the best place of a tag for its task.

use super::gaussian::Gaussian;
use super::guesses;
use super::objective::{self, Objective, PlaceEvaluator, PlaceValue, PosePrior, Task, ViewCost};
use super::quadrature::{Approximate, Quadrature};
use super::scale::{self, Fineness};
use super::search::{Method, Search};
use super::space::Space;
use super::{CostError, expected_cost_of};
use core::cmp::Ordering;
use posegate::shape::{Pose3Deg, Tolerance};
use rayon::prelude::*;

/// The input of a placement.
#[derive(Clone, Copy)]
pub struct PlacementProblem<'a> {
    /// The task and its tag.
    pub task: &'a Task,
    /// The robot's possible poses.
    pub known: PosePrior,
    /// The cost of a view.
    pub cost: &'a dyn ViewCost,
    /// The objective.
    pub objective: Objective,
}

impl core::fmt::Debug for PlacementProblem<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Order")
            .field("task", self.task)
            .field("known", &self.known)
            .field("objective", &self.objective)
            .finish_non_exhaustive()
    }
}

/// A tag at a place, with its evaluation.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The tag's pose in the world.
    pub pose: Pose3Deg,
    /// The tag's size, metres.
    pub size: f64,
    /// `E[c]` over the pose-set's mass; `None` if the pose is known exactly.
    pub mean: Option<Approximate>,
    /// The cost at the goal itself.
    pub cost_at_goal: f64,
    /// The probability of a miss, unknown views included; 0 or 1 if the pose is known exactly.
    pub p_miss: f64,
    /// The probability of a view without a known cost ([`ViewCost::of_view`]): a part of `p_miss`.
    pub p_unknown: Approximate,
    /// A proven lower bound of the largest scale at which S contains the pose-set, for every pose of the tag within
    /// the reserve. `None` if the pose is known exactly, or if S contains the pose-set at any scale.
    pub margin: Option<f64>,
    /// `true` if S is proven to contain the pose-set (the goal, if the pose is known exactly) for every pose of the tag
    /// within the reserve, and no view without a known cost was met. The first part is a proof. The second covers only what the quadrature evaluated: with a
    /// learnt cost, the pose-set may still contain an unknown part smaller than the distance between rays.
    pub contained: bool,
    /// The installation error for which containment and margin are proven.
    pub reserve: Tolerance,
    /// Installation error beyond the reserve at which S is proven to contain the pose-set, in centimetres and degrees;
    /// 0 if the pose is known exactly.
    pub left: f64,
    /// Distance of the tag from the robot at the goal, in the plane, metres.
    pub distance: f64,
}

/// The result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// The best place.
    pub best: Placed,
    /// The best place of each start of the search, the best first.
    pub restarts: Vec<Restart>,
    /// Other local optima, the best first: a mirror image, for example.
    pub others: Vec<Placed>,
    /// The number of places that were evaluated.
    pub evaluations: u64,
}

/// The place at which a start of the search ended, before the final polish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restart {
    /// The tag's pose in the world.
    pub pose: Pose3Deg,
    /// `E[c]` over the pose-set's mass, to about 1e-3; `None` if the pose is known exactly, or nothing is seen.
    pub mean: Option<f64>,
}

/// The reason why no tag was placed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlaceError {
    /// The objective needs a pose-set, but the pose is known exactly.
    #[error("the objective `{0}` is about a pose-set, but the pose is known exactly")]
    Exact(&'static str),
    /// The objective is the smallest tag, but the success set has no limit that a small tag violates.
    #[error(
        "the smallest tag has no size: the task's success set has no limit of the tag's resolution (px_per_bit_min)"
    )]
    NoSmallest,
    /// The cost of a place cannot be computed.
    #[error(transparent)]
    Cost(#[from] CostError),
    /// There are no places to compare.
    #[error("there are no candidates")]
    NoCandidates,
}

/// Searches the best place in a space, and evaluates it at full accuracy.
///
/// `looks` is the largest number of places to evaluate. The result is the same for the same arguments and any number of
/// threads. `progress` is called with each number of places that were evaluated.
///
/// # Errors
/// [`PlaceError`] if the problem is invalid.
pub fn place(
    order: &PlacementProblem<'_>,
    space: &Space,
    method: Method,
    looks: u64,
    seed: u64,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Placement, PlaceError> {
    order.check()?;
    let evaluator = order.evaluator(SEARCH, Fineness::CLOSE);
    let search = Search {
        space,
        value: &|pose| evaluator.value(pose),
        guesses: guesses::guesses(order.task),
        progress,
    };
    let found = search.run(method, looks, seed);
    let restart = |pose: &Pose3Deg| Restart {
        pose: *pose,
        mean: evaluator.mean(*pose),
    };
    let placed = found.best.par_iter().map(|pose| order.placed(*pose));
    let mut placed = placed.collect::<Result<Vec<_>, _>>()?;
    placed.sort_by(|a, b| order.objective.compared(a, b));
    let best = if placed.is_empty() {
        return Err(PlaceError::NoCandidates);
    } else {
        placed.remove(0)
    };
    Ok(Placement {
        best,
        others: placed,
        restarts: found.descents.par_iter().map(restart).collect(),
        evaluations: found.looks,
    })
}

impl Objective {
    /// Returns the order of two places by their cost at full accuracy; equal if the objective is no cost.
    fn compared(self, a: &Placed, b: &Placed) -> Ordering {
        let cost = |one: &Placed| one.mean.map_or(one.cost_at_goal, |mean| mean.value);
        let by_cost = cost(a).total_cmp(&cost(b));
        match self {
            Self::Cost => by_cost,
            Self::ContainedCost => b.contained.cmp(&a.contained).then(by_cost),
            _ => Ordering::Equal,
        }
    }
}

/// Evaluates each of the given poses. Returns the index of the best, and the results in the order of the poses.
///
/// # Errors
/// [`PlaceError`] if the problem is invalid or there are no poses.
pub fn compare(
    order: &PlacementProblem<'_>,
    poses: &[Pose3Deg],
    progress: &(dyn Fn(u64) + Sync),
) -> Result<(usize, Vec<Placed>), PlaceError> {
    order.check()?;
    let evaluator = order.evaluator(SEARCH, Fineness::FINE);
    let looked: Vec<(PlaceValue, Result<Placed, PlaceError>)> = poses
        .par_iter()
        .map(|pose| {
            let both = (evaluator.value(*pose), order.placed(*pose));
            progress(1);
            both
        })
        .collect();
    let values = looked.iter().map(|(value, _)| *value).enumerate();
    let (best, _) = values
        .min_by(|a, b| a.1.order(&b.1))
        .ok_or(PlaceError::NoCandidates)?;
    let placed = looked.into_iter().map(|(_, placed)| placed);
    Ok((best, placed.collect::<Result<_, _>>()?))
}

/// The quadrature of a search: fine enough to resolve the differences that it compares.
const SEARCH: Quadrature = Quadrature {
    accuracy: 1e-3,
    views: 30_000,
    ..Quadrature::ROUGH
};

/// The quadrature of a result. If a wall or the image's border cuts through the pose-set, the limit on views keeps
/// the time to about a second; the reported error is then larger.
const ANSWER: Quadrature = Quadrature {
    accuracy: 1e-7,
    headings: 6_000,
    views: 1_000_000,
};

impl PlacementProblem<'_> {
    fn check(&self) -> Result<(), PlaceError> {
        let about_sets = !matches!(self.objective, Objective::Cost | Objective::ContainedCost);
        if self.known == PosePrior::Exactly && about_sets {
            return Err(PlaceError::Exact(self.objective.name()));
        }
        if self.objective == Objective::SmallestTag && !self.task.asks_for_sharpness() {
            return Err(PlaceError::NoSmallest);
        }
        Ok(())
    }

    fn evaluator(&self, quadrature: Quadrature, fineness: Fineness) -> PlaceEvaluator<'_> {
        PlaceEvaluator {
            task: self.task,
            known: self.known,
            cost: self.cost,
            objective: self.objective,
            quadrature: self.cost.quadrature(quadrature),
            fineness,
        }
    }

    /// Evaluates a place at full accuracy.
    ///
    /// # Errors
    /// [`PlaceError::Cost`] if there is no expected cost.
    pub fn placed(&self, pose: Pose3Deg) -> Result<Placed, PlaceError> {
        let evaluator = self.evaluator(ANSWER, Fineness::FINE);
        let size = match (self.objective, self.known) {
            (Objective::SmallestTag, PosePrior::About(_)) => {
                let value = evaluator.value(pose);
                if value.missing > 0.0 {
                    self.task.tag.size
                } else {
                    value.objective
                }
            }
            _ => self.task.tag.size,
        };
        let resized = Task {
            set: self
                .task
                .set
                .with_views_of(&self.task.tag, |view| view.tag.size = size),
            tag: posegate::shape::Tag {
                size,
                ..self.task.tag
            },
            wall: self.task.wall.clone(),
            reserve: self.task.reserve,
        };
        let evaluator = PlaceEvaluator {
            task: &resized,
            ..evaluator
        };
        let set = resized.at(pose);
        let reserved = resized.reserved(pose, size, 0.0);
        let goal = objective::goal(&set);
        let cost_at_goal = evaluator.at_goal(&set);
        let distance = libm::hypot(pose.x - goal[0], pose.y - goal[1]);
        let mut placed = Placed {
            pose,
            size,
            mean: None,
            cost_at_goal,
            p_miss: 0.0,
            p_unknown: Approximate::default(),
            margin: None,
            contained: evaluator.sees_from_goal(&reserved),
            reserve: resized.reserve,
            left: 0.0,
            distance,
        };
        match self.known {
            PosePrior::Exactly => {
                placed.p_miss = if evaluator.sees_from_goal(&set) {
                    0.0
                } else {
                    1.0
                };
                if set.membership(goal).inside {
                    placed.p_unknown.value = placed.p_miss;
                }
            }
            PosePrior::About(belief) => self.about(&mut placed, &resized, &set, &belief)?,
        }
        Ok(placed)
    }

    fn about(
        &self,
        placed: &mut Placed,
        task: &Task,
        set: &posegate::shape::SuccessSet,
        belief: &Gaussian,
    ) -> Result<(), PlaceError> {
        let of_view = |view| self.cost.of_view(view);
        let quadrature = self.cost.quadrature(ANSWER);
        let found = expected_cost_of(set, belief, self.cost.of_miss(), &of_view, &quadrature)?;
        let mass = found.mass.value;
        placed.mean = Some(found.mean);
        placed.p_miss = found.p_miss.value;
        placed.p_unknown = Approximate {
            value: found.unknown_mass.value / mass,
            error: found.unknown_mass.error / mass,
        };
        let (margin, left) = rayon::join(
            || scale::proven(&task.reserved(placed.pose, placed.size, 0.0), belief),
            || objective::installation(task, placed.pose, belief),
        );
        placed.margin = margin;
        placed.contained =
            margin.is_none_or(|margin| margin >= 1.0) && !(placed.p_unknown.value > 0.0);
        if placed.contained {
            placed.left = left;
        }
        Ok(())
    }
}

impl Task {
    fn asks_for_sharpness(&self) -> bool {
        let views = self.set.views_of(&self.tag);
        views.iter().any(|view| view.sharpness.is_some())
    }
}
