//! Intervals of `f64` whose ends are rounded outwards.
//!
//! The basic operations of IEEE 754 are correctly rounded, so the next number outwards encloses the
//! exact result. `libm`'s sine and cosine are within 1 ulp; [`TRIG_ERROR`] is four times that.

use crate::num::BinaryAngle;
use crate::shape::Scalar;
use core::ops::{Add, Mul, Neg, Sub};

/// A closed interval that encloses an exact number (or all values of an expression).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

/// Bound of the absolute error of `libm::sin` and `libm::cos`: 4 ulp of a number below 1.
const TRIG_ERROR: f64 = 4.0 * (f64::EPSILON / 2.0);

/// The least size of an end that is not zero. The numbers next to zero are subnormal, and a processor takes about a hundred times as long to
/// multiply them. A product of two ends of this size is not subnormal either.
const TINY: f64 = 1e-150;

/// Returns a number below every number that rounds to `value`.
#[inline]
fn below(value: f64) -> f64 {
    if value.abs() >= TINY {
        value.next_down()
    } else if value > 0.0 {
        0.0
    } else {
        -TINY
    }
}

impl Interval {
    /// All numbers: nothing is known.
    pub const ENTIRE: Self = Self {
        lo: f64::NEG_INFINITY,
        hi: f64::INFINITY,
    };

    /// Pi: the `f64` constant is below pi, its successor above.
    pub const PI: Self = Self {
        lo: core::f64::consts::PI,
        hi: core::f64::consts::PI.next_up(),
    };

    /// Encloses one number exactly.
    #[inline]
    #[must_use]
    pub const fn point(value: f64) -> Self {
        Self {
            lo: value,
            hi: value,
        }
    }

    /// Rounds both ends one number outwards; an end that is NaN makes the interval everything. An end that is closer to zero than
    /// [`TINY`] becomes zero, or `TINY` on the other side of it.
    #[inline]
    fn outwards(lo: f64, hi: f64) -> Self {
        if lo.is_nan() || hi.is_nan() {
            return Self::ENTIRE;
        }
        Self {
            lo: below(lo),
            hi: -below(-hi),
        }
    }

    /// Encloses an angle of `units / 2^32` turns in radians; `units` is exact up to 2^53.
    #[must_use]
    pub fn radians(units: i64) -> Self {
        // The scale is a power of two, so the product with it is exact.
        let turns = Self::point(units as f64 * (1.0 / 2_147_483_648.0));
        turns * Self::PI
    }

    /// Encloses the angle of a table's heading in `[0, 2 pi)`.
    #[must_use]
    pub fn of_angle(angle: BinaryAngle) -> Self {
        Self::radians(i64::from(angle.0))
    }

    /// Returns the smallest interval that contains both intervals.
    #[must_use]
    pub const fn hull(self, other: Self) -> Self {
        Self {
            lo: self.lo.min(other.lo),
            hi: self.hi.max(other.hi),
        }
    }

    /// Returns `true` if every number of the interval is at least 0.
    #[must_use]
    pub fn is_at_least_zero(self) -> bool {
        self.lo >= 0.0
    }

    /// Returns a number in the middle.
    #[must_use]
    pub fn middle(self) -> f64 {
        self.lo + 0.5 * (self.hi - self.lo)
    }

    /// Encloses `1 / self`; everything if the interval contains zero.
    #[must_use]
    pub fn reciprocal(self) -> Self {
        if self.lo > 0.0 || self.hi < 0.0 {
            Self::outwards(1.0 / self.hi, 1.0 / self.lo)
        } else {
            Self::ENTIRE
        }
    }

