//! Reads numbers from bytes and floats, only for the second evaluation.

use crate::num;

/// Returns a little-endian number at an offset, or `None` beyond the end.
pub(super) fn word16(bytes: &[u8], at: usize) -> Option<u16> {
    let (two, _) = bytes.split_at_checked(at)?.1.split_first_chunk()?;
    Some(u16::from_le_bytes(*two))
}

/// Returns a little-endian number at an offset, or `None` beyond the end.
pub(super) fn word32(bytes: &[u8], at: usize) -> Option<u32> {
    let (four, _) = bytes.split_at_checked(at)?.1.split_first_chunk()?;
    Some(u32::from_le_bytes(*four))
}

/// Returns `value / by`, rounded towards zero, or 0 if `by` is 0.
#[cfg_attr(small_code, inline(never))]
pub(super) fn quotient(value: i64, by: u64) -> i64 {
    let magnitude = num::quotient(value.unsigned_abs(), by).unwrap_or(0) as i64;
    if value < 0 {
        magnitude.wrapping_neg()
    } else {
        magnitude
    }
}

/// Returns the root of a word, rounded down: bit by bit.
pub(super) const fn root32(value: u32) -> u32 {
    let (mut rest, mut root, mut bit) = (value, 0u32, 1u32 << 30);
    while bit != 0 {
        let next = root.wrapping_add(bit);
        root >>= 1;
        if rest >= next {
            rest = rest.wrapping_sub(next);
            root = root.wrapping_add(bit);
        }
        bit >>= 2;
    }
    root
}

/// Returns the root, rounded down: its upper half is the root of the upper word, its lower half a quotient, which is at most 1 too large
/// (Zimmermann 1999).
#[inline(never)]
pub(super) fn root(value: u64) -> u64 {
    let up = value.leading_zeros() & 62;
    let shifted = value.wrapping_shl(up);
    let high = (shifted >> 32) as u32;
    let upper = root32(high);
    // At most twice the upper half: below 2^17.
    let rest = high.wrapping_sub(upper.wrapping_mul(upper));
    let both = rest.wrapping_shl(15) | (shifted >> 17) as u32 & 0x7fff;
    let lower = both.checked_div(upper).unwrap_or(0);
    // Only the largest numbers saturate: their root is the largest word.
    let root = u64::from((upper << 16).saturating_add(lower));
    let is_above = root.wrapping_mul(root) > shifted;
    root.wrapping_sub(u64::from(is_above)).wrapping_shr(up >> 1)
}

/// Returns the product of two numbers. Exact.
#[inline(always)]
pub(super) const fn wide(a: i32, b: i32) -> i64 {
    if cfg!(narrow_products) {
        by_halves(a, b)
    } else {
        (a as i64).wrapping_mul(b as i64)
    }
}

/// Returns the product of a number of 16 bits and another. Exact.
#[inline(always)]
pub(super) const fn short_by(a: i32, b: i32) -> i64 {
    if cfg!(narrow_products) {
        by_two_halves(a, b)
    } else {
        wide(a, b)
    }
}

/// Returns the product of a number between -2^15 and 2^15 and another.
#[inline(always)]
const fn by_two_halves(a: i32, b: i32) -> i64 {
    let most = a.wrapping_mul(b >> 16);
    let least = a.wrapping_mul(b & 0xffff);
    ((most as i64) << 16).wrapping_add(least as i64)
}

/// Returns the product of two numbers whose low halves have no sign, for a core that multiplies to 32 bits.
#[inline(never)]
const fn by_halves(a: i32, b: i32) -> i64 {
    let (above, below) = (a >> 16, a & 0xffff);
    let (left, right) = (b >> 16, b & 0xffff);
    let least = (below as u32).wrapping_mul(right as u32);
    // Each between -2^31 and 2^31 with the half word that is added.
    let inner = above.wrapping_mul(right).wrapping_add((least >> 16) as i32);
    let outer = below.wrapping_mul(left).wrapping_add(inner & 0xffff);
    let most = above
        .wrapping_mul(left)
        .wrapping_add(inner >> 16)
        .wrapping_add(outer >> 16);
    let low = (outer as u32) << 16 | least & 0xffff;
    ((most as u32 as u64) << 32 | low as u64) as i64
}

/// The exponent of an infinity and of NaN.
const NO_NUMBER: u32 = 0x7ff;

