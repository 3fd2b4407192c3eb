//! MAVLink: `ODOMETRY` and `VISION_POSITION_ESTIMATE`, whose covariance is 21 floats.
//!
//! ```
//! use posegate::report::mavlink::{Axes, VisionPositionEstimate};
//!
//! // z down: y, z and yaw change their signs.
//! let message = VisionPositionEstimate {
//!     position: [2.0, 1.0, -0.1],
//!     angles: [0.0, 0.0, 0.5],
//!     covariance: [f32::NAN; 21],
//! };
//! let belief = message.belief(Axes::Down);
//! assert_eq!((belief.x_m, belief.y_m), (2.0, -1.0));
//! // NaN in the first entry: the covariance is unknown, and a gate denies.
//! assert!(belief.spread.is_none());
//! ```

use super::{Heading, PoseEstimate};
use crate::set::Uncertainty;

/// The directions of a message's axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Axes {
    /// z up, yaw counter-clockwise: `MAV_FRAME_LOCAL_ENU`, `LOCAL_FLU`.
    Up,
    /// z down, yaw clockwise: `MAV_FRAME_LOCAL_NED`, `LOCAL_FRD`. y, z and yaw change their signs; x does
    /// not.
    Down,
}

/// MAVLink `VISION_POSITION_ESTIMATE` (102): the fields of the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct VisionPositionEstimate {
    /// x, y, z in the message's axes, metres.
    pub position: [f32; 3],
    /// Roll, pitch, yaw, radians.
    pub angles: [f32; 3],
    /// Upper triangle by rows over x, y, z, roll, pitch, yaw: m^2, m rad, rad^2. NaN in the first entry means unknown.
    pub covariance: [f32; 21],
}

/// MAVLink `ODOMETRY` (331): the fields of the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Odometry {
    /// x, y, z in the message's axes, metres.
    pub position: [f32; 3],
    /// The orientation: a quaternion w, x, y, z.
    pub q: [f32; 4],
    /// Upper triangle by rows over x, y, z, roll, pitch, yaw: m^2, m rad, rad^2. NaN in the first entry means unknown.
    pub pose_covariance: [f32; 21],
}

impl VisionPositionEstimate {
    /// Returns the pose estimate, in axes with z up.
    #[must_use]
    pub fn belief(&self, axes: Axes) -> PoseEstimate {
        let [roll, pitch, yaw] = self.angles.map(f64::from);
        let heading = Heading::RollPitchYaw([roll, pitch, turned(yaw, axes)]);
        belief(self.position, heading, &self.covariance, axes)
    }
}

impl Odometry {
    /// Returns the pose estimate, in axes with z up.
    #[must_use]
    pub fn belief(&self, axes: Axes) -> PoseEstimate {
        let [w, x, y, z] = self.q.map(f64::from);
        // Half a turn about x changes the signs of y and z.
        let heading = Heading::Quaternion([x, turned(y, axes), turned(z, axes), w]);
        belief(self.position, heading, &self.pose_covariance, axes)
    }
}

fn belief(
    [x, y, _]: [f32; 3],
    heading: Heading,
    covariance: &[f32; 21],
    axes: Axes,
) -> PoseEstimate {
    let [
        xx,
        xy,
        _,
        _,
        _,
        xt, //
        yy,
        _,
        _,
        _,
        yt, //
        _,
        _,
        _,
        _, //
        _,
        _,
        _, //
        _,
        _, //
        tt,
    ] = covariance.map(f64::from);
    // y and yaw both change their signs, so their common term does not.
    let (xy, xt) = (turned(xy, axes), turned(xt, axes));
    let known = !xx.is_nan();
    PoseEstimate {
        x_m: f64::from(x),
        y_m: turned(f64::from(y), axes),
        heading,
        spread: known.then_some(Uncertainty::Gaussian([
            [xx, xy, xt],
            [xy, yy, yt],
            [xt, yt, tt],
        ])),
    }
}

/// Returns a value with its sign changed if its axis points the other way.
const fn turned(value: f64, axes: Axes) -> f64 {
    match axes {
        Axes::Up => value,
        Axes::Down => f64::from_bits(value.to_bits() ^ 1 << 63),
    }
}
