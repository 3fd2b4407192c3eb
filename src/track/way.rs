//! The way of a robot since a fix: its sum, what its noise adds to a covariance, and how long it is.
//!
//! Everything is in the robot's axes at the fix. An increment `w` (turned to these axes) moves the error of the place by `J w` times the
//! error of the heading, so the covariance N of both grows by `G N G'` and the increment's own noise.

use super::increment::Increment;
use super::model::Noise;
use super::turned;
use crate::num::{BinaryAngle, Float, Rounding};
use crate::set::{Growth, PathNoise, RadiusSquared};

/// 2 pi times 2^32: 2^-24 turn in radians, unit 2^-56.
const LEVER_Q56: i128 = 26_986_075_409;
/// What roundings take off the entries on the diagonal in one increment: three products in the plane's, one in each that is shared with
/// the yaw.
const ROUNDED: i64 = 8;
/// Fraction bits of the place.
const FINER: u32 = 8;

/// The way since a fix.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// The place, 2^-8 um.
    x: i64,
    y: i64,
    /// The turn, 2^-32 turn, wrapping.
    turn: u32,
    /// What the noise adds.
    noise: PathNoise,
    /// The length of the way, micrometres, and the sum of its turns, 2^-24 turn: up.
    length_um: u64,
    turned_q24: u64,
    /// What the first increment may have of the time before the fix.
    left_out: Growth,
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
    pub fn add(&mut self, increment: &Increment, ms: u32, noise: &Noise) {
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
        // Unit 2^-64: below 2^31 * 2^34.7.
        let a = i128::from(y).wrapping_neg().wrapping_mul(LEVER_Q56);
        let b = i128::from(x).wrapping_mul(LEVER_Q56);
        // Entries are below 2^60, else they saturate and are refused later.
        let by = |lever: i128, entry: i64| (lever.wrapping_mul(i128::from(entry)) >> 64) as i64;
        let n = &mut self.noise;
        let (att, btt) = (by(a, n.tt), by(b, n.tt));
        let (axt, byt) = (by(a, n.xt), by(b, n.yt));
        let sum = |parts: [i64; 4]| {
            parts
                .iter()
                .fold(0i64, |sum, part| sum.saturating_add(*part))
        };
        n.xx = sum([n.xx, axt.saturating_mul(2), by(a, att), plane]).saturating_add(ROUNDED);
        n.yy = sum([n.yy, byt.saturating_mul(2), by(b, btt), plane]).saturating_add(ROUNDED);
        n.xy = sum([n.xy, by(a, n.yt), by(b, n.xt), by(a, btt)]);
        n.xt = n.xt.saturating_add(att);
        n.yt = n.yt.saturating_add(btt);
        n.tt = n.tt.saturating_add(turn).saturating_add(ROUNDED);
    }

    /// Adds the last `after` of `whole` milliseconds of an increment. How the robot moved within it is not known, so the larger part
    /// may be wrong.
    pub fn add_part(&mut self, increment: &Increment, [after, whole]: [u32; 2], noise: &Noise) {
        self.add(&increment.part([after, whole]), after, noise);
        let larger = after.max(whole.wrapping_sub(after));
        let rest = increment.part([larger, whole]);
        self.leave_out(Growth::new(
            rest.length_um().saturating_add(2),
            rest.turn_q24().saturating_add(2),
        ));
    }

    /// States what the first increment may have of the time before the fix.
    pub fn leave_out(&mut self, growth: Growth) {
        self.left_out = self.left_out.plus(growth);
    }

    pub const fn turn(&self) -> u32 {
        self.turn
    }

    /// Returns the place in world axes, micrometres, for a heading at the fix.
    pub fn in_world(&self, yaw: BinaryAngle) -> [i64; 2] {
        let [c, s] = yaw.cos_sin_q30().map(i128::from);
        let (x, y) = (i128::from(self.x), i128::from(self.y));
        let whole = |sum: i128| (sum.wrapping_add(1 << 37) >> 38) as i64;
        [
            whole(c.wrapping_mul(x).wrapping_sub(s.wrapping_mul(y))),
            whole(s.wrapping_mul(x).wrapping_add(c.wrapping_mul(y))),
        ]
    }

    /// Returns what the noise adds, in world axes, for a heading at the fix.
    pub fn noise_in_world(&self, yaw: BinaryAngle) -> PathNoise {
        turned(&self.noise, yaw.cos_sin_q30())
    }

    /// Returns what may have slipped, with what the roundings of the place take off: a turn that slips swings all of the way after it.
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

    /// Returns how far a turn by up to `yaw_q24` at the start moves the end, micrometres, up.
    pub fn swung(&self, yaw_q24: i32) -> u32 {
        let swung = self.chord(u64::from(yaw_q24.unsigned_abs()));
        u32::try_from(swung).unwrap_or(u32::MAX)
    }

    /// The way's length times a turn, micrometres, up.
    fn chord(&self, turn_q24: u64) -> u64 {
        let product = u128::from(self.length_um).wrapping_mul(u128::from(turn_q24));
        // 2 pi / 2^24 from above.
        let swung = product.saturating_mul(411_775) >> 40;
        u64::try_from(swung).unwrap_or(u64::MAX).saturating_add(1)
    }

    /// Returns what the curvature of the way's error adds: a heading that is off by t moves the end of the way along a circle, which
    /// leaves its tangent by at most `L t^2 / 2`.
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
