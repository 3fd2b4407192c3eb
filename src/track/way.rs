//! The path of a robot since a fix: its sum, its noise, and its length.
//!
//! Everything is in the robot's axes at the fix. An increment `w` (turned to these axes) moves the error of the
//! position by `J w` times the error of the heading. So the covariance N of both grows by `G N G'` and the
//! increment's own noise.
//!
//! # The heading's noise within an increment
//! The noise of the heading, of variance q, comes evenly along an arc of length l and turn t. With u the lever from a place of the arc to
//! its end, across the chord c at the right angle to it, its covariance with the position is q times the mean of u, and the position has q times the
//! mean of `u u'`. The means are, along `J w` and along w:
//!
//! | | mean of u | variance of u |
//! |---|---|---|
//! | `J w` | c / 2 | at most c^2 / 12 |
//! | w | m, at most l t / 12 | at most (l t)^2 / 720 |
//!
//! What is added here has q / 2 at the start, so a lever c / 2 and a variance c^2 / 4, and besides h on the heading and p on each axis. It is not
//! smaller if `p >= 2.5 m^2 q + (l t)^2 q / 720 + m^2 q^2 / h`. With `h = q t / 4` and t at most an eighth of a turn, `p = q l^2 t / 16` is enough.

use super::increment::Step;
use super::model::Noise;
use super::ring::TOGETHER_MS;
use super::turned;
use crate::num::{BinaryAngle, Float, Rounding, long_product, product, wide};
use crate::set::{Growth, PathNoise, RadiusSquared};

/// 2 pi times 2^32, a 2^-24 turn in radians with the unit 2^-56, without its whole 6 * 2^32.
const LEVER_Q56: u32 = 1_216_271_633;
/// The fraction of 2 pi times 2^32, unit 2^-32.
const LEVER_REST: i32 = 189_141_414;
/// Most by which roundings lower the entries on the diagonal in one increment. A product is off by less than 1.7 units; one of a product,
/// for a movement of 4 m on each axis, by less than 5.5. Half of an odd variance is off by a half, which gives 1.1 and 2.5 more. So the entries of
/// x and y, and the one between them, are off by 11.4, and those with the yaw by 2.8. A symmetric matrix does not get smaller if each entry on its
/// diagonal grows by the errors in its row: 25.6.
pub(super) const ROUNDED: i64 = 28;
/// The largest noise that is carried: an error of two turns in the heading, of 500 m in the position.
const WIDEST_TURN: i64 = 1 << 50;
const WIDEST_PLANE: i64 = 1 << 58;

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
    /// The length of the path, 2^-8 um, and the sum of its turns, 2^-24 turn: rounded up.
    length_q8: u64,
    turned_q24: u64,
    /// The largest number of its increments.
    count: u32,
    /// Bound of the part of the first increment that belongs to the time before the fix.
    left_out: Growth,
}

/// Returns the variances that an arc of a length, 2^-8 um, and a turn adds to those of a straight line: p on each axis of the plane and h on the
/// heading, um^2 and squares of 2^-24 turn, for a variance q of its heading; rounded up.
pub(super) fn along_arc(length_q8: u32, turn_q24: u32, q: i64) -> [i64; 2] {
    let length_um = (length_q8 >> 8).wrapping_add(1);
    // The length times the turn: below 2^20.
    let across = ((wide(length_um, turn_q24) >> 24) as u32).wrapping_add(1);
    let up = |product: u64, down: u32| {
        i64::try_from((product >> down).wrapping_add(1)).unwrap_or(i64::MAX)
    };
    let q = (q.unsigned_abs() >> 24).saturating_add(1);
    // q l^2 t / 16, with q and t in turns: (2 pi)^3 / 16 is 15.5. Below 2^60 for every q that is carried.
    let p = q.saturating_mul((wide(length_um, across) >> 8).wrapping_add(1));
    // q t / 4: 2 pi / 4 is 1.571.
    let h = q.saturating_mul(u64::from(turn_q24).wrapping_mul(13));
    [up(p, 12), up(h, 3)]
}

