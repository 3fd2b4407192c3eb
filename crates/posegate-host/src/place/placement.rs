//! The search for the best place of a tag for its task.

use super::gaussian::Gaussian;
use super::grid;
use super::objective::{self, Objective, PlaceEvaluator, PosePrior, Task, ViewCost};
use super::quadrature::{Approximate, Quadrature};
use super::scale::{self, Fineness};
use super::search::{Budget, Descent, Fidelity, Optimizer, Polish, Problem, Solution};
use super::space::Space;
use super::{CostError, expected_cost_of};
use posegate::shape::{Pose3Deg, Scalar, Tolerance};
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

/// Percentages of the budget for each place that is polished: for a descent, and for the last steps.
const DESCENT: u64 = 16;
const LAST: u64 = 6;

/// The share of the budget for the grid on which the search begins, percent.
const GRID: u64 = 16;

/// Smaller budgets start from a few hints instead of a grid.
const SMALL: u64 = 1_200;

/// The number of places that are polished: the best, and possible mirror images.
const POLISHED: usize = 2;

/// The number of places straight in front of the camera that a search may start from.
const AHEAD: u32 = 8;

struct Searched<'a> {
    quick: PlaceEvaluator<'a>,
    fine: PlaceEvaluator<'a>,
    space: &'a Space,
    hints: Vec<Vec<f64>>,
}

impl Problem for Searched<'_> {
    fn dimensions(&self) -> usize {
        self.space.dimensions()
    }

    fn is_periodic(&self, number: usize) -> bool {
        self.space.is_periodic(number)
    }

    fn initial_guesses(&self) -> Vec<Vec<f64>> {
        self.hints.clone()
    }

    fn value(&self, point: &[f64], look: Fidelity) -> f64 {
        let evaluator = match look {
            Fidelity::Quick => &self.quick,
            Fidelity::Fine => &self.fine,
        };
        match self.space.pose(point) {
            Ok(pose) => evaluator.value(pose),
            // Worse than any valid pose, and better the closer it is to a valid one.
            Err(depth) => 1e40 * (1.0 + depth),
        }
    }
}

