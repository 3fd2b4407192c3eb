//! The assumptions of learning. If an assumption holds, the result holds. If not, the result visibly fails. The tests of
//! dependence, fleets, drift and surveys test their own assumptions in the same way.

use crate::distribution::{Distribution, Random, SQUARES};
use crate::inflation::estimates;
use crate::{Share, in_regions};
use posegate::confidence::radius_squared;
use posegate_learn::{
    BoundsSettings, Detection, Detections, ErrorModel, InflationModel, InflationSettings, Scored,
    ScoredEstimates, learn_bounds, learn_inflation,
};
use std::collections::BTreeMap;

const QUANTILE: f64 = 0.9;

fn learnt(detections: &Detections) -> ErrorModel {
    let settings = BoundsSettings {
        quantile: QUANTILE,
        ..BoundsSettings::default()
    };
    learn_bounds(detections, &settings).unwrap()
}

/// Returns the share of translation errors within the bound in each region, and overall at the end.
fn shares(model: &ErrorModel, later: &Detections) -> Vec<Share> {
    let mut shares: Vec<Share> = in_regions(model, later)
        .into_iter()
        .map(|[own, _]| own)
        .collect();
    let sum = |field: fn(&Share) -> u64| shares.iter().map(field).sum();
    let overall = Share {
        trials: sum(|share| share.trials),
        hits: sum(|share| share.hits),
    };
    shares.push(overall);
    shares
}

/// Bounds are for later views like those of the data: not for a camera with 1.5 times the noise.
#[test]
#[ignore = "takes seconds: ./ci.sh deep"]
fn bounds_are_too_low_if_later_errors_are_larger() {
    let noisier = Distribution {
        sigma: |at| 1.5 * (SQUARES.sigma)(at),
        ..SQUARES
    };
    let model = learnt(&SQUARES.views(12_000, 301, |_| true));
    let same = shares(&model, &SQUARES.views(12_000, 302, |_| true));
    assert!(same.iter().all(|share| share.holds(QUANTILE)), "{same:?}");
    let larger = shares(&model, &noisier.views(12_000, 302, |_| true));
    assert!(
        !larger.iter().any(|share| share.holds(QUANTILE)),
        "{larger:?}"
    );
}

/// A bound holds for the mixture of places in its region, but not for one place with larger errors alone.
#[test]
#[ignore = "takes seconds: ./ci.sh deep"]
fn bounds_are_too_low_at_one_place_with_larger_errors() {
    const SPOT: fn([f64; 3]) -> bool =
        |[d, _, psi]| (3.0..3.3).contains(&d) && (30.0..33.0).contains(&psi);
    let glare = Distribution {
        sigma: |at| (SQUARES.sigma)(at) * if SPOT(at) { 4.0 } else { 1.0 },
        ..SQUARES
    };
    let model = learnt(&glare.views(12_000, 311, |_| true));
    let everywhere = shares(&model, &glare.views(12_000, 312, |_| true));
    assert!(
        everywhere.iter().all(|share| share.holds(QUANTILE)),
        "{everywhere:?}"
    );
    let there = *shares(&model, &glare.views(500, 312, SPOT)).last().unwrap();
    assert!(there.trials > 400 && there.value() < 0.75, "{there:?}");
}

/// Each bound holds for a share Q; both together only for 2 Q - 1 if a view never misses both.
#[test]
fn both_bounds_hold_for_less_than_each() {
    let views = |seed: u64| {
        let mut random = Random(seed);
        let rows = (0..12_000).map(|_| {
            let at = Distribution::place(&mut random);
            let (sigma, u) = ((SQUARES.sigma)(at), random.even());
            // Exponential errors; the larger the one, the smaller the other.
            let errors = [-sigma * (1.0 - u).ln(), -0.2 * sigma * u.max(1e-300).ln()];
            Detection {
                at,
                errors: Some(errors),
            }
        });
        Detections {
            rows: rows.collect(),
            ..Detections::default()
        }
    };
    let model = learnt(&views(321));
    let [mut translation, mut yaw, mut both] = [Share::default(); 3];
    for row in views(322).rows {
        let (Some(errors), Some(bounds)) = (row.errors, model.bounds_deg(row.at)) else {
            continue;
        };
        let held = [errors[0] <= bounds.0, errors[1] <= bounds.1];
        translation.count(held[0]);
        yaw.count(held[1]);
        both.count(held[0] && held[1]);
    }
    assert!(translation.holds(QUANTILE) && yaw.holds(QUANTILE));
    assert!(
        both.holds(model.coverage()) && !both.holds(QUANTILE),
        "{both:?}"
    );
}

fn settings() -> InflationSettings {
    InflationSettings {
        epsilon: QUANTILE,
        ..InflationSettings::default()
    }
}

/// Returns the share of estimates whose inflated sets hold the truth, at the conditions that `stated` makes of the true ones.
fn covered(model: &InflationModel, later: &ScoredEstimates, stated: impl Fn(f64) -> f64) -> Share {
    let r2 = radius_squared(QUANTILE).unwrap();
    let mut share = Share::default();
    for row in &later.rows {
        if let Some(inflation) = model.inflation(Some(stated(row.condition))) {
            share.count(row.squared_distance <= inflation * r2);
        }
    }
    share
}

