//! A success set prepared for questions about poses: what does not depend on a pose is computed once.
//!
//! Membership and slacks are here; [`super::evaluator`] asks it about blocks of poses, [`super::along`] about lines of positions.

use super::membership::{is_seen, seen};
use super::planar::Planar;
use super::scalar::{Scalar, dot};
use super::visibility::Resolved;
use super::{BoxSet, ErrorLimit, Exclusion, Footprint, Line, MinSlack, PoseDeg, Shape, SuccessSet};

/// A prepared set.
#[derive(Debug)]
pub(super) struct Prepared {
    pub(super) root: Node,
    /// The views of tags in the set, in order of occurrence.
    pub(super) views: Vec<Resolved<f64>>,
}

/// A set in the tree.
#[derive(Debug)]
pub(super) struct Node {
    /// Its number in the tree: each set before its members, from 1.
    pub(super) number: u32,
    pub(super) kind: Kind,
}

#[derive(Debug)]
pub(super) enum Kind {
    Box(BoxSet),
    Footprint(Footprint),
    /// A view by its index, and the largest error of its observation.
    View(usize, Option<ErrorLimit>),
    /// The camera is at least this far from the tag, metres, and the tolerances farther.
    Near(Box<Resolved<f64>>, f64),
    /// The camera is outside of a cone about the tag's normal.
    Square {
        view: Box<Resolved<f64>>,
        cosine: f64,
        /// The distance of the tip behind the tag, metres.
        back: f64,
    },
    /// The outside of a polygon or a polyhedron.
    Sides {
        set: Box<Exclusion>,
        /// A pose is in the set if it is in one of these half-planes. Each has its number; those without any pose are omitted.
        lines: Vec<(u32, Line<f64>)>,
    },
    Any(Vec<Node>),
    All(Vec<Node>),
}

/// A pose in the goal frame; its yaw (not wrapped), rad, and its cosine and sine.
#[derive(Clone, Copy)]
pub(super) struct Pose {
    pub(super) planar: Planar<f64>,
    pub(super) yaw: f64,
}

impl From<[f64; 3]> for Pose {
    /// Returns a pose from x, y and yaw: m, m, rad.
    fn from(pose: [f64; 3]) -> Self {
        Self {
            planar: pose.into(),
            yaw: pose[2],
        }
    }
}

impl Prepared {
    pub(super) fn of(set: &SuccessSet) -> Self {
        let (mut views, mut number) = (Vec::new(), 0);
        let root = Node::of(&set.shape, set.goal, &mut views, &mut number);
        Self { root, views }
    }

    /// Returns the only view of a tag; `None` if there is none or more than one.
    pub(super) fn view(&self) -> Option<&Resolved<f64>> {
        super::only(self.views.iter())
    }

    /// Returns `true` if a pose is in the set.
    pub(super) fn contains(&self, pose: &Pose) -> bool {
        self.root.contains(&self.views, pose)
    }

    /// Returns the least slack at a pose, and its constraint.
    pub(super) fn least(&self, pose: &Pose) -> MinSlack {
        self.root.least(&self.views, pose)
    }

    /// Returns the slacks at a pose, by name; of a union those of the set with the largest least slack.
    pub(super) fn slacks(&self, pose: &Pose) -> Vec<(&'static str, f64)> {
        self.root.slacks(&self.views, pose)
    }
}

impl Node {
    fn of(shape: &Shape, goal: PoseDeg, views: &mut Vec<Resolved<f64>>, number: &mut u32) -> Self {
        *number = number.wrapping_add(1);
        let own = *number;
        let mut view = |set: &super::Visibility| {
            views.push(set.resolve(goal));
            views.len() - 1
        };
        let kind = match shape {
            Shape::Box(set) => Kind::Box(*set),
            Shape::Footprint(set) => Kind::Footprint(set.clone()),
            Shape::Visibility(set) => Kind::View(view(set), None),
            Shape::Bounded { view: set, limit } => Kind::View(view(set), Some(*limit)),
            Shape::Apart(Exclusion::Near { view, d_min }) => {
                Kind::Near(Box::new(view.resolve(goal)), *d_min)
            }
            Shape::Apart(Exclusion::Square { view, psi_min_deg }) => {
                let (psi_min_deg, back) = view.too_head_on(*psi_min_deg);
                Kind::Square {
                    view: Box::new(view.resolve(goal)),
                    cosine: f64::cos_sin_deg(psi_min_deg)[0],
                    back,
                }
            }
            Shape::Apart(set) => Kind::Sides {
                set: Box::new(set.clone()),
                lines: (0..)
                    .zip(set.lines(goal))
                    .filter(|(_, line)| line.is_possible())
                    .collect(),
            },
            Shape::Any(sets) | Shape::All(sets) => {
                let nodes = sets.iter().map(|set| Self::of(set, goal, views, number));
                let nodes = nodes.collect();
                if matches!(shape, Shape::Any(_)) {
                    Kind::Any(nodes)
                } else {
                    Kind::All(nodes)
                }
            }
        };
        Self { number: own, kind }
    }

