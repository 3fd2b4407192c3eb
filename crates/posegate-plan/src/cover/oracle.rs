//! Answers, by planning, which sets of candidates serve one work task.

use std::collections::{BTreeMap, BTreeSet};

use super::tags::Tags;
use crate::{Options, Plan, PlanError, PlanResult, Status, StopSignal, TaskPlanner};

/// The requirement on a set of tags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Robustness {
    /// There is a plan.
    Plain,
    /// There is a plan with an alternative before each of its looks.
    Survives,
}

/// The answer for a set of tags.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum OracleAnswer {
    /// There is a plan, and it needs only these candidates.
    Served(Tags),
    /// There is no plan.
    Not,
    /// The search for a plan ended at its limit.
    Unknown,
}

/// Cached answers. A superset of a set that serves also serves; a subset of a set that does not serve does not serve
/// either.
#[derive(Clone, Debug, Default)]
struct OracleCache {
    served: Vec<Tags>,
    not: Vec<Tags>,
    unknown: Vec<Tags>,
}

/// A work task with its cached answers.
#[derive(Debug)]
pub(super) struct Oracle<'a> {
    pub task: String,
    /// The chain from whose start the task begins.
    pub from: String,
    pub endpoint: TaskPlanner<'a>,
    /// The candidates that are useful for the task.
    pub reach: Tags,
    /// The candidates that serve the task alone (with the tags that are already mounted).
    pub singles: Tags,
    number: &'a BTreeMap<String, usize>,
    options: Options,
    memory: [OracleCache; 2],
    /// The number of plans made.
    pub asked: usize,
}

impl<'a> Oracle<'a> {
    pub fn of(
        (task, from): (&str, &str),
        endpoint: TaskPlanner<'a>,
        number: &'a BTreeMap<String, usize>,
        options: Options,
    ) -> Self {
        let mut reach = Tags::none(number.len());
        for tag in endpoint.tags() {
            if let Some(number) = number.get(tag) {
                reach.insert(*number);
            }
        }
        Self {
            task: task.to_owned(),
            from: from.to_owned(),
            endpoint,
            singles: Tags::none(number.len()),
            reach,
            number,
            options,
            memory: [OracleCache::default(), OracleCache::default()],
            asked: 0,
        }
    }

    fn options(&self, kind: Robustness) -> Options {
        Options {
            survive_a_lost_tag: kind == Robustness::Survives,
            ..self.options.clone()
        }
    }

    /// Returns the plan with these candidates and the tags that are already mounted.
    pub fn plan(&self, set: &Tags, kind: Robustness) -> Result<PlanResult, PlanError> {
        let has = |tag: &str| self.number.get(tag).is_none_or(|number| set.has(*number));
        self.endpoint.plan(has, &self.options(kind))
    }

    /// Returns the answer for a set if the cache implies it.
    fn known(&self, set: &Tags, kind: Robustness) -> Option<OracleAnswer> {
        let [plain, survives] = &self.memory;
        let serving = match kind {
            // A plan that survives a loss is also a plan.
            Robustness::Plain => plain
                .served
                .iter()
                .chain(&survives.served)
                .collect::<Vec<_>>(),
            Robustness::Survives => survives.served.iter().collect(),
        };
        if let Some(used) = serving.into_iter().find(|used| used.is_within(set)) {
            return Some(OracleAnswer::Served(used.clone()));
        }
        let failing = match kind {
            Robustness::Plain => plain.not.iter().collect::<Vec<_>>(),
            Robustness::Survives => survives.not.iter().chain(&plain.not).collect(),
        };
        if failing.into_iter().any(|not| set.is_within(not)) {
            return Some(OracleAnswer::Not);
        }
        let unknown = &self.memory[kind as usize].unknown;
        unknown.contains(set).then_some(OracleAnswer::Unknown)
    }

    /// Makes every answer that needs a search [`OracleAnswer::Unknown`] once the signal is set.
    pub fn stop_on(&mut self, signal: StopSignal) {
        self.options.stop = signal;
    }

    /// Returns the answer for a set of candidates.
    pub fn ask(&mut self, set: &Tags, kind: Robustness) -> Result<OracleAnswer, PlanError> {
        let set = set.and(&self.reach);
        if let Some(known) = self.known(&set, kind) {
            return Ok(known);
        }
        if self.options.stop.is_set() {
            return Ok(OracleAnswer::Unknown);
        }
        self.asked += 1;
        let planned = self.plan(&set, kind)?;
        if self.options.stop.is_set() {
            // The search may have ended early.
            return Ok(OracleAnswer::Unknown);
        }
        let used = planned.plan.as_ref();
        let used = used
            .map(|plan| self.used(plan, &planned, kind))
            .transpose()?;
        let (used, status) = match (used, kind) {
            (Some(used), Robustness::Survives) => self.without_each(&set, used, &planned)?,
            (used, _) => (used, planned.status),
        };
        let memory = &mut self.memory[kind as usize];
        Ok(match (used, status) {
            (Some(used), _) => {
                memory.served.retain(|known| !used.is_within(known));
                memory.served.push(used.clone());
                OracleAnswer::Served(used)
            }
            (None, Status::Infeasible) => {
                memory.not.retain(|known| !known.is_within(&set));
                memory.not.push(set);
                OracleAnswer::Not
            }
            (None, _) => {
                memory.unknown.push(set);
                OracleAnswer::Unknown
            }
        })
    }

