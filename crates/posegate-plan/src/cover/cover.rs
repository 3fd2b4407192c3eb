//! Covers a site: prepares its tasks and candidates, chooses tags, and evaluates the choice.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::clearance::{on_a_keep_out, overlap};
use super::exact::{Progress, Terms, bounded, completed, first_cuts, search};
use super::missing::{unreinforced, unserved};
use super::mounted::{mounted_tags, with_tags};
use super::oracle::{Oracle, Robustness};
use super::tags::Tags;
use super::value::value;
use super::{
    ChosenTag, Cover, CoverError, CoverOptions, Incumbent, Method, Stage, TaskCoverage, Watch,
};
use crate::{Library, Options, PlanError, PlanResult, Plans, StopSignal, TaskPlanner};
use posegate_site::{Site, SiteTag, TaskKind};

/// Chooses the cheapest candidates with which every work task has a plan. `tick` is called for each step of a stage,
/// with the number of its steps if that is known.
///
/// No two chosen tags may overlap, nor a chosen tag and a mounted one. If the cheapest choice has such an overlap,
/// one of the tags is removed from the candidates, and the choice is made again. The bound remains that of the first
/// choice if the same tasks are served. Otherwise it is 0, because no bound is known for those tasks only.
///
/// The answer is the same for any number of threads, if no time limit ends it.
///
/// # Errors
/// [`CoverError`]. A task that no candidate serves is not an error: the answer contains the reason.
pub fn cover(
    site: &Site,
    order: &CoverOptions,
    tick: &(dyn Fn(Stage, Option<usize>) + Sync),
) -> Result<Cover, CoverError> {
    let watch = Watch {
        tick,
        improved: &|_| (),
        stop: Arc::default(),
    };
    cover_watched(site, order, &watch)
}

/// Like [`cover`]. Reports each improvement of the choice and of the bound. Stops if [`Watch::stop`] is set or the
/// time is over: the answer is then the best choice so far, which costs no more than the greedy one.
///
/// # Errors
/// As [`cover`].
pub fn cover_watched(
    site: &Site,
    order: &CoverOptions,
    watch: &Watch<'_>,
) -> Result<Cover, CoverError> {
    let begun = Instant::now();
    if site.candidates.is_empty() {
        return Err(CoverError::NoCandidates);
    }
    if site.planner.offers.is_empty() {
        return Err(CoverError::NoLook);
    }
    for (name, found) in &site.candidates {
        if let Some(wall) = on_a_keep_out(site, &found.tag) {
            return Err(CoverError::KeepOut {
                candidate: name.clone(),
                wall: wall.into(),
            });
        }
    }
    let mut site = site.clone();
    let mut first: Option<Cover> = None;
    loop {
        let mut found = chosen(&site, order, begun, watch)?;
        if let Some(first) = &first {
            let served = |cover: &Cover| -> Vec<bool> {
                let tasks = cover.tasks.iter();
                tasks.map(|task| task.reason.is_none()).collect()
            };
            (found.bound, found.bound_checked) = if served(first) == served(&found) {
                (first.bound, first.bound_checked)
            } else {
                (0.0, 0.0)
            };
        }
        let Some(dropped) = overlapping(&found) else {
            return Ok(found);
        };
        site.candidates.remove(&dropped);
        site.planner.offers.retain(|_, made| made.tag != dropped);
        first = first.or(Some(found));
    }
}

/// Returns a cover with tags that may overlap.
fn chosen(
    site: &Site,
    order: &CoverOptions,
    begun: Instant,
    watch: &Watch<'_>,
) -> Result<Cover, CoverError> {
    let tick = watch.tick;
    let until = order
        .time_limit
        .map(|seconds| begun + Duration::from_secs_f64(seconds));
    let stop = StopSignal::new(watch.stop.clone(), until);
    let starts = checked(site, order)?;
    let costs: Vec<f64> = site.candidates.values().map(|found| found.cost).collect();
    let number: BTreeMap<String, usize> = site.candidates.keys().cloned().zip(0..).collect();

    tick(Stage::Tables, None);
    let library = Library::with_candidates(site)?;
    let oracles = oracles(site, order, (&library, &number), &starts, &|| {
        tick(Stage::Reach, Some(starts.len()));
    })?;
    let terms = Terms {
        costs: &costs,
        kind: if order.survive_a_lost_tag {
            Robustness::Survives
        } else {
            Robustness::Plain
        },
        gap: order.gap,
        stop: &stop,
        tick: &|| tick(Stage::Rounds, None),
        improved: &|cost, bound| {
            (watch.improved)(Incumbent {
                cost,
                bound,
                seconds: begun.elapsed().as_secs_f64(),
            });
        },
    };
    let choice = Choice::greedy(oracles, site, &terms)?.improved(order.method, &terms)?;
    let mut cover = choice.cover(site, order, &terms)?;
    let count = starts.len();
    cover.tasks = choice.tasks(&cover.site, &terms, &order.options(), &|| {
        tick(Stage::Check, Some(count));
    })?;
    value(&mut cover, &order.options(), terms.kind)?;
    if order.survive_a_lost_tag {
        name_missing_alternatives(&mut cover);
    }
    if cover.serves_all() && cover.bound > cover.cost * (1.0 + 1e-6) {
        return Err(CoverError::Bound {
            bound: cover.bound,
            cost: cover.cost,
        });
    }
    Ok(cover)
}

