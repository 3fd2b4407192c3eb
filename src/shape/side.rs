//! Half-planes of positions, each inside a set that excludes a convex region.

use super::PoseDeg;
use super::planar::Planar;
use super::scalar::{NONE, Scalar, Selection, Vector, dot, selected};
use super::visibility::{Resolved, Visibility};
use super::wall::{WALL_BORDER, Wall};

/// A half-plane at every heading. Its poses are certain to be in the [`super::Exclusion`] for which it was
/// made, for any direction with which it was made.
#[derive(Clone, Debug, PartialEq)]
pub enum SeparatingHalfPlane {
    /// Points of the robot (robot frame) beyond an edge of an obstacle (goal frame, obstacle to its left).
    OfObstacle {
        /// Metres.
        points: Vec<[f64; 2]>,
        /// From, to, metres.
        edge: [[f64; 2]; 2],
        /// Required distance, metres.
        gap: f64,
    },
    /// Corners of an obstacle (goal frame) beyond an edge of the robot (robot frame, robot to its left).
    OfRobot {
        /// Metres.
        points: Vec<[f64; 2]>,
        /// From, to, metres.
        edge: [[f64; 2]; 2],
        /// Required distance, metres.
        gap: f64,
    },
    /// The camera is so far from the tag along a direction that its distance is at least `d_min`.
    Near {
        /// The camera and the tag.
        view: Visibility,
        /// Metres.
        d_min: f64,
        /// From the tag, on the floor; a unit vector. Zero if the camera is so far above or below the tag that
        /// no position is too near.
        direction: [f64; 2],
    },
    /// Beyond a tangent plane of the cone of head-on views.
    Square {
        /// The camera and the tag.
        view: Visibility,
        /// Degrees.
        psi_min_deg: f64,
        /// From the tag: a unit vector.
        toward: [f64; 3],
    },
    /// Below a plane that has the tag below it and the wall above.
    Hidden {
        /// The camera and the tag.
        view: Visibility,
        /// The wall that may hide the tag.
        wall: Wall,
        /// In the goal frame.
        normal: [f64; 3],
        /// Metres.
        offset: f64,
    },
}

/// The points that a line constrains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binds {
    /// Points of the robot, by a line of the goal frame.
    Robot,
    /// Points of the goal frame, by a line of the robot.
    Goal,
}

/// A half-plane in some arithmetic: `normal . P <= offset` for every point P, and pose-independent numbers that
/// must be at least zero.
#[derive(Clone, Debug)]
pub struct Line<S> {
    /// The points that the line constrains.
    pub binds: Binds,
    /// The points P, metres: of the robot, or of the goal frame.
    pub points: Vec<[S; 2]>,
    /// Unit normal, in the other frame.
    pub normal: [S; 2],
    /// Metres.
    pub offset: S,
    constants: Vec<S>,
    name: &'static str,
}

/// Returns a vector scaled to a length of at most one, for any rounding.
fn shortened<const N: usize>(v: [f64; N]) -> [f64; N] {
    let length = libm::sqrt(v.iter().map(|c| c * c).sum());
    v.map(|c| {
        if length > 0.0 {
            c / length * (1.0 - 1e-14)
        } else {
            0.0
        }
    })
}

