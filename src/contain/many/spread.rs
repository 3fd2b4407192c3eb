//! A Gaussian pose-set in floats: bounds of the set of integers that a decision uses instead.
//!
//! Lengths are in micrometres, headings in radians. The set of integers is `{ F u : |u| <= 1 }` with `F F' = T + R`, where T is
//! `r2 P` and R has no negative direction. So R is at most three times its own diagonal, in every direction. The diagonal
//! follows from the head of `set::covariance`. X, Y and Q are the roots of the diagonal of T, Q in 2^-24 turn.
//!
//! | entry of the diagonal of R | at most | with the limits below |
//! |---|---|---|
//! | yaw: `Q + Q / 2^11 + 1` instead of Q, and one unit of T's rounding | `(Q (1 + 2^-10) + 4)^2 - Q^2` | `24e-4 Q^2 + 5e4` |
//! | x: the share of a residual over the pivot of yaw; a root that is up by 2; T's rounding | `S + 4 (X + S^0.5) + 10 + 1e-8 X^2` | `21e-5 X^2 + 23e3` |
//! | y: the same, and the share of a residual over the pivot of x | `S + S' + 4 (Y + (S + S')^0.5) + 10 + 1e-8 Y^2` | `45e-5 Y^2 + 21e-6 X^2 + 7e4` |
//!
//! The share of a residual of `ratio` pivots is `2^11 ratio^2` for yaw and `(x2 + 1) ratio^2 / 2` for x, both up by less than 2 %
//! and 8. A ratio is at most a half, 2^-26 of the quotient, the slack of the covariance (`3 2^-28` of the root of both
//! variances, and 2) over the pivot, and 1e-3. So `S <= 2010` for pivots of yaw from 64 on and roots up to 4 m. The second
//! pivot x2 is at most `X + 50`, and at least `X / 452` since the determinant is at least 5e-6 of the product of the variances:
//! `ratio <= 0.51 + 904 / X + 6e-6 Y`. Terms in X and Y themselves are bounded by `4 X <= 2e-4 X^2 + 2e4`.

use super::angle::{LARGEST, binary, cos_sin};
use crate::pose::Pose;
use crate::set::RadiusSquared;

/// 2^-24 turn in radians, and 2^-32 turn per radian.
const RADIANS_PER_Q24: f64 = core::f64::consts::TAU / 16_777_216.0;
const Q32_PER_RADIAN: f64 = 4_294_967_296.0 / core::f64::consts::TAU;
/// Smallest and largest variance of a length times the squared radius, square metres: 100 um and 4 m.
const LENGTH: [f64; 2] = [1e-8, 16.0];
/// The same of a heading: 1e-4 rad, which is 267 units of 2^-24 turn, and 6 rad.
const YAW: [f64; 2] = [1e-8, 36.0];
/// Smallest determinant over the product of the variances.
const LEAST_DETERMINANT: f64 = 5e-6;

/// A symmetric matrix over x, y and yaw: um^2, um rad, rad^2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Square {
    pub xx: f64,
    pub xy: f64,
    pub xt: f64,
    pub yy: f64,
    pub yt: f64,
    pub tt: f64,
}

impl Square {
    /// Returns the square of the extent along a vector.
    #[inline(always)]
    pub fn along(&self, [x, y, t]: [f64; 3]) -> f64 {
        x * (self.xx * x + self.xy * y + self.xt * t)
            + y * (self.xy * x + self.yy * y + self.yt * t)
            + t * (self.xt * x + self.yt * y + self.tt * t)
    }

    /// Returns the matrix in axes that are turned by the angle with this cosine and sine.
    #[inline(always)]
    pub fn turned(&self, [c, s]: [f64; 2]) -> Self {
        // Rows of the plane times the turn, on both sides.
        let (ax, ay) = (c * self.xx + s * self.xy, c * self.xy + s * self.yy);
        let (bx, by) = (c * self.xy - s * self.xx, c * self.yy - s * self.xy);
        Self {
            xx: c * ax + s * ay,
            xy: c * ay - s * ax,
            xt: c * self.xt + s * self.yt,
            yy: c * by - s * bx,
            yt: c * self.yt - s * self.xt,
            tt: self.tt,
        }
    }
}

/// A pose: its place from the goal in world axes, and its heading.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub x: f64,
    pub y: f64,
    /// Heading above the goal's, 2^-32 turn, within 3 of them.
    pub above_goal: u32,
    /// Cosine and sine of the heading.
    pub facing: [f64; 2],
}

/// A pose-set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    pub estimate: Point,
    /// At least `F F'` in every direction.
    pub above: Square,
    /// At least the length of every offset in the plane.
    pub broad: f64,
    /// At least the largest turn, radians.
    pub turn: f64,
}

impl Spread {
    /// Returns `None` if the filter leaves the set to the integer code: invalid or unusual numbers.
    #[inline(always)]
    pub fn new(
        [x_m, y_m, yaw]: [f64; 3],
        covariance: &[[f64; 3]; 3],
        radius_squared: RadiusSquared,
        goal: Pose,
    ) -> Option<Self> {
        let [[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]] = *covariance;
        let r2 = f64::from(radius_squared.q16()) / 65_536.0;
        let within = |v: f64, [least, most]: [f64; 2]| (v * r2 >= least) & (v * r2 <= most);
        let (x_y, x_t, y_t) = (xx * yy, xx * tt, yy * tt);
        let determinant =
            xx * (y_t - yt * yt) - xy * (xy * tt - xt * yt) + xt * (xy * yt - xt * yy);
        // A comparison with a NaN is false.
        let is_valid = x_m.abs() <= 1_999.0
            && y_m.abs() <= 1_999.0
            && yaw.abs() <= LARGEST - 1.0
            && (xy == yx) & (xt == tx) & (yt == ty)
            && within(xx, LENGTH)
            && within(yy, LENGTH)
            && within(tt, YAW)
            && (xy * xy < x_y) & (xt * xt < x_t) & (yt * yt < y_t)
            && determinant >= LEAST_DETERMINANT * x_y * tt;
        if !is_valid {
            return None;
        }
        let (length, area) = (r2 * 1e6, r2 * 1e12);
        let given = Square {
            xx: xx * area,
            xy: xy * area,
            xt: xt * length,
            yy: yy * area,
            yt: yt * length,
            tt: tt * r2,
        };
        let more_x = 21e-5 * given.xx + 23e3;
        let more_y = 45e-5 * given.yy + 21e-6 * given.xx + 7e4;
        let more_turn = 24e-4 * given.tt + 5e4 * (RADIANS_PER_Q24 * RADIANS_PER_Q24);
        let above = Square {
            xx: given.xx + 3.0 * more_x,
            yy: given.yy + 3.0 * more_y,
            tt: given.tt + 3.0 * more_turn,
            ..given
        };
        Some(Self {
            estimate: Point {
                x: x_m * 1e6 - f64::from(goal.x_um),
                y: y_m * 1e6 - f64::from(goal.y_um),
                above_goal: binary(yaw).wrapping_sub(goal.yaw.0),
                facing: cos_sin(yaw),
            },
            above,
            broad: (given.xx + given.yy + more_x + more_y).sqrt() + 2.0,
            turn: (given.tt + more_turn).sqrt(),
        })
    }

    /// Returns at least the largest turn of the set of integers, 2^-32 turn.
    #[inline(always)]
    pub fn largest_turn(&self) -> f64 {
        self.turn * Q32_PER_RADIAN
    }
}
