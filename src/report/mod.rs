//! Reports of localization sources, as robots send them.
//!
//! A [`Report`] is what a gate is fed with: which source it comes from, in which frame its numbers are,
//! when it was made, and the [`PoseEstimate`] itself: a pose and how far the truth may be from it. Beliefs come
//! from ROS ([`ros`]), from MAVLink ([`mavlink`]), from nine numbers ([`PoseEstimate::compact`]), from `nalgebra`
//! types, or are put together by hand. Nothing is checked on the way in: a belief is turned into a
//! pose-set at one door, [`PoseEstimate::pose_set`], and there every number is.
//!
//! Floats are only moved here, never added or multiplied.

use crate::pose::Pose;
use crate::set::{Estimate, InputError, PoseSet, RadiusSquared, Trust, Uncertainty, place};

pub use self::frame::FrameId;
pub use self::heading::Heading;

mod frame;
mod heading;
pub mod mavlink;
pub mod ros;

/// Where a source believes the robot to be, and how far the truth may be from it. As it came: any bits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PoseEstimate {
    /// Metres, in the report's frame.
    pub x_m: f64,
    /// Metres, in the report's frame.
    pub y_m: f64,
    /// Which way the robot looks in the report's frame.
    pub heading: Heading,
    /// How far the truth may be from it, in the axes of the report's frame; `None` where the source says
    /// that it does not know.
    pub spread: Option<Uncertainty>,
}

/// A belief with all that a gate must know of it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Report {
    /// Which of the gate's sources sent it.
    pub source: u8,
    /// The frame of its numbers.
    pub frame: FrameId,
    /// Counts the source's reports: one more each time, wrapping.
    pub sequence: u32,
    /// When it was made, milliseconds of the controller's wrapping clock.
    pub stamp_ms: u32,
    /// What it says.
    pub belief: PoseEstimate,
}

impl PoseEstimate {
    /// An estimate with its spread.
    #[must_use]
    pub const fn new(estimate: Estimate, spread: Uncertainty) -> Self {
        Self {
            x_m: estimate.x_m,
            y_m: estimate.y_m,
            heading: Heading::Radians(estimate.yaw_rad),
            spread: Some(spread),
        }
    }

    /// Nine numbers: x, y (m), yaw (rad), and of the covariance xx, xy, x-yaw, yy, y-yaw, yaw-yaw. In
    /// `f32`, as micro-ROS messages and CAN frames carry them: a coordinate of 100 m is then told to 8 um.
    #[must_use]
    pub fn compact(numbers: [f32; 9]) -> Self {
        let [x_m, y_m, yaw_rad, xx, xy, xt, yy, yt, tt] = numbers.map(f64::from);
        let estimate = Estimate { x_m, y_m, yaw_rad };
        let covariance = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]];
        Self::new(estimate, Uncertainty::Gaussian(covariance))
    }

    /// Variances alone: x, y (m^2), yaw (rad^2), with nothing between them. Where the terms between them
    /// are not zero but unknown, the source's [`crate::set::CrossTerms`] must say so.
    #[must_use]
    pub const fn diagonal(estimate: Estimate, [xx, yy, tt]: [f64; 3]) -> Self {
        let covariance = [[xx, 0.0, 0.0], [0.0, yy, 0.0], [0.0, 0.0, tt]];
        Self::new(estimate, Uncertainty::Gaussian(covariance))
    }

    /// The pose as integers.
    ///
    /// # Errors
    /// The [`InputError`] of an estimate or an orientation.
    pub fn mean(&self) -> Result<Pose, InputError> {
        place(self.x_m, self.y_m, || self.heading.angle())
    }

    /// The pose-set of the belief at a squared radius, as far as its source is trusted. The heading of a
    /// quaternion is within 0.5 unit and 2^-8 of 2^-32 turn, which the error budgets of
    /// [`crate::contain`] hold.
    ///
    /// # Errors
    /// [`InputError`]: the estimate's first, then the spread's.
    pub fn pose_set(
        &self,
        radius_squared: RadiusSquared,
        trust: Trust,
    ) -> Result<PoseSet, InputError> {
        let mean = self.mean()?;
        let spread = self.spread.ok_or(InputError::CovarianceUnknown)?;
        PoseSet::trusted(mean, spread, radius_squared, trust)
    }
}

impl From<(nalgebra::Isometry2<f64>, nalgebra::Matrix3<f64>)> for PoseEstimate {
    /// A planar pose and its covariance of (x, y, yaw).
    fn from((pose, covariance): (nalgebra::Isometry2<f64>, nalgebra::Matrix3<f64>)) -> Self {
        // Columns are rows of a symmetric matrix, and an asymmetric one is refused either way.
        Self::new(pose.into(), Uncertainty::Gaussian(covariance.into()))
    }
}

impl From<(nalgebra::Isometry3<f64>, nalgebra::Matrix6<f64>)> for PoseEstimate {
    /// A pose in space and its covariance of (x, y, z, roll, pitch, yaw), fixed axes: what ROS sends.
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