    /// Encloses cosine and sine of an angle in radians.
    #[must_use]
    pub fn cos_sin(self) -> [Self; 2] {
        let quarter = 0.5 * core::f64::consts::PI;
        if !(self.hi - self.lo < quarter && self.lo.abs() < 1e4 && self.hi.abs() < 1e4) {
            let all = Self { lo: -1.0, hi: 1.0 };
            return [all, all];
        }
        // An extremum of magnitude 1 at every multiple of pi, counted from `first`. The test for it
        // is widened by far more than the rounding of the multiple.
        let enclose = |a: f64, b: f64, first: f64| {
            let mut range = Self {
                lo: a.min(b) - TRIG_ERROR,
                hi: a.max(b) + TRIG_ERROR,
            };
            let nearest = libm::round((self.middle() - first) / core::f64::consts::PI);
            let extremum = first + nearest * core::f64::consts::PI;
            if extremum >= self.lo - 1e-9 && extremum <= self.hi + 1e-9 {
                if libm::fmod(nearest, 2.0) == 0.0 {
                    range.hi = 1.0;
                } else {
                    range.lo = -1.0;
                }
            }
            Self::outwards(range.lo.max(-1.0), range.hi.min(1.0))
        };
        [
            enclose(libm::cos(self.lo), libm::cos(self.hi), 0.0),
            enclose(libm::sin(self.lo), libm::sin(self.hi), quarter),
        ]
    }
}

impl Add for Interval {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self::outwards(self.lo + other.lo, self.hi + other.hi)
    }
}

impl Sub for Interval {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::outwards(self.lo - other.hi, self.hi - other.lo)
    }
}

impl Neg for Interval {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self {
            lo: -self.hi,
            hi: -self.lo,
        }
    }
}

impl Mul for Interval {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        let [a, b] = [self.lo * other.lo, self.lo * other.hi];
        let [c, d] = [self.hi * other.lo, self.hi * other.hi];
        // Also if two are infinite with different signs.
        if ((a + b) + (c + d)).is_nan() {
            return Self::ENTIRE;
        }
        // `f64::min` and `f64::max` would look for NaN again.
        let least = |a: f64, b: f64| if a < b { a } else { b };
        let most = |a: f64, b: f64| if a > b { a } else { b };
        Self {
            lo: below(least(least(a, b), least(c, d))),
            hi: -below(-most(most(a, b), most(c, d))),
        }
    }
}

impl Scalar for Interval {
    fn exact(value: f64) -> Self {
        Self::point(value)
    }

    fn cos_sin_deg(degrees: f64) -> [Self; 2] {
        // Right angles are exact, because rotations by them are common. The remainder is exact.
        let turned = libm::fmod(degrees, 360.0);
        let whole = |c: f64, s: f64| [Self::point(c), Self::point(s)];
        if turned == 0.0 {
            whole(1.0, 0.0)
        } else if turned == 90.0 || turned == -270.0 {
            whole(0.0, 1.0)
        } else if turned == 180.0 || turned == -180.0 {
            whole(-1.0, 0.0)
        } else if turned == 270.0 || turned == -90.0 {
            whole(0.0, -1.0)
        } else {
            (Self::point(turned) * Self::PI * Self::point(180.0).reciprocal()).cos_sin()
        }
    }

    fn root(self) -> Self {
        // IEEE 754 square roots are correctly rounded, and so is libm's.
        let root = Self::outwards(libm::sqrt(self.lo.max(0.0)), libm::sqrt(self.hi.max(0.0)));
        Self {
            lo: root.lo.max(0.0),
            ..root
        }
    }

