//! The field of a lens: how far from the optical axis it is one-to-one.

use super::LensError;
use crate::certify::{Interval, Slope};
use crate::shape::{Lens, Scalar};

/// Largest field radius that is searched: 86.4 degrees off the optical axis. A wider lens gets this one.
pub(super) const FARTHEST: f64 = 16.0;

/// The search for the end of a field stops at steps below this share of its radius.
const FINEST: f64 = 1e-9;

impl Lens {
    /// Returns the largest radius of normalised points up to which the lens is proven to be one-to-one
    /// (infinite for a pinhole, otherwise at most 16). Rounded down, and within 1e-6 of the true radius.
    ///
    /// # Errors
    /// [`LensError`] if a coefficient is not finite, or the field is empty.
    pub fn field(&self) -> Result<f64, LensError> {
        let bad = self.coefficients().iter().find(|k| !k.is_finite());
        if let Some(value) = bad {
            return Err(LensError::Number {
                what: "a distortion coefficient",
                value: *value,
            });
        }
        if matches!(self, Self::Pinhole) {
            return Ok(f64::INFINITY);
        }
        let (mut proven, mut step) = (0.0, 0.125);
        while proven < FARTHEST {
            let end = (proven + step).min(FARTHEST);
            if is_one_to_one(
                self,
                Interval {
                    lo: proven,
                    hi: end,
                },
            ) {
                proven = end;
                step *= 2.0;
            } else {
                step *= 0.5;
                if step < FINEST * proven.max(1e-3) {
                    break;
                }
            }
        }
        if proven > 0.0 {
            Ok(proven)
        } else {
            Err(LensError::NoField)
        }
    }
}

/// Number of rings of a disc in the search for the largest magnification.
const RINGS: u32 = 256;

impl Lens {
    /// Returns an upper bound of the factor by which the lens lengthens a short line in a disc of normalised
    /// points; 1 for a pinhole. The bound is on the Jacobian's eigenvalues, as for the field, so it holds in
    /// every direction.
    pub fn magnification(&self, radius: f64) -> f64 {
        if matches!(self, Self::Pinhole) {
            return 1.0;
        }
        let ring = |number: u32| radius * f64::from(number) / f64::from(RINGS);
        (0..RINGS)
            .map(|number| {
                let [radial, across, tangential] = eigenvalues(
                    self,
                    Interval {
                        lo: ring(number),
                        hi: ring(number + 1),
                    },
                );
                let largest = |v: Interval| v.lo.abs().max(v.hi.abs());
                (largest(radial).max(largest(across)) + tangential.hi).next_up()
            })
            .fold(0.0, f64::max)
    }
}

/// Returns `true` if the Jacobian is positive definite for every radius in an interval.
fn is_one_to_one(lens: &Lens, radius: Interval) -> bool {
    let [radial, across, tangential] = eigenvalues(lens, radius);
    (across - tangential).lo > 0.0 && (radial - tangential).lo > 0.0
}

/// Encloses the Jacobian's eigenvalues without the tangential part, along the radius and across it, and
/// bounds how much that part can change them, for every radius in an interval.
fn eigenvalues(lens: &Lens, radius: Interval) -> [Interval; 3] {
    // Here the derivative is by the radius.
    let r = Slope {
        value: radius,
        by_yaw: Interval::point(1.0),
    };
    let scale = lens.scale(r.square());
    let radial = r * scale;
    let [p1, p2] = lens.tangential().map(Interval::point);
    let tangential = Interval::point(6.0) * (p1.square() + p2.square()).root() * radius;
    [radial.by_yaw, scale.value, tangential]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn field_ends_where_derivative_reaches_zero() {
        // 1 + 3 k1 r^2 = 0 at k1 = -1/3.
        let field = Lens::PlumbBob([-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0])
            .field()
            .unwrap();
        assert!(field < 1.0 && field > 1.0 - 1e-6, "{field}");
        // 1 - 6 p2 r = 0 towards -x.
        let field = Lens::PlumbBob([0.0, 0.0, 0.0, 0.1, 0.0]).field().unwrap();
        assert!(field < 1.0 / 0.6 && field > 1.0 / 0.6 - 1e-6, "{field}");
        // A pole at r = 2.
        let pole = [0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0];
        let field = Lens::RationalPolynomial(pole).field().unwrap();
        assert!(field < 2.0 && field > 2.0 - 1e-6, "{field}");
        // 1 - 3 theta^2 / 3 = 0 at one radian.
        let field = Lens::Equidistant([-1.0 / 3.0, 0.0, 0.0, 0.0])
            .field()
            .unwrap();
        let tan = libm::tan(1.0);
        assert!(field < tan && field > tan - 1e-6, "{field}");
    }

    #[test]
    fn wide_fields_end_at_farthest_angle() {
        for lens in [
            Lens::PlumbBob([0.1, 0.0, 0.0, 0.0, 0.0]),
            Lens::Equidistant([0.0; 4]),
            Lens::RationalPolynomial([0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0]),
        ] {
            let field = lens.field();
            // r / (1 + r^2 / 10) folds at the square root of 10.
            let rational = lens.name() == "rational_polynomial";
            let expected = if rational { libm::sqrt(10.0) } else { FARTHEST };
            let field = field.unwrap();
            assert!(field <= expected && field > expected - 1e-5, "{field}");
        }
        assert_eq!(Lens::Pinhole.field(), Ok(f64::INFINITY));
    }

    #[test]
    fn magnifications_bound_differences() {
        assert_eq!(Lens::Pinhole.magnification(9.0), 1.0);
        for lens in crate::certify::optic::tests::LENSES {
            let most = lens.magnification(0.6);
            let mut found = 0.0f64;
            for place in 0..40_000u32 {
                let [r, angle] = [f64::from(place / 200) / 200.0 * 0.6, f64::from(place % 200)];
                let p = [r * libm::cos(angle), r * libm::sin(angle)];
                let way = [libm::cos(0.7 * angle), libm::sin(0.7 * angle)];
                let ends = [0.5e-6, -0.5e-6]
                    .map(|by| lens.distort([0, 1].map(|axis: usize| p[axis] + by * way[axis])));
                let [dx, dy] = [0, 1].map(|axis: usize| ends[0][axis] - ends[1][axis]);
                found = found.max(libm::hypot(dx, dy) * 1e6);
            }
            assert!(
                found <= most && found > 0.95 * most,
                "{lens:?}: {found}, {most}"
            );
        }
    }

    #[test]
    fn invalid_fields_are_refused() {
        let error = Lens::Equidistant([0.0, f64::NAN, 0.0, 0.0]).field();
        assert!(
            error
                .unwrap_err()
                .to_string()
                .contains("coefficient is NaN")
        );
        let steep = Lens::PlumbBob([-1e300, 0.0, 0.0, 0.0, 0.0]).field();
        assert_eq!(steep, Err(LensError::NoField));
    }
}
