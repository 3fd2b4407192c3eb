//! Label-setting search: labels of (cost, set, risk) at places, the cheapest first.
//!
//! A label means that the robot can be at a place with a belief. Each look whose success set contains the belief's
//! set gives a new belief; from there the robot can drive to every place within range. A label is dropped if another
//! label of the same place is at least as good in cost, set and risk. A dropped label cannot be part of a cheaper
//! plan: a smaller set stays smaller after each step, and fits wherever a larger set does.
//!
//! (The facet test uses several levers: a smaller set may fail it although a larger set passes. If no plan is found,
//! a shorter search drops only equal labels.)
//!
//! A backward pass from the work task drops places from which even a robot with an exactly known pose before the look
//! could not arrive well enough. The other places get a lower bound of the cost to go, which makes the search
//! best-first. The first plan taken from the queue is the cheapest of the library. If the queue becomes empty, there
//! is no plan.

use core::cell::RefCell;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::Arc;

use super::BeliefStateF64;
use super::library::needed;
use super::problem::SearchProblem;
use super::queue::Queued;
use posegate::contain::decide_with_sharp_margin;
use posegate::table::Table;
use posegate_replay::factor;
use posegate_site::ErrorBound;

/// The goal of a search.
#[derive(Clone, Copy, Debug)]
pub(super) enum SearchGoal<'d> {
    /// The cheapest plan.
    Cheapest,
    /// Any plan, at any cost: the search ends with the first one. It adds no label that an earlier search with the
    /// same banned look showed to be a dead end.
    Any(&'d RefCell<DeadEnds>),
}

/// Labels from which there is no plan, by place. No drive without a look follows them.
#[derive(Clone, Debug, Default)]
pub(super) struct DeadEnds {
    places: BTreeMap<usize, Vec<(BeliefStateF64, f64)>>,
}

impl DeadEnds {
    /// Returns `true` if a label with less uncertainty and less risk is a dead end.
    fn imply(&self, label: &Label) -> bool {
        self.places.get(&label.place).is_some_and(|known| {
            let mut known = known.iter();
            known.any(|(belief, risk)| *risk <= label.risk && is_within(belief, &label.belief))
        })
    }

    fn add(&mut self, label: &Label) {
        if !self.imply(label) {
            let known = self.places.entry(label.place).or_default();
            known.retain(|(belief, risk)| {
                !(label.risk <= *risk && is_within(&label.belief, belief))
            });
            known.push((label.belief.clone(), label.risk));
        }
    }
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

/// The end of a search.
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

#[derive(Clone)]
struct Label {
    place: usize,
    belief: BeliefStateF64,
    cost: f64,
    risk: f64,
    parent: Option<usize>,
    /// The actions from the parent to this label.
    actions: Vec<Action>,
    /// `true` if a later label of the same place dominates this one.
    is_dominated: bool,
}

impl SearchProblem<'_> {
    /// Searches from a belief at a place. A look counts only if `rescue` returns `true`, that is, if a plan without
    /// its tags exists from there.
    pub fn search(
        &self,
        (start, place, risk): (&BeliefStateF64, usize, f64),
        banned: Option<usize>,
        goal: SearchGoal<'_>,
        rescue: &mut Rescue<'_>,
    ) -> SearchOutcome {
        let mut search = Search::new(self, banned, goal);
        search.add(
            Label {
                place,
                belief: start.clone(),
                cost: 0.0,
                risk,
                parent: None,
                actions: vec![],
                is_dominated: false,
            },
            false,
        );
        search.run(rescue)
    }
}

/// Returns `true` if a plan exists without the tags of a look. Arguments: the belief and the place before the look,
/// the risk so far, the look's number.
pub(super) type Rescue<'r> = dyn FnMut(&BeliefStateF64, usize, f64, usize) -> bool + 'r;

/// The number of labels between two checks of the stop signal.
const STOP_EVERY: usize = 16;

/// A running search: all labels, and the queue of those that may be extended.
struct Search<'s, 'p, 'd> {
    problem: &'s SearchProblem<'p>,
    /// The look that is not allowed, nor any other look at its tags.
    banned: Option<usize>,
    goal: SearchGoal<'d>,
    /// A lower bound of the cost from each place to the work.
    to_go: Arc<Vec<f64>>,
    labels: Vec<Label>,
    queue: BinaryHeap<Queued>,
    /// The labels of each place that no other label dominates.
    at_place: Vec<Vec<usize>>,
    /// The cheapest finished plan: its cost and its last label.
    best: Option<(f64, usize)>,
    miss: Option<NearMiss>,
}