/// A factor is for places and weather like those of the data.
#[test]
fn inflation_is_too_small_if_later_estimates_are_worse() {
    let model = learn_inflation(&estimates(60, 331), &settings()).unwrap();
    let mut later = estimates(60, 332);
    let same = covered(&model, &later, |condition| condition);
    assert!(same.holds(QUANTILE), "{same:?}");
    for row in &mut later.rows {
        row.squared_distance *= 2.0;
    }
    let worse = covered(&model, &later, |condition| condition);
    assert!(!worse.holds(QUANTILE) && worse.value() < 0.85, "{worse:?}");
}

/// A factor by the time since the last fix is for sources that do not understate this time; an overstated one is safe.
#[test]
fn inflation_by_age_is_too_small_if_the_age_is_understated() {
    let model = learn_inflation(&estimates(60, 341), &settings()).unwrap();
    let later = estimates(60, 342);
    let old = |condition: f64| condition > 0.55;
    let of_old = ScoredEstimates {
        rows: later
            .rows
            .iter()
            .copied()
            .filter(|row| old(row.condition))
            .collect(),
        ..later.clone()
    };
    let stated = covered(&model, &of_old, |condition| condition);
    assert!(stated.holds(QUANTILE), "{stated:?}");
    let understated = covered(&model, &of_old, |condition| condition - 0.5);
    assert!(
        understated.trials > 3000 && understated.value() < 0.75,
        "{understated:?}"
    );
    let overstated = covered(&model, &later, |condition| 0.5 + 0.5 * condition);
    assert!(overstated.holds(QUANTILE), "{overstated:?}");
}

/// Returns the share of logs whose factor covers later logs as stated. Each has 4,000 rows of a filter whose covariance is four times too
/// small; errors last for `rows` rows.
fn covering(rows: u32, seed: u64) -> Share {
    let mut random = Random(seed);
    let mut log = || {
        let mut scored = Vec::new();
        let mut error = [0.0; 3];
        for row in 0..4000 {
            if row % rows == 0 {
                error = [0.0; 3].map(|_: f64| random.normal());
            }
            let noisy = error.map(|e| e + 0.1 * random.normal());
            scored.push(Scored {
                squared_distance: 4.0 * noisy.iter().map(|e| e * e).sum::<f64>(),
                condition: random.even(),
                run: 0,
                group: 0,
            });
        }
        ScoredEstimates {
            rows: scored,
            ..estimates(1, 1)
        }
    };
    let mut share = Share::default();
    for _ in 0..40 {
        let Ok(model) = learn_inflation(&log(), &settings()) else {
            continue;
        };
        // The next 30 logs together show the true share.
        let mut later = log();
        for _ in 0..30 {
            later.rows.extend(log().rows);
        }
        share.count(covered(&model, &later, |condition| condition).value() >= QUANTILE - 0.005);
    }
    share
}

/// Blocks of rows must be independent of each other: an error that lasts for the whole log cannot be seen in it.
#[test]
#[ignore = "takes seconds: ./ci.sh deep"]
fn inflation_is_too_small_if_an_error_lasts_for_the_whole_log() {
    let short = covering(10, 351);
    assert!(short.trials == 40 && short.value() >= 0.7, "{short:?}");
    let lasting = covering(4000, 352);
    assert!(lasting.trials == 40 && lasting.value() < 0.4, "{lasting:?}");
}

/// Limits of the share of detected views are for later views like those of the data: not if every sixth view is dark.
#[test]
#[ignore = "takes seconds: ./ci.sh deep"]
fn detected_share_is_too_high_if_later_views_are_dark() {
    let mut random = Random(501);
    let places: Vec<[f64; 3]> = (0..20_000)
        .map(|_| Distribution::place(&mut random))
        .collect();
    // Cells whose limits contain the share: in the light of the data, and in the dark.
    let (mut cells, mut same, mut dark) = (0, 0, 0);
    for seed in 0..6 {
        let model = learnt(&SQUARES.views(6_000, 511 + seed, |_| true));
        // Places of one cell have the same limits.
        let mut shares: BTreeMap<[u64; 2], [f64; 2]> = BTreeMap::new();
        for at in &places {
            if let Some(found) = model.detectability_deg(*at) {
                let [sum, count] = shares.entry(found.limits.map(f64::to_bits)).or_default();
                *sum += Distribution::detected(*at);
                *count += 1.0;
            }
        }
        for (limits, [sum, count]) in shares {
            let [low, high] = limits.map(f64::from_bits);
            let within = |share: f64| usize::from((low..=high).contains(&share));
            cells += 1;
            same += within(sum / count);
            dark += within(sum / count * 5.0 / 6.0);
        }
    }
    assert!(cells > 60, "{cells}");
    assert!(same * 100 >= cells * 93, "{same} of {cells}");
    assert!(dark * 4 < cells, "{dark} of {cells}");
}
