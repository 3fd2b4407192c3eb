//! Label-setting search: labels of (cost, set, risk) at places, the cheapest first.
//!
//! A label says that the robot can be at a place with a belief. Each look whose success set contains the belief's set
//! gives a new belief; from there the robot can drive to every place within range. A label is dropped if another label
//! of the same place is at least as good in cost, set and risk. A dropped label cannot be part of a cheaper plan: a
//! smaller set stays smaller after each step, and fits wherever a larger set does.
//!
//! (The facet test uses several levers: a smaller set may fail it although a larger set passes. If nothing is found, a
//! shorter search drops only labels that are equal.)
//!
//! A backward pass from the work task drops places from which even a robot with an exactly known pose before the look
//! could not arrive well enough. The other places get a lower bound of the cost to go, which makes the search
//! best-first. The first plan taken from the queue is the cheapest of the library. If the queue becomes empty, there is
//! no plan.

use std::cmp;
use std::collections::BinaryHeap;

use super::BeliefStateF64;
use super::costs::{Costs, way};
use super::library::{Library, needed};
use crate::site::{DriveModel, ErrorBound, Navigation};
use posegate::contain::{Decision, Examination, decide, examine};
use posegate::set::Estimate;
use posegate::table::Table;
use posegate::task::Leg;

/// The input of a search.
pub(super) struct SearchProblem<'a> {
    pub library: &'a Library,
    pub tables: &'a [Table<'a>],
    /// Places: the library's, and those of this problem. The goal is the last one.
    pub places: &'a [[f64; 3]],
    pub work: &'a Table<'a>,
    pub navigation: &'a Navigation,
    pub model: Option<DriveModel>,
    pub epsilon: f64,
    pub costs: &'a Costs,
    pub range: f64,
    pub most_risk: f64,
    /// The factor by which the sets of beliefs are widened.
    pub wider: f64,
    /// The places where a robot with a known pose may begin the work. The goal is one of them.
    pub ends: &'a [usize],
    /// The looks that each place's pose is in.
    pub seen: &'a [Vec<usize>],
    /// The successors of each place: where, at best, a robot arrives well enough to look there.
    pub leads: &'a [Vec<usize>],
    /// The predecessors of each place.
    pub predecessors: &'a [Vec<usize>],
    /// The number of labels that may be taken from the queue.
    pub limit: usize,
    /// `true` if dominated labels are dropped; else only equal labels are dropped.
    pub prunes_dominated: bool,
}

/// One action of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    /// A look, by number.
    Look(usize),
    /// A drive to a place, by number.
    Drive(usize),
}

/// The plan that a search found.
#[derive(Clone, Debug)]
pub(super) struct Answer {
    pub actions: Vec<Action>,
    /// The place and the belief at each label along the plan, from the start to the work.
    pub beliefs: Vec<(usize, BeliefStateF64)>,
    pub cost: f64,
}

/// How a search ended.
#[derive(Clone, Debug)]
pub(super) enum SearchOutcome {
    /// The cheapest plan.
    Optimal(Answer),
    /// The best plan found within the limit, and a lower bound of the cheapest plan's cost.
    Feasible(Answer, f64),
    /// There is no plan; the nearest miss.
    Infeasible(Option<NearMiss>),
    /// The limit was reached without a plan; the nearest miss.
    Open(Option<NearMiss>),
}

/// An arrival at the work task that does not fit.
#[derive(Clone, Debug)]
pub(super) struct NearMiss {
    pub scale: f64,
    pub belief: BeliefStateF64,
    /// The look before the arrival.
    pub after: Option<usize>,
}

struct Label {
    place: usize,
    belief: BeliefStateF64,
    cost: f64,
    risk: f64,
    parent: Option<usize>,
    /// The actions that lead here from the parent.
    actions: Vec<Action>,
    /// `true` if a later label of the same place dominates this one.
    beaten: bool,
}

/// A queue entry, ordered by the smallest bound first.
#[derive(PartialEq)]
pub(super) struct Queued {
    pub bound: f64,
    pub label: usize,
    pub done: bool,
}

impl Eq for Queued {}

impl Ord for Queued {
    fn cmp(&self, other: &Self) -> cmp::Ordering {
        // The heap pops the greatest entry: the smallest bound, then a finished plan, then the oldest label.
        other
            .bound
            .total_cmp(&self.bound)
            .then(self.done.cmp(&other.done))
            .then(other.label.cmp(&self.label))
    }
}

impl PartialOrd for Queued {
    fn partial_cmp(&self, other: &Self) -> Option<cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl SearchProblem<'_> {
    /// Returns `true` if a task may begin with a belief.
    pub(super) fn fits(&self, table: &Table<'_>, belief: &BeliefStateF64) -> bool {
        needed(belief, self.wider).is_some_and(|set| decide(table, &set) == Decision::Inside)
    }