impl<'s, 'p, 'd> Search<'s, 'p, 'd> {
    fn new(problem: &'s SearchProblem<'p>, banned: Option<usize>, goal: SearchGoal<'d>) -> Self {
        Self {
            problem,
            banned,
            goal,
            to_go: problem.horizons.of(banned, || problem.to_go(banned)),
            labels: vec![],
            queue: BinaryHeap::new(),
            at_place: vec![vec![]; problem.places.len()],
            best: None,
            miss: None,
        }
    }

    /// Extends the labels in the order of their bounds, until a finished plan is the first, or the limit is reached.
    fn run(mut self, rescue: &mut Rescue<'_>) -> SearchOutcome {
        let mut taken = 0;
        while let Some(Queued { bound, label, done }) = self.queue.pop() {
            if done {
                return SearchOutcome::Optimal(answer(&self.labels, label));
            }
            if self.labels[label].is_dominated {
                continue;
            }
            taken += 1;
            let is_over = taken % STOP_EVERY == 0 && self.problem.stop.is_set();
            if taken > self.problem.limit || is_over {
                return match self.best {
                    Some((_, last)) => SearchOutcome::Feasible(answer(&self.labels, last), bound),
                    None => SearchOutcome::Open(self.miss),
                };
            }
            self.extend(label, rescue);
            if let (SearchGoal::Any(_), Some((_, last))) = (self.goal, self.best) {
                return SearchOutcome::Feasible(answer(&self.labels, last), bound);
            }
        }
        if let (SearchGoal::Any(dead), true) = (self.goal, self.problem.prunes_dominated) {
            let mut dead = dead.borrow_mut();
            // From the first label the robot may also drive without a look, so it is better than others there.
            let others = self.at_place.iter().flatten().filter(|number| **number > 0);
            others.for_each(|number| dead.add(&self.labels[*number]));
        }
        SearchOutcome::Infeasible(self.miss)
    }

    /// Adds every label that follows a label.
    fn extend(&mut self, number: usize, rescue: &mut Rescue<'_>) {
        let from = Label {
            parent: Some(number),
            actions: vec![],
            ..self.labels[number].clone()
        };
        self.arrive(&from, None);
        // From the start a robot may drive without a look.
        if number == 0 {
            self.drive_first(&from);
        }
        self.look(&from, rescue);
    }

    /// Adds the drives from the start to every place within range.
    fn drive_first(&mut self, from: &Label) {
        for to in 0..self.problem.places.len() {
            if !self.problem.is_near(from.place, to) {
                continue;
            }
            let Some(there) = self.driven(from, &from.belief, to) else {
                continue;
            };
            self.arrive(&there, None);
            if to != from.place {
                self.add(there, false);
            }
        }
    }

    /// Adds the looks from a label, each alone and with a drive to every successor.
    fn look(&mut self, from: &Label, rescue: &mut Rescue<'_>) {
        let problem = self.problem;
        let mut looked: Vec<ErrorBound> = vec![];
        for look in problem.seen[from.place].iter().copied() {
            // Another look with the same error successors to the same labels.
            let bound = problem.library.looks[look].bound;
            if looked.contains(&bound)
                || !problem.allowed(look, self.banned)
                || !problem.fits(&problem.tables[look], &from.belief)
                || !rescue(&from.belief, from.place, from.risk, look)
            {
                continue;
            }
            looked.push(bound);
            let after = Label {
                belief: from.belief.localized(bound.metres_radians()),
                cost: from.cost + problem.costs.look,
                risk: from.risk + from.belief.risk() + (1.0 - bound.coverage),
                actions: vec![Action::Look(look)],
                ..from.clone()
            };
            self.work(&after);
            let others = problem.successors[from.place].iter().copied();
            let others = others.filter(|to| !problem.ends.contains(to));
            let ends = problem.ends.iter().copied();
            let ends = ends.filter(|to| problem.is_near(from.place, *to));
            for to in others.chain(ends) {
                if !self.to_go[to].is_finite() {
                    continue;
                }
                let Some(there) = self.driven(&after, &after.belief, to) else {
                    continue;
                };
                self.arrive(&there, Some(look));
                self.add(there, false);
            }
            // Look again from here, at another tag.
            self.add(after, false);
        }
    }

