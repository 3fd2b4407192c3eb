//! The errors of an odometry, as numbers that a controller can add up.

use crate::motion::MotionBounds;
use crate::num::{Float, Rounding, sqrt_ceil, wide};

/// The errors of an odometry. Deviations grow with the root of the path length, as does the sum of many small independent errors. Slip is
/// a bound: the share of every movement that may be wrong in the worst direction. Lengths are those of the path. No value may be below zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct OdometryErrors {
    /// Standard deviation of the position on each axis, metres per root of a metre driven.
    pub m_per_sqrt_m: f64,
    /// Standard deviation of the heading, radians per root of a radian turned.
    pub rad_per_sqrt_rad: f64,
    /// Standard deviation of the heading, radians per root of a metre driven.
    pub rad_per_sqrt_m: f64,
    /// Standard deviation of the position on each axis, metres per root of a second.
    pub m_per_sqrt_s: f64,
    /// Standard deviation of the heading, radians per root of a second.
    pub rad_per_sqrt_s: f64,
    /// The share of a driven length that may be wrong, in any direction; below 1.
    pub slip: f64,
    /// The share of a turn that may be wrong, in either direction; below 1.
    pub turn_slip: f64,
    /// The additional turn that may be wrong, radians per metre driven.
    pub turn_slip_per_m: f64,
}

// The header of C gets the struct alone.
/// cbindgen:ignore
impl OdometryErrors {
    /// No error at all; to be filled in.
    pub const NONE: Self = Self {
        m_per_sqrt_m: 0.0,
        rad_per_sqrt_rad: 0.0,
        rad_per_sqrt_m: 0.0,
        m_per_sqrt_s: 0.0,
        rad_per_sqrt_s: 0.0,
        slip: 0.0,
        turn_slip: 0.0,
        turn_slip_per_m: 0.0,
    };
}

/// The errors in units of the path: variances in um^2 and squares of 2^-24 turn, 2^-8.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    plane_per_um: u64,
    plane_per_ms: u64,
    turn_per_um: u64,
    turn_per_q24: u64,
    turn_per_ms: u64,
    /// Shares, 2^-16, and 2^-24 turn per micrometre, 2^-32.
    slip_q16: u64,
    turn_slip_q16: u64,
    turn_slip_per_um_q32: u64,
}

/// Returns the square of a deviation in the unit of a variance, of which `per_unit` are one, rounded up. `None` if the deviation is below zero,
/// not a number or beyond 1000, or the variance is beyond 2^50.
#[inline(never)]
fn variance(deviation: f64, per_unit: u64) -> Option<u64> {
    let up = Float::of(deviation)?.scaled(1 << 20, 0, Rounding::AwayFromZero)?;
    let up = u64::try_from(up).ok().filter(|up| *up < 1 << 30)?;
    let product = u128::from(up.wrapping_mul(up)).wrapping_mul(u128::from(per_unit));
    let down = u64::try_from(product >> 40).ok()?.checked_add(1)?;
    let is_zero = deviation.to_bits() << 1 == 0;
    Some(if is_zero { 0 } else { down }).filter(|v| *v < 1 << 50)
}

/// Readings below this, to either side, cannot be taken for a turn of at most an eighth of a turn, 2^-24 turn: 7/8 of a turn.
const TOLD_APART: u64 = 7 << 21;
/// The deviations of a heading's noise that a reading may be off: the largest root of a squared radius.
const DEVIATIONS: u64 = 16;

/// One, as a share.
const WHOLE: u64 = 1 << 16;

/// Returns `value / (1 - share)`, the share with unit 2^-16, rounded up. `None` unless the share is below 1.
#[inline(never)]
fn of_the_rest(value: u64, share_q16: u64) -> Option<u64> {
    let rest = WHOLE.checked_sub(share_q16).filter(|rest| *rest > 0)?;
    // In 64 bits: the whole part of the quotient, and the rest's, which is below the unit.
    let whole = value.checked_div(rest)?.checked_mul(WHOLE)?;
    let part = value.checked_rem(rest)?.wrapping_mul(WHOLE);
    whole.checked_add(part.wrapping_add(rest.wrapping_sub(1)).checked_div(rest)?)
}

/// A value times a factor, rounded up. `None` if it is below zero, not a number, or beyond 2^40.
#[inline(never)]
fn scaled(value: f64, factor: u128) -> Option<u64> {
    let up = Float::of(value)?.scaled(factor, 0, Rounding::AwayFromZero)?;
    u64::try_from(up).ok().filter(|up| *up < 1 << 40)
}

