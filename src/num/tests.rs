use super::*;
use proptest::prelude::*;

proptest! {
    #[test]
    fn quotients_enclose(dividend in any::<i64>(), divisor in 1..i64::MAX) {
        let dividend = dividend / 2;
        let by = Divisor::new(divisor).unwrap();
        let (a, b) = (i128::from(dividend), i128::from(divisor));
        let lo = i128::from(by.floor(dividend));
        let hi = i128::from(by.ceil(dividend));
        prop_assert!(lo * b <= a && (lo + 1) * b > a);
        prop_assert!(hi * b >= a && (hi - 1) * b < a);
        let near = i128::from(by.nearest(dividend));
        prop_assert!((2 * (near * b - a)).abs() <= b);
    }

    /// As with numbers of 128 bits, at every size.
    #[test]
    fn scaled_floats_are_exact(
        bits in any::<u64>(), near in -70i32..70, factor in any::<u128>(), less in 54..128u32, away: bool,
    ) {
        let Some(float) = Float::of(f64::from_bits(bits)) else {
            return Ok(());
        };
        let (factor, rounding) = (factor >> less, if away { Rounding::AwayFromZero } else { Rounding::Nearest });
        for shift in [near, float.exponent + near, float.exponent + 63 + near] {
            let product = u128::from(float.mantissa) * factor;
            let power = float.exponent - shift;
            let exact = if product == 0 {
                Some(0)
            } else if power >= 0 {
                (power < product.leading_zeros() as i32).then(|| product << power)
            } else {
                let by = power.unsigned_abs();
                let whole = product.checked_shr(by).unwrap_or(0);
                let half = product.checked_shr(by - 1).unwrap_or(0) & 1;
                let rest = whole.checked_shl(by).unwrap_or(0) != product;
                Some(whole + if away { u128::from(rest) } else { half })
            };
            let exact = exact.filter(|v| v >> 62 == 0).map(|v| v as i64);
            let exact = exact.map(|v| if float.negative { -v } else { v });
            prop_assert_eq!(float.scaled(factor, shift, rounding), exact);
        }
    }

    #[test]
    fn floats_come_apart_exactly(value in any::<f64>()) {
        match Float::of(value) {
            None => prop_assert!(!value.is_finite()),
            Some(float) => {
                let magnitude = float.mantissa as f64 * 2f64.powi(float.exponent.max(-1000))
                    * 2f64.powi(float.exponent - float.exponent.max(-1000));
                prop_assert_eq!(if float.negative { -magnitude } else { magnitude }, value);
            }
        }
    }

    #[test]
    fn micrometres_are_the_nearest(value in -2000.0f64..2000.0) {
        let um = Float::of(value).unwrap().scaled(1_000_000, 0, Rounding::Nearest).unwrap();
        prop_assert!((um as f64 - value * 1e6).abs() <= 0.5 + 1e-6);
        let away = Float::of(value).unwrap().scaled(1_000_000, 0, Rounding::AwayFromZero).unwrap();
        prop_assert!((away as f64).abs() >= (value * 1e6).abs() - 1e-6);
        prop_assert!((away as f64).abs() < (value * 1e6).abs() + 1.0 + 1e-6);
    }

    #[test]
    fn angles_are_the_nearest(radians in -100.0f64..100.0) {
        let angle = BinaryAngle::from_radians(radians).unwrap();
        let expected = (radians / core::f64::consts::TAU).rem_euclid(1.0) * 4294967296.0;
        let error = (f64::from(angle.0) - expected).abs();
        prop_assert!(!(0.6..=4294967295.0).contains(&error));
    }
}

/// Every value of the polynomials, and headings between them.
#[test]
fn cosine_and_sine_keep_their_error() {
    let mut worst = 0.0f64;
    // Digests every bit of every value, so that no change in rounding goes unnoticed.
    let mut digest = 0xcbf2_9ce4_8422_2325u64;
    for step in (0..1u32 << 18).step_by(crate::test_iterations(1, 1021) as usize) {
        for odd in [0, 1 << 13, (1 << 13) - 1, 5000, 16_383] {
            let angle = BinaryAngle((step << 14).wrapping_add(odd));
            let [cos, sin] = angle.cos_sin_q15();
            for value in [cos, sin] {
                digest = (digest ^ u64::from(value as u32)).wrapping_mul(0x100_0000_01b3);
            }
            let [cos, sin] = [cos, sin].map(|v| f64::from(v) / 32_768.0);
            let (s, c) = (f64::from(angle.0) / 4_294_967_296.0 * core::f64::consts::TAU).sin_cos();
            worst = worst.max((cos - c).hypot(sin - s) * 32_768.0);
        }
    }
    if !cfg!(miri) {
        assert_eq!(digest, 0x2908_281c_f6b2_5e25, "{digest:#x}");
        assert!((1.2..=1.65).contains(&worst), "{worst}");
    }
    assert!(worst < f64::from(COS_SIN_ERROR_Q15));
}

#[test]
fn angles_at_the_ends() {
    assert_eq!(
        BinaryAngle::from_radians(core::f64::consts::PI).unwrap().0,
        1 << 31
    );
    assert_eq!(
        BinaryAngle::from_radians(-core::f64::consts::FRAC_PI_2)
            .unwrap()
            .0,
        3 << 30
    );
    assert_eq!(BinaryAngle::from_radians(-0.0).unwrap().0, 0);
    assert_eq!(BinaryAngle::from_radians(f64::MIN_POSITIVE).unwrap().0, 0);
    assert!(BinaryAngle::from_radians(16383.9).is_some());
    for bad in [
        16384.0,
        -16384.0,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
    ] {
        assert_eq!(BinaryAngle::from_radians(bad), None, "{bad}");
    }
}

#[test]
fn half_a_turn_is_the_lowest_of_signed_angles() {
    for (angle, signed) in [
        (0, 0),
        (1, 1),
        ((1 << 31) - 1, i32::MAX),
        (1 << 31, i32::MIN),
        (u32::MAX, -1),
    ] {
        assert_eq!(BinaryAngle(angle).signed(), signed);
    }
}

#[test]
fn products_too_large_are_refused() {
    assert_eq!(
        Float::of(1e300).unwrap().scaled(1, 0, Rounding::Nearest),
        None
    );
    assert_eq!(
        Float::of(1.0)
            .unwrap()
            .scaled(1 << 74, 0, Rounding::Nearest),
        None
    );
    assert_eq!(
        Float::of(1.0)
            .unwrap()
            .scaled(1 << 62, 0, Rounding::Nearest),
        None
    );
    let largest = Float::of(1.0)
        .unwrap()
        .scaled((1 << 62) - 1, 0, Rounding::Nearest);
    assert_eq!(largest, Some((1 << 62) - 1));
    assert_eq!(
        Float::of(0.0).unwrap().scaled(1, -2000, Rounding::Nearest),
        Some(0)
    );
    assert_eq!(
        Float::of(5e-324)
            .unwrap()
            .scaled(1, 0, Rounding::AwayFromZero),
        Some(1)
    );
    assert_eq!(Divisor::new(0), None);
    assert_eq!(Divisor::new(-1), None);
}
