//! Bounds from rows that depend on each other: approaches whose successive errors are similar.

use crate::Share;
use crate::distribution::{Distribution, HEAD_ON, Random, SQUARES};
use posegate_learn::{
    BoundsSettings, Detections, ErrorModel, LearnError, RunSource, Runs, acceptance, learn_bounds,
};
use posegate_testkit::counts;
use std::sync::OnceLock;

/// The places of many approaches, at which the share of errors within a bound is computed exactly.
fn places() -> &'static [[f64; 3]] {
    static PLACES: OnceLock<Vec<[f64; 3]>> = OnceLock::new();
    PLACES.get_or_init(|| {
        let rows = SQUARES.approaches(400, 0.0, 0.0, 1001).rows;
        rows.iter().map(|row| row.at).collect()
    })
}

/// Bounds of regions, counted over models.
#[derive(Clone, Copy, Debug, Default)]
struct Low {
    /// Models, and those of them with a bound that is significantly low.
    models: u64,
    significant: u64,
    /// Bounds (two for each region), and those that hold for less than their share.
    bounds: u64,
    low: u64,
}

impl Low {
    /// Counts both bounds of each region of a model for the share `q`. `within` returns the exact shares of translation and yaw errors
    /// within the bounds at a place, and the weight of the place. One later detection per place is drawn; a bound is significantly low
    /// if so few of them are within it with a probability below 1 %, divided by the number of bounds (Bonferroni).
    fn count(
        &mut self,
        model: &ErrorModel,
        q: f64,
        places: &[[f64; 3]],
        within: impl Fn([f64; 3], [f64; 2]) -> ([f64; 2], f64),
    ) {
        let mut random = Random(self.models);
        let mut regions = vec![([0.0; 3], [Share::default(); 2]); model.regions().count()];
        for at in places {
            let Some(bounds) = model.bounds_deg(*at) else {
                continue;
            };
            let (shares, weight) = within(*at, [bounds.0, bounds.1]);
            let (sums, hits) = &mut regions[model.region_deg(*at).unwrap()];
            sums[2] += weight;
            let is_detected = random.even() < weight;
            for which in [0, 1] {
                sums[which] += weight * shares[which];
                let is_within = random.even() < shares[which];
                if is_detected {
                    hits[which].count(is_within);
                }
            }
        }
        regions.retain(|(sums, _)| sums[2] > 0.0);
        let count = 2 * regions.len() as u64;
        let confidence = 1.0 - 2.0 * 0.01 / count.max(1) as f64;
        let low = |share: &Share| share.hits < acceptance(share.trials, q, confidence)[0];
        self.models += 1;
        self.significant += u64::from(regions.iter().flat_map(|(_, hits)| hits).any(low));
        self.bounds += count;
        for (sums, _) in &regions {
            self.low += [0, 1]
                .map(|which| u64::from(sums[which] < q * sums[2]))
                .iter()
                .sum::<u64>();
        }
    }

    /// Returns the share of bounds that hold for less than their share of the detections.
    fn share(&self) -> f64 {
        self.low as f64 / self.bounds.max(1) as f64
    }

    /// Prints the counts, and checks them: at most 5 % of the bounds are low, and no more models have a significantly low one than
    /// chance explains.
    fn check(&self, name: &str) {
        println!("{name}: {self:?}, {:.2} % low", 100.0 * self.share());
        // 5 % is the confidence of each bound, so the number of low ones is up to chance.
        let [_, most] = acceptance(self.bounds, 0.05, 0.99);
        assert!(self.low <= most, "{name}: {self:?}");
        let [_, most] = acceptance(self.models, 0.01, 0.99);
        assert!(self.significant <= most, "{name}: {self:?}");
    }
}

