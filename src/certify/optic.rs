//! Lens-model operations for intervals and slopes.

use super::{Interval, Slope};
use crate::shape::{Optic, Scalar};

/// Bound of the relative error of `libm::atan`: 4 ulp, although `libm` claims less than 1.
const ATAN_ERROR: f64 = 4.0 * f64::EPSILON;

/// Below this square of a radius, series replace quotients.
const SMALL: f64 = 1e-3;

impl Optic for Interval {
    fn reciprocal(self) -> Self {
        Self::reciprocal(self)
    }

    fn arctangent_ratio(self) -> Self {
        // Decreasing: atan(r) / r is the integral of 1 / (1 + r^2 t^2) for t from 0 to 1.
        let (near, far) = (ratio(self.lo.max(0.0)), ratio(self.hi.max(0.0)));
        Self {
            lo: far.lo,
            hi: near.hi,
        }
    }
}

impl Optic for Slope {
    fn reciprocal(self) -> Self {
        let value = self.value.reciprocal();
        Self {
            value,
            by_yaw: -(self.by_yaw * value.square()),
        }
    }

    fn arctangent_ratio(self) -> Self {
        // Increasing in s = r^2: the integral of -t^2 / (1 + s t^2)^2.
        let [low, high] = [self.value.lo, self.value.hi].map(|s| by_square(s.max(0.0)));
        let slope = Interval {
            lo: low.lo.max(-0.333_333_34),
            hi: high.hi.min(0.0),
        };
        Self {
            value: self.value.arctangent_ratio(),
            by_yaw: self.by_yaw * slope,
        }
    }
}

/// Encloses `atan(r) / r` at one `s = r^2`.
fn ratio(s: f64) -> Interval {
    if s < 1e-12 {
        // Between 1 - s/3 and 1.
        return Interval {
            lo: (1.0 - s).next_down(),
            hi: 1.0,
        };
    }
    let r = Interval::point(s).root();
    let angle = Interval {
        lo: libm::atan(r.lo) * (1.0 - ATAN_ERROR),
        hi: libm::atan(r.hi) * (1.0 + ATAN_ERROR),
    };
    angle * r.reciprocal()
}

/// Encloses the derivative of `atan(r) / r` by `s = r^2`, at one s.
fn by_square(s: f64) -> Interval {
    let point = Interval::point(s);
    if s < SMALL {
        // The series -1/3 + 2 s / 5 - 3 s^2 / 7 ... alternates with decreasing terms.
        return Interval {
            lo: -0.333_333_34,
            hi: (Interval::point(0.4) * point).hi - 0.333_333_33,
        };
    }
    let one = Interval::point(1.0);
    ((one + point).reciprocal() - ratio(s)) * (point + point).reciprocal()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::shape::Lens;
    use proptest::prelude::*;

    fn holds(interval: Interval, value: f64) -> bool {
        interval.lo <= value && value <= interval.hi
    }

    /// A lens of each model, with each coefficient in use.
    pub(crate) const LENSES: [Lens; 4] = [
        Lens::PlumbBob([-0.32, 0.11, 0.002, -0.003, -0.016]),
        Lens::PlumbBob([0.12, 0.05, -0.004, 0.001, 0.01]),
        Lens::RationalPolynomial([0.4, -0.08, 0.001, 0.002, 0.003, 0.72, 0.05, 0.01]),
        Lens::Equidistant([-0.02, 0.011, -0.006, 0.001]),
    ];

    proptest! {
        #[test]
        fn interval_ratios_enclose_exact_values(s in 0.0f64..300.0, w in 0.0f64..2.0, t in 0.0f64..1.0, small in 1e-9f64..1.0) {
            for (s, w) in [(s, w), (s * small, w * small)] {
                let over = Interval { lo: s, hi: s + w };
                let p = (s + t * w).clamp(over.lo, over.hi);
                let exact = libm::atan(libm::sqrt(p)) / libm::sqrt(p);
                prop_assert!(holds(over.arctangent_ratio(), exact) || p == 0.0);
                let point = Interval::point(p).arctangent_ratio();
                prop_assert!(point.hi - point.lo < 1e-11);
                let slope = Slope { value: over, by_yaw: Interval::point(1.0) }.arctangent_ratio();
                let step = 1e-4 * p.max(1e-3);
                let chord = (f64::arctangent_ratio(p + step) - f64::arctangent_ratio(p)) / step;
                let margin = step + 1e-14 / step;
                prop_assert!(slope.by_yaw.lo <= chord + margin && chord - margin <= slope.by_yaw.hi);
                prop_assert!(slope.by_yaw.hi - slope.by_yaw.lo < w + 1e-3);
            }
        }

        /// Points and differences of each model lie in the enclosures along a line.
        #[test]
        fn interval_distortion_encloses_exact_values(
            x in -0.6f64..0.6, y in -0.6f64..0.6, dx in -0.1f64..0.1, dy in -0.1f64..0.1, t in 0.0f64..1.0,
        ) {
            let along = |at: f64, by: f64, value: Interval| Slope {
                value: Interval::point(at) + Interval::point(by) * value,
                by_yaw: Interval::point(by),
            };
            for lens in LENSES {
                let whole = Interval { lo: 0.0, hi: 1.0 };
                let over = lens.distort([along(x, dx, whole), along(y, dy, whole)]);
                let p = lens.distort([x + t * dx, y + t * dy]);
                let ends = [0.0, 1.0].map(|t| lens.distort([x + t * dx, y + t * dy]));
                for axis in 0..2 {
                    prop_assert!(over[axis].value.lo <= p[axis] && p[axis] <= over[axis].value.hi);
                    // The mean value of the derivative.
                    let chord = ends[1][axis] - ends[0][axis];
                    prop_assert!(over[axis].by_yaw.lo <= chord && chord <= over[axis].by_yaw.hi);
                }
            }
        }
    }

    #[test]
    fn unbounded_interval_gives_unbounded_result() {
        let ratio = Interval::ENTIRE.arctangent_ratio();
        assert!(ratio.lo <= 0.0 && ratio.hi >= 1.0);
        let slope = Slope::constant(Interval { lo: -1.0, hi: 1.0 });
        assert_eq!(Optic::reciprocal(slope).value, Interval::ENTIRE);
    }
}
