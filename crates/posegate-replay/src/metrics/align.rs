//! Aligns an estimated trajectory with its reference.

use super::Matched;
use crate::tum::Stamped;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// The alignment of an estimate before it is compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Align {
    /// No alignment.
    #[default]
    None,
    /// Rotated and shifted so that the squared distances of the positions are least (Umeyama 1991).
    Se3,
    /// Also scaled.
    Sim3,
    /// Moved so that the first poses agree.
    Origin,
}

/// The reason why an estimate cannot be aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AlignError {
    /// All positions of one trajectory lie on a line, so any rotation about that line fits equally well.
    #[error("the positions lie on a line or in a point, so that no rotation is the best one")]
    Degenerate,
}

/// Returns the same pairs with the estimate aligned. A scale changes only positions.
///
/// # Errors
/// [`AlignError`].
pub fn aligned(matched: &Matched, align: Align) -> Result<Matched, AlignError> {
    let (rotation, shift, scale) = match align {
        Align::None => return Ok(matched.clone()),
        Align::Se3 | Align::Sim3 => umeyama(matched, align == Align::Sim3)?,
        Align::Origin => {
            let first = matched.reference.first().zip(matched.estimate.first());
            let (reference, estimate) = first.ok_or(AlignError::Degenerate)?;
            let rotation = reference.rotation * estimate.rotation.inverse();
            let shift = reference.position - rotation * estimate.position;
            (rotation, shift, 1.0)
        }
    };
    let moved = matched.estimate.iter().map(|pose| Stamped {
        t_s: pose.t_s,
        position: rotation * (scale * pose.position) + shift,
        rotation: rotation * pose.rotation,
    });
    Ok(Matched {
        reference: matched.reference.clone(),
        estimate: moved.collect(),
    })
}

/// Umeyama, "Least-squares estimation of transformation parameters between two point patterns", 1991: Eqs. 38 to 43.
fn umeyama(
    matched: &Matched,
    scaled: bool,
) -> Result<(UnitQuaternion<f64>, Vector3<f64>, f64), AlignError> {
    let count = matched.estimate.len().max(1) as f64;
    let mean = |poses: &[Stamped]| {
        let positions = poses.iter().map(|pose| pose.position);
        positions.sum::<Vector3<f64>>() / count
    };
    let (from, to) = (mean(&matched.estimate), mean(&matched.reference));
    let mut covariance = Matrix3::zeros();
    let mut variance = 0.0;
    for (estimate, reference) in matched.estimate.iter().zip(&matched.reference) {
        let (a, b) = (estimate.position - from, reference.position - to);
        covariance += b * a.transpose() / count;
        variance += a.norm_squared() / count;
    }
    let parts = covariance.svd(true, true);
    let (Some(u), Some(vt)) = (parts.u, parts.v_t) else {
        return Err(AlignError::Degenerate);
    };
    let values = parts.singular_values;
    // Two of three singular values must be above 0; the third direction follows from the other two.
    if !(values[1] > f64::EPSILON * values[0].max(f64::MIN_POSITIVE)) {
        return Err(AlignError::Degenerate);
    }
    let mirrored = u.determinant() * vt.determinant() < 0.0;
    let sign = Vector3::new(1.0, 1.0, if mirrored { -1.0 } else { 1.0 });
    let turn = u * Matrix3::from_diagonal(&sign) * vt;
    let scale = if scaled {
        values.dot(&sign) / variance
    } else {
        1.0
    };
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    Ok((rotation, to - rotation * (scale * from), scale))
}
