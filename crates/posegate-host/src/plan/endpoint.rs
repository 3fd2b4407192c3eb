//! One work task and where it is begun, made ready to be planned with any of the tags about it.

use std::collections::BTreeSet;

use super::map;
use super::planner::{Prepared, RouteGraph, WIDER};
use super::walk::world;
use super::{Library, Options, PlanError, PlanResult, TaskTable};
use crate::site::{ChainStart, Site, TaskKind};

/// One work task and where it is begun, with the part of a library that is of use for it.
///
/// What its places see and where they lead is found once. A plan with some of the tags then costs what its own search
/// and its proofs cost, and is the same whatever was asked before.
#[derive(Debug)]
pub struct TaskPlanner<'a> {
    site: &'a Site,
    library: Library,
    laid: RouteGraph,
    start: ChainStart,
    work: TaskTable,
    tags: BTreeSet<String>,
    chain: Option<String>,
}

impl<'a> TaskPlanner<'a> {
    /// Of a work task that is begun at a start, with those looks of a library that are seen from the start, from the
    /// goal, or from one of their own places at most `beside` metres from the straight way between the two. `chain`
    /// names the chain whose drives' model is taken where the site has none of its own.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn of(
        site: &'a Site,
        library: &Library,
        start: &ChainStart,
        work: &str,
        chain: Option<&str>,
        beside: f64,
    ) -> Result<Self, PlanError> {
        let task = site.tasks.get(work);
        let task = task.filter(|task| task.kind == TaskKind::Work);
        let task = task.ok_or_else(|| PlanError::NoWork(work.to_owned()))?;
        let start = start.toward(task.success.goal);
        let ends = [world(start.pose), world(task.success.goal)];
        let chosen = in_reach(library, ends, beside)?;
        let library = library.only(|look| chosen.contains(look.table.name.as_str()));
        let mut prepared = Prepared::unconnected(site, chain, library.clone());
        prepared.connect()?;
        let work = TaskTable::baked(site, work, &task.success, task.wish)?;

        let laid = prepared.laid(&start, &work, WIDER[0])?;
        let tags = library.looks.iter().flat_map(|look| &look.tags);
        Ok(Self {
            site,
            tags: tags.cloned().collect(),
            library,
            laid,
            start,
            work,
            chain: chain.map(ToOwned::to_owned),
        })
    }

    /// The names of the tags that are of use for it.
    #[must_use]
    pub const fn tags(&self) -> &BTreeSet<String> {
        &self.tags
    }

    /// Where it is begun, in the world.
    #[must_use]
    pub const fn start(&self) -> &ChainStart {
        &self.start
    }

    /// The tags of the look that a place of a plan ([`PlanStep::place`](super::PlanStep::place)) was made for: without
    /// them the place is not among those that are planned with. None for the start and the goal.
    #[must_use]
    pub fn tags_of_place(&self, place: &str) -> &[String] {
        let look = place.rsplit_once('#').map(|(look, _)| look);
        let mut looks = self.library.looks.iter();
        let look = looks.find(|known| Some(known.table.name.as_str()) == look);
        look.map_or(&[], |look| &look.tags)
    }

    /// Plans with those looks alone whose every tag `has` says: with the fewest looks, which tells soonest whether there
    /// is a plan, and with other ways where they are asked for alone.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn plan(
        &self,
        has: impl Fn(&str) -> bool,
        options: &Options,
    ) -> Result<PlanResult, PlanError> {
        let mut count = 0;
        let number: Vec<Option<usize>> = self
            .library
            .looks
            .iter()
            .map(|look| {
                let kept = look.tags.iter().all(|tag| has(tag));
                count += usize::from(kept);
                kept.then(|| count - 1)
            })
            .collect();
        let part = self
            .library
            .only(|look| look.tags.iter().all(|tag| has(tag)));
        let laid = self.laid.only(&self.library, &number);
        let mut prepared =
            Prepared::unconnected(self.site, self.chain.as_deref(), part).with_fewest_looks();
        prepared.plan_laid(&self.start, &mut self.work.clone(), options, Some(laid))
    }
}

/// The names of the looks that are of use about a way.
fn in_reach(
    library: &Library,
    [start, goal]: [[f64; 3]; 2],
    beside: f64,
) -> Result<BTreeSet<String>, PlanError> {
    let tables = super::planner::parsed(library)?;
    let name = |look: usize| library.looks[look].table.name.clone();
    let ends = [start, goal].into_iter();
    let mut names: BTreeSet<String> = ends
        .flat_map(|pose| map::seen(library, &tables, pose))
        .map(name)
        .collect();
    let (dx, dy) = (goal[0] - start[0], goal[1] - start[1]);
    let square = (dx * dx + dy * dy).max(f64::MIN_POSITIVE);
    for view in &library.views {
        let (x, y) = (view.pose[0] - start[0], view.pose[1] - start[1]);
        let along = ((x * dx + y * dy) / square).clamp(0.0, 1.0);
        if libm::hypot(x - along * dx, y - along * dy) <= beside {
            names.insert(name(view.look));
        }
    }
    Ok(names)
}
