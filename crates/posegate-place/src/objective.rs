//! The objective of a placement: the value of a tag's place.

use super::cost::{Cost, expected_cost_of};
use super::gaussian::Gaussian;
use super::quadrature::Quadrature;
use super::scale::{self, Fineness};
use core::cmp::Ordering;
use posegate::shape::{Pose3Deg, SuccessSet, Tag, Tolerance};

/// The objective of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Objective {
    /// The least expected cost (Eq. 12); a miss has a cost like any view.
    Cost,
    /// The least expected cost of the places at which S contains the complete pose-set.
    ContainedCost,
    /// The largest scale at which S contains the pose-set.
    Margin,
    /// The smallest tag with which S contains the pose-set. Needs a limit of the tag's resolution (`px_per_bit_min`).
    SmallestTag,
    /// The largest installation error beyond the reserve at which S contains the pose-set, in equal numbers of
    /// centimetres and degrees.
    Tolerance,
}

impl Objective {
    /// All objectives.
    pub const ALL: [Self; 5] = [
        Self::Cost,
        Self::ContainedCost,
        Self::Margin,
        Self::SmallestTag,
        Self::Tolerance,
    ];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cost => "cost",
            Self::ContainedCost => "contained-cost",
            Self::Margin => "margin",
            Self::SmallestTag => "smallest-tag",
            Self::Tolerance => "tolerance",
        }
    }
}

/// The robot's possible poses at the look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PosePrior {
    /// At its goal (the paper's x = x*, known exactly).
    Exactly,
    /// Distributed about its goal.
    About(Gaussian),
}

/// The cost of a view, `[d, phi, psi]` in m and rad ([`posegate::shape::Sight`]).
pub trait ViewCost: Sync {
    /// Returns the cost, finite and at least 0; infinity if the cost of such a view is not known. Such a view counts
    /// as a miss, in the mean and in the probability of a miss.
    fn of_view(&self, view: [f64; 3]) -> f64;

    /// Returns the cost of a pose outside S.
    fn of_miss(&self) -> f64;

    /// Returns the definition of the cost in words, with its unit.
    fn definition(&self) -> String;

    /// Returns the quadrature to use instead of the requested one: coarser if a cost is expensive or has kinks.
    fn quadrature(&self, wanted: Quadrature) -> Quadrature {
        wanted
    }
}

impl ViewCost for Cost {
    fn of_view(&self, view: [f64; 3]) -> f64 {
        Self::of_view(self, view)
    }

    fn of_miss(&self) -> f64 {
        self.c_high
    }

    fn definition(&self) -> String {
        Self::definition(self)
    }
}

/// A tag to be mounted for a task.
#[derive(Clone, Debug)]
pub struct Task {
    /// The task's success set, with the tag at its present pose.
    pub set: SuccessSet,
    /// The tag.
    pub tag: Tag,
    /// The wall on which the tag is to be mounted; it does not hide this tag. `None` for no wall.
    pub wall: Option<String>,
    /// The largest installation error. Containment and margins are valid for every pose of the tag within it. The
    /// expected cost is that of the planned pose.
    pub reserve: Tolerance,
}

impl Task {
    /// The reserve of a tag without a tolerance.
    pub const USUAL_RESERVE: Tolerance = Tolerance {
        translation: 0.01,
        turn_deg: 0.5,
    };

    /// Returns the tag's tolerance in a success set, or [`Self::USUAL_RESERVE`] if it has none.
    #[must_use]
    pub fn usual_reserve(set: &SuccessSet, tag: &Tag) -> Tolerance {
        let stated = set.views_of(tag).last().map(|view| view.tag_tolerance);
        stated
            .filter(|tolerance| !tolerance.is_none())
            .unwrap_or(Self::USUAL_RESERVE)
    }

    /// Returns the success set with the tag exactly at a pose, or within its tolerance, but at most the reserve.
    #[must_use]
    pub fn at(&self, pose: Pose3Deg) -> SuccessSet {
        self.changed(pose, self.tag.size, None)
    }

    /// Returns the poses from which the task succeeds for every pose of the tag within the reserve, and `left`
    /// centimetres and degrees beyond it.
    #[must_use]
    pub fn reserved(&self, pose: Pose3Deg, size: f64, left: f64) -> SuccessSet {
        let tolerance = Tolerance {
            translation: self.reserve.translation + 0.01 * left,
            turn_deg: self.reserve.turn_deg + left,
        };
        self.changed(pose, size, Some(tolerance))
    }

    /// Returns the success set with the tag at a pose, with another size and an installation tolerance.
    #[must_use]
    pub fn changed(&self, pose: Pose3Deg, size: f64, tolerance: Option<Tolerance>) -> SuccessSet {
        let set = self.set.with_views_of(&self.tag, |view| {
            view.tag.pose = pose;
            view.tag.size = size;
            view.tag_tolerance = tolerance.unwrap_or_else(|| {
                let own = view.tag_tolerance;
                Tolerance {
                    translation: own.translation.min(self.reserve.translation),
                    turn_deg: own.turn_deg.min(self.reserve.turn_deg),
                }
            });
        });
        let tag = Tag {
            pose,
            size,
            ..self.tag
        };
        match &self.wall {
            Some(wall) => set.without_wall(wall, &tag),
            None => set,
        }
    }
}

