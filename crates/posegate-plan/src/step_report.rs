//! The results of a chain and of its steps.

use super::BeliefStateF64;
use posegate::chain::{BeliefState, Failure, StartAssumption};
use posegate::contain::Margin;

/// The kind of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepKind {
    /// A work task.
    Work,
    /// A localization task.
    Localization,
    /// A drive.
    Navigation,
}

/// The result of one step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepReport {
    /// The kind of the step.
    pub kind: StepKind,
    /// The task's name; `None` for a drive.
    pub task: Option<String>,
    /// The belief before the step.
    pub before: BeliefStateF64,
    /// The belief after the step.
    pub after: BeliefStateF64,
    /// The belief before the step, in the core's integers.
    pub standing: BeliefState,
    /// The margin in the task's success set.
    pub margin: Option<Margin>,
    /// The reason of the failure, if the step fails.
    pub failure: Option<Failure>,
    /// The probability of failure that the step adds.
    pub risk: f64,
}

/// The result of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainReport {
    /// The assumption about the estimate.
    pub assume: StartAssumption,
    /// The result of each step. Steps after a failed step are evaluated as if that step had succeeded.
    pub steps: Vec<StepReport>,
    /// The probability that the chain fails although no step does.
    pub risk: f64,
}

impl ChainReport {
    /// Returns `true` if no step fails.
    #[must_use]
    pub fn succeeds(&self) -> bool {
        self.first_failure().is_none()
    }

    /// Returns the number of the first step that fails, from 0, and its failure.
    #[must_use]
    pub fn first_failure(&self) -> Option<(usize, Failure)> {
        let mut steps = self.steps.iter().enumerate();
        steps.find_map(|(index, step)| Some((index, step.failure?)))
    }

    /// Returns the risk with six decimals, rounded up: a risk above 0 is never printed as 0.
    #[must_use]
    pub fn risk_text(&self) -> String {
        format!("{:.6}", libm::ceil(self.risk * 1e6) * 1e-6)
    }
}
