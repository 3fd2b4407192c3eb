//! Repeated evaluation of a success set: at many poses, and for blocks of poses.

use super::membership::is_seen;
use super::scalar::ALL;
use super::visibility::{Resolved, distance_and_angles};
use super::{
    BoxSet, ErrorLimit, Exclusion, Footprint, Line, Planar, Ranges, Scalar, Shape, SuccessSet,
};

/// A success set prepared for evaluation at many poses.
#[derive(Debug)]
pub struct SetEvaluator<'a> {
    set: &'a SuccessSet,
    /// The goal: x, y, and the cosine and sine of its heading.
    goal: Planar<f64>,
    root: Node,
    view: Option<Resolved<f64>>,
}

/// Poses of the goal frame about a middle one.
#[derive(Clone, Copy, Debug)]
pub struct PoseBlock {
    /// The middle pose: m, m, rad.
    pub middle: [f64; 3],
    /// The largest distance of a pose's position from the middle one, metres.
    pub distance: f64,
    /// The largest difference of a pose's yaw from the middle one, rad.
    pub turn: f64,
}

impl PoseBlock {
    /// Returns the block of ranges of x, y and yaw.
    #[must_use]
    pub fn of(ranges: Ranges) -> Self {
        let [x, y, turn] = ranges.map(|[lo, hi]| 0.5 * (hi - lo));
        Self {
            middle: ranges.map(|[lo, hi]| 0.5 * (lo + hi)),
            distance: libm::hypot(x, y),
            turn,
        }
    }
}

#[derive(Debug)]
enum Node {
    Box(BoxSet),
    Footprint(Footprint),
    View(Box<Resolved<f64>>, Option<ErrorLimit>),
    /// The outside of a polygon or a polyhedron: a pose is in it if it is in one of the half-planes.
    Sides(Vec<Line<f64>>, Exclusion),
    /// The outside of a curved body.
    Curved(Exclusion),
    Any(Vec<Self>),
    All(Vec<Self>),
}

impl Node {
    fn new(shape: &Shape, set: &SuccessSet) -> Self {
        let each = |sets: &[Shape]| sets.iter().map(|shape| Self::new(shape, set)).collect();
        match shape {
            Shape::Box(set) => Self::Box(*set),
            Shape::Footprint(set) => Self::Footprint(set.clone()),
            Shape::Visibility(view) => Self::View(Box::new(view.resolve(set.goal)), None),
            Shape::Bounded { view, limit } => {
                Self::View(Box::new(view.resolve(set.goal)), Some(*limit))
            }
            Shape::Apart(apart) if apart.is_polyhedral() => {
                let sides = apart.sides(set.goal);
                let sides = sides.iter().map(|side| side.resolve(set.goal)).collect();
                Self::Sides(sides, apart.clone())
            }
            Shape::Apart(apart) => Self::Curved(apart.clone()),
            Shape::Any(sets) => Self::Any(each(sets)),
            Shape::All(sets) => Self::All(each(sets)),
        }
    }

    fn contains(&self, set: &SuccessSet, pose: &Planar<f64>, yaw: f64) -> bool {
        let mut holds = true;
        let mut note = |slack: f64| holds &= slack >= 0.0;
        match self {
            Self::Box(own) => own.slacks(pose.x, pose.y, yaw, &mut |_, slack| note(slack)),
            Self::Footprint(own) => own.exact_slacks(pose, &mut |_, slack| note(slack)),
            Self::View(view, limit) => {
                return is_seen(view, pose)
                    && limit
                        .as_ref()
                        .is_none_or(|limit| limit.slack(&view.set, &view.sight(pose)) >= 0.0);
            }
            Self::Sides(sides, _) => return sides.iter().any(|side| side.room(pose) >= 0.0),
            Self::Curved(apart) => return apart.slack(set.goal, pose) >= 0.0,
            Self::Any(nodes) => return nodes.iter().any(|node| node.contains(set, pose, yaw)),
            Self::All(nodes) => return nodes.iter().all(|node| node.contains(set, pose, yaw)),
        }
        holds
    }

