//! The probability w that the robot is at none of a report's hypotheses.
//!
//! A pose-set contains the robot with the confidence of the site, epsilon. If the hypotheses of a report contain it only with the
//! probability 1 - w, each set must contain it with a confidence epsilon' such that (1 - w) epsilon' is at least epsilon. The sets grow
//! by a factor of their covariances, which is found without an exponential on the decision path:
//!
//! - Q(x), the probability that a normal error of three dimensions is beyond the squared radius x, is read from a list of lower bounds.
//! - Its hazard rate rises with x, and is at least x / (2 (x + 1)). So Q(x') is at most Q(x) exp(-(x' - x) x / (2 (x + 1))).
//! - x' is chosen so that this is at most Q(x) - w: then 1 - w - Q(x') is at least 1 - Q(x).

use crate::num::quotient;
use crate::set::{Inflation, RadiusSquared, Trust};
use crate::task::Risk;

/// Lower bounds of Q(x), unit 2^-32, for x = 1, 1.5 and so on up to 32.
const BEYOND: [u32; 63] = [
    3_441_350_950,
    2_930_328_755,
    2_458_468_075,
    2_041_359_659,
    1_682_017_324,
    1_377_662_818,
    1_122_979_887,
    911_779_841,
    737_863_116,
    595_448_327,
    479_362_266,
    385_097_522,
    308_798_581,
    247_211_668,
    197_618_771,
    157_767_526,
    125_803_399,
    100_207_430,
    79_740_944,
    63_397_570,
    50_362_252,
    39_976_684,
    31_710_432,
    25_136_994,
    19_914_068,
    15_767_391,
    12_477_536,
    9_869_189,
    7_802_447,
    6_165_794,
    4_870_425,
    3_845_691,
    3_035_435,
    2_395_051,
    1_889_139,
    1_489_620,
    1_174_239,
    925_364,
    729_038,
    574_214,
    452_157,
    355_960,
    280_165,
    220_461,
    173_443,
    136_426,
    107_288,
    84_357,
    66_316,
    52_124,
    40_962,
    32_186,
    25_285,
    19_862,
    15_599,
    12_249,
    9_618,
    7_551,
    5_927,
    4_652,
    3_650,
    2_864,
    2_247,
];
/// The natural logarithm of 2, unit 2^-16, rounded up.
const LN_2_Q16: u64 = 45_427;

/// Returns the trust with which a set of this squared radius compensates the probability `elsewhere`. `None` if no set does:
/// `elsewhere` exceeds 1 - epsilon of the site, or the inflation exceeds 4096.
#[inline(always)]
pub(super) fn allowed_for(elsewhere: Risk, radius: RadiusSquared, trust: Trust) -> Option<Trust> {
    if elsewhere == Risk::NONE {
        Some(trust)
    } else {
        widened(elsewhere, radius, trust)
    }
}

#[inline(never)]
fn widened(elsewhere: Risk, radius: RadiusSquared, trust: Trust) -> Option<Trust> {
    let factor = inflation(elsewhere.q32(), radius.q16())?;
    let inflation = trust.inflation.times(factor)?;
    Some(Trust { inflation, ..trust })
}

fn inflation(w: u32, x_q16: u32) -> Option<Inflation> {
    // The next entry, at a larger radius, is a lower bound.
    let index = x_q16.saturating_sub(1 << 16).wrapping_add((1 << 15) - 1) >> 15;
    let beyond = u64::from(*BEYOND.get(index as usize)?);
    let left = beyond.checked_sub(u64::from(w)).filter(|left| *left > 0)?;
    // (Q - w) / Q, unit 2^-32, rounded down: below 2^32, since w is not zero.
    let share = u32::try_from(quotient(left << 32, beyond)?).ok()?;
    // -ln of 2^-n m is at most (n + 1 - m) ln 2 for m from 1 to 2.
    let n = share.leading_zeros().wrapping_add(1);
    let mantissa_q16 = share.checked_shl(n.wrapping_sub(1))? >> 15;
    let steps_q16 = (u64::from(n).wrapping_add(1) << 16).wrapping_sub(u64::from(mantissa_q16));
    let logarithm_q16 = (steps_q16.wrapping_mul(LN_2_Q16) >> 16).wrapping_add(1);
    // The radius grows by 2 L (x + 1) / x, so the covariance by that over x. Below 2^60.
    let x = u64::from(x_q16);
    let numerator = logarithm_q16
        .wrapping_mul(x.wrapping_add(1 << 16))
        .wrapping_mul(2)
        << 16;
    let more = quotient(numerator, x.wrapping_mul(x))?.wrapping_add(1);
    Inflation::from_q16(u32::try_from(more.checked_add(1 << 16)?).ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Q(x) in closed form.
    fn beyond(x: f64) -> f64 {
        libm::erfc((x / 2.0).sqrt()) + (2.0 * x / core::f64::consts::PI).sqrt() * (-x / 2.0).exp()
    }

    #[test]
    fn the_list_is_of_lower_bounds() {
        for (k, bound) in (0u32..).zip(BEYOND) {
            let exact = beyond(1.0 + f64::from(k) / 2.0) * 2f64.powi(32);
            assert!(
                f64::from(bound) <= exact && f64::from(bound) > exact - 1.001,
                "{k}"
            );
        }
    }

    proptest! {
        /// The sets contain the robot with the confidence of the radius, by the distribution in closed form.
        #[test]
        fn the_confidence_is_kept(x in 1.0..32.0f64, share in 0.0..1.0f64) {
            let radius = RadiusSquared::from_q16((x * 65_536.0) as u32).unwrap();
            let x = f64::from(radius.q16()) / 65_536.0;
            let w = (share * beyond(x) * 2f64.powi(32)) as u32;
            let Some(factor) = inflation(w.max(1), radius.q16()) else {
                // The list's steps lose a quarter at most.
                prop_assert!(share > 0.7);
                return Ok(());
            };
            let grown = x * f64::from(factor.q16()) / 65_536.0;
            let w = f64::from(w) / 2f64.powi(32);
            let held = (1.0 - w) * (1.0 - beyond(grown));
            prop_assert!(held >= 1.0 - beyond(x) - 1e-12, "{held} {}", 1.0 - beyond(x));
            // Not too large if `elsewhere` is small.
            if share < 0.1 && x > 4.0 {
                prop_assert!(beyond(grown) > 0.5 * beyond(x), "{grown} {x}");
            }
        }
    }

    #[test]
    fn what_no_set_makes_up_for_is_refused() {
        // 0.99 of three dimensions.
        let radius = RadiusSquared::from_q16(743_498).unwrap();
        let risk = |confidence| Risk::from_confidence(confidence).unwrap();
        let of = |risk| allowed_for(risk, radius, Trust::FULL);
        assert_eq!(of(Risk::NONE), Some(Trust::FULL));
        assert_eq!(of(risk(0.99)), None);
        assert_eq!(of(risk(0.5)), None);
        let little = of(risk(0.999)).unwrap().inflation.q16();
        let more = of(risk(0.995)).unwrap().inflation.q16();
        assert!(
            65_536 < little && little < more && more < 90_000,
            "{little} {more}"
        );
        let largest = Trust {
            inflation: Inflation::from_q16(1 << 28).unwrap(),
            ..Trust::FULL
        };
        assert_eq!(allowed_for(risk(0.999), radius, largest), None);
        // Beyond the list.
        let wide = RadiusSquared::from_q16(40 << 16).unwrap();
        assert_eq!(allowed_for(risk(0.999_999), wide, Trust::FULL), None);
    }
}
