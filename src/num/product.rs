//! Products of 64 bits, also for cores that multiply to 32 bits only (`build.rs`).

/// Returns the product of two 32-bit numbers. Exact.
#[must_use]
#[inline(always)]
pub const fn product(a: i32, b: i32) -> i64 {
    if cfg!(narrow_products) {
        of_signed_halves(a, b)
    } else {
        (a as i64).wrapping_mul(b as i64)
    }
}

/// Returns the product of two 32-bit numbers without signs. Exact.
#[must_use]
#[inline(always)]
pub const fn wide(a: u32, b: u32) -> u64 {
    if cfg!(narrow_products) {
        of_halves(a, b)
    } else {
        (a as u64).wrapping_mul(b as u64)
    }
}

/// Returns `a b / 2^DOWN`, rounded down; its 64 lower bits. Not inlined: it is long, and a covariance takes many.
#[must_use]
#[inline(never)]
pub fn shifted_product<const DOWN: u32>(a: i64, b: i64) -> i64 {
    long_product(a, b).wrapping_shr(DOWN) as i64
}

/// Returns the product of two 64-bit numbers. Exact.
#[must_use]
#[inline(always)]
pub fn long_product(a: i64, b: i64) -> i128 {
    if cfg!(narrow_products) {
        of_words(a, b)
    } else {
        i128::from(a).wrapping_mul(i128::from(b))
    }
}

/// Returns the product from four products of words; the low words have no sign.
#[inline(always)]
fn of_words(a: i64, b: i64) -> i128 {
    let (a_high, a_low) = ((a >> 32) as i32, a as u32);
    let (b_high, b_low) = ((b >> 32) as i32, b as u32);
    let middle = i128::from(by_low(a_high, b_low)).wrapping_add(by_low(b_high, a_low).into());
    i128::from(product(a_high, b_high))
        .wrapping_shl(64)
        .wrapping_add(middle.wrapping_shl(32))
        .wrapping_add(wide(a_low, b_low).into())
}

/// Returns the product of a number with a sign and one without.
#[inline(always)]
const fn by_low(signed: i32, low: u32) -> i64 {
    // As a number without a sign, a negative one is larger by 2^32.
    let more = if signed < 0 { (low as u64) << 32 } else { 0 };
    wide(signed as u32, low).wrapping_sub(more) as i64
}

/// Returns the product from four products of halves.
///
/// Not inlined: the call costs less than the registers that it would take from the caller.
#[inline(never)]
const fn of_halves(a: u32, b: u32) -> u64 {
    let (a_high, a_low) = (a >> 16, a & 0xffff);
    let (b_high, b_low) = (b >> 16, b & 0xffff);
    let low = a_low.wrapping_mul(b_low);
    // At most (2^16 - 1)^2 + 2^16 - 1: no carry.
    let first = a_high.wrapping_mul(b_low).wrapping_add(low >> 16);
    let second = a_low.wrapping_mul(b_high).wrapping_add(first & 0xffff);
    let high = a_high
        .wrapping_mul(b_high)
        .wrapping_add(first >> 16)
        .wrapping_add(second >> 16);
    (high as u64) << 32 | (second << 16 | low & 0xffff) as u64
}

/// Returns the product of numbers with signs from four products of halves; the low halves have no sign.
#[inline(never)]
const fn of_signed_halves(a: i32, b: i32) -> i64 {
    let (a_high, a_low) = (a >> 16, a & 0xffff);
    let (b_high, b_low) = (b >> 16, b & 0xffff);
    let low = (a_low as u32).wrapping_mul(b_low as u32);
    // At least -2^15 (2^16 - 1), and at most (2^15 - 1) (2^16 - 1) + 2^16 - 1: no carry.
    let first = a_high.wrapping_mul(b_low).wrapping_add((low >> 16) as i32);
    let second = a_low.wrapping_mul(b_high).wrapping_add(first & 0xffff);
    let high = a_high
        .wrapping_mul(b_high)
        .wrapping_add(first >> 16)
        .wrapping_add(second >> 16);
    ((high as i64) << 32) | ((second as u32) << 16 | low & 0xffff) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(a: u32, b: u32) {
        assert_eq!(of_halves(a, b), u64::from(a) * u64::from(b));
        let (a, b) = (a as i32, b as i32);
        assert_eq!(of_signed_halves(a, b), i64::from(a) * i64::from(b));
        assert_eq!(of_signed_halves(a, b), product(a, b));
    }

    fn check_words(a: i64, b: i64) {
        assert_eq!(of_words(a, b), i128::from(a) * i128::from(b));
    }

    #[test]
    fn products_of_halves_are_exact_at_the_ends() {
        let ends = [
            0,
            1,
            2,
            0xfffe,
            0xffff,
            0x1_0000,
            0x1_0001,
            0x7fff_ffff,
            0x8000_0000,
            0x8000_0001,
            0xffff_0000,
            u32::MAX,
        ];
        for a in ends {
            for b in ends {
                check(a, b);
                for (high, low) in ends.iter().flat_map(|high| ends.map(|low| (*high, low))) {
                    let word =
                        |high: u32, low: u32| (u64::from(high) << 32 | u64::from(low)) as i64;
                    check_words(word(a, low), word(high, b));
                }
            }
        }
    }

    proptest! {
        #[test]
        fn products_of_words_are_exact(a in any::<i64>(), b in any::<i64>(), less in 0..64u32) {
            check_words(a, b);
            check_words(a >> less, b);
        }

        #[test]
        fn products_of_halves_are_exact(a in any::<u32>(), b in any::<u32>(), less in 0..32u32) {
            check(a, b);
            check(a >> less, b);
            check((a as i32 >> less) as u32, b);
        }
    }
}