/// Returns an entry, below 2^60, times 2 pi, off by less than two.
#[inline(always)]
fn lever(entry: i64) -> i64 {
    let rest = product(LEVER_REST, (entry >> 32) as i32) >> 32;
    let rest = scaled(LEVER_Q56, entry).wrapping_add(rest);
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
    /// Returns a path of no increments. It has the noise of one millisecond, by which stamps are rounded.
    pub fn new(noise: &Noise) -> Self {
        let [plane, turn] = noise.variances(0, 0, 1);
        Self {
            x: 0,
            y: 0,
            turn: 0,
            noise: PathNoise {
                xx: plane,
                yy: plane,
                tt: turn,
                ..PathNoise::default()
            },
            length_q8: 0,
            turned_q24: 0,
            // Those of which only a part is on the path.
            count: TOGETHER_MS,
            left_out: Growth::NONE,
        }
    }

    /// Adds an increment with the length, 2^-8 um, and the turns, 2^-24 turn, that the robot drove at most, and the time that it lasted, milliseconds.
    #[inline(never)]
    pub fn add(
        &mut self,
        increment: &Step,
        [length_q8, turn_q24]: [u32; 2],
        ms: u32,
        noise: &Noise,
    ) {
        let [c, s] = BinaryAngle(self.turn).cos_sin_q30().map(i64::from);
        let (dx, dy) = (i64::from(increment.x_q8), i64::from(increment.y_q8));
        let whole = |sum: i64| sum.wrapping_add(1 << 29) >> 30;
        // Sums below 2^61.
        let x = whole(c.wrapping_mul(dx).wrapping_sub(s.wrapping_mul(dy)));
        let y = whole(s.wrapping_mul(dx).wrapping_add(c.wrapping_mul(dy)));
        let [plane, turn] = noise.variances(length_q8, turn_q24, ms);
        let [bent, curved] = along_arc(length_q8, turn_q24, turn);
        let plane = plane.saturating_add(bent);
        self.x = self.x.saturating_add(x);
        self.y = self.y.saturating_add(y);
        self.turn = self.turn.wrapping_add(increment.turn as u32);
        self.length_q8 = self.length_q8.saturating_add(u64::from(length_q8));
        self.turned_q24 = self.turned_q24.saturating_add(u64::from(turn_q24));
        // A short one may be as many as it has milliseconds.
        let increments = if ms <= TOGETHER_MS { ms } else { 1 };
        self.count = self.count.saturating_add(increments);
        let n = &mut self.noise;
        if n.tt >= WIDEST_TURN || n.xx.max(n.yy) >= WIDEST_PLANE {
            // Too large to be used, and refused later: such a sum is not carried.
            n.tt = i64::MAX;
            return;
        }
        // Below 2^31: increments are at most 2^22 um on each axis.
        let (a, b) = ((y as i32).wrapping_neg(), x as i32);
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
        n.tt = sum([n.tt, turn, curved, ROUNDED]);
    }

    /// Sets the bound of the part of the first increment that belongs to the time before the fix.
    pub fn leave_out(&mut self, growth: Growth) {
        self.left_out = self.left_out.plus(growth);
    }

    #[cfg(test)]
    pub const fn with_noise(self, noise: PathNoise) -> Self {
        Self { noise, ..self }
    }

    #[cfg(test)]
    pub const fn noise_of_path(&self) -> PathNoise {
        self.noise
    }

    #[cfg(test)]
    pub const fn place_q8(&self) -> [i64; 2] {
        [self.x, self.y]
    }

    pub const fn turn(&self) -> u32 {
        self.turn
    }

    /// Returns the position in world axes, micrometres, for the cosine and sine of the heading at the fix, 2^-30.
    pub fn in_world(&self, facing: [i32; 2]) -> [i64; 2] {
        let [c, s] = facing.map(i64::from);
        let (x, y) = (self.x, self.y);
        let whole = |sum: i128| (sum.wrapping_add(1 << 37) >> 38) as i64;
        [
            whole(long_product(c, x).wrapping_sub(long_product(s, y))),
            whole(long_product(s, x).wrapping_add(long_product(c, y))),
        ]
    }

    /// Returns the covariance that the noise adds, in world axes, for the cosine and sine of the heading at the fix, 2^-30.
    pub fn noise_in_world(&self, facing: [i32; 2]) -> PathNoise {
        turned(&self.noise, facing)
    }

    /// Returns the bound of the slip and of all roundings, by their number: an error of a turn rotates the whole path after it.
    ///
    /// | rounding | at most |
    /// |---|---|
    /// | an increment to 2^-8 um on each axis, and turned to the axes of the fix | 1.42 of 2^-8 um each |
    /// | the turn of an increment to 2^-32 turn | half of it each |
    /// | cosines to 2^-30, of each increment, of those that are kept as one, and of the whole path | 2^-27 of the length |
    /// | the part of an increment after a fix, the whole path, its start, and the odometry's poses, to the micrometre | 3 um; 1 of 2^-24 turn |
    pub fn slip(&self, noise: &Noise) -> Growth {
        let [length, turn] = noise.slip(self.length_q8, self.turned_q24);
        let turn = turn
            .saturating_add(u64::from(self.left_out.yaw_q24().unsigned_abs()))
            .saturating_add(u64::from(self.count >> 9))
            .saturating_add(2);
        let rounded = (u64::from(self.count).wrapping_mul(3) >> 9)
            .saturating_add(self.length_q8 >> 35)
            .saturating_add(5);
        let length = length
            .saturating_add(u64::from(self.left_out.translation_um().unsigned_abs()))
            .saturating_add(self.arc(turn))
            .saturating_add(rounded);
        let limited = |v: u64| u32::try_from(v).unwrap_or(u32::MAX);
        Growth::new(limited(length), limited(turn))
    }

    /// Returns the largest movement of the end by a turn of up to `yaw_q24` at the start, micrometres, rounded up.
    pub fn swung(&self, yaw_q24: i32) -> u32 {
        let swung = self.arc(u64::from(yaw_q24.unsigned_abs()));
        u32::try_from(swung).unwrap_or(u32::MAX)
    }

    /// Returns the path's length times a turn, micrometres, rounded up; for an absurd turn more than twice the length.
    fn arc(&self, turn_q24: u64) -> u64 {
        // 2 pi / 2^24 from above, unit 2^-40. It saturates at 2^24 rad; the end moves by at most twice the length.
        let turn = u128::from(turn_q24.saturating_mul(411_775));
        let swung = u128::from(self.length_q8).wrapping_mul(turn) >> 48;
        u64::try_from(swung).unwrap_or(u64::MAX).saturating_add(1)
    }

    /// Returns the bound of the curvature of the path's error: an error t of the heading moves the end of the path along a circle, which
    /// deviates from its tangent by at most `L t^2 / 2`, for every real t (half a turn leaves 3.73 L of 4.93 L).
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
        let product = u128::from(self.length_q8).wrapping_mul(u128::from(square.unsigned_abs()));
        let bent = u64::try_from(product >> 41)
            .unwrap_or(u64::MAX)
            .saturating_add(1);
        Growth::new(u32::try_from(bent).unwrap_or(u32::MAX), 0)
    }
}

#[cfg(test)]
mod tests;
