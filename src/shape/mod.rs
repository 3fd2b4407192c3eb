//! Success sets as a site file defines them: where a task can succeed.
//!
//! A success set S (Definition 2) is a closed set of planar poses, given in the goal frame g of its task: a
//! world pose p is in S if `T_w_g^-1 p` is. Numbers here are those of the site file: metres, and degrees if
//! the name says so. Angles are converted to radians only inside an arithmetic that accounts for the rounding
//! of that step ([`Scalar`]).
//!
//! ```
//! use posegate::shape::{BoxSet, PoseDeg, Shape, SuccessSet};
//!
//! // A dock at (2 m, 1 m) that is approached along +y.
//! let success = SuccessSet {
//!     goal: PoseDeg { x: 2.0, y: 1.0, yaw_deg: 90.0 },
//!     shape: Shape::Box(BoxSet {
//!         x: [-0.08, 0.08],
//!         y: [-0.06, 0.06],
//!         yaw_deg: [-4.0, 4.0],
//!     }),
//! };
//! // 7 cm before the dock is inside; 7 cm to its side is not, and `y` is the constraint that fails.
//! let heading = core::f64::consts::FRAC_PI_2;
//! assert!(success.membership([2.0, 0.93, heading]).inside);
//! let aside = success.membership([1.93, 1.0, heading]);
//! let worst = aside.slack.iter().min_by(|a, b| a.1.total_cmp(&b.1));
//! assert_eq!(worst.map(|(name, _)| *name), Some("y"));
//! ```

pub use self::along::{Headed, LineClipper, LineInterval, LineSegment, OPEN, ViewAlongLine};
pub use self::apart::Exclusion;
pub use self::boxed::{BoxSet, is_arc, is_whole_circle};
pub use self::camera::Camera;
pub(crate) use self::camera::Edge;
pub use self::clear::Clear;
pub use self::error_model::{ErrorLimit, ErrorModel};
pub use self::evaluator::{PoseBlock, SetEvaluator};
pub use self::family::Family;
pub use self::footprint::{Footprint, PolygonError};
pub(crate) use self::groups::halves;
pub use self::groups::{GroupName, PoseGroup, Ranges};
pub use self::lens::{Lens, Optic};
pub use self::membership::{Membership, MinSlack};
pub(crate) use self::part::{ConvexPart, Parts, Ready};
pub use self::planar::Planar;
pub use self::polygon::hull;
pub(crate) use self::polygon::{clipped, edges};
pub use self::round::{Round, RoundError};
pub use self::scalar::Scalar;
pub(crate) use self::scalar::farthest_holding;
pub use self::scalar::{ALL, NONE, Selection, rotation, selected};
pub use self::side::SeparatingHalfPlane;
pub use self::side::{Binds, Line};
pub use self::tolerance::{Intrinsics, Sharpness, Tolerance};
pub use self::visibility::Resolved;
pub use self::visibility::{Mount, Sight, Tag, Visibility};
pub use self::wall::Wall;
pub use self::window::Window;

mod along;
mod apart;
mod boxed;
mod camera;
mod clear;
mod digest;
mod error_model;
mod evaluator;
mod family;
mod footprint;
mod groups;
mod hang;
mod lens;
mod membership;
mod part;
mod planar;
mod polygon;
mod prepared;
mod round;
mod scalar;
mod side;
mod survey;
mod tolerance;
mod union;
mod visibility;
mod wall;
mod window;

/// A planar pose as a site file writes it: metres, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseDeg {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Degrees, counter-clockwise.
    pub yaw_deg: f64,
}

/// The world frame as a goal: a set that is resolved in it is in world axes.
pub(crate) const WORLD: PoseDeg = PoseDeg {
    x: 0.0,
    y: 0.0,
    yaw_deg: 0.0,
};

/// A spatial pose as a site file writes it: metres, and URDF's fixed-axis angles in degrees,
/// `R = Rz(yaw) Ry(pitch) Rx(roll)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose3Deg {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Metres.
    pub z: f64,
    /// Degrees.
    pub roll_deg: f64,
    /// Degrees.
    pub pitch_deg: f64,
    /// Degrees.
    pub yaw_deg: f64,
}

/// A success set in its goal frame.
// A site has only a few shapes, so the size of a camera's window does not matter.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Each coordinate in an interval (the paper's task-space region).
    Box(BoxSet),
    /// A convex footprint inside a convex region.
    Footprint(Footprint),
    /// The poses from which a tag is seen (S_l of the paper).
    Visibility(Visibility),
    /// The poses from which a tag is seen and the observation's error is small enough: S_l(r).
    Bounded {
        /// The camera and the tag.
        view: Visibility,
        /// The largest error.
        limit: ErrorLimit,
    },
    /// The outside of something convex.
    Apart(Exclusion),
    /// The union of sets: at least one.
    Any(Vec<Self>),
    /// The intersection of sets: at least one.
    All(Vec<Self>),
}

