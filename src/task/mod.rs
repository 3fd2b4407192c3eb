//! Tasks and how each changes the knowledge of the robot's pose: the pose-set modifiers F of work, localization and
//! navigation (Definitions 2 to 5).
//!
//! The knowledge is a [`PoseErrorSet`]: the true pose is the estimate, plus an error that is certain to lie in a
//! cylinder, plus a normally distributed error. A task is checked by whether the set of all these poses lies in its
//! success set ([`PoseErrorSet::about`]). F then gives the knowledge after the task:
//!
//! | task | F |
//! |---|---|
//! | work | nothing changes |
//! | localization | the estimate becomes the observation, the error is in the cylinder r_l ([`PoseErrorSet::bounded`]) |
//! | navigation | the error grows along the path ([`MotionUpdate`]) |
//!
//! Paths and their models are floats ([`Leg`], [`Odometry`], [`BoundedDriveModel`]). They are read once, when a
//! [`MotionUpdate`] is made: on a PC or when a controller starts. After that all arithmetic is on integers, rounded
//! outwards, with the same result on every machine.

pub use self::growth::{GrowthError, MotionUpdate, PathTolerance};
pub use self::knowledge::{Cylinder, PoseErrorSet, Risk, enclosing};
pub use self::model::{BoundedDriveModel, ModelError, Odometry};
// The host side also wraps angles with this function.
#[cfg(feature = "std")]
pub use self::path::wrapped;
pub use self::path::{Ends, Leg, Motion, Travel, travel};

mod growth;
mod knowledge;
mod model;
mod path;
#[cfg(test)]
mod tests;
