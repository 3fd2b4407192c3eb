//! Reports of localization sources, as robots send them.
//!
//! A [`Report`] is the input of a gate: its source, the frame of its numbers, its time, and the [`PoseEstimate`],
//! a pose with its uncertainty. Estimates come from ROS ([`ros`]), from MAVLink ([`mavlink`]), from nine numbers
//! ([`PoseEstimate::compact`]), from `nalgebra` types, or from fields. Nothing is checked on input.
//! [`PoseEstimate::pose_set`] is the only conversion to a pose-set, and it checks every number.
//!
//! Floats are only moved here, never added or multiplied.
//!
//! ```
//! use posegate::report::{FrameId, PoseEstimate, Report};
//! use posegate::set::{Estimate, Uncertainty};
//!
//! // A tag detector that states an error bound: 5 cm and 2 degrees.
//! let report = Report {
//!     source: 0,
//!     frame: FrameId::of("map"),
//!     sequence: 17,
//!     stamp_ms: 81_200,
//!     belief: PoseEstimate::new(
//!         Estimate { x_m: 1.2, y_m: -0.4, yaw_rad: 0.02 },
//!         Uncertainty::Bounded { translation_m: 0.05, yaw_rad: 0.035 },
//!     ),
//! };
//! assert_eq!(report.belief.mean().expect("a pose on the floor").y_um, -400_000);
//! ```

use crate::pose::Pose;
use crate::set::{Estimate, InputError, PoseSet, RadiusSquared, Trust, Uncertainty, place};

pub use self::frame::FrameId;
pub use self::heading::Heading;

mod frame;
mod heading;
pub mod mavlink;
pub mod ros;

/// A source's estimate of the robot's pose, with its uncertainty. Unchecked: any bits are possible.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PoseEstimate {
    /// x, metres, in the report's frame.
    pub x_m: f64,
    /// y, metres, in the report's frame.
    pub y_m: f64,
    /// The robot's heading in the report's frame.
    pub heading: Heading,
    /// The uncertainty of the estimate, in the axes of the report's frame; `None` if the source reports
    /// no uncertainty.
    pub spread: Option<Uncertainty>,
}

/// A pose estimate with its source, frame, sequence number and stamp: the input of a gate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Report {
    /// The index of the source among the gate's sources.
    pub source: u8,
    /// The frame of the estimate.
    pub frame: FrameId,
    /// The source's count of its reports: one more each time, wrapping.
    pub sequence: u32,
    /// The time of the estimate, milliseconds of the controller's wrapping clock.
    pub stamp_ms: u32,
    /// The estimated pose and its uncertainty.
    pub belief: PoseEstimate,
}

impl PoseEstimate {
    /// Returns an estimate with its uncertainty.
    #[must_use]
    pub const fn new(estimate: Estimate, spread: Uncertainty) -> Self {
        Self {
            x_m: estimate.x_m,
            y_m: estimate.y_m,
            heading: Heading::Radians(estimate.yaw_rad),
            spread: Some(spread),
        }
    }

    /// Returns an estimate from nine numbers: x, y (m), yaw (rad), and of the covariance xx, xy, x-yaw, yy,
    /// y-yaw, yaw-yaw. They are `f32`, as in micro-ROS messages and CAN frames: a coordinate of 100 m then has a
    /// resolution of 8 um.
    #[must_use]
    pub fn compact(numbers: [f32; 9]) -> Self {
        let [x_m, y_m, yaw_rad, xx, xy, xt, yy, yt, tt] = numbers.map(f64::from);
        let estimate = Estimate { x_m, y_m, yaw_rad };
        let covariance = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]];
        Self::new(estimate, Uncertainty::Gaussian(covariance))
    }

    /// Returns an estimate with variances only: x, y (m^2), yaw (rad^2); all other terms are zero. If the other
    /// terms are unknown instead of zero, the source's [`crate::set::CrossTerms`] must say so.
    #[must_use]
    pub const fn diagonal(estimate: Estimate, [xx, yy, tt]: [f64; 3]) -> Self {
        let covariance = [[xx, 0.0, 0.0], [0.0, yy, 0.0], [0.0, 0.0, tt]];
        Self::new(estimate, Uncertainty::Gaussian(covariance))
    }

    /// Returns the pose in micrometres and 2^-32 turn.
    ///
    /// # Errors
    /// The [`InputError`] of an estimate or an orientation.
    pub fn mean(&self) -> Result<Pose, InputError> {
        place(self.x_m, self.y_m, || self.heading.angle())
    }

    /// Returns the pose-set of the estimate at a squared radius, with the trust in its source applied. The
    /// heading of a quaternion is within 0.5 unit and 2^-8 unit, of 2^-32 turn, which the error budgets of
    /// [`crate::contain`] include.
    ///
    /// # Errors
    /// [`InputError`]: of the estimate first, then of the uncertainty.
    pub fn pose_set(
        &self,
        radius_squared: RadiusSquared,
        trust: Trust,
    ) -> Result<PoseSet, InputError> {
        let mean = self.mean()?;
        let spread = self.spread.as_ref().ok_or(InputError::CovarianceUnknown)?;
        PoseSet::of_spread(mean, spread, radius_squared, trust)
    }
}

impl From<(nalgebra::Isometry2<f64>, nalgebra::Matrix3<f64>)> for PoseEstimate {
    /// Converts a planar pose and its covariance of (x, y, yaw).
    fn from((pose, covariance): (nalgebra::Isometry2<f64>, nalgebra::Matrix3<f64>)) -> Self {
        // The columns of a symmetric matrix are its rows, and an asymmetric one is refused in either order.
        Self::new(pose.into(), Uncertainty::Gaussian(covariance.into()))
    }
}

impl From<(nalgebra::Isometry3<f64>, nalgebra::Matrix6<f64>)> for PoseEstimate {
    /// Converts a pose in space and its covariance of (x, y, z, roll, pitch, yaw) about fixed axes, as ROS sends
    /// it.
    fn from((pose, covariance): (nalgebra::Isometry3<f64>, nalgebra::Matrix6<f64>)) -> Self {
        let turn = pose.rotation.coords;
        let rows: [[f64; 6]; 6] = covariance.into();
        let [
            [xx, xy, _, _, _, xt],
            [yx, yy, _, _, _, yt],
            _,
            _,
            _,
            [tx, ty, _, _, _, tt],
        ] = rows;
        Self {
            x_m: pose.translation.x,
            y_m: pose.translation.y,
            heading: Heading::Quaternion([turn.x, turn.y, turn.z, turn.w]),
            spread: Some(Uncertainty::Gaussian([
                [xx, xy, xt],
                [yx, yy, yt],
                [tx, ty, tt],
            ])),
        }
    }
}

#[cfg(test)]
mod tests;