impl SeparatingHalfPlane {
    /// Returns the half-plane with the site's numbers in some arithmetic.
    pub fn resolve<S: Scalar>(&self, goal: PoseDeg) -> Line<S> {
        let beyond = |binds, points: &[[f64; 2]], [[ax, ay], [bx, by]]: [[f64; 2]; 2], gap: f64| {
            let unit = S::exact(1.0 / libm::hypot(bx - ax, by - ay));
            let from = [ax, ay].map(S::exact);
            let along = [S::exact(bx) - from[0], S::exact(by) - from[1]];
            // The left of the edge is the inside: inward normal (-y, x).
            let normal = [-along[1] * unit, along[0] * unit];
            Line {
                binds,
                points: points.iter().map(|p| p.map(S::exact)).collect(),
                offset: normal[0] * from[0] + normal[1] * from[1] - S::exact(gap),
                normal,
                constants: Vec::new(),
                name: "obstacle",
            }
        };
        let camera = |tag: &Resolved<S>, binds, normal, offset, constants, name| Line {
            binds,
            points: std::vec![[tag.mount[0], tag.mount[1]]],
            normal,
            offset,
            constants,
            name,
        };
        match self {
            Self::OfObstacle { points, edge, gap } => beyond(Binds::Robot, points, *edge, *gap),
            Self::OfRobot { points, edge, gap } => beyond(Binds::Goal, points, *edge, *gap),
            Self::Near {
                view,
                d_min,
                direction,
            } => {
                let tag: Resolved<S> = view.resolve(goal);
                let [ux, uy] = shortened(*direction).map(S::exact);
                let height = tag.mount[2] - tag.centre[2];
                let d_min = *d_min + view.tolerance_margins().ray;
                let room = height.square() - S::exact(d_min).square();
                let at = ux * tag.centre[0] + uy * tag.centre[1];
                let offset = if *direction == [0.0; 2] {
                    room
                } else {
                    -at - (-room).root()
                };
                camera(&tag, Binds::Robot, [-ux, -uy], offset, Vec::new(), "d_min")
            }
            Self::Square {
                view,
                psi_min_deg,
                toward,
            } => {
                let tag: Resolved<S> = view.resolve(goal);
                let (psi_min_deg, back) = view.too_head_on(*psi_min_deg);
                let cosine = S::cos_sin_deg(psi_min_deg)[0];
                let toward = shortened(*toward).map(S::exact);
                let k: Vector<S> = [0, 1, 2].map(|i| cosine * toward[i] - tag.normal[i]);
                let [cx, cy, cz] =
                    [0, 1, 2].map(|i| tag.centre[i] - S::exact(back) * tag.normal[i]);
                let offset = k[2] * (tag.mount[2] - cz) - k[0] * cx - k[1] * cy;
                camera(
                    &tag,
                    Binds::Robot,
                    [-k[0], -k[1]],
                    offset,
                    Vec::new(),
                    "psi_min",
                )
            }
            Self::Hidden {
                view,
                wall,
                normal,
                offset,
            } => {
                let tag: Resolved<S> = view.resolve(goal);
                let n = normal.map(S::exact);
                let offset = S::exact(*offset);
                let above = wall
                    .corners_in_goal::<S>(goal)
                    .into_iter()
                    .map(|p| dot(n, p) - offset + S::exact(WALL_BORDER));
                let hung = S::exact(tag.less.hung);
                let below = tag.corners.into_iter().map(|k| offset - dot(n, k) - hung);
                let constants = above.chain(below).collect();
                let offset = offset - n[2] * tag.mount[2] - S::exact(tag.less.mounted);
                camera(&tag, Binds::Robot, [n[0], n[1]], offset, constants, "wall")
            }
        }
    }
}

impl Line<f64> {
    /// Returns `false` if a pose-independent number is negative: no pose is in such a half-plane.
    pub(super) fn is_possible(&self) -> bool {
        let mut constants = self.constants.iter();
        !constants.any(|constant| constant.is_finite() && *constant < 0.0)
    }

    /// Returns the least slack of the points; minus infinity if a pose-independent number is negative.
    pub fn room(&self, pose: &Planar<f64>) -> f64 {
        if self.constants.iter().any(|constant| *constant < 0.0) {
            return f64::NEG_INFINITY;
        }
        let points = self.points.iter().map(|point| self.of_point(pose, *point));
        points.fold(f64::INFINITY, f64::min)
    }
}

impl<S: Scalar> Line<S> {
    /// Returns the slack of a point at a pose.
    pub(super) fn of_point(&self, pose: &Planar<S>, point: [S; 2]) -> S {
        let [x, y] = match self.binds {
            Binds::Robot => pose.to_goal(point),
            Binds::Goal => pose.to_robot_level(point),
        };
        self.offset - self.normal[0] * x - self.normal[1] * y
    }

    /// Computes every slack of the selection, numbered from `first`; returns their number.
    pub(crate) fn slacks(
        &self,
        pose: &Planar<S>,
        selection: Selection,
        first: usize,
        note: &mut impl FnMut(usize, &'static str, S),
    ) -> usize {
        let mut index = first;
        let mut wanted = |slack: &dyn Fn() -> S| {
            if selection & selected(index) != NONE {
                note(index, self.name, slack());
            }
            index += 1;
        };
        for point in &self.points {
            wanted(&|| self.of_point(pose, *point));
        }
        for constant in &self.constants {
            wanted(&|| *constant);
        }
        index
    }
}
