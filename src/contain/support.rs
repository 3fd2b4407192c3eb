//! The reach of an ellipsoid, by exact integer arithmetic on the factor.

use crate::num::{Divisor, product, sqrt_ceil};

/// Returns `a . b`. Entries below 2^30: the sum is below 2^62.
pub(super) fn dot([a1, a2, a3]: [i32; 3], [b1, b2, b3]: [i32; 3]) -> i64 {
    product(a1, b1)
        .wrapping_add(product(a2, b2))
        .wrapping_add(product(a3, b3))
}

/// Returns `|row|^2`. Entries below 2^30.
pub(super) fn squared_length(row: [i32; 3]) -> u64 {
    dot(row, row).unsigned_abs()
}

/// Returns `a^2` at full width.
pub(super) fn wide_square(a: i64) -> u128 {
    let a = u128::from(a.unsigned_abs());
    a.wrapping_mul(a)
}

/// The place of an ellipsoid's farthest point in some direction, relative to a yaw window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SupportPoint {
    /// The farthest point lies within the window.
    Free,
    /// The farthest point lies beyond the window: within the window, the reach is largest at this
    /// offset.
    At(i64),
}

/// Returns where in the window `[e0, e1]` the ellipsoid reaches farthest along `row . u`.
///
/// The unconstrained optimum has the yaw offset `yaw * row1 / |row|`. The reach is concave in the
/// offset, so if the optimum is beyond the window, the nearer edge is the best. The comparison is
/// exact.
pub(super) fn held(row: [i32; 3], yaw: i32, [e0, e1]: [i64; 2]) -> SupportPoint {
    let [first, _, _] = row;
    // Below 2^60; offsets are below 2^31, squared lengths below 2^61: products below 2^123.
    let optimum = product(yaw, first);
    let square = u128::from(squared_length(row));
    // offset * |row| compared with optimum.
    let above = |offset: i64| match (offset >= 0, optimum >= 0) {
        (true, false) => true,
        (false, true) => false,
        (true, true) => wide_square(offset).wrapping_mul(square) > wide_square(optimum),
        (false, false) => wide_square(offset).wrapping_mul(square) < wide_square(optimum),
    };
    let below = |offset: i64| match (offset >= 0, optimum >= 0) {
        (true, false) => false,
        (false, true) => true,
        (true, true) => wide_square(offset).wrapping_mul(square) < wide_square(optimum),
        (false, false) => wide_square(offset).wrapping_mul(square) > wide_square(optimum),
    };
    if above(e0) {
        SupportPoint::At(e0)
    } else if below(e1) {
        SupportPoint::At(e1)
    } else {
        SupportPoint::Free
    }
}

/// Returns the largest `row . u` over `|u| <= 1`, with the yaw offset `yaw u1` as `held` fixes it,
/// rounded up.
///
/// At the offset e: `(row1 e + |(row2, row3)| sqrt(yaw^2 - e^2)) / yaw`, with `|e| <= yaw`.
pub(super) fn reach(row: [i32; 3], yaw: i32, held: SupportPoint) -> i64 {
    match held {
        SupportPoint::Free => sqrt_ceil(squared_length(row)),
        SupportPoint::At(offset) => {
            let [first, second, third] = row;
            let side = sqrt_ceil(squared_length([0, second, third]));
            let yaw = i64::from(yaw);
            let left = yaw
                .wrapping_mul(yaw)
                .wrapping_sub(offset.wrapping_mul(offset));
            let height = sqrt_ceil(left.max(0).unsigned_abs());
            // Each product is below 2^61.
            let sum = i64::from(first)
                .wrapping_mul(offset)
                .wrapping_add(side.wrapping_mul(height));
            Divisor::new(yaw).map_or(i64::MAX, |by| by.ceil(sum))
        }
    }
}
