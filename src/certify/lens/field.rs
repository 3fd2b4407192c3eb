//! How far a lens is one-to-one.

use super::LensError;
use crate::certify::{Interval, Slope};
use crate::shape::{Lens, Scalar};

/// How far a field is looked for: 86.4 degrees off the optical axis. A wider lens has this one.
pub(super) const FARTHEST: f64 = 16.0;

/// A field that is not found within this share of its radius is taken to end.
const FINEST: f64 = 1e-9;

impl Lens {
    /// The largest radius of normalised points up to which the lens is proven to be one-to-one (infinite
    /// for a pinhole, otherwise at most 16). It is rounded down, and within 1e-6 of the true radius.
    ///
    /// # Errors
    /// A coefficient that is no number, or a field that is empty.
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

/// Whether the Jacobian is positive definite wherever the radius is in an interval.
fn is_one_to_one(lens: &Lens, radius: Interval) -> bool {
    // The derivative is by the radius.
    let r = Slope {
        value: radius,
        by_yaw: Interval::point(1.0),
    };
    let scale = lens.scale(r.square());
    let radial = r * scale;
    let [p1, p2] = lens.tangential().map(Interval::point);
    let tangential = Interval::point(6.0) * (p1.square() + p2.square()).root() * radius;
    (scale.value - tangential).lo > 0.0 && (radial.by_yaw - tangential).lo > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn fields_end_where_the_derivative_does() {
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
    fn wide_fields_end_where_nobody_looks() {
        for lens in [
            Lens::PlumbBob([0.1, 0.0, 0.0, 0.0, 0.0]),
            Lens::Equidistant([0.0; 4]),
            Lens::RationalPolynomial([0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0]),
        ] {
            let field = lens.field();
            // r / (1 + r^2 / 10) folds at the root of 10.
            let rational = lens.name() == "rational_polynomial";
            let expected = if rational { libm::sqrt(10.0) } else { FARTHEST };
            let field = field.unwrap();
            assert!(field <= expected && field > expected - 1e-5, "{field}");
        }
        assert_eq!(Lens::Pinhole.field(), Ok(f64::INFINITY));
    }

    #[test]
    fn fields_that_are_none_are_refused() {
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
