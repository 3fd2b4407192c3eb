//! The effect of the tolerances of tags and camera on a fix.
//!
//! If a tag or the camera is off by theta, the least-squares pose is off by `(J'J)^-1 J' K theta`, K being the Jacobian
//! of the projection by theta (to first order, like the covariance). Each tolerance is a ball of theta: a translation
//! of the tag, its rotation about the vertical, a translation of the camera, its rotation about any axis. So each one
//! moves the pose within an ellipsoid. The sum of these ellipsoids and that of the noise lies in the ellipsoid
//! `(sum p) (sum Q / p)`, for all numbers p above 0 (Kurzhanski and Valyi, Ellipsoidal Calculus); p is the size of each
//! ellipsoid in the metric of the noise. Unlike a 6-DoF pose of one tag, a fit on the floor mistakes a leaning camera
//! for a nearer or farther tag, so a small angle may have a large effect.
//! one tag, a fit on the floor takes a camera that leans for a tag that is nearer or farther: a small angle may do much.

use super::{MountedCamera, STEP, TagObservation, View, dot, slopes};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

/// Returns the ellipsoids `{ e : e' Q^-1 e <= 1 }` of the possible pose errors, one for each tolerance above 0.
pub(super) fn shifts<'e>(
    view: &View<'e>,
    pose: &Vector3<f64>,
    eye: &MountedCamera,
    seen: &[TagObservation<'_>],
) -> Option<Vec<Matrix3<f64>>> {
    let jacobian = view.jacobian(pose)?;
    let information = Matrix3::from_fn(|r, c| dot(&jacobian[r], &jacobian[c]));
    let inverse = information.cholesky()?.inverse();
    let mut all = Vec::new();
    // Adds the ellipsoid of a ball with these axes. Each axis changes the view by a step.
    let mut add = |size: f64, axes: &[Vector3<f64>], moved: &dyn Fn(Vector3<f64>) -> View<'e>| {
        if !(size > 0.0) {
            return Some(());
        }
        let mut sum = Matrix3::zeros();
        for axis in axes {
            let ahead = moved(axis * STEP).residuals(pose)?;
            let behind = moved(axis * -STEP).residuals(pose)?;
            let column = slopes(&ahead, &behind)?;
            let off = inverse * Vector3::from_fn(|r, _| dot(&jacobian[r], &column)) * size;
            sum += off * off.transpose();
        }
        all.push(sum);
        Some(())
    };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    for (number, seen) in seen.iter().enumerate() {
        let by = seen.tolerance;
        let moved = |motion: Isometry3<f64>| {
            let mut moved = view.clone();
            for (corner, _) in moved.corners.iter_mut().skip(4 * number).take(4) {
                *corner = motion * *corner;
            }
            moved
        };
        let at = seen.tag.pose;
        let centre = Translation3::new(at.x, at.y, at.z);
        add(by.translation, &axes, &|way| {
            moved(Translation3::from(way).into())
        })?;
        add(by.turn_deg.to_radians(), &axes[2..], &|turn| {
            moved(centre * UnitQuaternion::from_scaled_axis(turn) * centre.inverse())
        })?;
    }
    let by = eye.mount_tolerance;
    add(by.translation, &axes, &|way| {
        let mut moved = view.clone();
        moved.mount.translation.vector += way;
        moved
    })?;
    add(by.turn_deg.to_radians(), &axes, &|turn| {
        let mut moved = view.clone();
        moved.mount.rotation = UnitQuaternion::from_scaled_axis(turn) * moved.mount.rotation;
        moved
    })?;
    Some(all)
}

/// Returns a covariance whose ellipsoid with this radius holds every sum of an error of the given covariance and of the
/// shifts; `None` if the given one is not positive definite.
pub(super) fn widened(
    covariance: Matrix3<f64>,
    radius_squared: f64,
    shifts: &[Matrix3<f64>],
) -> Option<Matrix3<f64>> {
    if shifts.is_empty() {
        return Some(covariance);
    }
    let inverse = covariance.cholesky()?.inverse();
    let own = libm::sqrt(3.0);
    let (mut sizes, mut sum) = (own, covariance / own);
    for shift in shifts {
        let shift = shift / radius_squared;
        let size = libm::sqrt((inverse * shift).trace());
        if size > 0.0 {
            sizes += size;
            sum += shift / size;
        }
    }
    let wider = sum * sizes;
    // Makes it symmetric to the last bit.
    Some((wider + wider.transpose()) * 0.5)
}
