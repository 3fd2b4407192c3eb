//! One plan on a large site: prepares only the looks near the path that can matter.

use super::library::region;
use super::{Library, Options, PlanError, PlanResult, Prepared, Status};
use posegate::bake::wide_extent;
use posegate::shape::SuccessSet;
use posegate_site::{ChainStart, Site};

/// Sites with at most this many looks are prepared completely.
const FEW: usize = 64;

/// First allowed length of a path beyond the straight one, metres.
const DETOUR: f64 = 4.0;

/// Plans one task of a site. The plan costs as much as that of [`Prepared::plan`] with the complete library. `chain`
/// names the chain whose drive model is used if the site has none.
///
/// Only looks near the path are prepared at first. If a cheaper chain could have a longer path, the looks within that
/// path's length are added. If there is no plan, those of paths twice as long are added, until all looks are in use.
/// Contingencies that no option requires are searched for with the same looks, so a contingency far from the path may
/// be omitted.
///
/// # Errors
/// [`PlanError`].
pub fn plan_near(
    site: &Site,
    chain: Option<&str>,
    start: &ChainStart,
    work: &str,
    options: &Options,
) -> Result<PlanResult, PlanError> {
    let all = || Prepared::of(site, chain)?.plan(start, work, options);
    let tasks = site.tasks.values();
    let own = tasks.filter(|task| task.error_bound.is_some()).count();
    let metre = site.planner.metre;
    let is_complete = own + site.planner.looks.len() <= FEW
        || options.survive_a_lost_tag
        || !options.costs.is_empty()
        || !(metre > 0.0);
    let task = site.tasks.get(work);
    let reach = task.and_then(|task| Some((&task.success, reach(&task.success)?)));
    let (success, reach) = match reach {
        Some(known) if !is_complete => known,
        _ => return all(),
    };
    let goal = [success.goal.x, success.goal.y];
    let from = start.toward(success.goal).pose;
    let from = [from.x, from.y];
    let apart = |a: [f64; 2], b: [f64; 2]| libm::hypot(a[0] - b[0], a[1] - b[1]);
    // A lower bound of the length of a path from the start to a place from which the work may begin, by a place where
    // a look may be useful.
    let least = |success: &SuccessSet| {
        let (centre, radius) = region(success);
        apart(from, centre) + apart(centre, goal) - 2.0 * radius - reach
    };
    let made = site.planner.looks.values().map(|made| least(&made.success));
    let own = site.tasks.values();
    let own = own.filter(|task| task.error_bound.is_some());
    let own = own.map(|task| least(&task.success));
    let lengths: Vec<f64> = made.chain(own).collect();
    let mut length = apart(from, goal) + DETOUR;
    loop {
        if lengths.iter().all(|least| *least <= length) {
            return all();
        }
        if lengths.iter().all(|least| *least > length) {
            length *= 2.0;
            continue;
        }
        let keeps = |success: &SuccessSet| least(success) <= length;
        let library = match Library::part(site, &keeps) {
            Err(PlanError::NoLooks(_)) => {
                length *= 2.0;
                continue;
            }
            library => library?,
        };
        let mut prepared = Prepared::unconnected(site, chain, library);
        prepared.connect()?;
        let planned = prepared.plan(start, work, options)?;
        let cost = planned.plan.as_ref().map(|plan| plan.cost);
        match (cost, planned.status) {
            // No cheaper chain drives farther than the length whose cost equals its complete cost.
            (Some(cost), Status::Optimal) if cost / metre <= length => return Ok(planned),
            (Some(cost), Status::Optimal) => length = cost / metre,
            _ => length *= 2.0,
        }
    }
}

/// Returns the largest distance from the goal at which a pose may be in a set, metres; `None` if it has no bounds.
fn reach(success: &SuccessSet) -> Option<f64> {
    let extent = wide_extent(success)?;
    let far = |[low, high]: [f64; 2]| low.abs().max(high.abs());
    Some(libm::hypot(far(extent.x), far(extent.y)))
}
