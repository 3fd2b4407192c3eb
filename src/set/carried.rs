//! A covariance that is carried along a known path: from integers back to floats, rounded outwards.
//!
//! No float is added or multiplied; floats are decoded from their bits and encoded into bits.

use super::covariance::{ScaledCovariance, target};
use super::{InputError, RadiusSquared, Reach, Trust};
use crate::num::shifted_product;

/// The variances and covariances that a path adds: um^2, um times 2^-24 turn, squares of 2^-24 turn, in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PathNoise {
    pub xx: i64,
    pub xy: i64,
    pub yy: i64,
    pub xt: i64,
    pub yt: i64,
    pub tt: i64,
}

/// A number as `mantissa * 2^power`, the mantissa with its top bit at bit 63.
type Unit = (u64, i32);

/// 1e-12, 1e-6 times 2^-24 turn in radians, and the square of that turn: each within 2^-63 of its value.
const UM2: Unit = (10_141_204_801_825_835_212, -103);
const UM_Q24: Unit = (15_191_809_894_545_354_324, -105);
const Q24_2: Unit = (11_378_879_155_978_302_163, -106);
/// 1e-6, and 2^-32 turn in radians.
const UM: Unit = (9_671_406_556_917_033_398, -83);
const TURN: Unit = (14_488_038_916_154_245_685, -93);
/// 2 pi times 2^32: 2^-24 turn in radians, unit 2^-56.
const LEVER_Q56: i64 = 26_986_075_409;
/// The longest path, micrometres, and the number below which each entry is: then no product below exceeds 2^61.4.
const LONGEST: i64 = 1 << 26;
const LARGER: i64 = 1 << 52;
/// The bound of the errors of a row, without those that grow with the lever: 7, and 2 for the lever's own rounding in entries below 2^40.
pub(super) const ROUNDED: i64 = 9;

/// The covariance of an estimate with the trust in its source applied, to be carried: um^2, um times 2^-24 turn, squares of 2^-24 turn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carriable(ScaledCovariance);

impl Carriable {
    /// Reads a covariance once for all paths.
    ///
    /// # Errors
    /// The [`InputError`] of the covariance.
    pub fn of(covariance: &[[f64; 3]; 3], trust: Trust) -> Result<Self, InputError> {
        const ONE: RadiusSquared = RadiusSquared(1 << 16);
        let p = target(&trust.cross_terms.of(*covariance), Reach::of(ONE, trust))?;
        // The entries beside the diagonal are within their slacks, also in the other half. Wider variances contain every such matrix.
        let wider = |entry: i64, [a, b]: [i64; 2]| entry.saturating_add(a).saturating_add(b);
        Ok(Self(ScaledCovariance {
            xx: wider(p.xx, [p.xy_slack, p.xt_slack]),
            yy: wider(p.yy, [p.xy_slack, p.yt_slack]),
            tt: wider(p.tt, [p.xt_slack, p.yt_slack]),
            ..p
        }))
    }
}

/// Returns the covariance of an estimate after a path `[x, y]`, micrometres in world axes: `G P G'` with the path's noise.
///
/// # Errors
/// [`InputError::CovarianceTooLarge`] if a number is out of range.
pub(crate) fn carried(
    Carriable(p): &Carriable,
    [dx, dy]: [i64; 2],
    noise: &PathNoise,
) -> Result<[[f64; 3]; 3], InputError> {
    let is_small = dx.unsigned_abs().max(dy.unsigned_abs()) <= LONGEST.unsigned_abs();
    let entries = [p.xx, p.yy, p.tt, p.xy, p.xt, p.yt];
    let noises = [noise.xx, noise.yy, noise.tt, noise.xy, noise.xt, noise.yt];
    // The bits of a negative number, inverted, are those of a magnitude.
    let all = entries.iter().chain(&noises);
    if !(is_small && all.fold(0, |bits, entry| bits | (entry ^ (entry >> 63))) < LARGER) {
        return Err(InputError::CovarianceTooLarge);
    }
    // Um per 2^-24 turn of the yaw's error, unit 2^-56: below 2^60.7.
    let a = dy.wrapping_neg().wrapping_mul(LEVER_Q56);
    let b = dx.wrapping_mul(LEVER_Q56);
    let by = shifted_product::<56>;
    let (att, btt) = (by(a, p.tt), by(b, p.tt));
    // A product is rounded by less than a unit, and one of a product by less than a unit and the lever: with m the larger lever, xx, yy and
    // xy are off by m + 3, the entries with the yaw by 1. So the errors of a row are at most 2 m + 7.
    let longest = (a.unsigned_abs().max(b.unsigned_abs()) >> 56) as i64;
    let slack = longest.wrapping_mul(2).wrapping_add(ROUNDED);
    let (aatt, bbtt) = (by(a, att), by(b, btt));
    // The lever is too short by a share d of 1.7e-12. So the covariance is at most 1 + e times the one here and `(1 + 1/e) d^2` times that of the
    // lever's whole swing, for every e. With a third of the last rounding below for e, and both axes, that is 2^-35.7 of the longer swing.
    let swung = aatt.max(bbtt).saturating_abs() >> 35;
    let plane = slack.saturating_add(swung);
    // Twice the cross term and the square of the lever are below 2^62 in magnitude.
    let sum = |parts: [i64; 5]| {
        let sum = parts
            .iter()
            .try_fold(0i64, |sum, part| sum.checked_add(*part));
        sum.filter(|sum| sum.unsigned_abs() < 1 << 60)
            .ok_or(InputError::CovarianceTooLarge)
    };
    let twice = |v: i64| v.saturating_mul(2);
    let xx = sum([p.xx, twice(by(a, p.xt)), aatt, noise.xx, plane])?;
    let yy = sum([p.yy, twice(by(b, p.yt)), bbtt, noise.yy, plane])?;
    let tt = sum([p.tt, 0, 0, noise.tt, slack])?;
    let xy = sum([p.xy, by(a, p.yt), by(b, p.xt), by(a, btt), noise.xy])?;
    let xt = sum([p.xt, att, 0, 0, noise.xt])?;
    let yt = sum([p.yt, btt, 0, 0, noise.yt])?;
    // The rounding of the floats' last bits.
    let up = |entry: i64| entry.wrapping_add(entry >> 40);
    let [xx, yy] = [xx, yy].map(|entry| encoded(up(entry), UM2));
    let tt = encoded(up(tt), Q24_2);
    let xy = encoded(xy, UM2);
    let [xt, yt] = [xt, yt].map(|entry| encoded(entry, UM_Q24));
    Ok([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]])
}

