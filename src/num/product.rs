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
    i128::from(a).wrapping_mul(i128::from(b)).wrapping_shr(DOWN) as i64
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
            }
        }
    }

    proptest! {
        #[test]
        fn products_of_halves_are_exact(a in any::<u32>(), b in any::<u32>(), less in 0..32u32) {
            check(a, b);
            check(a >> less, b);
            check((a as i32 >> less) as u32, b);
        }
    }
}
