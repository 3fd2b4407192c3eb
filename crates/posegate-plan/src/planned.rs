//! Options and results of planning.

use std::collections::BTreeMap;

use super::{StepReport, StopSignal};

/// Options of a plan.
#[derive(Clone, Debug)]
pub struct Options {
    /// The largest allowed probability that the plan fails although no step does.
    pub most_risk: f64,
    /// `true` if a plan must exist after the loss of any one tag.
    pub survive_a_lost_tag: bool,
    /// The number of labels that a search may expand.
    pub limit: usize,
    /// Costs of drives by the places' names; `start` and the work task's name are places too. Other drives
    /// cost [`Planner::metre`](posegate_site::Planner::metre) per metre.
    pub costs: BTreeMap<(String, String), f64>,
    /// Ends the search early.
    pub stop: StopSignal,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            most_risk: 0.05,
            survive_a_lost_tag: false,
            limit: 100_000,
            costs: BTreeMap::new(),
            stop: StopSignal::default(),
        }
    }
}

/// The end of a search for a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// No chain of the library is cheaper.
    Optimal,
    /// There is a plan, but a cheaper plan is possible: a limit was reached, or the core accepted the plan only with
    /// wider sets than those of the cheapest plan's search.
    Feasible,
    /// No chain of the library is certain to succeed.
    Infeasible,
    /// A limit was reached without a plan, or the core accepted none of the plans found.
    Limit,
}

/// A step of a plan.
#[derive(Clone, Debug)]
pub struct PlanStep {
    /// Name of the intended place of the robot after the step.
    pub place: String,
    /// The tags that the step looks at.
    pub tags: Vec<String>,
    /// The result of the step; its margin is proven.
    pub report: StepReport,
}

/// A chain of steps that ends with the work.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The steps; the last one is the work.
    pub steps: Vec<PlanStep>,
    /// The cost of the plan.
    pub cost: f64,
    /// The probability that the plan fails although no step does.
    pub risk: f64,
}

impl Plan {
    /// Returns `true` if every step succeeds with a margin of at least `least`.
    pub(super) fn succeeds_with(&self, least: f64) -> bool {
        let report = self.report();
        let least = libm::floor(least * 65_536.0) as u32;
        let worst = report.worst_margin();
        report.succeeds() && worst.is_none_or(|(margin, _)| margin.q16() >= least)
    }
}

/// The plan to follow if a look fails.
#[derive(Clone, Debug)]
pub struct Contingency {
    /// The index of the look among the plan's steps, from 0.
    pub step: usize,
    /// The tags that the look needs. `plan` uses none of them.
    pub tags: Vec<String>,
    /// The risk of the steps before the look.
    pub risk_before: f64,
    /// The plan from there, without the look.
    pub plan: Plan,
}

/// The arrival at the work task that comes nearest to success.
#[derive(Clone, Debug)]
pub struct Nearest {
    /// The scale at which the set would fit.
    pub scale: f64,
    /// The scale at which it must fit: `least_margin` of `[planner]`.
    pub least: f64,
    /// The set: translation, yaw (m, rad), the estimate's spread included.
    pub set: [f64; 2],
    /// The name of the look before the arrival; `None` if the robot arrives without a look.
    pub after: Option<String>,
}

/// The result of planning.
#[derive(Clone, Debug)]
pub struct PlanResult {
    /// The end of the search.
    pub status: Status,
    /// The plan; `None` if the search found no plan.
    pub plan: Option<Plan>,
    /// A lower bound of the cost of every chain of the library; `None` if no search found a
    /// plan.
    pub bound: Option<f64>,
    /// A lower bound of the cost of every chain, with looks from any places: the straight path, and the least number
    /// of looks that any chain needs.
    pub bound_of_all: f64,
    /// Plans for failed looks; with [`Options::survive_a_lost_tag`] for every look at a tag.
    pub contingencies: Vec<Contingency>,
    /// The nearest miss, if there is no plan.
    pub nearest: Option<Nearest>,
    /// The source of the drive model: `site`, or `chain NAME`. Without it no plan drives.
    pub model_from: Option<String>,
}

impl PlanResult {
    pub(super) fn steps_mut(&mut self) -> impl Iterator<Item = &mut PlanStep> {
        let others = self.contingencies.iter_mut();
        let own = self.plan.iter_mut().flat_map(|plan| plan.steps.iter_mut());
        own.chain(others.flat_map(|other| other.plan.steps.iter_mut()))
    }

    /// Returns the part of the plan's cost above [`Self::bound_of_all`], as a share from 0 to 1; `None` without a
    /// plan.
    #[must_use]
    pub fn gap(&self) -> Option<f64> {
        let cost = self.plan.as_ref()?.cost;
        let gap = if cost > 0.0 {
            ((cost - self.bound_of_all) / cost).max(0.0)
        } else {
            0.0
        };
        Some(gap)
    }

    /// Returns `true` if the core's evaluation satisfies the options, and every margin is at least `least`.
    pub(super) fn satisfies(&self, options: &Options, least: f64) -> bool {
        let Some(plan) = &self.plan else {
            return false;
        };
        let within = |risk: f64| risk <= options.most_risk + 1e-12;
        let other = |other: &Contingency| {
            other.plan.succeeds_with(least) && within(other.risk_before + other.plan.risk)
        };
        let survives = !options.survive_a_lost_tag
            || plan.steps.iter().enumerate().all(|(number, step)| {
                step.tags.is_empty() || self.contingencies.iter().any(|c| c.step == number)
            });
        plan.succeeds_with(least)
            && within(plan.risk)
            && survives
            && (!options.survive_a_lost_tag || self.contingencies.iter().all(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Prepared;
    use posegate_site::Site;

    const PAPER: &str = include_str!("../../../examples/sites/paper-chain.toml");

    #[test]
    fn plan_succeeds_with_its_least_margin_and_with_no_larger_one() {
        let site = Site::parse(PAPER, "site.toml").unwrap();
        let start = &site.chains["back-to-dock"].start;
        let mut prepared = Prepared::of(&site, Some("back-to-dock")).unwrap();
        let planned = prepared.plan(start, "dock", &Options::default()).unwrap();
        let plan = planned.plan.unwrap();
        let (least, _) = plan.report().worst_margin().unwrap();
        let least = f64::from(least.q16()) / 65_536.0;
        assert!(plan.succeeds_with(1.0) && plan.succeeds_with(least));
        assert!(!plan.succeeds_with(least + 1e-4));
    }
}
