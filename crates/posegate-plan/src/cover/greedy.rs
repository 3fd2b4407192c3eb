//! Greedy choice: adds the tags that serve the most new tasks per cost, then drops tags that no task needs.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::oracle::{Oracle, OracleAnswer, Robustness};
use super::tags::Tags;
use crate::PlanError;

/// Returns how many more tags a task needs, from those that serve it alone. If no tag serves it alone, counts sets
/// that serve it.
fn short(oracle: &Oracle<'_>, set: &Tags, demand: usize) -> usize {
    if oracle.serving().iter().any(Tags::is_empty) {
        return 0;
    }
    let alone = oracle.singles.and(set).len();
    if alone == 0 && oracle.serving().iter().any(|used| used.is_within(set)) {
        return demand.saturating_sub(1);
    }
    demand.saturating_sub(alone)
}

/// Completes a choice so that every task has a plan, by the known sets that serve. With a `demand` of two, a task
/// that single tags serve gets two of these, if there are two.
pub(super) fn complete(oracles: &[Oracle<'_>], from: &Tags, demand: usize, costs: &[f64]) -> Tags {
    let mut chosen = from.clone();
    let wanted = |oracle: &Oracle<'_>| {
        if oracle.singles.is_empty() {
            1
        } else {
            demand.min(oracle.singles.len())
        }
    };
    loop {
        let open: Vec<(&Oracle<'_>, usize, usize)> = oracles
            .iter()
            .map(|oracle| {
                let wanted = wanted(oracle);
                (oracle, wanted, short(oracle, &chosen, wanted))
            })
            .filter(|(_, _, short)| *short > 0)
            .collect();
        let moves: BTreeSet<Tags> = open
            .iter()
            .flat_map(|(oracle, ..)| oracle.serving())
            .map(|used| used.minus(&chosen))
            .filter(|used| !used.is_empty())
            .collect();
        let worth = |add: &Tags| {
            let with = chosen.or(add);
            let near = |oracle: &Oracle<'_>| !oracle.reach.and(add).is_empty();
            let gained: usize = open
                .iter()
                .filter(|(oracle, ..)| near(oracle))
                .map(|(oracle, wanted, before)| before - short(oracle, &with, *wanted).min(*before))
                .sum();
            gained as f64 / add.cost(costs)
        };
        let moves: Vec<Tags> = moves.into_iter().collect();
        let worths: Vec<f64> = moves.par_iter().map(worth).collect();
        // The first, if several are equal.
        let best = worths
            .iter()
            .enumerate()
            .filter(|(_, worth)| **worth > 0.0)
            .max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0)));
        match best {
            Some((number, _)) => chosen = chosen.or(&moves[number]),
            None => return chosen,
        }
    }
}

/// Adds tags so that every task has another plan before each look.
pub(super) fn reinforce(oracles: &mut [Oracle<'_>], from: &Tags) -> Result<Tags, PlanError> {
    let added: Vec<Option<Tags>> = oracles
        .par_iter_mut()
        .map(|oracle| {
            if oracle.serves(from, Robustness::Survives)? {
                return Ok(None);
            }
            for more in [oracle.singles.clone(), oracle.reach.clone()] {
                if let OracleAnswer::Served(used) =
                    oracle.ask(&from.or(&more), Robustness::Survives)?
                {
                    return Ok(Some(used));
                }
            }
            Ok(None)
        })
        .collect::<Result<_, PlanError>>()?;
    Ok(added
        .iter()
        .flatten()
        .fold(from.clone(), |all, more| all.or(more)))
}

/// Drops tags that no task needs, the most expensive first.
pub(super) fn drop_unneeded(
    oracles: &mut [Oracle<'_>],
    chosen: &Tags,
    kind: Robustness,
    costs: &[f64],
) -> Result<Tags, PlanError> {
    let mut kept = chosen.clone();
    let mut order: Vec<usize> = chosen.iter().collect();
    // Of tags with equal costs, the tag in reach of the fewest tasks comes first.
    let near = |tag: usize| {
        oracles
            .iter()
            .filter(|oracle| oracle.reach.has(tag))
            .count()
    };
    let nearness: Vec<usize> = order.iter().map(|tag| near(*tag)).collect();
    let mut keyed: Vec<(usize, usize)> = order.drain(..).zip(nearness).collect();
    keyed.sort_by(|a, b| {
        costs[b.0]
            .total_cmp(&costs[a.0])
            .then(a.1.cmp(&b.1))
            .then(a.0.cmp(&b.0))
    });
    for (tag, _) in keyed {
        let less = kept.without(tag);
        // If the chosen tags do not serve a task, the task needs none of them.
        let is_unneeded = oracles
            .par_iter_mut()
            .filter(|oracle| oracle.reach.has(tag))
            .map(|oracle| Ok(oracle.serves(&less, kind)? || !oracle.serves(&kept, kind)?))
            .collect::<Result<Vec<bool>, PlanError>>()?;
        if is_unneeded.into_iter().all(|is_unneeded| is_unneeded) {
            kept = less;
        }
    }
    Ok(kept)
}
