//! The leading bits of a float.

/// The 32 leading bits of a finite `f64`: its magnitude is at least `bits * 2^exponent`, and below
/// `(bits + 1) * 2^exponent`.
///
/// For numbers that are rounded to 31 bits or less: their rounding to the nearest is that of the whole float, because
/// halves are rounded away from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Leading {
    /// The sign bit.
    pub negative: bool,
    /// Zero, or at least 2^31.
    pub bits: u32,
    /// The power of two, in `[-1105, 992]`.
    pub exponent: i32,
}

impl Leading {
    /// Decodes a float. For infinities and NaN the result has no meaning.
    #[must_use]
    #[cfg_attr(small_code, inline(never))]
    #[cfg_attr(not(small_code), inline)]
    pub const fn of(value: f64) -> Self {
        let bits = value.to_bits();
        let high = (bits >> 32) as u32;
        let biased = high >> 20 & 0x7ff;
        let negative = high >> 31 == 1;
        if biased == 0 {
            return Self::of_small(negative, bits & 0x000f_ffff_ffff_ffff);
        }
        Self {
            negative,
            bits: high << 11 | bits as u32 >> 21 | 1 << 31,
            exponent: (biased as i32).wrapping_sub(1054),
        }
    }

    /// Decodes zero or a number below 2^-1022.
    #[cold]
    const fn of_small(negative: bool, fraction: u64) -> Self {
        // Of zero: 64.
        let up = fraction.leading_zeros() & 63;
        Self {
            negative,
            bits: (fraction.wrapping_shl(up) >> 32) as u32,
            exponent: (-1042i32).wrapping_sub(up as i32),
        }
    }

    /// Returns `true` if the number is above zero.
    #[must_use]
    pub const fn is_positive(self) -> bool {
        !self.negative && self.bits != 0
    }

    /// Returns the magnitude times `2^power`, to the nearest, halves up, or `None` if it may be 2^30 or more.
    #[must_use]
    #[inline]
    pub const fn nearest(self, power: i32) -> Option<u32> {
        let down = self.exponent.wrapping_add(power).wrapping_neg();
        if self.bits == 0 || down > 32 {
            return Some(0);
        }
        if down < 2 {
            return None;
        }
        // At most 31.
        let half = self.bits.wrapping_shr((down as u32).wrapping_sub(1));
        Some(half.wrapping_add(1) >> 1)
    }
}

#[cfg(test)]
mod tests {
    use super::Leading;
    use crate::num::{Float, Rounding};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(20_000, 40)))]
        #[test]
        fn leading_bits_are_those_of_the_float(bits in any::<u64>(), small: bool, about in 0..40i32) {
            let bits = if small { bits >> 12 | bits & (1 << 63) } else { bits };
            let value = f64::from_bits(bits);
            if let Some(float) = Float::of(value) {
                let found = Leading::of(value);
                prop_assert_eq!(found.negative, float.negative);
                if float.is_zero() {
                    prop_assert_eq!(found.bits, 0);
                } else {
                    prop_assert!(found.bits >> 31 == 1);
                    prop_assert_eq!(float.top_bit(), found.exponent + 31);
                    let down = found.exponent - float.exponent;
                    let whole = if down >= 0 { float.mantissa >> down } else { float.mantissa << -down };
                    prop_assert_eq!(whole, u64::from(found.bits));
                    prop_assert_eq!(found.is_positive(), float.is_positive());
                }
                let power = 5 - about - found.exponent;
                let exact = float.scaled(1, -power, Rounding::Nearest).map(i64::unsigned_abs);
                match found.nearest(power) {
                    Some(nearest) => prop_assert_eq!(Some(u64::from(nearest)), exact),
                    None => prop_assert!(exact.is_none_or(|exact| exact >= 1 << 30)),
                }
            }
        }
    }

    #[test]
    fn the_smallest_floats_have_leading_bits() {
        let least = Leading::of(5e-324);
        assert_eq!((least.bits, least.exponent), (1 << 31, -1105));
        let most = Leading::of(f64::MAX);
        assert_eq!((most.bits, most.exponent), (u32::MAX, 992));
        assert_eq!(Leading::of(0.0).bits, 0);
        assert_eq!(Leading::of(-0.0).nearest(2000), Some(0));
        assert_eq!(Leading::of(f64::MAX).nearest(0), None);
        // A half, and the last float below it.
        assert_eq!(Leading::of(0.5).nearest(0), Some(1));
        assert_eq!(Leading::of(0.5f64.next_down()).nearest(0), Some(0));
    }
}
