//! Rules that are in use without a gate.
//!
//! | rule | permits if | default |
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

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            distance_m: 0.05,
            sigma_m: 0.05,
            sigma_yaw_rad: 0.05,
            ellipse_scale: 3.0,
            ellipse_m: 1.5,
            ellipse_lateral_m: 0.3,
            ate_m: 0.05,
        }
    }
}

/// The rules for a goal.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    thresholds: Thresholds,
    goal: PoseDeg,
}

impl Rules {
    /// Returns the rules with these limits.
    #[must_use]
    pub const fn new(thresholds: Thresholds, goal: PoseDeg) -> Self {
        Self { thresholds, goal }
    }

    /// Returns the results of the rules in [`RULES`](super::RULES) for an estimate with its recorded covariance. `None` if a rule
    /// needs a covariance and there is none. NaN permits nothing.
    #[must_use]
    pub fn of(&self, row: &Row) -> [Option<bool>; 3] {
        let limits = &self.thresholds;
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
mod tests {
    use super::*;
    use posegate::gate::{Reason, State, Verdict};

    fn row(pose: [f64; 3], covariance: [[f64; 3]; 3]) -> Row {
        Row {
            index: 0,
            source: 0,
            t_s: 0.0,
            logged_s: None,
            pose,
            spread: None,
            recorded: Some(Uncertainty::Gaussian(covariance)),
            age: None,
            in_world: true,
            possible: true,
            verdict: Verdict::deny(Reason::Stale),
            examined: true,
            permitted: false,
            state: State::Inhibited(Reason::Silent),
            step: Err(Reason::Silent),
            truth: None,
            since_fix_ms: None,
            against: None,
            rules: [None; 3],
        }
    }

    fn diagonal([xx, yy, tt]: [f64; 3]) -> [[f64; 3]; 3] {
        [[xx, 0.0, 0.0], [0.0, yy, 0.0], [0.0, 0.0, tt]]
    }

    #[test]
    fn each_rule_checks_only_its_own_limits() {
        let goal = PoseDeg {
            x: 1.0,
            y: 2.0,
            yaw_deg: 0.0,
        };
        let rules = Rules::new(Thresholds::default(), goal);
        let small = diagonal([1e-4; 3]);
        assert_eq!(
            rules.of(&row([1.03, 2.03, 3.0], small)),
            [true; 3].map(Some)
        );
        assert_eq!(
            rules.of(&row([1.04, 2.04, 0.0], small)),
            [false, true, true].map(Some)
        );
        // 0.04 m and 0.09 m: beyond one limit, and 0.27 m to the side.
        let wide = diagonal([16e-4, 81e-4, 1e-4]);
        assert_eq!(
            rules.of(&row([1.0, 2.0, 0.0], wide)),
            [true, false, true].map(Some)
        );
        // To the side 3 * 0.11 m.
        let side = diagonal([16e-4, 121e-4, 1e-4]);
        assert_eq!(
            rules.of(&row([1.0, 2.0, 0.0], side)),
            [true, false, false].map(Some)
        );
        // The same ellipse ahead of the robot.
        let quarter = core::f64::consts::FRAC_PI_2;
        assert_eq!(
            rules.of(&row([1.0, 2.0, quarter], side)),
            [true, false, true].map(Some)
        );
        // Long: 3 * sqrt(0.25) m along the diagonal, in the direction of the robot's heading.
        let long = [[0.13, 0.125, 0.0], [0.125, 0.13, 0.0], [0.0, 0.0, 1e-4]];
        let eighth = core::f64::consts::FRAC_PI_4;
        assert_eq!(
            rules.of(&row([1.0, 2.0, eighth], long)),
            [true, false, false].map(Some)
        );
        let yaw = diagonal([1e-4, 1e-4, 26e-4]);
        assert_eq!(
            rules.of(&row([1.0, 2.0, 0.0], yaw)),
            [true, false, true].map(Some)
        );
    }

    #[test]
    fn zero_covariance_passes_and_nan_does_not() {
        let goal = PoseDeg {
            x: 0.0,
            y: 0.0,
            yaw_deg: 0.0,
        };
        let rules = Rules::new(Thresholds::default(), goal);
        assert_eq!(
            rules.of(&row([0.0; 3], diagonal([0.0; 3]))),
            [Some(true); 3]
        );
        let nan = diagonal([f64::NAN; 3]);
        assert_eq!(rules.of(&row([f64::NAN; 3], nan)), [Some(false); 3]);
        // The ellipse of a negative variance still has a long radius.
        assert_eq!(
            rules.of(&row([0.0; 3], diagonal([-1.0, 1e-4, 1e-4]))),
            [true, false, true].map(Some)
        );
        let mut bare = row([0.0; 3], nan);
        bare.recorded = None;
        assert_eq!(rules.of(&bare), [Some(true), None, None]);
    }
}
