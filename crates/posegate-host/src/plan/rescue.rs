//! Plans without a lost tag: does one exist from a place and a belief, and which is the cheapest?
//!
//! A search for a plan that survives a lost tag asks this before every look that it tries. Most answers follow from
//! earlier ones: an earlier plan is taken again step by step, and what is impossible with less uncertainty is impossible
//! with more.

use core::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;

use super::BeliefStateF64;
use super::search::{Action, Answer, DeadEnds, SearchOutcome, SearchProblem, Wanted, is_within};

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
    /// What led nowhere without a look.
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
        // Only the search that drops dominated labels may assume that less uncertainty is never worse.
        let implied = |(known, least): &KnownStart| {
            if problem.prunes_dominated {
                *least <= risk && is_within(known, belief)
            } else {
                *least == risk && known == belief
            }
        };
        if let Some(known) = self.none.borrow().get(&(place, look))
            && known.iter().any(implied)
        {
            return false;
        }
        let dead = self.dead.borrow_mut().entry(look).or_default().clone();
        if let Some(answer) = self.search(problem, begin, look, Wanted::Any(&dead)) {
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
        self.search(problem, begin, look, Wanted::Cheapest)
    }

    fn search(
        &self,
        problem: &SearchProblem<'_>,
        begin: Begin<'_>,
        look: usize,
        wanted: Wanted<'_>,
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

impl SearchProblem<'_> {
    /// Returns `true` if the actions of a plan lead to the work from another beginning, without the banned look.
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
mod tests {
    use super::*;
    use crate::plan::{Options, Plans};
    use crate::site::Site;
    use posegate_testkit::planning_sites::{Drive, Random, hall};

    thread_local! {
        /// The numbers of answers compared: no plan, and a plan.
        static COMPARED: Cell<[usize; 2]> = const { Cell::new([0, 0]) };
    }

    /// Compares an answer with a search that knows of no earlier one.
    pub(super) fn compare(
        problem: &SearchProblem<'_>,
        begin: Begin<'_>,
        look: usize,
        answer: bool,
    ) {
        let alone = Rescues::default().cheapest(problem, begin, look).is_some();
        assert_eq!(answer, alone, "without look {look} at place {}", begin.1);
        let mut counts = COMPARED.get();
        counts[usize::from(answer)] += 1;
        COMPARED.set(counts);
    }

    #[test]
    fn answers_equal_those_of_searches_on_their_own() {
        let options = Options {
            survive_a_lost_tag: true,
            ..Options::default()
        };
        COMPARED.set([0, 0]);
        for seed in 0..6 {
            let drive = [Drive::Bounded, Drive::Gaussian][usize::from(seed % 3 == 2)];
            // Tags near each other, so that there are other ways.
            let text = hall(&mut Random(seed), 3 + (seed % 4) as usize, 2, drive);
            let text = text.replace("d_max = 5.5", "d_max = 9.0");
            let text = text.replace("psi_max_deg = 50.0", "psi_max_deg = 75.0");
            let site = Site::parse(&text, "hall.toml").expect("a site");
            let mut plans = Plans::of(&site);
            for dock in 0..2 {
                let (from, task) = (format!("to{dock}"), format!("dock{dock}"));
                plans.plan(&from, &task, &options).expect("an answer");
            }
        }
        let [none, some] = COMPARED.get();
        assert!(none >= 10 && some >= 5, "compared {none} and {some}");
    }
}
