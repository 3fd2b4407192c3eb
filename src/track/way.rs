//! The path of a robot since a fix: its sum, its noise, and its length.
//!
//! Everything is in the robot's axes at the fix. An increment `w` (turned to these axes) moves the error of the
//! position by `J w` times the error of the heading. So the covariance N of both grows by `G N G'` and the
//! increment's own noise.

use super::increment::Step;
use super::model::Noise;
use super::turned;
use crate::num::{BinaryAngle, Float, Rounding, wide};
use crate::set::{Growth, PathNoise, RadiusSquared};

/// 2 pi times 2^32, a 2^-24 turn in radians with the unit 2^-56, without its whole 6 * 2^32.
const LEVER_Q56: u32 = 1_216_271_633;
/// The fraction of 2 pi times 2^32, unit 2^-32.
const LEVER_REST: u32 = 189_141_414;
/// Most by which roundings lower the entries on the diagonal in one increment. A product is off by less than 1.8 units; one of a product,
/// for a movement of 4 m on each axis, by less than 5.6. So the entries of x and y, and the one between them, are off by 9.2, and those with
/// the yaw by 1.8; half of an odd variance is off by 1.2 and 2.5 more. A symmetric matrix does not get smaller if each entry on its diagonal
/// grows by the errors in its row: 28.
const ROUNDED: i64 = 32;
/// The largest noise that is carried: an error of two turns in the heading, of 500 m in the position.
const WIDEST_TURN: i64 = 1 << 50;
const WIDEST_PLANE: i64 = 1 << 58;
/// Fraction bits of the position.
const FINER: u32 = 8;

/// The path since a fix.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// The position, 2^-8 um.
    x: i64,
    y: i64,
    /// The turn, 2^-32 turn, wrapping.
    turn: u32,
    /// The covariance that the noise adds.
    noise: PathNoise,
    /// The length of the path, micrometres, and the sum of its turns, 2^-24 turn: rounded up.
    length_um: u64,
    turned_q24: u64,
    /// Bound of the part of the first increment that belongs to the time before the fix.
    left_out: Growth,
}

/// Returns an entry, below 2^60, times 2 pi, off by less than two.
#[inline(always)]
fn lever(entry: i64) -> i64 {
    let rest = scaled(LEVER_Q56, entry).wrapping_add(scaled(LEVER_REST, entry >> 32));
    entry.wrapping_mul(6).wrapping_add(rest)
}

/// Returns `factor entry / 2^32`, rounded towards zero: off by less than one.
#[inline(always)]
fn times(factor: i32, entry: i64) -> i64 {
    let size = scaled(factor.unsigned_abs(), entry);
    if factor < 0 {
        size.wrapping_neg()
    } else {
        size
    }
}

/// Returns `factor entry / 2^32`, rounded towards zero.
#[inline(never)]
fn scaled(factor: u32, entry: i64) -> i64 {
    let size = entry.unsigned_abs();
    let (high, low) = ((size >> 32) as u32, size as u32);
    let product = wide(factor, high).wrapping_add(wide(factor, low) >> 32) as i64;
    if entry < 0 {
        product.wrapping_neg()
    } else {
        product
    }
}

impl Way {
    pub const START: Self = Self {
        x: 0,
        y: 0,
        turn: 0,
        noise: PathNoise {
            xx: 0,
            xy: 0,
            yy: 0,
            xt: 0,
            yt: 0,
            tt: 0,
        },
        length_um: 0,
        turned_q24: 0,
        left_out: Growth::NONE,
    };

    /// Adds an increment that lasted for a time, milliseconds.
    #[inline(never)]
    pub fn add(&mut self, increment: &Step, ms: u32, noise: &Noise) {
        let [c, s] = BinaryAngle(self.turn).cos_sin_q30().map(i64::from);
        let (dx, dy) = (i64::from(increment.x_um), i64::from(increment.y_um));
        let fine = |sum: i64| sum.wrapping_add(1 << (29 - FINER)) >> (30 - FINER);
        // Below 2^53 each.
        let x = fine(c.wrapping_mul(dx).wrapping_sub(s.wrapping_mul(dy)));
        let y = fine(s.wrapping_mul(dx).wrapping_add(c.wrapping_mul(dy)));
        let (length_um, turn_q24) = (increment.length_um(), increment.turn_q24());
        let [plane, turn] = noise.variances(length_um, turn_q24, ms);
        self.x = self.x.saturating_add(x);
        self.y = self.y.saturating_add(y);
        self.turn = self.turn.wrapping_add(increment.turn as u32);
        self.length_um = self.length_um.saturating_add(u64::from(length_um));
        self.turned_q24 = self.turned_q24.saturating_add(u64::from(turn_q24));
        let n = &mut self.noise;
        if n.tt >= WIDEST_TURN || n.xx.max(n.yy) >= WIDEST_PLANE {
            // Too large to be used, and refused later: such a sum is not carried.
            n.tt = i64::MAX;
            return;
        }
        // Below 2^31: increments are at most 2^22 um on each axis.
        let (a, b) = ((y as i32).wrapping_neg(), x as i32);
        // The heading errs all along the increment: of its own variance q, `q l / 2` is shared with the place aside, and `q l^2 / 3`
        // is there. Half of q at the start gives the one, and more than the other along one direction.
        let halfway = n.tt.saturating_add(turn >> 1);
        let (tt, xt, yt) = (lever(halfway), lever(n.xt), lever(n.yt));
        let (att, btt) = (times(a, tt), times(b, tt));
        let (axt, byt) = (times(a, xt), times(b, yt));
        let (aatt, bbtt, abtt) = (
            times(a, lever(att)),
            times(b, lever(btt)),
            times(a, lever(btt)),
        );
        let (ayt, bxt) = (times(a, yt), times(b, xt));
        let sum = |parts: [i64; 4]| {
            parts
                .iter()
                .fold(0i64, |sum, part| sum.saturating_add(*part))
        };
        n.xx = sum([n.xx, axt.saturating_mul(2), aatt, plane]).saturating_add(ROUNDED);
        n.yy = sum([n.yy, byt.saturating_mul(2), bbtt, plane]).saturating_add(ROUNDED);
        n.xy = sum([n.xy, ayt, bxt, abtt]);
        n.xt = n.xt.saturating_add(att);
        n.yt = n.yt.saturating_add(btt);
        n.tt = n.tt.saturating_add(turn).saturating_add(ROUNDED);
    }

