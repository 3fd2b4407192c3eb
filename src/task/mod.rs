//! Tasks, and the change of the pose knowledge by each: the pose-set modifiers F of work, localization and
//! navigation (Definitions 2 to 5).
//!
//! The knowledge is a [`PoseErrorSet`]: the true pose is the estimate, plus an error that is certain to lie in a
//! cylinder, plus a normally distributed error. A task succeeds if the set of all these poses lies in its
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
//!
//! ```
//! use posegate::set::Estimate;
//! use posegate::task::{BoundedDriveModel, Cylinder, Leg, MotionUpdate, PathTolerance, PoseErrorSet};
//!
//! // After a look at a tag the robot is within 5 cm and 1 degree of its estimate.
//! let after_look = PoseErrorSet::bounded(Cylinder::new(0.05, 0.0175).expect("below 268 m"));
//!
//! // It drives 2 m straight ahead. Its odometry drifts by 1 % and by 0.01 rad a metre.
//! let model = BoundedDriveModel { k_turn: 0.02, k_drift: 0.01, k_slip: 0.01 };
//! let start = Estimate { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0 };
//! let legs = [Leg::Straight(Estimate { x_m: 2.0, ..start })];
//! let drive = MotionUpdate::bounded(&start, &legs, &model, PathTolerance::default())?;
//!
//! let after = drive.after(&after_look).and_then(|known| known.enclosing()).expect("below 268 m");
//! // 5 cm + 1 % of 2 m + 2 m times the heading's error of 0.0375 rad: 14.5 cm.
//! assert!((144_900..145_100).contains(&after.translation_um()));
//! # Ok::<(), posegate::task::GrowthError>(())
//! ```

pub use self::growth::{GrowthError, MotionUpdate, PathTolerance};
pub use self::knowledge::{Cylinder, PoseErrorSet, Risk, enclosing};
pub use self::model::{BoundedDriveModel, ModelError, Odometry};
// The host side also wraps angles with this function.
#[cfg(feature = "std")]
pub use self::path::wrapped;
pub use self::path::{Ends, Leg, Motion, Travel, travel};

#[cfg(test)]
mod error_budget;
mod growth;
mod knowledge;
mod model;
mod path;
#[cfg(test)]
mod tests;
