//! Bounds from rows that depend on each other: approaches whose successive errors are similar.

use crate::distribution::{Distribution, SQUARES};
use posegate_host::learn::{
    BoundsSettings, Detection, Detections, ErrorModel, LearnError, RunSource, Runs, learn_bounds,
};
use std::sync::OnceLock;

/// The places of many approaches, at which the share of errors within a bound is computed exactly.
fn places() -> &'static [Detection] {
    static PLACES: OnceLock<Vec<Detection>> = OnceLock::new();
    PLACES.get_or_init(|| SQUARES.approaches(400, 0.0, 0.0, 1001).rows)
}

/// Returns the share of bounds that hold for less than `q` of their detections, and the number of bounds. Counts both
/// bounds of each region of models of 60 approaches.
fn low(models: impl Iterator<Item = ErrorModel>, scale: f64, q: f64) -> (f64, u32) {
    let (mut low, mut count) = (0, 0);
    for model in models {
        let mut shares = vec![[0.0; 3]; model.regions().count()];
        for place in places() {
            let Some(bounds) = model.bounds_deg(place.at) else {
                continue;
            };
            let region = model.region_deg(place.at).unwrap();
            for (which, bound) in [bounds.0, bounds.1 / 0.2].into_iter().enumerate() {
                shares[region][which] += within(place.at, bound, scale);
            }
            shares[region][2] += 1.0;
        }
        for [translation, yaw, places] in shares {
            if places > 0.0 {
                low += u32::from(translation < q * places) + u32::from(yaw < q * places);
                count += 2;
            }
        }
    }
    (f64::from(low) / f64::from(count.max(1)), count)
}

/// Returns the share of errors within a bound, over the common scales of approaches.
fn within(at: [f64; 3], bound: f64, scale: f64) -> f64 {
    if scale == 0.0 {
        return SQUARES.share_within(at, bound);
    }
    let (mut sum, mut weights) = (0.0, 0.0);
    for k in -12..=12 {
        let normal = 0.3 * f64::from(k);
        let weight = (-0.5 * normal * normal).exp();
        sum += weight * SQUARES.share_within(at, bound / (scale * normal).exp());
        weights += weight;
    }
    sum / weights
}

fn learnt(detections: &Detections, quantile: f64) -> Result<ErrorModel, LearnError> {
    let settings = BoundsSettings {
        quantile,
        ..BoundsSettings::default()
    };
    learn_bounds(detections, &settings)
}

/// At most 5 % of the regions are too low, with frames whose errors have a correlation of 0.9, and with approaches that
/// differ as a whole.
fn check(seeds: u64) {
    for (lasting, scale, quantile) in [(0.9, 0.0, 0.9), (0.9, 0.3, 0.9), (0.9, 0.0, 0.95)] {
        let models = (0..seeds).filter_map(|seed| {
            let detections = SQUARES.approaches(60, lasting, scale, 7919 * seed + 13);
            let model = learnt(&detections, quantile).ok()?;
            let (rows, independent) = model.independent();
            assert!(
                rows == 6000 && independent > 100 && independent < rows / 3,
                "{independent}"
            );
            assert_eq!(model.runs(), Some(60));
            Some(model)
        });
        let (share, count) = low(models, scale, quantile);
        // Fewer than one model in ten is refused.
        assert!(count as f64 >= 1.8 * seeds as f64, "{count} of {seeds}");
        assert!(
            share <= 0.05,
            "{lasting} {scale} {quantile}: {share} of {count}"
        );
    }
}

#[test]
fn regions_hold_if_frames_depend_on_each_other() {
    check(6);
}

#[test]
#[ignore = "takes minutes: ./ci.sh deep"]
fn regions_hold_if_frames_depend_on_each_other_in_many_data_sets() {
    check(240);
}

/// The test above finds rows that are wrongly taken as independent.
#[test]
fn regions_are_too_low_if_dependent_frames_are_taken_as_independent() {
    let models = (0..12).filter_map(|seed| {
        let detections = SQUARES.approaches(60, 0.9, 0.0, 7919 * seed + 13);
        let detections = Detections {
            runs: Runs::default(),
            ..detections
        };
        learnt(&detections, 0.9).ok()
    });
    let (share, count) = low(models, 0.0, 0.9);
    assert!(count > 20 && share > 0.1, "{share} of {count}");
}

/// The split, and so the model, does not depend on the order of the rows or on the names of the runs.
#[test]
fn model_is_independent_of_the_order_of_runs() {
    let detections = SQUARES.approaches(60, 0.9, 0.0, 3);
    let mut turned = detections.clone();
    turned.rows.reverse();
    turned.runs.of_row = turned
        .runs
        .of_row
        .iter()
        .rev()
        .map(|run| 59 - run)
        .collect();
    let write = |detections: &Detections| learnt(detections, 0.9).unwrap().write().unwrap();
    assert_eq!(write(&detections), write(&turned));
    assert_eq!(
        ErrorModel::parse(&write(&detections), "m.toml").unwrap(),
        learnt(&detections, 0.9).unwrap()
    );
}

/// If every row is a separate run, hardly any information is lost.
#[test]
fn runs_of_one_row_are_independent_rows() {
    let mut detections = SQUARES.views(4000, 5, |_| true);
    let alone = learnt(&detections, 0.9).unwrap();
    detections.runs = Runs {
        of_row: (0..4000).collect(),
        source: RunSource::Column,
    };
    let model = learnt(&detections, 0.9).unwrap();
    let (rows, independent) = model.independent();
    assert!(rows == 4000 && independent > 3400, "{independent}");
    let at = [3.0, 10.0, 30.0];
    let ratio = model.bounds_deg(at).unwrap().0 / alone.bounds_deg(at).unwrap().0;
    assert!((0.85..1.2).contains(&ratio), "{ratio}");
}

/// 16 runs leave fewer than 10 for the calibration, whatever the number of their rows.
#[test]
fn too_few_runs_are_refused() {
    let error = learnt(&SQUARES.approaches(16, 0.0, 0.0, 6), 0.9).unwrap_err();
    assert_eq!(
        error,
        LearnError::TooFewRuns {
            found: 16,
            needed: 17
        }
    );
}

/// The limits of the share of detected views count dependent views as fewer.
#[test]
fn detection_limits_are_wider_for_dependent_views() {
    let mut detections = SQUARES.approaches(60, 0.9, 0.0, 8);
    let mut random = crate::distribution::Random(9);
    // The tag is hidden for 40 consecutive frames in a third of the approaches.
    for run in 0..60 {
        let hidden = random.even() < 0.33;
        for frame in 30..70 {
            if hidden {
                detections.rows[100 * run + frame].errors = None;
            }
        }
    }
    let width = |detections: &Detections| {
        let model = learnt(detections, 0.8).unwrap();
        let mut random = crate::distribution::Random(10);
        let widths = (0..500).filter_map(|_| {
            let [low, high] = model
                .detectability_deg(Distribution::place(&mut random))?
                .limits;
            Some(high - low)
        });
        let widths: Vec<f64> = widths.collect();
        widths.iter().sum::<f64>() / widths.len() as f64
    };
    let wide = width(&detections);
    detections.runs = Runs::default();
    let narrow = width(&detections);
    assert!(wide > 2.0 * narrow, "{wide} {narrow}");
}
