//! Quotients by one divisor, without a division of 64 bits.

use core::num::NonZeroU32;

/// `1 / z` of a positive z, to be multiplied with: for telemetry, where a quotient near the true one will
/// do and a division of 64 bits (some 300 instructions where the core has none) is too dear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reciprocal {
    /// `2^63 / (z 2^shift)`.
    mantissa: u32,
    shift: u32,
}

impl Reciprocal {
    /// `None` for zero.
    #[must_use]
    pub fn of(z: u32) -> Option<Self> {
        let shift = z.leading_zeros();
        let z = z.checked_shl(shift)?;
        // 2^48 / z to 16 bits, and one step of Newton's rule.
        let first = u32::MAX / NonZeroU32::new(z >> 16)?;
        let rest = (1i64 << 48).wrapping_sub(i64::from(z).wrapping_mul(i64::from(first)));
        // |rest| < 2^34, first <= 2^17.
        let step = (rest >> 4).wrapping_mul(i64::from(first)) >> 29;
        let mantissa = i64::from(first).wrapping_shl(15).wrapping_add(step);
        Some(Self {
            mantissa: u32::try_from(mantissa).unwrap_or(u32::MAX),
            shift,
        })
    }

    /// `dividend / z`: off by at most 2^-29 of itself, and one unit. Saturates.
    #[must_use]
    pub fn times(self, dividend: i64) -> i64 {
        let magnitude = dividend.unsigned_abs();
        let zeros = magnitude.leading_zeros();
        let top = magnitude.checked_shl(zeros).unwrap_or(0) >> 32;
        // top 2^(32 - zeros) mantissa 2^(shift - 63).
        let by = zeros.wrapping_add(31).wrapping_sub(self.shift);
        let product = top.wrapping_mul(u64::from(self.mantissa));
        let quotient = product.checked_shr(by).unwrap_or(0);
        let quotient = i64::try_from(quotient).unwrap_or(i64::MAX);
        if dividend < 0 {
            quotient.wrapping_neg()
        } else {
            quotient
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn error(z: u32, dividend: i64) -> f64 {
        let got = i128::from(Reciprocal::of(z).unwrap().times(dividend));
        let (z, dividend) = (i128::from(z), i128::from(dividend));
        // |got z - dividend| against 2^-29 of the dividend, and z.
        let off = (got * z - dividend).unsigned_abs();
        let allowed = (dividend.unsigned_abs() >> 29) + z.unsigned_abs();
        off as f64 / allowed as f64
    }

    proptest! {
        #[test]
        fn quotients_are_near(z in 1..=u32::MAX, by in 0..32u32, dividend in any::<i64>(), down in 0..64u32) {
            let z = (z >> by).max(1);
            prop_assert!(error(z, dividend >> down) <= 1.0);
        }
    }

    /// The step of Newton's rule is at its worst where 16 bits say least of the divisor.
    #[test]
    fn the_bound_holds_at_the_ends() {
        let mut worst = 0.0f64;
        for top in 0x8000..=0xffffu32 {
            for low in [0, 1, 0x7fff, 0xffff] {
                worst = worst.max(error(top << 16 | low, i64::MAX));
            }
        }
        assert!((0.6..=1.0).contains(&worst), "{worst}");
        for (z, dividend) in [
            (1, i64::MAX),
            (1, i64::MIN),
            (u32::MAX, i64::MIN),
            (1 << 31, 0),
        ] {
            assert!(error(z, dividend) <= 1.0, "{z} {dividend}");
        }
        assert_eq!(Reciprocal::of(0), None);
        let exact = [(1u32, 7i64), (1 << 10, -(1 << 30)), (1 << 31, 1 << 40)];
        for (z, dividend) in exact {
            let quotient = Reciprocal::of(z).unwrap().times(dividend);
            assert!((quotient - dividend / i64::from(z)).abs() <= 1);
        }
    }
}