    #[inline]
    fn square(self) -> Self {
        let (a, b) = (self.lo * self.lo, self.hi * self.hi);
        let straddles = self.lo <= 0.0 && self.hi >= 0.0;
        let square = Self::outwards(if straddles { 0.0 } else { a.min(b) }, a.max(b));
        Self {
            lo: square.lo.max(0.0),
            ..square
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn holds(interval: Interval, value: f64) -> bool {
        interval.lo <= value && value <= interval.hi
    }

    /// Exact sums and products of small multiples of 2^-20 fit an `f64`, so they check the direction
    /// of the rounding without another arithmetic.
    fn grid(value: f64) -> f64 {
        libm::round(value * 1_048_576.0) / 1_048_576.0
    }

    proptest! {
        #[test]
        fn interval_operations_enclose_exact_results(
            a in -100.0f64..100.0, b in -100.0f64..100.0, wa in 0.0f64..2.0, wb in 0.0f64..2.0,
            ta in 0.0f64..1.0, tb in 0.0f64..1.0,
        ) {
            let (x, y) = (Interval { lo: a, hi: a + wa }, Interval { lo: b, hi: b + wb });
            let (p, q) = ((a + ta * wa).clamp(x.lo, x.hi), (b + tb * wb).clamp(y.lo, y.hi));
            prop_assert!(holds(x + y, p + q) && holds(x - y, p - q) && holds(x * y, p * q));
            prop_assert!(holds(-x, -p) && holds(x.square(), p * p));
            prop_assert!(holds(x.root(), libm::sqrt(p.max(0.0))));
            prop_assert!(holds(x.reciprocal(), 1.0 / p) || p == 0.0);
            let exact = Interval::point(grid(a)) * Interval::point(grid(b));
            prop_assert!(exact.lo < grid(a) * grid(b) && exact.hi > grid(a) * grid(b));
        }

        #[test]
        fn interval_sine_and_cosine_enclose_exact_values(a in -7.0f64..7.0, w in 0.0f64..1.5, t in 0.0f64..1.0) {
            let x = Interval { lo: a, hi: a + w };
            let p = (a + t * w).clamp(x.lo, x.hi);
            let [cos, sin] = x.cos_sin();
            prop_assert!(holds(cos, p.cos()) && holds(sin, p.sin()));
            prop_assert!(cos.hi <= 1.0f64.next_up() && cos.lo >= (-1.0f64).next_down());
            // And tight: no wider than the angle.
            prop_assert!(cos.hi - cos.lo <= w + 1e-14 && sin.hi - sin.lo <= w + 1e-14);
        }
    }

    /// Products of the numbers next to zero are subnormal, and slow: with them, proofs took four times as long.
    #[test]
    fn ends_close_to_zero_enclose_it_and_are_not_subnormal() {
        let zero = Interval::point(1.0) - Interval::point(1.0);
        let below = zero - Interval { lo: 0.0, hi: 3.0 };
        let ends = [1e-300, 1e-160, TINY, 1e-140, 0.3, 7.0].map(Interval::point);
        let tried = ends
            .into_iter()
            .chain(ends.map(|end| -end))
            .chain([zero, below]);
        let tried: Vec<Interval> = tried.collect();
        for x in &tried {
            for y in &tried {
                for (found, exact) in [
                    (
                        *x * *y,
                        [x.lo * y.lo, x.lo * y.hi, x.hi * y.lo, x.hi * y.hi],
                    ),
                    (
                        *x + *y,
                        [x.lo + y.lo, x.lo + y.hi, x.hi + y.lo, x.hi + y.hi],
                    ),
                    (
                        *x - *y,
                        [x.lo - y.lo, x.lo - y.hi, x.hi - y.lo, x.hi - y.hi],
                    ),
                ] {
                    assert!(
                        exact.iter().all(|value| holds(found, *value)),
                        "{x:?} {y:?} {found:?}"
                    );
                    for end in [found.lo, found.hi] {
                        assert!(
                            end == 0.0 || end.abs() > 0.9 * TINY,
                            "{x:?} {y:?} {found:?}"
                        );
                    }
                }
            }
        }
        // Exact products that are too small for a number are inside, too.
        let small = Interval::point(1e-300);
        assert!((small * small).hi > 0.0 && (small * -small).lo < 0.0);
        assert!(zero.lo < 0.0 && zero.hi > 0.0);
    }

    #[test]
    fn interval_angles_enclose_exact_values() {
        let right = Interval::radians(1 << 30);
        assert!(right.lo < core::f64::consts::FRAC_PI_2 && right.hi > core::f64::consts::FRAC_PI_2);
        let [cos, sin] = Interval::cos_sin_deg(60.0);
        assert!(holds(cos, 0.5) && sin.hi - sin.lo < 1e-14);
        assert_eq!(
            Interval::cos_sin_deg(-90.0),
            [Interval::point(0.0), Interval::point(-1.0)]
        );
        assert_eq!(Interval::ENTIRE * Interval::point(0.0), Interval::ENTIRE);
    }
}
