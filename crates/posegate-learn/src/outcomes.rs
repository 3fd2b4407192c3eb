//! Tests whether the outcomes of permitted dockings contradict the claim that they succeed with probability epsilon.

use super::LearnError;
use super::sequence::confidence_sequence;
use posegate_files::sheet::Sheet;

/// Reads a fleet's outcomes: `success`, 0 or 1, in the order of `t_s` if that column exists.
///
/// # Errors
/// A missing column; the first invalid field, with its line and column; a file without rows.
pub fn outcomes(bytes: &[u8], file: &str) -> Result<Vec<bool>, LearnError> {
    let mut sheet = Sheet::new(bytes, file)?;
    let success = sheet.needed("success", &["success"])?;
    let time = sheet.optional("t_s")?;
    let mut rows = Vec::new();
    while let Some(line) = sheet.line()? {
        let at = match time {
            Some(column) => line.number(column, |_| true, "a time in seconds")?,
            None => 0.0,
        };
        rows.push((at, line.flag(success)?));
    }
    if rows.is_empty() {
        return Err(LearnError::Empty {
            file: file.to_owned(),
        });
    }
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(rows.into_iter().map(|(_, success)| success).collect())
}

/// The result of testing a fleet's outcomes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutcomesReport {
    /// Number of dockings.
    pub count: u64,
    /// Dockings that succeeded.
    pub successes: u64,
    /// Limits of the probability of success, with confidence `1 - alpha` for all evaluations together: a confidence
    /// sequence, see [`confidence_sequence`].
    pub limits: [f64; 2],
    /// The value of the bet against the claim after the last docking.
    pub e_value: f64,
    /// The largest value of the bet against the claim.
    pub largest_e_value: f64,
    /// The number of dockings after which the bet first reached `1 / alpha`: the claim is contradicted. `None` if
    /// it never did.
    pub contradicted_at: Option<u64>,
}

/// The number of failure rates with a bet, evenly spaced on a logarithmic scale between the claimed rate and 1.
const BETS: u32 = 64;

/// Tests the claim that a docking succeeds with probability `epsilon` or more, for any results of earlier dockings.
///
/// A bet starts at 1. At each docking it is multiplied by the likelihood ratio of the outcome: its probability under
/// a higher failure rate over that under the claimed one. The e-value is the mean of the bets on many rates. If the
/// claim is true, the e-value ever reaches `1 / alpha` with probability at most `alpha` (Ville's inequality), for any
/// number of evaluations and any stopping rule. The e-value is the test. The limits are also valid at every
/// evaluation, if every docking succeeds with the same probability.
///
/// # Errors
/// [`LearnError::Share`] if epsilon or alpha is not in (0, 1).
pub fn test_outcomes(
    outcomes: &[bool],
    epsilon: f64,
    alpha: f64,
) -> Result<OutcomesReport, LearnError> {
    for (name, value) in [("epsilon", epsilon), ("alpha", alpha)] {
        if !(value > 0.0 && value < 1.0) {
            return Err(LearnError::Share { name, value });
        }
    }
    let claimed = 1.0 - epsilon;
    let rates = (0..BETS).map(|k| {
        let share = (f64::from(k) + 0.5) / f64::from(BETS);
        libm::pow(claimed, 1.0 - share)
    });
    // The logarithms of a bet's factors at a failure and at a success.
    let steps: Vec<[f64; 2]> = rates
        .map(|rate| [libm::log(rate / claimed), libm::log((1.0 - rate) / epsilon)])
        .collect();
    let mut bets = std::vec![0.0; steps.len()];
    let threshold = -libm::log(alpha);
    let (mut e, mut largest, mut contradicted_at) = (0.0, 0.0f64, None);
    for (index, success) in outcomes.iter().enumerate() {
        for (bet, step) in bets.iter_mut().zip(&steps) {
            *bet += step[usize::from(*success)];
        }
        e = mean_of_logarithms(&bets);
        largest = largest.max(e);
        if e >= threshold && contradicted_at.is_none() {
            contradicted_at = Some(index as u64 + 1);
        }
    }
    let successes = outcomes.iter().filter(|success| **success).count() as u64;
    let count = outcomes.len() as u64;
    Ok(OutcomesReport {
        count,
        successes,
        limits: confidence_sequence(successes, count, alpha),
        e_value: libm::exp(e.min(700.0)),
        largest_e_value: libm::exp(largest.min(700.0)),
        contradicted_at,
    })
}

/// Returns the logarithm of the mean of numbers, given their logarithms.
fn mean_of_logarithms(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = logs.iter().map(|log| libm::exp(log - most)).sum();
    most + libm::log(sum / logs.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::mixed;

    fn fleet(seed: u64, count: u64, failures: f64) -> Vec<bool> {
        let limit = (failures * (1u64 << 53) as f64) as u64;
        (0..count)
            .map(|k| mixed(mixed(seed) ^ k) >> 11 >= limit)
            .collect()
    }

    #[test]
    fn false_claims_are_contradicted_and_true_ones_rarely() {
        let contradicted = |failures: f64| {
            (0..400)
                .filter(|seed| {
                    let fleet = fleet(*seed, 1500, failures);
                    let found = test_outcomes(&fleet, 0.99, 0.05).unwrap();
                    found.contradicted_at.is_some()
                })
                .count()
        };
        // At most 5 % of the fleets with a barely true claim; 32 of 400 would be 3 sigma more.
        assert!(contradicted(0.01) <= 32, "{}", contradicted(0.01));
        assert!(contradicted(0.03) >= 390, "{}", contradicted(0.03));
    }

    /// Each docking must succeed with the probability for any earlier results. If failures come in series of 20, the claim is true on
    /// average, and false after the first failure of a series: such fleets are contradicted.
    #[test]
    fn failures_in_series_contradict_a_claim_that_is_true_on_average() {
        let contradicted = (0..400).filter(|seed| {
            let series = fleet(*seed, 75, 0.01);
            let dockings: Vec<bool> = series.iter().flat_map(|ok| [*ok; 20]).collect();
            let found = test_outcomes(&dockings, 0.99, 0.05).unwrap();
            found.contradicted_at.is_some()
        });
        let count = contradicted.count();
        assert!(count > 100, "{count}");
    }

    #[test]
    fn e_value_equals_the_hand_computed_one() {
        let found = test_outcomes(&[true; 100], 0.9, 0.05).unwrap();
        assert!(found.e_value < 1.0 && found.contradicted_at.is_none());
        assert_eq!(found.successes, 100);
        assert_eq!(found.limits, confidence_sequence(100, 100, 0.05));
        let found = test_outcomes(&[false; 10], 0.9, 0.05).unwrap();
        assert!(found.contradicted_at.is_some_and(|at| at <= 3));
        assert!(test_outcomes(&[true], 1.0, 0.05).is_err());
        assert!(test_outcomes(&[true], 0.9, f64::NAN).is_err());
    }
}
