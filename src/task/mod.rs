//! Tasks and what they do to what is known of the robot's pose: the pose-set modifiers F of work,
//! localization and navigation (Definitions 2 to 5).
//!
//! What is known is a [`Knowledge`]: the true pose is the estimate, plus an error in a cylinder that holds for
//! certain, plus an error that is normally distributed. A task is asked whether the set of all of these lies in
//! its success set ([`Knowledge::about`]); then F makes the knowledge after it:
//!
//! | task | F |
//! |---|---|
//! | work | nothing changes |
//! | localization | the estimate becomes the observation, the error is in the cylinder r_l ([`Knowledge::bounded`]) |
//! | navigation | what is unknown grows along the path ([`Growth`]) |
//!
//! Paths and their models are floats ([`Leg`], [`Odometry`], [`Drift`]), taken once, when a [`Growth`] is made
//! of them: on a PC or at a controller's start. From then on everything is integers, rounded outwards, and
//! the same on every machine.

pub use self::growth::{Growth, GrowthError, Within};
pub use self::knowledge::{Cylinder, Knowledge, Risk, enclosing};
pub use self::model::{Drift, ModelError, Odometry};
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
