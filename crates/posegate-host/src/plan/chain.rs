//! A hand-made chain of the site file, step by step.

use std::collections::BTreeMap;

use super::walk::Walk;
use super::{BeliefStateF64, PlanError, TaskTable};
use crate::site::{ChainStep, Site, SiteChain, Task};
use posegate::chain::{BeliefState, Failure, StartAssumption};
use posegate::contain::{Decision, Margin, decide};
use posegate::table::Table;
use posegate::task::{Cylinder, PoseErrorSet};

/// What kind of step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepKind {
    /// A work task.
    Work,
    /// A localization task.
    Localization,
    /// A drive.
    Navigation,
}

/// What was found of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepReport {
    /// What kind of step.
    pub kind: StepKind,
    /// The task's name; none of a drive.
    pub task: Option<String>,
    /// What was known before it.
    pub before: BeliefStateF64,
    /// What is known after it.
    pub after: BeliefStateF64,
    /// What was known before it, in the core's integers.
    pub standing: BeliefState,
    /// How much room a task's set has.
    pub margin: Option<Margin>,
    /// Why it fails, if it does.
    pub failure: Option<Failure>,
    /// The chance that it adds.
    pub risk: f64,
}

/// What was found of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainReport {
    /// What was assumed of the estimate.
    pub assume: StartAssumption,
    /// What was found of each step; what follows one that fails holds as if it had not.
    pub steps: Vec<StepReport>,
    /// The chance that the chain fails although no step does.
    pub risk: f64,
}

impl ChainReport {
    /// Whether no step fails.
    #[must_use]
    pub fn succeeds(&self) -> bool {
        self.first_failure().is_none()
    }

    /// The first step that fails, and why.
    #[must_use]
    pub fn first_failure(&self) -> Option<(usize, Failure)> {
        let mut steps = self.steps.iter().enumerate();
        steps.find_map(|(index, step)| Some((index, step.failure?)))
    }

    /// The risk to six digits, rounded up: what is above 0 never reads 0.
    #[must_use]
    pub fn risk_text(&self) -> String {
        format!("{:.6}", libm::ceil(self.risk * 1e6) * 1e-6)
    }
}

/// Evaluates a chain of a site file on proven tables, which are made.
///
/// Decisions are those of [`posegate::chain`], with sharp margins ([`posegate::contain::examine`]).
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
                // The site's parser lets no name through that is no task's.
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

/// Whether what a localization leaves would fit into its own success set where the set before did: about its
/// goal, if that is in the set at all.
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
