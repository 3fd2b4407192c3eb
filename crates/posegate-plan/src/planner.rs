//! Planning: the cheapest chain of looks and drives after which a work task is certain to succeed.

use std::sync::Arc;

use rayon::prelude::*;

use super::attempt::Attempt;
use super::better_places::{BetterPlaces, WORTH_IT};
use super::bound::EveryChain;
use super::costs::Costs;
use super::horizons::Horizons;
use super::library::Library;
use super::map::{self, Roadmap};
use super::problem::SearchProblem;
use super::proofs::{Proofs, Sharpness};
use super::route_graph::RouteGraph;
use super::walk::world;
use super::{
    Options, Plan, PlanError, PlanResult, Status, StepKind, StopSignal, TaskTable, Viewpoint,
};
use posegate_site::{ChainStart, ChainStep, DriveModel, Site, TaskKind};

/// A site's library, prepared for any number of plans.
#[derive(Clone, Debug)]
pub struct Prepared<'a> {
    site: &'a Site,
    library: Library,
    /// The looks whose success set contains each place's pose.
    seen: Vec<Vec<usize>>,
    successors: Vec<Vec<usize>>,
    /// `seen` and `successors` of the tables as baked, while a stricter table is in use.
    as_baked: Option<[Vec<Vec<usize>>; 2]>,
    model: Option<DriveModel>,
    model_from: String,
    /// Costs of a metre and of a look.
    prices: [f64; 2],
    /// `true` if contingencies are searched for even if no option requires them.
    finds_contingencies: bool,
    proofs: Arc<Proofs>,
}

/// The largest number of times that a plan's places are improved.
const IMPROVEMENTS: usize = 4;

/// The fallback if a single set cannot be proven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ProofFallback {
    /// Prove the task's complete table, and use it.
    Table,
    /// Search with wider sets.
    Wider,
}

/// Factors by which the search widens the sets, tried in this order until the core accepts the plan.
pub(super) const WIDER: [f64; 5] = [1.003, 1.02, 1.06, 1.15, 1.4];

/// Returns the drive model and its source: the site's own model, or that of the first drive of a chain.
fn model_of(site: &Site, prefer: Option<&str>) -> Option<(DriveModel, String)> {
    let of_chain = |(name, chain): (&String, &posegate_site::SiteChain)| {
        chain.steps.iter().find_map(|step| match step {
            ChainStep::Navigate { model, .. } => Some((*model, std::format!("chain {name}"))),
            ChainStep::Task(_) => None,
        })
    };
    let own = site.navigation.model;
    let own = own.map(|model| (model, "site".to_owned()));
    let named = prefer.and_then(|name| site.chains.get_key_value(name));
    own.or_else(|| named.and_then(of_chain))
        .or_else(|| site.chains.iter().find_map(of_chain))
}

