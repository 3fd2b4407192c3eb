//! Evaluates a manual chain of the site file, step by step.

use std::collections::BTreeMap;

use super::walk::Walk;
use super::{BeliefStateF64, PlanError, TaskTable};
use crate::site::{ChainStep, Site, SiteChain, Task};
use posegate::chain::{BeliefState, Failure, StartAssumption};
use posegate::contain::{Decision, Margin, decide};
use posegate::table::Table;
use posegate::task::{Cylinder, PoseErrorSet};

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
    /// The margin in the task's success set; `None` for a drive.
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

/// Evaluates a chain of a site file; errors call it `name`. Builds and proves the tables that the chain needs.
///
/// Decisions are those of [`posegate::chain`], with the margins of [`posegate::contain::examine`].
///
/// # Errors
/// [`PlanError`].
pub fn evaluate(
    site: &Site,
    name: &str,
    chain: &SiteChain,
    assume: StartAssumption,
) -> Result<ChainReport, PlanError> {
    if chain.steps.is_empty() {
        return Err(PlanError::NoSteps(name.to_owned()));
    }
    let mut tables: BTreeMap<&str, (&Task, TaskTable)> = BTreeMap::new();
    for step in &chain.steps {
        if let ChainStep::Task(name) = step
            && !tables.contains_key(name.as_str())
            && let Some(task) = site.tasks.get(name)
        {
            let table = TaskTable::proven(site, name, &task.success, task.wish)?;
            tables.insert(name, (task, table));
        }
    }
    let mut walk = Walk::start(site, &chain.start, assume)?;
    let mut steps = Vec::new();
    for (index, step) in chain.steps.iter().enumerate() {
        let report = match step {
            ChainStep::Task(name) => {
                // The site parser accepts only names of tasks, so this lookup succeeds.
                let Some((task, table)) = tables.get(name.as_str()) else {
                    continue;
                };
                let report = walk.task(&table.table()?, task.error_bound)?;
                if let Some(bound) = task.error_bound
                    && !fits(&table.table()?, &walk.standing)
                {
                    return Err(PlanError::BoundTooLarge {
                        task: name.clone(),
                        translation: bound.translation,
                        yaw_deg: bound.yaw_deg,
                    });
                }
                report
            }
            ChainStep::Navigate { from, legs, model } => {
                walk.drive(from, legs, model)
                    .map_err(|cause| PlanError::Drive {
                        step: index + 1,
                        cause,
                    })?
            }
        };
        steps.push(report);
    }
    let risk = steps.iter().map(|step| step.risk).sum();
    Ok(ChainReport {
        assume,
        steps,
        risk,
    })
}

/// Returns `true` if the set after a localization fits into the localization's own success set. The set is
/// placed at the goal. Also returns `true` if the goal itself is not in the success set.
fn fits(table: &Table<'_>, after: &BeliefState) -> bool {
    let goal = table.goal().pose;
    let Some(smallest) = PoseErrorSet::bounded(Cylinder::POINT).about(goal, Cylinder::POINT) else {
        return true;
    };
    if decide(table, &smallest) != Decision::Inside {
        return true;
    }
    let set = after.knowledge.about(goal, Cylinder::POINT);
    set.is_some_and(|set| decide(table, &set) == Decision::Inside)
}