/// Prepares every work task with its start, and asks which candidates serve it alone.
fn oracles<'a>(
    site: &'a Site,
    order: &CoverOptions,
    (library, number): (&Library, &'a BTreeMap<String, usize>),
    starts: &[(&str, &str)],
    tick: &(dyn Fn() + Sync),
) -> Result<Vec<Oracle<'a>>, PlanError> {
    starts
        .par_iter()
        .map(|(task, from)| {
            let start = &site.chains[*from].start;
            let endpoint = TaskPlanner::of(site, library, start, task, Some(from), order.beside)?;
            let mut oracle = Oracle::of((task, from), endpoint, number, order.options());
            oracle.ask_singles()?;
            tick();
            Ok(oracle)
        })
        .collect()
}

/// A choice of candidates.
struct Choice<'a> {
    /// The tasks that it serves.
    served: Vec<Oracle<'a>>,
    /// The tasks that no choice serves.
    gone: Vec<Oracle<'a>>,
    /// The names of `gone`, with the reasons.
    lost: BTreeMap<String, String>,
    at: Progress,
}

impl<'a> Choice<'a> {
    /// Returns the greedy choice.
    fn greedy(
        mut oracles: Vec<Oracle<'a>>,
        site: &Site,
        terms: &Terms<'_>,
    ) -> Result<Self, PlanError> {
        let mut lost = unserved(&mut oracles, site)?;
        let (mut served, mut gone) = apart(oracles, &lost);
        let mut cuts = first_cuts(&mut served, terms.demand())?;
        let none = Tags::none(terms.costs.len());
        let mut chosen = completed(&mut served, &none, terms)?;
        let also = unreinforced(&mut served, &chosen, terms)?;
        if !also.is_empty() {
            lost.extend(also);
            let (rest, more) = apart(served, &lost);
            (served, gone) = (rest, gone.into_iter().chain(more).collect());
            cuts = first_cuts(&mut served, terms.demand())?;
            chosen = completed(&mut served, &none, terms)?;
        }
        Ok(Self {
            served,
            gone,
            lost,
            at: Progress {
                chosen,
                bound: 0.0,
                checked: 0.0,
                cuts,
                rounds: 0,
                is_finished: true,
            },
        })
    }

    /// Improves the choice and its bound by a method.
    fn improved(mut self, method: Method, terms: &Terms<'_>) -> Result<Self, CoverError> {
        match method {
            Method::Exact => {
                // The greedy choice is complete from here on, so the search may end at any time.
                for oracle in &mut self.served {
                    oracle.stop_on(terms.stop.clone());
                }
                self.at = search(&mut self.served, self.at, terms)?;
                for oracle in &mut self.served {
                    oracle.stop_on(StopSignal::default());
                }
            }
            Method::Greedy => {
                bounded(&mut self.at, terms.costs)?;
                (terms.improved)(self.at.chosen.cost(terms.costs), self.at.bound);
            }
        }
        Ok(self)
    }

    /// Returns the cover without its tasks, and without the values of its tags.
    fn cover(
        &self,
        site: &Site,
        order: &CoverOptions,
        terms: &Terms<'_>,
    ) -> Result<Cover, CoverError> {
        let names: Vec<&String> = site.candidates.keys().collect();
        let chosen_tags = mounted_tags(site, &names, &self.at.chosen)?;
        let tag = |(number, (name, tag)): (&usize, &(String, SiteTag))| ChosenTag {
            name: name.clone(),
            tag: tag.clone(),
            cost: terms.costs[*number],
            looked_at_by: vec![],
            needed_by: vec![],
            second_of: vec![],
        };
        let oracles = self.served.iter().chain(&self.gone);
        Ok(Cover {
            tags: chosen_tags.iter().map(tag).collect(),
            tasks: Vec::new(),
            cost: self.at.chosen.cost(terms.costs),
            bound: self.at.bound,
            bound_checked: self.at.checked,
            beside: order.beside,
            is_finished: self.at.is_finished,
            rounds: self.at.rounds,
            cuts: self.at.cuts.sure.len(),
            plans: oracles.map(|oracle| oracle.asked).sum(),
            site: with_tags(site, &chosen_tags),
        })
    }

    /// Returns the tasks by name: with the plans on the site with the chosen tags, or the reason why there is none.
    fn tasks(
        &self,
        site: &Site,
        terms: &Terms<'_>,
        options: &Options,
        tick: &dyn Fn(),
    ) -> Result<Vec<TaskCoverage>, PlanError> {
        let mut tasks = final_plans(site, &self.served, terms, options, tick)?;
        for oracle in &self.gone {
            tasks.push(TaskCoverage {
                reason: self.lost.get(&oracle.task).cloned(),
                ..coverage(oracle, oracle.plan(&oracle.reach, terms.kind)?)
            });
        }
        tasks.sort_by(|a, b| a.task.cmp(&b.task));
        Ok(tasks)
    }
}

