//! Bounds on the error of a pose that is observed in one view of a tag, and the views where the error is small enough.

use super::visibility::{Sight, Visibility};

/// A bound on the error of an observation by distance and angles ([`Sight`]):
/// `c0 + c1 d^2 + c2 phi^2 + c3 psi^2` (m, rad, rad; the paper's form with a constant). It covers the detector only.
/// The error that the tolerances of tag and camera add is [`Visibility::tolerance_error`].
///
/// `c3` may be below 0: a tag that is seen head-on has the largest errors. The bound must not be below 0 at any angle of a
/// view: [`Self::is_bound_up_to`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorModel {
    /// `[c0, c1, c2, c3]` of the translation, metres; the first three at least 0.
    pub translation: [f64; 4],
    /// `[c0, c1, c2, c3]` of the yaw, degrees; the first three at least 0.
    pub yaw_deg: [f64; 4],
}

impl ErrorModel {
    /// Returns the two bounds, metres and degrees, at a distance (m) and angles (rad).
    #[must_use]
    pub fn at(&self, d: f64, phi: f64, psi: f64) -> [f64; 2] {
        [self.translation, self.yaw_deg]
            .map(|[c0, c1, c2, c3]| c0 + c1 * d * d + c2 * phi * phi + c3 * psi * psi)
    }

    /// Returns `true` if neither bound is below 0 at any angle `psi` up to this one, degrees.
    #[must_use]
    pub fn is_bound_up_to(&self, psi_max_deg: f64) -> bool {
        let least = self.at(0.0, 0.0, psi_max_deg.to_radians());
        [self.translation[0], self.yaw_deg[0], least[0], least[1]]
            .iter()
            .all(|bound| *bound >= 0.0)
    }

    /// Returns `true` if a bound falls with `psi`.
    fn falls_with_psi(&self) -> bool {
        self.translation[3] < 0.0 || self.yaw_deg[3] < 0.0
    }
}

