//! Square roots of 64-bit numbers, exact, from a few 32-bit products.
//!
//! The number is shifted left by an even count to n, in `[2^62, 2^64)`, and `1 / sqrt(n)` approached by Newton's
//! iteration: it needs no division, which costs hundreds of instructions on a core without a divider.
//!
//! | relative error of `1 / sqrt(n)` | at most |
//! |---|---|
//! | a line over each half of the interval | 2.3e-2 |
//! | first step: 3/2 of the square, and 16-bit roundings | 8.7e-4 |
//! | second step: the same | 9.2e-5 |
//! | third step, 32 bits: 1.3e-8, and a rest of 26 bits | 3.0e-8 |
//! | **root of n**: `3.0e-8 * 2^32` units | 130 units |
//! | after one correction by the remainder: 130^2 / 2^32, a quotient to 2^-5, rounded down | 1.1 units |
//!
//! The candidate is then compared with the number itself and moved by one if necessary. So the result is exact, and the
//! table only has to show that one unit is enough.

use super::wide;

/// Returns the largest integer whose square is at most `value`.
#[must_use]
pub const fn sqrt_floor(value: u64) -> i64 {
    divided(value).0 as i64
}

/// Returns the smallest integer whose square is at least `value`.
#[must_use]
pub const fn sqrt_ceil(value: u64) -> i64 {
    let (root, is_square) = divided(value);
    (root as i64).wrapping_add(!is_square as i64)
}

/// Returns the root, rounded down, and `true` if it is exact.
const fn divided(value: u64) -> (u32, bool) {
    // By words: a core without the instruction would count both.
    let high = (value >> 32) as u32;
    let zeros = if high == 0 {
        32u32.wrapping_add((value as u32).leading_zeros())
    } else {
        high.leading_zeros()
    };
    let up = zeros & 62;
    let n = value.wrapping_shl(up);
    let near = near_root(n);
    // Shifted by 9 or more, 130 units are less than one.
    let root = if up < 18 { corrected(n, near) } else { near.0 };
    let candidate = root.wrapping_shr(up >> 1);
    let rest = value.wrapping_sub(wide(candidate, candidate)) as i64;
    let twice = (candidate as i64) << 1;
    // (r - 1)^2 = r^2 - (2 r - 1), (r + 1)^2 = r^2 + 2 r + 1.
    if rest < 0 {
        (candidate.wrapping_sub(1), rest.wrapping_add(twice) == 1)
    } else if rest > twice {
        (candidate.wrapping_add(1), rest.wrapping_sub(twice) == 1)
    } else {
        (candidate, rest == 0)
    }
}

/// Returns the root of a number of at least 2^62, within 130, and its inverse, unit 2^-30. For smaller numbers the result has
/// no meaning, except that zero gives a zero root.
#[inline(always)]
const fn near_root(n: u64) -> (u32, u32) {
    let top = (n >> 32) as u32;
    let short = top >> 16;
    // 2^47 / sqrt(n): between 1 and 2, unit 2^-15. The error of each line is 2.23 %.
    let line = if short < 1 << 15 {
        82_845u32.wrapping_sub(short.wrapping_mul(75_072) >> 16)
    } else {
        58_580u32.wrapping_sub(short.wrapping_mul(26_542) >> 16)
    };
    let second = closer(closer(line, short), short);
    // 1 - y^2 n, unit 2^-30: twice the relative error of y, so at most 2^18.
    let product = wide(second.wrapping_mul(second), top) >> 32;
    let rest = (1u32 << 30).wrapping_sub(product as u32) as i32 >> 4;
    let step = (second as i32).wrapping_mul(rest) >> 12;
    // Unit 2^-30.
    let inverse = second.wrapping_shl(15).wrapping_add_signed(step);
    let root = wide(top, inverse) >> 30;
    let root = if root > u32::MAX as u64 {
        u32::MAX
    } else {
        root as u32
    };
    (root, inverse)
}

/// Returns the root of a number of at least 2^62, within one of the root rounded down.
#[inline(always)]
const fn corrected(n: u64, (root, inverse): (u32, u32)) -> u32 {
    // |n - r^2| is below 2^41.
    let rest = (n.wrapping_sub(wide(root, root)) as i64 >> 26) as i32;
    let step = rest.wrapping_mul((inverse >> 16) as i32) >> 21;
    root.saturating_add_signed(step)
}

/// Returns a closer `1 / sqrt` of a number of 16 bits, unit 2^-15: `y + y (1 - y^2 n) / 2`.
const fn closer(y: u32, n: u32) -> u32 {
    let square = y.wrapping_mul(y) >> 15;
    // Unit 2^-31, within 5 % of zero.
    let rest = (1u32 << 31).wrapping_sub(square.wrapping_mul(n)) as i32 >> 16;
    y.wrapping_add_signed((y as i32).wrapping_mul(rest) >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(value: u64) {
        let (low, high) = (sqrt_floor(value) as u128, sqrt_ceil(value) as u128);
        let value = u128::from(value);
        assert!(
            low * low <= value && (low + 1) * (low + 1) > value,
            "{value}: {low}"
        );
        assert!(
            high * high >= value && (high == 0 || (high - 1) * (high - 1) < value),
            "{value}: {high}"
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(20_000, 40)))]
        #[test]
        fn roots_are_exact(value in any::<u64>(), by in 0..64u32) {
            check(value >> by);
        }

        /// Where floor and ceiling change.
        #[test]
        fn roots_of_squares_are_exact(root in any::<u32>(), by in 0..32u32) {
            let square = u64::from(root >> by).pow(2);
            for value in [square.wrapping_sub(1), square, square + 1] {
                check(value);
            }
        }
    }

    fn root_of_shifted(n: u64) -> u32 {
        corrected(n, near_root(n))
    }

    /// Every leading half word, with the least and the largest number that begins with it, and around the squares there:
    /// the error of the table's steps depends on little else.
    #[test]
    fn roots_are_exact_for_every_leading_half_word() {
        let (mut worst, mut near) = (0i64, 0i64);
        for short in (1u64 << 14..1 << 16).step_by(crate::test_iterations(1, 1021) as usize) {
            for n in [
                short << 48,
                (short << 48) + 0x7fff_ffff_ffff,
                (short << 48) | 0xffff_ffff_ffff,
            ] {
                check(n);
                let error = i64::from(root_of_shifted(n)) - n.isqrt() as i64;
                worst = worst.max(error.abs());
                let error = i64::from(near_root(n).0) - n.isqrt() as i64;
                near = near.max(error.abs());
                let root = n.isqrt();
                for around in [root.pow(2), root.pow(2) - 1, root * (root + 1)] {
                    check(around);
                    let error = i64::from(root_of_shifted(around.max(1 << 62)))
                        - around.max(1 << 62).isqrt() as i64;
                    worst = worst.max(error.abs());
                }
            }
        }
        assert!(worst <= 1 && (20..=130).contains(&near), "{worst} {near}");
        for small in 0..10_000 {
            check(small);
            check(u64::MAX - small);
            check((1 << 62) + small);
            check((1 << 62) - small);
        }
    }
}
