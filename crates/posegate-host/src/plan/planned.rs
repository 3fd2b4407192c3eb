//! What a plan is asked for, and what comes of it.

use std::collections::BTreeMap;

use super::StepReport;

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
    /// A plan, but not all that are cheaper were ruled out: a limit was reached, or the core has kept it only with
    /// wider sets than the search of the cheapest had.
    Feasible,
    /// No chain of the library is sure to succeed.
    Infeasible,
    /// A limit was reached without a plan, or the core kept none that was found.
    Limit,
}

/// A step of a plan.
#[derive(Clone, Debug)]
pub struct PlanStep {
    /// Where the robot is meant to be after it: the place's name.
    pub place: String,
    /// The tags that are looked at.
    pub tags: Vec<String>,
    /// What was found of it; its margin is proven.
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
pub struct PlanResult {
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

impl PlanResult {
    pub(super) fn steps_mut(&mut self) -> impl Iterator<Item = &mut PlanStep> {
        let others = self.contingencies.iter_mut();
        let own = self.plan.iter_mut().flat_map(|plan| plan.steps.iter_mut());
        own.chain(others.flat_map(|other| other.plan.steps.iter_mut()))
    }

    /// Whether the core keeps what the search promised.
    pub(super) fn keeps(&self, options: &Options) -> bool {
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
