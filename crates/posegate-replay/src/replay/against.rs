//! Compares an estimate with the truth.

use super::{Row, TruthComparison};
use nalgebra::{Matrix3, Vector3};
use posegate::set::{CrossTerms, RadiusSquared, Trust, Uncertainty};
use posegate::shape::SuccessSet;

impl TruthComparison {
    /// Compares an estimate with the truth, in plain floats: a true pose on the border may count as inside or
    /// outside.
    #[must_use]
    pub fn of(
        row: &Row,
        truth: [f64; 3],
        success: &SuccessSet,
        radius: RadiusSquared,
        trust: Option<Trust>,
    ) -> Self {
        let [x, y, yaw] = row.pose;
        let turn = truth[2] - yaw;
        let turn = libm::atan2(libm::sin(turn), libm::cos(turn));
        let error = Vector3::new(truth[0] - x, truth[1] - y, turn);
        let error_m = libm::hypot(error.x, error.y);
        let (mut nees, mut scale) = (None, None);
        // An impossible estimate has no pose-set, even if its numbers are finite. A stale estimate has a pose-set.
        let possible = row.possible;
        match (row.spread, trust) {
            (Some(Uncertainty::Gaussian(covariance)), Some(trust)) => {
                nees = form(&covariance, &error);
                if possible {
                    let r2 = f64::from(radius.q16()) / 65536.0;
                    scale = believed(&covariance, trust)
                        .and_then(|covariance| form(&covariance, &error))
                        .map(|form| libm::sqrt(form / r2));
                }
            }
            (
                Some(Uncertainty::Bounded {
                    translation_m,
                    yaw_rad,
                }),
                Some(trust),
            ) if possible => {
                let grown = libm::sqrt(f64::from(trust.inflation.q16()) / 65536.0);
                let most = (error_m / translation_m).max(turn.abs() / yaw_rad);
                scale = Some(most / grown);
            }
            _ => {}
        }
        Self {
            inside: success.membership(truth).inside,
            scale,
            held: scale.map(|scale| scale <= 1.0),
            nees,
            error_m,
            error_yaw_rad: turn.abs(),
        }
    }
}

/// Returns `e' P^-1 e`.
fn form(covariance: &[[f64; 3]; 3], error: &Vector3<f64>) -> Option<f64> {
    let covariance = Matrix3::from_fn(|r, c| covariance[r][c]);
    let solved = covariance.cholesky()?.solve(error);
    let form = error.dot(&solved);
    form.is_finite().then_some(form)
}

/// Returns the covariance grown by the source's trust; `None` for a kind of cross terms that is not
/// supported.
fn believed(covariance: &[[f64; 3]; 3], trust: Trust) -> Option<[[f64; 3]; 3]> {
    let grown = f64::from(trust.inflation.q16()) / 65536.0;
    let [[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]] = *covariance;
    let rows = match trust.cross_terms {
        CrossTerms::YawUnknown(share) => {
            let w = f64::from(share.q8()) / 256.0;
            let (plane, yaw) = (1.0 / w, 1.0 / (1.0 - w));
            [
                [xx * plane, xy * plane, 0.0],
                [yx * plane, yy * plane, 0.0],
                [0.0, 0.0, tt * yaw],
            ]
        }
        CrossTerms::AllUnknown(share) => {
            let each = f64::from((share.q8() >> 1).max(1)) / 256.0;
            let (plane, yaw) = (1.0 / each, 1.0 / (1.0 - 2.0 * each));
            [
                [xx * plane, 0.0, 0.0],
                [0.0, yy * plane, 0.0],
                [0.0, 0.0, tt * yaw],
            ]
        }
        CrossTerms::Filled => [[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]],
        _ => return None,
    };
    Some(rows.map(|row| row.map(|entry| entry * grown)))
}
