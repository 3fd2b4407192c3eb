use super::*;
use crate::{InflationSettings, Scored, ScoredEstimates, learn_inflation};

/// A model whose conditions have these factors: each a time since the last fix, and a scale.
fn model(conditions: &[(f64, f64)], name: &str) -> InflationModel {
    let mut random = 1u64;
    let mut rows = Vec::new();
    for (condition, scale) in conditions {
        for _ in 0..600 {
            random = crate::random::mixed(random);
            let even = (random >> 11) as f64 / (1u64 << 53) as f64;
            rows.push(Scored {
                squared_distance: scale * 6.25 * even / 0.9,
                condition: *condition,
                run: rows.len() as u32,
                group: 0,
            });
        }
    }
    let estimates = ScoredEstimates {
        rows,
        impossible: Vec::new(),
        without_truth: 0,
        condition: name.into(),
        timed: true,
        groups: Vec::new(),
        grouped_by: "robot",
        sha256: [0; 32],
    };
    let settings = InflationSettings {
        epsilon: 0.9,
        ..InflationSettings::default()
    };
    learn_inflation(&estimates, &settings).unwrap()
}

/// The controller's factor at an age, from the words of the table.
fn at(by_age: &ByAge, age_s: f64) -> f64 {
    let age_ms = libm::ceil(age_s * 1000.0);
    let mut steps = by_age.steps();
    let step = steps.find(|(until_ms, _)| age_ms <= f64::from(*until_ms));
    step.map_or(f64::from(by_age.inflation.q16()) / 65_536.0, |step| step.1)
}

#[test]
fn factors_are_at_least_those_of_the_model() {
    for conditions in [
        &[(0.1, 1.0), (5.0, 9.0)][..],
        &[(0.1, 9.0), (5.0, 1.0)],
        &[(0.0, 1.0), (1.0, 4.0), (2.0, 3.0), (40.0, 20.0)],
        &[(0.01, 2.0), (0.02, 4.0), (0.03, 9.0)],
        &[(0.06, 1.0), (5.0, 9.0)],
        &[(0.06, 9.0), (5.0, 1.0)],
        &[(0.07, 1.0), (5.0, 9.0)],
        &[(2.0, 1.0), (20.0, 9.0), (60.0, 9.0)],
        &[
            (0.0, 1.0),
            (1.0, 2.0),
            (2.0, 3.0),
            (4.0, 4.5),
            (8.0, 9.0),
            (5000.0, 30.0),
        ],
        &[
            (0.5, 1.0),
            (1.0, 2.0),
            (2.0, 3.0),
            (4.0, 4.5),
            (8.0, 9.0),
            (5000.0, 30.0),
        ],
    ] {
        let model = model(conditions, "since_fix_s");
        let by_age = model.by_age().unwrap();
        let (first, last) = (conditions[0].0, conditions.last().unwrap().0);
        // The controller does not distinguish an age below one unit from one unit.
        let unit = UNIT_MS / 1000.0;
        assert_eq!(model.parts()[0].from, first);
        let ages = (0..2000)
            .map(|k| 0.005 * f64::from(k))
            .chain([64.0, 4194.0]);
        let borders = model.parts().iter().flat_map(|part| [part.from, part.to]);
        let mut before = (0.0, 0.0);
        for age in ages.filter(|age| *age <= last).chain(borders) {
            let used = at(&by_age, age);
            // Below the data, no row supports a smaller factor than the largest one.
            let learnt = match model.inflation(Some(age)) {
                Some(learnt) => learnt,
                None if first <= unit => at(&by_age, unit),
                None => at(&by_age, 1e6),
            };
            assert!(used >= learnt, "{age} s: {used} {learnt} {conditions:?}");
            assert!(age < before.0 || used >= before.1, "{age} s: falls");
            before = (age, used);
        }
        assert_eq!(at(&by_age, 1e6), at(&by_age, last));
    }
}

/// A model of these ages, with exactly these factors.
fn stated(ages: &[f64], factors: &[f64]) -> InflationModel {
    let conditions: Vec<(f64, f64)> = ages.iter().map(|age| (*age, 1.0)).collect();
    let text = model(&conditions, "since_fix_s").write().unwrap();
    let mut values = [factors[factors.len() - 1]]
        .into_iter()
        .chain(factors.iter().copied());
    let lines = text
        .lines()
        .map(|line| match line.starts_with("inflation = ") {
            true => format!("inflation = {:?}\n", values.next().unwrap()),
            false => format!("{line}\n"),
        });
    let text: String = lines.collect();
    assert_eq!(values.next(), None, "{text}");
    InflationModel::parse(&text, "stated.toml").unwrap()
}

#[test]
fn factors_too_large_for_a_step_are_left_out() {
    const MOST: f64 = 65_535.0 / 64.0;
    for (factors, steps) in [
        (&[1500.0, 3000.0][..], &[][..]),
        (&[2.0, 1500.0, 3000.0], &[2.0]),
        (&[2.0, MOST, 3000.0], &[2.0, MOST]),
        (&[2.0, MOST + 1e-6, 3000.0], &[2.0]),
        (&[MOST + 1e-6, 2.0, 4096.0], &[]),
    ] {
        let ages: Vec<f64> = (0..factors.len()).map(|k| k as f64).collect();
        let by_age = stated(&ages, factors).by_age();
        let by_age = by_age.unwrap_or_else(|| panic!("{factors:?}: no settings"));
        let found: Vec<f64> = by_age.steps().map(|step| step.1).collect();
        assert_eq!(found, steps, "{factors:?}");
        let largest = factors.iter().copied().fold(0.0, f64::max);
        assert_eq!(at(&by_age, 1e6), largest);
    }
}

#[test]
fn fresh_estimates_have_a_smaller_factor() {
    let by_age = model(&[(0.05, 1.0), (10.0, 9.0)], "since_fix_s").by_age();
    let by_age = by_age.unwrap();
    assert!(at(&by_age, 0.2) < 1.5 && at(&by_age, 9.0) > 8.0);
    // The size of a covariance is not an age.
    let by_size = model(&[(0.2, 1.0), (10.0, 9.0)], "log_det")
        .by_age()
        .unwrap();
    assert_eq!(by_size.aging, Aging::NONE);
    assert!(at(&by_size, 0.2) > 8.0);
}