impl Shape {
    /// Returns the visibility set in the shape if there is exactly one: the camera and its tag.
    #[must_use]
    pub fn visibility(&self) -> Option<&Visibility> {
        only(self.simple().into_iter().filter_map(|set| match set {
            Self::Visibility(view) | Self::Bounded { view, .. } => Some(view),
            Self::Box(_) | Self::Footprint(_) | Self::Apart(_) | Self::Any(_) | Self::All(_) => {
                None
            }
        }))
    }

    /// Returns the sets of which the shape is a union and an intersection, at any depth.
    fn simple(&self) -> Vec<&Self> {
        match self {
            Self::Any(sets) | Self::All(sets) => sets.iter().flat_map(Self::simple).collect(),
            Self::Box(_)
            | Self::Footprint(_)
            | Self::Visibility(_)
            | Self::Bounded { .. }
            | Self::Apart(_) => vec![self],
        }
    }

    /// Returns the poses that are in the set for every position of its reference (box, region, obstacle)
    /// within a tolerance of the goal. Tags have a tolerance of their own.
    #[must_use]
    pub fn within(self, tolerance: Tolerance) -> Self {
        match self {
            Self::Box(set) => Self::Box(set.within(tolerance)),
            Self::Footprint(set) => Self::Footprint(set.within(tolerance)),
            Self::Apart(set) => Self::Apart(set.within(tolerance)),
            Self::Visibility(_) | Self::Bounded { .. } => self,
            Self::Any(sets) => Self::Any(each_within(sets, tolerance)),
            Self::All(sets) => Self::All(each_within(sets, tolerance)),
        }
    }

    /// Returns `true` if no view keeps the error within its limit; tolerances can cause this.
    #[must_use]
    pub fn never_within_error(&self) -> bool {
        match self {
            Self::Bounded { view, limit } => limit.views(view).is_empty(),
            Self::Any(sets) => sets.iter().all(Self::never_within_error),
            Self::All(sets) => sets.iter().any(Self::never_within_error),
            _ => false,
        }
    }

    /// Returns `true` if a box of the shape contains no pose; a tolerance can cause this.
    #[must_use]
    pub fn has_empty_box(&self) -> bool {
        match self {
            Self::Box(set) => set.is_empty(),
            Self::Any(sets) | Self::All(sets) => sets.iter().any(Self::has_empty_box),
            _ => false,
        }
    }

    /// Returns the kind of set, as the site file names it.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Box(_) => "box",
            Self::Footprint(_) => "footprint",
            Self::Visibility(_) | Self::Bounded { .. } => "visibility",
            Self::Apart(Exclusion::Obstacle(_)) => "clear",
            Self::Apart(Exclusion::Gap { .. }) => "footprint",
            Self::Apart(_) => "visibility",
            Self::Any(_) => "any",
            Self::All(sets) => match sets.as_slice() {
                [Self::Footprint(set), Self::Box(_)] => set.round().map_or("all", Round::name),
                _ => "all",
            },
        }
    }
}

/// Returns the item of an iterator that has exactly one.
fn only<T>(mut items: impl Iterator<Item = T>) -> Option<T> {
    let first = items.next();
    first.filter(|_| items.next().is_none())
}

fn each_within(sets: Vec<Shape>, tolerance: Tolerance) -> Vec<Shape> {
    sets.into_iter().map(|set| set.within(tolerance)).collect()
}

/// A success set with the goal pose that places it in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct SuccessSet {
    /// The goal pose x*: frame g in the world.
    pub goal: PoseDeg,
    /// The set in frame g.
    pub shape: Shape,
}

impl SuccessSet {
    /// Returns the depth of the goal itself in an obstacle that no alternative avoids, metres (negative);
    /// `None` if the goal is clear.
    #[must_use]
    pub fn covered_by(&self) -> Option<f64> {
        fn obstacles(shape: &Shape, goal: PoseDeg) -> f64 {
            let origin = Planar::from([0.0; 3]);
            match shape {
                Shape::Apart(set @ Exclusion::Obstacle(_)) => {
                    let rooms = set.lines(goal).map(|line| line.room(&origin));
                    rooms.fold(f64::NEG_INFINITY, f64::max)
                }
                Shape::All(sets) => sets
                    .iter()
                    .map(|set| obstacles(set, goal))
                    .fold(f64::INFINITY, f64::min),
                Shape::Any(sets) => sets
                    .iter()
                    .map(|set| obstacles(set, goal))
                    .fold(f64::NEG_INFINITY, f64::max),
                _ => f64::INFINITY,
            }
        }
        let slack = obstacles(&self.shape, self.goal);
        (slack < 0.0).then_some(slack)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two views in a nested set are no missing view.
    #[test]
    fn single_view_is_counted_at_any_depth() {
        let view = |id| {
            let mut view = visibility::test_view();
            view.tag.id = id;
            Shape::Visibility(view)
        };
        let nested = Shape::All(vec![Shape::Any(vec![view(1), view(2)]), view(3)]);
        assert_eq!(nested.visibility(), None);
        let one = Shape::All(vec![Shape::Any(vec![view(1)])]);
        assert_eq!(one.visibility().map(|view| view.tag.id), Some(1));
        assert_eq!(Shape::Any(Vec::new()).visibility(), None);
    }
}
