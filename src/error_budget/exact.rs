//! Numbers with 256 bits after the point.

use core::ops::{Add, Mul, Neg, Sub};
use num_bigint::BigInt;
use std::sync::OnceLock;

/// Bits after the point.
const BITS: u32 = 256;

/// A number in units of 2^-256. Sums are exact; products, quotients, roots and functions are within some units.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Exact(BigInt);

impl Exact {
    /// Returns `value / 2^down`, exactly if down is at most 256.
    pub fn dyadic(value: impl Into<BigInt>, down: u32) -> Self {
        Self((value.into() << BITS) >> down)
    }

    pub fn int(value: impl Into<BigInt>) -> Self {
        Self::dyadic(value, 0)
    }

    /// Returns a finite float, exactly if it is a multiple of 2^-256.
    pub fn float(value: f64) -> Self {
        let bits = value.to_bits();
        let exponent = (bits >> 52 & 0x7ff) as i32;
        let whole = if exponent == 0 { 0 } else { 1u64 << 52 };
        let mantissa = BigInt::from(bits & ((1 << 52) - 1) | whole);
        let up = exponent.max(1) - 1075 + BITS as i32;
        let scaled = if up < 0 {
            mantissa >> -up
        } else {
            mantissa << up
        };
        Self(if value < 0.0 { -scaled } else { scaled })
    }

    pub fn div(&self, by: &Self) -> Self {
        Self((&self.0 << BITS) / &by.0)
    }

    pub fn sqrt(&self) -> Self {
        Self((&self.0 << BITS).sqrt())
    }

    pub fn abs(&self) -> Self {
        if *self < Self::int(0) {
            -self
        } else {
            self.clone()
        }
    }

    /// Returns the nearest float, within 2^-50 of it.
    pub fn to_f64(&self) -> f64 {
        let top = self.0.bits().saturating_sub(62);
        let head = i64::try_from(&self.0 >> top).expect("63 bits");
        head as f64 * 2f64.powi(top as i32 - BITS as i32)
    }

    pub fn pi() -> Self {
        static PI: OnceLock<Exact> = OnceLock::new();
        // Machin: 16 atan(1/5) - 4 atan(1/239).
        let atan_of = |by: i64| {
            let mut power = Self::int(1).0 / by;
            let (mut sum, mut k) = (BigInt::from(0), 0i64);
            while power != BigInt::from(0) {
                let term = &power / (2 * k + 1);
                sum += if k % 2 == 0 { term } else { -term };
                power /= by * by;
                k += 1;
            }
            sum
        };
        PI.get_or_init(|| Self(atan_of(5) * 16 - atan_of(239) * 4))
            .clone()
    }

    /// Returns cosine and sine of an angle in radians.
    pub fn cos_sin(&self) -> [Self; 2] {
        let turn = &Self::pi() + &Self::pi();
        // The angle within a turn, a 2^10th of it, and doubled again.
        let small = Self((&self.0 % &turn.0) >> 10);
        let square = &small * &small;
        let (mut cos, mut sin) = (Self::int(1), small.clone());
        let (mut of_cos, mut of_sin) = (Self::int(1), small);
        for k in 1..40i64 {
            of_cos = Self((&(-&(&of_cos * &square)).0) / ((2 * k - 1) * 2 * k));
            of_sin = Self((&(-&(&of_sin * &square)).0) / (2 * k * (2 * k + 1)));
            cos = &cos + &of_cos;
            sin = &sin + &of_sin;
            if of_sin == Self::int(0) {
                break;
            }
        }
        for _ in 0..10 {
            let doubled = &cos * &sin;
            cos = &(&cos * &cos) - &(&sin * &sin);
            sin = &doubled + &doubled;
        }
        [cos, sin]
    }
}

impl Add for &Exact {
    type Output = Exact;
    fn add(self, other: Self) -> Exact {
        Exact(&self.0 + &other.0)
    }
}

impl Sub for &Exact {
    type Output = Exact;
    fn sub(self, other: Self) -> Exact {
        Exact(&self.0 - &other.0)
    }
}

impl Mul for &Exact {
    type Output = Exact;
    fn mul(self, other: Self) -> Exact {
        Exact((&self.0 * &other.0) >> BITS)
    }
}

impl Neg for &Exact {
    type Output = Exact;
    fn neg(self) -> Exact {
        Exact(-&self.0)
    }
}

/// The functions agree with each other far beyond a float, and with floats.
#[test]
fn functions_keep_200_bits() {
    let tiny = Exact::dyadic(1, 236);
    for angle in [-7.5, -0.3, 0.0, 1e-9, 2.0, 3.0, 100.0] {
        let [cos, sin] = Exact::float(angle).cos_sin();
        let one = &(&cos * &cos) + &(&sin * &sin);
        assert!((&one - &Exact::int(1)).abs() < tiny);
        assert!((cos.to_f64() - angle.cos()).abs() < 1e-14);
        assert!((sin.to_f64() - angle.sin()).abs() < 1e-14);
    }
    let half = &Exact::pi() - &Exact::dyadic(1, 0);
    assert!((half.to_f64() - core::f64::consts::PI + 1.0).abs() < 1e-15);
    let [cos, sin] = Exact::pi().cos_sin();
    assert!((&cos + &Exact::int(1)).abs() < tiny && sin.abs() < tiny);
    let root = Exact::float(2.0).sqrt();
    assert!((&(&root * &root) - &Exact::int(2)).abs() < tiny);
    assert_eq!(Exact::float(-0.1).to_f64(), -0.1);
    let third = Exact::int(1).div(&Exact::int(3));
    assert!((&(&third * &Exact::int(3)) - &Exact::int(1)).abs() < tiny);
}
