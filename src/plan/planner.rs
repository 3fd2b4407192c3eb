//! Plans: the cheapest chain of looks and drives after which a work task is sure to succeed.

use std::borrow::ToOwned;
use std::collections::BTreeMap;
use std::string::String;
use std::vec;
use std::vec::Vec;

use rayon::prelude::*;

use super::certificate::is_certain;
use super::chain::{Walk, world};
use super::library::{Library, baked, bounded, towards};
use super::rooms::proven;
use super::search::{Action, Answer, Costs, End, Question};
use super::{Belief, PlanError, StepKind, StepReport};
use crate::certify::Prover;
use crate::chain::Assume;
use crate::contain::{Decision, Margin, decide};
use crate::set::Estimate;
use crate::shape::SuccessSet;
use crate::site::{ChainStart, ChainStep, DriveModel, Known, Site, TaskKind};
use crate::table::Table;
use crate::task::Leg;

/// What a plan is asked for.
#[derive(Clone, Debug)]
pub struct Options {
    /// The largest chance that the plan fails although no step does.
    pub most_risk: f64,
    /// Whether there must be a plan after the loss of any one tag.
    pub survive_a_lost_tag: bool,
    /// Labels that a search may look at.
    pub limit: usize,
    /// Costs of drives by the places' names; `start` and the work task's name are places too.
    pub costs: BTreeMap<(String, String), f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            most_risk: 0.05,
            survive_a_lost_tag: false,
            limit: 100_000,
            costs: BTreeMap::new(),
        }
    }
}

/// How a search for a plan ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// No chain of the library is cheaper.
    Optimal,
    /// A plan, but the limit was reached before all that are cheaper were ruled out.
    Feasible,
    /// No chain of the library is sure to succeed.
    Infeasible,
    /// The limit was reached without a plan.
    Limit,
}

/// A step of a plan.
#[derive(Clone, Debug)]
pub struct PlanStep {
    /// Where the robot is meant to be after it: the place's name.
    pub place: String,
    /// The tags that are looked at.
    pub tags: Vec<String>,
    /// What was found of it, on proven tables.
    pub report: StepReport,
}

/// A chain of steps that ends with the work.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Its steps; the last one is the work.
    pub steps: Vec<PlanStep>,
    /// What it costs.
    pub cost: f64,
    /// The chance that it fails although no step does.
    pub risk: f64,
}

/// What to do where a look fails.
#[derive(Clone, Debug)]
pub struct Contingency {
    /// The look's number in the plan.
    pub step: usize,
    /// The tags that the look needs: the rest of the plan needs none of them.
    pub tags: Vec<String>,
    /// The risk of the steps before.
    pub risk_before: f64,
    /// From there, without it.
    pub plan: Plan,
}

/// The arrival at the work that comes nearest.
#[derive(Clone, Debug)]
pub struct Nearest {
    /// By how much the set would have to be smaller: its scale that fits.
    pub scale: f64,
    /// The set: translation, yaw (m, rad), the estimate's spread included.
    pub set: [f64; 2],
    /// After which look.
    pub after: Option<String>,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Planned {
    /// How the search ended.
    pub status: Status,
    /// The plan.
    pub plan: Option<Plan>,
    /// No plan is cheaper than this.
    pub bound: Option<f64>,
    /// What to do where a look fails; with [`Options::survive_a_lost_tag`] for every look at a tag.
    pub contingencies: Vec<Contingency>,
    /// Where there is no plan: the nearest miss.
    pub nearest: Option<Nearest>,
    /// What says how driving adds to what is unknown: `site`, or `chain NAME`; without that nothing is driven.
    pub model_from: Option<String>,
}

/// A site's library made ready for any number of plans.
#[derive(Debug)]
pub struct Prepared<'a> {
    site: &'a Site,
    library: Library,
    /// Looks that each place's pose is in, and the places that each leads to.
    seen: Vec<Vec<usize>>,
    leads: Vec<Vec<usize>>,
    model: Option<DriveModel>,
    model_from: String,
}

/// By how much the sets of the search are taken wider than they are, until the core keeps the plan.
const WIDER: [f64; 5] = [1.003, 1.02, 1.06, 1.15, 1.4];

/// Shares of a table's margin that a certificate is tried for.
const SHARES: [f64; 4] = [0.98, 0.9, 0.75, 0.0];

