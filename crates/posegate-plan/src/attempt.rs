//! One search on a route graph, and the evaluation of its answer with the core.

use std::collections::BTreeMap;

use super::costs::Costs;
use super::horizons::Horizons;
use super::library::Library;
use super::problem::SearchProblem;
use super::rescue::Rescues;
use super::route_graph::RouteGraph;
use super::search::{Action, Answer, NearMiss, SearchGoal, SearchOutcome};
use super::walk::{Walk, world};
use super::{
    BeliefStateF64, Contingency, Nearest, Options, Plan, PlanError, PlanResult, PlanStep, Status,
    StepReport, TaskTable,
};
use posegate::chain::StartAssumption;
use posegate::set::Estimate;
use posegate::task::Leg;
use posegate_site::{ChainStart, DriveModel, Site};

/// If the search finds no plan, it runs again without dominance pruning, limited to `min(limit / FALLBACK_DIVISOR,
/// FALLBACK_LIMIT)` labels.
const FALLBACK_DIVISOR: usize = 10;
const FALLBACK_LIMIT: usize = 4_000;

/// The input of a search and of the evaluation of its answer.
pub(super) struct Attempt<'a> {
    pub site: &'a Site,
    pub library: &'a Library,
    pub model: Option<DriveModel>,
    pub model_from: Option<String>,
    /// Costs of a metre and of a look.
    pub prices: [f64; 2],
    /// `true` if contingencies are searched for even if no option requires them.
    pub finds_contingencies: bool,
    pub start: &'a ChainStart,
    pub work: &'a TaskTable,
    pub options: &'a Options,
    /// The factor by which the sets of beliefs are widened.
    pub wider: f64,
    pub graph: &'a RouteGraph,
}

/// The end of a search: its status, its answer, a lower bound of the cost, and the nearest miss.
struct SearchEnd {
    status: Status,
    answer: Option<Answer>,
    bound: Option<f64>,
    miss: Option<NearMiss>,
}

impl SearchEnd {
    /// Converts the outcome of a search.
    fn of(outcome: SearchOutcome) -> Self {
        let (status, answer, bound, miss) = match outcome {
            SearchOutcome::Optimal(answer) => {
                let cost = answer.cost;
                (Status::Optimal, Some(answer), Some(cost), None)
            }
            SearchOutcome::Feasible(answer, bound) => {
                (Status::Feasible, Some(answer), Some(bound), None)
            }
            SearchOutcome::Infeasible(miss) => (Status::Infeasible, None, None, miss),
            SearchOutcome::Open(miss) => (Status::Limit, None, None, miss),
        };
        Self {
            status,
            answer,
            bound,
            miss,
        }
    }

    /// Weakens the status if a contingency was not found: a plan that was excluded without it may have one.
    fn weakened(self) -> Self {
        let (status, bound) = match self.status {
            Status::Optimal => (Status::Feasible, Some(0.0)),
            Status::Infeasible => (Status::Limit, None),
            status => (status, self.bound),
        };
        Self {
            status,
            bound,
            ..self
        }
    }
}

