//! The effect of the tolerances of tags and camera on a fix.
//!
//! If a tag or the camera is off by theta, the least-squares pose is off by `(J'J)^-1 J' K theta`, K being the Jacobian
//! of the projection by theta (to first order, like the covariance). Each tolerance is a ball of theta: a translation
//! of the tag, its rotation about the vertical, a translation of the camera, its rotation about any axis. So each
//! tolerance moves the pose within an ellipsoid. The sum of these ellipsoids and that of the noise lies in the
//! ellipsoid `(sum p) (sum Q / p)`, for all numbers p above 0 (Kurzhanski and Valyi, Ellipsoidal Calculus); p is the
//! size of each ellipsoid in the metric of the noise. Unlike a 6-DoF pose of one tag, a fit on the floor mistakes a
//! tilted camera for a nearer or farther tag, so a small angle may have a large effect.

use super::{MountedCamera, STEP, TagObservation, View, dot, slopes};
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

/// A tolerance: a ball of displacements of a tag or of the camera.
pub(super) struct Ball<'v, 'e> {
    /// The ball's radius, metres or radians, above 0.
    pub(super) size: f64,
    /// The view after a displacement along each of its axes.
    pub(super) axes: Vec<Moved<'v, 'e>>,
}

/// Returns the view after a displacement, metres or radians.
type Moved<'v, 'e> = Box<dyn Fn(f64) -> View<'e> + 'v>;

/// Returns the tolerances above 0.
pub(super) fn balls<'v, 'e>(
    view: &'v View<'e>,
    eye: &MountedCamera,
    seen: &[TagObservation<'_>],
) -> Vec<Ball<'v, 'e>> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut all: Vec<Ball<'v, 'e>> = Vec::new();
    let mut add = |size: f64, axes: Vec<Moved<'v, 'e>>| {
        if size > 0.0 {
            all.push(Ball { size, axes });
        }
    };
    for (number, seen) in seen.iter().enumerate() {
        let moved = move |motion: IsometryMatrix3<f64>| {
            let mut moved = view.clone();
            for (corner, _) in moved.corners.iter_mut().skip(4 * number).take(4) {
                *corner = motion * *corner;
            }
            moved
        };
        let shift = |axis: Vector3<f64>| -> Moved<'v, 'e> {
            Box::new(move |by| moved(Translation3::from(axis * by).into()))
        };
        let at = seen.tag.pose;
        let centre = Translation3::new(at.x, at.y, at.z);
        let turn = |axis: Vector3<f64>| -> Moved<'v, 'e> {
            Box::new(move |by| {
                moved(centre * Rotation3::from_scaled_axis(axis * by) * centre.inverse())
            })
        };
        add(seen.tolerance.translation, axes.map(shift).into());
        add(
            seen.tolerance.turn_deg.to_radians(),
            Vec::from([turn(Vector3::z())]),
        );
    }
    let shift = |axis: Vector3<f64>| -> Moved<'v, 'e> {
        Box::new(move |by| {
            let mut moved = view.clone();
            moved.mount.translation.vector += axis * by;
            moved
        })
    };
    let turn = |axis: Vector3<f64>| -> Moved<'v, 'e> {
        Box::new(move |by| {
            let mut moved = view.clone();
            let turn = Rotation3::from_scaled_axis(axis * by);
            moved.mount.rotation = turn * moved.mount.rotation;
            moved
        })
    };
    add(eye.mount_tolerance.translation, axes.map(shift).into());
    add(
        eye.mount_tolerance.turn_deg.to_radians(),
        axes.map(turn).into(),
    );
    all
}

/// Returns the ellipsoids `{ e : e' Q^-1 e <= 1 }` of the possible pose errors, one for each tolerance above 0.
pub(super) fn shifts(
    view: &View<'_>,
    pose: &Vector3<f64>,
    balls: &[Ball<'_, '_>],
) -> Option<Vec<Matrix3<f64>>> {
    let jacobian = view.jacobian(pose)?;
    let information = Matrix3::from_fn(|r, c| dot(&jacobian[r], &jacobian[c]));
    let inverse = information.cholesky()?.inverse();
    let mut all = Vec::new();
    for ball in balls {
        let mut sum = Matrix3::zeros();
        for moved in &ball.axes {
            let ahead = moved(STEP).residuals(pose)?;
            let behind = moved(-STEP).residuals(pose)?;
            let column = slopes(&ahead, &behind)?;
            let off = inverse * Vector3::from_fn(|r, _| dot(&jacobian[r], &column)) * ball.size;
            sum += off * off.transpose();
        }
        all.push(sum);
    }
    Some(all)
}

/// Returns a covariance whose ellipsoid with this radius contains every sum of an error of the given covariance and
/// of the shifts; `None` if the given covariance is not positive definite.
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
