//! Is the error model of a source still valid? A test of every accepted fix against its prediction.
//!
//! A camera that was knocked, or a tag that has moved, gives fixes with larger errors than their covariance claims. Such fixes differ from
//! their predictions by more than both covariances claim. The monitor tests the claim:
//!
//! - The square of the normalised innovation, `d^2 = r' S^-1 r`, has at most the chi-square distribution with 3 degrees of freedom if the
//!   claims are true. `r` is the difference of fix and prediction, `S` the sum of their covariances.
//! - Under the claim the factor `e = s^-3 exp(d^2 (1 - s^-2) / 2)` has a mean of at most 1: it is the likelihood ratio of errors that are
//!   `s` times as large. The monitor uses `s` of root 2 and of 2.
//! - The product of the factors, restarted whenever it falls below 1, exceeds a bound A after A fixes on average, or later (e-detectors:
//!   Shin, Ramdas and Rinaldo 2022, arXiv 2203.03532). Two products are watched, so each may reach 2 A.
//!
//! Assumed: given all fixes before it, each innovation has at most the distribution that it claims. The monitor searches for errors that repeat
//! from fix to fix, such as one wrong survey. Slow errors, such as those of a filter that shares its past with the prediction, belong
//! into the covariance ([`Innovation::of_dependent`]).
//!
//! Floating point is used, because nothing here can permit: a contradicted model only adds a denial.

// Errors of floating point are far below the margin of a bet.
#![allow(clippy::float_arithmetic)]

use crate::report::PoseEstimate;
use crate::set::{Growth, InputError, Uncertainty};
use core::f64::consts::{LOG2_E, TAU};

/// The bets: the square of how much larger the errors are than claimed, and its binary logarithm.
const BETS: [(f64, f64); 2] = [(2.0, 1.0), (4.0, 2.0)];

/// The difference of a fix and its prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Innovation {
    /// The fix minus the prediction, less its slip: x and y in metres in world axes, yaw in radians within half a turn.
    pub difference: [f64; 3],
    /// The claimed covariance of `difference`, by rows, world axes: m^2, m rad, rad^2. It is the sum of the covariances
    /// of fix and prediction, or twice that if their errors may be dependent.
    pub covariance: [[f64; 3]; 3],
}

impl Innovation {
    /// Returns the difference of a fix from a prediction for the same time, whose errors are independent: a fix from a tag, and a
    /// pose that odometry carried from an earlier tag. The slip of the prediction (`beside`) is subtracted from the difference.
    ///
    /// # Errors
    /// [`InputError`] if fix or prediction is not a valid estimate, or is a bounded set, which states no distribution
    /// ([`InputError::CovarianceUnknown`]).
    pub fn of_independent(
        fix: &PoseEstimate,
        prediction: &PoseEstimate,
        beside: Growth,
    ) -> Result<Self, InputError> {
        Self::of(fix, prediction, beside, 1.0)
    }

    /// As [`Innovation::of_independent`], for errors that may depend on each other in any way: twice the sum of both covariances bounds that
    /// of the difference. Detects a wrong model later.
    ///
    /// # Errors
    /// As for [`Innovation::of_independent`].
    pub fn of_dependent(
        fix: &PoseEstimate,
        prediction: &PoseEstimate,
        beside: Growth,
    ) -> Result<Self, InputError> {
        Self::of(fix, prediction, beside, 2.0)
    }

    fn of(
        fix: &PoseEstimate,
        prediction: &PoseEstimate,
        beside: Growth,
        factor: f64,
    ) -> Result<Self, InputError> {
        let [from, to] = [prediction.mean()?, fix.mean()?];
        let metres = |a: i32, b: i32| (f64::from(a) - f64::from(b)) * 1e-6;
        let x = metres(to.x_um, from.x_um);
        let y = metres(to.y_um, from.y_um);
        let yaw = f64::from(to.yaw.minus(from.yaw).signed()) * (TAU / 4_294_967_296.0);
        // On each axis, so at least as much as the disc of the slip explains.
        let less = |value: f64, by: f64| value - value.max(-by).min(by);
        let slipped = f64::from(beside.translation_um()) * 1e-6;
        let turned = f64::from(beside.yaw_q24()) * (TAU / 16_777_216.0);
        let [a, b] = [covariance(fix)?, covariance(prediction)?];
        let mut sum = a;
        for (row, other) in sum.iter_mut().zip(b) {
            for (entry, more) in row.iter_mut().zip(other) {
                *entry = factor * (*entry + more);
            }
        }
        Ok(Self {
            difference: [less(x, slipped), less(y, slipped), less(yaw, turned)],
            covariance: sum,
        })
    }