    pub(super) fn drive(&self, belief: &BeliefStateF64, to: usize) -> Option<BeliefStateF64> {
        let model = self.model.as_ref()?;
        let pose = |[x_m, y_m, yaw_rad]: [f64; 3]| Estimate { x_m, y_m, yaw_rad };
        let from = pose(belief.pose);
        let legs = [Leg::Straight(pose(self.places[to]))];
        Some(belief.driven(
            &from,
            &legs,
            model,
            self.epsilon,
            belief.spread,
            self.navigation.controller,
        ))
    }

    /// Returns `true` if a look needs none of the tags of the banned look.
    pub(super) fn allowed(&self, look: usize, banned: Option<usize>) -> bool {
        let tags = |look: usize| &self.library.looks[look].tags;
        banned.is_none_or(|lost| {
            look != lost && !tags(look).iter().any(|tag| tags(lost).contains(tag))
        })
    }

    /// Searches from a belief at a place. A look counts only if `rescue` returns `true`: a plan without its tags exists
    /// from there.
    pub fn search(
        &self,
        start: &BeliefStateF64,
        place: usize,
        risk: f64,
        banned: Option<usize>,
        rescue: &mut dyn FnMut(&BeliefStateF64, usize, f64, usize) -> bool,
    ) -> SearchOutcome {
        let to_go = self.to_go(banned);
        let goal = self.places.len() - 1;
        let mut labels: Vec<Label> = vec![];
        let mut queue = BinaryHeap::new();
        let mut at_place: Vec<Vec<usize>> = vec![vec![]; self.places.len()];
        let mut best: Option<(f64, usize)> = None;
        let mut miss: Option<NearMiss> = None;
        let mut note = |belief: &BeliefStateF64, after: Option<usize>| {
            let scale = scale(self.work, belief, self.wider);
            if miss.as_ref().is_none_or(|known| scale > known.scale) {
                miss = Some(NearMiss {
                    scale,
                    belief: belief.clone(),
                    after,
                });
            }
        };
        let add = |label: Label,
                   done: bool,
                   labels: &mut Vec<Label>,
                   queue: &mut BinaryHeap<Queued>,
                   at_place: &mut Vec<Vec<usize>>,
                   best: &mut Option<(f64, usize)>| {
            if label.risk > self.most_risk {
                return;
            }
            let ahead = if done { 0.0 } else { to_go[label.place] };
            let bound = label.cost + ahead;
            if !bound.is_finite() && label.parent.is_some() {
                return;
            }
            if !done {
                let beats = |a: &Label, b: &Label| {
                    if self.prunes_dominated {
                        beats(a, b)
                    } else {
                        a.cost <= b.cost && a.risk <= b.risk && a.belief == b.belief
                    }
                };
                let here = &mut at_place[label.place];
                if here.iter().any(|other| beats(&labels[*other], &label)) {
                    return;
                }
                here.retain(|other| {
                    let stays = !beats(&label, &labels[*other]);
                    labels[*other].beaten = !stays;
                    stays
                });
            }
            let number = labels.len();
            if done && best.is_none_or(|(cost, _)| label.cost < cost) {
                *best = Some((label.cost, number));
            }
            if !done {
                at_place[label.place].push(number);
            }
            queue.push(Queued {
                bound: if bound.is_finite() { bound } else { label.cost },
                label: number,
                done,
            });
            labels.push(label);
        };
        add(
            Label {
                place,
                belief: start.clone(),
                cost: 0.0,
                risk,
                parent: None,
                actions: vec![],
                beaten: false,
            },
            false,
            &mut labels,
            &mut queue,
            &mut at_place,
            &mut best,
        );
        let mut taken = 0;
        while let Some(Queued {
            bound,
            label: number,
            done,
        }) = queue.pop()
        {
            if done {
                return SearchOutcome::Optimal(answer(&labels, number));
            }
            if labels[number].beaten {
                continue;
            }
            taken += 1;
            if taken > self.limit {
                return match best {
                    Some((_, number)) => SearchOutcome::Feasible(answer(&labels, number), bound),
                    None => SearchOutcome::Open(miss),
                };
            }
            let (place, belief, cost, risk) = {
                let label = &labels[number];
                (label.place, label.belief.clone(), label.cost, label.risk)
            };
            let mut reach = |belief: BeliefStateF64,
                             place: usize,
                             cost: f64,
                             risk: f64,
                             actions: Vec<Action>,
                             done: bool| {
                let label = Label {
                    place,
                    belief,
                    cost,
                    risk,
                    parent: Some(number),
                    actions,
                    beaten: false,
                };
                add(
                    label,
                    done,
                    &mut labels,
                    &mut queue,
                    &mut at_place,
                    &mut best,
                );
            };
            // The work without another step.
            if self.fits(self.work, &belief) {
                reach(
                    belief.clone(),
                    place,
                    cost,
                    risk + belief.risk(),
                    vec![],
                    true,
                );
            } else if place == goal {
                note(&belief, None);
            }
            let first = number == 0;
            // From the start a robot may drive without a look.
            if first {
                for to in 0..self.places.len() {
                    if way(self.places[place], self.places[to]) > self.range {
                        continue;
                    }
                    let Some(there) = self.drive(&belief, to) else {
                        continue;
                    };
                    let cost = cost + self.costs.drive(place, to, self.places);
                    if self.fits(self.work, &there) {
                        let risk = risk + there.risk();
                        reach(there.clone(), to, cost, risk, vec![Action::Drive(to)], true);
                    } else if to == goal {
                        note(&there, None);
                    }
                    if to != place {
                        reach(there, to, cost, risk, vec![Action::Drive(to)], false);
                    }
                }
            }
            let mut looked: Vec<ErrorBound> = vec![];
            for look in self.seen[place].iter().copied() {
                // Another look with the same error leads to the same labels.
                let bound = self.library.looks[look].bound;
                if looked.contains(&bound)
                    || !self.allowed(look, banned)
                    || !self.fits(&self.tables[look], &belief)
                {
                    continue;
                }
                if !rescue(&belief, place, risk, look) {
                    continue;
                }
                looked.push(bound);
                let cost = cost + self.costs.look;
                let risk = risk + belief.risk() + (1.0 - bound.coverage);
                let after = belief.localized(bound.metres_radians());
                if self.fits(self.work, &after) {
                    reach(
                        after.clone(),
                        place,
                        cost,
                        risk,
                        vec![Action::Look(look)],
                        true,
                    );
                }
                let near = |to: &usize| way(self.places[place], self.places[*to]) <= self.range;
                let others = self.leads[place].iter().copied();
                let others = others.filter(|to| !self.ends.contains(to));
                let ends = self.ends.iter().copied().filter(near);
                for to in others.chain(ends) {
                    if !to_go[to].is_finite() {
                        continue;
                    }
                    let Some(there) = self.drive(&after, to) else {
                        continue;
                    };
                    let cost = cost + self.costs.drive(place, to, self.places);
                    let actions = vec![Action::Look(look), Action::Drive(to)];
                    if self.fits(self.work, &there) {
                        let risk = risk + there.risk();
                        reach(there.clone(), to, cost, risk, actions.clone(), true);
                    } else if to == goal {
                        note(&there, Some(look));
                    }
                    reach(there, to, cost, risk, actions, false);
                }
                // Look again from here, at another tag.
                reach(after, place, cost, risk, vec![Action::Look(look)], false);
            }
        }
        SearchOutcome::Infeasible(miss)
    }
}

