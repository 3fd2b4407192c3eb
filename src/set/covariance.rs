//! Converts a covariance of floats to a factor of integers: checks and rounding.
//!
//! # Is it a covariance?
//! Each variance is scaled by a power of four into `[2^28, 2^30)` and each covariance to match. The test for positive
//! definiteness then uses the correlations to 30 bits, for all units and magnitudes. The two pivots of the elimination
//! must exceed the largest error of their rounding ([`is_positive_definite`]).
//!
//! # The factor
//! The integer ellipsoid contains the true one because `F F' >= r2 P` in the order of positive semi-definite matrices.
//! The elimination (Cholesky, yaw first) leaves residuals off the diagonal of `R = F F' - r2 P`. Each is bounded by
//! half a pivot plus the slack of the target. For each pair of rows the diagonal receives shares h and l with
//! `h l >= residual^2`. The share h comes from rounding up the earlier pivot (the yaw pivot is widened by 2^-11 for
//! it); l is added to the later pivot before its root is taken. R is then a sum of three matrices `[[h, r], [r, l]]`,
//! each positive semi-definite, and of the rest of the diagonal, which is not negative. So the claim needs no
//! assumption on the numbers. The cost is 2^-11 in yaw, and about 22 um in x and y.

use super::given::Target;
use super::trust::{Reach, Scaled};
use super::{InputError, SqrtFactor};
use crate::num::{Divisor, Float, Rounding, clamped, sqrt_ceil};

/// Indices of rows and columns as callers pass them.
const X: usize = 0;
const Y: usize = 1;
const YAW: usize = 2;

/// `10^12`: square metres to square micrometres.
const UM2: (u128, i32) = (1_000_000_000_000, 0);
/// `10^6 * 2^24 / (2 pi) * 2^8`: metre radians to micrometres times 2^-24 turn.
const UM_Q24: (u128, i32) = (683_565_275_576_432, 8);
/// `(2^24 / (2 pi))^2 * 2^7`: square radians to squares of 2^-24 turn.
const Q24_2: (u128, i32) = (912_620_089_792_740, 7);

/// Largest entry of a factor: 2^28 um (268 m) in a length, 2^29 (32 turns) in yaw.
const LARGEST_LENGTH: i64 = 1 << 28;
const LARGEST_YAW: i64 = 1 << 29;

/// Returns the factor of `r2 P`, rounded outwards, and a bound from inside, or the reason why `p` is not a covariance.
/// The squared radius may differ between the plane and yaw if the terms between them are zero.
pub(super) fn factor(
    [[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]]: [[f64; 3]; 3],
    reach: Reach,
) -> Result<(SqrtFactor, Target), InputError> {
    let float = |value: f64| Float::of(value).ok_or(InputError::CovarianceNotFinite);
    let diagonal = [float(xx)?, float(yy)?, float(tt)?];
    let pairs = [
        (X, Y, float(xy)?, float(yx)?),
        (X, YAW, float(xt)?, float(tx)?),
        (Y, YAW, float(yt)?, float(ty)?),
    ];
    if diagonal.iter().all(|v| v.is_zero())
        && pairs.iter().all(|(_, _, a, b)| a.is_zero() && b.is_zero())
    {
        return Err(InputError::CovarianceZero);
    }
    let [vx, vy, vt] = diagonal;
    if !(vx.is_positive() && vy.is_positive() && vt.is_positive()) {
        return Err(InputError::CovarianceNotPositiveDefinite);
    }
    let correlations = correlations(diagonal, pairs)?;
    if !is_positive_definite(correlations) {
        return Err(InputError::CovarianceNotPositiveDefinite);
    }
    let [(_, _, xy, yx), (_, _, xt, tx), (_, _, yt, ty)] = pairs;
    let target = ScaledCovariance::of(diagonal, [(xy, yx), (xt, tx), (yt, ty)], reach)
        .ok_or(InputError::CovarianceTooLarge)?;
    let factor = target.factor().ok_or(InputError::CovarianceTooLarge)?;
    Ok((factor, Target::of(&target)))
}

/// The covariance with each variable scaled by a power of two, to 30 bits.
#[derive(Clone, Copy)]
pub(super) struct Correlations {
    /// Diagonal: x, y, yaw, each in `[2^28, 2^30)`, rounded to within 1.
    pub(super) diagonal: [i64; 3],
    pub(super) xy: i64,
    pub(super) xt: i64,
    pub(super) yt: i64,
}

