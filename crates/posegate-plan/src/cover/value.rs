//! Finds the tasks that need each chosen tag.

use rayon::prelude::*;

use super::oracle::Robustness;
use super::{Cover, TaskCoverage};
use crate::{Library, Options, PlanError, TaskPlanner};

impl TaskCoverage {
    /// Returns `true` if the task's plan, or one of its contingencies, looks at a tag.
    pub(super) fn looks_at(&self, tag: &str) -> bool {
        let others = self.planned.contingencies.iter().map(|other| &other.plan);
        let plans = self.planned.plan.iter().chain(others);
        let mut steps = plans.flat_map(|plan| &plan.steps);
        steps.any(|step| step.tags.iter().any(|known| known == tag))
    }
}

/// Finds for each chosen tag the tasks that look at it, and which of them have no plan, or no surviving plan, without
/// it.
pub(super) fn value(
    cover: &mut Cover,
    options: &Options,
    kind: Robustness,
) -> Result<(), PlanError> {
    let site = &cover.site;
    let library = match Library::of(site) {
        Ok(library) => library,
        Err(PlanError::NoLooks(_)) => return Ok(()),
        Err(error) => return Err(error),
    };
    let tags: Vec<&str> = cover.tags.iter().map(|tag| tag.name.as_str()).collect();
    let options = |survive| Options {
        survive_a_lost_tag: survive,
        ..options.clone()
    };
    // A task does not need a tag that it does not look at.
    let effects_of = |task: &TaskCoverage| {
        let looked = tags.iter().copied().filter(|tag| task.looks_at(tag));
        let looked: Vec<&str> = looked.filter(|_| task.reason.is_none()).collect();
        if looked.is_empty() {
            return Ok(vec![]);
        }
        let start = &site.chains[&task.from].start;
        let (from, all) = (Some(task.from.as_str()), f64::INFINITY);
        let endpoint = TaskPlanner::of(site, &library, start, &task.task, from, all)?;
        let effect_of = |tag: &str| {
            let has = |other: &str| other != tag;
            if endpoint.plan(has, &options(false))?.plan.is_none() {
                return Ok(LossEffect::Plan);
            }
            let second = kind == Robustness::Survives;
            Ok(
                if second && endpoint.plan(has, &options(true))?.plan.is_none() {
                    LossEffect::Second
                } else {
                    LossEffect::Nothing
                },
            )
        };
        let effect = |tag: &str| Ok((tag.to_owned(), task.task.clone(), effect_of(tag)?));
        looked
            .into_iter()
            .map(effect)
            .collect::<Result<Vec<_>, _>>()
    };
    let effects = cover.tasks.par_iter().map(effects_of);
    let effects: Vec<_> = effects.collect::<Result<Vec<_>, PlanError>>()?;
    for tag in &mut cover.tags {
        for list in [
            &mut tag.looked_at_by,
            &mut tag.needed_by,
            &mut tag.second_of,
        ] {
            list.clear();
        }
    }
    for (name, task, effect) in effects.into_iter().flatten() {
        let own = cover.tags.iter_mut().find(|tag| tag.name == name);
        if let Some(tag) = own {
            tag.looked_at_by.push(task.clone());
            match effect {
                LossEffect::Plan => tag.needed_by.push(task),
                LossEffect::Second => tag.second_of.push(task),
                LossEffect::Nothing => {}
            }
        }
    }
    Ok(())
}

/// The effect of a tag's loss on a task.
enum LossEffect {
    Plan,
    Second,
    Nothing,
}
