//! Tests of the inflation of covariances.

use crate::Share;
use crate::distribution::Random;
use posegate::confidence::radius_squared;
use posegate_learn::{
    InflationModel, InflationSettings, LearnError, Scored, ScoredEstimates, learn_inflation,
};

/// Returns estimates of a filter with correlated errors and too small covariances. The factor depends on the time
/// since the last fix: 2 below half a second, 6 from there on.
pub fn estimates(runs: u32, seed: u64) -> ScoredEstimates {
    let mut random = Random(seed);
    let mut rows = Vec::new();
    for run in 0..runs {
        let mut error = [0.0; 3].map(|_: f64| random.normal());
        for _ in 0..200 {
            const LASTING: f64 = 0.9;
            for e in &mut error {
                *e = LASTING * *e + (1.0 - LASTING * LASTING).sqrt() * random.normal();
            }
            let condition = random.even();
            let factor = if condition < 0.5 { 2.0 } else { 6.0 };
            let squared: f64 = error.iter().map(|e| e * e).sum();
            rows.push(Scored {
                squared_distance: factor * squared,
                condition,
                run,
                group: 0,
            });
        }
    }
    ScoredEstimates {
        rows,
        impossible: vec![7],
        without_truth: 0,
        condition: "since_fix_s".into(),
        timed: true,
        groups: Vec::new(),
        grouped_by: "robot",
        sha256: [0; 32],
    }
}

#[test]
fn inflated_sets_hold_under_each_condition() {
    for (epsilon, seed) in [(0.9, 1), (0.95, 2), (0.99, 3)] {
        let settings = InflationSettings {
            epsilon,
            ..InflationSettings::default()
        };
        let model = learn_inflation(&estimates(60, seed), &settings).unwrap();
        assert!(model.parts().len() >= 2, "{epsilon}");
        assert_eq!(model.counts(), (12_000, 1));
        // Correlated rows count as fewer independent rows.
        let overall = model.overall();
        assert!(overall.independent_rows * 2 < overall.rows, "{overall:?}");
        assert!(overall.low <= overall.needed && overall.needed <= overall.inflation);
        let r2 = radius_squared(epsilon).unwrap();
        let mut shares = vec![Share::default(); model.parts().len()];
        for row in estimates(60, seed + 50).rows {
            let Some(inflation) = model.inflation(Some(row.condition)) else {
                continue;
            };
            let part = model
                .parts()
                .iter()
                .position(|part| row.condition <= part.to)
                .unwrap();
            shares[part].count(row.squared_distance <= inflation * r2);
        }
        for (share, part) in shares.iter().zip(model.parts()) {
            assert!(share.holds(epsilon), "{epsilon}: {share:?} {part:?}");
            if part.to < 0.5 || part.from >= 0.5 {
                let factor = if part.to < 0.5 { 2.0 } else { 6.0 };
                let ratio = part.inflation / factor;
                assert!((0.9..1.5).contains(&ratio), "{epsilon}: {part:?}");
            }
        }
    }
}

