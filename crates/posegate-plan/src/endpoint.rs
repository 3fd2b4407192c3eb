//! One work task and its start, prepared for plans with any subset of the tags near them.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::map;
use super::planner::{Prepared, WIDER};
use super::proofs::Proofs;
use super::route_graph::RouteGraph;
use super::walk::world;
use super::{Library, Options, PlanError, PlanResult, TaskTable};
use posegate_site::{ChainStart, Site, TaskKind};

/// One work task and its start, with the part of a library that is useful for them.
///
/// The looks possible at each place and the links between places are computed once. A plan with a subset of the tags
/// then costs only its own search and proofs. The result does not depend on earlier plans.
#[derive(Debug)]
pub struct TaskPlanner<'a> {
    site: &'a Site,
    library: Library,
    graph: RouteGraph,
    proofs: Arc<Proofs>,
    start: ChainStart,
    work: TaskTable,
    tags: BTreeSet<String>,
    chain: Option<String>,
}

impl<'a> TaskPlanner<'a> {
    /// Prepares a work task from a start. Keeps a look if it is possible at the start or at the goal, or if one of
    /// its viewpoints is at most `beside` metres from the straight line between the two. `chain` names the chain
    /// whose drive model is used if the site has none.
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

        let graph = prepared.route_graph(&start, &work, WIDER[0])?;
        let tags = library.looks.iter().flat_map(|look| &look.tags);
        Ok(Self {
            site,
            tags: tags.cloned().collect(),
            proofs: Arc::default(),
            library,
            graph,
            start,
            work,
            chain: chain.map(ToOwned::to_owned),
        })
    }

    /// Returns the names of the tags that are useful for the task.
    #[must_use]
    pub const fn tags(&self) -> &BTreeSet<String> {
        &self.tags
    }

    /// Returns the start, in the world.
    #[must_use]
    pub const fn start(&self) -> &ChainStart {
        &self.start
    }

    /// Returns the tags of the look for which a plan's place ([`PlanStep::place`](super::PlanStep::place)) was made.
    /// The place exists in the planning only with these tags. Returns an empty slice for the start and the goal.
    #[must_use]
    pub fn tags_of_place(&self, place: &str) -> &[String] {
        let look = place.rsplit_once('#').map(|(look, _)| look);
        let mut looks = self.library.looks.iter();
        let look = looks.find(|known| Some(known.table.name.as_str()) == look);
        look.map_or(&[], |look| &look.tags)
    }

    /// Plans only with looks for which `has` returns `true` for every tag. Minimizes the number of looks, because
    /// that answers soonest if a plan exists. Finds contingencies only if the options require them.
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
        let graph = self.graph.only(&self.library, &number);
        let mut prepared = Prepared::unconnected(self.site, self.chain.as_deref(), part)
            .with_fewest_looks()
            .with_proofs(self.proofs.clone());
        prepared.plan_on_graph(&self.start, &mut self.work.clone(), options, Some(graph))
    }
}

/// Returns the names of the looks that are useful near the line from start to goal.
fn in_reach(
    library: &Library,
    [start, goal]: [[f64; 3]; 2],
    beside: f64,
) -> Result<BTreeSet<String>, PlanError> {
    let tables = library.tables()?;
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
