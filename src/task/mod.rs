//! Tasks and what they do to what is known of the robot's pose: the pose-set modifiers F of work,
//! localization and navigation (Definitions 2 to 5).
//!
//! What is known is a [`PoseErrorSet`]: the true pose is the estimate, plus an error in a cylinder that holds for
//! certain, plus an error that is normally distributed. A task is asked whether the set of all of these lies in
//! its success set ([`PoseErrorSet::about`]); then F makes the knowledge after it:
//!
//! | task | F |
//! |---|---|
//! | work | nothing changes |
//! | localization | the estimate becomes the observation, the error is in the cylinder r_l ([`PoseErrorSet::bounded`]) |
//! | navigation | what is unknown grows along the path ([`MotionUpdate`]) |
//!
//! Paths and their models are floats ([`Leg`], [`Odometry`], [`BoundedDriveModel`]), taken once, when a [`MotionUpdate`] is made
//! of them: on a PC or at a controller's start. From then on everything is integers, rounded outwards, and
//! the same on every machine.

pub use self::growth::{GrowthError, MotionUpdate, PathTolerance};
pub use self::knowledge::{Cylinder, PoseErrorSet, Risk, enclosing};
pub use self::model::{BoundedDriveModel, ModelError, Odometry};
// The host side wraps angles with it, too.
#[cfg(feature = "std")]
pub use self::path::wrapped;
pub use self::path::{Ends, Leg, Motion, Travel, travel};

mod growth;
mod knowledge;
mod model;
mod path;
#[cfg(test)]
mod tests;
