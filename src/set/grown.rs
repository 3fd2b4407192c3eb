//! Scaled covariances of pose-sets that are carried along a path, and the noise that the path adds: always
//! rounded outwards.

use super::covariance::ScaledCovariance;
use super::trust::Scaled;
use super::{RadiusSquared, Reach, SqrtFactor, Trust};
use crate::num::{Float, Rounding, clamped};

/// `10^12`: square metres to square micrometres.
const UM2: (u128, i32) = (1_000_000_000_000, 0);
/// `10^6 * 2^24 / (2 pi) * 2^8`: metre radians to micrometres times 2^-24 turn.
const UM_Q24: (u128, i32) = (683_565_275_576_432, 8);
/// `(2^24 / (2 pi))^2 * 2^7`: square radians to squares of 2^-24 turn.
const Q24_2: (u128, i32) = (912_620_089_792_740, 7);

/// 2 pi, unit 2^-24: too small by 0.07 of a unit, 6e-10 of its value.
const TURN_Q24: i64 = 105_414_357;

/// Upper bound of the diagonal entries.
const LARGEST: i64 = 1 << 60;

impl ScaledCovariance {
    /// Returns `r2 P` of a matrix that need not be definite, or `None` if an entry is 2^60 or more.
    pub(super) fn of(
        [xx, yy, tt]: [Float; 3],
        [xy, xt, yt]: [Float; 3],
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
        let near = |value, unit| {
            let v = scaled(value, unit, reach.plane, Rounding::Nearest)?;
            let relative = (v.unsigned_abs() >> 44) as i64;
            Some((v, relative.wrapping_add(1)))
        };
        let (xy, xy_slack) = near(xy, UM2)?;
        let (xt, xt_slack) = near(xt, UM_Q24)?;
        let (yt, yt_slack) = near(yt, UM_Q24)?;
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

    /// Returns `r2 N` for the noise N of a path. N is a matrix computed in floats from products, symmetric to
    /// its last bits, and may be singular. 2^-40 of its diagonal is added. `None` if an entry is not a number or
    /// exceeds 2^60.
    pub(crate) fn of_noise(noise: [[f64; 3]; 3], radius_squared: RadiusSquared) -> Option<Self> {
        let [[xx, xy, xt], [_, yy, yt], [_, _, tt]] = noise;
        let reach = Reach::of(radius_squared, Trust::FULL);
        let float = |value: f64| Float::of(value);
        let square = Self::of(
            [float(xx)?, float(yy)?, float(tt)?],
            [float(xy)?, float(xt)?, float(yt)?],
            reach,
        )?;
        let up = |v: i64| v.wrapping_add(v >> 40).wrapping_add(1);
        Some(Self {
            xx: up(square.xx),
            yy: up(square.yy),
            tt: up(square.tt),
            ..square
        })
    }

    /// Returns `G F F' G'` for an error `F u` at the start of a path that moves by `step_um` (each below 2^30),
    /// or by up to `away_um` (below 2^29) more in any direction. The rounding of the path is included. `None` if
    /// the yaw is more than a turn or an entry is out of range.
    pub(crate) fn carried(factor: &SqrtFactor, [dx, dy]: [i32; 2], away_um: i32) -> Option<Self> {
        let yaw = i64::from(factor.yaw);
        if yaw > 1 << 24 {
            return None;
        }
        // Radians, unit 2^-28, below 2^31: with this unit a lever is off by at most 2^-28 of the path.
        let radians = yaw.wrapping_mul(TURN_Q24).wrapping_add(1 << 19) >> 20;
        let moved = |entry: i32, lever: i64| -> Option<i64> {
            let by = lever.wrapping_mul(radians).wrapping_add(1 << 27) >> 28;
            let moved = i64::from(entry).wrapping_add(by);
            (moved.unsigned_abs() < 1 << 29).then_some(moved)
        };
        let [x1, x2, x3] = factor.x;
        let [y1, y2, y3] = factor.y;
        let x = [
            moved(x1, i64::from(dy).wrapping_neg())?,
            i64::from(x2),
            i64::from(x3),
        ];
        let y = [moved(y1, i64::from(dx))?, i64::from(y2), i64::from(y3)];
        let dot = |a: [i64; 3], b: [i64; 3]| {
            a.into_iter()
                .zip(b)
                .fold(0i64, |sum, (a, b)| sum.wrapping_add(a.wrapping_mul(b)))
        };
        let longest = i64::from(dx.unsigned_abs().max(dy.unsigned_abs()));
        // The rounding, the ends of the path (1 um, times the yaw), the angle.
        let off = (yaw >> 21).wrapping_add(longest >> 28).wrapping_add(3);
        let beside = off.wrapping_mul(off).wrapping_mul(2 * 4097);
        let carried = Self {
            xx: dot(x, x),
            yy: dot(y, y),
            tt: yaw.wrapping_mul(yaw),
            xy: dot(x, y),
            xt: x[0].wrapping_mul(yaw),
            yt: y[0].wrapping_mul(yaw),
            xy_slack: 0,
            xt_slack: 0,
            yt_slack: 0,
        };
        let carried = carried.enlarged(-12)?.wider(beside)?;
        if away_um == 0 {
            return Some(carried);
        }
        // No start moves the error at the end by more than this: `away_um` times the yaw.
        let swung = (i64::from(away_um).wrapping_mul(radians) >> 28).wrapping_add(4);
        let spread = carried.xx.checked_add(carried.yy)?;
        let bits = |v: i64| 64i32.wrapping_sub(v.leading_zeros() as i32);
        // (1 + p) times the one and (1 + 1/p) times the other, where p is a power of two near the ratio of their
        // roots.
        let power = bits(swung).wrapping_sub(bits(spread) >> 1);
        let power = clamped(i64::from(power), -12, 12) as i32;
        let square = swung.checked_mul(swung)?;
        let beside = square.checked_add(times_power(square, power.wrapping_neg())?)?;
        carried.enlarged(power)?.wider(beside.wrapping_add(1))
    }

    /// Returns the sum of two, or `None` if an entry is out of range.
    pub(crate) fn plus(&self, other: &Self) -> Option<Self> {
        let sum = |a: i64, b: i64| {
            a.checked_add(b)
                .filter(|v| v.unsigned_abs() < LARGEST as u64)
        };
        Some(Self {
            xx: sum(self.xx, other.xx)?,
            yy: sum(self.yy, other.yy)?,
            tt: sum(self.tt, other.tt)?,
            xy: sum(self.xy, other.xy)?,
            xt: sum(self.xt, other.xt)?,
            yt: sum(self.yt, other.yt)?,
            xy_slack: sum(self.xy_slack, other.xy_slack)?,
            xt_slack: sum(self.xt_slack, other.xt_slack)?,
            yt_slack: sum(self.yt_slack, other.yt_slack)?,
        })
    }

    /// Returns this multiplied by `1 + 2^power`.
    fn enlarged(&self, power: i32) -> Option<Self> {
        let more = |v: i64| v.checked_add(times_power(v, power)?);
        // The product is rounded down by less than a unit. The added unit covers that.
        let up = |v: i64| more(v)?.checked_add(1);
        Some(Self {
            xx: up(self.xx)?,
            yy: up(self.yy)?,
            tt: up(self.tt)?,
            xy: more(self.xy)?,
            xt: more(self.xt)?,
            yt: more(self.yt)?,
            xy_slack: up(self.xy_slack)?,
            xt_slack: up(self.xt_slack)?,
            yt_slack: up(self.yt_slack)?,
        })
    }

    /// Returns this with `more` added to the variances of x and y.
    fn wider(&self, more: i64) -> Option<Self> {
        Some(Self {
            xx: self.xx.checked_add(more)?,
            yy: self.yy.checked_add(more)?,
            ..*self
        })
    }
}

/// Returns `v 2^power`, rounded down, or `None` if that is 2^60 or more.
fn times_power(v: i64, power: i32) -> Option<i64> {
    if power < 0 {
        return Some(v.wrapping_shr(power.unsigned_abs().min(63)));
    }
    let room = v.unsigned_abs().leading_zeros();
    (room > power.unsigned_abs().wrapping_add(4)).then(|| v.wrapping_shl(power.unsigned_abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A half, and the relative error of the unit factors, are added outwards: 2^-44 and a unit.
    #[test]
    fn targets_are_rounded_outwards() {
        let float = |value: f64| Float::of(value).unwrap();
        let one = RadiusSquared::from_q16(1 << 16).unwrap();
        let one = Reach::of(one, Trust::FULL);
        let target = ScaledCovariance::of(
            [float(10_000.0), float(1.25e-12), float(2.0)],
            [float(8192.0), float(0.5), float(-0.5)],
            one,
        )
        .unwrap();
        let um2 = 1_000_000_000_000;
        assert_eq!(target.xx, 10_000 * um2 + 568 + 1);
        assert_eq!(target.yy, 3);
        assert_eq!((target.xy, target.xy_slack), (8192 * um2, 465 + 1));
        let q24 = 2f64.powi(24) / core::f64::consts::TAU;
        assert!((target.tt as f64 - 2.0 * q24 * q24 - 1.5).abs() < 0.6);
        let half = 0.5e6 * q24;
        assert!((target.xt as f64 - half).abs() < 1.0 && (target.yt as f64 + half).abs() < 1.0);
        assert_eq!((target.xt_slack, target.yt_slack), (1, 1));
    }
}
