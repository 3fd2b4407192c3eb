//! Quotients of 64 bits.
//!
//! A controller divides 32 bits at most. The compiler's routine for 64 bits takes 930 bytes of flash on a Cortex-M4F, `by_digits` takes 280.
//! All quotients of a gate's step that may need more than 32 bits are from here.

/// Returns `n / d`, rounded down, or `None` if d is zero.
#[must_use]
#[cfg_attr(not(small_code), inline)]
pub fn quotient(n: u64, d: u64) -> Option<u64> {
    if cfg!(small_code) {
        by_digits(n, d)
    } else {
        n.checked_div(d)
    }
}

/// Returns [`quotient`] by long division with digits of some 15 bits. Each round divides the leading bits of the rest by those of d, and
/// subtracts that multiple of d. The leading bits of d are rounded up, so the rest never falls below zero. Each round leaves less than
/// 2^-14 of the rest, or less than six times d. So there are ten rounds at most.
#[cfg_attr(not(any(small_code, test)), allow(dead_code))]
#[inline(never)]
fn by_digits(n: u64, d: u64) -> Option<u64> {
    if (n | d) >> 32 == 0 {
        return (n as u32).checked_div(d as u32).map(u64::from);
    }
    if d == 0 {
        return None;
    }
    let d_zeros = d.leading_zeros();
    // From 2^15 + 1 to 2^16.
    let short = (d.wrapping_shl(d_zeros) >> 48) as u32;
    let short = short.wrapping_add(1);
    let (mut rest, mut sum) = (n, 0u64);
    while rest >= d {
        let zeros = rest.leading_zeros();
        let leading = (rest.wrapping_shl(zeros) >> 32) as u32;
        // Below 2^17, unit 2^(up - 16).
        let digit = u64::from(leading.checked_div(short).unwrap_or(0));
        let up = d_zeros.wrapping_sub(zeros);
        let digit = if up > 16 {
            digit.wrapping_shl(up.wrapping_sub(16))
        } else {
            digit.wrapping_shr(16u32.wrapping_sub(up)).max(1)
        };
        sum = sum.wrapping_add(digit);
        rest = rest.wrapping_sub(digit.wrapping_mul(d));
    }
    Some(sum)
}

/// Returns `value / by`, rounded towards zero, or 0 if `by` is not above zero.
#[must_use]
#[cfg_attr(not(small_code), inline)]
pub fn towards_zero(value: i64, by: i64) -> i64 {
    if cfg!(small_code) {
        signed_by_digits(value, by)
    } else {
        value.checked_div(by.max(0)).unwrap_or(0)
    }
}

/// Returns [`towards_zero`] by [`by_digits`].
#[cfg_attr(not(any(small_code, test)), allow(dead_code))]
fn signed_by_digits(value: i64, by: i64) -> i64 {
    let by = u64::try_from(by).unwrap_or(0);
    let magnitude = by_digits(value.unsigned_abs(), by).unwrap_or(0) as i64;
    if value < 0 {
        magnitude.wrapping_neg()
    } else {
        magnitude
    }
}

#[cfg(test)]
mod tests {
    use super::{by_digits, quotient, signed_by_digits, towards_zero};
    use proptest::prelude::*;

    fn check(n: u64, d: u64) {
        let exact = n.checked_div(d);
        assert_eq!(by_digits(n, d), exact, "{n} / {d}");
        assert_eq!(quotient(n, d), exact, "{n} / {d}");
        let (n, by) = (n as i64, d as i64);
        let exact = n.checked_div(by.max(0)).unwrap_or(0);
        assert_eq!(towards_zero(n, by), exact, "{n} / {by}");
        assert_eq!(signed_by_digits(n, by), exact, "{n} / {by}");
    }

    #[test]
    fn quotients_at_the_ends_are_exact() {
        let ends = (0..64u32).flat_map(|k| {
            let power = 1u64 << k;
            [
                power - 1,
                power,
                power + 1,
                power.wrapping_neg(),
                (power - 1).wrapping_mul(3),
            ]
        });
        let ends: Vec<u64> = ends.collect();
        for n in &ends {
            for d in &ends {
                check(*n, *d);
                for near in -1i64..=1 {
                    check(n.wrapping_mul(*d).wrapping_add_signed(near), *d);
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(20_000, 40)))]
        #[test]
        fn quotients_are_exact(n in any::<u64>(), d in any::<u64>(), down in 0..64u32, less in 0..64u32) {
            let (n, d) = (n >> down, d >> less);
            check(n, d);
            check(n - n.checked_rem(d).unwrap_or(0), d);
            check((n - n.checked_rem(d).unwrap_or(0)).wrapping_sub(1), d);
        }
    }
}