/// Returns the biased exponent.
const fn biased(value: f64) -> u32 {
    (value.to_bits() >> 52) as u32 & NO_NUMBER
}

/// Returns `value * factor * 2^power`, rounded towards zero, for a factor whose top bit is bit 63. A value
/// below 2^-1022 counts as zero. `None` for NaN and infinities, and if the result is 2^62 or more.
#[inline(never)]
pub(super) fn fixed(value: f64, factor: u64, power: i32) -> Option<i64> {
    let biased = biased(value);
    if biased == NO_NUMBER {
        return None;
    }
    if biased == 0 {
        return Some(0);
    }
    // The mantissa's unit is 2^(biased - 1086).
    let mantissa = value.to_bits() << 11 | 1 << 63;
    let product = (u128::from(mantissa).wrapping_mul(u128::from(factor)) >> 64) as u64;
    let down = 1022i32.wrapping_sub(biased as i32).wrapping_sub(power);
    if down < 2 {
        return None;
    }
    let magnitude = product.checked_shr(down.unsigned_abs()).unwrap_or(0) as i64;
    Some(if value.is_sign_negative() {
        magnitude.wrapping_neg()
    } else {
        magnitude
    })
}

/// Returns `true` if a float is not infinite and not NaN.
pub(super) const fn is_finite(value: f64) -> bool {
    biased(value) != NO_NUMBER
}

/// Returns `true` if a float is a number above zero.
pub(super) fn is_above_zero(value: f64) -> bool {
    let bits = value.to_bits();
    bits != 0 && bits < 0x7ff0_0000_0000_0000
}

/// Returns `true` if the magnitude of a float is below `2^power`, for a power above -1022.
pub(super) fn is_below(value: f64, power: i32) -> bool {
    (biased(value) as i32).wrapping_sub(1022) <= power
}

/// A number of 31 bits: `mantissa * 2^exponent`.
#[derive(Clone, Copy)]
pub(super) struct Short {
    mantissa: i32,
    exponent: i32,
}

impl Short {
    /// Converts a finite float, rounded towards zero: smaller by at most 2^-30 of its value.
    pub fn of(value: f64) -> Self {
        let biased = biased(value);
        let (mantissa, exponent) = if biased == 0 {
            let whole = value.to_bits() << 12;
            let up = whole.leading_zeros();
            let exponent = (-1053i32).wrapping_sub(up as i32);
            ((whole.wrapping_shl(up) >> 33) as i32, exponent)
        } else {
            let mantissa = (value.to_bits() >> 22) as u32 & 0x3fff_ffff | 1 << 30;
            (mantissa as i32, (biased as i32).wrapping_sub(1053))
        };
        Self {
            mantissa: if value.is_sign_negative() {
                mantissa.wrapping_neg()
            } else {
                mantissa
            },
            exponent,
        }
    }

    /// Returns the least b with `|value| < 2^b`; for zero a number far below every other.
    #[cfg_attr(small_code, inline(never))]
    pub const fn top(self) -> i32 {
        if self.mantissa == 0 {
            -(1 << 20)
        } else {
            self.exponent
                .wrapping_add(32)
                .wrapping_sub(self.mantissa.unsigned_abs().leading_zeros() as i32)
        }
    }

    /// Returns the product with a weight, rounded down: smaller by at most 2^-29 of its value.
    #[inline(always)]
    pub const fn times(self, weight: Weight) -> Self {
        let product = wide(self.mantissa, weight.mantissa);
        Self {
            mantissa: (product >> 31) as i32,
            exponent: self.exponent.wrapping_add(31).wrapping_add(weight.exponent),
        }
    }

    /// Returns `value * 2^power`, rounded down. `None` if the result is 2^30 or more.
    #[cfg_attr(small_code, inline(never))]
    #[cfg_attr(not(small_code), inline(always))]
    pub fn at(self, power: i32) -> Option<i32> {
        let by = self.exponent.wrapping_add(power);
        let Self { mantissa, .. } = self;
        if by < 0 {
            return Some(mantissa.wrapping_shr(by.unsigned_abs().min(31)));
        }
        let room = mantissa.unsigned_abs().leading_zeros().saturating_sub(2);
        (by.unsigned_abs() <= room || mantissa == 0)
            .then_some(mantissa.wrapping_shl(by.unsigned_abs()))
    }

    #[cfg(test)]
    pub fn value(self) -> f64 {
        f64::from(self.mantissa) * 2f64.powi(self.exponent)
    }

