//! Plans without a lost tag: whether one exists from a place and a belief, and the cheapest one.
//!
//! A search for a plan that survives a lost tag asks for an answer before every look that it tries. Most answers
//! follow from earlier ones: the steps of an earlier plan are tried again, and a plan that is impossible with less
//! uncertainty is impossible with more.

use core::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;

use super::BeliefStateF64;
use super::problem::SearchProblem;
use super::search::{Action, Answer, DeadEnds, SearchGoal, SearchOutcome, is_within};

/// A belief at a place, and the risk so far.
type Begin<'b> = (&'b BeliefStateF64, usize, f64);

/// A belief, and the risk so far.
type KnownStart = (BeliefStateF64, f64);

/// The answers of one problem, by place.
#[derive(Default)]
pub(super) struct Rescues {
    /// The actions of plans.
    plans: RefCell<BTreeMap<usize, Vec<Vec<Action>>>>,
    /// The beliefs and risks from which there is no plan without a look.
    none: RefCell<BTreeMap<(usize, usize), Vec<KnownStart>>>,
    /// Dead ends without a look.
    dead: RefCell<BTreeMap<usize, Rc<RefCell<DeadEnds>>>>,
    unsure: Cell<bool>,
}

impl Rescues {
    /// Returns `true` if a search ended at its limit without an answer.
    pub fn is_unsure(&self) -> bool {
        self.unsure.get()
    }

    /// Returns `true` if there is a plan without a look and without other looks at its tags.
    pub fn exists(&self, problem: &SearchProblem<'_>, begin: Begin<'_>, look: usize) -> bool {
        let answer = self.answer(problem, begin, look);
        #[cfg(test)]
        tests::compare(problem, begin, look, answer);
        answer
    }

    fn answer(&self, problem: &SearchProblem<'_>, begin: Begin<'_>, look: usize) -> bool {
        let (belief, place, risk) = begin;
        let again = |actions: &Vec<Action>| problem.succeeds(begin, look, actions);
        if let Some(known) = self.plans.borrow().get(&place)
            && known.iter().any(again)
        {
            return true;
        }
        let implied =
            |failed: &KnownStart| failure_follows(failed, (belief, risk), problem.prunes_dominated);
        if let Some(known) = self.none.borrow().get(&(place, look))
            && known.iter().any(implied)
        {
            return false;
        }
        let dead = self.dead.borrow_mut().entry(look).or_default().clone();
        if let Some(answer) = self.search(problem, begin, look, SearchGoal::Any(&dead)) {
            let mut plans = self.plans.borrow_mut();
            plans.entry(place).or_default().push(answer.actions);
            return true;
        }
        let mut none = self.none.borrow_mut();
        let none = none.entry((place, look)).or_default();
        none.push((belief.clone(), risk));
        false
    }

    /// Returns the cheapest plan without a look and without other looks at its tags.
    pub fn cheapest(
        &self,
        problem: &SearchProblem<'_>,
        begin: Begin<'_>,
        look: usize,
    ) -> Option<Answer> {
        self.search(problem, begin, look, SearchGoal::Cheapest)
    }

    fn search(
        &self,
        problem: &SearchProblem<'_>,
        begin: Begin<'_>,
        look: usize,
        wanted: SearchGoal<'_>,
    ) -> Option<Answer> {
        match problem.search(begin, Some(look), wanted, &mut |_, _, _, _| true) {
            SearchOutcome::Optimal(answer) | SearchOutcome::Feasible(answer, _) => Some(answer),
            SearchOutcome::Infeasible(_) => None,
            SearchOutcome::Open(_) => {
                self.unsure.set(true);
                None
            }
        }
    }
}

/// Returns `true` if an earlier failure at the same place implies that there is no plan from a belief and a risk: the
/// failed belief and risk are at least as good in every respect. A failure implies nothing for beliefs with less
/// uncertainty. Without pruning of dominated labels, a failure implies only that of an equal belief: only the pruning
/// search may assume that less uncertainty is never worse.
fn failure_follows(
    (failed, at_risk): &KnownStart,
    (belief, risk): (&BeliefStateF64, f64),
    prunes_dominated: bool,
) -> bool {
    if prunes_dominated {
        *at_risk <= risk && is_within(failed, belief)
    } else {
        *at_risk == risk && failed == belief
    }
}

impl SearchProblem<'_> {
    /// Returns `true` if the actions of a plan lead to the work from another start, without the banned look.
    fn succeeds(
        &self,
        (belief, place, risk): Begin<'_>,
        banned: usize,
        actions: &[Action],
    ) -> bool {
        let (mut belief, mut place, mut risk) = (belief.clone(), place, risk);
        for action in actions {
            match *action {
                Action::Look(look) => {
                    if !self.allowed(look, Some(banned))
                        || !self.seen[place].contains(&look)
                        || !self.fits(&self.tables[look], &belief)
                    {
                        return false;
                    }
                    let bound = self.library.looks[look].bound;
                    risk += belief.risk() + (1.0 - bound.coverage);
                    belief = belief.localized(bound.metres_radians());
                }
                Action::Drive(to) => {
                    let Some(there) = self.drive(&belief, to) else {
                        return false;
                    };
                    (belief, place) = (there, to);
                }
            }
        }
        risk += belief.risk();
        risk <= self.most_risk && self.fits(self.work, &belief)
    }
}

#[cfg(test)]
mod tests;
