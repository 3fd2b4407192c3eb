//! Converts a covariance of floats to a factor of integers: checks and rounding.
//!
//! # Is it a covariance?
//! Each variance is scaled by a power of four into `[2^28, 2^30)` and each covariance to match. The test for positive
//! definiteness then uses the correlations to 30 bits, for all units and magnitudes. The two pivots of the elimination
//! must exceed the largest error of their rounding ([`is_positive_definite`]).
//!
//! # The target
//! The target is `r2 P` in integer units: [`ScaledCovariance`]. The unit times r2 is one number of 32 bits for each kind of
//! entry ([`Scale`]), so an entry is one product.
//!
//! | rounding | direction | at most |
//! |---|---|---|
//! | unit times r2, to 31 bits: the unit (0 for the plane), the product | up | 2 of its units, 2^-29.2 of the entry |
//! | a variance, to its 32 leading bits | up | 2^-31 of it |
//! | a variance, to the unit of the target | up | 1 |
//! | a covariance, to the correlations' 30 bits | nearest | half a unit of the correlations |
//! | a covariance, to the unit of the target | nearest | 1/2 |
//!
//! A correlation is at most 2^30 of its units and a scale at least 2^30.2, so the first row is worth 1.65 units of
//! the correlations at most. The slack of a covariance is `3 + d` of these units, where d is the difference of its two
//! halves, and `1/2`, rounded up.
//!
//! # The factor
//! The integer ellipsoid contains the true one because `F F' >= r2 P` in the order of positive semi-definite matrices.
//! The elimination (Cholesky, yaw first) leaves residuals off the diagonal of `R = F F' - r2 P`: the remainders of its
//! quotients, which are computed exactly, plus the slack of the target. For each pair of rows the diagonal receives shares
//! h and l with `h l >= residual^2`. The share h comes from rounding up the earlier pivot (the yaw pivot is widened by
//! 2^-11 for it); l is added to the later pivot before its root is taken. R is then a sum of three matrices
//! `[[h, r], [r, l]]`, each positive semi-definite, and of the rest of the diagonal, which is not negative. So the claim
//! needs no assumption on the numbers, and none on the quotients: a worse quotient leaves a larger remainder.
//!
//! | rounding | direction | at most |
//! |---|---|---|
//! | the roots of the pivots | up | 1 |
//! | a quotient, by an inverse ([`Inverse`]) | nearest | 1/2 and 2^-26 of it; no promise depends on it |
//! | residual over pivot, unit 2^-14 | up | 2^-26 of it and 6 |
//! | its square, unit 2^-11 | up | 1 |
//! | the weight `pivot^2 / h` | up | 1/4 |
//! | l | up | 1 |
//!
//! The cost is 2^-11 in yaw, at most about 23 um in x and y, and in y the root of an eighth of x (0.35 mm for 1 m), added
//! as squares.

use core::num::NonZeroU32;

use super::trust::{Reach, Scaled};
use super::{InputError, SqrtFactor};
use crate::num::{
    Divisor, FloatUnit, Inverse, Leading, Rounding, converted, is_finite, product, sqrt_ceil, wide,
};

/// A unit of the target as `factor 2^exponent`, rounded up.
#[derive(Clone, Copy)]
struct Unit {
    factor: u32,
    exponent: i32,
}

/// Square metres to square micrometres: 10^12, exactly.
const UM2: Unit = Unit {
    factor: 3_906_250_000,
    exponent: 8,
};
/// Metre radians to micrometres times 2^-24 turn: 10^6 2^24 / (2 pi).
const UM_Q24: Unit = Unit {
    factor: 2_607_594_588,
    exponent: 10,
};
/// Square radians to squares of 2^-24 turn: (2^24 / (2 pi))^2.
const Q24_2: Unit = Unit {
    factor: 3_481_369_362,
    exponent: 11,
};

/// Largest entry of a factor: 2^28 um (268 m) in a length, 2^29 (32 turns) in yaw.
const LARGEST_LENGTH: i64 = 1 << 28;
const LARGEST_YAW: i64 = 1 << 29;

