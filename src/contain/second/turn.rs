//! Rotates a vector by a heading, and computes a vector's heading: CORDIC (Volder 1959) in both modes,
//! on 32-bit words, with one table.
//!
//! Eleven rotations by arctangents of 2^-k leave an angle below 2^-10 rad, which is applied to second
//! order.
//!
//! | error | at most |
//! |---|---|
//! | a cosine or sine: 11 shifts and arctangents, the last rotation | 2^-26 |
//! | the heading of a vector: arctangents 5.5, shifts 11 times 0.64 / 1.6, the quotient 1 | 12 of 2^-32 turn |
//!
//! `error_budget.rs` searches for the largest errors.

use crate::num::quotient;

/// Arctangents of 2^-k, 2^-32 turn, to the nearest.
const ARCTANGENTS: [i32; 11] = [
    536_870_912,
    316_933_406,
    167_458_907,
    85_004_756,
    42_667_331,
    21_354_465,
    10_679_838,
    5_340_245,
    2_670_163,
    1_335_087,
    667_544,
];
/// The start length of a vector that has the length 1 after eleven rotations, unit 2^-30.
const SHORTENED: i32 = 652_032_978;
/// The factor from 2^-32 turn to radians in unit 2^-30: pi / 2, times 2^16.
const HALF_PI_Q16: i64 = 102_944;
/// The number of 2^-32 turns in a radian.
const UNITS_PER_RADIAN: u64 = 683_565_276;

/// Returns cosine and sine of a heading (2^-32 turn), unit 2^-30.
#[inline(never)]
pub(super) fn cosine_and_sine(heading: u32) -> [i32; 2] {
    let quarter = heading.wrapping_add(1 << 29) >> 30;
    let mut left = heading.wrapping_sub(quarter.wrapping_shl(30)) as i32;
    let (mut x, mut y) = (SHORTENED, 0i32);
    for (k, arctangent) in (0u32..).zip(ARCTANGENTS) {
        let (dx, dy) = (y.wrapping_shr(k), x.wrapping_shr(k));
        if left >= 0 {
            (x, y) = (x.wrapping_sub(dx), y.wrapping_add(dy));
            left = left.wrapping_sub(arctangent);
        } else {
            (x, y) = (x.wrapping_add(dx), y.wrapping_sub(dy));
            left = left.wrapping_add(arctangent);
        }
    }
    let left = i64::from(left).wrapping_mul(HALF_PI_Q16) >> 16;
    let (x, y) = (i64::from(x), i64::from(y));
    // 1 - left^2 / 2.
    let less = left.wrapping_mul(left) >> 31;
    let turned = |along: i64, across: i64| {
        let along_and_across = across
            .wrapping_mul(left)
            .wrapping_sub(along.wrapping_mul(less));
        along.wrapping_add(along_and_across.wrapping_add(1 << 29) >> 30) as i32
    };
    let (cosine, sine) = (turned(x, y.wrapping_neg()), turned(y, x));
    match quarter & 3 {
        0 => [cosine, sine],
        1 => [sine.wrapping_neg(), cosine],
        2 => [cosine.wrapping_neg(), sine.wrapping_neg()],
        _ => [sine, cosine.wrapping_neg()],
    }
}

/// Returns the heading (2^-32 turn) of a vector whose length is between 0.9 and 1.1, unit 2^-30.
pub(super) fn heading([x, y]: [i32; 2]) -> u32 {
    // Rotate by quarter turns until x is the largest.
    let (quarter, mut x, mut y) = if x.unsigned_abs() >= y.unsigned_abs() {
        if x >= 0 {
            (0u32, x, y)
        } else {
            (2, x.wrapping_neg(), y.wrapping_neg())
        }
    } else if y >= 0 {
        (1, y, x.wrapping_neg())
    } else {
        (3, y.wrapping_neg(), x)
    };
    let mut angle = quarter.wrapping_shl(30);
    for (k, arctangent) in (0u32..).zip(ARCTANGENTS) {
        let (dx, dy) = (y.wrapping_shr(k), x.wrapping_shr(k));
        let arctangent = arctangent.unsigned_abs();
        if y >= 0 {
            (x, y) = (x.wrapping_add(dx), y.wrapping_sub(dy));
            angle = angle.wrapping_add(arctangent);
        } else {
            (x, y) = (x.wrapping_sub(dx), y.wrapping_add(dy));
            angle = angle.wrapping_sub(arctangent);
        }
    }
    // Below 2^22 * 2^30.
    let rest = u64::from(y.unsigned_abs()).wrapping_mul(UNITS_PER_RADIAN);
    let rest = quotient(rest, u64::from(x.unsigned_abs())).unwrap_or(0) as u32;
    if y >= 0 {
        angle.wrapping_add(rest)
    } else {
        angle.wrapping_sub(rest)
    }
}
