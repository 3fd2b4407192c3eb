//! Parts of a success set that are convex at every heading, and the choice among them.
//!
//! A set may be a union of very many such parts: several obstacles, each of which can be passed on any of
//! its sides. So parts are not listed but chosen: for given poses, the part of each alternative with the
//! largest slack ([`Parts::holding`]). Any chosen part lies in the set. A bad choice reduces the margin
//! but never invalidates a proof.

use super::boxed::maximal;
use super::planar::Planar;
use super::prepared::Pose;
use super::scalar::{ALL, NONE, Scalar, Selection, selected};
use super::side::Line;
use super::{
    BoxSet, Exclusion, Footprint, PoseDeg, Resolved, SeparatingHalfPlane, Shape, SuccessSet,
    Visibility,
};
use std::collections::HashMap;
use std::sync::Arc;

/// A set that is convex in (x, y) at every heading.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Convex {
    /// A box.
    Box(BoxSet),
    /// A footprint in a region.
    Footprint(Footprint),
    /// The poses from which a tag is seen.
    Visibility(Visibility),
    /// A half-plane.
    Side(SeparatingHalfPlane),
    /// The empty set: a union without members.
    Nothing,
}

/// A convex set with the numbers of the site in some arithmetic.
#[derive(Clone, Debug)]
pub(crate) enum Ready<S> {
    /// A box's sides are decimal numbers, and its yaw is an arc, so proofs use the box directly.
    Box(BoxSet),
    Footprint(Footprint),
    Visibility(Box<Resolved<S>>),
    Side(Line<S>),
    Nothing,
}

impl Convex {
    /// Converts the numbers of the site to some arithmetic.
    pub(crate) fn resolve<S: Scalar>(&self, goal: PoseDeg) -> Ready<S> {
        match self {
            Self::Box(set) => Ready::Box(*set),
            Self::Footprint(set) => Ready::Footprint(set.clone()),
            Self::Visibility(set) => Ready::Visibility(Box::new(set.resolve(goal))),
            Self::Side(set) => Ready::Side(set.resolve(goal)),
            Self::Nothing => Ready::Nothing,
        }
    }
}

impl<S: Scalar> Ready<S> {
    /// Computes every slack of the selection, numbered from `first`; returns the number after the last. A
    /// box has none.
    pub(crate) fn slacks(
        &self,
        pose: &Planar<S>,
        selection: Selection,
        first: usize,
        note: &mut impl FnMut(usize, &'static str, S),
    ) -> usize {
        match self {
            Self::Box(_) => first,
            Self::Footprint(set) => set.slacks(pose, selection, first, note),
            Self::Visibility(set) => set.slacks(pose, selection, first, note),
            Self::Side(set) => set.slacks(pose, selection, first, note),
            Self::Nothing => {
                if selection & selected(first) != NONE {
                    note(first, "nothing", S::exact(-1.0));
                }
                first + 1
            }
        }
    }
}

/// A part of a success set that is convex in (x, y) at every heading: the intersection of these sets.
#[derive(Clone, Debug)]
pub(crate) struct ConvexPart {
    /// The goal pose: frame g in the world.
    pub goal: PoseDeg,
    all: Vec<Arc<Leaf>>,
}

/// A success set prepared for the choice of convex parts.
#[derive(Debug)]
pub(crate) struct Parts {
    goal: PoseDeg,
    node: Node,
}

#[derive(Debug)]
enum Node {
    Leaf(Arc<Leaf>),
    /// Any of these.
    Choice(Vec<Self>),
    /// All of these.
    All(Vec<Self>),
}

/// A convex set, and the same set with its numbers converted once.
#[derive(Debug)]
struct Leaf {
    set: Convex,
    ready: Ready<f64>,
}

impl Leaf {
    fn new(set: Convex, goal: PoseDeg) -> Self {
        let ready = set.resolve(goal);
        Self { set, ready }
    }

    /// Returns the least slack at a pose.
    fn slack(&self, Pose { planar: pose, yaw }: &Pose) -> f64 {
        let mut least = f64::INFINITY;
        let mut note = |_: usize, _: &'static str, slack: f64| least = least.min(slack);
        match &self.ready {
            Ready::Box(set) => set.slacks(pose.x, pose.y, *yaw, &mut |name, slack| {
                note(0, name, slack)
            }),
            Ready::Side(line) => return line.room(pose),
            Ready::Nothing => return f64::NEG_INFINITY,
            Ready::Footprint(_) | Ready::Visibility(_) => {
                self.ready.slacks(pose, ALL, 0, &mut note);
            }
        }
        least
    }
}

impl Node {
    fn of(shape: &Shape, goal: PoseDeg) -> Self {
        let leaf = |set| Self::Leaf(Arc::new(Leaf::new(set, goal)));
        // A union without members must stay a constraint: a part without it would be too large.
        let any = |mut nodes: Vec<Self>| {
            if nodes.is_empty() {
                nodes.push(leaf(Convex::Nothing));
            }
            Self::Choice(nodes)
        };
        match shape {
            Shape::Box(set) => leaf(Convex::Box(*set)),
            Shape::Footprint(set) => leaf(Convex::Footprint(set.clone())),
            Shape::Visibility(set) => leaf(Convex::Visibility(*set)),
            Shape::Bounded { view, limit } => {
                let views = limit.views(view).into_iter().map(|within| {
                    let seen = leaf(Convex::Visibility(within.view));
                    if !(within.psi_min_deg > 0.0) {
                        return seen;
                    }
                    let oblique = Shape::Apart(Exclusion::Square {
                        view: within.view,
                        psi_min_deg: within.psi_min_deg,
                    });
                    Self::All(vec![seen, Self::of(&oblique, goal)])
                });
                any(views.collect())
            }
            Shape::Apart(set) => {
                let sides = set.sides(goal).into_iter();
                any(sides.map(|side| leaf(Convex::Side(side))).collect())
            }
            Shape::Any(sets) => {
                let is_box = |set: &&Shape| matches!(set, Shape::Box(_));
                let boxes = sets.iter().filter_map(|set| match set {
                    Shape::Box(set) => Some(*set),
                    _ => None,
                });
                let boxes = maximal(boxes.collect()).into_iter();
                let boxes = boxes.map(|set| leaf(Convex::Box(set)));
                let others = sets.iter().filter(|set| !is_box(set));
                any(boxes.chain(others.map(|set| Self::of(set, goal))).collect())
            }
            Shape::All(sets) => Self::All(sets.iter().map(|set| Self::of(set, goal)).collect()),
        }
    }

