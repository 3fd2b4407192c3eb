//! The plans among the results of a merge.

use std::path::Path;

use serde_json::Value;

use super::error::SiteBuildError;
use super::piece::Piece;
use super::records;
use super::results::parts_to_merge;
use super::store::Store;
use crate::{BeliefStateF64, Route};
use posegate_site::Site;

/// A plan that a merge wrote.
#[derive(Clone, Debug, PartialEq)]
pub struct MergedPlan {
    /// The chain whose start the plan begins with.
    pub from: String,
    /// The work task.
    pub task: String,
    /// The route, the cost and the smallest margin; the reason if there is no plan.
    pub found: Result<MergedRoute, String>,
}

/// The route of a plan that a merge wrote.
#[derive(Clone, Debug, PartialEq)]
pub struct MergedRoute {
    /// The route.
    pub route: Route,
    /// The cost of the plan.
    pub cost: f64,
    /// The smallest margin of its steps.
    pub worst_margin: Option<f64>,
}

/// Returns the plans that [`merge`](super::merge()) wrote into `output` for this site, sorted by task and chain. They
/// depend on the results only, so they are equal for any number of shards.
///
/// # Errors
/// [`SiteBuildError`] if the parts are not of this site, or if a plan is missing or damaged.
pub fn merged_plans(output: &Path, site: &Site) -> Result<Vec<MergedPlan>, SiteBuildError> {
    let (inventory, _) = records::inventory(&parts_to_merge(output)?, Some(site))?;
    let results = Store::new(output.into());
    let mut plans = Vec::new();
    for piece in inventory.pieces() {
        let Piece::Plan { from, task } = piece else {
            continue;
        };
        let path = Piece::plan_path(from, task);
        let bytes = results.read(&path)?.unwrap_or_default();
        let found = serde_json::from_slice(&bytes)
            .ok()
            .and_then(|plan: Value| found(&plan, site, from, task))
            .ok_or_else(|| SiteBuildError::Damaged {
                path: results.path(&path),
                why: "is not a plan".into(),
            })?;
        plans.push(MergedPlan {
            from: from.clone(),
            task: task.clone(),
            found,
        });
    }
    plans.sort_by(|a, b| (&a.task, &a.from).cmp(&(&b.task, &b.from)));
    Ok(plans)
}

/// Reads a plan's JSON. Returns `None` if it is not the plan of a task of this site.
fn found(plan: &Value, site: &Site, from: &str, task: &str) -> Option<Result<MergedRoute, String>> {
    if !plan["success"].as_bool()? {
        return Some(Err(plan["reason"].as_str()?.to_owned()));
    }
    let goal = site.tasks.get(task)?.success.goal;
    let start = site.chains.get(from)?.start.toward(goal);
    let pose = [start.pose.x, start.pose.y, start.pose.yaw_deg.to_radians()];
    let start = BeliefStateF64::at_start(pose, start.spread, &start.known);
    let margins = plan["steps"].as_array()?.iter();
    let margins = margins.filter_map(|step| step["margin"].as_f64());
    Some(Ok(MergedRoute {
        route: Route::from_json(plan, &start)?,
        cost: plan["cost"].as_f64()?,
        worst_margin: margins.min_by(f64::total_cmp),
    }))
}