/// Returns the factor of `r2 P`, rounded outwards, and `r2 P`, or the reason why `p` is not a covariance. The squared radius may differ between
/// the plane and yaw if the terms between them are zero.
#[inline(always)]
pub(super) fn factor(
    p: &[[f64; 3]; 3],
    reach: Reach,
) -> Result<(SqrtFactor, ScaledCovariance), InputError> {
    let target = target(p, reach)?;
    let factor = target.factor().ok_or(InputError::CovarianceTooLarge)?;
    Ok((factor, target))
}

/// Checks a covariance and returns `r2 P`.
#[inline(always)]
pub(super) fn target(p: &[[f64; 3]; 3], reach: Reach) -> Result<ScaledCovariance, InputError> {
    if !p.iter().flatten().all(|value| is_finite(*value)) {
        return Err(InputError::CovarianceNotFinite);
    }
    let [[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]] = *p;
    let [vx, vy, vt] = [xx, yy, tt].map(Leading::of);
    if !(vx.is_positive() && vy.is_positive() && vt.is_positive()) {
        let is_zero = |value: &f64| value.to_bits() << 1 == 0;
        return Err(if p.iter().flatten().all(is_zero) {
            InputError::CovarianceZero
        } else {
            InputError::CovarianceNotPositiveDefinite
        });
    }
    let (hx, hy, ht) = (half(vx), half(vy), half(vt));
    let xy = (xy, yx, hx.wrapping_add(hy));
    let xt = (xt, tx, hx.wrapping_add(ht));
    let yt = (yt, ty, hy.wrapping_add(ht));
    let (Some((c_xy, xy_apart)), Some((c_xt, xt_apart)), Some((c_yt, yt_apart))) =
        (correlation(xy), correlation(xt), correlation(yt))
    else {
        return Err(refusal([xy, xt, yt]));
    };
    let correlations = Correlations {
        diagonal: [rounded(vx), rounded(vy), rounded(vt)],
        xy: i64::from(c_xy),
        xt: i64::from(c_xt),
        yt: i64::from(c_yt),
    };
    if !is_positive_definite(correlations) {
        return Err(InputError::CovarianceNotPositiveDefinite);
    }
    let plane = reach.plane.with_32_bits();
    let yaw = if reach.yaw == reach.plane {
        plane
    } else {
        reach.yaw.with_32_bits()
    };
    let in_plane = Scale::of(UM2, plane);
    let between = Scale::of(UM_Q24, plane);
    let in_yaw = Scale::of(Q24_2, yaw);
    let scales = [in_plane, between, in_yaw];
    let covariances = [
        (c_xy, xy_apart, xy.2),
        (c_xt, xt_apart, xt.2),
        (c_yt, yt_apart, yt.2),
    ];
    scaled([vx, vy, vt], covariances, scales).ok_or(InputError::CovarianceTooLarge)
}

/// Returns the variances and covariances in units of the target; `None` if one is out of range. A covariance is a correlation, the distance of its two
/// halves and an exponent. Inlined: a closure of [`target`] is compiled once for all callers, which costs 150 instructions (M4F).
#[inline(always)]
fn scaled(
    [vx, vy, vt]: [Leading; 3],
    [xy, xt, yt]: [(i32, Option<u32>, i32); 3],
    [in_plane, between, in_yaw]: [Scale; 3],
) -> Option<ScaledCovariance> {
    let (xy, xy_slack) = in_plane.covariance(xy.0, xy.1, xy.2)?;
    let (xt, xt_slack) = between.covariance(xt.0, xt.1, xt.2)?;
    let (yt, yt_slack) = between.covariance(yt.0, yt.1, yt.2)?;
    Some(ScaledCovariance {
        xx: in_plane.variance(vx)?,
        yy: in_plane.variance(vy)?,
        tt: in_yaw.variance(vt)?,
        xy,
        xt,
        yt,
        xy_slack,
        xt_slack,
        yt_slack,
    })
}

