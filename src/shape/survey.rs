//! The error that the tolerances of tag and camera add to an observation.
//!
//! The robot computes its pose as if tag and camera had the poses of the site file: `T_w_t (T_r_c T_c_t)^-1`, of which
//! x, y and yaw are used. Let the tag be off by tau and turned by delta about the vertical through its true centre p.
//! Let the camera be off by sigma and turned by alpha about any axis. Let x be the robot's true position, c the
//! camera's position on the robot, and e the detector's own error of the position. With the turn R by -delta and the
//! turn Q by alpha, the error of the position is
//!
//! ```text
//! R (e + m) + (R - I)(x - p) - tau, |m| <= |sigma + (I - Q) c|
//! ```
//!
//! so at most `|e| + |tau| + |sigma| + 2 sin(alpha / 2) |c| + 2 sin(delta / 2) |x - p|`, with `|x - p|` along the
//! floor. The bounds add up, and some positions of tag and camera within the tolerances reach the sum.
//!
//! Errors are measured along the floor. A detector's pose of the robot may lean by beta and be off in height by up to
//! `sin(beta) l`. Here l is the distance in space from the tag to the robot's reference point. A camera that is turned
//! by alpha relative to the camera with which the errors were measured projects `sin(alpha) sin(beta) l` of that height
//! onto the floor, and turns the yaw by up to `asin(sin(alpha) / cos(beta))`. Both are included for a beta of
//! [`LARGEST_LEAN_DEG`]. The yaw is off by at most the detector's own error, delta, and this angle.

use super::{Visibility, farthest_holding};
use core::f64::consts::{FRAC_PI_2, PI};

/// Largest lean of a detector's pose of the robot that the bounds allow for, degrees.
pub const LARGEST_LEAN_DEG: f64 = 20.0;

/// Factor by which a value is rounded up.
const UP: f64 = 1.0 + 1e-12;
/// Number of bisections of a distance.
const HALVINGS: u32 = 48;

impl Visibility {
    /// Returns the largest error that the tolerances of tag and camera add to an observation while the true distance
    /// between camera and tag is at most `d` metres: metres, degrees. Rounded up; does not decrease with `d`; zeros
    /// without a tolerance.
    #[must_use]
    pub fn tolerance_error(&self, d: f64) -> [f64; 2] {
        let (tag, mount) = (self.tag_tolerance, self.mount_tolerance);
        if self.is_exact() {
            return [0.0, 0.0];
        }
        let camera = libm::hypot(libm::hypot(self.mount.x, self.mount.y), self.mount.z);
        let lever = self.farthest_lever(d);
        let lean = LARGEST_LEAN_DEG.to_radians();
        let height = libm::hypot(lever, self.tag.pose.z.abs() + tag.translation) * libm::sin(lean);
        let sine = libm::sin(mount.turn_deg.min(90.0).to_radians());
        let turned = libm::asin((sine / libm::cos(lean)).min(1.0)).to_degrees();
        [
            (tag.reach(lever) + mount.reach(camera) + sine * height) * UP,
            (tag.turn_deg + turned.max(mount.turn_deg)) * UP,
        ]
    }

    /// Returns `true` if neither tag nor camera has a tolerance.
    pub fn is_exact(&self) -> bool {
        self.tag_tolerance.is_none() && self.mount_tolerance.is_none()
    }

    /// Returns the largest distance along the floor between the tag and the robot's reference point, metres. The camera
    /// is at most `d` from the tag and sees it within `phi_max_deg` of its axis.
    fn farthest_lever(&self, d: f64) -> f64 {
        let (tag, mount) = (self.tag_tolerance, self.mount_tolerance);
        let off = tag.translation + mount.translation;
        let rise = ((self.tag.pose.z - self.mount.z).abs() - off).max(0.0);
        let level = libm::sqrt(((d - rise) * (d + rise)).max(0.0));
        let (pitch, yaw) = (
            self.mount.pitch_deg.to_radians(),
            self.mount.yaw_deg.to_radians(),
        );
        // Direction of the optical axis along the floor, and the largest angle between it and the ray to the tag.
        let axis = [
            libm::cos(yaw) * libm::cos(pitch),
            libm::sin(yaw) * libm::cos(pitch),
        ];
        let cone = (self.phi_max_deg + mount.turn_deg).to_radians();
        let beside = if cone < FRAC_PI_2 {
            let sine = libm::sin(cone) / libm::hypot(axis[0], axis[1]);
            if sine < 1.0 { libm::asin(sine) } else { PI }
        } else {
            PI
        };
        let [x, y] = [self.mount.x, self.mount.y];
        let between = libm::atan2((x * axis[1] - y * axis[0]).abs(), x * axis[0] + y * axis[1]);
        let angle = (between - beside - 1e-9).max(0.0);
        let arm = libm::hypot(x, y);
        // The distance to a point of a line segment is largest at one of its ends.
        let far = libm::hypot(level + arm * libm::cos(angle), arm * libm::sin(angle));
        (arm.max(far) + mount.translation) * UP
    }

    /// Returns the largest distance up to `most` at which a condition holds; 0 if there is none. If the condition holds
    /// at a distance, it must hold at every smaller one.
    pub(super) fn farthest_where(most: f64, holds: impl Fn(f64) -> bool) -> f64 {
        if holds(most) {
            return most;
        }
        if !holds(0.0) {
            return 0.0;
        }
        farthest_holding(0.0, most, HALVINGS, holds)
    }

    /// Reduces `d_max` until the error that the tolerances add is within [`Self::error_room`]. If no distance satisfies
    /// this, `d_max` becomes 0, at which no tag is seen.
    pub fn keep_error_room(&mut self) {
        let Some([translation, yaw_deg]) = self.error_room else {
            return;
        };
        let view = *self;
        self.d_max = Self::farthest_where(view.d_max, |d| {
            let [metres, degrees] = view.tolerance_error(d);
            metres <= translation && degrees <= yaw_deg
        });
    }
}
