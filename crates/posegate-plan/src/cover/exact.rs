//! Exact search of the cheapest choice by cuts: the method of implicit hitting sets (Moreno-Centeno and Karp, 2013),
//! with plans as the oracle.

use rayon::prelude::*;

use super::CoverError;
use super::greedy::{complete, drop_unneeded, reinforce};
use super::master::{Cut, cheapest};
use super::oracle::{Oracle, OracleAnswer, Robustness};
use super::tags::Tags;
use crate::{PlanError, StopSignal};

/// Cuts. A cut is certain if no search for it ended at its limit.
#[derive(Clone, Debug, Default)]
pub(super) struct Cuts {
    pub sure: Vec<Cut>,
    pub unsure: Vec<Cut>,
}

impl Cuts {
    fn add(&mut self, cuts: Vec<(Cut, bool)>) {
        for (cut, sure) in cuts {
            let list = if sure {
                &mut self.sure
            } else {
                &mut self.unsure
            };
            if !list.contains(&cut) {
                list.push(cut);
            }
        }
    }

    fn all(&self) -> Vec<Cut> {
        self.sure.iter().chain(&self.unsure).cloned().collect()
    }
}

/// The state of the search.
#[derive(Clone, Debug)]
pub(super) struct Progress {
    /// The cheapest choice known to serve all tasks.
    pub chosen: Tags,
    pub bound: f64,
    pub checked: f64,
    pub cuts: Cuts,
    pub rounds: usize,
    pub is_finished: bool,
}

/// The limits and the goal of the search.
pub(super) struct Terms<'a> {
    pub costs: &'a [f64],
    pub kind: Robustness,
    /// Allowed gap, relative to the cost.
    pub gap: f64,
    /// Ends the search. The best choice so far is kept.
    pub stop: &'a StopSignal,
    pub tick: &'a (dyn Fn() + Sync),
    /// Called with the cost and the bound when one of them has improved.
    pub improved: &'a (dyn Fn(f64, f64) + Sync),
}

impl Terms<'_> {
    /// Returns the number of candidates that a cut demands of those outside of a set.
    pub const fn demand(&self) -> usize {
        match self.kind {
            Robustness::Plain => 1,
            Robustness::Survives => 2,
        }
    }
}

/// Returns the cut of a set that does not serve the task: at least `demand` of the candidates outside of the set are
/// needed.
fn cut(oracle: &Oracle<'_>, not: &Tags, demand: usize, sure: bool) -> (Cut, bool) {
    let of = oracle.reach.minus(not);
    // If there are fewer candidates than the demand, it is only known that all of them are needed.
    let short = of.len() < demand;
    let demand = demand.min(of.len());
    (Cut { of, demand }, sure && !short)
}