#[test]
fn unknown_condition_has_the_largest_factor_or_is_refused() {
    let settings = InflationSettings {
        epsilon: 0.9,
        ..InflationSettings::default()
    };
    let model = learn_inflation(&estimates(60, 5), &settings).unwrap();
    let largest = model
        .parts()
        .iter()
        .fold(0.0f64, |most, part| most.max(part.inflation));
    assert_eq!(model.inflation(None), Some(largest));
    assert_eq!(model.inflation(Some(1.5)), None);
    assert_eq!(model.inflation(Some(f64::NAN)), None);
    let ends = model.parts()[0].to;
    let [a, b] = [0, 1].map(|k| model.parts()[k].inflation);
    assert_eq!(model.inflation(Some(ends)), Some(a.max(b)));
    // The covariance of a conservative filter is not reduced.
    let mut careful = estimates(60, 6);
    for row in &mut careful.rows {
        row.squared_distance *= 0.01;
    }
    let model = learn_inflation(&careful, &settings).unwrap();
    assert!(model.overall().needed < 0.2);
    assert_eq!(model.inflation(Some(0.7)), Some(1.0));
    // Estimates unrelated to the truth: no factor that a gate accepts.
    let mut wild = estimates(60, 6);
    for row in &mut wild.rows {
        row.squared_distance *= 1e4;
    }
    let model = learn_inflation(&wild, &settings).unwrap();
    assert_eq!(model.inflation(Some(0.7)), None);

    let mut few = estimates(1, 7);
    few.rows.truncate(40);
    assert!(matches!(
        learn_inflation(&few, &InflationSettings::default()),
        Err(LearnError::TooFew { .. })
    ));
    few.rows.clear();
    assert!(learn_inflation(&few, &settings).is_err());
}

/// Returns independent rows, each under one of a few conditions, with the factor that the condition needs.
fn under(conditions: &[(f64, f64, usize)], name: &str) -> ScoredEstimates {
    let mut random = Random(71);
    let mut rows = Vec::new();
    for (condition, factor, count) in conditions {
        for _ in 0..*count {
            let squared: f64 = (0..3).map(|_| random.normal().powi(2)).sum();
            rows.push(Scored {
                squared_distance: factor * squared,
                condition: *condition,
                run: rows.len() as u32,
                group: 0,
            });
        }
    }
    ScoredEstimates {
        rows,
        impossible: Vec::new(),
        without_truth: 0,
        condition: name.into(),
        timed: true,
        groups: Vec::new(),
        grouped_by: "robot",
        sha256: [0; 32],
    }
}

/// Each value of a condition with few values has its own factor.
#[test]
fn repeated_conditions_have_their_own_factors() {
    let settings = InflationSettings {
        epsilon: 0.9,
        ..InflationSettings::default()
    };
    for conditions in [
        &[(0.1, 1.0, 3000), (5.0, 9.0, 3000)][..],
        &[(0.1, 1.0, 5400), (5.0, 9.0, 600)],
        &[(0.1, 9.0, 600), (5.0, 1.0, 5400)],
        &[(0.0, 1.0, 2000), (1.0, 4.0, 2000), (2.0, 9.0, 2000)],
        &[
            (1.0, 1.0, 1500),
            (2.0, 3.0, 1500),
            (3.0, 9.0, 1500),
            (4.0, 27.0, 1500),
        ],
    ] {
        let model = learn_inflation(&under(conditions, "since_fix_s"), &settings).unwrap();
        for (condition, factor, _) in conditions {
            let ratio = model.inflation(Some(*condition)).unwrap() / factor;
            assert!(
                (0.95..1.35).contains(&ratio),
                "{condition}: {ratio} {conditions:?}"
            );
        }
    }
    // More values than parts.
    let many: Vec<(f64, f64, usize)> = (0..12)
        .map(|k| (f64::from(k), if k < 8 { 1.0 } else { 9.0 }, 1000))
        .collect();
    let model = learn_inflation(&under(&many, "since_fix_s"), &settings).unwrap();
    for k in 8..12 {
        assert!(model.inflation(Some(f64::from(k))).unwrap() > 8.0, "{k}");
    }
    // A filter whose covariance is constant except for its last digits.
    let digits: Vec<(f64, f64, usize)> = (0..20)
        .map(|k| (-20.0 + 1e-12 * f64::from(k), 4.0, 100))
        .collect();
    let model = learn_inflation(&under(&digits, "log_det"), &settings).unwrap();
    assert!(model.inflation(Some(-20.0 + 1e-9)).unwrap() > 3.8);
    assert_eq!(model.inflation(Some(-19.0)), None);
}

