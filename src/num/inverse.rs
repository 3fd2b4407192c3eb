//! `1 / d` of a positive d, to 27 bits, without a division.
//!
//! For quotients whose remainder is computed anyway, so that no promise depends on this error, and for bounds that add
//! it.

use super::wide;

/// The inverse of a positive number.
///
/// The divisor is shifted left to D in `[2^31, 2^32)`. Newton's iteration for `2^63 / D` approaches from below, and every
/// rounding is downwards, so the inverse is never too large.
///
/// | relative error of the inverse | at most |
/// |---|---|
/// | a line over the interval | 1/17 |
/// | first step: the square, and 16-bit roundings | 3.6e-3 |
/// | second step: 1.3e-5, and roundings of D (up), the factor and the product: 2^-15 each | 1.05e-4 |
/// | third step, to the second order: 1.2e-12, two roundings of 2^-29, one of 2^-31 | 2^-27 |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inverse {
    /// In `[2^31 - 16, 2^32)`.
    mantissa: u32,
    /// The shift from d to D: at most 31.
    up: u32,
}

impl Inverse {
    /// Returns the inverse; meaningless for zero.
    #[must_use]
    pub const fn of(d: u32) -> Self {
        let up = d.leading_zeros() & 31;
        let shifted = d.wrapping_shl(up);
        let short = (shifted >> 16).wrapping_add(1);
        // 48/17 - 32/17 D, unit 2^-15.
        let line = 92_521u32.wrapping_sub(short.wrapping_mul(61_681) >> 16);
        let second = closer(closer(line, short), short);
        // 1 - z D, below 2^34 in units of 2^-47.
        let rest = (1u64 << 47).wrapping_sub(wide(shifted, second)) >> 18;
        // Unit 2^-29, below 2^16.
        let rest = rest as u32;
        let rest = rest.wrapping_add(rest.wrapping_mul(rest) >> 29);
        Self {
            mantissa: second
                .wrapping_shl(16)
                .wrapping_add(second.wrapping_mul(rest) >> 13),
            up,
        }
    }

    /// Returns `n 2^BITS / d`: never above it, and smaller by at most 2^-27 of it and 2. Returns the largest `u64` if n has
    /// more than 32 bits and d is below `2^BITS`: the quotient is then 2^32 or more. n is below 2^62.
    #[must_use]
    #[inline]
    pub const fn times<const BITS: u32>(self, n: u64) -> u64 {
        const { assert!(BITS <= 14, "the shift is not below zero") };
        let high = (n >> 32) as u32;
        let low = wide(n as u32, self.mantissa);
        let down = self.up.wrapping_add(BITS);
        if high == 0 {
            return low.wrapping_shr(63u32.wrapping_sub(down));
        }
        if down > 31 {
            return u64::MAX;
        }
        wide(high, self.mantissa)
            .wrapping_add(low >> 32)
            .wrapping_shr(31u32.wrapping_sub(down))
    }
}

/// Returns a closer `1 / D`, unit 2^-15: `z (2 - z D)`.
const fn closer(z: u32, d: u32) -> u32 {
    let factor = z.wrapping_mul(d).wrapping_neg();
    z.wrapping_mul(factor >> 16) >> 15
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The mantissa is below `2^63 / D`, by at most 2^-27 of it.
    fn check(d: u32) {
        let Inverse { mantissa, up } = Inverse::of(d);
        let product = u128::from(mantissa) * (u128::from(d) << up);
        assert!(
            ((1 << 63) - (1 << 36)..=1 << 63).contains(&product),
            "{d}: {mantissa}"
        );
    }

    #[test]
    fn inverses_are_below_and_near_for_every_leading_half_word() {
        for short in (1u32 << 15..1 << 16).step_by(crate::test_iterations(1, 1021) as usize) {
            for low in [0, 1, 0x7fff, 0x8000, 0xffff] {
                check(short << 16 | low);
            }
        }
        for d in (1..5000).chain((0..32).flat_map(|k| [1 << k, (1u32 << k).wrapping_sub(1).max(1)]))
        {
            check(d);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(20_000, 40)))]
        #[test]
        fn quotients_are_below_and_near(d in 1..=u32::MAX, by in 0..32u32, n in 0..1u64 << 62, down in 0..62u32) {
            let (d, n) = ((d >> by).max(1), n >> down);
            check(d);
            let inverse = Inverse::of(d);
            for (got, bits) in [(inverse.times::<0>(n), 0), (inverse.times::<1>(n), 1), (inverse.times::<14>(n), 14)] {
                let exact = (u128::from(n) << bits) / u128::from(d);
                if got == u64::MAX {
                    prop_assert!(exact >= 1 << 32, "{n} {d}");
                } else {
                    let got = u128::from(got);
                    prop_assert!(got <= exact && got + (exact >> 27) + 2 >= exact, "{n} {d} {bits}: {got} {exact}");
                }
            }
        }
    }
}