    /// Returns the square of the normalised innovation: the difference in units of its claimed deviation.
    ///
    /// # Errors
    /// [`InputError`] if a number is not finite, or the covariance is not positive definite.
    pub fn normalised_squared(&self) -> Result<f64, InputError> {
        let [[xx, xy, xt], [_, yy, yt], [_, _, tt]] = self.covariance;
        let [x, y, yaw] = self.difference;
        if ![x, y, yaw].iter().all(|value| value.is_finite()) {
            return Err(InputError::EstimateNotFinite);
        }
        if ![xx, xy, xt, yy, yt, tt]
            .iter()
            .all(|value| value.is_finite())
        {
            return Err(InputError::CovarianceNotFinite);
        }
        // By elimination: each pivot must be above zero.
        let refused = InputError::CovarianceNotPositiveDefinite;
        let pivot = |value: f64| if value > 0.0 { Ok(value) } else { Err(refused) };
        let first = pivot(xx)?;
        let (to_y, to_yaw) = (xy / first, xt / first);
        let second = pivot(yy - to_y * xy)?;
        let rest = yt - to_y * xt;
        let between = rest / second;
        let third = pivot(tt - to_yaw * xt - between * rest)?;
        let own_y = y - to_y * x;
        let own_yaw = yaw - to_yaw * x - between * own_y;
        Ok(x * x / first + own_y * own_y / second + own_yaw * own_yaw / third)
    }
}

fn covariance(estimate: &PoseEstimate) -> Result<[[f64; 3]; 3], InputError> {
    match estimate.spread {
        Some(Uncertainty::Gaussian(covariance)) => Ok(covariance),
        _ => Err(InputError::CovarianceUnknown),
    }
}

/// How well a model agrees with the fixes so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum ModelStanding {
    /// No sign of a contradiction.
    #[default]
    Holds,
    /// The logarithm of the evidence has reached half of the limit for a contradiction: check camera and tags soon.
    InDoubt,
    /// The fixes contradict the model. Deny with [`super::Reason::ModelContradicted`] until a manual check.
    Contradicted,
}

/// Tests the errors that a source claims, fix by fix. 32 bytes; `./ci.sh budgets` prints the instructions of a fix.
///
/// ```
/// use posegate::gate::{Gate, Innovation, ModelStanding, Monitor, Reason, Step};
/// use posegate::report::Report;
/// use posegate::set::Growth;
///
/// /// Steps a gate on a fix, after the prediction for its time was compared with it.
/// fn step(gate: &mut Gate<'_>, monitor: &mut Monitor, now_ms: u32, fix: &Report, predicted: &Report) -> Step {
///     if let Ok(innovation) = Innovation::of_independent(&fix.belief, &predicted.belief, Growth::NONE) {
///         let _ = monitor.fix(&innovation);
///     }
///     match monitor.standing() {
///         ModelStanding::Contradicted => gate.inhibit(now_ms, Reason::ModelContradicted),
///         _ => gate.step(now_ms, fix),
///     }
/// }
/// ```
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Monitor {
    /// The binary logarithm of twice the fixes between false alarms, rounded up.
    most: f64,
    /// The binary logarithm of each product.
    doubts: [f64; 2],
    is_contradicted: bool,
}

impl Monitor {
    /// Returns a monitor. While the model is valid, a false alarm comes on average once in `fixes_between_false_alarms` fixes, or less
    /// often. `None` for fewer than 100. At 10 fixes per second, a million means once in 28 hours, 100 million once in four months.
    #[must_use]
    pub fn new(fixes_between_false_alarms: u32) -> Option<Self> {
        (fixes_between_false_alarms >= 100).then(|| Self {
            // Rounded up: alarms are rarer.
            most: f64::from(
                33_u32.saturating_sub(fixes_between_false_alarms.saturating_sub(1).leading_zeros()),
            ),
            doubts: [0.0; 2],
            is_contradicted: false,
        })
    }

    /// Takes an accepted fix, and returns the standing of the model with it. A contradiction stays until [`Monitor::reset`].
    ///
    /// # Errors
    /// [`InputError`] of an innovation that is not valid: it is ignored.
    pub fn fix(&mut self, innovation: &Innovation) -> Result<ModelStanding, InputError> {
        let squared = innovation.normalised_squared()?;
        for (doubt, scale) in self.doubts.iter_mut().zip(BETS) {
            *doubt = doubt.max(0.0) + bet(squared, scale);
            // An innovation beyond the range of numbers contradicts as well.
            self.is_contradicted |= !(*doubt < self.most);
        }
        Ok(self.standing())
    }

    /// Returns the standing of the model with the fixes so far.
    pub fn standing(&self) -> ModelStanding {
        if self.is_contradicted {
            return ModelStanding::Contradicted;
        }
        let most = self.doubts.into_iter().fold(0.0, f64::max);
        if most * 2.0 < self.most {
            ModelStanding::Holds
        } else {
            ModelStanding::InDoubt
        }
    }

    /// Discards all fixes. A manual action: call it after the cause was removed.
    pub fn reset(&mut self) {
        self.doubts = [0.0; 2];
        self.is_contradicted = false;
    }
}

/// Returns the binary logarithm of the factor of a bet.
fn bet(normalised_squared: f64, (scale_squared, logarithm): (f64, f64)) -> f64 {
    normalised_squared * (1.0 - 1.0 / scale_squared) * (0.5 * LOG2_E) - 1.5 * logarithm
}

#[cfg(test)]
mod tests;