/// Evaluates places of a tag.
pub(super) struct PlaceEvaluator<'a> {
    pub task: &'a Task,
    pub known: PosePrior,
    pub cost: &'a dyn ViewCost,
    pub objective: Objective,
    pub quadrature: Quadrature,
    pub fineness: Fineness,
}

/// The expected values at a place.
struct Expected {
    mean: f64,
    p_miss: f64,
    /// The mass of the views without a known cost.
    unknown: f64,
}

/// The value of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlaceValue {
    /// The objective; less is better.
    pub objective: f64,
    /// 0 for a valid place. Otherwise the place is worse than every valid one, and a smaller number is better: at most 1
    /// as part of the scale is missing, above 1 if the goal does not see the tag.
    pub missing: f64,
}

impl PlaceValue {
    /// How much a missing scale counts in a model of the objective's logarithm. It is more than the objective gains by it.
    const STEEPNESS: f64 = 5.0;

    pub fn valid(objective: f64) -> Self {
        Self {
            objective,
            missing: 0.0,
        }
    }

    /// Returns the order of two places, the better one first.
    pub fn order(&self, other: &Self) -> Ordering {
        let missing = self.missing.total_cmp(&other.missing);
        missing.then(self.objective.total_cmp(&other.objective))
    }

    /// Returns a continuous number for optimizers. Costs differ by powers of ten; a model of their logarithms is more exact.
    pub fn merit(&self) -> f64 {
        libm::asinh(self.objective) + Self::STEEPNESS * self.missing
    }
}

/// A scale from this value on counts as contained. It is above 1, so that containment can be proven.
pub(super) const CONTAINED: f64 = 1.0 + 2e-4;

/// Largest installation error beyond the reserve that is tried, centimetres and degrees.
const MOST_LEFT: f64 = 45.0;

