//! Values of a pose-set that every decision needs, independent of the table: computed once.

use super::{Extent, Growth, SqrtFactor};
use crate::num::{ANGLE_UNITS_PER_Q24, sqrt_ceil, wide};
use crate::pose::Pose;

/// Values of a pose-set that do not depend on a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Common {
    /// Cosine and sine of the estimate's heading, unit 2^-15.
    pub cos_q15: i32,
    pub sin_q15: i32,
    /// Upper bound of the length of an offset in the plane, and of every entry of a factor, micrometres.
    pub broad_um: u32,
    /// The largest yaw offset.
    pub turn: Turn,
}

/// The largest bound of a length that a repeated growth gives, micrometres: no table contains a set of that size.
const MOST_BROAD_UM: u32 = (1 << 31) - 1;

impl Common {
    /// Returns the values of a set that was grown to this extent.
    pub(super) fn grow(&mut self, extent: Extent, by: Growth) {
        let yaw_q24 = match extent {
            Extent::Bounded { yaw_q24, .. } => yaw_q24,
            Extent::Gaussian(factor) => factor.yaw,
            Extent::Grown { factor, by } => factor.yaw.wrapping_add(by.yaw_q24()),
        };
        let moved = by.translation_um().unsigned_abs();
        self.broad_um = self.broad_um.saturating_add(moved).min(MOST_BROAD_UM);
        self.turn = Turn::of(yaw_q24.unsigned_abs());
    }

    pub(super) fn of(mean: Pose, extent: Extent) -> Self {
        let [cos_q15, sin_q15] = mean.yaw.cos_sin_q15();
        let (broad_um, yaw_q24) = match extent {
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => (translation_um.unsigned_abs(), yaw_q24),
            Extent::Gaussian(factor) => (broad_um(&factor), factor.yaw),
            // Below 2^30.4 and 2^30.1.
            Extent::Grown { factor, by } => (
                broad_um(&factor).wrapping_add(by.translation_um().unsigned_abs()),
                factor.yaw.wrapping_add(by.yaw_q24()),
            ),
        };
        Self {
            cos_q15,
            sin_q15,
            broad_um,
            turn: Turn::of(yaw_q24.unsigned_abs()),
        }
    }
}

/// Returns an upper bound of the length of an ellipsoid's offsets in the plane, micrometres.
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline(always))]
pub(crate) fn broad_um(factor: &SqrtFactor) -> u32 {
    // Six squares below 2^58.
    let rows = [factor.x, factor.y];
    let squares = rows.as_flattened().iter().fold(0u64, |sum, entry| {
        let entry = entry.unsigned_abs();
        sum.wrapping_add(wide(entry, entry))
    });
    sqrt_ceil(squares) as u32
}

/// A largest yaw offset in radians: `mantissa * 2^-down`, to within 3.8e-5 of it: 1.53e-5 for its 16 bits,
/// 1.95e-5 for the mantissa, 2.8e-6 for 2 pi.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Turn {
    /// At most 51472.
    mantissa: i32,
    /// Between 7 and 36.
    down: u32,
    /// The offset, 2^-15 rad, rounded up; some value above [`Turn::LARGEST`] if the offset is larger.
    pub radians_q15: i32,
    /// The square of the offset, 2^-15, rounded up, if it is at most [`Turn::LARGEST`]: at most 2^13 + 1.
    pub square_q15: u32,
    /// The offset, 2^-32 turn, or `u32::MAX` if it is a turn or more.
    pub reach: u32,
}

impl Turn {
    /// Half a radian, unit 2^-15.
    pub const LARGEST: i32 = 1 << 14;

    /// No turn.
    pub const NONE: Self = Self {
        mantissa: 0,
        down: 36,
        radians_q15: 1,
        square_q15: 1,
        reach: 0,
    };

    /// Returns the turn of an offset below 2^31.
    pub fn of(yaw_q24: u32) -> Self {
        // 16 bits of it: `t 2^s`, t <= 2^16 to the nearest; times 2 pi / 8 as 51472 / 2^16.
        let s = 16i32.wrapping_sub(yaw_q24.leading_zeros() as i32);
        let t = if s > 0 {
            let half = 1u32.wrapping_shl(s.unsigned_abs()) >> 1;
            yaw_q24.wrapping_add(half).wrapping_shr(s.unsigned_abs())
        } else {
            yaw_q24.wrapping_shl(s.unsigned_abs())
        };
        let mantissa = t.wrapping_mul(51_472).wrapping_add(1 << 15) >> 16;
        let radians = if s > 5 {
            i32::MAX.unsigned_abs()
        } else {
            // mantissa * 2^(s - 6), rounded up.
            let by = 6i32.wrapping_sub(s).unsigned_abs().min(31);
            mantissa.wrapping_shr(by).wrapping_add(1)
        };
        let within = radians.min(Self::LARGEST.unsigned_abs());
        let square_q15 = (within.wrapping_mul(within) >> 15).wrapping_add(1);
        Self {
            mantissa: mantissa as i32,
            down: 21i32.wrapping_sub(s).unsigned_abs(),
            radians_q15: radians as i32,
            square_q15,
            reach: if yaw_q24 < 1 << 24 {
                yaw_q24.wrapping_mul(ANGLE_UNITS_PER_Q24 as u32)
            } else {
                u32::MAX
            },
        }
    }