    /// Returns the candidates needed for a plan without any one tag that `planned` uses. The places that were made
    /// for a lost tag are also removed. Returns `None` if there is no such plan, with the status of that search.
    fn without_each(
        &mut self,
        set: &Tags,
        mut used: Tags,
        planned: &PlanResult,
    ) -> Result<(Option<Tags>, Status), PlanError> {
        for tag in used.clone().iter() {
            match self.ask(&set.without(tag), Robustness::Plain)? {
                OracleAnswer::Served(others) => used = used.or(&others),
                OracleAnswer::Not => return Ok((None, Status::Infeasible)),
                OracleAnswer::Unknown => return Ok((None, Status::Limit)),
            }
        }
        // Tags that are already mounted can also be lost.
        let steps = planned.plan.iter().flat_map(|plan| &plan.steps);
        let looked_at: BTreeSet<&String> = steps
            .flat_map(|step| &step.tags)
            .filter(|tag| !self.number.contains_key(*tag))
            .collect();
        for lost in looked_at {
            let has = |tag: &str| {
                tag != lost && self.number.get(tag).is_none_or(|number| set.has(*number))
            };
            let others = self.endpoint.plan(has, &self.options(Robustness::Plain))?;
            match &others.plan {
                Some(plan) => used = used.or(&self.looked_at(&[plan], true)),
                None => return Ok((None, others.status)),
            }
        }
        Ok((Some(used), Status::Optimal))
    }

    /// Returns the candidates that plans look at. With `placed`, adds the candidates for which the plans' places were
    /// made.
    fn looked_at(&self, plans: &[&Plan], placed: bool) -> Tags {
        let mut used = Tags::none(self.number.len());
        for step in plans.iter().flat_map(|plan| &plan.steps) {
            let places: &[String] = if placed {
                self.endpoint.tags_of_place(&step.place)
            } else {
                &[]
            };
            let tags = step.tags.iter().chain(places);
            for number in tags.filter_map(|tag| self.number.get(tag)) {
                used.insert(*number);
            }
        }
        used
    }

    /// Returns the candidates that a plan needs: those that it looks at. If there is no plan without the places made
    /// for other candidates, adds these candidates.
    fn used(
        &mut self,
        plan: &Plan,
        planned: &PlanResult,
        kind: Robustness,
    ) -> Result<Tags, PlanError> {
        let others = planned.contingencies.iter().map(|other| &other.plan);
        let others = others.filter(|_| kind == Robustness::Survives);
        let plans: Vec<&Plan> = others.chain([plan]).collect();
        let used = self.looked_at(&plans, false);
        let placed = self.looked_at(&plans, true);
        if placed == used {
            return Ok(used);
        }
        self.asked += 1;
        let serves = self.plan(&used, kind)?.plan.is_some();
        Ok(if serves { used } else { placed })
    }

    pub fn serves(&mut self, set: &Tags, kind: Robustness) -> Result<bool, PlanError> {
        Ok(matches!(self.ask(set, kind)?, OracleAnswer::Served(_)))
    }

    /// The minimal sets that are known to serve.
    pub fn serving(&self) -> &[Tags] {
        &self.memory[Robustness::Plain as usize].served
    }

    /// Checks every candidate alone.
    pub fn ask_singles(&mut self) -> Result<(), PlanError> {
        let mut none = Tags::none(self.number.len());
        if self.serves(&none, Robustness::Plain)? {
            return Ok(());
        }
        for number in self.reach.clone().iter() {
            none.insert(number);
            if self.serves(&none, Robustness::Plain)? {
                self.singles.insert(number);
            }
            none.remove(number);
        }
        Ok(())
    }

    /// Returns a maximal superset of `from` that does not serve the task, and `true` if that is certain. Begins with
    /// all candidates in reach. While the set serves, removes the most used candidate that is not in `from`.
    pub fn grow(&mut self, from: &Tags, kind: Robustness) -> Result<(Tags, bool), PlanError> {
        let from = from.and(&self.reach);
        if kind == Robustness::Survives {
            return self.grow_up(from);
        }
        let mut set = self.reach.clone();
        let mut out = vec![];
        let mut sure = loop {
            match self.ask(&set, kind)? {
                OracleAnswer::Not => break true,
                OracleAnswer::Unknown => break false,
                OracleAnswer::Served(used) => match self.most_used(&used.minus(&from)) {
                    Some(number) => {
                        set.remove(number);
                        out.push(number);
                    }
                    // `from` alone serves the task, so there is no such set.
                    None => return Ok((from, false)),
                },
            }
        };
        for number in out {
            set.insert(number);
            match self.ask(&set, kind)? {
                OracleAnswer::Not => sure = true,
                _ => set.remove(number),
            }
        }
        Ok((set, sure))
    }

    /// Returns the tag that most of the known serving sets contain.
    fn most_used(&self, tags: &Tags) -> Option<usize> {
        let sets = self.memory.iter().flat_map(|memory| &memory.served);
        let sets: Vec<&Tags> = sets.collect();
        let uses = |tag: &usize| sets.iter().filter(|set| set.has(*tag)).count();
        tags.iter()
            .max_by_key(|tag| (uses(tag), core::cmp::Reverse(*tag)))
    }

    /// Like `grow`, by adding candidates, for plans that survive a loss: with few tags their search is much faster.
    fn grow_up(&mut self, from: Tags) -> Result<(Tags, bool), PlanError> {
        let sure = self.ask(&from, Robustness::Survives)? == OracleAnswer::Not;
        let rest: Vec<usize> = self.reach.minus(&from).iter().collect();
        let (mut set, mut at, mut step) = (from, 0, 1);
        while at < rest.len() {
            let taken = &rest[at..rest.len().min(at + step)];
            let mut more = set.clone();
            for number in taken {
                more.insert(*number);
            }
            if self.ask(&more, Robustness::Survives)? == OracleAnswer::Not {
                (set, at, step) = (more, at + taken.len(), 2 * step);
            } else if taken.len() == 1 {
                at += 1;
            } else {
                step = 1;
            }
        }
        Ok((set, sure))
    }
}
