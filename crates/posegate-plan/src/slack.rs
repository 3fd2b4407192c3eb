//! The smallest margin of a chain, and the advice if it is hardly above 1.

use super::ChainReport;
use posegate::contain::Margin;
use posegate_replay::factor;

/// Below this margin, errors that are a little larger than stated break a plan.
const LITTLE_SLACK: f64 = 1.05;

impl ChainReport {
    /// Returns the smallest margin with the number of its step, from 0.
    #[must_use]
    pub fn worst_margin(&self) -> Option<(Margin, usize)> {
        let steps = self.steps.iter().enumerate();
        let margins = steps.filter_map(|(number, step)| Some((step.margin?, number)));
        margins.min_by_key(|(margin, _)| margin.q16())
    }
}

/// Returns what a margin hardly above 1 means and what to do; `None` for a larger margin.
#[must_use]
pub fn little_slack(margin: Margin) -> Option<&'static str> {
    (factor(margin) < LITTLE_SLACK).then_some(
        "this plan holds for hardly larger errors than stated: write `least_margin = 1.1` under [planner] in the site file and plan again, or let the task allow more",
    )
}

/// Formats a margin with two decimals, rounded down: the printed value is proven.
#[must_use]
pub fn margin_text(margin: Margin) -> String {
    format!("{:.2}", libm::floor(factor(margin) * 100.0) / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margins_below_1_05_have_little_slack() {
        let of = |factor: f64| Margin::from_q16((factor * 65_536.0) as u32);
        assert!(little_slack(of(1.0)).is_some() && little_slack(of(1.0499)).is_some());
        assert!(little_slack(of(1.0501)).is_none());
        assert_eq!(margin_text(of(1.0499)), "1.04");
    }
}