type Pair = (usize, usize, Float, Float);

fn correlations(diagonal: [Float; 3], pairs: [Pair; 3]) -> Result<Correlations, InputError> {
    // `variance * 2^(2 half)` lies in [2^28, 2^30).
    let half = |variance: Float| 29i32.wrapping_sub(variance.top_bit()) >> 1;
    let [hx, hy, ht] = diagonal.map(half);
    let scaled = |value: Float, power: i32| -> Option<i64> {
        value.scaled(1, power.wrapping_neg(), Rounding::Nearest)
    };
    let mut entries = [0i64; 3];
    for (entry, (row, column, upper, lower)) in entries.iter_mut().zip(pairs) {
        let power = |axis: usize| match axis {
            X => hx,
            Y => hy,
            _ => ht,
        };
        let power = power(row).wrapping_add(power(column));
        // A value that does not fit at all is a correlation far beyond 1.
        let limit = 1i64 << 30;
        *entry = match (scaled(upper, power), scaled(lower, power)) {
            (Some(upper), Some(lower)) if upper.abs_diff(lower) <= 1 << 10 => {
                clamped(upper, limit.wrapping_neg(), limit)
            }
            (None, None) => limit,
            _ => return Err(InputError::CovarianceNotSymmetric),
        };
    }
    let [xy, xt, yt] = entries;
    let [vx, vy, vt] = diagonal;
    let variance = |v: Float, h: i32| scaled(v, h.wrapping_mul(2)).unwrap_or(0);
    Ok(Correlations {
        diagonal: [variance(vx, hx), variance(vy, hy), variance(vt, ht)],
        xy,
        xt,
        yt,
    })
}

/// Returns `true` if both pivots of the elimination, yaw first, exceed their rounding.
///
/// All entries are at most 2^30 and within 1 of the true ones. The first minor `t x - xt^2` is then
/// within 2^33 of the true one. Divided by t >= 2^28 and rounded, `x'`, `y'` and `xy'` are within 40
/// of the true Schur complement, so the second minor is within 40 (x' + y' + 2 |xy'|) + 1600 <=
/// 80 (x' + y') + 1600 of the true one whenever that is positive.
pub(super) fn is_positive_definite(c: Correlations) -> bool {
    let [x, y, t] = c.diagonal;
    let Some(divisor) = Divisor::new(t) else {
        return false;
    };
    // Each product is at most 2^60.
    let minor = |a: i64, b: i64, ab: i64| a.wrapping_mul(b).wrapping_sub(ab.wrapping_mul(ab));
    let (first_x, first_y) = (minor(t, x, c.xt), minor(t, y, c.yt));
    let margin = 1i64 << 34;
    if !(first_x > margin && first_y > margin) {
        return false;
    }
    let (x, y) = (divisor.floor(first_x), divisor.floor(first_y));
    let product = c.xy.wrapping_mul(t).wrapping_sub(c.xt.wrapping_mul(c.yt));
    let xy = divisor.nearest(product);
    if xy.unsigned_abs() > 1 << 30 {
        return false;
    }
    let margin = x.wrapping_add(y).wrapping_mul(80).wrapping_add(1600);
    minor(x, y, xy) > margin
}

/// `r2 P` in integer units (um^2, um times 2^-24 turn, squares of 2^-24 turn). Each diagonal entry is rounded up; each
/// other entry is within its `slack`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct ScaledCovariance {
    pub(super) xx: i64,
    pub(super) yy: i64,
    pub(super) tt: i64,
    pub(super) xy: i64,
    pub(super) xt: i64,
    pub(super) yt: i64,
    pub(super) xy_slack: i64,
    pub(super) xt_slack: i64,
    pub(super) yt_slack: i64,
}

