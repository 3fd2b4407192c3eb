//! `learn check`: valid models are not contradicted, however often they are tested. Changes are found, dated and named.

use crate::distribution::{Distribution, Random, SQUARES};
use posegate_learn::{
    BoundsSettings, Change, CheckReport, CheckSettings, Detection, Detections, ErrorModel, Runs,
    acceptance, check_bounds, learn_bounds,
};

fn learnt(detections: &Detections, quantile: f64) -> ErrorModel {
    let settings = BoundsSettings {
        quantile,
        ..BoundsSettings::default()
    };
    learn_bounds(detections, &settings).unwrap()
}

fn checked(model: &ErrorModel, new: &Detections) -> CheckReport {
    check_bounds(model, new, &CheckSettings::default()).unwrap()
}

/// Models of 1,500 rows, each tested after every one of 10,000 new rows of the same distribution.
fn false_alarms(seeds: u64) {
    for quantile in [0.5, 0.9] {
        let alarms = (0..seeds).filter(|seed| {
            let model = learnt(&SQUARES.views(1500, 2 * seed + 1, |_| true), quantile);
            let new = SQUARES.views(10_000, 2 * seed + 2_000_000, |_| true);
            checked(&model, &new).after_rows.is_some()
        });
        let most = acceptance(seeds, 0.05, 0.99)[1];
        let count = alarms.count() as u64;
        assert!(count <= most, "{quantile}: {count} of {seeds}");
    }
}

#[test]
fn valid_model_is_not_contradicted() {
    false_alarms(10);
}

#[test]
#[ignore = "takes minutes: ./ci.sh deep"]
fn many_valid_models_are_not_contradicted() {
    false_alarms(200);
}

/// Approaches that differ as a whole contradict a model that holds, if their rows are taken as independent.
#[test]
fn rows_of_one_run_count_as_one_observation() {
    let (mut alarms, mut alone) = (0, 0);
    for seed in 0..10 {
        let model = learnt(&SQUARES.approaches(60, 0.9, 0.3, 50 + seed), 0.9);
        let mut new = SQUARES.approaches(60, 0.9, 0.3, 500 + seed);
        let found = checked(&model, &new);
        assert_eq!(found.bets, 60);
        alarms += u32::from(found.after_rows.is_some());
        new.runs = Runs::default();
        alone += u32::from(checked(&model, &new).after_rows.is_some());
    }
    // One approach that differs as a whole is no evidence that all differ.
    assert!(alarms <= 2 && alone >= 4, "{alarms} {alone}");
}

/// Errors of a camera whose calibration has drifted: focal length by 1.5 %, image centre by 8 pixels of 615.
fn drifted(row: &Detection, random: &mut Random) -> Option<[f64; 2]> {
    let [translation, yaw] = row.errors?;
    let angle = core::f64::consts::TAU * random.even();
    let away = 0.015 * row.at[0];
    let side = if random.even() < 0.5 { 1.0 } else { -1.0 };
    Some([
        (away + translation * angle.cos()).hypot(translation * angle.sin()),
        (8.0 / 615.0 + side * yaw).abs(),
    ])
}

#[test]
fn drifted_calibration_is_found_within_60_detections() {
    let model = learnt(&SQUARES.views(6000, 71, |_| true), 0.9);
    for seed in 0..20 {
        for good in [0, 1000] {
            let mut new = SQUARES.views(good + 200, 900 + seed, |_| true);
            let mut random = Random(seed);
            for row in &mut new.rows[good..] {
                row.errors = drifted(row, &mut random);
            }
            let found = checked(&model, &new);
            let after = found.after_rows.unwrap() as usize;
            let detections = new.rows[good.min(after)..after]
                .iter()
                .filter(|row| row.errors.is_some())
                .count();
            assert!(after > good && detections <= 60, "{seed}: {after}");
            assert_eq!(found.overall.looks_like, Some(Change::Calibration));
            let since = found.overall.yaw.since_row.unwrap() as usize;
            // A miss by chance just before the change belongs to it.
            let first = good.saturating_sub(30);
            assert!((first..good + 40).contains(&since), "{seed}: {since}");
        }
    }
}