/// Searches the best place in a space: an optimizer's search, a polish of its best solutions, and an evaluation of
/// the final place at full accuracy.
///
/// `evaluations` is the number of places to evaluate, including those of the polish. The result is the same for the
/// same arguments and any number of threads. `progress` is called with the number of evaluations of each batch.
///
/// # Errors
/// [`PlaceError`] if the problem is invalid or no place was found.
pub fn place(
    order: &PlacementProblem<'_>,
    space: &Space,
    optimizer: &dyn Optimizer,
    evaluations: u64,
    seed: u64,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Placement, PlaceError> {
    order.check()?;
    let share = |of_100: u64| evaluations * of_100 / 100;
    let polished = if optimizer.refines_internally() {
        0
    } else {
        POLISHED as u64 * share(DESCENT + LAST)
    };
    let searched = Searched {
        quick: order.evaluator(None, Fineness::ROUGH),
        fine: order.evaluator(Some(POLISH), Fineness::CLOSE),
        space,
        hints: if evaluations < SMALL {
            let ahead = order.task.ahead();
            ahead.iter().map(|pose| space.point(pose)).collect()
        } else {
            grid::grid(order.task, space, share(GRID) as usize)
        },
    };
    let search = Budget::new(evaluations - polished, progress);
    let mut found = optimizer.search(&searched, &search, seed);
    found.sort_by(|a, b| a.value.total_cmp(&b.value));
    let restarts: Vec<Restart> = found
        .par_iter()
        .filter_map(|found| {
            let pose = space.pose(&found.point).ok()?;
            let mean = searched.fine.mean(pose);
            Some(Restart { pose, mean })
        })
        .collect();
    found.truncate(POLISHED);
    let mut total = search.spent();
    let mut polished = Vec::new();
    if optimizer.refines_internally() {
        polished = core::mem::take(&mut found);
    }
    // Each solution has its own budgets, so the solutions can be polished in parallel with the same results.
    let budgets = [DESCENT, LAST].map(share);
    let ends: Vec<(Vec<Solution>, u64)> = found
        .into_par_iter()
        .with_max_len(1)
        .map(|solution| polish(&searched, solution.point, budgets, seed, progress))
        .collect();
    for (ends, spent) in ends {
        polished.extend(ends);
        total += spent;
    }
    let found = super::search::distinct(&searched, polished);
    let placed: Vec<Result<Placed, PlaceError>> = found
        .par_iter()
        .filter_map(|found| {
            let pose = space.pose(&found.point).ok()?;
            Some(order.placed(pose))
        })
        .collect();
    let mut placed = best_first(placed, order.objective).into_iter();
    let best = placed.next().ok_or(PlaceError::NoCandidates)??;
    Ok(Placement {
        best,
        others: placed.collect::<Result<_, _>>()?,
        restarts,
        evaluations: total,
    })
}

/// Improves a solution in two steps, a descent and a polish of what it finds, with a budget of evaluations for each. Returns the ends,
/// and the evaluations that were spent.
fn polish(
    searched: &Searched<'_>,
    point: Vec<f64>,
    [descent, last]: [u64; 2],
    seed: u64,
    progress: &(dyn Fn(u64) + Sync),
) -> (Vec<Solution>, u64) {
    let budget = Budget::new(descent, progress);
    let value = budget.values(searched, core::slice::from_ref(&point), Fidelity::Fine)[0];
    let from = Solution { point, value };
    let found = Descent { from, sigma: 0.01 }.search(searched, &budget, seed);
    let mut spent = budget.spent();
    let mut ends = Vec::new();
    for from in found {
        let budget = Budget::new(last, progress);
        let last = Polish {
            from,
            step: 1e-3,
            smallest: 1e-8,
        };
        ends.extend(last.search(searched, &budget, seed));
        spent += budget.spent();
    }
    (ends, spent)
}

/// Sorts places by their cost at full accuracy, if the objective is a cost. A place that cannot be evaluated comes first, so that its
/// error is reported.
fn best_first(
    mut placed: Vec<Result<Placed, PlaceError>>,
    objective: Objective,
) -> Vec<Result<Placed, PlaceError>> {
    if matches!(objective, Objective::Cost | Objective::ContainedCost) {
        let contained = objective == Objective::ContainedCost;
        placed.sort_by(|a, b| match (a, b) {
            (Ok(a), Ok(b)) => {
                let cost = |one: &Placed| one.mean.map_or(one.cost_at_goal, |mean| mean.value);
                let misses = |one: &Placed| contained && !one.contained;
                let order = misses(a).cmp(&misses(b));
                order.then(cost(a).total_cmp(&cost(b)))
            }
            _ => a.is_ok().cmp(&b.is_ok()),
        });
    }
    placed
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
    let evaluator = order.evaluator(Some(POLISH), Fineness::FINE);
    let looked: Vec<(f64, Result<Placed, PlaceError>)> = poses
        .par_iter()
        .map(|pose| {
            let both = (evaluator.value(*pose), order.placed(*pose));
            progress(1);
            both
        })
        .collect();
    let values = looked.iter().map(|(value, _)| *value).enumerate();
    let (best, _) = values
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .ok_or(PlaceError::NoCandidates)?;
    let placed = looked.into_iter().map(|(_, placed)| placed);
    Ok((best, placed.collect::<Result<_, _>>()?))
}

/// The quadrature of the polish: finer than in a search, to resolve the differences that it compares.
const POLISH: Quadrature = Quadrature {
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

    fn evaluator(&self, quadrature: Option<Quadrature>, fineness: Fineness) -> PlaceEvaluator<'_> {
        PlaceEvaluator {
            task: self.task,
            known: self.known,
            cost: self.cost,
            objective: self.objective,
            quadrature: quadrature.map(|wanted| self.cost.quadrature(wanted)),
            fineness,
        }
    }

    /// Evaluates a place at full accuracy.
    ///
    /// # Errors
    /// [`PlaceError::Cost`] if there is no expected cost.
    pub fn placed(&self, pose: Pose3Deg) -> Result<Placed, PlaceError> {
        let evaluator = self.evaluator(Some(ANSWER), Fineness::FINE);
        let size = match (self.objective, self.known) {
            (Objective::SmallestTag, PosePrior::About(_)) => {
                let size = evaluator.value(pose);
                if size < 1e20 {
                    size
                } else {
                    self.task.tag.size
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
    /// Returns poses straight in front of the camera at the goal, facing it, at distances up to the largest one.
    fn ahead(&self) -> Vec<Pose3Deg> {
        let mut places = Vec::new();
        let goal = self.set.goal;
        for view in self.set.views_of(&self.tag) {
            let mount = &view.mount;
            let yaw_deg = goal.yaw_deg + mount.yaw_deg;
            let [c, s] = f64::cos_sin_deg(goal.yaw_deg);
            let eye = [
                goal.x + c * mount.x - s * mount.y,
                goal.y + s * mount.x + c * mount.y,
            ];
            let [c, s] = f64::cos_sin_deg(yaw_deg);
            places.extend((0..AHEAD).map(|k| {
                let share = f64::from(k) / f64::from(AHEAD - 1);
                let far = view.d_max * libm::pow(20.0, share - 1.0);
                Pose3Deg {
                    x: eye[0] + far * c,
                    y: eye[1] + far * s,
                    z: mount.z,
                    yaw_deg: yaw_deg + 180.0,
                    ..self.tag.pose
                }
            }));
        }
        places
    }

    fn asks_for_sharpness(&self) -> bool {
        let views = self.set.views_of(&self.tag);
        views.iter().any(|view| view.sharpness.is_some())
    }
}
