//! The search: labels of (cost, set, risk) at places, the cheapest first.
//!
//! A label says that the robot can be at a place with a belief. From it, every look whose success set holds what
//! the belief needs makes a new belief, from which every place within range is driven to. A label that another one
//! of the same place beats in cost, set and risk is dropped. What is dropped cannot be part of a cheaper plan: a
//! smaller set grows to a smaller one, and fits wherever a larger one does.
//!
//! (Facets are asked at several levers: a smaller set may meet one that a larger one did not. Where nothing is found, a
//! shorter search drops those labels alone that are alike.)
//!
//! Backward from the work task, places from which not even a robot that knew its pose before the look could arrive
//! well enough are dropped, and the others get their distance to go: a bound from below, with which the search is
//! best first. The first plan that it takes from its queue is the cheapest of the library; with the queue empty
//! there is none.

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

/// What a search is asked.
pub(super) struct SearchProblem<'a> {
    pub library: &'a Library,
    pub tables: &'a [Table<'a>],
    /// Places: the library's, and those of this question. The goal is the last one.
    pub places: &'a [[f64; 3]],
    pub work: &'a Table<'a>,
    pub navigation: &'a Navigation,
    pub model: Option<DriveModel>,
    pub epsilon: f64,
    pub costs: &'a Costs,
    pub range: f64,
    pub most_risk: f64,
    /// By how much the sets of beliefs are taken wider than they are.
    pub wider: f64,
    /// The places that the work may be done from by a robot that knew its pose: the goal is one.
    pub ends: &'a [usize],
    /// The looks that each place's pose is in.
    pub seen: &'a [Vec<usize>],
    /// The places at which a robot can arrive from each place well enough to look there, at best.
    pub leads: &'a [Vec<usize>],
    /// The same backwards.
    pub predecessors: &'a [Vec<usize>],
    /// Labels that may be taken from the queue.
    pub limit: usize,
    /// Whether labels that are beaten are dropped; else those alone that are alike.
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

/// The answer.
#[derive(Clone, Debug)]
pub(super) struct Answer {
    pub actions: Vec<Action>,
    /// The belief before each action, and before the work.
    pub beliefs: Vec<(usize, BeliefStateF64)>,
    pub cost: f64,
}

/// How a search ended.
#[derive(Clone, Debug)]
pub(super) enum SearchOutcome {
    /// The cheapest plan.
    Optimal(Answer),
    /// The best that was found within the limit, and a bound on the cheapest.
    Feasible(Answer, f64),
    /// There is none; the nearest miss.
    Infeasible(Option<NearMiss>),
    /// The limit was reached without one.
    Open(Option<NearMiss>),
}

/// An arrival at the work task that does not fit.
#[derive(Clone, Debug)]
pub(super) struct NearMiss {
    pub scale: f64,
    pub belief: BeliefStateF64,
    /// The look before it.
    pub after: Option<usize>,
}

struct Label {
    place: usize,
    belief: BeliefStateF64,
    cost: f64,
    risk: f64,
    parent: Option<usize>,
    /// What led here from the parent.
    actions: Vec<Action>,
    /// Beaten by a later one of its place.
    beaten: bool,
}

/// What waits to be looked at, the smallest bound first.
#[derive(PartialEq)]
pub(super) struct Queued {
    pub bound: f64,
    pub label: usize,
    pub done: bool,
}

impl Eq for Queued {}

impl Ord for Queued {
    fn cmp(&self, other: &Self) -> cmp::Ordering {
        // The heap's greatest is the smallest bound; then what was made first.
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
    /// Whether a look (or, without one, the work) may begin with a belief.
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

    /// Whether a look needs no tag of the one that is banned.
    pub(super) fn allowed(&self, look: usize, banned: Option<usize>) -> bool {
        let tags = |look: usize| &self.library.looks[look].tags;
        banned.is_none_or(|lost| {
            look != lost && !tags(look).iter().any(|tag| tags(lost).contains(tag))
        })
    }

    /// Searches from a belief at a place. With `rescue`, a look counts only where a plan without its tag exists
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
            // The work as it is.
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
                // Looking again from here, at another tag.
                reach(after, place, cost, risk, vec![Action::Look(look)], false);
            }
        }
        SearchOutcome::Infeasible(miss)
    }
}

/// Whether a label is at least as good as another one of its place in every way.
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

/// How much larger than a belief's set its work may be: a lower bound of the scale.
fn scale(work: &Table<'_>, belief: &BeliefStateF64, wider: f64) -> f64 {
    let Some(set) = needed(belief, wider) else {
        return 0.0;
    };
    let Examination { margin, .. } = examine(work, &set);
    f64::from(margin.q16()) / 65_536.0
}
