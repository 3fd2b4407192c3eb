//! Repeated evaluation of a success set: at many poses, and for blocks of poses.

use super::planar::Planar;
use super::prepared::{Kind, Node, Pose, Prepared};
use super::scalar::{ALL, Scalar};
use super::visibility::{Resolved, distance_and_angles};
use super::{MinSlack, PoseDeg, Ranges, SuccessSet};

/// A success set prepared for evaluation at many poses.
#[derive(Debug)]
pub struct SetEvaluator {
    goal: PoseDeg,
    /// The goal: x, y, and the cosine and sine of its heading.
    frame: Planar<f64>,
    set: Prepared,
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

impl Node {
    /// Returns `true` if no pose of a block is in the set. A slack changes at most by the distance that its point of the robot moves,
    /// the slack of a cone by twice that distance.
    fn excludes(&self, views: &[Resolved<f64>], pose: &Planar<f64>, block: &PoseBlock) -> bool {
        let PoseBlock { distance, turn, .. } = *block;
        let mut excluded = false;
        match &self.kind {
            Kind::Box(own) => own.slacks(pose.x, pose.y, block.middle[2], &mut |name, slack| {
                excluded |= slack < -if name == "yaw" { turn } else { distance };
            }),
            Kind::Footprint(own) => {
                let most = distance + own.lever() * turn;
                own.exact_slacks(pose, &mut |_, slack| excluded |= slack < -most);
            }
            Kind::View(view, _) => {
                let view = &views[*view];
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
            Kind::Sides { set, lines } => {
                let most = set.gap() + distance + set.lever() * turn;
                return lines.iter().all(|(_, line)| line.room(pose) < -most);
            }
            Kind::Near(..) | Kind::Square { .. } => {}
            Kind::Any(nodes) => return nodes.iter().all(|node| node.excludes(views, pose, block)),
            Kind::All(nodes) => return nodes.iter().any(|node| node.excludes(views, pose, block)),
        }
        excluded
    }
}

impl SuccessSet {
    /// Prepares the set.
    #[must_use]
    pub fn evaluator(&self) -> SetEvaluator {
        let [cos, sin] = f64::cos_sin_deg(self.goal.yaw_deg);
        SetEvaluator {
            goal: self.goal,
            frame: Planar {
                x: self.goal.x,
                y: self.goal.y,
                cos,
                sin,
            },
            set: Prepared::of(self),
        }
    }
}

impl SetEvaluator {
    /// Returns `true` if a pose of the goal frame (m, m, rad) is in the set. Agrees with [`SuccessSet::membership`].
    #[must_use]
    pub fn contains(&self, pose: [f64; 3]) -> bool {
        self.set.contains(&pose.into())
    }

    /// Returns `true` if a world pose (m, m, rad) is in the set. Agrees with [`SuccessSet::membership`].
    #[must_use]
    pub fn holds(&self, world: [f64; 3]) -> bool {
        self.contains(self.goal.to_goal(world))
    }

    /// Returns the least slack of [`SuccessSet::membership`] at a world pose: m, m, rad.
    #[must_use]
    pub fn least(&self, world: [f64; 3]) -> MinSlack {
        self.set.least(&self.goal.to_goal(world).into())
    }

    /// Returns `true` if no pose of a block is in the set (in `f64`); `false` if that is not shown.
    #[must_use]
    pub fn excludes(&self, block: &PoseBlock) -> bool {
        let set = &self.set;
        set.root.excludes(&set.views, &block.middle.into(), block)
    }

    /// Returns `[d, phi, psi]` (m, rad; [`Sight`](super::Sight)) of the task's only view at a world pose (x, y, yaw; m,
    /// rad) of the set. `None` outside of the set, and for sets without exactly one view. Agrees with
    /// [`SuccessSet::membership`].
    #[must_use]
    pub fn at(&self, world: [f64; 3]) -> Option<[f64; 3]> {
        let view = self.set.view()?;
        let [dx, dy] = [world[0] - self.frame.x, world[1] - self.frame.y];
        let (c, s) = (self.frame.cos, self.frame.sin);
        let (sin, cos) = libm::sincos(world[2]);
        let pose = Planar {
            x: c * dx + s * dy,
            y: c * dy - s * dx,
            cos: cos * c + sin * s,
            sin: sin * c - cos * s,
        };
        let yaw = world[2] - self.goal.yaw_deg.to_radians();
        if !self.set.contains(&Pose { planar: pose, yaw }) {
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
