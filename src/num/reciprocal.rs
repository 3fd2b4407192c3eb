//! Ratios with a common divisor, without 64-bit divisions.

use core::num::NonZeroU32;

/// `1 / z` of a positive z, for multiplication. For telemetry, where an approximate ratio is enough and a
/// 64-bit division is too expensive (hundreds of instructions on a core without one).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reciprocal {
    /// `2^62 / (z 2^shift)`, 31 bits.
    mantissa: i32,
    /// At most 31.
    shift: u32,
}

impl Reciprocal {
    /// Returns the reciprocal, or `None` for zero.
    #[must_use]
    #[inline(always)]
    pub fn of(z: u32) -> Option<Self> {
        let shift = z.leading_zeros();
        let z = z.checked_shl(shift)?;
        // 2^48 / z to 16 bits, and one Newton step.
        let first = u32::MAX / NonZeroU32::new(z >> 16)?;
        let rest = (1i64 << 48).wrapping_sub(i64::from(z).wrapping_mul(i64::from(first)));
        // first < 2^17, |rest| < 2^34.
        let step = super::product((rest >> 4) as i32, first as i32) >> 30;
        let mantissa = i64::from(first).wrapping_shl(14).wrapping_add(step);
        Some(Self {
            // A power of two gives 2^31.
            mantissa: mantissa.min(i64::from(i32::MAX)) as i32,
            shift,
        })
    }

    /// Returns `part / z`, unit 2^-BITS, BITS at most 30, with an error of at most 2^-29 of its value and
    /// one unit. Saturates.
    #[must_use]
    #[inline(always)]
    pub const fn ratio<const BITS: u32>(self, part: i32) -> i32 {
        const { assert!(BITS <= 30, "a ratio has at most 30 fraction bits") };
        let by = (62u32.wrapping_sub(BITS)).wrapping_sub(self.shift);
        let ratio = super::product(part, self.mantissa).wrapping_shr(by);
        if ratio > i32::MAX as i64 {
            i32::MAX
        } else if ratio < i32::MIN as i64 {
            i32::MIN
        } else {
            ratio as i32
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns the error of a ratio divided by the allowed error.
    fn error<const BITS: u32>(z: u32, part: i32) -> f64 {
        let got = i64::from(Reciprocal::of(z).unwrap().ratio::<BITS>(part));
        let unit = f64::from(1u32 << BITS);
        let exact = f64::from(part) / f64::from(z) * unit;
        let exact = exact.clamp(f64::from(i32::MIN), f64::from(i32::MAX));
        (got as f64 - exact).abs() / (exact.abs() / 536_870_912.0 + 1.0)
    }

    proptest! {
        #[test]
        fn ratios_are_near(z in 1..=u32::MAX, by in 0..32u32, part in any::<i32>(), down in 0..32u32) {
            let (z, part) = ((z >> by).max(1), part >> down);
            prop_assert!(error::<30>(z, part) <= 1.0);
            prop_assert!(error::<24>(z, part) <= 1.0);
            prop_assert!(error::<0>(z, part) <= 1.0);
        }
    }

    /// The Newton step is least accurate where 16 bits describe the divisor worst.
    #[test]
    fn the_bound_holds_at_the_ends() {
        let mut worst = 0.0f64;
        for top in 0x8000..=0xffffu32 {
            for low in [0, 1, 0x7fff, 0xffff] {
                worst = worst.max(error::<30>(top << 16 | low, i32::MIN));
                worst = worst.max(error::<30>((top << 16 | low) >> 1, i32::MAX));
            }
        }
        assert!((0.5..=1.0).contains(&worst), "{worst}");
        for z in [1, 2, 1 << 30, 1 << 31, u32::MAX] {
            for part in [i32::MIN, -1, 0, 1, i32::MAX] {
                assert!(error::<30>(z, part) <= 1.0, "{z} {part}");
            }
        }
        assert_eq!(Reciprocal::of(0), None);
    }
}
