//! Factors for a new robot: the factors that robots (or runs) with systematic differences need, and the largest that
//! a new one will need.

use super::binomial::{conformal_rank, order_statistic};
use serde::{Deserialize, Serialize};

/// A group of estimates: a robot, or a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroupReport {
    /// The text in the column.
    pub name: String,
    /// Rows with a possible covariance.
    pub rows: u64,
    /// The share of the group's pose-sets that contain the truth with the model's factors.
    pub coverage: f64,
    /// That share with the factors that the other groups need; `None` if there are too few other groups.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out_coverage: Option<f64>,
}

/// Returns the smallest number of groups from which a factor for a new one follows with a confidence.
pub(super) fn needed(confidence: f64) -> u64 {
    let fewest = libm::ceil(confidence / (1.0 - confidence) - 1e-9).max(1.0) as u64;
    // The rank decides; the quotient may be off by a rounding error.
    (fewest.saturating_sub(1).max(1)..=fewest + 1)
        .find(|groups| conformal_rank(*groups, confidence).is_some())
        .unwrap_or(fewest + 1)
}

/// Returns the factor that a group needs: the score of rank ceil((n + 1) epsilon) of its n, infinite if it has too
/// few scores. All groups use the same rank, so the factors of groups that differ only by chance are exchangeable.
pub(super) fn own_factor(scores: &[f64], epsilon: f64) -> f64 {
    conformal_rank(scores.len() as u64, epsilon)
        .and_then(|rank| order_statistic(scores, rank))
        .unwrap_or(f64::INFINITY)
}

/// Returns the largest factor that a new group needs, with a confidence: the one of rank ceil((G + 1) confidence) of
/// the factors of G groups. `None` if there are too few groups, or if too many of them have too few rows.
pub(super) fn for_a_new_group(factors: &[f64], confidence: f64) -> Option<f64> {
    let rank = conformal_rank(factors.len() as u64, confidence)?;
    order_statistic(factors, rank).filter(|factor| factor.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_is_that_of_exchangeable_groups() {
        for (confidence, groups) in [(0.5, 1), (0.7, 3), (0.8, 4), (0.9, 9), (0.95, 19)] {
            assert_eq!(needed(confidence), groups, "{confidence}");
        }
        assert_eq!(for_a_new_group(&[1.0, 4.0, 2.0], 0.8), None);
        assert_eq!(for_a_new_group(&[1.0, 4.0, 2.0, 3.0], 0.8), Some(4.0));
        assert_eq!(for_a_new_group(&[1.0, 4.0, 2.0, 3.0], 0.6), Some(3.0));
        assert_eq!(for_a_new_group(&[1.0, f64::INFINITY, 2.0, 3.0], 0.8), None);
        assert_eq!(own_factor(&[3.0, 1.0, 2.0, 4.0], 0.8), 4.0);
        assert_eq!(own_factor(&[3.0, 1.0, 2.0], 0.8), f64::INFINITY);
    }
}
