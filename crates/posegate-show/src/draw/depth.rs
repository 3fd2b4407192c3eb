//! The least slack of a success set at many poses. Values that do not depend on the pose are computed once.

use posegate::shape::{Line, Planar, PoseDeg, Resolved, Shape, SuccessSet, is_seen, seen};

/// A success set, prepared for many evaluations.
#[derive(Debug)]
pub struct SlackEvaluator {
    goal: PoseDeg,
    node: Node,
}

#[derive(Debug)]
enum Node {
    /// A set whose membership is cheap.
    Plain(Box<SuccessSet>),
    /// A view.
    View(Box<Resolved<f64>>),
    /// The outside of a convex set: the pose must be on the outer side of at least one line.
    Sides(&'static str, Vec<Line<f64>>),
    Any(Vec<Self>),
    All(Vec<Self>),
}

/// The least slack of a pose, at least 0 inside, and the constraint that has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MinSlack {
    /// The slack, roughly in metres or radians.
    pub slack: f64,
    /// The constraint's name, as in [`SuccessSet::membership`].
    pub name: &'static str,
}

impl SlackEvaluator {
    /// Prepares a set.
    #[must_use]
    pub fn of(set: &SuccessSet) -> Self {
        Self {
            goal: set.goal,
            node: Node::of(&set.shape, set.goal),
        }
    }

    /// Returns the least slack of [`SuccessSet::membership`] at a world pose: m, m, rad.
    #[must_use]
    pub fn at(&self, world: [f64; 3]) -> MinSlack {
        self.node.at(world, &self.planar(world))
    }

    /// Returns `true` if a world pose is in the set.
    #[must_use]
    pub fn holds(&self, world: [f64; 3]) -> bool {
        self.node.holds(world, &self.planar(world))
    }

    fn planar(&self, world: [f64; 3]) -> Planar<f64> {
        let frame = SuccessSet {
            goal: self.goal,
            shape: Shape::All(Vec::new()),
        };
        let [x, y, yaw] = frame.to_goal(world);
        let (cos, sin) = (libm::cos(yaw), libm::sin(yaw));
        Planar { x, y, cos, sin }
    }
}

impl Node {
    fn of(shape: &Shape, goal: PoseDeg) -> Self {
        let each = |sets: &[Shape]| sets.iter().map(|set| Self::of(set, goal)).collect();
        match shape {
            Shape::Any(sets) => Self::Any(each(sets)),
            Shape::All(sets) => Self::All(each(sets)),
            Shape::Apart(set) if set.is_polyhedral() => {
                let sides = set.sides(goal);
                Self::Sides(
                    set.name(),
                    sides.iter().map(|side| side.resolve(goal)).collect(),
                )
            }
            Shape::Visibility(set) => Self::View(Box::new(set.resolve(goal))),
            shape => Self::Plain(Box::new(SuccessSet {
                goal,
                shape: shape.clone(),
            })),
        }
    }

    /// Returns `true` if the least slack is at least 0, without computing all slacks.
    fn holds(&self, world: [f64; 3], pose: &Planar<f64>) -> bool {
        match self {
            Self::View(view) => is_seen(view, pose),
            Self::All(nodes) => nodes.iter().all(|node| node.holds(world, pose)),
            Self::Any(nodes) => nodes.iter().any(|node| node.holds(world, pose)),
            Self::Plain(_) | Self::Sides(..) => self.at(world, pose).slack >= 0.0,
        }
    }

    fn at(&self, world: [f64; 3], pose: &Planar<f64>) -> MinSlack {
        match self {
            Self::Plain(set) => {
                let slacks = set.membership(world).slack;
                least(
                    slacks
                        .into_iter()
                        .map(|(name, slack)| MinSlack { slack, name }),
                )
            }
            Self::View(view) => {
                let mut tightest = ALL_HOLD;
                seen(view, pose, &mut |name, slack| {
                    if slack < tightest.slack {
                        tightest = MinSlack { slack, name };
                    }
                });
                tightest
            }
            Self::Sides(name, sides) => {
                let slacks = sides.iter().map(|side| side.room(pose));
                MinSlack {
                    slack: slacks.fold(f64::NEG_INFINITY, f64::max),
                    name,
                }
            }
            Self::All(nodes) => least(nodes.iter().map(|node| node.at(world, pose))),
            Self::Any(nodes) => {
                let all = nodes.iter().map(|node| node.at(world, pose));
                let best = all.max_by(|a, b| a.slack.total_cmp(&b.slack));
                best.unwrap_or(NOTHING)
            }
        }
    }
}

/// The slack of an empty union.
const NOTHING: MinSlack = MinSlack {
    slack: f64::NEG_INFINITY,
    name: "any",
};

/// The slack of an empty list of constraints.
const ALL_HOLD: MinSlack = MinSlack {
    slack: f64::INFINITY,
    name: "all",
};

fn least(slacks: impl Iterator<Item = MinSlack>) -> MinSlack {
    slacks.fold(ALL_HOLD, |known, next| {
        if next.slack < known.slack {
            next
        } else {
            known
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate_site::{SAMPLE, Site};
    use posegate_testkit::counts;

    /// At random poses of every task of some sites, the numbers equal those of membership.
    #[test]
    fn slack_equals_the_least_slack_of_membership() {
        let bay = include_str!("../../../../examples/sites/loading-bay.toml");
        let lens = include_str!("../../../../examples/sites/lens.toml");
        let mut random = crate::draw::tests::Random(7);
        for text in [SAMPLE, bay, lens] {
            let site = Site::parse(text, "site.toml").unwrap();
            for (name, task) in &site.tasks {
                let depth = SlackEvaluator::of(&task.success);
                let mut inside = 0;
                for _ in 0..counts::rounds(2000, 20) {
                    let goal = task.success.goal;
                    // Half of them near the goal, because sets may be small.
                    let near = if random.signed() < 0.0 { 1.0 } else { 0.03 };
                    let pose = [
                        goal.x + near * 3.0 * random.signed(),
                        goal.y + near * 2.0 * random.signed(),
                        goal.yaw_deg.to_radians() + near * 0.4 * random.signed(),
                    ];
                    let membership = task.success.membership(pose);
                    let slacks = membership.slack.iter().map(|(_, slack)| *slack);
                    let expected = slacks.fold(f64::INFINITY, f64::min);
                    let got = depth.at(pose);
                    assert_eq!(got.slack, expected, "{name}: {pose:?}");
                    assert!(
                        membership
                            .slack
                            .iter()
                            .any(|(n, s)| *n == got.name && *s == got.slack)
                    );
                    inside += u32::from(depth.holds(pose));
                    assert_eq!(depth.holds(pose), membership.inside);
                }
                assert!(inside > 0 || cfg!(miri), "{name}");
            }
        }
    }
}
