//! Errors of poses and of relative poses.

use super::{Matched, Pairs, Statistics};
use crate::tum::Stamped;
use nalgebra::{UnitQuaternion, Vector3};

/// Errors by component, one entry for every pose or pair.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Errors {
    /// Errors of the position, metres.
    pub translation: Vec<f64>,
    /// Angles of the rotation errors, radians, 0 to pi.
    pub rotation: Vec<f64>,
    /// The Frobenius norm of the error's 4x4 matrix minus the identity.
    pub full: Vec<f64>,
}

impl Errors {
    /// Returns statistics of each component by name, in `evo`'s words: `translation` (m), `rotation` (rad),
    /// `rotation_deg`, `full`; `None` if there are no errors.
    #[must_use]
    pub fn statistics(&self) -> Option<[(&'static str, Statistics); 4]> {
        let degrees: Vec<f64> = self
            .rotation
            .iter()
            .map(|angle| angle.to_degrees())
            .collect();
        Some([
            ("translation", Statistics::of(&self.translation)?),
            ("rotation", Statistics::of(&self.rotation)?),
            ("rotation_deg", Statistics::of(&degrees)?),
            ("full", Statistics::of(&self.full)?),
        ])
    }

    fn push(&mut self, translation: f64, rotation: &UnitQuaternion<f64>) {
        let half_sine = rotation.imag().norm();
        self.translation.push(translation);
        let angle = 2.0 * libm::atan2(half_sine, rotation.w.abs());
        self.rotation.push(angle);
        // |R - 1|^2 = 8 sin^2(angle / 2).
        let turned = libm::sqrt(8.0) * half_sine;
        self.full.push(libm::hypot(translation, turned));
    }
}

/// Returns the absolute pose errors: of `E = estimate^-1 reference`, for every pose.
#[must_use]
pub fn absolute(matched: &Matched) -> Errors {
    let mut errors = Errors::default();
    for (reference, estimate) in matched.reference.iter().zip(&matched.estimate) {
        let turn = estimate.rotation.inverse() * reference.rotation;
        errors.push((reference.position - estimate.position).norm(), &turn);
    }
    errors
}

/// Returns the relative pose errors: of `E = (R_i^-1 R_j)^-1 (P_i^-1 P_j)`, with the reference R and the estimate
/// P, for every pair (i, j).
#[must_use]
pub fn relative(matched: &Matched, pairs: Pairs) -> Errors {
    let motion = |from: &Stamped, to: &Stamped| -> (Vector3<f64>, UnitQuaternion<f64>) {
        let back = from.rotation.inverse();
        (back * (to.position - from.position), back * to.rotation)
    };
    let mut errors = Errors::default();
    for (i, j) in pairs.of(&matched.estimate) {
        let (moved, turned) = motion(&matched.reference[i], &matched.reference[j]);
        let (own, own_turned) = motion(&matched.estimate[i], &matched.estimate[j]);
        errors.push((own - moved).norm(), &(turned.inverse() * own_turned));
    }
    errors
}