/// Returns the h for which `variance 2^(2h)` lies in `[2^28, 2^30)`.
const fn half(variance: Leading) -> i32 {
    (-2i32).wrapping_sub(variance.exponent) >> 1
}

/// Returns a variance in the correlations' units, rounded to within 1.
fn rounded(variance: Leading) -> i64 {
    let power = half(variance) << 1;
    variance.nearest(power).map_or(0, i64::from)
}

/// The largest difference of the two halves of a covariance, in units of the correlations.
const LARGEST_DIFFERENCE: u32 = 1 << 10;

/// Returns a covariance times `2^power`, to the nearest, and the difference of the roundings of its halves (`None` if both
/// halves are zero). Returns `None` if it is beyond every correlation or if the halves differ too much.
fn correlation((upper, lower, power): Pair) -> Option<(i32, Option<u32>)> {
    let signed = |leading: Leading| -> Option<i32> {
        let magnitude = leading.nearest(power)? as i32;
        Some(if leading.negative {
            magnitude.wrapping_neg()
        } else {
            magnitude
        })
    };
    let first = Leading::of(upper);
    let entry = signed(first)?;
    if upper.to_bits() == lower.to_bits() {
        return Some((entry, (first.bits != 0).then_some(0)));
    }
    // Up to 2^31.
    let apart = entry.abs_diff(signed(Leading::of(lower))?);
    (apart <= LARGEST_DIFFERENCE).then_some((entry, Some(apart)))
}

/// The two halves of a covariance, and the power of two that makes it a correlation.
type Pair = (f64, f64, i32);

/// Returns the reason to refuse covariances of which one is far beyond every correlation, or the halves differ.
#[cold]
fn refusal(pairs: [Pair; 3]) -> InputError {
    let is_symmetric = |(upper, lower, power): Pair| {
        let unit = FloatUnit::new(1, power.wrapping_neg());
        let scaled = |value: f64| converted(value, &unit, Rounding::Nearest).ok();
        match (scaled(upper), scaled(lower)) {
            (Some(upper), Some(lower)) => upper.abs_diff(lower) <= u64::from(LARGEST_DIFFERENCE),
            (None, None) => true,
            _ => false,
        }
    };
    if pairs.into_iter().all(is_symmetric) {
        InputError::CovarianceNotPositiveDefinite
    } else {
        InputError::CovarianceNotSymmetric
    }
}

/// The covariance with each variable scaled by a power of two, to 30 bits.
#[derive(Clone, Copy)]
pub(super) struct Correlations {
    /// Diagonal: x, y, yaw, each in `[2^28, 2^30]`, rounded to within 1.
    pub(super) diagonal: [i64; 3],
    pub(super) xy: i64,
    pub(super) xt: i64,
    pub(super) yt: i64,
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
    let minor = |a: i64, b: i64, c: i64, d: i64| {
        product(a as i32, b as i32).wrapping_sub(product(c as i32, d as i32))
    };
    let (first_x, first_y) = (minor(t, x, c.xt, c.xt), minor(t, y, c.yt, c.yt));
    let margin = 1i64 << 34;
    if !(first_x > margin && first_y > margin) {
        return false;
    }
    let between = minor(c.xy, t, c.xt, c.yt);
    if is_well_definite(first_x, first_y, between) {
        return true;
    }
    let (x, y) = (divisor.floor(first_x), divisor.floor(first_y));
    let xy = divisor.nearest(between);
    if xy.unsigned_abs() > 1 << 30 {
        return false;
    }
    let margin = x.wrapping_add(y).wrapping_mul(80).wrapping_add(1600);
    minor(x, y, xy, xy) > margin
}