#[test]
fn kind_of_change_is_reported() {
    let model = learnt(&SQUARES.views(6000, 72, |_| true), 0.9);
    let changed = |seed: u64, change: &dyn Fn([f64; 2], &mut Random) -> [f64; 2]| {
        let mut new = SQUARES.views(600, seed, |_| true);
        let mut random = Random(seed);
        for row in &mut new.rows {
            row.errors = row.errors.map(|errors| change(errors, &mut random));
        }
        checked(&model, &new)
    };
    for seed in 0..10 {
        let found = changed(seed, &|[t, yaw], _| [2.0 * t, 2.0 * yaw]);
        assert_eq!(found.overall.looks_like, Some(Change::Scale), "{seed}");
        let found = changed(seed, &|[t, yaw], random| {
            let angle = core::f64::consts::TAU * random.even();
            [(0.15 + t * angle.cos()).hypot(t * angle.sin()), yaw]
        });
        assert_eq!(found.overall.looks_like, Some(Change::Offset), "{seed}");
        assert_eq!(found.overall.yaw.after_rows, None);
        // Smaller errors do not contradict the model.
        let found = changed(seed, &|[t, yaw], _| [0.5 * t, 0.5 * yaw]);
        assert_eq!(found.after_rows, None);
    }
}

/// Errors that grow in one region only are found there.
#[test]
fn contradicted_region_is_reported() {
    let model = learnt(&SQUARES.views(12_000, 73, |_| true), 0.9);
    let target = model.region_deg([5.5, 10.0, 60.0]).unwrap();
    let mut new = SQUARES.views(4000, 74, |_| true);
    for row in &mut new.rows[2000..] {
        if model.region_deg(row.at) == Some(target) {
            row.errors = row.errors.map(|errors| errors.map(|error| 3.0 * error));
        }
    }
    let found = checked(&model, &new);
    assert!(found.after_rows.is_some_and(|after| after > 2000));
    for (number, region) in found.regions.iter().enumerate() {
        let after = region.translation.after_rows.or(region.yaw.after_rows);
        assert_eq!(after.is_some(), number == target, "{number}: {region:?}");
    }
    let region = &found.regions[target];
    let since = region.translation.since_row.unwrap();
    // One row in eight is in the region.
    assert!((1700..2300).contains(&since), "{since}");
    assert_eq!(region.looks_like, Some(Change::Scale));
}

#[test]
fn lost_detections_are_found() {
    let model = learnt(&SQUARES.views(6000, 75, |_| true), 0.9);
    let mut new = SQUARES.views(1000, 76, |_| true);
    let mut random = Random(77);
    for row in &mut new.rows {
        if random.even() < 0.3 {
            row.errors = None;
        }
    }
    let found = checked(&model, &new);
    let after = found.detection.after_rows.unwrap();
    assert!(after < 200 && found.after_rows.unwrap() <= after, "{after}");
    assert!(found.detection.expected > 0.9);
    // More detections than expected are no contradiction, and places without bounds are counted.
    let far = |at: [f64; 3]| Detection {
        at,
        errors: Some([9.0, 3.0]),
    };
    let mut new = SQUARES.views(100, 78, |at| Distribution::detected(at) > 0.99);
    new.rows.push(far([9.0, 10.0, 30.0]));
    let found = checked(&model, &new);
    assert_eq!((found.after_rows, found.without_bounds), (None, 1));
}

/// Of one video without names of runs, only frames 2 s apart are used.
#[test]
fn video_without_runs_is_thinned() {
    let model = learnt(&SQUARES.views(3000, 79, |_| true), 0.9);
    let mut new = SQUARES.views(1000, 80, |_| true);
    new.times = (0..1000).map(|k| 0.1 * f64::from(k)).collect();
    new.runs = Runs::of_times(&new.times);
    assert_eq!(checked(&model, &new).bets, 50);
    // Independent rows are taken in the order of time.
    let mut new = SQUARES.views(400, 81, |_| true);
    new.times = (0..400).map(|k| 10.0 * f64::from(400 - k)).collect();
    for row in &mut new.rows[..200] {
        row.errors = row.errors.map(|errors| errors.map(|error| 5.0 * error));
    }
    let found = checked(&model, &new);
    assert!(found.after_rows.is_some_and(|after| after > 200));
    let settings = CheckSettings { confidence: 1.0 };
    assert!(check_bounds(&model, &new, &settings).is_err());
}
