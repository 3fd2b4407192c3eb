//! Cosine and sine in floats, and headings as binary angles.

use core::f64::consts::{FRAC_2_PI, FRAC_PI_2, TAU};

/// The largest angle of [`cos_sin`], radians.
pub(super) const LARGEST: f64 = 16_384.0;

/// The leading 33 bits of a quarter turn: its product with a number of quarter turns is exact.
const QUARTER_HIGH: f64 = f64::from_bits(FRAC_PI_2.to_bits() & !0xf_ffff);
/// The rest of a quarter turn: the float minus the bits above, and pi / 2 minus the float.
const QUARTER_LOW: f64 = FRAC_PI_2 - QUARTER_HIGH + 6.123_233_995_736_766e-17;
/// Adding this rounds a float below 2^51 to a whole number, in its low bits.
const TO_WHOLE: f64 = 6_755_399_441_055_744.0;

/// Returns cosine and sine of an angle up to [`LARGEST`] in magnitude, within 1e-13: series of Taylor about the nearest quarter
/// turn, up to the powers 14 and 13.
#[inline(always)]
pub(super) fn cos_sin(angle: f64) -> [f64; 2] {
    let whole = angle * FRAC_2_PI + TO_WHOLE;
    let quarters = whole - TO_WHOLE;
    let r = angle - quarters * QUARTER_HIGH - quarters * QUARTER_LOW;
    let q = r * r;
    let sin = r
        * (1.0
            + q * (-1.0 / 6.0
                + q * (1.0 / 120.0
                    + q * (-1.0 / 5_040.0
                        + q * (1.0 / 362_880.0
                            + q * (-1.0 / 39_916_800.0 + q * (1.0 / 6_227_020_800.0)))))));
    let cos = 1.0
        + q * (-1.0 / 2.0
            + q * (1.0 / 24.0
                + q * (-1.0 / 720.0
                    + q * (1.0 / 40_320.0
                        + q * (-1.0 / 3_628_800.0
                            + q * (1.0 / 479_001_600.0 - q * (1.0 / 87_178_291_200.0)))))));
    match whole.to_bits() & 3 {
        0 => [cos, sin],
        1 => [-sin, cos],
        2 => [-cos, -sin],
        _ => [sin, -cos],
    }
}

/// Returns an angle in units of 2^-32 turn, within 2 of them. The angle is at most [`LARGEST`] in magnitude.
#[inline(always)]
pub(super) fn binary(angle: f64) -> u32 {
    (angle * (4_294_967_296.0 / TAU)) as i64 as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(20_000, 40)))]
        #[test]
        fn cosine_and_sine_keep_their_error(angle in prop_oneof![-LARGEST..LARGEST, -7.0f64..7.0]) {
            let [c, s] = cos_sin(angle);
            prop_assert!((c - libm::cos(angle)).abs() < 1e-13, "{angle}: {c}");
            prop_assert!((s - libm::sin(angle)).abs() < 1e-13, "{angle}: {s}");
        }

        #[test]
        fn binary_angles_keep_their_error(angle in prop_oneof![-LARGEST..LARGEST, -7.0f64..7.0]) {
            let exact = crate::num::BinaryAngle::from_radians(angle).unwrap();
            let apart = binary(angle).wrapping_sub(exact.0) as i32;
            prop_assert!(apart.abs() <= 2, "{angle}: {apart}");
        }
    }
}
