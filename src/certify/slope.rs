//! Values with their derivative by yaw, for bounds over a yaw interval with a second-order error.

use super::Interval;
use crate::shape::Scalar;
use core::ops::{Add, Mul, Neg, Sub};

/// An enclosure of an expression's values over a yaw interval, and of its derivative by the yaw.
#[derive(Clone, Copy, Debug)]
pub struct Slope {
    /// Values.
    pub value: Interval,
    /// Derivatives by the yaw, per radian.
    pub by_yaw: Interval,
}

impl Add for Slope {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            by_yaw: self.by_yaw + other.by_yaw,
        }
    }
}

impl Sub for Slope {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            by_yaw: self.by_yaw - other.by_yaw,
        }
    }
}

impl Neg for Slope {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            by_yaw: -self.by_yaw,
        }
    }
}

impl Mul for Slope {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            by_yaw: self.by_yaw * other.value + self.value * other.by_yaw,
        }
    }
}

impl Scalar for Slope {
    fn exact(value: f64) -> Self {
        Self::constant(Interval::point(value))
    }

    fn cos_sin_deg(degrees: f64) -> [Self; 2] {
        Interval::cos_sin_deg(degrees).map(Self::constant)
    }

    fn root(self) -> Self {
        let value = self.value.root();
        Self {
            value,
            by_yaw: self.by_yaw * (value + value).reciprocal(),
        }
    }
}

/// Encloses a value over a range of yaws, from its enclosure there and the mean value form about
/// the middle.
#[must_use]
pub fn sharp(over: Slope, middle: Interval, offset: Interval) -> Interval {
    let mean = middle + over.by_yaw * offset;
    Interval {
        lo: over.value.lo.max(mean.lo),
        hi: over.value.hi.min(mean.hi),
    }
}

impl Slope {
    /// Creates a number that does not depend on the yaw.
    #[must_use]
    pub const fn constant(value: Interval) -> Self {
        Self {
            value,
            by_yaw: Interval::point(0.0),
        }
    }

    /// Encloses cosine and sine of the yaw over an interval.
    #[must_use]
    pub fn cos_sin_of(yaw: Interval) -> [Self; 2] {
        let [cos, sin] = yaw.cos_sin();
        [
            Self {
                value: cos,
                by_yaw: -sin,
            },
            Self {
                value: sin,
                by_yaw: cos,
            },
        ]
    }
}