/// Returns a length in micrometres as metres, to the nearest float.
pub(crate) fn metres(um: i64) -> f64 {
    encoded(um, UM)
}

/// Returns a heading of 2^-32 turn in radians, to the nearest float.
pub(crate) fn radians(turn: i32) -> f64 {
    encoded(i64::from(turn), TURN)
}

/// Returns `value mantissa 2^power` as a float, to the nearest.
fn encoded(value: i64, (mantissa, power): Unit) -> f64 {
    let product = u128::from(value.unsigned_abs()).wrapping_mul(u128::from(mantissa));
    if product == 0 {
        return 0.0;
    }
    // 54 bits, the last of which rounds.
    let down = 74u32.wrapping_sub(product.leading_zeros().min(74));
    let rounded = (product.wrapping_shr(down) as u64).wrapping_add(1) >> 1;
    // 2^53 if rounding carried: the next power of two.
    let exponent = power
        .wrapping_add(down as i32)
        .wrapping_add(1 + 52 + 1023)
        .wrapping_add((rounded >> 53) as i32);
    let rounded = rounded.wrapping_shr((rounded >> 53) as u32);
    let bits = (i64::from(exponent) as u64).wrapping_shl(52) | rounded & ((1 << 52) - 1);
    let sign = if value < 0 { 1 << 63 } else { 0 };
    f64::from_bits(bits | sign)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use proptest::prelude::*;

    /// A yaw that is off by turns, carried along a path: the square of the lever would exceed 64 bits.
    #[test]
    fn products_that_could_wrap_are_refused() {
        for yaw in [1e2, 1e3, 4_100.138451401141, 1e4] {
            let p = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, yaw]];
            let start = Carriable::of(&p, Trust::FULL).unwrap();
            for path in [1 << 20, 1 << 24, 1 << 26].map(|um| [0, um]) {
                let found = carried(&start, path, &PathNoise::default());
                assert_eq!(found.is_ok(), yaw < 6e2, "{yaw} {path:?}");
                if let Ok([[xx, ..], ..]) = found {
                    let swung = path[1] as f64 * 1e-6;
                    assert!(xx >= swung * swung * yaw, "{yaw} {path:?}: {xx}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn numbers_are_encoded_to_the_nearest(value in any::<i64>(), bits in 1u32..63) {
            let value = (value >> bits).clamp(-(1 << 61), 1 << 61);
            let near = |found: f64, exact: f64| (found - exact).abs() <= 4.0 * f64::EPSILON * exact.abs();
            prop_assert!(near(metres(value), value as f64 * 1e-6), "{}", metres(value));
            let turn = value as i32;
            prop_assert!(near(radians(turn), f64::from(turn) * TAU / 4_294_967_296.0));
            prop_assert!(near(encoded(value, UM2), value as f64 * 1e-12));
            let q24 = TAU / 16_777_216.0;
            prop_assert!(near(encoded(value, UM_Q24), value as f64 * 1e-6 * q24));
            prop_assert!(near(encoded(value, Q24_2), value as f64 * q24 * q24));
        }

        /// Compared with floats: the carried covariance is slightly larger in every direction.
        #[test]
        fn a_carried_covariance_contains_the_true_one(
            sigma in prop::array::uniform3(1e-3..0.3f64),
            rho in prop::array::uniform3(-0.5..0.5f64),
            step in prop::array::uniform2(-5_000_000i64..5_000_000),
            towards in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let mut p = [[0.0; 3]; 3];
            for i in 0..3 {
                for j in 0..3 {
                    let share = if i == j { 1.0 } else { rho[i + j - 1] };
                    p[i][j] = sigma[i] * sigma[j] * share;
                }
            }
            let noise = PathNoise { xx: 400, xy: 100, yy: 900, xt: 50, yt: -20, tt: 90 };
            let found = carried(&Carriable::of(&p, Trust::FULL).unwrap(), step, &noise).unwrap();
            let [x, y] = step.map(|v| v as f64 * 1e-6);
            let g = [[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]];
            let q24 = TAU / 16_777_216.0;
            let n = [
                [400e-12, 100e-12, 50e-6 * q24],
                [100e-12, 900e-12, -20e-6 * q24],
                [50e-6 * q24, -20e-6 * q24, 90.0 * q24 * q24],
            ];
            let (mut exact, mut got) = (0.0, 0.0);
            for i in 0..3 {
                for j in 0..3 {
                    let mut entry = n[i][j];
                    for k in 0..3 {
                        for l in 0..3 {
                            entry += g[i][k] * p[k][l] * g[j][l];
                        }
                    }
                    exact += towards[i] * towards[j] * entry;
                    got += towards[i] * towards[j] * found[i][j];
                }
            }
            prop_assert!(got >= exact * (1.0 - 1e-9), "{got} {exact}");
            prop_assert!(got <= exact * (1.0 + 1e-4) + 1e-9, "{got} {exact}");
        }
    }
}