    /// Returns `true` if no pose of a block is in the set. A slack changes at most by the distance that its point of the robot moves,
    /// the slack of a cone by twice that distance.
    fn excludes(&self, pose: &Planar<f64>, block: &PoseBlock) -> bool {
        let PoseBlock { distance, turn, .. } = *block;
        let mut excluded = false;
        match self {
            Self::Box(own) => own.slacks(pose.x, pose.y, block.middle[2], &mut |name, slack| {
                excluded |= slack < -if name == "yaw" { turn } else { distance };
            }),
            Self::Footprint(own) => {
                let most = distance + own.lever() * turn;
                own.exact_slacks(pose, &mut |_, slack| excluded |= slack < -most);
            }
            Self::View(view, _) => {
                let [x, y, _] = view.centre;
                let reach = libm::hypot(x - pose.x, y - pose.y) + view.set.tag.size + distance;
                let most = 2.0 * (distance + reach * turn);
                // An image through a lens is larger than the window of the slacks.
                let exact = view.image_slack(pose).is_some();
                view.slacks(pose, ALL, 0, &mut |_, name, slack| {
                    excluded |= slack < -most && !(exact && name.starts_with("image"));
                });
            }
            // The depth in the body changes so; the distance that a gap adds is not a depth.
            Self::Sides(sides, apart) => {
                let most = apart.gap() + distance + apart.lever() * turn;
                return sides.iter().all(|side| side.room(pose) < -most);
            }
            Self::Curved(_) => {}
            Self::Any(nodes) => return nodes.iter().all(|node| node.excludes(pose, block)),
            Self::All(nodes) => return nodes.iter().any(|node| node.excludes(pose, block)),
        }
        excluded
    }
}

impl SuccessSet {
    /// Prepares the set.
    #[must_use]
    pub fn evaluator(&self) -> SetEvaluator<'_> {
        let [cos, sin] = f64::cos_sin_deg(self.goal.yaw_deg);
        SetEvaluator {
            set: self,
            goal: Planar {
                x: self.goal.x,
                y: self.goal.y,
                cos,
                sin,
            },
            root: Node::new(&self.shape, self),
            view: self.shape.visibility().map(|view| view.resolve(self.goal)),
        }
    }
}

impl SetEvaluator<'_> {
    /// Returns `true` if a pose of the goal frame (m, m, rad) is in the set. Agrees with [`SuccessSet::membership`].
    #[must_use]
    pub fn contains(&self, pose: [f64; 3]) -> bool {
        self.root.contains(self.set, &pose.into(), pose[2])
    }

    /// Returns `true` if no pose of a block is in the set (in `f64`); `false` if that is not shown.
    #[must_use]
    pub fn excludes(&self, block: &PoseBlock) -> bool {
        self.root.excludes(&block.middle.into(), block)
    }

    /// Returns `[d, phi, psi]` (m, rad; [`Sight`](super::Sight)) of the task's only view at a world pose (x, y, yaw; m,
    /// rad) of the set. `None` outside of the set, and for sets without exactly one view. Agrees with
    /// [`SuccessSet::membership`].
    #[must_use]
    pub fn at(&self, world: [f64; 3]) -> Option<[f64; 3]> {
        let view = self.view.as_ref()?;
        let [dx, dy] = [world[0] - self.goal.x, world[1] - self.goal.y];
        let (c, s) = (self.goal.cos, self.goal.sin);
        let (sin, cos) = libm::sincos(world[2]);
        let pose = Planar {
            x: c * dx + s * dy,
            y: c * dy - s * dx,
            cos: cos * c + sin * s,
            sin: sin * c - cos * s,
        };
        let yaw = world[2] - self.set.goal.yaw_deg.to_radians();
        if !self.root.contains(self.set, &pose, yaw) {
            return None;
        }
        let ray = view.in_camera(&pose, view.centre);
        Some(distance_and_angles(
            ray,
            view.tag_to_camera(&pose),
            view.normal,
        ))
    }
}
