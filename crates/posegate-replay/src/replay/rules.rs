//! Rules that are in use without a gate.
//!
//! | rule | permits if | limit |
//! |---|---|---|
//! | `distance` | the estimate is within a distance of the goal | 0.05 m: `docking_threshold` of Nav2's `SimpleChargingDock`, whose `isDocked` checks only this |
//! | `sigma` | the deviations of x, y and yaw are below a limit each | 0.05 m and 0.05 rad: no project ships such limits; these are Nav2's docking threshold and its `undock_angular_tolerance` |
//! | `ellipse` | the long radius of the 3-sigma error ellipse, and its radius to the robot's side, are below a limit each | 1.5 m and 0.3 m: `error_ellipse_size` and `error_ellipse_size_lateral_direction` of Autoware's `localization_error_monitor`, `scale` 3 |
//! | `ate` | the recording's root mean square position error is below a bound: then all is permitted, else nothing | 0.05 m |
//!
//! Limits are compared as in those projects: a covariance of zeros is below every limit, and neither frame nor age is
//! checked.

use super::Row;
use posegate::set::Uncertainty;
use posegate::shape::PoseDeg;

/// The limits of the rules.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// `distance`, metres.
    pub distance_m: f64,
    /// `sigma` of x and y, metres.
    pub sigma_m: f64,
    /// `sigma` of yaw, radians.
    pub sigma_yaw_rad: f64,
    /// Number of sigmas of the ellipse.
    pub ellipse_scale: f64,
    /// `ellipse`: the long radius, metres.
    pub ellipse_m: f64,
    /// `ellipse`: the radius to the robot's side, metres.
    pub ellipse_lateral_m: f64,
    /// `ate`, metres.
    pub ate_m: f64,
}

impl Thresholds {
    /// The limits that are in use today.
    pub const IN_USE: Self = Self {
        distance_m: 0.05,
        sigma_m: 0.05,
        sigma_yaw_rad: 0.05,
        ellipse_scale: 3.0,
        ellipse_m: 1.5,
        ellipse_lateral_m: 0.3,
        ate_m: 0.05,
    };
}

/// The rules for a goal.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    goal: PoseDeg,
}

impl Rules {
    /// Returns the rules for a goal.
    #[must_use]
    pub const fn new(goal: PoseDeg) -> Self {
        Self { goal }
    }

    /// Returns the results of the rules in [`RULES`](super::RULES) for an estimate with its recorded covariance. `None` if a rule
    /// needs a covariance and there is none. NaN permits nothing.
    #[must_use]
    pub fn of(&self, row: &Row) -> [Option<bool>; 3] {
        let limits = Thresholds::IN_USE;
        let [x, y, yaw] = row.pose;
        let distance = libm::hypot(x - self.goal.x, y - self.goal.y) < limits.distance_m;
        let Some(Uncertainty::Gaussian([[xx, xy, _], [_, yy, _], [_, _, tt]])) = row.recorded
        else {
            return [Some(distance), None, None];
        };
        let sigma = libm::sqrt(xx) < limits.sigma_m
            && libm::sqrt(yy) < limits.sigma_m
            && libm::sqrt(tt) < limits.sigma_yaw_rad;
        let (middle, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let long = limits.ellipse_scale * libm::sqrt(middle + libm::hypot(half, xy));
        let (sin, cos) = (libm::sin(yaw), libm::cos(yaw));
        // e' P e along the direction to the robot's side, e = (-sin, cos).
        let side = sin * sin * xx - 2.0 * sin * cos * xy + cos * cos * yy;
        let lateral = limits.ellipse_scale * libm::sqrt(side);
        let ellipse = long < limits.ellipse_m && lateral < limits.ellipse_lateral_m;
        [distance, sigma, ellipse].map(Some)
    }
}

#[cfg(test)]
mod tests;