    /// Returns a number that is not below zero as an integer, rounded down. Returns the largest `u64` if
    /// the value is too large.
    pub fn whole(self) -> u64 {
        let magnitude = u64::from(self.mantissa.unsigned_abs());
        let by = self.exponent.unsigned_abs();
        if self.exponent < 0 {
            magnitude.checked_shr(by).unwrap_or(0)
        } else if by <= magnitude.leading_zeros() || magnitude == 0 {
            magnitude.checked_shl(by).unwrap_or(0)
        } else {
            u64::MAX
        }
    }
}

/// A factor `mantissa * 2^exponent` of 31 bits, rounded down.
#[derive(Clone, Copy)]
pub(super) struct Weight {
    mantissa: i32,
    exponent: i32,
}

impl Weight {
    /// Returns `value * 2^exponent`.
    #[cfg_attr(small_code, inline(never))]
    pub const fn of(value: u64, exponent: i32) -> Self {
        let up = value.leading_zeros();
        Self {
            mantissa: (value.wrapping_shl(up) >> 33) as i32,
            exponent: exponent.wrapping_add(33).wrapping_sub(up as i32),
        }
    }

    /// Returns the product with `factor * 2^exponent`, the factor's top bit at bit 30: smaller by at most
    /// 2^-29 of its value.
    pub const fn times(self, (factor, exponent): (i32, i32)) -> Self {
        let product = wide(self.mantissa, factor);
        Self {
            mantissa: (product >> 31) as i32,
            exponent: self.exponent.wrapping_add(exponent).wrapping_add(31),
        }
    }

    /// Returns the product with `2^power`.
    pub const fn scaled(self, power: i32) -> Self {
        Self {
            mantissa: self.mantissa,
            exponent: self.exponent.wrapping_add(power),
        }
    }

    #[cfg(test)]
    pub fn value(self) -> f64 {
        f64::from(self.mantissa) * 2f64.powi(self.exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::{by_halves, by_two_halves, root, root32, short_by, wide};
    use proptest::prelude::*;

    fn check_root(value: u64) {
        assert_eq!(root(value), value.isqrt(), "{value}");
        let word = value as u32;
        assert_eq!(root32(word), word.isqrt(), "{word}");
    }

    #[test]
    fn roots_are_rounded_down_about_squares_and_at_the_ends() {
        let step = crate::test_iterations(7, 4099) as usize;
        for low in (0..=u64::from(u16::MAX)).step_by(step) {
            for high in [0, 1, 0x7fff, 0x8000, 0xb504, 0xb505, 0xfffe, 0xffff] {
                for number in [high << 16 | low, low << 16 | high] {
                    for near in -2i64..=2 {
                        check_root((number * number).wrapping_add_signed(near));
                        check_root((number * (number + 2)).wrapping_add_signed(near));
                    }
                }
            }
        }
        for value in (0..5000).chain((0..64).map(|k| 1 << k)) {
            check_root(value);
            check_root(value.wrapping_neg());
        }
    }

    fn check(a: i32, b: i32) {
        let exact = i64::from(a) * i64::from(b);
        assert_eq!(by_halves(a, b), exact);
        assert_eq!(wide(a, b), exact);
        let short = a >> 16;
        for short in [short, short + 1, i32::from(a as i16)] {
            let exact = i64::from(short) * i64::from(b);
            assert_eq!(by_two_halves(short, b), exact);
            assert_eq!(short_by(short, b), exact);
        }
    }

    #[test]
    fn products_of_halves_are_exact_at_the_ends() {
        let ends = [
            0,
            1,
            -1,
            0x7fff,
            0x8000,
            0xffff,
            0x1_0000,
            -0x8000,
            -0x1_0000,
            0x7fff_ffff,
            -0x7fff_ffff,
            0x7fff_0000,
            i32::MIN,
            0x7fff_8000,
            -0x7fff_8000,
        ];
        for a in ends {
            for b in ends {
                check(a, b);
            }
        }
    }

    proptest! {
        #[test]
        fn roots_are_rounded_down(value in any::<u64>(), less in 0..64u32) {
            check_root(value >> less);
        }

        #[test]
        fn products_of_halves_are_exact(a in any::<i32>(), b in any::<i32>(), less in 0..32u32) {
            check(a, b);
            check(a >> less, b);
        }
    }
}
