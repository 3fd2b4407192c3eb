//! The language of success sets: what a site says about where a task can succeed.
//!
//! A success set S (Definition 2) is a closed set of planar poses, given in the goal frame g of its
//! task: a pose p of the world is in S when `T_w_g^-1 p` is. Numbers here are as the site file
//! writes them: metres, and degrees where the name says so; angles are turned into radians only
//! inside an arithmetic that accounts for the rounding of that step ([`Scalar`]).

pub use self::apart::Apart;
pub use self::boxed::{BoxSet, is_arc, is_whole_circle};
pub use self::clear::Clear;
pub use self::footprint::{Footprint, PolygonError};
pub(crate) use self::part::Parts;
pub(crate) use self::part::Ready;
pub use self::part::{Convex, Part};
pub use self::planar::{Membership, Planar};
pub use self::scalar::Scalar;
pub(crate) use self::scalar::{ALL, NONE, Selection, rotation, selected};
pub use self::side::Side;
pub(crate) use self::side::{Binds, Line};
pub(crate) use self::visibility::Resolved;
pub use self::visibility::{Camera, Mount, Sight, Tag, Visibility};
pub use self::wall::Wall;

mod apart;
mod boxed;
mod clear;
mod footprint;
mod part;
mod planar;
mod scalar;
mod side;
mod visibility;
mod wall;

use std::vec::Vec;

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
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Each coordinate in an interval (the paper's task-space region).
    Box(BoxSet),
    /// A convex footprint inside a convex region.
    Footprint(Footprint),
    /// The poses from which a tag is seen (S_l of the paper).
    Visibility(Visibility),
    /// The outside of something convex.
    Apart(Apart),
    /// The union of sets: at least one.
    Any(Vec<Self>),
    /// The intersection of sets: at least one.
    All(Vec<Self>),
}

impl Shape {
    /// The visibility set in it, where there is one only: what the camera looks at.
    #[must_use]
    pub fn visibility(&self) -> Option<&Visibility> {
        match self {
            Self::Visibility(set) => Some(set),
            Self::Any(sets) | Self::All(sets) => {
                let mut seen = sets.iter().filter_map(Self::visibility);
                seen.next().filter(|_| seen.next().is_none())
            }
            Self::Box(_) | Self::Footprint(_) | Self::Apart(_) => None,
        }
    }

    /// What kind of set it is, as the site file names it.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Box(_) => "box",
            Self::Footprint(_) => "footprint",
            Self::Visibility(_) => "visibility",
            Self::Apart(Apart::Obstacle(_)) => "clear",
            Self::Apart(_) => "visibility",
            Self::Any(_) => "any",
            Self::All(_) => "all",
        }
    }
}

/// A success set with the goal pose that places it in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct SuccessSet {
    /// The goal pose x*: frame g in the world.
    pub goal: PoseDeg,
    /// The set in frame g.
    pub shape: Shape,
}
