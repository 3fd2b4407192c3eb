//! The language of success sets: what a site says about where a task can succeed.
//!
//! A success set S (Definition 2) is a closed set of planar poses, given in the goal frame g of its
//! task: a pose p of the world is in S when `T_w_g^-1 p` is. Numbers here are as the site file
//! writes them: metres, and degrees where the name says so; angles are turned into radians only
//! inside an arithmetic that accounts for the rounding of that step ([`Scalar`]).

pub use self::boxed::{BoxSet, is_arc, is_whole_circle};
pub use self::camera::Camera;
pub use self::footprint::{Footprint, PolygonError};
pub use self::lens::{Lens, Optic};
pub use self::planar::{Membership, Planar};
pub use self::scalar::Scalar;
pub(crate) use self::scalar::{ALL, NONE, Selection, rotation, selected};
pub(crate) use self::visibility::Resolved;
pub use self::visibility::{Mount, Sight, Tag, Visibility};
pub use self::window::Window;

mod boxed;
mod camera;
mod footprint;
mod lens;
mod planar;
mod scalar;
mod visibility;
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

/// The world's own frame as a goal: what is resolved in it stands in world axes.
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
// A site has a handful of them: what a camera's window takes is well spent.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Each coordinate in an interval (the paper's task-space region).
    Box(BoxSet),
    /// A convex footprint inside a convex region.
    Footprint(Footprint),
    /// The poses from which a tag is seen (S_l of the paper).
    Visibility(Visibility),
}

/// A success set with the goal pose that places it in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct SuccessSet {
    /// The goal pose x*: frame g in the world.
    pub goal: PoseDeg,
    /// The set in frame g.
    pub shape: Shape,
}