    /// Sets the bound of the part of the first increment that belongs to the time before the fix.
    pub fn leave_out(&mut self, growth: Growth) {
        self.left_out = self.left_out.plus(growth);
    }

    pub const fn turn(&self) -> u32 {
        self.turn
    }

    /// Returns the position in world axes, micrometres, for a heading at the fix.
    pub fn in_world(&self, yaw: BinaryAngle) -> [i64; 2] {
        let [c, s] = yaw.cos_sin_q30().map(i128::from);
        let (x, y) = (i128::from(self.x), i128::from(self.y));
        let whole = |sum: i128| (sum.wrapping_add(1 << 37) >> 38) as i64;
        [
            whole(c.wrapping_mul(x).wrapping_sub(s.wrapping_mul(y))),
            whole(s.wrapping_mul(x).wrapping_add(c.wrapping_mul(y))),
        ]
    }

    /// Returns the covariance that the noise adds, in world axes, for a heading at the fix.
    pub fn noise_in_world(&self, yaw: BinaryAngle) -> PathNoise {
        turned(&self.noise, yaw.cos_sin_q30())
    }

    /// Returns the bound of the slip and of the rounding of the position: a slip of a turn rotates the whole path after it.
    pub fn slip(&self, noise: &Noise) -> Growth {
        let [length, turn] = noise.slip(self.length_um, self.turned_q24);
        let turn = turn.saturating_add(u64::from(self.left_out.yaw_q24().unsigned_abs()));
        // 2^-32 turn of each increment to the nearest, and its cosine.
        let rounded = (self.length_um >> 24).saturating_add(4);
        let length = length
            .saturating_add(u64::from(self.left_out.translation_um().unsigned_abs()))
            .saturating_add(self.chord(turn))
            .saturating_add(rounded);
        let limited = |v: u64| u32::try_from(v).unwrap_or(u32::MAX);
        Growth::new(limited(length), limited(turn.saturating_add(1)))
    }

    /// Returns the largest movement of the end by a turn of up to `yaw_q24` at the start, micrometres, rounded up.
    pub fn swung(&self, yaw_q24: i32) -> u32 {
        let swung = self.chord(u64::from(yaw_q24.unsigned_abs()));
        u32::try_from(swung).unwrap_or(u32::MAX)
    }

    /// Returns the path's length times a turn, micrometres, rounded up.
    fn chord(&self, turn_q24: u64) -> u64 {
        let product = u128::from(self.length_um).wrapping_mul(u128::from(turn_q24));
        // 2 pi / 2^24 from above.
        let swung = product.saturating_mul(411_775) >> 40;
        u64::try_from(swung).unwrap_or(u64::MAX).saturating_add(1)
    }

    /// Returns the bound of the curvature of the path's error: an error t of the heading moves the end of the path along a circle, which
    /// deviates from its tangent by at most `L t^2 / 2`.
    pub fn curvature(&self, covariance: &[[f64; 3]; 3], radius_squared: RadiusSquared) -> Growth {
        let [.., [_, _, tt]] = covariance;
        // The square of the largest turn, rad^2 times 2^-32.
        let square = Float::of(*tt)
            .and_then(|tt| {
                tt.scaled(
                    u128::from(radius_squared.q16()) << 16,
                    0,
                    Rounding::AwayFromZero,
                )
            })
            .unwrap_or(i64::MAX);
        let product = u128::from(self.length_um).wrapping_mul(u128::from(square.unsigned_abs()));
        let most = self.length_um.saturating_mul(2);
        let bent = u64::try_from(product >> 33)
            .unwrap_or(u64::MAX)
            .saturating_add(1);
        let bent = bent.min(most.saturating_add(1));
        Growth::new(u32::try_from(bent).unwrap_or(u32::MAX), 0)
    }
}

#[cfg(test)]
mod tests;