/// Counts models of 60 approaches.
fn low(models: impl Iterator<Item = ErrorModel>, scale: f64, q: f64) -> Low {
    let mut low = Low::default();
    for model in models {
        low.count(&model, q, places(), |at, [translation, yaw]| {
            (
                [translation, yaw / 0.2].map(|bound| within(at, bound, scale)),
                1.0,
            )
        });
    }
    low
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

/// The shares at which bounds are tried.
const QUANTILES: [f64; 5] = [0.5, 0.8, 0.9, 0.95, 0.99];

/// At most 5 % of the bounds are too low, with frames whose errors have a correlation of 0.9, and with approaches that
/// differ as a whole (`scale`).
fn check(seeds: u64, cases: &[(f64, f64)]) {
    for (scale, quantile) in cases.iter().copied() {
        // Of 60 approaches that differ as a whole, fewer than the 499 detections that a share of 0.99 needs are independent.
        let runs = if quantile < 0.99 { 60 } else { 180 };
        let models = (0..seeds).filter_map(|seed| {
            let detections = SQUARES.approaches(runs, 0.9, scale, 7919 * seed + 13);
            let model = learnt(&detections, quantile).ok()?;
            let (rows, independent) = model.independent();
            assert!(
                rows == 100 * u64::from(runs) && independent > 100 && independent < rows / 3,
                "{independent}"
            );
            assert_eq!(model.runs(), Some(runs.into()));
            Some(model)
        });
        let low = low(models, scale, quantile);
        low.check(&format!(
            "{runs} x 100 frames, Q {quantile}, scale {scale}, {seeds} data sets"
        ));
        // Fewer than one model in ten is refused.
        assert!(10 * low.models >= 9 * seeds, "{low:?} of {seeds}");
        assert!(low.share() <= 0.05, "{quantile} {scale}: {low:?}");
    }
}

#[test]
fn regions_hold_if_frames_depend_on_each_other() {
    check(
        6,
        &counts::one_a_day(&[(0.0, 0.9), (0.3, 0.9), (0.0, 0.95)]),
    );
}

#[test]
#[ignore = "takes minutes: ./ci.sh deep"]
fn regions_hold_if_frames_depend_on_each_other_in_many_data_sets() {
    let cases = QUANTILES.map(|quantile| [(0.0, quantile), (0.3, quantile)]);
    check(120, cases.as_flattened());
}

/// With independent rows each bound holds with the stated confidence, at every share, also where tags flip.
fn check_independent(seeds: u64, quantiles: &[f64]) {
    for (name, distribution) in [("errors of squares", SQUARES), ("flips head-on", HEAD_ON)] {
        let mut random = Random(2002);
        let places: Vec<[f64; 3]> = (0..40_000)
            .map(|_| Distribution::place(&mut random))
            .collect();
        for quantile in quantiles.iter().copied() {
            let mut low = Low::default();
            for seed in 0..seeds {
                let model = learnt(
                    &distribution.views(6000, 104_729 * seed + 17, |_| true),
                    quantile,
                );
                low.count(&model.unwrap(), quantile, &places, |at, bounds| {
                    (
                        distribution.shares_within(at, bounds),
                        Distribution::detected(at),
                    )
                });
            }
            low.check(&format!(
                "6000 independent views, {name}, Q {quantile}, {seeds} data sets"
            ));
        }
    }
}

#[test]
fn regions_hold_if_rows_are_independent() {
    check_independent(3, &counts::one_a_day(&QUANTILES));
}

#[test]
#[ignore = "takes minutes: ./ci.sh deep"]
fn regions_hold_if_rows_are_independent_in_many_data_sets() {
    check_independent(60, &QUANTILES);
}

/// The test above finds rows that are wrongly taken as independent.
#[test]
#[ignore = "takes seconds: ./ci.sh deep"]
fn regions_are_too_low_if_dependent_frames_are_taken_as_independent() {
    let models = (0..12).filter_map(|seed| {
        let detections = SQUARES.approaches(60, 0.9, 0.0, 7919 * seed + 13);
        let detections = Detections {
            runs: Runs::default(),
            ..detections
        };
        learnt(&detections, 0.9).ok()
    });
    let low = low(models, 0.0, 0.9);
    assert!(low.bounds > 20 && low.share() > 0.1, "{low:?}");
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
    let mut random = Random(9);
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
        let mut random = Random(10);
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
