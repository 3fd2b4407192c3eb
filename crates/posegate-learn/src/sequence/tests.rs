use super::*;
use crate::clopper_pearson;
use crate::random::mixed;
use posegate_testkit::counts;

const ALPHA: f64 = 0.05;

/// Returns how many of the fleets have limits that exclude the true probability after some docking.
fn excluded(fleets: u64, truth: f64, limits: impl Fn(u64, u64) -> [f64; 2]) -> u64 {
    let limit = (truth * (1u64 << 53) as f64) as u64;
    let excludes = |fleet: &u64| {
        let mut successes = 0;
        (1..=600).any(|count| {
            successes += u64::from(mixed(mixed(*fleet) ^ count) >> 11 < limit);
            let [low, high] = limits(successes, count);
            !(low..=high).contains(&truth)
        })
    };
    (0..fleets).filter(excludes).count() as u64
}

/// The limits of the test are evaluated after every docking.
#[test]
fn truth_is_inside_at_all_evaluations_with_probability_1_minus_alpha() {
    for truth in counts::one_a_day(&[0.99, 0.9, 0.5]) {
        let count = excluded(400, truth, |s, n| confidence_sequence(s, n, ALPHA));
        // 5 % of 400, and three standard deviations more.
        assert!(count <= 33, "{truth}: {count} of 400");
        // Limits for one look fail.
        let once = excluded(100, truth, |s, n| clopper_pearson(s, n, 1.0 - ALPHA));
        assert!(once >= 12, "{truth}: {once} of 100");
    }
}

/// If the rate changes there is no single probability: the limits exclude the first rate, and then have no
/// meaning.
#[test]
fn first_rate_is_excluded_after_a_change() {
    let successes = |count: u64| count.min(300) + count.saturating_sub(300) / 2;
    let excludes = |count: u64| confidence_sequence(successes(count), count, ALPHA)[1] < 0.99;
    assert!(!(1..=300).any(excludes) && (301..=340).any(excludes));
}

#[test]
fn limits_solve_their_equation_and_are_tight() {
    assert_eq!(confidence_sequence(0, 0, ALPHA), [0.0, 1.0]);
    for (s, n) in [
        (0, 1),
        (1, 1),
        (100, 100),
        (960, 1000),
        (3, 8),
        (999_000, 1_000_000),
    ] {
        let [low, high] = confidence_sequence(s, n, ALPHA);
        let share = s as f64 / n as f64;
        assert!((low..=high).contains(&share), "{s} of {n}: {low} {high}");
        let [once_low, once_high] = clopper_pearson(s, n, 1.0 - ALPHA);
        assert!(
            low <= once_low + 1e-9 && once_high <= high + 1e-9,
            "{s} of {n}"
        );
        if n >= 100 {
            // The price of evaluating after each trial grows as the root of the logarithm of their number.
            assert!(high - low <= 2.6 * (once_high - once_low), "{s} of {n}");
        }
        // By hand: (2n choose n) / 4^n / p^n = 1 / alpha for n successes of n.
        if s == n {
            let choose: f64 = (1..=n)
                .map(|k| (2.0 * k as f64 - 1.0) / (2.0 * k as f64))
                .map(f64::ln)
                .sum();
            let expected = ((choose + ALPHA.ln()) / n as f64).exp();
            assert!(
                (low - expected).abs() < 1e-9,
                "{s} of {n}: {low} {expected}"
            );
        }
    }
}
