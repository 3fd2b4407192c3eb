//! Numbers that round outwards: micrometres, binary angles, decoded floats, roots and quotients with a
//! named rounding direction.
//!
//! | quantity | type | unit | range |
//! |---|---|---|---|
//! | length | `i32`, `i64`, names end in `_um` | 1 micrometre | tables reach +-134 m, estimates +-2000 m |
//! | heading | [`BinaryAngle`] | 2^-32 turn (1.46e-9 rad) | wraps without cost |
//! | yaw extent | `i32`, `i64`, names end in `_q24` | 2^-24 turn (3.7e-7 rad) | +-64 turns |
//!
//! A micrometre makes decimal metres exact (2 cm is 20,000), and a binary angle makes wrapping exact. The
//! two units of a pose-set's extents (1 um, 0.37 urad) have similar weight, so a rounding in one costs no
//! more than a rounding in the other.
//!
//! There is no floating-point operation: an `f64` is decoded from its bits ([`Float`]), so every target
//! computes the same integers.
//!
//! ```
//! use posegate::num::{BinaryAngle, Float, Rounding, UM_PER_M};
//!
//! // A length from a message, to whole micrometres: rounded up if it widens a set.
//! let metres = Float::of(0.1).expect("a finite number");
//! assert_eq!(metres.scaled(UM_PER_M.into(), 0, Rounding::AwayFromZero), Some(100_001));
//! assert_eq!(metres.scaled(UM_PER_M.into(), 0, Rounding::Nearest), Some(100_000));
//!
//! // A heading that has turned ten times is the same heading, without a remainder of floats.
//! let yaw = |rad: f64| BinaryAngle::from_radians(rad).expect("below 16,384 rad");
//! let off = yaw(3.0 + 10.0 * core::f64::consts::TAU).minus(yaw(3.0)).signed();
//! assert!(off.abs() <= 1);
//! ```

use core::num::NonZeroU64;

pub(crate) use self::inverse::Inverse;
pub(crate) use self::leading::Leading;
pub(crate) use self::product::{long_product, product, shifted_product, wide};
pub(crate) use self::quotient::{quotient, towards_zero};
pub(crate) use self::reciprocal::Reciprocal;
pub(crate) use self::root::{sqrt_ceil, sqrt_floor};
pub(crate) use self::trig::COS_SIN_ERROR_Q30;

mod inverse;
mod leading;
mod product;
mod quotient;
mod reciprocal;
mod root;
mod trig;

/// Micrometres in a metre.
pub const UM_PER_M: u32 = 1_000_000;

/// Units of a [`BinaryAngle`] in one unit of a yaw extent (2^-24 turn).
pub(crate) const ANGLE_UNITS_PER_Q24: i64 = 256;

/// A heading as a fraction of a turn: unit 2^-32 turn, counter-clockwise, modulo one turn.
///
/// Addition and subtraction wrap, so +-180 degrees needs no special case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BinaryAngle(pub u32);

impl BinaryAngle {
    /// Returns `self + other`, modulo one turn. Exact.
    #[must_use]
    pub const fn plus(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }

    /// Returns `self - other`, modulo one turn, in `[0, 1)` turn. Exact.
    #[must_use]
    pub const fn minus(self, other: Self) -> Self {
        Self(self.0.wrapping_sub(other.0))
    }

    /// Returns the representative in `[-1/2, 1/2)` turn, in units of 2^-32 turn. Exact.
    #[must_use]
    pub const fn signed(self) -> i32 {
        self.0 as i32
    }