/// Returns `true` if the second pivot is certain to exceed its rounding, without a quotient.
///
/// With `k = 2^30 / t`, between 1 and 4, and a, b, d the minors and the product over 2^30, rounded down, the Schur
/// complement is `x' >= k a - 1`, `y' >= k b - 1`, `|xy'| <= k (|d| + 1) + 1/2` and `x' + y' <= k (a + b + 2)`. Then
/// `x' y' - xy'^2 > 80 (x' + y') + 1600` follows from `a b - d^2 > 81 (a + b) + 3 |d| + 1763`, where `2 |d| < a + b` as
/// `a b > d^2`.
fn is_well_definite(first_x: i64, first_y: i64, between: i64) -> bool {
    let high = |v: i64| (v >> 30) as i32;
    let (a, b, d) = (high(first_x), high(first_y), high(between));
    // a and b are at most 2^30, and |d| at most 2^31.
    let sum = a.wrapping_add(b).unsigned_abs();
    product(a, b).wrapping_sub(product(d, d)) > wide(sum, 84).wrapping_add(2048) as i64
}

/// A unit of the target times the squared radius: `bits 2^exponent`, rounded up by less than 2 of its units.
#[derive(Clone, Copy)]
struct Scale {
    /// Above 2^30.2.
    bits: u32,
    exponent: i32,
}

impl Scale {
    /// Returns the scale for a squared radius with 32 bits.
    fn of(unit: Unit, reach: Scaled) -> Self {
        let product = wide(unit.factor, reach.mantissa());
        Self {
            // No factor is so near to 2^32 that this wraps.
            bits: ((product >> 32) as u32).wrapping_add(1),
            exponent: unit.exponent.wrapping_add(32).wrapping_sub(reach.down()),
        }
    }

    /// Returns a variance in units of the target, rounded up, or `None` if it is too large for a factor.
    fn variance(self, variance: Leading) -> Option<i64> {
        let down = variance.exponent.wrapping_add(self.exponent).wrapping_neg();
        // Below 2^4 the result is 2^59 or more.
        if down < 4 {
            return None;
        }
        let product = wide(variance.bits, self.bits).wrapping_add(u64::from(self.bits));
        let whole = product.wrapping_shr(down.min(63).unsigned_abs());
        Some((whole as i64).wrapping_add(1))
    }

    /// Returns a covariance `entry 2^-power` in units of the target, and its slack, or `None` if a variance is too large
    /// for a factor.
    fn covariance(self, entry: i32, apart: Option<u32>, power: i32) -> Option<(i64, i64)> {
        let Some(apart) = apart else {
            return Some((0, 0));
        };
        let down = power.wrapping_sub(self.exponent);
        // The product of the roots of the two variances is then 2^58 or more.
        if down < 1 {
            return None;
        }
        let before = down.wrapping_sub(1).min(62).unsigned_abs();
        let nearest = |product: u64| (product.wrapping_shr(before).wrapping_add(1) >> 1) as i64;
        let magnitude = nearest(wide(entry.unsigned_abs(), self.bits));
        let slack = nearest(wide(apart.wrapping_add(3), self.bits)).wrapping_add(1);
        let entry = if entry < 0 {
            magnitude.wrapping_neg()
        } else {
            magnitude
        };
        Some((entry, slack))
    }
}

/// `r2 P` in integer units (um^2, um times 2^-24 turn, squares of 2^-24 turn), below 2^60. Each diagonal entry is rounded
/// up; each other entry is within its `slack`.
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

/// A pivot of the elimination.
struct Pivot {
    value: i32,
    inverse: Inverse,
    /// The pivot's own rounding gives the share `pivot^2 / weight` to each residual. Unit 1/4.
    weight: u32,
}

/// Returns the weight of the pivot `yaw = q + w`, for q below 2^29 and `w = floor(q / 2^11) + 1`.
///
/// As `yaw^2 - q^2 >= 2 q w`, the shares of x and y are `q w` each: `yaw^2 / (q/w + 2 + w/q)`. From q = 4 on, w/q is at
/// most 1/4; below, w is 1.
fn yaw_weight(q: u32, w: u32) -> u32 {
    let quotient = NonZeroU32::new(w).map_or(u32::MAX >> 1, |w| (q << 2).div_ceil(w.get()));
    let rest = match q {
        0 | 1 => 4,
        2 | 3 => 2,
        _ => 1,
    };
    quotient.wrapping_add(8).wrapping_add(rest)
}