    fn is_convex(&self) -> bool {
        match self {
            Self::Leaf(_) => true,
            Self::Choice(nodes) => matches!(nodes.as_slice(), [one] if one.is_convex()),
            Self::All(nodes) => nodes.iter().all(Self::is_convex),
        }
    }

    /// Appends the sets with the largest slack at the poses; returns their least slack.
    fn choose(&self, poses: &[Pose], into: &mut Vec<Arc<Leaf>>) -> f64 {
        match self {
            Self::Leaf(leaf) => {
                into.push(leaf.clone());
                let slacks = poses.iter().map(|pose| leaf.slack(pose));
                slacks.fold(f64::INFINITY, f64::min)
            }
            Self::All(nodes) => nodes
                .iter()
                .map(|node| node.choose(poses, into))
                .fold(f64::INFINITY, f64::min),
            Self::Choice(nodes) => {
                let before = into.len();
                let mut best = f64::NEG_INFINITY;
                let mut chosen: Option<Vec<Arc<Leaf>>> = None;
                for node in nodes {
                    let slack = node.choose(poses, into);
                    let theirs = into.split_off(before);
                    // One is always chosen: a part without any would be too large.
                    if chosen.is_none() || slack > best {
                        (best, chosen) = (slack, Some(theirs));
                    }
                }
                into.extend(chosen.into_iter().flatten());
                best
            }
        }
    }
}

impl Parts {
    /// Prepares a set.
    pub(crate) fn of(set: &SuccessSet) -> Self {
        Self {
            goal: set.goal,
            node: Node::of(&set.shape, set.goal),
        }
    }

    /// Returns the set itself if it is convex.
    pub(crate) fn only(&self) -> Option<ConvexPart> {
        self.node.is_convex().then(|| self.holding(&[]).0)
    }

    /// Returns the part with the largest least slack at these poses of the goal frame, and that slack (in
    /// `f64`: the choice need not be exact).
    pub(crate) fn holding(&self, poses: &[[f64; 3]]) -> (ConvexPart, f64) {
        let poses: Vec<Pose> = poses.iter().map(|pose| Pose::from(*pose)).collect();
        let mut all = Vec::new();
        let slack = self.node.choose(&poses, &mut all);
        let goal = self.goal;
        (ConvexPart { goal, all }, slack)
    }
}

impl ConvexPart {
    /// Returns `true` if two parts of the same [`Parts`] are made of the same sets.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.all.len() == other.all.len()
            && self
                .all
                .iter()
                .zip(&other.all)
                .all(|(a, b)| Arc::ptr_eq(a, b))
    }

    /// Returns the least slack of each part at each pose of the goal frame, in `f64`. A set that several parts share is evaluated once.
    pub(crate) fn slacks(parts: &[Self], poses: &[[f64; 3]]) -> Vec<Vec<f64>> {
        let poses: Vec<Pose> = poses.iter().map(|pose| Pose::from(*pose)).collect();
        let mut known: HashMap<*const Leaf, Vec<f64>> = HashMap::new();
        let of_part = |part: &Self| {
            let mut least = vec![f64::INFINITY; poses.len()];
            for leaf in &part.all {
                let slacks = known
                    .entry(Arc::as_ptr(leaf))
                    .or_insert_with(|| poses.iter().map(|pose| leaf.slack(pose)).collect());
                for (least, slack) in least.iter_mut().zip(slacks) {
                    *least = least.min(*slack);
                }
            }
            least
        };
        parts.iter().map(of_part).collect()
    }

    /// Returns the sets whose intersection is the part, each convex at every heading.
    pub(crate) fn constraints(&self) -> impl Iterator<Item = &Convex> {
        self.all.iter().map(|leaf| &leaf.set)
    }

    /// Returns the same sets with their numbers in `f64`.
    pub(crate) fn ready(&self) -> impl Iterator<Item = &Ready<f64>> {
        self.all.iter().map(|leaf| &leaf.ready)
    }

    /// Returns the boxes among the constraints.
    pub(crate) fn boxes(&self) -> impl Iterator<Item = &BoxSet> {
        self.ready().filter_map(|set| match set {
            Ready::Box(set) => Some(set),
            _ => None,
        })
    }

    /// Returns the least slack at a pose of the goal frame of all constraints but boxes, in `f64`.
    pub(crate) fn slack_without_boxes(&self, planar: &Planar<f64>) -> f64 {
        let pose = Pose {
            planar: *planar,
            yaw: 0.0,
        };
        let others = self
            .all
            .iter()
            .filter(|leaf| !matches!(leaf.ready, Ready::Box(_)));
        others
            .map(|leaf| leaf.slack(&pose))
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns the least slack at a pose of the goal frame, in `f64`.
    pub(crate) fn slack(&self, pose: [f64; 3]) -> f64 {
        let pose = Pose::from(pose);
        let slacks = self.all.iter().map(|leaf| leaf.slack(&pose));
        slacks.fold(f64::INFINITY, f64::min)
    }
}
