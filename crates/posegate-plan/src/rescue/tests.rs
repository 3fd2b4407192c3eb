use super::*;
use crate::belief::Random as Gaussian;
use crate::{Options, Plans};
use nalgebra::Matrix3;
use posegate_site::Site;
use posegate_testkit::counts;
use posegate_testkit::planning_sites::{Drive, Random, hall};

thread_local! {
    /// The numbers of answers compared: no plan, and a plan.
    static COMPARED: Cell<[usize; 2]> = const { Cell::new([0, 0]) };
}

/// Compares an answer with that of a search without earlier answers.
pub(super) fn compare(problem: &SearchProblem<'_>, begin: Begin<'_>, look: usize, answer: bool) {
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
