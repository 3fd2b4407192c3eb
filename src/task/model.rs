//! The change of the pose knowledge by driving: the models [`BoundedDriveModel`] and [`Odometry`].
//!
//! Uses floats, on a host and when a controller starts: no decision is made here.
#![allow(clippy::arithmetic_side_effects, clippy::float_arithmetic)]

use nalgebra::{Matrix3, Vector3};

use super::{Ends, Leg, Motion};
use crate::set::Estimate;

/// The name of a gain that is negative, NaN or infinite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModelError(pub &'static str);

impl core::fmt::Display for ModelError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "the gain {} is negative, NaN or infinite", self.0)
    }
}

impl core::error::Error for ModelError {}

fn gain(value: f64, name: &'static str) -> Result<(), ModelError> {
    if (0.0..f64::INFINITY).contains(&value) {
        Ok(())
    } else {
        Err(ModelError(name))
    }
}

/// Bounded navigation: over a path of length L and turning A, `alpha' = alpha + k_turn A + k_drift L` and
/// `rho' = rho + k_slip L + 2 L sin(min(alpha', pi) / 2)`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BoundedDriveModel {
    /// Radians of heading error per radian turned.
    pub k_turn: f64,
    /// Radians of heading error per metre driven.
    pub k_drift: f64,
    /// Metres of position error per metre driven.
    pub k_slip: f64,
}

impl BoundedDriveModel {
    /// Checks that every gain is finite and at least 0.
    ///
    /// # Errors
    /// The name of the first gain that is negative, NaN or infinite.
    pub fn check(&self) -> Result<(), ModelError> {
        gain(self.k_turn, "k_turn")?;
        gain(self.k_drift, "k_drift")?;
        gain(self.k_slip, "k_slip")
    }

    /// Returns the bounded set after a path, from and to `(metres, radians)`.
    #[must_use]
    pub fn grow(&self, length_m: f64, turning_rad: f64, [rho, alpha]: [f64; 2]) -> [f64; 2] {
        let alpha = alpha + self.k_turn * turning_rad + self.k_drift * length_m;
        let half = libm::fmin(alpha, core::f64::consts::PI) / 2.0;
        [
            rho + self.k_slip * length_m + 2.0 * length_m * libm::sin(half),
            alpha,
        ]
    }
}

/// Gaussian navigation: the odometry motion model of Probabilistic Robotics, linearised,
/// `P' = G P G' + V M V'` leg by leg.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Odometry {
    /// Variance of a turn, square radians per square radian turned.
    pub a1: f64,
    /// Variance of a turn, square radians per square metre driven.
    pub a2: f64,
    /// Variance of the length driven, square metres per square metre driven.
    pub a3: f64,
    /// Variance of the length driven, square metres per square radian turned.
    pub a4: f64,
}

impl Odometry {
    /// Checks that every gain is finite and at least 0.
    ///
    /// # Errors
    /// The name of the first gain that is negative, NaN or infinite.
    pub fn check(&self) -> Result<(), ModelError> {
        gain(self.a1, "a1")?;
        gain(self.a2, "a2")?;
        gain(self.a3, "a3")?;
        gain(self.a4, "a4")
    }

    /// Returns the covariance after a path that is driven exactly as given: m^2, m rad, rad^2, world axes.
    #[must_use]
    pub fn grow(&self, covariance: Matrix3<f64>, from: &Estimate, legs: &[Leg]) -> Matrix3<f64> {
        let noise = self.noise(from, legs, &Ends::default());
        let mut step = [0.0; 2];
        let mut at = *from;
        for leg in legs {
            let (motion, end) = leg.motion(&at);
            step = [step[0] + motion.step[0], step[1] + motion.step[1]];
            at = end;
        }
        let carry = carry(step);
        carry * covariance * carry.transpose() + noise
    }

    /// Returns the covariance of (x, y, yaw) that a path adds: `V M V'` of its legs, carried to the path's end. World
    /// axes; m^2, m rad, rad^2. If the path's ends may be off, returns a matrix that dominates the added covariance of
    /// every such path.
    ///
    /// Let `c = (J v, 1)` be the column of the first turn and d with `|d| <= away` be added to v. Then
    /// `(c + Jd)(c + Jd)' <= (1 + p) c c' + (1 + 1/p) away^2 I_xy` for each p above 0. The same bound holds for the
    /// noise of earlier legs, which the last leg carries.
    #[must_use]
    pub fn noise(&self, from: &Estimate, legs: &[Leg], ends: &Ends) -> Matrix3<f64> {
        let mut noise: Matrix3<f64> = Matrix3::zeros();
        let mut at = *from;
        let last = legs.len().saturating_sub(1);
        for (number, leg) in legs.iter().enumerate() {
            let (motion, end) = leg.motion(&at);
            let own = ends.of_leg(number == 0, number == last);
            let carry = carry(motion.step);
            let mut carried = carry * noise * carry.transpose();
            let ([off, _], heading) = (own.end, noise.m33);
            if off > 0.0 && heading > 0.0 {
                let chord = motion.chord();
                let p = off / libm::fmax(chord, off);
                carried = carried * (1.0 + p) + flat() * ((1.0 + 1.0 / p) * off * off * heading);
            }
            noise = carried + self.of_leg(&motion, &own);
            at = end;
        }
        noise
    }

    fn of_leg(&self, motion: &Motion, ends: &Ends) -> Matrix3<f64> {
        let [rot1, rot2] = motion.largest_turns(ends);
        let away = ends.away();
        let way = motion.length + away;
        let (turn1, turn2, way2) = (rot1 * rot1, rot2 * rot2, way * way);
        let first = self.a1 * turn1 + self.a2 * way2;
        let along = self.a3 * way2 + self.a4 * (turn1 + turn2);
        let last = self.a1 * turn2 + self.a2 * way2;
        let [dx, dy] = motion.step;
        let chord = motion.chord();
        let swing = Vector3::new(-dy, dx, 1.0);
        let heading = Vector3::new(0.0, 0.0, 1.0);
        let turned = heading * heading.transpose() * last;
        if away > 0.0 {
            let p = away / libm::fmax(chord, away);
            let swung =
                swing * swing.transpose() * (1.0 + p) + flat() * ((1.0 + 1.0 / p) * away * away);
            return swung * first + flat() * along + turned;
        }
        let ahead = Vector3::new(motion.ahead[0], motion.ahead[1], 0.0);
        swing * swing.transpose() * first + ahead * ahead.transpose() * along + turned
    }
}

/// Returns the identity restricted to x and y.
fn flat() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0))
}

/// Returns `G`, which maps an error before a motion to the error after it.
fn carry([dx, dy]: [f64; 2]) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, -dy, 0.0, 1.0, dx, 0.0, 0.0, 1.0)
}
