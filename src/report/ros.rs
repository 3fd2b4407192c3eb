//! ROS: `geometry_msgs/PoseWithCovariance`.

use super::{Heading, PoseEstimate};
use crate::set::Uncertainty;

/// `geometry_msgs/PoseWithCovariance`, field by field.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PoseWithCovariance {
    /// `pose.position`: x, y, z, metres. z is ignored.
    pub position: [f64; 3],
    /// `pose.orientation`: x, y, z, w.
    pub orientation: [f64; 4],
    /// 6 x 6 by rows over x, y, z and rotations about the fixed axes x, y, z, in the axes of the
    /// header's frame. Only the marginal of (x, y, yaw) is used: entries 0, 1, 5, 7, 11, 35 and their
    /// mirrors 6, 30, 31. Filters on the floor leave the rest zero.
    pub covariance: [f64; 36],
}

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
