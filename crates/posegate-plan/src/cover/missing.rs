//! Tasks that no candidate serves, with the reasons.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::exact::Terms;
use super::oracle::{Oracle, OracleAnswer, Robustness};
use super::tags::Tags;
use crate::{PlanError, PlanResult};
use posegate_site::{GeneratedLook, Site};

/// Returns the tasks that no choice serves, with the reasons.
pub(super) fn unserved(
    oracles: &mut [Oracle<'_>],
    site: &Site,
) -> Result<BTreeMap<String, String>, PlanError> {
    let why = oracles
        .par_iter_mut()
        .map(|oracle| {
            let all = oracle.reach.clone();
            if oracle.serves(&all, Robustness::Plain)? {
                return Ok(None);
            }
            let planned = oracle.plan(&all, Robustness::Plain)?;
            Ok(Some((oracle.task.clone(), why_not(oracle, &planned, site))))
        })
        .collect::<Result<Vec<_>, PlanError>>()?;
    Ok(why.into_iter().flatten().collect())
}

/// Returns the reason why no choice serves a task.
fn why_not(oracle: &Oracle<'_>, planned: &PlanResult, site: &Site) -> String {
    let start = oracle.endpoint.start().pose;
    let goal = site.tasks[&oracle.task].success.goal;
    let near = |made: &&GeneratedLook| {
        made.success.shape.visibility().is_some_and(|view| {
            let tag = view.tag.pose;
            let from = |x: f64, y: f64| libm::hypot(tag.x - x, tag.y - y);
            let reach = view.d_max + libm::hypot(view.mount.x, view.mount.y);
            from(start.x, start.y).min(from(goal.x, goal.y)) <= reach
        })
    };
    let offers = site.planner.offers.values().filter(near);
    let offered: BTreeSet<&String> = offers.map(|made| &made.tag).collect();
    if oracle.reach.is_empty() {
        return match offered.len() {
            0 => "no candidate is in reach: none is near enough to the start or the goal".into(),
            near => format!(
                "no candidate is in reach: {near} are near enough to the start or the goal, \
                 but none is seen from near the straight line between these: \
                 they look elsewhere, or walls hide them{}",
                if site
                    .candidates
                    .values()
                    .any(|one| !one.tag.tolerance.is_none())
                {
                    " (a wall also hides a tag on it that has a tolerance: \
                     leave the wall out of `walls` in [planner] look)"
                } else {
                    ""
                }
            ),
        };
    }
    format!(
        "with all {} candidates in reach: {}",
        oracle.reach.len(),
        planned.why_not()
    )
}

/// Returns the tasks that have plans, but none that survives the loss of a tag, even with all
/// candidates.
pub(super) fn unreinforced(
    oracles: &mut [Oracle<'_>],
    chosen: &Tags,
    terms: &Terms<'_>,
) -> Result<BTreeMap<String, String>, PlanError> {
    let why = oracles
        .par_iter_mut()
        .map(|oracle| {
            if oracle.serves(chosen, terms.kind)? {
                return Ok(None);
            }
            let all = oracle.reach.clone();
            let why = match oracle.ask(&all, terms.kind)? {
                // (The choice was completed without this task: an internal error that ends here.)
                OracleAnswer::Served(_) => return Ok(None),
                OracleAnswer::Unknown => "no plan within the limit of the search",
                OracleAnswer::Not => "every plan has a tag whose loss it does not survive",
            };
            let count = all.len();
            let why = format!("with all {count} candidates in reach: {why}");
            Ok(Some((oracle.task.clone(), why)))
        })
        .collect::<Result<Vec<_>, PlanError>>()?;
    Ok(why.into_iter().flatten().collect())
}