/// Views in which the error is within its limit: those of a visibility set, at an angle of at least `psi_min_deg`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ViewsWithin {
    /// The limits on distance and angles.
    pub view: Visibility,
    /// The smallest angle between the tag's normal and the ray to the camera, degrees; 0 without such a limit.
    pub psi_min_deg: f64,
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
        let d = sight.d + ray;
        let phi = sight.phi + turned(view.mount_tolerance);
        let turn = turned(view.tag_tolerance);
        let widest = self.model.at(d, phi, sight.psi + turn);
        let squarest = self.model.at(d, phi, (sight.psi - turn).max(0.0));
        let [metres, degrees] = view.tolerance_error(d);
        let translation = self.translation - (widest[0].max(squarest[0]) + metres);
        let yaw = self.yaw_deg - (widest[1].max(squarest[1]) + degrees);
        translation.min(yaw.to_radians())
    }

    /// Returns visibility sets with smaller limits, in each of which the bound, with the error that the tolerances add
    /// to it, is within the limit everywhere. The bound grows with distance and `phi`, and grows or falls with `psi`, so
    /// its value at the limits is the largest.
    pub(crate) fn views(&self, view: &Visibility) -> Vec<ViewsWithin> {
        let mut views: Vec<ViewsWithin> = Vec::new();
        let angles = |most: f64| (1..=STEPS).map(move |k| most * f64::from(k) / f64::from(STEPS));
        // A limit from below is of use only to a bound that falls.
        let most_square = if self.model.falls_with_psi() {
            STEPS - 1
        } else {
            0
        };
        let turned = 2.0 * view.tag_tolerance.turn_deg;
        for k in (0..=most_square).rev() {
            let psi_min_deg = view.psi_max_deg * f64::from(k) / f64::from(STEPS);
            for phi_max_deg in angles(view.phi_max_deg) {
                for psi_max_deg in angles(view.psi_max_deg) {
                    if psi_min_deg > 0.0 && !(psi_min_deg + turned < psi_max_deg) {
                        continue;
                    }
                    let d_max = self.farthest(view, phi_max_deg, [psi_min_deg, psi_max_deg]);
                    // Of sets with the same reach, keep the widest.
                    views.retain(|known| {
                        known.psi_min_deg < psi_min_deg
                            || known.view.d_max > d_max
                            || known.view.phi_max_deg > phi_max_deg
                            || known.view.psi_max_deg > psi_max_deg
                    });
                    if d_max > 0.0 {
                        views.push(ViewsWithin {
                            view: Visibility {
                                d_max,
                                phi_max_deg,
                                psi_max_deg,
                                ..*view
                            },
                            psi_min_deg,
                        });
                    }
                }
            }
        }
        views
    }

    /// Returns the largest distance up to the view's at which both bounds hold for angles up to `phi_deg` and between
    /// `psi_deg`: metres, rounded down. 0 if the bounds hold at no distance.
    fn farthest(&self, view: &Visibility, phi_deg: f64, psi_deg: [f64; 2]) -> f64 {
        let phi = phi_deg.to_radians();
        let [psi_min, psi_max] = psi_deg.map(f64::to_radians);
        // The part of the limit that is left for the growth with d.
        let rest = |c: [f64; 4], limit: f64| {
            let worst = if c[3] < 0.0 { psi_min } else { psi_max };
            limit * (1.0 - 1e-12) - (c[0] + c[2] * phi * phi + c[3] * worst * worst)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::visibility::test_view;

    /// Every view of the parts is within the limit, and the parts hold most of the views that are.
    #[test]
    fn bounds_falling_with_psi_keep_oblique_views() {
        let limits = [
            // Both bounds fall; one grows while the other one falls; both grow.
            ([0.05, 0.001, 0.01, -0.03], [2.0, 0.02, 0.1, -1.3]),
            ([0.01, 0.001, 0.0, 0.02], [2.0, 0.02, 0.0, -1.3]),
            ([0.01, 0.001, 0.01, 0.01], [0.2, 0.05, 0.1, 0.5]),
        ];
        for (translation, yaw_deg) in limits {
            let model = ErrorModel {
                translation,
                yaw_deg,
            };
            assert!(model.is_bound_up_to(70.0));
            let limit = ErrorLimit {
                model,
                translation: 0.045,
                yaw_deg: 1.6,
            };
            let parts = limit.views(&test_view());
            let (mut within, mut held) = (0, 0);
            for i in 0..50 {
                for j in 0..40 {
                    for k in 0..70 {
                        let [d, phi_deg, psi_deg] = [
                            0.05 + 0.1 * f64::from(i),
                            f64::from(j) + 0.5,
                            f64::from(k) + 0.5,
                        ];
                        let sight = Sight {
                            d,
                            phi: phi_deg.to_radians(),
                            psi: psi_deg.to_radians(),
                            corners_px: [None; 4],
                        };
                        let fits = limit.slack(&test_view(), &sight) >= 0.0;
                        let is_held = parts.iter().any(|part| {
                            d <= part.view.d_max
                                && phi_deg <= part.view.phi_max_deg
                                && (part.psi_min_deg..=part.view.psi_max_deg).contains(&psi_deg)
                        });
                        assert!(fits || !is_held, "{model:?} {d} {phi_deg} {psi_deg}");
                        within += u32::from(fits);
                        held += u32::from(is_held);
                    }
                }
            }
            assert!(within > 10_000 && held * 3 > within * 2, "{held} {within}");
        }
    }

    #[test]
    fn tilted_tag_may_be_seen_more_head_on() {
        // The bound is 4.5 deg at a psi of 23.4 deg.
        let limit = |yaw_deg| ErrorLimit {
            model: ErrorModel {
                translation: [0.0; 4],
                yaw_deg: [5.0, 0.0, 0.0, -3.0],
            },
            translation: 1.0,
            yaw_deg,
        };
        let sight = |psi_deg: f64| Sight {
            d: 2.0,
            phi: 0.0,
            psi: psi_deg.to_radians(),
            corners_px: [None; 4],
        };
        let mut view = test_view();
        assert!(limit(4.5).slack(&view, &sight(23.0)) < 0.0);
        assert!(limit(4.5).slack(&view, &sight(24.0)) > 0.0);
        // Turned by up to 3 deg, which adds as much to the error.
        view.tag_tolerance.turn_deg = 3.0;
        let added = view.tolerance_error(2.0)[1];
        assert!(limit(4.5 + added).slack(&view, &sight(26.0)) < 0.0);
        assert!(limit(4.5 + added).slack(&view, &sight(27.0)) > 0.0);
    }
}
