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
mod tests {
    use super::*;
    use crate::plan::belief::Random as Gaussian;
    use crate::plan::{Options, Plans};
    use crate::site::Site;
    use nalgebra::Matrix3;
    use posegate_testkit::counts;
    use posegate_testkit::planning_sites::{Drive, Random, hall};

    thread_local! {
        /// The numbers of answers compared: no plan, and a plan.
        static COMPARED: Cell<[usize; 2]> = const { Cell::new([0, 0]) };
    }

    /// Compares an answer with that of a search without earlier answers.
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

    /// Returns a belief with all lengths and angles of its error multiplied.
    fn larger(belief: &BeliefStateF64, times: f64) -> BeliefStateF64 {
        let mut larger = belief.clone();
        larger.certain = larger.certain.map(|extent| extent * times);
        if let Some(random) = &mut larger.random {
            random.covariance *= times * times;
        }
        larger
    }

    #[test]
    fn failure_is_implied_only_for_beliefs_that_contain_the_failed_one() {
        let bounded = BeliefStateF64 {
            pose: [1.0, 2.0, 0.5],
            spread: [0.1, 0.02],
            certain: [0.2, 0.03],
            doubt: 0.01,
            random: None,
        };
        let mut gaussian = bounded.clone();
        gaussian.random = Some(Gaussian {
            covariance: Matrix3::identity() * 0.01,
            epsilon: 0.99,
            radius_squared: 11.3449,
        });
        let vary = |of: &BeliefStateF64, change: &dyn Fn(&mut BeliefStateF64)| {
            let mut varied = of.clone();
            change(&mut varied);
            (varied, 0.02)
        };
        for belief in [&bounded, &gaussian] {
            let middle = (belief.clone(), 0.02);
            let more = [
                vary(belief, &|b| b.certain[0] += 0.1),
                vary(belief, &|b| b.certain[1] += 0.1),
                vary(belief, &|b| b.spread[0] += 0.1),
                vary(belief, &|b| b.spread[1] += 0.1),
                vary(belief, &|b| b.doubt += 0.1),
                (belief.clone(), 0.03),
            ];
            let wider = belief
                .random
                .is_some()
                .then(|| (larger(belief, 2.0), middle.1));
            for more in more.iter().chain(&wider) {
                assert!(failure_follows(&middle, (&more.0, more.1), true));
                assert!(!failure_follows(more, (&middle.0, middle.1), true));
                assert!(!failure_follows(&middle, (&more.0, more.1), false));
                assert!(!failure_follows(more, (&middle.0, middle.1), false));
            }
            for prunes_dominated in [false, true] {
                let equal = failure_follows(&middle, (belief, middle.1), prunes_dominated);
                assert!(equal, "an equal belief fails");
            }
        }
        // A normally distributed error is added to the bounded one.
        let (bounded, gaussian) = ((bounded, 0.02), (gaussian, 0.02));
        assert!(failure_follows(&bounded, (&gaussian.0, gaussian.1), true));
        assert!(!failure_follows(&gaussian, (&bounded.0, bounded.1), true));
    }

    #[test]
    fn answers_equal_those_of_independent_searches() {
        let options = Options {
            survive_a_lost_tag: true,
            ..Options::default()
        };
        COMPARED.set([0, 0]);
        let sites = if counts::is_deep() { 6 } else { 3 };
        for seed in 0..sites {
            let drive = [Drive::Bounded, Drive::Gaussian][usize::from(seed % 3 == 2)];
            // Tags near each other, so that there are alternatives.
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
        let least = if counts::is_deep() { [10, 5] } else { [1, 1] };
        assert!(
            none >= least[0] && some >= least[1],
            "compared {none} and {some}"
        );
    }
}