/// Proves the set that a step relies on inside its success set, as much larger as a share of what its table says; the
/// margin that is told is then what was proven.
fn certify(report: &mut StepReport, success: &SuccessSet) -> bool {
    let margin = report.margin.map_or(0.0, crate::log::factor);
    let prover = Prover::new(success);
    let mut tried = f64::INFINITY;
    for share in SHARES {
        let scale = (share * margin).clamp(1.0, 8.0);
        if scale >= tried {
            break;
        }
        if is_certain(&prover, success, &report.before, scale) {
            let q16 = libm::floor(scale * 65_536.0) as u32;
            report.margin = Some(Margin::from_q16(q16));
            return true;
        }
        tried = scale;
    }
    false
}

impl Planned {
    fn steps_mut(&mut self) -> impl Iterator<Item = &mut PlanStep> {
        let others = self.contingencies.iter_mut();
        let own = self.plan.iter_mut().flat_map(|plan| plan.steps.iter_mut());
        own.chain(others.flat_map(|other| other.plan.steps.iter_mut()))
    }

    /// Whether the core keeps what the search promised.
    fn keeps(&self, options: &Options) -> bool {
        let Some(plan) = &self.plan else {
            return false;
        };
        let within = |risk: f64| risk <= options.most_risk + 1e-12;
        let other = |other: &Contingency| {
            other.plan.report().succeeds() && within(other.risk_before + other.plan.risk)
        };
        let survives = !options.survive_a_lost_tag
            || plan.steps.iter().enumerate().all(|(number, step)| {
                step.tags.is_empty() || self.contingencies.iter().any(|c| c.step == number)
            });
        plan.report().succeeds()
            && within(plan.risk)
            && survives
            && (!options.survive_a_lost_tag || self.contingencies.iter().all(other))
    }
}

/// The work task's table: baked, and proven where no certificate does.
struct WorkTable {
    success: SuccessSet,
    bytes: Vec<u8>,
    is_proven: bool,
}

impl WorkTable {
    fn of(site: &Site, work: &str) -> Result<Self, PlanError> {
        let task = site.tasks.get(work);
        let task = task.filter(|task| task.kind == TaskKind::Work);
        let task = task.ok_or_else(|| PlanError::NoWork(work.to_owned()))?;
        let baked = baked(site, work, &task.success);
        let is_proven = baked.is_none();
        let bytes = match baked {
            Some(bytes) => bytes,
            None => proven(site, work, task)?,
        };
        Ok(Self {
            success: task.success.clone(),
            bytes,
            is_proven,
        })
    }

    /// Proves the whole table; whether its bytes have changed.
    fn prove(&mut self, site: &Site, work: &str) -> Result<bool, PlanError> {
        let Some(task) = site.tasks.get(work).filter(|_| !self.is_proven) else {
            return Ok(false);
        };
        let bytes = proven(site, work, task)?;
        let changed = bytes != self.bytes;
        self.bytes = bytes;
        self.is_proven = true;
        Ok(changed)
    }
}

/// Looks whose table holds a place.
fn seen(library: &Library, tables: &[Table<'_>], pose: [f64; 3]) -> Vec<usize> {
    let Some(point) = bounded(pose, [1e-5, 1e-5]) else {
        return vec![];
    };
    let near = |index: &usize| {
        let look = &library.looks[*index];
        libm::hypot(look.centre[0] - pose[0], look.centre[1] - pose[1]) <= look.radius
    };
    let holds = |index: &usize| decide(&tables[*index], &point) == Decision::Inside;
    (0..tables.len()).filter(near).filter(holds).collect()
}

fn parsed(library: &Library) -> Result<Vec<Table<'_>>, PlanError> {
    library.looks.iter().map(table_of).collect()
}

fn table_of(look: &super::Look) -> Result<Table<'_>, PlanError> {
    Table::parse(&look.bytes).map_err(|error| PlanError::Table {
        task: look.name.clone(),
        cause: crate::verify::VerifyError::Table(error).into(),
    })
}