impl ScaledCovariance {
    /// Returns the scaled covariance, or `None` if an entry is 2^60 or more.
    pub(super) fn of(
        [xx, yy, tt]: [Float; 3],
        [(xy, yx), (xt, tx), (yt, ty)]: [(Float, Float); 3],
        reach: Reach,
    ) -> Option<Self> {
        let scaled = |value: Float, (factor, shift): (u128, i32), reach: Scaled, rounding| {
            let factor = factor.wrapping_mul(u128::from(reach.mantissa()));
            value
                .scaled(factor, shift.wrapping_add(reach.down()), rounding)
                .filter(|v| v.unsigned_abs() < 1 << 60)
        };
        // The factors above are within 2^-49 of the true ones: 2^-44 covers that.
        let up = |value, unit, reach| {
            let v = scaled(value, unit, reach, Rounding::AwayFromZero)?;
            Some(v.wrapping_add(v >> 44).wrapping_add(1))
        };
        let near = |upper, lower, unit| {
            let u = scaled(upper, unit, reach.plane, Rounding::Nearest)?;
            let l = scaled(lower, unit, reach.plane, Rounding::Nearest)?;
            let slack = i64::try_from(u.abs_diff(l)).ok()?;
            let relative = (u.unsigned_abs() >> 44) as i64;
            Some((u, slack.wrapping_add(relative).wrapping_add(1)))
        };
        let (xy, xy_slack) = near(xy, yx, UM2)?;
        let (xt, xt_slack) = near(xt, tx, UM_Q24)?;
        let (yt, yt_slack) = near(yt, ty, UM_Q24)?;
        Some(Self {
            xx: up(xx, UM2, reach.plane)?,
            yy: up(yy, UM2, reach.plane)?,
            tt: up(tt, Q24_2, reach.yaw)?,
            xy,
            xt,
            yt,
            xy_slack,
            xt_slack,
            yt_slack,
        })
    }

    /// Runs the elimination of the module's head. Returns `None` if an entry exceeds its limit.
    pub(crate) fn factor(&self) -> Option<SqrtFactor> {
        let root = |square: i64| sqrt_ceil(square.max(0).unsigned_abs());
        let limited = |value: i64, limit: i64| {
            (value.unsigned_abs() < limit.unsigned_abs())
                .then_some(value)
                .and_then(|v| i32::try_from(v).ok())
        };
        let squared = |v: i32| i64::from(v).wrapping_mul(i64::from(v));
        // The largest residual of a quotient by a pivot, squared, divided by the share h from the pivot's own rounding:
        // the share l that the other diagonal entry needs.
        let loading = |pivot: i32, slack: i64, spare: i64| -> Option<i64> {
            let residual = (i64::from(pivot) >> 1).checked_add(1)?.checked_add(slack)?;
            Some(Divisor::new(spare)?.ceil(residual.checked_mul(residual)?))
        };

        // yaw = q (1 + 2^-11) + 1 gives yaw^2 - q^2 >= 2 q (1 + floor(q / 2^11)): a share for each of
        // x and y.
        let q = root(self.tt);
        let wider = (q >> 11).wrapping_add(1);
        let yaw = limited(q.wrapping_add(wider), LARGEST_YAW)?;
        let share = q.checked_mul(wider)?;
        let by_yaw = Divisor::new(i64::from(yaw))?;
        let x1 = limited(by_yaw.nearest(self.xt), LARGEST_LENGTH)?;
        let y1 = limited(by_yaw.nearest(self.yt), LARGEST_LENGTH)?;

        let square =
            self.xx
                .checked_sub(squared(x1))?
                .checked_add(loading(yaw, self.xt_slack, share)?)?;
        // (q + 1)^2 - q^2 >= q + 1: the spare for y.
        let x2 = limited(root(square).wrapping_add(1), LARGEST_LENGTH)?;
        let by_x = Divisor::new(i64::from(x2))?;
        let rest = self
            .xy
            .checked_sub(i64::from(x1).wrapping_mul(i64::from(y1)))?;
        let y2 = limited(by_x.nearest(rest), LARGEST_LENGTH)?;

        let square = self
            .yy
            .checked_sub(squared(y1))?
            .checked_sub(squared(y2))?
            .checked_add(loading(yaw, self.yt_slack, share)?)?
            .checked_add(loading(x2, self.xy_slack, i64::from(x2))?)?;
        let y3 = limited(root(square), LARGEST_LENGTH)?;
        Some(SqrtFactor {
            yaw,
            x: [x1, x2, 0],
            y: [y1, y2, y3],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::set::{RadiusSquared, Trust};
    use proptest::prelude::*;

    /// Returns `true` if no principal minor of a symmetric matrix is below zero. Entries below 2^40.
    fn is_semidefinite([[a, d, e], [_, b, f], [_, _, c]]: [[i128; 3]; 3]) -> bool {
        let determinant = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e);
        [a, b, c].iter().all(|v| *v >= 0)
            && a * b >= d * d
            && a * c >= e * e
            && b * c >= f * f
            && determinant >= 0
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(10_000, 40)))]
        /// Exactly: `F F' - T` has no negative direction for any T within the slack, and the diagonal is larger only by
        /// the loading and the roots.
        #[test]
        fn factors_of_integers_dominate(
            bits in proptest::array::uniform3(1u32..19),
            root in proptest::array::uniform6(-(1i64 << 18)..1 << 18),
            slack_bits in proptest::array::uniform3(0u32..12),
        ) {
            let [q, x2, y3] = [0, 1, 2].map(|k| (root[k].abs() >> (18 - bits[k].min(18))) + 1);
            let [x1, y1, y2] = [root[3] % (x2 + 1), root[4] % (y3 + 1), root[5] % (y3 + 1)];
            let [xy_slack, xt_slack, yt_slack] = slack_bits.map(|b| 1 << b);
            let target = ScaledCovariance {
                xx: x1 * x1 + x2 * x2,
                yy: y1 * y1 + y2 * y2 + y3 * y3,
                tt: q * q,
                xy: x1 * y1 + x2 * y2,
                xt: q * x1,
                yt: q * y1,
                xy_slack,
                xt_slack,
                yt_slack,
            };
            let SqrtFactor { yaw, x, y } = target.factor().unwrap();
            let wide = |row: [i32; 3]| row.map(i128::from);
            let (yaw, x, y) = (i128::from(yaw), wide(x), wide(y));
            let dot = |a: [i128; 3], b: [i128; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<i128>();
            let beyond = |got: i128, from: i64| got - i128::from(from);
            let (tt, xx, yy) = (
                beyond(yaw * yaw, target.tt),
                beyond(dot(x, x), target.xx),
                beyond(dot(y, y), target.yy),
            );
            for signs in 0..8 {
                let off = |bit: i64, slack: i64| if signs >> bit & 1 == 0 { slack } else { -slack };
                let xt = beyond(yaw * x[0], target.xt + off(0, xt_slack));
                let yt = beyond(yaw * y[0], target.yt + off(1, yt_slack));
                let xy = beyond(dot(x, y), target.xy + off(2, xy_slack));
                prop_assert!(is_semidefinite([[tt, xt, yt], [xt, xx, xy], [yt, xy, yy]]));
            }
            let share = (q * ((q >> 11) + 1)) as f64;
            let loading = |pivot: i128, slack: i64, spare: f64| {
                (pivot as f64 / 2.0 + 1.0 + slack as f64).powi(2) / spare + 1.0
            };
            let room = |extra: f64, square: i64, root: f64| {
                let square = square as f64 + extra;
                extra + root * (2.0 * square.sqrt() + root) + 1e-3
            };
            let (x_loading, y_loading) = (
                loading(yaw, xt_slack, share),
                loading(yaw, yt_slack, share) + loading(x[1], xy_slack, x[1] as f64),
            );
            prop_assert_eq!(yaw, i128::from(q + (q >> 11) + 1));
            prop_assert!(xx as f64 <= room(x_loading, target.xx, 2.0));
            prop_assert!(yy as f64 <= room(y_loading, target.yy, 1.0));
        }
    }

