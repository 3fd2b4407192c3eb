//! The cheapest set of candidates that satisfies the cuts: one integer program per component, solved by branch and
//! bound.
//!
//! Cuts that share no candidate are independent: each component is a program of its own. Candidate `a` dominates `b`
//! if `a` costs no more and is in every cut that `b` is in. A candidate is omitted if the number of others that
//! dominate it is at least the largest demand of its cuts. In a cheapest set it could be replaced by one of them, or
//! be omitted.
//!
//! The solver's answer is not trusted. Its choice is checked against every cut. The bound that is reported as checked
//! is computed from prices of the cuts, and is valid for any prices that are at least 0: no choice that satisfies the
//! cuts costs less than `sum(demand price) - sum(max(0, prices of the candidate's cuts - its cost))`.

use microlp::{ComparisonOp, OptimizationDirection, Problem, SolveOptions, Variable};
use rayon::prelude::*;

use super::tags::Tags;

/// A cut: at least `demand` of these candidates are needed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Cut {
    pub of: Tags,
    pub demand: usize,
}

/// The solution of the integer programs.
#[derive(Clone, Debug)]
pub(super) struct MasterSolution {
    pub chosen: Tags,
    /// Lower bound of the cost, according to the solver.
    pub bound: f64,
    /// Lower bound of the cost, by prices.
    pub checked: f64,
}

/// Largest number of branch-and-bound nodes per component.
const NODES: u64 = 200_000;

/// A bound is lowered by this, to allow for the rounding of floats.
const SLACK: f64 = 1e-9;

/// Returns the cheapest choice that satisfies the cuts.
pub(super) fn cheapest(cuts: &[Cut], costs: &[f64]) -> Result<MasterSolution, String> {
    let parts: Vec<MasterSolution> = components(&without_implied(cuts))
        .into_par_iter()
        .map(|cuts| component(&cuts, costs))
        .collect::<Result<_, _>>()?;
    let mut all = MasterSolution {
        chosen: Tags::none(costs.len()),
        bound: 0.0,
        checked: 0.0,
    };
    for part in parts {
        all.chosen = all.chosen.or(&part.chosen);
        all.bound += part.bound;
        all.checked += part.checked;
    }
    for cut in cuts {
        if all.chosen.and(&cut.of).len() < cut.demand {
            return Err("the solver's choice violates a cut".into());
        }
    }
    Ok(all)
}

/// Returns the cuts that no other cut implies.
fn without_implied(cuts: &[Cut]) -> Vec<Cut> {
    let mut kept: Vec<Cut> = vec![];
    for cut in cuts {
        let implies = |a: &Cut, b: &Cut| a.of.is_within(&b.of) && a.demand >= b.demand;
        if !kept.iter().any(|other| implies(other, cut)) {
            kept.retain(|other| !implies(cut, other));
            kept.push(cut.clone());
        }
    }
    kept
}

/// Groups the cuts into components that share candidates.
fn components(cuts: &[Cut]) -> Vec<Vec<Cut>> {
    let mut parts: Vec<(Tags, Vec<Cut>)> = vec![];
    for cut in cuts {
        let mut joined = (cut.of.clone(), vec![cut.clone()]);
        let mut apart = vec![];
        for (tags, cuts) in parts {
            if tags.and(&joined.0).is_empty() {
                apart.push((tags, cuts));
            } else {
                joined.0 = joined.0.or(&tags);
                joined.1.extend(cuts);
            }
        }
        apart.push(joined);
        parts = apart;
    }
    parts.into_iter().map(|(_, cuts)| cuts).collect()
}

/// A candidate and the indices of its cuts.
type Column = (usize, Vec<usize>);

/// Returns the candidates of some cuts.
fn columns(cuts: &[Cut], costs: &[f64]) -> Vec<Column> {
    let mut all = Tags::none(costs.len());
    for cut in cuts {
        all = all.or(&cut.of);
    }
    let rows = |number: usize| -> Vec<usize> {
        (0..cuts.len())
            .filter(|cut| cuts[*cut].of.has(number))
            .collect()
    };
    all.iter().map(|number| (number, rows(number))).collect()
}

/// Returns the candidates that are not dominated by enough others.
fn needed(all: &[Column], cuts: &[Cut], costs: &[f64]) -> Vec<Column> {
    // Of two equal candidates the earlier dominates the later.
    let dominates = |a: &Column, b: &Column| {
        let within = b.1.iter().all(|row| a.1.binary_search(row).is_ok());
        let equal = costs[a.0] == costs[b.0] && a.1.len() == b.1.len();
        a.0 != b.0 && within && costs[a.0] <= costs[b.0] && (!equal || a.0 < b.0)
    };
    let is_needed = |column: &&Column| {
        let demand = column.1.iter().map(|row| cuts[*row].demand).max();
        let others = all.iter().filter(|other| dominates(other, column));
        others.count() < demand.unwrap_or(0)
    };
    all.iter().filter(is_needed).cloned().collect()
}

