//! Options and results of a cover.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::{Options, PlanResult};
use posegate_site::{Site, SiteTag};

/// Options of a cover.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverOptions {
    /// The start chain of tasks without a `from`; `None` if each task has one.
    pub from: Option<String>,
    /// `true` if every task must keep a plan when any single tag is not seen.
    pub survive_a_lost_tag: bool,
    /// The method of choosing tags.
    pub method: Method,
    /// Allowed relative gap between the cost and the bound, at least 0.
    pub gap: f64,
    /// The search ends after this time, seconds, but not before the greedy choice is complete; `None` for no limit. (With a limit, the
    /// answer may depend on the machine.)
    pub time_limit: Option<f64>,
    /// The looks of a task's chain are from places at most this far from the straight line between its start and its
    /// goal, metres.
    pub beside: f64,
    /// The largest allowed probability that a plan fails although no step does.
    pub most_risk: f64,
    /// The number of labels that the search for a plan may expand.
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
    /// Returns the options of each plan.
    pub(super) fn options(&self) -> Options {
        Options {
            most_risk: self.most_risk,
            survive_a_lost_tag: self.survive_a_lost_tag,
            limit: self.limit,
            ..Options::default()
        }
    }
}

/// The method of choosing tags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The cheapest choice, to a proven gap.
    Exact,
    /// Greedy: the largest number of newly served tasks per cost first; then drops tags that no task needs. The only
    /// bound of its cost comes from the cuts of single candidates.
    Greedy,
}

/// The best choice so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incumbent {
    /// The cost of the choice.
    pub cost: f64,
    /// A proven lower bound of the cost of any choice.
    pub bound: f64,
    /// Seconds since the search began.
    pub seconds: f64,
}

impl Incumbent {
    /// Returns the gap between cost and bound, relative to the cost.
    #[must_use]
    pub fn gap(&self) -> f64 {
        if self.cost > 0.0 {
            ((self.cost - self.bound) / self.cost).max(0.0)
        } else {
            0.0
        }
    }
}

/// Callbacks of a running cover, and the signal that ends it.
pub struct Watch<'a> {
    /// Called for each step of a stage, with the number of steps if it is known.
    pub tick: &'a (dyn Fn(Stage, Option<usize>) + Sync),
    /// Called when the choice or its bound has improved.
    pub improved: &'a (dyn Fn(Incumbent) + Sync),
    /// Ends the search for a cheaper choice if it is set.
    pub stop: Arc<AtomicBool>,
}

impl core::fmt::Debug for Watch<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mut fields = f.debug_struct("Watch");
        fields.field("stop", &self.stop).finish_non_exhaustive()
    }
}

/// A stage of the work, for progress bars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Building the tables of the looks.
    Tables,
    /// The candidates in reach of each task, and those that serve the task alone: one step per task.
    Reach,
    /// Rounds of choosing tags and checking tasks: one step per round.
    Rounds,
    /// The plans on the site with the chosen tags: one step per task.
    Check,
}

/// A chosen tag.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenTag {
    /// The candidate's name.
    pub name: String,
    /// The tag. Its id is the candidate's, or the least free id of its family.
    pub tag: SiteTag,
    /// The cost of the tag.
    pub cost: f64,
    /// The tasks whose plans look at the tag.
    pub looked_at_by: Vec<String>,
    /// The tasks that have no plan without the tag, even with all the others.
    pub needed_by: Vec<String>,
    /// The tasks that have a plan without the tag, but none that survives the loss of another tag. Computed only if
    /// plans must survive a lost tag.
    pub second_of: Vec<String>,
}

/// A work task and the plan that serves it.
#[derive(Clone, Debug)]
pub struct TaskCoverage {
    /// The name of the work task.
    pub task: String,
    /// The chain from whose start the task begins.
    pub from: String,
    /// The number of candidates that are useful for the task.
    pub in_reach: usize,
    /// The number of candidates that serve the task alone.
    pub alone: usize,
    /// The plan on the site with the chosen tags, or the reason why there is none.
    pub planned: PlanResult,
    /// The reason why the task is not served; `None` if it is.
    pub reason: Option<String>,
}

/// The chosen tags, and the tasks that they serve.
#[derive(Clone, Debug)]
pub struct Cover {
    /// The chosen tags, in the order of their names.
    pub tags: Vec<ChosenTag>,
    /// The work tasks, in the order of their names.
    pub tasks: Vec<TaskCoverage>,
    /// The total cost of the chosen tags.
    pub cost: f64,
    /// Lower bound: no choice that serves these tasks by chains within [`CoverOptions::beside`] costs less (see
    /// [`language`](super::language) for the assumptions).
    pub bound: f64,
    /// The same lower bound as `bound`, computed without a solver's answer.
    pub bound_checked: f64,
    /// Largest distance from the straight line of the looks of the bound's chains, metres.
    pub beside: f64,
    /// `true` if the method was completed before its time limit.
    pub is_finished: bool,
    /// The number of rounds of choosing tags and checking tasks.
    pub rounds: usize,
    /// The number of cuts that the bound relies on.
    pub cuts: usize,
    /// The number of plans made.
    pub plans: usize,
    /// The site with the chosen tags, without candidates. Its digest is that of the original site.
    pub site: Site,
}

impl Cover {
    /// Returns `true` if every task is served.
    #[must_use]
    pub fn serves_all(&self) -> bool {
        self.tasks.iter().all(|task| task.reason.is_none())
    }

    /// Returns the gap between cost and bound, relative to the cost.
    #[must_use]
    pub fn gap(&self) -> f64 {
        if self.cost > 0.0 {
            ((self.cost - self.bound) / self.cost).max(0.0)
        } else {
            0.0
        }
    }
}
