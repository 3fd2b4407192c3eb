//! Cosine and sine to 2^-30, for predictions of camera images, where 2^-15 would be a pixel.

use super::BinaryAngle;

/// Upper bound of the distance of [`BinaryAngle::cos_sin_q30`] from the true cosine and sine, unit
/// 2^-30.
pub const COS_SIN_ERROR_Q30: i64 = 2;

/// Pi, unit 2^-29: 0.07 of a unit too small.
const PI_Q29: i64 = 1_686_629_713;

impl BinaryAngle {
    /// Returns cosine and sine, unit 2^-30. As a vector they are within `COS_SIN_ERROR_Q30` of the
    /// true one.
    ///
    /// Integer polynomials over an eighth of a turn: `cos x = 1 - t h(t)` and `sin x = x - x t g(t)`
    /// with `t = x^2`, where h and g are of the third degree, interpolated at Chebyshev points.
    ///
    /// | rounding, unit 2^-30 | cosine | sine |
    /// |---|---|---|
    /// | polynomial, its coefficients rounded | 0.21 | 0.04 |
    /// | t to 2^-32, rounded down | 0.13 | 0.04 |
    /// | four products of Horner's rule to 2^-32, rounded down: 1.38 of these in turns | 0.35 | 0.28 |
    /// | the last shift, to the nearest | 0.50 | 0.50 |
    /// | **sum** | **1.19** | **0.86** |
    /// | **as a vector**, 1.47, and x to the nearest of 2^-31, an angle of 0.29 | **1.76** | |
    #[must_use]
    pub const fn cos_sin_q30(self) -> [i32; 2] {
        // The nearest quarter turn, and the rest: at most 2^29.
        let quarter = self.0.wrapping_add(1 << 29) >> 30;
        let rest = self.0.wrapping_sub(quarter.wrapping_shl(30)) as i32;
        // Radians, unit 2^-31, below 0.7854; and their square, unit 2^-32, below 0.6169.
        let x = (rest as i64).wrapping_mul(PI_Q29).wrapping_add(1 << 28) >> 29;
        let t = (x.wrapping_mul(x) >> 30) as u32;
        let h = horner(t, [105_071, 5_964_674, 178_956_902, 2_147_483_647]);
        let g = horner(t, [11_704, 852_125, 35_791_388, 715_827_883]);
        let cos = (1i32 << 30).wrapping_sub((h.wrapping_add(2) >> 2) as i32);
        // x (1 - t g) from 2^-63 to 2^-30.
        let bend = x.wrapping_mul(g as i64);
        let sin = x.wrapping_shl(32).wrapping_sub(bend);
        let sin = (sin.wrapping_add(1 << 32) >> 33) as i32;
        match quarter & 3 {
            0 => [cos, sin],
            1 => [sin.wrapping_neg(), cos],
            2 => [cos.wrapping_neg(), sin.wrapping_neg()],
            _ => [sin, cos.wrapping_neg()],
        }
    }
}

/// Returns `t (d - t (c - t (b - t a)))`. Every number is a fraction of 2^32, every product is rounded
/// down.
#[inline(always)]
const fn horner(t: u32, [a, b, c, d]: [u32; 4]) -> u32 {
    let sum = b.wrapping_sub(high(t, a));
    let sum = c.wrapping_sub(high(t, sum));
    high(t, d.wrapping_sub(high(t, sum)))
}

/// Returns the upper half of a product.
#[inline(always)]
const fn high(a: u32, b: u32) -> u32 {
    ((a as u64).wrapping_mul(b as u64) >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the largest distance from the true vectors for headings `first`, `first + step`, ... Also returns a
    /// digest of every bit of every value, which detects any change in rounding.
    fn worst(first: u32, step: usize) -> (f64, u64) {
        let mut worst = 0.0f64;
        let mut digest = 0xcbf2_9ce4_8422_2325u64;
        for angle in (first..=u32::MAX).step_by(step) {
            let [cos, sin] = BinaryAngle(angle).cos_sin_q30();
            for value in [cos, sin] {
                digest = (digest ^ u64::from(value as u32)).wrapping_mul(0x100_0000_01b3);
            }
            let radians = f64::from(angle as i32) / 4_294_967_296.0 * core::f64::consts::TAU;
            let (s, c) = radians.sin_cos();
            let unit = 1_073_741_824.0;
            worst = worst.max((f64::from(cos) - c * unit).hypot(f64::from(sin) - s * unit));
        }
        (worst, digest)
    }

    /// Four million headings. The error table is a proof; this test checks that the code implements
    /// it.
    #[test]
    fn cosine_and_sine_keep_their_error() {
        let (worst, digest) = worst(0, 1021);
        assert!((1.0..=1.76).contains(&worst), "{worst}");
        assert!(worst < COS_SIN_ERROR_Q30 as f64);
        assert_eq!(digest, 0xde06_022c_b11e_7e88, "{digest:#x}");
    }

    #[test]
    #[ignore = "every heading takes minutes: run by ci.sh headings"]
    fn every_heading_keeps_its_error() {
        let (worst, _) = worst(0, 1);
        std::println!("worst {worst}");
        assert!((1.0..=1.76).contains(&worst), "{worst}");
    }

    #[test]
    fn quarters_of_a_turn_are_exact() {
        let one = 1 << 30;
        let quarters = [0u32, 1, 2, 3].map(|k| BinaryAngle(k << 30).cos_sin_q30());
        assert_eq!(quarters, [[one, 0], [0, one], [-one, 0], [0, -one]]);
    }
}