impl PlaceEvaluator<'_> {
    /// Returns the value of a pose.
    pub fn value(&self, pose: Pose3Deg) -> PlaceValue {
        let set = self.task.at(pose);
        let reserved = match self.objective {
            Objective::Cost => set.clone(),
            _ => self.task.reserved(pose, self.task.tag.size, 0.0),
        };
        let slack = reserved.membership(goal(&set)).slack;
        let slacks = slack.iter().map(|(_, slack)| *slack);
        let worst = slacks.fold(f64::INFINITY, f64::min);
        // If nothing is seen, a smaller distance from a view is better.
        let unseen = PlaceValue {
            objective: self.cost.of_miss(),
            missing: (2.0 - worst).clamp(1.0, 1e6),
        };
        let PosePrior::About(belief) = self.known else {
            if worst >= 0.0 {
                return PlaceValue::valid(self.at_goal(&set));
            }
            // Just beyond the border, the view is nearly as good as within.
            let cost = self
                .sight_from_goal(&set)
                .map(|view| self.cost.of_view(view));
            let known = cost.filter(|cost| cost.is_finite());
            return PlaceValue {
                objective: known.unwrap_or(unseen.objective),
                missing: (-10.0 * worst).min(1e6),
            };
        };
        if worst < 0.0 && self.objective != Objective::Cost {
            return unseen;
        }
        let scale = |left: f64| {
            let set = self.task.reserved(pose, self.task.tag.size, left);
            scale::largest(&set, &belief, self.fineness)
        };
        let held = |objective: f64, scale: f64| PlaceValue {
            objective,
            missing: (CONTAINED - scale).max(0.0),
        };
        match self.objective {
            Objective::Cost => match self.expected(&set, &belief) {
                Some(Expected { mean, p_miss, .. }) if p_miss < 1.0 - 1e-9 => {
                    PlaceValue::valid(mean)
                }
                _ => unseen,
            },
            Objective::ContainedCost => match self.expected(&set, &belief) {
                Some(found) if found.unknown > 0.0 => PlaceValue {
                    objective: found.mean,
                    missing: 1.0 + found.unknown,
                },
                Some(Expected { mean, p_miss, .. }) => {
                    let mut value = held(mean, scale(0.0));
                    value.missing = value.missing.max(p_miss);
                    value
                }
                None => unseen,
            },
            Objective::Margin => PlaceValue::valid(-scale(0.0).min(1e6)),
            Objective::SmallestTag => self.smallest(pose, &belief),
            Objective::Tolerance => {
                let plain = scale(0.0);
                if plain < CONTAINED {
                    return held(0.0, plain);
                }
                let left = bisected(0.0, MOST_LEFT, |left| scale(left) >= CONTAINED);
                PlaceValue::valid(-left)
            }
        }
    }

    /// Returns `true` if S contains the goal, and the view from there has a known cost.
    pub fn sees_from_goal(&self, set: &SuccessSet) -> bool {
        let membership = set.membership(goal(set));
        let known = self
            .sight_from_goal(set)
            .is_none_or(|view| self.cost.of_view(view).is_finite());
        membership.inside && known
    }

    /// Returns the expected cost of a pose; `None` if the robot's pose is known exactly, or if there is no view of a
    /// tag.
    pub fn mean(&self, pose: Pose3Deg) -> Option<f64> {
        let PosePrior::About(belief) = self.known else {
            return None;
        };
        let found = self.expected(&self.task.at(pose), &belief)?;
        Some(found.mean)
    }

    /// Returns the cost at the goal, or [`ViewCost::of_miss`] if the tag is not seen from there.
    pub fn at_goal(&self, set: &SuccessSet) -> f64 {
        let inside = set.membership(goal(set)).inside;
        let view = self.sight_from_goal(set).filter(|_| inside);
        let cost = view.map(|view| self.cost.of_view(view));
        cost.filter(|cost| cost.is_finite())
            .unwrap_or_else(|| self.cost.of_miss())
    }

    /// Returns the view from the goal, even if the goal is not in S.
    fn sight_from_goal(&self, set: &SuccessSet) -> Option<[f64; 3]> {
        let membership = set.membership(goal(set));
        let sight = membership.sight.or_else(|| {
            // If there are several views, use the task's own tag.
            let mut sights = set
                .tags()
                .into_iter()
                .filter(|tag| tag.id == self.task.tag.id);
            sights.next().and_then(|tag| {
                let alone = posegate::shape::SuccessSet {
                    goal: set.goal,
                    shape: first_view(&set.shape, &tag)?,
                };
                alone.membership(goal(set)).sight
            })
        });
        sight.map(|sight| [sight.d, sight.phi, sight.psi])
    }

    fn expected(&self, set: &SuccessSet, belief: &Gaussian) -> Option<Expected> {
        let miss = self.cost.of_miss();
        let of_view = |view| self.cost.of_view(view);
        let found = expected_cost_of(set, belief, miss, &of_view, &self.quadrature).ok()?;
        Some(Expected {
            mean: found.mean.value,
            p_miss: found.p_miss.value,
            unknown: found.unknown_mass.value,
        })
    }

    /// Returns the smallest size with which S contains the pose-set, searched upwards from 1/8 of the tag's own size.
    fn smallest(&self, pose: Pose3Deg, belief: &Gaussian) -> PlaceValue {
        let scale = |size: f64| {
            let set = self.task.reserved(pose, size, 0.0);
            scale::largest(&set, belief, self.fineness)
        };
        let own = self.task.tag.size;
        // A larger tag has a better resolution, but leaves the image sooner: the sizes that succeed form an interval.
        let sizes = (-12..=8).map(|k| own * libm::exp2(0.25 * f64::from(k)));
        let mut best = 0.0f64;
        let mut below = 0.0;
        for size in sizes {
            let held = scale(size);
            if held >= CONTAINED {
                return PlaceValue::valid(if below > 0.0 {
                    -bisected(-size, -below, |size| scale(-size) >= CONTAINED)
                } else {
                    size
                });
            }
            best = best.max(held);
            below = size;
        }
        PlaceValue {
            objective: below,
            missing: CONTAINED - best,
        }
    }
}

/// Returns an installation error beyond the reserve, in centimetres and degrees, at which S is proven to contain the
/// pose-set. It is the largest one, or at most 2 % smaller if its proof is difficult; 0 if no error is proven.
pub(super) fn installation(task: &Task, pose: Pose3Deg, belief: &Gaussian) -> f64 {
    let reserved = |left: f64| task.reserved(pose, task.tag.size, left);
    let holds = |left: f64| scale::largest(&reserved(left), belief, Fineness::CLOSE) >= CONTAINED;
    if !holds(0.0) {
        return 0.0;
    }
    let largest = bisected(0.0, MOST_LEFT, holds);
    let share = scale::last_proven([0.98, 0.99, 0.999, 1.0], |share| {
        scale::is_contained(&reserved(share * largest), belief, share)
    });
    share.map_or(0.0, |share| share * largest)
}

/// Returns the goal in the world: m, m, rad.
pub(super) fn goal(set: &SuccessSet) -> [f64; 3] {
    [set.goal.x, set.goal.y, set.goal.yaw_deg.to_radians()]
}

/// Returns the largest number for which `holds` is true, by bisection from `holds_at`. `holds` must be true up to
/// some number and false beyond it.
fn bisected(holds_at: f64, most: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (holds_at, most);
    if holds(high) {
        return high;
    }
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

fn first_view(shape: &posegate::shape::Shape, tag: &Tag) -> Option<posegate::shape::Shape> {
    use posegate::shape::Shape;
    match shape {
        Shape::Visibility(view) | Shape::Bounded { view, .. } => {
            (view.tag == *tag).then_some(Shape::Visibility(*view))
        }
        Shape::Any(sets) | Shape::All(sets) => sets.iter().find_map(|set| first_view(set, tag)),
        Shape::Box(_) | Shape::Footprint(_) | Shape::Apart(_) => None,
    }
}
