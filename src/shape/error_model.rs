//! Bounds on the error of a pose that is observed in one view of a tag, and the views where the error is small enough.

use super::visibility::{Sight, Visibility};

/// A bound on the error of an observation that grows with distance and angles:
/// `c0 + c1 d^2 + c2 phi^2 + c3 psi^2` (m, rad, rad; the paper's form with a constant). It covers the detector only.
/// The error that the tolerances of tag and camera add is [`Visibility::tolerance_error`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorModel {
    /// `[c0, c1, c2, c3]` of the translation, metres; each at least 0.
    pub translation: [f64; 4],
    /// `[c0, c1, c2, c3]` of the yaw, degrees; each at least 0.
    pub yaw_deg: [f64; 4],
}

/// The largest error that a task allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorLimit {
    /// Bound on the error.
    pub model: ErrorModel,
    /// Metres.
    pub translation: f64,
    /// Degrees.
    pub yaw_deg: f64,
}

/// Number of steps in which each angle is sampled.
const STEPS: u32 = 8;

impl ErrorLimit {
    /// Returns the limit minus the bound, with the error that the tolerances add to it, at the worst view within the
    /// tolerances: the lesser of metres and radians.
    pub(crate) fn slack(&self, view: &Visibility, sight: &Sight) -> f64 {
        let ray = view.tolerance_margins().ray;
        let parallax = libm::asin((ray / sight.d).min(1.0));
        let turned = |tolerance: super::Tolerance| tolerance.turn_deg.to_radians() + parallax;
        let at = [
            sight.d + ray,
            sight.phi + turned(view.mount_tolerance),
            sight.psi + turned(view.tag_tolerance),
        ];
        let bound = |c: [f64; 4]| c[0] + (0..3).map(|i| c[i + 1] * at[i] * at[i]).sum::<f64>();
        let [metres, degrees] = view.tolerance_error(at[0]);
        let translation = self.translation - (bound(self.model.translation) + metres);
        let yaw = self.yaw_deg - (bound(self.model.yaw_deg) + degrees);
        translation.min(yaw.to_radians())
    }

    /// Returns visibility sets with smaller limits, in each of which the bound, with the error that the tolerances add
    /// to it, is within the limit everywhere. The bound grows with every argument, so its value at the three limits is
    /// the largest.
    pub(crate) fn views(&self, view: &Visibility) -> Vec<Visibility> {
        let mut views: Vec<Visibility> = Vec::new();
        let angles = |most: f64| (1..=STEPS).map(move |k| most * f64::from(k) / f64::from(STEPS));
        for phi_max_deg in angles(view.phi_max_deg) {
            for psi_max_deg in angles(view.psi_max_deg) {
                let d_max = self.farthest(view, phi_max_deg, psi_max_deg);
                // Of sets with the same reach, keep the widest.
                views.retain(|known| {
                    known.d_max > d_max
                        || known.phi_max_deg > phi_max_deg
                        || known.psi_max_deg > psi_max_deg
                });
                if d_max > 0.0 {
                    views.push(Visibility {
                        d_max,
                        phi_max_deg,
                        psi_max_deg,
                        ..*view
                    });
                }
            }
        }
        views
    }

    /// Returns the largest distance up to the view's at which both bounds hold for these angles, metres, rounded down;
    /// 0 if there is none.
    fn farthest(&self, view: &Visibility, phi_deg: f64, psi_deg: f64) -> f64 {
        let (phi, psi) = (phi_deg.to_radians(), psi_deg.to_radians());
        // The part of the limit that is left for the growth with d.
        let rest = |c: [f64; 4], limit: f64| {
            limit * (1.0 - 1e-12) - (c[0] + c[2] * phi * phi + c[3] * psi * psi)
        };
        let (translation, yaw) = (self.model.translation, self.model.yaw_deg);
        let left = [rest(translation, self.translation), rest(yaw, self.yaw_deg)];
        let reach = |c: [f64; 4], rest: f64| {
            if !(rest >= 0.0) {
                0.0
            } else if c[1] > 0.0 {
                libm::sqrt(rest / c[1]) * (1.0 - 1e-12)
            } else {
                f64::INFINITY
            }
        };
        let exact = reach(translation, left[0]).min(reach(yaw, left[1]));
        let most = exact.min(view.d_max);
        if view.is_exact() {
            return most;
        }
        Visibility::farthest_where(most, |d| {
            let [metres, degrees] = view.tolerance_error(d);
            // 1e-12 is more than the rounding error of `rest` for errors below 1 km.
            let up = |c: [f64; 4]| c[1] * d * d * (1.0 + 1e-12) + 1e-12;
            up(translation) + metres <= left[0] && up(yaw) + degrees <= left[1]
        })
    }
}