    /// Returns cosine and sine, unit 2^-15. As a vector they are within [`COS_SIN_ERROR_Q15`] of the true
    /// one.
    ///
    /// Integer polynomials over an eighth of a turn, 32-bit products only.
    ///
    /// | rounding, unit 2^-15 | at most |
    /// |---|---|
    /// | the heading, to 2^-18 turn | 0.40 |
    /// | the polynomials, their sums and the shift to 2^-15 (exhaustive test) | 1.25 |
    /// | **sum** | **1.65** |
    #[must_use]
    pub(crate) const fn cos_sin_q15(self) -> [i32; 2] {
        // The nearest quarter turn, and the rest in units of 2^-18 turn: at most 2^15.
        let quarter = self.0.wrapping_add(1 << 29) >> 30;
        let rest = self.0.wrapping_sub(quarter.wrapping_shl(30)) as i32;
        let rest = rest.wrapping_add(1 << 13) >> 14;
        // Radians, unit 2^-17: 51472 = pi 2^14.
        let x = rest.wrapping_mul(51_472).wrapping_add(1 << 13) >> 14;
        let x_q15 = x.wrapping_add(2) >> 2;
        let x2 = x_q15.wrapping_mul(x_q15).wrapping_add(1 << 14) >> 15;
        let x4 = x2.wrapping_mul(x2).wrapping_add(1 << 14) >> 15;
        let x6 = x4.wrapping_mul(x2).wrapping_add(1 << 14) >> 15;
        // sin x = x (1 - 0.16662834 x^2 + 0.008153 x^4), minimax to 1e-6.
        let bend = x2
            .wrapping_mul(43_681)
            .wrapping_sub(x4.wrapping_mul(17_098) >> 3)
            .wrapping_add(1 << 15)
            >> 16;
        let sin = x.wrapping_sub(x.wrapping_mul(bend).wrapping_add(1 << 16) >> 17);
        // cos x = 1 - 0.5 x^2 + 0.0416563 x^4 - 0.00135978 x^6, minimax to 4e-8.
        let fall = x2
            .wrapping_mul(65_536)
            .wrapping_sub(x4.wrapping_mul(43_680) >> 3)
            .wrapping_add(x6.wrapping_mul(45_627) >> 8)
            .wrapping_add(1 << 14)
            >> 15;
        let cos = (1i32 << 17).wrapping_sub(fall);
        let (cos, sin) = (cos.wrapping_add(2) >> 2, sin.wrapping_add(2) >> 2);
        match quarter & 3 {
            0 => [cos, sin],
            1 => [sin.wrapping_neg(), cos],
            2 => [cos.wrapping_neg(), sin.wrapping_neg()],
            _ => [sin, cos.wrapping_neg()],
        }
    }

    /// Returns the nearest binary angle to a finite angle in radians.
    ///
    /// `None` if `radians` is not finite or its magnitude is 16,384 or more (a heading that is wound up
    /// this far is an error of the source). The error is at most 0.5 unit and 2^-30 unit.
    #[must_use]
    pub fn from_radians(radians: f64) -> Option<Self> {
        let float = Float::of(radians)?;
        if !float.is_below_power_of_two(14) {
            return None;
        }
        let units = float.scaled(UNITS_PER_RADIAN_Q44, 44, Rounding::Nearest)?;
        // The low 32 bits are the angle modulo one turn, for negative angles too.
        Some(Self(units as u32))
    }
}

/// 2^32 / (2 pi) * 2^44, to the nearest integer (relative error 2^-74).
const UNITS_PER_RADIAN_Q44: u128 = 12_025_407_501_443_077_023_729;

/// Upper bound of the distance of [`BinaryAngle::cos_sin_q15`] from the true cosine and sine, unit 2^-15.
pub(crate) const COS_SIN_ERROR_Q15: i32 = 2;

/// The units of an integer in one unit of a float: `factor / 2^shift`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FloatUnit {
    factor: u128,
    shift: i32,
}

impl FloatUnit {
    /// Micrometres in a metre.
    pub const MICRO: Self = Self::new(UM_PER_M as u128, 0);

    /// Returns the unit `factor / 2^shift`, for a factor of at most 74 bits.
    pub const fn new(factor: u128, shift: i32) -> Self {
        Self { factor, shift }
    }
}

/// The reason why a float is not converted to an integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NotConverted {
    /// It is NaN or infinite.
    NotFinite,
    /// The integer would be 2^62 or more.
    TooLarge,
}

/// Returns a float in units of an integer, as [`Float::scaled`] rounds it. With `small_code` it is in flash once.
///
/// # Errors
/// [`NotConverted`].
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline(always))]
pub(crate) fn converted(
    value: f64,
    unit: &FloatUnit,
    rounding: Rounding,
) -> Result<i64, NotConverted> {
    let float = Float::of(value).ok_or(NotConverted::NotFinite)?;
    let scaled = float.scaled(unit.factor, unit.shift, rounding);
    scaled.ok_or(NotConverted::TooLarge)
}

