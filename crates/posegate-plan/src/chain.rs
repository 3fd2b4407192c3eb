//! Evaluates a manual chain of the site file, step by step.

use std::collections::BTreeMap;

use super::walk::Walk;
use super::{ChainReport, PlanError, TaskTable};
use posegate::chain::{BeliefState, StartAssumption};
use posegate::contain::{Decision, decide};
use posegate::table::Table;
use posegate::task::{Cylinder, PoseErrorSet};
use posegate_site::{ChainStep, Site, SiteChain, Task};

/// Evaluates a chain of a site file; errors call it `name`. Builds and proves the tables that it needs.
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