/// Returns the initial cuts of each task. If the candidates that do not serve alone do not serve together either, the
/// task needs one candidate that serves alone, and no others: that cut is exact.
pub(super) fn first_cuts(oracles: &mut [Oracle<'_>], demand: usize) -> Result<Cuts, PlanError> {
    let found = oracles
        .par_iter_mut()
        .map(|oracle| {
            let others = oracle.reach.minus(&oracle.singles);
            if oracle.serves(&others.minus(&others), Robustness::Plain)? {
                return Ok(None);
            }
            if !oracle.singles.is_empty()
                && oracle.ask(&others, Robustness::Plain)? == OracleAnswer::Not
            {
                return Ok(Some(cut(oracle, &others, demand, true)));
            }
            let (not, sure) = oracle.grow(&others.minus(&others), Robustness::Plain)?;
            Ok(Some(cut(oracle, &not, demand, sure)))
        })
        .collect::<Result<Vec<_>, PlanError>>()?;
    let mut cuts = Cuts::default();
    cuts.add(found.into_iter().flatten().collect());
    Ok(cuts)
}

/// Returns cuts that a choice violates, if it does not serve the task.
fn violated(
    oracle: &mut Oracle<'_>,
    chosen: &Tags,
    kind: Robustness,
) -> Result<Vec<(Cut, bool)>, PlanError> {
    /// Largest number of cuts per task and round.
    const MOST: usize = 6;
    let mut cuts = vec![];
    if oracle.serves(chosen, kind)? {
        return Ok(cuts);
    }
    if kind == Robustness::Survives {
        let own = chosen.and(&oracle.reach);
        let lost = own.iter().map(|tag| own.without(tag));
        for less in lost.chain([own.clone()]) {
            if !oracle.serves(&less, Robustness::Plain)? {
                // If one more tag were added, its loss would result in this set.
                let (not, sure) = oracle.grow(&less, Robustness::Plain)?;
                cuts.push(cut(oracle, &not, 2, sure));
                if cuts.len() == MOST {
                    break;
                }
            }
        }
        if cuts.is_empty() {
            let (not, sure) = oracle.grow(chosen, Robustness::Survives)?;
            cuts.push(cut(oracle, &not, 1, sure));
        }
        return Ok(cuts);
    }
    // Disjoint cuts, until the choice with all of their candidates would serve the task.
    let mut with = chosen.clone();
    while cuts.len() < MOST && !oracle.serves(&with, kind)? {
        let (not, sure) = oracle.grow(&with, kind)?;
        let (cut, sure) = cut(oracle, &not, 1, sure);
        if cut.of.is_empty() {
            break;
        }
        with = with.or(&cut.of);
        cuts.push((cut, sure));
    }
    Ok(cuts)
}

/// Completes a choice so that it serves every task, then drops tags that no task needs.
pub(super) fn completed(
    oracles: &mut [Oracle<'_>],
    chosen: &Tags,
    terms: &Terms<'_>,
) -> Result<Tags, PlanError> {
    let mut all = complete(oracles, chosen, terms.demand(), terms.costs);
    if terms.kind == Robustness::Survives {
        all = reinforce(oracles, &all)?;
    }
    drop_unneeded(oracles, &all, terms.kind, terms.costs)
}

/// Alternates between choosing tags and checking tasks until the gap is small enough.
pub(super) fn search(
    oracles: &mut [Oracle<'_>],
    mut at: Progress,
    terms: &Terms<'_>,
) -> Result<Progress, CoverError> {
    let mut reported = None;
    loop {
        let choice = bounded(&mut at, terms.costs)?;
        let cost = at.chosen.cost(terms.costs);
        if reported != Some((cost, at.bound)) {
            reported = Some((cost, at.bound));
            (terms.improved)(cost, at.bound);
        }
        if cost - at.bound <= terms.gap * cost + 1e-7 * cost {
            return Ok(at);
        }
        if terms.stop.is_set() {
            at.is_finished = false;
            return Ok(at);
        }
        at.rounds += 1;
        (terms.tick)();
        let found: Vec<Vec<(Cut, bool)>> = oracles
            .par_iter_mut()
            .map(|oracle| violated(oracle, &choice, terms.kind))
            .collect::<Result<_, PlanError>>()?;
        let found: Vec<(Cut, bool)> = found.into_iter().flatten().collect();
        if terms.stop.is_set() {
            // Tasks may be unchecked.
            continue;
        }
        if found.is_empty() {
            if choice.cost(terms.costs) < cost {
                at.chosen = choice;
                (terms.improved)(at.chosen.cost(terms.costs), at.bound);
            }
            return Ok(at);
        }
        at.cuts.add(found);
        let completed = completed(oracles, &choice, terms)?;
        let serves = oracles
            .par_iter_mut()
            .map(|oracle| oracle.serves(&completed, terms.kind))
            .collect::<Result<Vec<bool>, PlanError>>()?;
        if serves.into_iter().all(|serves| serves) && completed.cost(terms.costs) < cost {
            at.chosen = completed;
        }
    }
}

/// Returns the cheapest choice that satisfies all cuts. Raises the bound to that of the certain cuts.
pub(super) fn bounded(at: &mut Progress, costs: &[f64]) -> Result<Tags, CoverError> {
    let choice = cheapest(&at.cuts.all(), costs).map_err(CoverError::Solver)?;
    let sure = if at.cuts.unsure.is_empty() {
        choice.clone()
    } else {
        cheapest(&at.cuts.sure, costs).map_err(CoverError::Solver)?
    };
    at.bound = at.bound.max(sure.bound);
    at.checked = at.checked.max(sure.checked);
    Ok(choice.chosen)
}