/// The biased exponent of infinities and NaN.
const NOT_FINITE: u32 = 0x7ff;

/// Returns the biased exponent of a float.
const fn biased(value: f64) -> u32 {
    (value.to_bits() >> 52) as u32 & NOT_FINITE
}

/// Returns `true` if a float is a number: not infinite, not NaN.
#[must_use]
pub(crate) const fn is_finite(value: f64) -> bool {
    biased(value) != NOT_FINITE
}

/// Returns `true` if a float is a number with `|value| < 2^power`, for a power from -1022 to 1023.
#[must_use]
pub(crate) const fn is_below_power_of_two(value: f64, power: i32) -> bool {
    (biased(value) as i32) < power.wrapping_add(1023)
}

/// The rounding of a number between two integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rounding {
    /// To the nearest integer, ties away from zero: error at most 0.5.
    Nearest,
    /// Away from zero: never smaller in magnitude.
    AwayFromZero,
}

/// A finite `f64` in parts: exactly `(-1)^negative * mantissa * 2^exponent`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Float {
    /// The sign bit.
    pub negative: bool,
    /// At most 53 bits.
    pub mantissa: u64,
    /// The power of two, in `[-1074, 971]`.
    pub exponent: i32,
}

impl Float {
    /// Decodes a float. `None` for infinities and NaN (IEEE 754-2019, 3.4).
    #[must_use]
    pub const fn of(value: f64) -> Option<Self> {
        let bits = value.to_bits();
        let negative = bits >> 63 == 1;
        let biased = (bits >> 52) as i32 & 0x7ff;
        let fraction = bits & 0x000f_ffff_ffff_ffff;
        match biased {
            0x7ff => None,
            0 => Some(Self {
                negative,
                mantissa: fraction,
                exponent: -1074,
            }),
            _ => Some(Self {
                negative,
                mantissa: fraction | 0x0010_0000_0000_0000,
                exponent: biased.wrapping_sub(1075),
            }),
        }
    }

    /// Returns `true` if the number is zero (of either sign).
    #[must_use]
    pub(crate) const fn is_zero(self) -> bool {
        self.mantissa == 0
    }

    /// Returns `true` if the number is above zero.
    #[must_use]
    pub(crate) const fn is_positive(self) -> bool {
        !self.negative && self.mantissa != 0
    }

    /// Returns `true` if `|value| < 2^power`.
    #[must_use]
    pub(crate) const fn is_below_power_of_two(self, power: i32) -> bool {
        self.mantissa == 0 || self.top_bit() < power
    }

    /// Returns the `b` for which `2^b <= |value| < 2^(b+1)`; meaningless for zero.
    #[must_use]
    pub(crate) const fn top_bit(self) -> i32 {
        // A mantissa has at most 53 bits and an exponent at most 11, so no sum leaves an i32.
        63i32
            .wrapping_sub(self.mantissa.leading_zeros() as i32)
            .wrapping_add(self.exponent)
    }

    /// Returns `value * factor / 2^shift` as an integer, with the given rounding.
    ///
    /// The product is exact (53 bits by at most 74 bits); only the last step rounds. `None` if `factor`
    /// has more than 74 bits or the result's magnitude is 2^62 or more.
    #[must_use]
    pub fn scaled(self, factor: u128, shift: i32, rounding: Rounding) -> Option<i64> {
        if factor >> 74 != 0 {
            return None;
        }
        let (high, low) = self.times(factor);
        if high == 0 && low == 0 {
            return Some(0);
        }
        let power = self.exponent.checked_sub(shift)?;
        let magnitude = if power >= 0 {
            let power = power.unsigned_abs();
            if high != 0 || power >= low.leading_zeros() {
                return None;
            }
            low.wrapping_shl(power)
        } else {
            let by = power.unsigned_abs();
            let twice = shifted_down(high, low, by.wrapping_sub(1))?;
            let round_up = match rounding {
                Rounding::Nearest => twice & 1 == 1,
                Rounding::AwayFromZero => trailing_zeros(high, low) < by,
            };
            (twice >> 1).wrapping_add(u64::from(round_up))
        };
        if magnitude >> 62 != 0 {
            return None;
        }
        let magnitude = magnitude as i64;
        Some(if self.negative {
            magnitude.wrapping_neg()
        } else {
            magnitude
        })
    }