impl Noise {
    /// `None` if an error is below zero, not a number or beyond 1000, or a share is 1 or more.
    ///
    /// With a share s a length L that is reported is at most `L / (1 - s)` as driven, so an error of `s` times the driven length is at
    /// most `s / (1 - s)` times the reported one. Turns are alike, with the additional turn per metre.
    pub fn of(errors: &OdometryErrors) -> Option<Self> {
        let [slip, turn_slip] = [
            scaled(errors.slip, WHOLE.into())?,
            scaled(errors.turn_slip, WHOLE.into())?,
        ];
        let per_length = |value: u64| of_the_rest(value, slip);
        let per_turn = |value: u64| of_the_rest(value, turn_slip);
        // 2^24 / (2 pi) / 10^6 * 2^32, up.
        let turn_slip_per_um_q32 = scaled(errors.turn_slip_per_m, 11_468_322_280)?;
        let turn_slip_per_um_q32 = per_length(turn_slip_per_um_q32)?;
        // m^2 per m is 10^6 um^2 per um; per s 10^9 um^2 per ms. Times 2^8. (2^24 / (2 pi))^2 is 7.13e12, and 2^24 / (2 pi) is
        // 2,670,176.9.
        let turn_per_um = per_length(variance(errors.rad_per_sqrt_m, 1_825_240_180)?)?;
        let turn_per_q24 = per_turn(variance(errors.rad_per_sqrt_rad, 683_565_276)?)?;
        // The turns that slip adds to a length have their own noise.
        let slipping = u128::from(turn_per_q24).wrapping_mul(turn_slip_per_um_q32.into());
        let slipping = u64::try_from(slipping.wrapping_add(u32::MAX.into()) >> 32).ok()?;
        Some(Self {
            plane_per_um: per_length(variance(errors.m_per_sqrt_m, 256_000_000)?)?,
            plane_per_ms: variance(errors.m_per_sqrt_s, 256_000_000_000)?,
            turn_per_um: turn_per_um.checked_add(slipping)?,
            turn_per_q24,
            turn_per_ms: variance(errors.rad_per_sqrt_s, 1_825_240_179_586)?,
            slip_q16: per_length(slip)?,
            turn_slip_q16: per_turn(turn_slip)?,
            turn_slip_per_um_q32: per_turn(turn_slip_per_um_q32)?,
        })
    }

    /// Returns the variances that a movement adds: um^2 on each axis, and squares of 2^-24 turn; rounded up. The length has the unit
    /// 2^-8 um.
    pub fn variances(&self, length_q8: u32, turn_q24: u32, ms: u32) -> [i64; 2] {
        // The usual rates have 32 bits: one product.
        let part = |per: u64, of: u32| match u32::try_from(per) {
            Ok(per) => wide(per, of),
            Err(_) => per.saturating_mul(u64::from(of)),
        };
        let up = |sum: u64| i64::try_from((sum >> 8).saturating_add(1)).unwrap_or(i64::MAX);
        let along = |per: u64| (part(per, length_q8) >> 8).saturating_add(1);
        let plane = along(self.plane_per_um).saturating_add(part(self.plane_per_ms, ms));
        let turn = along(self.turn_per_um)
            .saturating_add(part(self.turn_per_q24, turn_q24))
            .saturating_add(part(self.turn_per_ms, ms));
        [up(plane), up(turn)]
    }

    /// Returns the longest time of an increment, milliseconds, whose turn cannot be read as another that differs by whole turns: the robot's largest
    /// turn, with its slip and its noise, stays below [`TOLD_APART`]. Zero if none is short enough.
    pub fn longest_ms(&self, bounds: MotionBounds) -> u32 {
        let mut longest = 0;
        let mut bit = 1 << 30;
        while bit > 0 {
            if self.tells_apart(bounds, longest | bit) {
                longest |= bit;
            }
            bit >>= 1;
        }
        longest
    }

    fn tells_apart(&self, bounds: MotionBounds, ms: u32) -> bool {
        // A millisecond for the rounding of both stamps.
        let most = bounds.within(ms.saturating_add(1));
        let turn_q24 = most.yaw_q24().unsigned_abs();
        // A length beyond 16 m is no increment.
        let Some(length_q8) = most.translation_um().unsigned_abs().checked_mul(1 << 8) else {
            return false;
        };
        let [_, slipped] = self.slip(length_q8.into(), turn_q24.into());
        let [_, variance] = self.variances(length_q8, turn_q24, ms.saturating_add(1));
        // Below 2^36.
        let noise = sqrt_ceil(variance.unsigned_abs())
            .unsigned_abs()
            .wrapping_mul(DEVIATIONS);
        let besides = u64::from(turn_q24).wrapping_add(noise);
        slipped < TOLD_APART && slipped.wrapping_add(besides) < TOLD_APART
    }

    /// Returns the bound of the slip on a path whose length has the unit 2^-8 um: micrometres and 2^-24 turn, rounded up.
    pub fn slip(&self, length_q8: u64, turned_q24: u64) -> [u64; 2] {
        let up = |per: u64, of: u64, down: u32| {
            let product = u128::from(per).wrapping_mul(u128::from(of));
            let whole = product.wrapping_shr(down) as u64;
            if product == 0 {
                0
            } else {
                whole.saturating_add(1)
            }
        };
        let turn = up(self.turn_slip_q16, turned_q24, 16).saturating_add(up(
            self.turn_slip_per_um_q32,
            length_q8,
            40,
        ));
        [up(self.slip_q16, length_q8, 24), turn]
    }
}

#[cfg(test)]
mod error_budget;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_errors_are_refused() {
        for bad in [-1e-9, f64::NAN, f64::INFINITY, 1e9] {
            for which in 0..8 {
                let mut all = [0.0; 8];
                all[which] = bad;
                let [a, b, c, d, e, f, g, h] = all;
                let errors = OdometryErrors {
                    m_per_sqrt_m: a,
                    rad_per_sqrt_rad: b,
                    rad_per_sqrt_m: c,
                    m_per_sqrt_s: d,
                    rad_per_sqrt_s: e,
                    slip: f,
                    turn_slip: g,
                    turn_slip_per_m: h,
                };
                assert!(Noise::of(&errors).is_none(), "{errors:?}");
            }
        }
        assert!(Noise::of(&OdometryErrors::NONE).is_some());
    }
}
