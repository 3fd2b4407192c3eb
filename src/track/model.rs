//! The errors of an odometry, as numbers that a controller can add up.

use crate::num::{Float, Rounding};

/// The errors of an odometry. Deviations grow with the root of the path length, as does the sum of many small independent errors. Slip
/// is a bound: the share of every movement that may be wrong in the worst direction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
    /// The share of a driven length that may be wrong, in any direction.
    pub slip: f64,
    /// The share of a turn that may be wrong, in either direction.
    pub turn_slip: f64,
    /// The additional turn that may be wrong, radians per metre driven.
    pub turn_slip_per_m: f64,
}

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

/// Squares of a deviation, unit 2^-20 of its square root's unit: of 1 the square is 2^40.
fn square_q40(deviation: f64) -> Option<u128> {
    let float = Float::of(deviation)?;
    let up = float.scaled(1 << 20, 0, Rounding::AwayFromZero)?;
    let up = u64::try_from(up).ok().filter(|up| *up < 1 << 30)?;
    Some(u128::from(up).wrapping_mul(u128::from(up)))
}

/// A value times a factor, rounded up. `None` if it is below zero, not a number, or beyond 2^40.
fn scaled(value: f64, factor: u128) -> Option<u64> {
    let up = Float::of(value)?.scaled(factor, 0, Rounding::AwayFromZero)?;
    u64::try_from(up).ok().filter(|up| *up < 1 << 40)
}

impl Noise {
    /// `None` if an error is below zero, not a number or beyond 1000.
    pub fn of(errors: &OdometryErrors) -> Option<Self> {
        let variance = |deviation: f64, per_unit: u128| {
            let product = square_q40(deviation)?.checked_mul(per_unit)?;
            let down = (product >> 40).checked_add(1)?;
            let is_zero = deviation.to_bits() << 1 == 0;
            u64::try_from(if is_zero { 0 } else { down })
                .ok()
                .filter(|v| *v < 1 << 50)
        };
        Some(Self {
            // m^2 per m is 10^6 um^2 per um; per s 10^9 um^2 per ms. Times 2^8.
            plane_per_um: variance(errors.m_per_sqrt_m, 256_000_000)?,
            plane_per_ms: variance(errors.m_per_sqrt_s, 256_000_000_000)?,
            // (2^24 / (2 pi))^2 is 7.13e12, and 2^24 / (2 pi) is 2,670,176.9. Times 2^8.
            turn_per_um: variance(errors.rad_per_sqrt_m, 1_825_240_180)?,
            turn_per_q24: variance(errors.rad_per_sqrt_rad, 683_565_276)?,
            turn_per_ms: variance(errors.rad_per_sqrt_s, 1_825_240_179_586)?,
            slip_q16: scaled(errors.slip, 1 << 16)?,
            turn_slip_q16: scaled(errors.turn_slip, 1 << 16)?,
            // 2^24 / (2 pi) / 10^6 * 2^32, up.
            turn_slip_per_um_q32: scaled(errors.turn_slip_per_m, 11_468_322_280)?,
        })
    }

    /// Returns the variances that a movement adds: um^2 on each axis, and squares of 2^-24 turn; rounded up.
    pub fn variances(&self, length_um: u32, turn_q24: u32, ms: u32) -> [i64; 2] {
        let part = |per: u64, of: u32| per.saturating_mul(u64::from(of));
        let up = |sum: u64| i64::try_from((sum >> 8).saturating_add(1)).unwrap_or(i64::MAX);
        let plane = part(self.plane_per_um, length_um).saturating_add(part(self.plane_per_ms, ms));
        let turn = part(self.turn_per_um, length_um)
            .saturating_add(part(self.turn_per_q24, turn_q24))
            .saturating_add(part(self.turn_per_ms, ms));
        [up(plane), up(turn)]
    }

    /// Returns the bound of the slip on a path: micrometres and 2^-24 turn, rounded up.
    pub fn slip(&self, length_um: u64, turned_q24: u64) -> [u64; 2] {
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
            length_um,
            32,
        ));
        [up(self.slip_q16, length_um, 16), turn]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    #[test]
    fn variances_are_those_of_the_deviations_rounded_up() {
        let errors = OdometryErrors {
            m_per_sqrt_m: 0.02,
            rad_per_sqrt_rad: 0.05,
            rad_per_sqrt_m: 0.03,
            m_per_sqrt_s: 0.001,
            rad_per_sqrt_s: 0.002,
            slip: 0.05,
            turn_slip: 0.1,
            turn_slip_per_m: 0.01,
        };
        let noise = Noise::of(&errors).unwrap();
        let q24 = TAU / 16_777_216.0;
        for (metres, radians, seconds) in [
            (0.006f64, 0.02f64, 0.02f64),
            (1.0, 1.5, 4.0),
            (3.9, 3.0, 60.0),
        ] {
            let [plane, turn] = noise.variances(
                (metres * 1e6) as u32,
                (radians / q24) as u32,
                (seconds * 1e3) as u32,
            );
            let exact = (4e-4 * metres + 1e-6 * seconds) * 1e12;
            assert!(
                plane as f64 >= exact * 0.99999 && (plane as f64) < exact * 1.001 + 100.0,
                "{plane} {exact}"
            );
            let exact = (25e-4 * radians + 9e-4 * metres + 4e-6 * seconds) / (q24 * q24);
            assert!(
                turn as f64 >= exact * 0.99999 && (turn as f64) < exact * 1.001 + 3000.0,
                "{turn} {exact}"
            );
            let [length, turn] = noise.slip((metres * 1e6) as u64, (radians / q24) as u64);
            assert!((length as f64 - 0.05e6 * metres).abs() < 0.001 * 0.05e6 * metres + 2.0);
            let exact = (0.1 * radians + 0.01 * metres) / q24;
            assert!(
                (turn as f64 - exact).abs() < 0.001 * exact + 3.0,
                "{turn} {exact}"
            );
        }
    }

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