/// Returns `true` if a label is at least as good as another label of its place in every respect.
fn beats(a: &Label, b: &Label) -> bool {
    let within = |a: [f64; 2], b: [f64; 2]| a[0] <= b[0] && a[1] <= b[1];
    a.cost <= b.cost
        && within(a.belief.certain, b.belief.certain)
        && within(a.belief.spread, b.belief.spread)
        && a.risk <= b.risk
        && a.belief.risk() <= b.belief.risk()
        && match (&a.belief.random, &b.belief.random) {
            (None, _) => true,
            (Some(a), Some(b)) => {
                let more = b.covariance - a.covariance;
                a.epsilon == b.epsilon && more.symmetric_eigen().eigenvalues.min() >= -1e-15
            }
            (Some(_), None) => false,
        }
}

fn answer(labels: &[Label], last: usize) -> Answer {
    let mut numbers = vec![last];
    while let Some(parent) = labels[numbers[numbers.len() - 1]].parent {
        numbers.push(parent);
    }
    numbers.reverse();
    let mut actions = vec![];
    let mut beliefs = vec![];
    for number in numbers {
        let label = &labels[number];
        actions.extend(label.actions.iter().copied());
        beliefs.push((label.place, label.belief.clone()));
    }
    Answer {
        actions,
        beliefs,
        cost: labels[last].cost,
    }
}

/// Returns a lower bound of the scale at which a belief's set still fits the work.
fn scale(work: &Table<'_>, belief: &BeliefStateF64, wider: f64) -> f64 {
    let Some(set) = needed(belief, wider) else {
        return 0.0;
    };
    let Examination { margin, .. } = examine(work, &set);
    f64::from(margin.q16()) / 65_536.0
}