    /// A half, and the relative error of the unit factors, are added outwards: 2^-44 and a unit.
    #[test]
    fn targets_are_rounded_outwards() {
        let float = |value: f64| Float::of(value).unwrap();
        let one = RadiusSquared::from_q16(1 << 16).unwrap();
        let one = Reach::of(one, Trust::FULL);
        let lower = 8192.0 - 1.0 / 1024.0;
        let target = ScaledCovariance::of(
            [float(10_000.0), float(1.25e-12), float(2.0)],
            [
                (float(8192.0), float(lower)),
                (float(0.5), float(0.5)),
                (float(-0.5), float(0.0)),
            ],
            one,
        )
        .unwrap();
        let um2 = 1_000_000_000_000;
        assert_eq!(target.xx, 10_000 * um2 + 568 + 1);
        assert_eq!(target.yy, 3);
        assert_eq!(
            (target.xy, target.xy_slack),
            (8192 * um2, um2 / 1024 + 465 + 1)
        );
        let q24 = 2f64.powi(24) / core::f64::consts::TAU;
        assert!((target.tt as f64 - 2.0 * q24 * q24 - 1.5).abs() < 0.6);
        let half = 0.5e6 * q24;
        assert!((target.xt as f64 - half).abs() < 1.0 && (target.yt as f64 + half).abs() < 1.0);
        assert_eq!((target.xt_slack, target.yt_slack), (1, target.xt + 1));
    }
}