impl Pivot {
    /// Returns the pivot of a value above zero.
    fn of(value: i32, weight: u32) -> Self {
        Self {
            value,
            inverse: Inverse::of(value.unsigned_abs()),
            weight,
        }
    }

    /// Returns the quotient of an entry by the pivot, near the nearest integer, and the share of the other diagonal entry:
    /// the square of the largest residual over the pivot's share, rounded up. `None` if the quotient reaches
    /// [`LARGEST_LENGTH`] or the residual 2^17 pivots.
    fn divide(&self, entry: i64, slack: i64) -> Option<(i32, i64)> {
        let magnitude = entry.unsigned_abs();
        let quotient = self.inverse.times::<1>(magnitude).saturating_add(1) >> 1;
        if quotient >= LARGEST_LENGTH.unsigned_abs() {
            return None;
        }
        let quotient = quotient as i32;
        let residual = magnitude.wrapping_sub(product(quotient, self.value) as u64) as i64;
        let residual = residual.unsigned_abs().wrapping_add(slack.unsigned_abs());
        let signed = if entry < 0 {
            quotient.wrapping_neg()
        } else {
            quotient
        };
        if residual == 0 {
            return Some((signed, 0));
        }
        // Residual over pivot, unit 2^-14, rounded up: `times` loses less than 2^-27 and 2.
        let ratio = self.inverse.times::<14>(residual);
        if ratio >= 1 << 31 {
            return None;
        }
        let ratio = (ratio as u32)
            .wrapping_add(ratio as u32 >> 26)
            .wrapping_add(4);
        // Unit 2^-11.
        let square = (wide(ratio, ratio) >> 17).wrapping_add(1);
        let share = if square >> 32 == 0 {
            wide(square as u32, self.weight)
        } else {
            square.checked_mul(u64::from(self.weight))?
        } >> 13;
        Some((signed, (share as i64).wrapping_add(1)))
    }
}

impl ScaledCovariance {
    /// Runs the elimination of the module's head. Returns `None` if an entry exceeds its limit.
    #[inline(always)]
    pub(crate) fn factor(&self) -> Option<SqrtFactor> {
        let root = |square: i64| sqrt_ceil(square.max(0).unsigned_abs());
        let limited = |value: i64, limit: i64| (value < limit).then_some(value as i32);
        let squared = |v: i32| product(v, v);

        let q = root(self.tt).max(1);
        let wider = (q >> 11).wrapping_add(1);
        let yaw = limited(q.wrapping_add(wider), LARGEST_YAW)?;
        let weight = yaw_weight(q as u32, wider as u32);
        let by_yaw = Pivot::of(yaw, weight);
        let (x1, x_share) = by_yaw.divide(self.xt, self.xt_slack)?;
        let (y1, y_share) = by_yaw.divide(self.yt, self.yt_slack)?;

        let square = self.xx.wrapping_sub(squared(x1)).wrapping_add(x_share);
        // x2 = q + 1 gives x2^2 - q^2 = 2 x2 - 1, which is at least x2^2 / ((x2 + 1) / 2).
        let x2 = limited(root(square).wrapping_add(1), LARGEST_LENGTH)?;
        let by_x = Pivot::of(x2, x2.unsigned_abs().wrapping_add(1) << 1);
        let rest = self.xy.wrapping_sub(product(x1, y1));
        let (y2, y_more) = by_x.divide(rest, self.xy_slack)?;

        let square = self
            .yy
            .wrapping_sub(squared(y1))
            .wrapping_sub(squared(y2))
            .wrapping_add(y_share)
            .wrapping_add(y_more);
        let y3 = limited(root(square), LARGEST_LENGTH)?;
        Some(SqrtFactor {
            yaw,
            x: [x1, x2, 0],
            y: [y1, y2, y3],
        })
    }
}

#[cfg(test)]
mod tests;