    /// Reports the slacks of a set that is neither a union nor an intersection, by name.
    fn own_slacks(
        &self,
        views: &[Resolved<f64>],
        Pose { planar: pose, yaw }: &Pose,
        note: &mut impl FnMut(&'static str, f64),
    ) {
        match &self.kind {
            Kind::Box(set) => set.slacks(pose.x, pose.y, *yaw, note),
            Kind::Footprint(set) => set.exact_slacks(pose, note),
            Kind::View(view, limit) => {
                let view = &views[*view];
                seen(view, pose, note);
                if let Some(limit) = limit {
                    note("error", limit.slack(&view.set, &view.sight(pose)));
                }
            }
            Kind::Near(view, d_min) => {
                let ray = view.tag_to_camera(pose);
                note("d_min", libm::sqrt(dot(ray, ray)) - d_min - view.less.ray);
            }
            Kind::Square { view, cosine, back } => {
                let ray = view.tag_to_camera(pose);
                let ray = [0, 1, 2].map(|i| ray[i] + back * view.normal[i]);
                note(
                    "psi_min",
                    cosine * libm::sqrt(dot(ray, ray)) - dot(view.normal, ray),
                );
            }
            Kind::Sides { set, lines } => {
                let rooms = lines.iter().map(|(_, line)| line.room(pose));
                note(set.name(), rooms.fold(f64::NEG_INFINITY, f64::max));
            }
            Kind::Any(_) | Kind::All(_) => {}
        }
    }

    fn contains(&self, views: &[Resolved<f64>], pose: &Pose) -> bool {
        match &self.kind {
            Kind::View(view, limit) => {
                let (view, pose) = (&views[*view], &pose.planar);
                let small = |limit: &ErrorLimit| limit.slack(&view.set, &view.sight(pose)) >= 0.0;
                is_seen(view, pose) && limit.as_ref().is_none_or(small)
            }
            Kind::Any(nodes) => nodes.iter().any(|node| node.contains(views, pose)),
            Kind::All(nodes) => nodes.iter().all(|node| node.contains(views, pose)),
            _ => {
                let mut holds = true;
                self.own_slacks(views, pose, &mut |_, slack| holds &= slack >= 0.0);
                holds
            }
        }
    }

    fn least(&self, views: &[Resolved<f64>], pose: &Pose) -> MinSlack {
        match &self.kind {
            Kind::Any(nodes) => {
                let all = nodes.iter().map(|node| node.least(views, pose));
                let best = all.max_by(|a, b| a.slack.total_cmp(&b.slack));
                best.unwrap_or(MinSlack::NOTHING)
            }
            Kind::All(nodes) => {
                let all = nodes.iter().map(|node| node.least(views, pose));
                all.fold(MinSlack::EVERYTHING, MinSlack::lower)
            }
            _ => {
                let mut least = MinSlack::EVERYTHING;
                self.own_slacks(views, pose, &mut |name, slack| {
                    least = least.lower(MinSlack { slack, name });
                });
                least
            }
        }
    }

    fn slacks(&self, views: &[Resolved<f64>], pose: &Pose) -> Vec<(&'static str, f64)> {
        let mut smallest: Vec<(&'static str, f64)> = Vec::new();
        // Several constraints may share a name: the smallest slack of each name is kept.
        let mut note =
            |name, value: f64| match smallest.iter_mut().find(|(known, _)| *known == name) {
                Some((_, least)) => *least = least.min(value),
                None => smallest.push((name, value)),
            };
        match &self.kind {
            Kind::Any(nodes) => {
                let least = |slacks: &[(&'static str, f64)]| {
                    slacks.iter().map(|(_, v)| *v).fold(f64::INFINITY, f64::min)
                };
                return nodes
                    .iter()
                    .map(|node| node.slacks(views, pose))
                    .max_by(|a, b| least(a).total_cmp(&least(b)))
                    .unwrap_or_default();
            }
            Kind::All(nodes) => {
                for (name, value) in nodes.iter().flat_map(|node| node.slacks(views, pose)) {
                    note(name, value);
                }
            }
            _ => self.own_slacks(views, pose, &mut note),
        }
        smallest
    }
}
