//! What comes of a cover.

use crate::plan::{Options, PlanResult};
use crate::site::{Site, SiteTag};

/// What a cover is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverOptions {
    /// The chain that tasks without a `from` are begun from.
    pub from: Option<String>,
    /// Whether every task must keep a plan when any single tag is not seen.
    pub survive_a_lost_tag: bool,
    /// How tags are chosen.
    pub method: Method,
    /// The share of the cost by which the bound may be below it, at least 0.
    pub gap: f64,
    /// Rounds are not begun after this time, seconds. (The answer may then depend on the machine.)
    pub time_limit: Option<f64>,
    /// How far beside the straight way from its start to its goal a task's chain may look from, metres.
    pub beside: f64,
    /// The largest chance that a plan fails although no step does.
    pub most_risk: f64,
    /// Labels that the search for a plan may look at.
    pub limit: usize,
}

impl Default for CoverOptions {
    fn default() -> Self {
        Self {
            from: None,
            survive_a_lost_tag: false,
            method: Method::Exact,
            gap: 0.05,
            time_limit: None,
            beside: 2.0,
            most_risk: 0.05,
            limit: 100_000,
        }
    }
}

impl CoverOptions {
    /// What each plan is asked for.
    pub(super) fn options(&self) -> Options {
        Options {
            most_risk: self.most_risk,
            survive_a_lost_tag: self.survive_a_lost_tag,
            limit: self.limit,
            ..Options::default()
        }
    }
}

/// How tags are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The cheapest, to a gap that is proven.
    Exact,
    /// Most newly served tasks for its cost first; then those that nothing needs are dropped. Nothing is proven of its cost
    /// but what the cuts of single candidates say.
    Greedy,
}

/// A stage of the work, for progress bars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The looks' tables.
    Tables,
    /// What is in reach of each task, and which candidate serves it alone: a step a task.
    Reach,
    /// Rounds of choosing and asking: a step a round.
    Rounds,
    /// The plans on the site with the chosen tags: a step a task.
    Check,
    /// Chosen tags are moved a little: a step a tag.
    Polish,
}

/// A tag that was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenTag {
    /// The candidate's name.
    pub name: String,
    /// The tag, with its number: the candidate's, or the least that is free in its family.
    pub tag: SiteTag,
    /// What it costs.
    pub cost: f64,
    /// The tasks whose plans look at it.
    pub looked_at_by: Vec<String>,
    /// The tasks that have no plan without it, by `plan` with all the others.
    pub needed_by: Vec<String>,
    /// The tasks that have a plan without it, and none that survives the loss of another tag. Asked where tags may be lost.
    pub second_of: Vec<String>,
    /// What its polish did; none where none was asked for, or nothing looks at it.
    pub polished: Option<Polished>,
}

/// How a chosen tag was moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polished {
    /// How far from the candidate's place, along its own y and z axes, metres.
    pub moved: [f64; 2],
    /// The reserve before its move, and on the whole polished site: how many times as large the errors of all starts and all looks may be, and each task
    /// that looks at the tag still has a plan, with no other chosen tags than its plan looked at. At least 1; looked for in
    /// steps of 2 %, rounded down.
    pub reserve: [f64; 2],
}

/// A work task and what serves it.
#[derive(Clone, Debug)]
pub struct TaskCoverage {
    /// The work task.
    pub task: String,
    /// The chain that it is begun from.
    pub from: String,
    /// How many candidates are of use for it.
    pub in_reach: usize,
    /// How many of them serve it alone.
    pub alone: usize,
    /// The plan on the site with the chosen tags; without one, what is missing.
    pub planned: PlanResult,
    /// Why the task is not served.
    pub reason: Option<String>,
}

/// The chosen tags, and what they serve.
#[derive(Clone, Debug)]
pub struct Cover {
    /// The chosen tags, in the order of their names.
    pub tags: Vec<ChosenTag>,
    /// The work tasks, in the order of their names.
    pub tasks: Vec<TaskCoverage>,
    /// What the chosen tags cost together.
    pub cost: f64,
    /// No choice that serves these tasks by chains within [`CoverOptions::beside`] costs less (see [`language`](super::language) for what
    /// that rests on).
    pub bound: f64,
    /// The same, by arithmetic alone: a solver's answer is not in it.
    pub bound_checked: f64,
    /// How far beside the straight way the chains of the bound look from, metres.
    pub beside: f64,
    /// Whether the method ended by itself, not by its time.
    pub is_finished: bool,
    /// Rounds of choosing and asking.
    pub rounds: usize,
    /// Cuts that the bound rests on.
    pub cuts: usize,
    /// Plans that were made.
    pub plans: usize,
    /// The site with the chosen tags, without candidates. Its digest is that of the site that was asked for.
    pub site: Site,
}

impl Cover {
    /// Whether every task is served.
    #[must_use]
    pub fn serves_all(&self) -> bool {
        self.tasks.iter().all(|task| task.reason.is_none())
    }

    /// By how much the bound is below the cost, as a share of it.
    #[must_use]
    pub fn gap(&self) -> f64 {
        if self.cost > 0.0 {
            ((self.cost - self.bound) / self.cost).max(0.0)
        } else {
            0.0
        }
    }
}
