//! Inflation for a new robot, learnt from robots that differ as a whole.

use crate::distribution::Random;
use posegate::confidence::radius_squared;
use posegate_learn::{
    InflationModel, InflationSettings, LearnError, Scored, ScoredEstimates, acceptance,
    learn_inflation,
};

/// Returns the estimates of robots whose covariance is too small, each by its own factor: the square of a lognormal
/// number, 4 in the median. Consecutive errors are correlated.
fn fleet(robots: u32, rows: u32, spread: f64, seed: u64) -> ScoredEstimates {
    const LASTING: f64 = 0.8;
    let mut random = Random(seed);
    let mut estimates = ScoredEstimates {
        rows: Vec::new(),
        impossible: Vec::new(),
        without_truth: 0,
        condition: "log_det".into(),
        timed: true,
        groups: (0..robots)
            .map(|robot| format!("robot {robot:03}"))
            .collect(),
        grouped_by: "robot",
        sha256: [0; 32],
    };
    for robot in 0..robots {
        let scale = 2.0 * (spread * random.normal()).exp();
        let mut error = [0.0; 3].map(|_: f64| random.normal());
        for _ in 0..rows {
            for e in &mut error {
                *e = LASTING * *e + (1.0 - LASTING * LASTING).sqrt() * random.normal();
            }
            let squared: f64 = error.iter().map(|e| e * e).sum();
            estimates.rows.push(Scored {
                squared_distance: scale * scale * squared,
                condition: -20.0 + random.even(),
                run: robot,
                group: robot,
            });
        }
    }
    estimates
}

fn settings(epsilon: f64, confidence: f64) -> InflationSettings {
    InflationSettings {
        epsilon,
        confidence,
        ..InflationSettings::default()
    }
}

/// Returns the share of a robot's estimates whose inflated sets contain the truth.
fn coverage(model: &InflationModel, robot: &ScoredEstimates, epsilon: f64) -> f64 {
    let r2 = radius_squared(epsilon).unwrap();
    let held = robot.rows.iter().filter(|row| {
        let factor = model.inflation(Some(row.condition.clamp(-19.99, -19.01)));
        row.squared_distance <= factor.unwrap() * r2
    });
    held.count() as f64 / robot.rows.len() as f64
}

/// Returns how many of `fleets` fleets cover a new robot, whose own share of covered rows is the stated one.
fn covered(fleets: u64, robots: u32, spread: f64, settings: &InflationSettings) -> u64 {
    let is_covered = |fleet_seed: &u64| {
        let seed = 1000 * fleet_seed + u64::from(robots);
        let model = learn_inflation(&fleet(robots, 400, spread, seed), settings).unwrap();
        let new = fleet(1, 2000, spread, seed + 500);
        coverage(&model, &new, settings.epsilon) >= settings.epsilon
    };
    (0..fleets).filter(is_covered).count() as u64
}

/// A new robot is covered as stated in the stated share of the fleets; not if its fleet is taken as one population.
fn new_robots(fleets: u64) {
    for (robots, spread, epsilon, confidence) in
        [(9, 0.2, 0.9, 0.8), (5, 0.5, 0.95, 0.8), (20, 0.5, 0.9, 0.9)]
    {
        let settings = settings(epsilon, confidence);
        let count = covered(fleets, robots, spread, &settings);
        let [least, _] = acceptance(fleets, confidence, 0.99);
        println!(
            "{robots} robots, spread {spread}, confidence {confidence}: {count} of {fleets} covered"
        );
        assert!(count >= least, "{robots} {spread} {confidence}: {count}");
    }
    let together = InflationSettings {
        new_group: false,
        ..settings(0.9, 0.9)
    };
    let count = covered(fleets, 20, 0.2, &together);
    let [least, _] = acceptance(fleets, 0.9, 0.99);
    println!("20 robots as one population, confidence 0.9: {count} of {fleets} covered");
    assert!(count < least, "{count}");
}

#[test]
fn new_robot_is_covered() {
    new_robots(200);
}

#[test]
#[ignore = "takes minutes: ./ci.sh deep"]
fn new_robot_is_covered_in_many_fleets() {
    new_robots(1000);
}

/// Robots that do not differ cost little.
#[test]
fn equal_robots_need_hardly_larger_factors() {
    let fleet = fleet(20, 400, 0.0, 7);
    let model = learn_inflation(&fleet, &settings(0.9, 0.8)).unwrap();
    assert_eq!(model.new_group(), Some("robot"));
    let factor = model.overall().inflation;
    assert!((4.0..5.6).contains(&factor), "{factor}");
}

#[test]
fn each_group_is_reported() {
    let estimates = fleet(6, 400, 0.5, 8);
    let model = learn_inflation(&estimates, &settings(0.9, 0.8)).unwrap();
    let groups = model.groups();
    assert_eq!(groups.len(), 6);
    for (k, group) in groups.iter().enumerate() {
        let others = ScoredEstimates {
            rows: estimates
                .rows
                .iter()
                .filter(|row| row.group != k as u32)
                .copied()
                .collect(),
            ..estimates.clone()
        };
        assert_eq!((group.rows, others.rows.len()), (400, 2000));
        assert_eq!(group.name, format!("robot {k:03}"));
        // The robot that needs the largest factor is covered by itself, not by the others.
        assert!(group.coverage >= group.left_out_coverage.unwrap());
    }
    let covered = |share: f64| share >= 0.9;
    assert!(groups.iter().filter(|g| covered(g.coverage)).count() >= 5);
    let left_out = groups
        .iter()
        .filter(|g| !covered(g.left_out_coverage.unwrap()));
    assert!(left_out.count() >= 1);
    // With one robot fewer than needed among the others.
    let model = learn_inflation(&fleet(4, 400, 0.5, 9), &settings(0.9, 0.8)).unwrap();
    assert!(model.groups().iter().all(|g| g.left_out_coverage.is_none()));
    let text = model.write().unwrap();
    assert_eq!(InflationModel::parse(&text, "m.toml").unwrap(), model);
}

#[test]
fn too_few_groups_are_refused() {
    let three = fleet(3, 400, 0.5, 10);
    let error = learn_inflation(&three, &settings(0.9, 0.8)).unwrap_err();
    assert!(matches!(
        error,
        LearnError::TooFewGroups {
            found: 3,
            needed: 4,
            of: "robot",
            ..
        }
    ));
    assert!(learn_inflation(&three, &settings(0.9, 0.7)).is_ok());
    // Robots with too few rows for the share are no evidence.
    let short = fleet(4, 60, 0.5, 11);
    let error = learn_inflation(&short, &settings(0.99, 0.8)).unwrap_err();
    assert!(matches!(
        error,
        LearnError::TooFewGroups {
            found: 0,
            rows: 99,
            ..
        }
    ));
    let together = InflationSettings {
        new_group: false,
        ..settings(0.9, 0.8)
    };
    let model = learn_inflation(&three, &together).unwrap();
    assert_eq!((model.new_group(), model.groups().len()), (None, 3));
}