impl Attempt<'_> {
    /// Searches for the cheapest plan and its contingencies, and evaluates them.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn run(self) -> Result<PlanResult, PlanError> {
        let tables = self.library.tables()?;
        let work_table = self.work.table()?;
        let costs = self.costs()?;
        let map = &self.graph.map;
        let problem = SearchProblem {
            library: self.library,
            tables: &tables,
            places: &map.places,
            work: &work_table,
            navigation: &self.site.navigation,
            model: self.model,
            epsilon: self.start.epsilon(self.site),
            costs: &costs,
            range: self.site.planner.range,
            most_risk: self.options.most_risk,
            wider: self.wider,
            ends: &map.ends,
            seen: &map.seen,
            successors: &self.graph.successors,
            predecessors: &self.graph.predecessors,
            limit: self.options.limit,
            stop: &self.options.stop,
            prunes_dominated: true,
            horizons: &Horizons::default(),
        };
        let rescues = Rescues::default();
        let mut end = SearchEnd::of(self.search(&problem, &rescues));
        if rescues.is_unsure() {
            end = end.weakened();
        }
        let plan = match &end.answer {
            Some(answer) => Some(self.evaluated(self.walk()?, answer)?),
            None => None,
        };
        let contingencies = match (&end.answer, &plan) {
            (Some(answer), Some(plan)) => self.contingencies(&problem, &rescues, answer, plan)?,
            _ => vec![],
        };
        Ok(PlanResult {
            status: end.status,
            plan,
            bound: end.bound,
            contingencies,
            nearest: end.miss.map(|miss| self.nearest(&miss)),
            bound_of_all: 0.0,
            model_from: self.model_from,
        })
    }

    /// Searches with dominance pruning. If that finds no plan, searches without.
    fn search(&self, problem: &SearchProblem<'_>, rescues: &Rescues) -> SearchOutcome {
        let belief =
            BeliefStateF64::at_start(world(self.start.pose), self.start.spread, &self.start.known);
        let begin = (&belief, self.graph.map.start, 0.0);
        let mut rescue = |belief: &BeliefStateF64, place: usize, risk: f64, look: usize| {
            // A look that needs no tag cannot lose one.
            !self.options.survive_a_lost_tag
                || self.library.looks[look].tags.is_empty()
                || rescues.exists(problem, (belief, place, risk), look)
        };
        match problem.search(begin, None, SearchGoal::Cheapest, &mut rescue) {
            // A smaller set may fail a facet's lever although a larger set passes, so dominance pruning may lose a
            // plan.
            SearchOutcome::Infeasible(miss) if self.finds_contingencies => {
                let thorough = SearchProblem {
                    prunes_dominated: false,
                    limit: (self.options.limit / FALLBACK_DIVISOR).min(FALLBACK_LIMIT),
                    ..*problem
                };
                match thorough.search(begin, None, SearchGoal::Cheapest, &mut rescue) {
                    SearchOutcome::Optimal(answer) | SearchOutcome::Feasible(answer, _) => {
                        SearchOutcome::Feasible(answer, 0.0)
                    }
                    SearchOutcome::Infeasible(_) | SearchOutcome::Open(_) => {
                        SearchOutcome::Infeasible(miss)
                    }
                }
            }
            outcome => outcome,
        }
    }

    /// Returns the contingencies of a plan, if an option requires them or they are searched for anyway.
    fn contingencies(
        &self,
        problem: &SearchProblem<'_>,
        rescues: &Rescues,
        answer: &Answer,
        plan: &Plan,
    ) -> Result<Vec<Contingency>, PlanError> {
        let mut contingencies = vec![];
        let others = self.options.survive_a_lost_tag || self.finds_contingencies;
        let actions = answer.actions.iter().enumerate();
        for (step, action) in actions.filter(|_| others) {
            let Action::Look(look) = action else {
                continue;
            };
            let tags = self.library.looks[*look].tags.clone();
            if tags.is_empty() {
                continue;
            }
            let before = &answer.actions[..step];
            let spent = plan.steps[..step].iter();
            let risk_before = spent.map(|step| step.report.risk).sum();
            let begin = (
                &plan.steps[step].report.before,
                self.place_after(before),
                risk_before,
            );
            let Some(other) = rescues.cheapest(problem, begin, *look) else {
                continue;
            };
            let mut walk = self.walk()?;
            self.replay(&mut walk, before)?;
            let plan = self.evaluated(walk, &other)?;
            let least = self.site.planner.least_margin();
            if self.options.survive_a_lost_tag || plan.succeeds_with(least) {
                contingencies.push(Contingency {
                    step,
                    tags,
                    risk_before,
                    plan,
                });
            }
        }
        Ok(contingencies)
    }

    /// Returns the place to which the last drive of some actions leads; the start if there is no drive.
    fn place_after(&self, actions: &[Action]) -> usize {
        let mut actions = actions.iter().rev();
        let last = actions.find_map(|action| match action {
            Action::Drive(to) => Some(*to),
            Action::Look(_) => None,
        });
        last.unwrap_or(self.graph.map.start)
    }

    /// Converts the nearest miss of a search.
    fn nearest(&self, miss: &NearMiss) -> Nearest {
        let [rho, alpha] = miss.belief.enclosing();
        Nearest {
            // The search widens its sets by the smallest margin.
            scale: miss.scale * self.site.planner.least_margin,
            least: self.site.planner.least_margin,
            set: [rho + miss.belief.spread[0], alpha + miss.belief.spread[1]],
            after: miss
                .after
                .map(|look| self.library.looks[look].table.name.clone()),
        }
    }

    /// Begins a walk at the start, for every possible estimate.
    fn walk(&self) -> Result<Walk, PlanError> {
        Walk::start(self.site, self.start, StartAssumption::General)
    }

    /// Evaluates one action.
    fn take(&self, walk: &mut Walk, action: Action) -> Result<StepReport, PlanError> {
        match action {
            Action::Look(look) => {
                let look = &self.library.looks[look];
                walk.task(&look.table.table()?, Some(look.bound))
            }
            Action::Drive(to) => {
                let pose = |[x_m, y_m, yaw_rad]: [f64; 3]| Estimate { x_m, y_m, yaw_rad };
                let from = pose(walk.belief.pose);
                let to = pose(self.graph.map.places[to]);
                let model = self.model.ok_or(PlanError::NoModel)?;
                walk.drive(&from, &[Leg::Straight(to)], &model)
                    .map_err(|cause| PlanError::Drive { step: 0, cause })
            }
        }
    }

    /// Evaluates actions, without their reports.
    fn replay(&self, walk: &mut Walk, actions: &[Action]) -> Result<(), PlanError> {
        for action in actions {
            self.take(walk, *action)?;
        }
        Ok(())
    }

    /// Returns the name of a place.
    fn name_of(&self, place: usize) -> String {
        self.graph.map.name_of(place, self.library, &self.work.name)
    }

    /// Evaluates an answer of the search as a plan with the core, on the tables in use.
    fn evaluated(&self, mut walk: Walk, answer: &Answer) -> Result<Plan, PlanError> {
        let mut steps = vec![];
        let mut place = self.name_of(answer.beliefs[0].0);
        for action in &answer.actions {
            let report = self.take(&mut walk, *action)?;
            let tags = match action {
                Action::Look(look) => self.library.looks[*look].tags.clone(),
                Action::Drive(to) => {
                    place = self.name_of(*to);
                    vec![]
                }
            };
            steps.push(PlanStep {
                place: place.clone(),
                tags,
                report,
            });
        }
        let report = walk.task(&self.work.table()?, None)?;
        steps.push(PlanStep {
            place,
            tags: vec![],
            report,
        });
        let risk = steps.iter().map(|step| step.report.risk).sum();
        Ok(Plan {
            steps,
            cost: answer.cost,
            risk,
        })
    }

    /// Returns the costs of drives and looks, by the places' numbers.
    fn costs(&self) -> Result<Costs, PlanError> {
        let mut costs = Costs {
            metre: self.prices[0],
            look: self.prices[1],
            drives: BTreeMap::new(),
        };
        for ((from, to), cost) in &self.options.costs {
            if !(*cost >= 0.0 && cost.is_finite()) {
                return Err(PlanError::Costs(std::format!(
                    "from {from} to {to}: {cost} is not a cost; write a number, at least 0"
                )));
            }
            let (starts, ends) = (self.places_named(from), self.places_named(to));
            for (name, places) in [(from, &starts), (to, &ends)] {
                if places.is_empty() {
                    let work = &self.work.name;
                    return Err(PlanError::Costs(std::format!(
                        "there is no place `{name}`; places are `start`, `{work}` and the names of the looks"
                    )));
                }
            }
            for start in &starts {
                for end in &ends {
                    costs.drives.insert((*start, *end), *cost);
                }
            }
        }
        Ok(costs)
    }

    /// Returns the places with a name. A look's name means all of its places.
    fn places_named(&self, name: &str) -> Vec<usize> {
        (0..self.graph.map.places.len())
            .filter(|place| {
                let known = self.name_of(*place);
                known == name || known.split('#').next() == Some(name)
            })
            .collect()
    }
}