fn component(cuts: &[Cut], costs: &[f64]) -> Result<MasterSolution, String> {
    let all = columns(cuts, costs);
    let columns = needed(&all, cuts, costs);
    let mut problem = Problem::new(OptimizationDirection::Minimize);
    let variables: Vec<Variable> = columns
        .iter()
        .map(|(number, _)| problem.add_binary_var(costs[*number]))
        .collect();
    for (row, cut) in cuts.iter().enumerate() {
        let of = columns.iter().zip(&variables);
        let of = of.filter(|((_, rows), _)| rows.binary_search(&row).is_ok());
        let terms: Vec<(Variable, f64)> = of.map(|(_, variable)| (*variable, 1.0)).collect();
        problem.add_constraint(terms.as_slice(), ComparisonOp::Ge, cut.demand as f64);
    }
    let mut options = SolveOptions::default();
    options.node_limit = Some(NODES);
    let outcome = problem.solve_with(options);
    let outcome = outcome.map_err(|error| format!("{error}"))?;
    let best = outcome.stats().best_bound;
    let solution = outcome
        .solution()
        .ok_or("the solver found nothing within its nodes")?;
    let mut chosen = Tags::none(costs.len());
    for ((number, _), variable) in columns.iter().zip(&variables) {
        if solution.var_value_raw(*variable) > 0.5 {
            chosen.insert(*number);
        }
    }
    let cost = chosen.cost(costs);
    let checked = dual_bound(cuts, (&columns, &all), costs);
    let said = if outcome.is_optimal() {
        cost
    } else {
        best.unwrap_or(0.0)
    };
    let lower = |bound: f64| (bound - SLACK * (1.0 + bound.abs())).min(cost);
    Ok(MasterSolution {
        bound: lower(said).max(lower(checked)),
        checked: lower(checked),
        chosen,
    })
}

/// Returns a bound by prices. The prices are those of the linear relaxation, from a solver. The bound is valid for
/// any prices that are at least 0.
fn dual_bound(cuts: &[Cut], (columns, all): (&[Column], &[Column]), costs: &[f64]) -> f64 {
    let mut dual = Problem::new(OptimizationDirection::Maximize);
    let prices: Vec<Variable> = cuts
        .iter()
        .map(|cut| dual.add_var(cut.demand as f64, (0.0, f64::INFINITY)))
        .collect();
    for (number, rows) in columns {
        // The part of the prices above the cost, because a candidate is chosen at most once.
        let above = dual.add_var(-1.0, (0.0, f64::INFINITY));
        let mut terms: Vec<(Variable, f64)> = rows.iter().map(|row| (prices[*row], 1.0)).collect();
        terms.push((above, -1.0));
        dual.add_constraint(terms.as_slice(), ComparisonOp::Le, costs[*number]);
    }
    let Ok(outcome) = dual.solve() else {
        return 0.0;
    };
    let Some(solution) = outcome.solution() else {
        return 0.0;
    };
    let price: Vec<f64> = prices
        .iter()
        .map(|variable| solution.var_value_raw(*variable))
        .map(|price| {
            if price.is_finite() {
                price.max(0.0)
            } else {
                0.0
            }
        })
        .collect();
    let paid: f64 = cuts
        .iter()
        .zip(&price)
        .map(|(cut, price)| cut.demand as f64 * price)
        .sum();
    let above: f64 = all
        .iter()
        .map(|(number, rows)| {
            let of: f64 = rows.iter().map(|row| price[*row]).sum();
            (of - costs[*number]).max(0.0)
        })
        .sum();
    let bound = paid - above;
    // Integer costs have an integer sum.
    let is_whole = all.iter().all(|(number, _)| costs[*number] % 1.0 == 0.0);
    if is_whole {
        libm::ceil(bound - 1e-6).max(0.0)
    } else {
        bound.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate_testkit::counts;

    /// splitmix64.
    fn next(state: &mut u64) -> u64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Random cuts of ten candidates: the choice is the cheapest of all 1,024, and no bound is above it.
    #[test]
    fn choice_is_the_cheapest_that_satisfies_the_cuts() {
        const COUNT: usize = 10;
        let mut apart = 0;
        for seed in 0..counts::rounds(300, 2) {
            let mut state = u64::from(seed);
            let is_whole = next(&mut state).is_multiple_of(2);
            let costs: Vec<f64> = (0..COUNT)
                .map(|_| {
                    let part = (next(&mut state) % 5 + 2) as f64;
                    if is_whole { part } else { part / 3.0 }
                })
                .collect();
            let cuts: Vec<Cut> = (0..next(&mut state) % 7 + 1)
                .map(|_| {
                    let mut of = Tags::none(COUNT);
                    // Neighbours, so that some cuts share no candidate.
                    let first = next(&mut state) as usize % COUNT;
                    for step in 0..next(&mut state) as usize % 4 + 2 {
                        of.insert((first + step) % COUNT);
                    }
                    let demand = next(&mut state) as usize % 2 + 1;
                    Cut { of, demand }
                })
                .collect();
            let keeps = |chosen: &Tags| {
                let mut cuts = cuts.iter();
                cuts.all(|cut| chosen.and(&cut.of).len() >= cut.demand)
            };
            let best = (0..1usize << COUNT)
                .map(|subset| {
                    let mut chosen = Tags::none(COUNT);
                    for number in (0..COUNT).filter(|number| subset >> number & 1 == 1) {
                        chosen.insert(number);
                    }
                    chosen
                })
                .filter(keeps)
                .map(|chosen| chosen.cost(&costs))
                .fold(f64::INFINITY, f64::min);
            let found = cheapest(&cuts, &costs).unwrap();
            assert!(keeps(&found.chosen));
            let cost = found.chosen.cost(&costs);
            assert!((cost - best).abs() < 1e-9, "seed {seed}: {cost}, {best}");
            assert!(found.bound <= best && found.bound > best - 1e-6);
            assert!(found.checked <= best && found.checked > 0.5 * best);
            apart += usize::from(components(&cuts).len() > 1);
        }
        assert!(cfg!(miri) || apart > 50, "{apart}");
    }
}