/// The model that a site drives by, and what says it: its own, or that of the first drive of a chain.
fn model_of(site: &Site, prefer: Option<&str>) -> Option<(DriveModel, String)> {
    let of_chain = |(name, chain): (&String, &crate::site::SiteChain)| {
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
    /// Makes the library of a site ready; `chain` names the chain whose drives' model is taken where the site has
    /// none of its own.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn of(site: &'a Site, chain: Option<&str>) -> Result<Self, PlanError> {
        let (model, model_from) = model_of(site, chain).unzip();
        let mut prepared = Self {
            site,
            library: Library::of(site)?,
            seen: vec![],
            leads: vec![],
            model,
            model_from: model_from.unwrap_or_default(),
        };
        prepared.connect()?;
        Ok(prepared)
    }

    /// The library.
    #[must_use]
    pub const fn library(&self) -> &Library {
        &self.library
    }

    /// Finds what each place sees and leads to.
    fn connect(&mut self) -> Result<(), PlanError> {
        let tables = parsed(&self.library)?;
        let places: Vec<[f64; 3]> = self.library.views.iter().map(|view| view.pose).collect();
        let seen: Vec<Vec<usize>> = places
            .par_iter()
            .map(|pose| seen(&self.library, &tables, *pose))
            .collect();
        let costs = Costs::default();
        let Some(any) = tables.first() else {
            return Ok(());
        };
        let question = Question {
            library: &self.library,
            tables: &tables,
            places: &places,
            work: any,
            navigation: &self.site.navigation,
            model: self.model,
            epsilon: self.site.epsilon,
            costs: &costs,
            range: self.site.planner.range,
            most_risk: 1.0,
            wider: WIDER[0],
            ends: &[],
            seen: &seen,
            leads: &[],
            led: &[],
            limit: 0,
        };
        let leads = (0..places.len())
            .into_par_iter()
            .map(|from| {
                (0..places.len())
                    .filter(|to| question.arrives(from, *to))
                    .collect()
            })
            .collect();
        drop(tables);
        self.seen = seen;
        self.leads = leads;
        Ok(())
    }

    /// Plans from a start to a work task.
    ///
    /// What decides in the end is [`crate::chain`], with the estimate wherever it may be ([`Assume::General`]). Each
    /// set that the plan relies on is proven to lie in its success set, by itself; where that does not succeed its
    /// whole table is proven, and where that proof had to give something away the search is done again with what was
    /// proven. (A controller's own tables are proven when they are built.)
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn plan(
        &mut self,
        start: &ChainStart,
        work: &str,
        options: &Options,
    ) -> Result<Planned, PlanError> {
        let mut work_table = WorkTable::of(self.site, work)?;
        let mut bound = None;
        for wider in WIDER {
            let (planned, keeps) =
                self.plan_proven(start, work, &mut work_table, options, wider)?;
            if planned.plan.is_none() && bound.is_none() || keeps {
                let relaxed = bound.is_some() && planned.status == Status::Optimal;
                return Ok(Planned {
                    status: if relaxed {
                        Status::Feasible
                    } else {
                        planned.status
                    },
                    bound: bound.or(planned.bound),
                    ..planned
                });
            }
            // The search has allowed for less than the core's roundings: no plan is cheaper than the one that it found.
            bound = bound.or(planned.bound);
        }
        Ok(Planned {
            status: Status::Limit,
            plan: None,
            bound,
            contingencies: vec![],
            nearest: None,
            model_from: self.model_from(),
        })
    }

    /// Plans with sets that are taken wider than they are by a factor, proves what the plan relies on, and tells
    /// whether the core's own evaluation keeps it, risk and contingencies included.
    fn plan_proven(
        &mut self,
        start: &ChainStart,
        work: &str,
        work_table: &mut WorkTable,
        options: &Options,
        wider: f64,
    ) -> Result<(Planned, bool), PlanError> {
        loop {
            let mut planned = self.plan_once(start, work, &work_table.bytes, options, wider)?;
            let mut changed = false;
            for step in planned.steps_mut() {
                let name = step.report.task.as_deref();
                let look = self.library.looks.iter().position(|look| {
                    Some(look.name.as_str()) == name && step.report.kind == StepKind::Localization
                });
                let (success, is_proven) = match (look, step.report.kind) {
                    (_, StepKind::Navigation) => continue,
                    (Some(look), _) => {
                        let look = &self.library.looks[look];
                        (&look.success, look.is_proven)
                    }
                    (None, _) => (&work_table.success, work_table.is_proven),
                };
                if is_proven || step.report.failure.is_some() || certify(&mut step.report, success)
                {
                    continue;
                }
                changed |= match look {
                    Some(look) => self.library.prove(self.site, look)?,
                    None => work_table.prove(self.site, work)?,
                };
            }
            if !changed {
                let keeps = planned.keeps(options);
                return Ok((planned, keeps));
            }
            self.connect()?;
        }
    }

    fn plan_once(
        &self,
        start: &ChainStart,
        work: &str,
        bytes: &[u8],
        options: &Options,
        wider: f64,
    ) -> Result<Planned, PlanError> {
        let tables = parsed(&self.library)?;
        let work_table = Table::parse(bytes).map_err(|error| PlanError::Table {
            task: work.to_owned(),
            cause: crate::verify::VerifyError::Table(error).into(),
        })?;
        let goal = self
            .site
            .tasks
            .get(work)
            .map(|task| world(task.success.goal));
        let goal = goal.unwrap_or_default();
        let begin = world(start.pose);
        let map = Map::of(self, &tables, &work_table, begin, goal);
        let costs = self.costs(&map, work, options)?;
        let question = |most_risk| Question {
            library: &self.library,
            tables: &tables,
            places: &map.places,
            work: &work_table,
            navigation: &self.site.navigation,
            model: self.model,
            epsilon: self.epsilon(start),
            costs: &costs,
            range: self.site.planner.range,
            most_risk,
            wider,
            ends: &map.ends,
            seen: &map.seen,
            leads: &map.leads,
            led: &map.led,
            limit: options.limit,
        };
        let (leads, led) = map.with_dynamic(&question(1.0));
        let question = Question {
            leads: &leads,
            led: &led,
            ..question(options.most_risk)
        };
        let belief = Belief::at_start(begin, start.spread, &start.known);
        // Whether a search for another way ended at its limit.
        let unsure = core::cell::Cell::new(false);
        let without = |belief: &Belief, place: usize, risk: f64, look: usize| -> Option<Answer> {
            match question.search(belief, place, risk, Some(look), &mut |_, _, _, _| true) {
                End::Optimal(answer) | End::Feasible(answer, _) => Some(answer),
                End::Infeasible(_) => None,
                End::Open(_) => {
                    unsure.set(true);
                    None
                }
            }
        };
        // A look at no tag cannot lose one.
        let mut known: Vec<(Belief, usize, f64, usize, bool)> = vec![];
        let mut rescue = |belief: &Belief, place: usize, risk: f64, look: usize| {
            if !options.survive_a_lost_tag || self.library.looks[look].tags.is_empty() {
                return true;
            }
            let found = known
                .iter()
                .find(|(b, p, r, l, _)| (*p, *r, *l) == (place, risk, look) && b == belief);
            if let Some((.., answer)) = found {
                return *answer;
            }
            let answer = without(belief, place, risk, look).is_some();
            known.push((belief.clone(), place, risk, look, answer));
            answer
        };
        let end = question.search(&belief, map.start, 0.0, None, &mut rescue);
        let (status, answer, bound, miss) = match end {
            End::Optimal(answer) => {
                let cost = answer.cost;
                (Status::Optimal, Some(answer), Some(cost), None)
            }
            End::Feasible(answer, bound) => (Status::Feasible, Some(answer), Some(bound), None),
            End::Infeasible(miss) => (Status::Infeasible, None, None, miss),
            End::Open(miss) => (Status::Limit, None, None, miss),
        };
        // What was ruled out for lack of another way may have had one.
        let (status, bound) = match (status, unsure.get()) {
            (Status::Optimal, true) => (Status::Feasible, Some(0.0)),
            (Status::Infeasible, true) => (Status::Limit, None),
            (status, _) => (status, bound),
        };
        let mut contingencies = vec![];
        let plan = match &answer {
            None => None,
            Some(answer) => {
                let walk = self.walk(start)?;
                let plan = self.told(walk, answer, &map, work, bytes)?;
                for (step, action) in answer.actions.iter().enumerate() {
                    let Action::Look(look) = action else {
                        continue;
                    };
                    let tags = self.library.looks[*look].tags.clone();
                    if tags.is_empty() {
                        continue;
                    }
                    let place = answer.actions[..step]
                        .iter()
                        .rev()
                        .find_map(|action| match action {
                            Action::Drive(to) => Some(*to),
                            Action::Look(_) => None,
                        })
                        .unwrap_or(map.start);
                    let before = &plan.steps[step].report.before;
                    let spent = plan.steps[..step].iter();
                    let risk_before = spent.map(|step| step.report.risk).sum();
                    if let Some(other) = without(before, place, risk_before, *look) {
                        let mut walk = self.walk(start)?;
                        self.replay(&mut walk, &answer.actions[..step], &map)?;
                        let plan = self.told(walk, &other, &map, work, bytes)?;
                        if options.survive_a_lost_tag || plan.report().succeeds() {
                            contingencies.push(Contingency {
                                step,
                                tags,
                                risk_before,
                                plan,
                            });
                        }
                    }
                }
                Some(plan)
            }
        };
        let nearest = miss.map(|miss| {
            let [rho, alpha] = miss.belief.enclosing();
            Nearest {
                scale: miss.scale,
                set: [rho + miss.belief.spread[0], alpha + miss.belief.spread[1]],
                after: miss.after.map(|look| self.library.looks[look].name.clone()),
            }
        });
        let planned = Planned {
            status,
            plan,
            bound,
            contingencies,
            nearest,
            model_from: self.model_from(),
        };
        Ok(planned)
    }

    /// The confidence of every Gaussian set of a plan: the start's, or the site's.
    fn epsilon(&self, start: &ChainStart) -> f64 {
        match start.known {
            Known::Gaussian { epsilon, .. } => epsilon,
            Known::Bounded { .. } => self.site.epsilon,
        }
    }

    fn model_from(&self) -> Option<String> {
        self.model.as_ref().map(|_| self.model_from.clone())
    }

    fn walk(&self, start: &ChainStart) -> Result<Walk, PlanError> {
        Walk::start(
            start,
            self.epsilon(start),
            self.site.navigation.controller,
            Assume::General,
        )
    }

    fn take(&self, walk: &mut Walk, action: Action, map: &Map) -> Result<StepReport, PlanError> {
        match action {
            Action::Look(look) => {
                let look = &self.library.looks[look];
                walk.task(
                    &look.name,
                    TaskKind::Localization,
                    Some(look.bound),
                    look.doubt,
                    &look.bytes,
                )
            }
            Action::Drive(to) => {
                let pose = |[x_m, y_m, yaw_rad]: [f64; 3]| Estimate { x_m, y_m, yaw_rad };
                let from = pose(walk.belief.pose);
                let model = self
                    .model
                    .ok_or_else(|| PlanError::Costs("a drive without a model".to_owned()))?;
                walk.drive(&from, &[Leg::Straight(pose(map.places[to]))], &model)
                    .map_err(|cause| PlanError::Drive { step: 0, cause })
            }
        }
    }

    fn replay(&self, walk: &mut Walk, actions: &[Action], map: &Map) -> Result<(), PlanError> {
        for action in actions {
            self.take(walk, *action, map)?;
        }
        Ok(())
    }

    /// A plan by the core, on the tables that there are.
    fn told(
        &self,
        mut walk: Walk,
        answer: &Answer,
        map: &Map,
        work: &str,
        bytes: &[u8],
    ) -> Result<Plan, PlanError> {
        let mut steps = vec![];
        let mut place = map.name_of(answer.beliefs[0].0, self, work);
        for action in &answer.actions {
            let report = self.take(&mut walk, *action, map)?;
            let tags = match action {
                Action::Look(look) => self.library.looks[*look].tags.clone(),
                Action::Drive(to) => {
                    place = map.name_of(*to, self, work);
                    vec![]
                }
            };
            steps.push(PlanStep {
                place: place.clone(),
                tags,
                report,
            });
        }
        let report = walk.task(work, TaskKind::Work, None, 0.0, bytes)?;
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

    fn costs(&self, map: &Map, work: &str, options: &Options) -> Result<Costs, PlanError> {
        let mut costs = Costs {
            metre: self.site.planner.metre,
            look: self.site.planner.look_cost,
            drives: BTreeMap::new(),
        };
        if options.costs.is_empty() {
            return Ok(costs);
        }
        let named = |name: &str| -> Vec<usize> {
            (0..map.places.len())
                .filter(|place| {
                    let known = map.name_of(*place, self, work);
                    known == name || known.split('#').next() == Some(name)
                })
                .collect()
        };
        for ((from, to), cost) in &options.costs {
            if !(*cost >= 0.0 && cost.is_finite()) {
                return Err(PlanError::Costs(std::format!(
                    "from {from} to {to}: {cost} is no cost; write a number, at least 0"
                )));
            }
            let (starts, ends) = (named(from), named(to));
            for (name, places) in [(from, &starts), (to, &ends)] {
                if places.is_empty() {
                    return Err(PlanError::Costs(std::format!(
                        "there is no place `{name}`; places are `start`, `{work}` and the looks' names"
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
}

/// The places of one question: the library's, the start, those on the way, and the goal.
struct Map {
    places: Vec<[f64; 3]>,
    seen: Vec<Vec<usize>>,
    leads: Vec<Vec<usize>>,
    led: Vec<Vec<usize>>,
    /// How many are the library's.
    fixed: usize,
    start: usize,
    /// The looks of the places between start and goal.
    nearer: Vec<usize>,
    /// Places from which the work may be done.
    ends: Vec<usize>,
}

/// Looks that get a place nearer to the goal.
const NEARER: usize = 12;

impl Map {
    fn of(
        prepared: &Prepared<'_>,
        tables: &[Table<'_>],
        work: &Table<'_>,
        start: [f64; 3],
        goal: [f64; 3],
    ) -> Self {
        let library = &prepared.library;
        let mut places: Vec<[f64; 3]> = library.views.iter().map(|view| view.pose).collect();
        let mut all_seen = prepared.seen.clone();
        let fixed = places.len();
        places.push(start);
        let mut nearest: Vec<(f64, usize)> = library
            .looks
            .iter()
            .enumerate()
            .map(|(index, look)| {
                let far = libm::hypot(look.centre[0] - goal[0], look.centre[1] - goal[1]);
                (far - look.radius, index)
            })
            .filter(|(far, _)| *far <= prepared.site.planner.range)
            .collect();
        nearest.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut nearer = vec![];
        for (_, index) in nearest.into_iter().take(NEARER) {
            let look = &library.looks[index];
            let first = library
                .views
                .iter()
                .find(|view| view.name.rsplit_once('#').map(|(name, _)| name) == Some(&look.name));
            let place = first.and_then(|view| towards(look, &tables[index], view.pose, goal));
            if let Some(place) = place {
                places.push(place);
                nearer.push(index);
            }
        }
        places.push(goal);
        for place in &places[fixed..] {
            all_seen.push(seen(library, tables, *place));
        }
        let last = places.len() - 1;
        let holds = |place: &usize| {
            let point = bounded(places[*place], [1e-5, 1e-5]);
            *place == last || point.is_some_and(|set| decide(work, &set) == Decision::Inside)
        };
        let ends = (0..places.len()).filter(holds).collect();
        Self {
            ends,
            leads: prepared.leads.clone(),
            led: vec![],
            start: fixed,
            fixed,
            nearer,
            seen: all_seen,
            places,
        }
    }

    /// Where each place leads, and from where it is led to, the question's own places included.
    fn with_dynamic(&self, question: &Question<'_>) -> (Vec<Vec<usize>>, Vec<Vec<usize>>) {
        let count = self.places.len();
        let mut leads = self.leads.clone();
        leads.resize(count, vec![]);
        for own in self.fixed..count {
            for (from, led) in leads.iter_mut().enumerate().take(self.fixed) {
                if question.arrives(from, own) {
                    led.push(own);
                }
            }
            leads[own] = (0..count).filter(|to| question.arrives(own, *to)).collect();
        }
        let mut led = vec![vec![]; count];
        for (from, to) in leads.iter().enumerate() {
            for to in to {
                led[*to].push(from);
            }
        }
        (leads, led)
    }

    fn name_of(&self, place: usize, prepared: &Prepared<'_>, work: &str) -> String {
        match prepared.library.views.get(place) {
            Some(view) => view.name.clone(),
            None if place == self.start => "start".to_owned(),
            None if place + 1 == self.places.len() => work.to_owned(),
            None => {
                let look = self.nearer.get(place - self.start - 1);
                let name = look.map_or("", |look| &prepared.library.looks[*look].name);
                std::format!("{name}#near")
            }
        }
    }
}