/// Adds the reason to every task that needs a tag for which there is no alternative.
fn name_missing_alternatives(cover: &mut Cover) {
    for tag in &cover.tags {
        for task in &mut cover.tasks {
            if task.reason.is_none() && tag.needed_by.contains(&task.task) {
                task.reason = Some(format!("there is no plan without the tag `{}`", tag.name));
            }
        }
    }
}

/// Returns a chosen tag that overlaps another chosen or a mounted tag: of two chosen tags the more expensive one, or
/// the last if they cost the same.
fn overlapping(found: &Cover) -> Option<String> {
    let chosen = |name: &str| found.tags.iter().any(|tag| tag.name == name);
    for (at, tag) in found.tags.iter().enumerate() {
        let mut mounted = found.site.tags.iter().filter(|(name, _)| !chosen(name));
        if mounted.any(|(_, other)| overlap(&tag.tag, other)) {
            return Some(tag.name.clone());
        }
        let others = found.tags[at + 1..].iter();
        if let Some(other) = others
            .into_iter()
            .find(|other| overlap(&tag.tag, &other.tag))
        {
            let costlier = if other.cost >= tag.cost { other } else { tag };
            return Some(costlier.name.clone());
        }
    }
    None
}

/// Returns the work tasks with their start chains. Checks the options and the site.
fn checked<'a>(
    site: &'a Site,
    order: &'a CoverOptions,
) -> Result<Vec<(&'a str, &'a str)>, CoverError> {
    let wrong = |what: &str, value: f64| CoverError::Number(format!("{what} {value}"));
    let at_least_0 = |value: f64| value >= 0.0 && value.is_finite();
    if !at_least_0(order.gap) {
        return Err(wrong("a gap is a share, at least 0, not", order.gap));
    }
    if !at_least_0(order.beside) {
        return Err(wrong(
            "the largest distance from the straight line is in metres, at least 0, not",
            order.beside,
        ));
    }
    if !(order.most_risk >= 0.0 && order.most_risk <= 1.0) {
        return Err(wrong("a risk is a probability, not", order.most_risk));
    }
    if let Some(limit) = order.time_limit
        && !(limit > 0.0 && limit <= 1e9)
    {
        return Err(wrong("a time limit is seconds, above 0, not", limit));
    }
    let work = site.tasks.iter();
    let work = work.filter(|(_, task)| task.kind == TaskKind::Work);
    let starts: Vec<(&str, &str)> = work
        .map(|(name, task)| {
            let from = task.from.as_ref().or(order.from.as_ref());
            let from = from.ok_or_else(|| CoverError::NoStart(name.clone()))?;
            let known = site.chains.contains_key(from);
            let from = known.then_some(from.as_str());
            Ok((
                name.as_str(),
                from.ok_or_else(|| CoverError::NoChain(order.from.clone().unwrap_or_default()))?,
            ))
        })
        .collect::<Result<_, CoverError>>()?;
    if starts.is_empty() {
        return Err(CoverError::NoWork);
    }
    Ok(starts)
}

/// Separates the served tasks from the others.
fn apart<'a>(
    oracles: Vec<Oracle<'a>>,
    lost: &BTreeMap<String, String>,
) -> (Vec<Oracle<'a>>, Vec<Oracle<'a>>) {
    oracles
        .into_iter()
        .partition(|oracle| !lost.contains_key(&oracle.task))
}

fn coverage(oracle: &Oracle<'_>, planned: PlanResult) -> TaskCoverage {
    TaskCoverage {
        task: oracle.task.clone(),
        from: oracle.from.clone(),
        in_reach: oracle.reach.len(),
        alone: oracle.singles.len(),
        planned,
        reason: None,
    }
}

/// Returns the plans on the site with the chosen tags, as `posegate plan` finds them.
fn final_plans(
    site: &Site,
    served: &[Oracle<'_>],
    terms: &Terms<'_>,
    options: &Options,
    tick: &dyn Fn(),
) -> Result<Vec<TaskCoverage>, PlanError> {
    let mut plans = Plans::of(site);
    let mut tasks = Vec::new();
    for oracle in served {
        let planned = match plans.plan(&oracle.from, &oracle.task, options)? {
            Some(planned) => planned,
            // The site has no looks, so no tag is needed.
            None => oracle.plan(&Tags::none(terms.costs.len()), terms.kind)?,
        };
        let reason = planned.plan.is_none().then(|| {
            format!(
                "there is a plan with a part of the chosen tags, but with all of them: {}",
                planned.why_not()
            )
        });
        tick();
        tasks.push(TaskCoverage {
            reason,
            ..coverage(oracle, planned)
        });
    }
    Ok(tasks)
}
