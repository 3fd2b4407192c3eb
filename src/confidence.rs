//! The radius of a Gaussian pose-set: quantiles of the chi-square distribution with 3 degrees of
//! freedom, from the confidence epsilon.
//!
//! ```
//! use posegate::confidence::{probability, radius_squared};
//!
//! // The pose-set of epsilon = 0.99 reaches 3.37 standard deviations, not 2.58 as in one dimension.
//! let r2 = radius_squared(0.99).expect("between 0 and 1");
//! assert!((r2.sqrt() - 3.368).abs() < 1e-3);
//! assert!((probability(r2) - 0.99).abs() < 1e-9);
//! ```

use crate::set::RadiusSquared;

/// Returns `P(chi^2_3 <= r2)`: the probability that a Gaussian pose-set of squared radius `r2`
/// contains the true pose. Error below 1e-14. Returns 0 for `r2` of 0 and below, and 1 for infinity.
#[must_use]
pub fn probability(r2: f64) -> f64 {
    if r2 <= 0.0 {
        return 0.0;
    }
    // Beyond, the rest is below 1e-300; at infinity the product would be NaN.
    if r2 > 1_400.0 {
        return 1.0;
    }
    let r = libm::sqrt(r2);
    let tail = libm::sqrt(2.0 / core::f64::consts::PI) * r * libm::exp(-0.5 * r2);
    libm::erf(r * core::f64::consts::FRAC_1_SQRT_2) - tail
}

/// Returns the squared radius r2 of the pose-set that contains the true pose with probability
/// `epsilon` (Definition 1): the chi-square quantile with 3 degrees of freedom. `None` unless
/// `0 < epsilon < 1`.
///
/// Relative error below 1e-10 for epsilon up to 1 - 1e-9; found by bisection of [`probability`],
/// from the complement if that is smaller.
#[must_use]
pub fn radius_squared(epsilon: f64) -> Option<f64> {
    if !(epsilon > 0.0 && epsilon < 1.0) {
        return None;
    }
    let complement = 1.0 - epsilon;
    // Compares with the quantile by the more exact of the two tails.
    let below = |r2: f64| {
        if complement < 0.5 {
            let r = libm::sqrt(r2);
            let tail = libm::sqrt(2.0 / core::f64::consts::PI) * r * libm::exp(-0.5 * r2);
            libm::erfc(r * core::f64::consts::FRAC_1_SQRT_2) + tail > complement
        } else {
            probability(r2) < epsilon
        }
    };
    let (mut low, mut high) = (0.0, 512.0);
    while high - low > 1e-13 * high {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(high)
}

/// Returns [`radius_squared`] in the core's form, rounded up by the quantile's own error and to
/// 2^-16. `None` if it is out of the core's range (epsilon below 0.199, or 1 to within 1e-15).
#[must_use]
pub fn core_radius(epsilon: f64) -> Option<RadiusSquared> {
    let r2 = radius_squared(epsilon)? * (1.0 + 1e-9);
    let raw = libm::ceil(r2 * 65536.0);
    (raw < f64::from(u32::MAX))
        .then_some(raw as u32)
        .and_then(RadiusSquared::from_q16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn infinite_radius_contains_everything() {
        for r2 in [1_399.0, 1_401.0, 1e300, f64::INFINITY] {
            assert_eq!(probability(r2), 1.0, "{r2}");
        }
    }

    #[test]
    fn quantiles_equal_published_values() {
        // Published tables of the chi-square distribution, 3 degrees of freedom.
        for (epsilon, r2) in [
            (0.90, 6.251_388_631_170_325),
            (0.95, 7.814_727_903_251_179),
            (0.99, 11.344_866_730_144_373),
        ] {
            let got = radius_squared(epsilon).unwrap();
            assert!((got / r2 - 1.0).abs() < 1e-10, "{epsilon}: {got}");
            let core = core_radius(epsilon).unwrap();
            assert!(f64::from(core.q16()) / 65536.0 >= r2);
            assert!(f64::from(core.q16()) / 65536.0 < r2 + 2e-5);
        }
        for bad in [0.0, 1.0, -0.1, 1.1, f64::NAN] {
            assert_eq!(radius_squared(bad), None);
            assert_eq!(core_radius(bad), None);
        }
        assert_eq!(core_radius(1e-6), None);
    }
}