impl<'a> Prepared<'a> {
    /// Prepares the library of a site. `chain` names the chain whose drive model is used if the site has none.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn of(site: &'a Site, chain: Option<&str>) -> Result<Self, PlanError> {
        let mut prepared = Self::unconnected(site, chain, Library::of(site)?);
        prepared.connect()?;
        Ok(prepared)
    }

    /// Creates the value without the looks and successors of its places; [`Self::connect`] computes these.
    pub(super) fn unconnected(site: &'a Site, chain: Option<&str>, library: Library) -> Self {
        let (model, model_from) = model_of(site, chain).unzip();
        Self {
            site,
            library,
            seen: vec![],
            successors: vec![],
            as_baked: None,
            model,
            model_from: model_from.unwrap_or_default(),
            prices: [site.planner.metre, site.planner.look_cost],
            finds_contingencies: true,
            proofs: Arc::default(),
        }
    }

    /// Plans with the fewest looks, for any length of drives, and without optional contingencies. This answers
    /// soonest if a plan exists.
    pub(super) fn with_fewest_looks(mut self) -> Self {
        self.prices = [0.0, 1.0];
        self.finds_contingencies = false;
        self
    }

    /// Shares proofs with other plans of the same task and library.
    pub(super) fn with_proofs(self, proofs: Arc<Proofs>) -> Self {
        Self { proofs, ..self }
    }

    /// Returns the library.
    #[must_use]
    pub const fn library(&self) -> &Library {
        &self.library
    }

    /// Computes the looks and the successors of each place.
    pub(super) fn connect(&mut self) -> Result<(), PlanError> {
        self.link(0)
    }

    /// Computes the looks and the successors of the places from a number on, and adds them to the successors of the
    /// other places.
    fn link(&mut self, first: usize) -> Result<(), PlanError> {
        let tables = self.library.tables()?;
        let places: Vec<[f64; 3]> = self.library.views.iter().map(|view| view.pose).collect();
        let mut seen = self.seen.clone();
        seen.par_extend(
            places[first..]
                .par_iter()
                .map(|pose| map::seen(&self.library, &tables, *pose)),
        );
        let costs = Costs::default();
        let Some(any) = tables.first() else {
            return Ok(());
        };
        let question = SearchProblem {
            library: &self.library,
            tables: &tables,
            places: &places,
            work: any,
            navigation: &self.site.navigation,
            model: self.model,
            epsilon: self.least_epsilon(),
            costs: &costs,
            range: self.site.planner.range,
            most_risk: 1.0,
            wider: WIDER[0],
            ends: &[],
            seen: &seen,
            successors: &[],
            predecessors: &[],
            limit: 0,
            stop: &StopSignal::default(),
            prunes_dominated: true,
            horizons: &Horizons::default(),
        };
        let successors = (0..places.len())
            .into_par_iter()
            .map(|from| {
                let (mut known, new) = match self.successors.get(from) {
                    Some(known) => (known.clone(), first),
                    None => (vec![], 0),
                };
                known.extend((new..places.len()).filter(|to| question.arrives(from, *to)));
                known
            })
            .collect();
        drop(tables);
        self.seen = seen;
        self.successors = successors;
        Ok(())
    }

    /// Returns the least confidence of all problems of this site: with it, drives add the least uncertainty.
    fn least_epsilon(&self) -> f64 {
        let starts = self.site.chains.values();
        let of_starts = starts.map(|chain| chain.start.epsilon(self.site));
        of_starts.fold(self.site.epsilon, f64::min)
    }

    /// Plans from a start to a work task.
    ///
    /// The final decision is that of [`posegate::chain`], for every possible estimate ([`posegate::chain::StartAssumption::General`]).
    /// Each set that the plan relies on is proven to lie in its success set. If the proof of a single set fails, its
    /// whole table is proven. If that proof makes the table stricter, the search runs again with the proven table. (A
    /// controller's own tables are proven when they are built.)
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn plan(
        &mut self,
        start: &ChainStart,
        work: &str,
        options: &Options,
    ) -> Result<PlanResult, PlanError> {
        let task = self.site.tasks.get(work);
        let task = task.filter(|task| task.kind == TaskKind::Work);
        let task = task.ok_or_else(|| PlanError::NoWork(work.to_owned()))?;
        let table = TaskTable::baked(self.site, work, &task.success, task.wish)?;
        let start = start.toward(task.success.goal);
        let planned = self.plan_on_graph(&start, &mut table.clone(), options, None);
        self.relax();
        let mut planned = planned?;
        let priced = !options.costs.is_empty();
        let every = EveryChain::of(self.site, &start, &table.success, self.model, priced);
        let bound = every.bound();
        if !priced && !options.survive_a_lost_tag {
            let worth = bound * (1.0 + WORTH_IT);
            planned = self.improved(planned, &start, &table, options, worth)?;
        }
        Ok(PlanResult {
            bound_of_all: bound,
            ..planned
        })
    }

    /// Improves the places of a plan until it costs no more than `worth`, or an improvement saves little.
    fn improved(
        &self,
        mut planned: PlanResult,
        start: &ChainStart,
        work: &TaskTable,
        options: &Options,
        worth: f64,
    ) -> Result<PlanResult, PlanError> {
        for _ in 0..IMPROVEMENTS {
            let plan = planned.plan.as_ref().filter(|plan| plan.cost > worth);
            let Some(plan) = plan else { break };
            let enough = plan.cost * (1.0 - 2.0 * WORTH_IT);
            let Some(cheaper) = self.with_better_places(start, work, options, plan)? else {
                break;
            };
            planned = cheaper;
            if planned.plan.as_ref().is_some_and(|plan| plan.cost > enough) {
                break;
            }
        }
        Ok(planned)
    }

    /// Plans with additional places for a plan's looks and for chains with fewer looks. Returns a cheaper plan, if there
    /// is one.
    fn with_better_places(
        &self,
        start: &ChainStart,
        work: &TaskTable,
        options: &Options,
        plan: &Plan,
    ) -> Result<Option<PlanResult>, PlanError> {
        let places = BetterPlaces {
            site: self.site,
            library: &self.library,
            tables: &self.library.tables()?,
            work: &work.table()?,
            model: self.model,
            start,
            begin: world(start.pose),
            goal: world(work.success.goal),
            options,
            plan,
        }
        .places();
        if places.is_empty() {
            return Ok(None);
        }
        let mut more = self.clone();
        let known = more.library.views.len();
        for (look, pose) in places {
            let own = more.library.views.iter().filter(|view| view.look == look);
            let name = std::format!(
                "{}#{}",
                self.library.looks[look].table.name,
                own.count() + 1
            );
            more.library.views.push(Viewpoint { pose, name, look });
        }
        more.link(known)?;
        let again = more.plan_on_graph(start, &mut work.clone(), options, None)?;
        let costs_less = |other: &Plan| other.cost < plan.cost * (1.0 - 1e-9);
        Ok(again.plan.as_ref().is_some_and(costs_less).then_some(again))
    }

    /// Restores the tables as baked, so that an answer does not depend on earlier problems.
    fn relax(&mut self) {
        for look in &mut self.library.looks {
            look.table.relax();
        }
        if let Some([seen, successors]) = self.as_baked.take() {
            (self.seen, self.successors) = (seen, successors);
        }
    }

    /// Plans from a start in the world. Uses the given route graph, if any.
    ///
    /// If a set cannot be proven by itself and its task's proven table allows no plan, another plan may have provable
    /// sets. The second search for such a plan uses wider sets, on the tables as baked.
    pub(super) fn plan_on_graph(
        &mut self,
        start: &ChainStart,
        work_table: &mut TaskTable,
        options: &Options,
        graph: Option<RouteGraph>,
    ) -> Result<PlanResult, PlanError> {
        let planned = self.plan_widening(
            start,
            work_table,
            options,
            graph.clone(),
            ProofFallback::Table,
        )?;
        if planned.plan.is_some() || (self.as_baked.is_none() && !work_table.is_stricter()) {
            return Ok(planned);
        }
        self.relax();
        work_table.relax();
        let again = self.plan_widening(start, work_table, options, graph, ProofFallback::Wider)?;
        Ok(match (again.plan.is_some(), again.status) {
            (true, Status::Optimal) => PlanResult {
                status: Status::Feasible,
                ..again
            },
            (true, _) => again,
            (false, _) => planned,
        })
    }

    fn plan_widening(
        &mut self,
        start: &ChainStart,
        work_table: &mut TaskTable,
        options: &Options,
        mut graph: Option<RouteGraph>,
        fallback: ProofFallback,
    ) -> Result<PlanResult, PlanError> {
        let mut bound = None;
        for wider in WIDER {
            let wider = wider * self.site.planner.least_margin();
            let (planned, satisfies) =
                self.plan_proven(start, work_table, options, wider, &mut graph, fallback)?;
            if planned.plan.is_none() && bound.is_none() || satisfies {
                let relaxed = bound.is_some() && planned.status == Status::Optimal;
                return Ok(PlanResult {
                    status: if relaxed {
                        Status::Feasible
                    } else {
                        planned.status
                    },
                    bound: bound.or(planned.bound),
                    ..planned
                });
            }
            // The search allowed for less rounding than the core, so no plan is cheaper than the plan that it found.
            bound = bound.or(planned.bound);
        }
        Ok(PlanResult {
            status: Status::Limit,
            plan: None,
            bound,
            contingencies: vec![],
            nearest: None,
            bound_of_all: 0.0,
            model_from: self.model_from(),
        })
    }

    /// Plans with sets widened by a factor, and proves the sets that the plan relies on. Also returns `true` if the
    /// core's own evaluation accepts the plan, including its risk and contingencies.
    fn plan_proven(
        &mut self,
        start: &ChainStart,
        work: &mut TaskTable,
        options: &Options,
        wider: f64,
        graph: &mut Option<RouteGraph>,
        fallback: ProofFallback,
    ) -> Result<(PlanResult, bool), PlanError> {
        loop {
            let mut planned = match graph {
                Some(graph) => self.attempt(start, work, options, wider, graph).run()?,
                None => {
                    let graph = &self.route_graph(start, work, wider)?;
                    self.attempt(start, work, options, wider, graph).run()?
                }
            };
            let (mut changed, mut lacks) = (false, false);
            let proofs = self.proofs.clone();
            let sharpness = if self.finds_contingencies {
                Sharpness::Margin
            } else {
                Sharpness::Holds
            };
            let least = self.site.planner.least_margin();
            for step in planned.steps_mut() {
                let name = step.report.task.as_deref();
                let table = match step.report.kind {
                    StepKind::Navigation => continue,
                    StepKind::Work => &mut *work,
                    StepKind::Localization => {
                        let mut tables = self.library.looks.iter_mut().map(|look| &mut look.table);
                        match tables.find(|table| Some(table.name.as_str()) == name) {
                            Some(table) => table,
                            None => continue,
                        }
                    }
                };
                let failed = step.report.failure.is_some();
                if table.is_proven()
                    || failed
                    || proofs.certify(&mut step.report, &table.success, sharpness, least)
                {
                    continue;
                }
                match fallback {
                    ProofFallback::Table => changed |= table.prove(self.site)?,
                    ProofFallback::Wider => {
                        lacks = true;
                        break;
                    }
                }
            }
            if lacks {
                return Ok((planned, false));
            }
            if !changed {
                let satisfies = planned.satisfies(options, least);
                return Ok((planned, satisfies));
            }
            *graph = None;
            if self.as_baked.is_none() {
                let own = [
                    core::mem::take(&mut self.seen),
                    core::mem::take(&mut self.successors),
                ];
                self.as_baked = Some(own);
            }
            self.connect()?;
        }
    }

    /// Builds the route graph of a problem, with sets widened by a factor.
    pub(super) fn route_graph(
        &self,
        start: &ChainStart,
        work: &TaskTable,
        wider: f64,
    ) -> Result<RouteGraph, PlanError> {
        let tables = self.library.tables()?;
        let work_table = work.table()?;
        let map = Roadmap::of(
            &self.library,
            &tables,
            (&self.seen, &self.successors),
            self.site.planner.range,
            &work_table,
            [world(start.pose), world(work.success.goal)],
        );
        let question = SearchProblem {
            library: &self.library,
            tables: &tables,
            places: &map.places,
            work: &work_table,
            navigation: &self.site.navigation,
            model: self.model,
            epsilon: start.epsilon(self.site),
            costs: &Costs::default(),
            range: self.site.planner.range,
            most_risk: 1.0,
            wider,
            ends: &map.ends,
            seen: &map.seen,
            successors: &[],
            predecessors: &[],
            limit: 0,
            stop: &StopSignal::default(),
            prunes_dominated: true,
            horizons: &Horizons::default(),
        };
        let (successors, predecessors) = map.with_dynamic(&question);
        Ok(RouteGraph {
            map,
            successors,
            predecessors,
        })
    }

    /// Returns the input of a single search, with sets widened by a factor.
    fn attempt<'s>(
        &'s self,
        start: &'s ChainStart,
        work: &'s TaskTable,
        options: &'s Options,
        wider: f64,
        graph: &'s RouteGraph,
    ) -> Attempt<'s> {
        Attempt {
            site: self.site,
            library: &self.library,
            model: self.model,
            model_from: self.model_from(),
            prices: self.prices,
            finds_contingencies: self.finds_contingencies,
            start,
            work,
            options,
            wider,
            graph,
        }
    }

    fn model_from(&self) -> Option<String> {
        self.model.as_ref().map(|_| self.model_from.clone())
    }
}