    /// Returns the mantissa times a factor of at most 74 bits, in two words.
    fn times(self, factor: u128) -> (u64, u64) {
        let (m1, m0) = ((self.mantissa >> 32) as u32, self.mantissa as u32);
        let f0 = factor as u32;
        let lowest = wide(m0, f0);
        if factor >> 32 == 0 {
            // Below 2^53 and 2^32.
            let middle = wide(m1, f0).wrapping_add(lowest >> 32);
            return (middle >> 32, middle << 32 | lowest & 0xffff_ffff);
        }
        let (f2, f1) = ((factor >> 64) as u32, (factor >> 32) as u32);
        // Each sum is below 2^64: a product of two words and two more words fit.
        let middle = wide(m0, f1).wrapping_add(lowest >> 32);
        let other = wide(m1, f0).wrapping_add(middle & 0xffff_ffff);
        let highest = wide(m0, f2).wrapping_add(wide(m1, f2) << 32);
        let high = wide(m1, f1)
            .wrapping_add(middle >> 32)
            .wrapping_add(other >> 32)
            .wrapping_add(highest);
        (high, other << 32 | lowest & 0xffff_ffff)
    }
}

/// Returns a number of two words over `2^by`, rounded down, or `None` if it has more than 64 bits.
fn shifted_down(high: u64, low: u64, by: u32) -> Option<u64> {
    match by {
        0 => (high == 0).then_some(low),
        1..64 => {
            let fits = high.wrapping_shr(by) == 0;
            let both = high.wrapping_shl(64u32.wrapping_sub(by)) | low.wrapping_shr(by);
            fits.then_some(both)
        }
        64..128 => Some(high.wrapping_shr(by.wrapping_sub(64))),
        _ => Some(0),
    }
}

/// Returns the zeros below the lowest one of a number of two words.
const fn trailing_zeros(high: u64, low: u64) -> u32 {
    if low == 0 {
        high.trailing_zeros().wrapping_add(64)
    } else {
        low.trailing_zeros()
    }
}

/// Returns `value` limited to `[low, high]`, or `high` if the interval is empty. (`Ord::clamp` panics
/// then, and the core must not panic.)
#[must_use]
#[allow(clippy::manual_clamp)]
pub(crate) fn clamped(value: i64, low: i64, high: i64) -> i64 {
    value.max(low).min(high)
}

/// A divisor above zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Divisor(NonZeroU64);

impl Divisor {
    /// Returns the divisor, or `None` unless `value` is above zero.
    #[must_use]
    pub const fn new(value: i64) -> Option<Self> {
        if value <= 0 {
            return None;
        }
        match NonZeroU64::new(value as u64) {
            Some(value) => Some(Self(value)),
            None => None,
        }
    }

    /// Returns `dividend / self`, rounded down.
    #[must_use]
    pub fn floor(self, dividend: i64) -> i64 {
        self.rounded(dividend, dividend < 0)
    }

    /// Returns `dividend / self`, rounded up.
    #[must_use]
    pub fn ceil(self, dividend: i64) -> i64 {
        self.rounded(dividend, dividend >= 0)
    }

    /// Returns `dividend / self`, rounded to the nearest integer: the error is at most 0.5.
    #[must_use]
    pub fn nearest(self, dividend: i64) -> i64 {
        self.floor(dividend.saturating_add((self.0.get() >> 1) as i64))
    }

    /// Returns `dividend / self`, rounded away from zero or towards zero.
    #[cfg_attr(small_code, inline(never))]
    fn rounded(self, dividend: i64, away: bool) -> i64 {
        let magnitude = dividend.unsigned_abs();
        let down = quotient(magnitude, self.0.get()).unwrap_or(0);
        let more = away && down.wrapping_mul(self.0.get()) != magnitude;
        let rounded = down.wrapping_add(u64::from(more)) as i64;
        if dividend < 0 {
            rounded.wrapping_neg()
        } else {
            rounded
        }
    }
}

#[cfg(test)]
mod tests;