    /// Returns the label after a drive from a label; `None` if the site has no drive model.
    fn driven(&self, from: &Label, belief: &BeliefStateF64, to: usize) -> Option<Label> {
        let mut actions = from.actions.clone();
        actions.push(Action::Drive(to));
        Some(Label {
            place: to,
            belief: self.problem.drive(belief, to)?,
            cost: from.cost
                + self
                    .problem
                    .costs
                    .drive(from.place, to, self.problem.places),
            actions,
            ..from.clone()
        })
    }

    /// Adds the end of the plan if the work fits a label, and returns `true`.
    fn work(&mut self, label: &Label) -> bool {
        let fits = self.problem.fits(self.problem.work, &label.belief);
        if fits {
            let done = Label {
                risk: label.risk + label.belief.risk(),
                ..label.clone()
            };
            self.add(done, true);
        }
        fits
    }

    /// Adds the end of the plan if the work fits a label. If it does not fit at the goal, records a near miss.
    /// `after` is the look before.
    fn arrive(&mut self, label: &Label, after: Option<usize>) {
        let goal = self.problem.places.len() - 1;
        if !self.work(label) && label.place == goal {
            self.note(&label.belief, after);
        }
    }

    /// Keeps the arrival that is nearest to fitting the work.
    fn note(&mut self, belief: &BeliefStateF64, after: Option<usize>) {
        let scale = scale(self.problem.work, belief, self.problem.wider);
        if self.miss.as_ref().is_none_or(|known| scale > known.scale) {
            self.miss = Some(NearMiss {
                scale,
                belief: belief.clone(),
                after,
            });
        }
    }

    /// Adds a label, unless its risk is too high, it is a dead end, or another label of its place is at least as
    /// good. `done` labels are finished plans.
    fn add(&mut self, label: Label, done: bool) {
        if label.risk > self.problem.most_risk {
            return;
        }
        let ahead = if done { 0.0 } else { self.to_go[label.place] };
        let bound = label.cost + ahead;
        if !bound.is_finite() && label.parent.is_some() {
            return;
        }
        let number = self.labels.len();
        if done {
            if self.best.is_none_or(|(cost, _)| label.cost < cost) {
                self.best = Some((label.cost, number));
            }
        } else {
            let is_dead = match self.goal {
                SearchGoal::Any(dead)
                    if self.problem.prunes_dominated && label.parent.is_some() =>
                {
                    dead.borrow().imply(&label)
                }
                _ => false,
            };
            if is_dead || self.is_dominated_by_another(&label) {
                return;
            }
            self.drop_dominated(&label);
            self.at_place[label.place].push(number);
        }
        self.queue.push(Queued {
            bound: if bound.is_finite() { bound } else { label.cost },
            label: number,
            done,
        });
        self.labels.push(label);
    }

    /// Returns `true` if a label of the same place dominates this one.
    fn is_dominated_by_another(&self, label: &Label) -> bool {
        let mut here = self.at_place[label.place].iter();
        here.any(|other| self.dominates(&self.labels[*other], label))
    }

    /// Drops the labels of its place that a label dominates.
    fn drop_dominated(&mut self, label: &Label) {
        let here = core::mem::take(&mut self.at_place[label.place]);
        let (is_dominated, stays) = here
            .into_iter()
            .partition(|other| self.dominates(label, &self.labels[*other]));
        self.at_place[label.place] = stays;
        let is_dominated: Vec<usize> = is_dominated;
        for other in is_dominated {
            self.labels[other].is_dominated = true;
        }
    }

    /// Returns `true` if a label dominates another label of its place.
    fn dominates(&self, a: &Label, b: &Label) -> bool {
        let costs_no_more = match self.goal {
            SearchGoal::Cheapest => a.cost <= b.cost,
            SearchGoal::Any(_) => true,
        };
        costs_no_more
            && a.risk <= b.risk
            && if self.problem.prunes_dominated {
                is_within(&a.belief, &b.belief)
            } else {
                a.belief == b.belief
            }
    }
}

/// Returns `true` if a belief is at least as good as another belief at the same place in every respect.
pub(super) fn is_within(a: &BeliefStateF64, b: &BeliefStateF64) -> bool {
    let within = |a: [f64; 2], b: [f64; 2]| a[0] <= b[0] && a[1] <= b[1];
    within(a.certain, b.certain)
        && within(a.spread, b.spread)
        && a.risk() <= b.risk()
        && match (&a.random, &b.random) {
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
    factor(decide_with_sharp_margin(work, &set).1)
}