/// An error that persists for a thousand rows counts as one error.
#[test]
fn persistent_error_counts_as_one_error() {
    let mut estimates = under(&[(0.0, 1.0, 60_000)], "since_fix_s");
    for k in 0..estimates.rows.len() {
        estimates.rows[k].squared_distance = estimates.rows[k - k % 1000].squared_distance;
        estimates.rows[k].run = 0;
    }
    let settings = InflationSettings {
        epsilon: 0.8,
        ..InflationSettings::default()
    };
    let model = learn_inflation(&estimates, &settings).unwrap();
    assert!(
        model.overall().independent_rows < 150,
        "{:?}",
        model.overall()
    );
}

/// The smallest allowed number of rows contains, with the stated confidence, at least one error above the quantile.
#[test]
fn high_epsilon_needs_many_rows() {
    let settings = InflationSettings::default();
    let of = |count| learn_inflation(&under(&[(0.0, 1.0, count)], "since_fix_s"), &settings);
    assert!(matches!(
        of(120),
        Err(LearnError::TooFew { needed: 161, .. })
    ));
    assert!(of(4000).unwrap().overall().inflation >= 1.0);
}

#[test]
fn inconsistent_model_file_is_refused() {
    let settings = InflationSettings {
        epsilon: 0.9,
        ..InflationSettings::default()
    };
    let model = learn_inflation(&estimates(60, 8), &settings).unwrap();
    let text = model.write().unwrap();
    assert_eq!(InflationModel::parse(&text, "m.toml").unwrap(), model);
    for (from, to) in [
        ("posegate_model = 1", "posegate_model = 3"),
        ("epsilon = 0.9", "epsilon = 0.9\nmore = 1"),
        ("epsilon = 0.9\n", ""),
        ("\ninflation = ", "\ninflation = 0.5\nneeded_too = "),
        ("\nfrom = ", "\nfrom = 1"),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text);
        assert!(InflationModel::parse(&changed, "m.toml").is_err(), "{to}");
    }
}

/// Returns estimates of one drive, whose errors have this correlation from row to row, with a covariance that is 4 times too small.
fn drive(rows: usize, correlation: f64, seed: u64) -> ScoredEstimates {
    let mut random = Random(seed);
    let mut error = [0.0; 3].map(|_: f64| random.normal());
    let mut estimates = under(&[(0.0, 1.0, rows)], "since_fix_s");
    for row in &mut estimates.rows {
        for e in &mut error {
            *e = correlation * *e + (1.0 - correlation * correlation).sqrt() * random.normal();
        }
        row.squared_distance = 4.0 * error.iter().map(|e| e * e).sum::<f64>();
        row.run = 0;
    }
    estimates
}

/// The promise holds for dependent rows: of 80 recordings at most 20 % give a factor that is too small, or none is given.
#[test]
fn factors_of_dependent_rows_are_large_enough_or_refused() {
    for (correlation, rows) in [
        (0.9, 500),
        (0.98, 500),
        (0.99, 500),
        (0.99, 2000),
        (0.0, 500),
    ] {
        for epsilon in [0.8, 0.9, 0.95] {
            let settings = InflationSettings {
                epsilon,
                ..InflationSettings::default()
            };
            let factors = (0..80).map(|seed| {
                let estimates = drive(rows, correlation, 7919 * seed + 1);
                let model = learn_inflation(&estimates, &settings).ok()?;
                Some(model.overall().inflation)
            });
            let factors: Vec<f64> = factors.flatten().collect();
            let small = factors.iter().filter(|factor| **factor < 4.0).count();
            println!(
                "{correlation} {rows} {epsilon}: {small} of {} are too small",
                factors.len()
            );
            assert!(small <= 16, "{correlation} {epsilon}: {small}");
            // Independent rows are enough, and those with a short memory mostly.
            if correlation <= 0.9 {
                assert!(
                    factors.len() >= 60,
                    "{correlation} {epsilon}: {}",
                    factors.len()
                );
            }
        }
    }
}