    /// Returns the right shift that converts a product of a lever (length units) and the mantissa to units
    /// that are finer by `finer` bits: between 1 and 32.
    #[cfg_attr(small_code, inline(never))]
    #[cfg_attr(not(small_code), inline(always))]
    pub fn shift(&self, finer: i32) -> u32 {
        (self.down as i32).wrapping_sub(finer).clamp(1, 32) as u32
    }

    /// Returns half the turn, which is at most [`Turn::LARGEST`].
    pub fn halved(&self) -> Self {
        let radians = self.radians_q15.wrapping_add(1) >> 1;
        let square = (radians.wrapping_mul(radians) >> 15).wrapping_add(1);
        Self {
            mantissa: self.mantissa,
            down: self.down.wrapping_add(1),
            radians_q15: radians,
            square_q15: square as u32,
            reach: self.reach >> 1,
        }
    }

    /// Returns the offset times a lever below 41,700, shifted right, to the nearest: within
    /// half a unit and 3.8e-5 of it.
    #[cfg_attr(small_code, inline(never))]
    #[cfg_attr(not(small_code), inline(always))]
    pub const fn at(&self, lever: i32, shift: u32) -> i32 {
        // Below 2^31: 51472 * 41,700.
        let product = lever.wrapping_mul(self.mantissa);
        product.wrapping_shr(shift.wrapping_sub(1)).wrapping_add(1) >> 1
    }
}

#[cfg(test)]
mod tests {
    use super::Turn;
    use core::f64::consts::TAU;
    use proptest::prelude::*;

    #[test]
    fn turns_are_rounded_to_the_nearest() {
        // 25736.8.
        assert_eq!(Turn::of(32_769).mantissa, 25_737);
        // Sixteen bits without rounding.
        assert_eq!(Turn::of(1 << 15).mantissa, 25_736);
    }

    #[test]
    fn a_whole_turn_reaches_everywhere() {
        assert_eq!(Turn::of(3).reach, 3 << 8);
        assert_eq!(Turn::of((1 << 24) - 1).reach, 0xffff_ff00);
        assert_eq!(Turn::of(1 << 24).reach, u32::MAX);
        assert_eq!(Turn::of((1 << 30) - 1).reach, u32::MAX);
    }

    proptest! {
        #[test]
        fn turns_keep_their_error(bits in 0..30u32, low in any::<u32>(), lever in -41_700i32..41_700, finer in -1..13i32, halvings in 0..6) {
            let yaw = 1u32 << bits | low & ((1 << bits) - 1);
            // Turns of half a radian at most are halved.
            let halvings = if Turn::of(yaw).radians_q15 <= Turn::LARGEST { halvings } else { 0 };
            let turn = (0..halvings).fold(Turn::of(yaw), |turn, _| turn.halved());
            let radians = f64::from(yaw) * TAU / 16_777_216.0 / f64::from(1 << halvings);
            let shown = f64::from(turn.mantissa) * 0.5f64.powi(turn.down as i32);
            prop_assert!((shown / radians - 1.0).abs() <= 3.8e-5);
            if radians <= 0.5 {
                let q15 = radians * 32_768.0;
                prop_assert!(f64::from(turn.radians_q15) >= q15 && f64::from(turn.radians_q15) <= q15 + 2.7);
                let [square, found] = [q15 * q15 / 32_768.0, f64::from(turn.square_q15)];
                prop_assert!(found >= square && found <= square + 4.0, "{found} {square}");
            } else {
                prop_assert!(turn.radians_q15 > Turn::LARGEST);
            }
            let exact = radians * f64::from(lever) * f64::from(finer).exp2();
            if exact.abs() <= 41_000.0 {
                let found = turn.at(lever, turn.shift(finer));
                let most = 0.5 + 3.8e-5 * exact.abs();
                prop_assert!((f64::from(found) - exact).abs() <= most, "{found} {exact}");
            }
        }
    }
}
