//! ROS: `geometry_msgs/PoseWithCovariance`.
//!
//! ```
//! use posegate::report::PoseEstimate;
//! use posegate::report::ros::PoseWithCovariance;
//!
//! // What AMCL publishes: x and y to 5 cm, yaw to 0.03 rad.
//! let mut covariance = [0.0; 36];
//! (covariance[0], covariance[7], covariance[35]) = (0.0025, 0.0025, 0.0009);
//! let message = PoseWithCovariance {
//!     position: [1.2, -0.4, 0.0],
//!     orientation: [0.0, 0.0, 0.0, 1.0],
//!     covariance,
//! };
//! let belief = PoseEstimate::from(&message);
//! assert_eq!((belief.x_m, belief.y_m), (1.2, -0.4));
//! assert_eq!(belief.mean().expect("a rotation").yaw.signed(), 0);
//! ```

use super::{Heading, PoseEstimate};
use crate::set::Uncertainty;

/// `geometry_msgs/PoseWithCovariance`, in the layout of `rosidl` in C.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct PoseWithCovariance {
    /// `pose.position`: x, y, z, metres. z is ignored.
    pub position: [f64; 3],
    /// `pose.orientation`: x, y, z, w.
    pub orientation: [f64; 4],
    /// 6 x 6 by rows over x, y, z and rotations about the fixed axes x, y, z: m^2, m rad, rad^2.
    pub covariance: [f64; 36],
}

/// The covariance is in the axes of the header's frame. Only the marginal of (x, y, yaw) is used: entries 0, 1, 5, 7, 11, 35 and their
/// mirrors 6, 30, 31. Filters on the floor leave the rest zero.
impl From<&PoseWithCovariance> for PoseEstimate {
    fn from(message: &PoseWithCovariance) -> Self {
        let [x_m, y_m, _] = message.position;
        let [
            xx,
            xy,
            _,
            _,
            _,
            xt, //
            yx,
            yy,
            _,
            _,
            _,
            yt, //
            _,
            _,
            _,
            _,
            _,
            _, //
            _,
            _,
            _,
            _,
            _,
            _, //
            _,
            _,
            _,
            _,
            _,
            _, //
            tx,
            ty,
            _,
            _,
            _,
            tt,
        ] = message.covariance;
        Self {
            x_m,
            y_m,
            heading: Heading::Quaternion(message.orientation),
            spread: Some(Uncertainty::Gaussian([
                [xx, xy, xt],
                [yx, yy, yt],
                [tx, ty, tt],
            ])),
        }
    }
}
