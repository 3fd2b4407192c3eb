//! Tests of error bounds, and of the share of views that are detected.

use crate::Share;
use crate::distribution::{Distribution, HEAD_ON, Random, SQUARES};
use posegate_learn::{
    BoundsSettings, Detections, ErrorModel, LearnError, clopper_pearson, learn_bounds,
};
use posegate_testkit::counts;

fn learnt(detections: &Detections, quantile: f64) -> ErrorModel {
    let settings = BoundsSettings {
        quantile,
        ..BoundsSettings::default()
    };
    learn_bounds(detections, &settings).unwrap()
}

/// Both bounds have their coverage on new detections, overall and in each region.
#[test]
fn bounds_hold_overall_and_in_each_region() {
    let cases = [(HEAD_ON, 0.95, 1), (SQUARES, 0.95, 3), (SQUARES, 0.99, 4)];
    for (distribution, quantile, seed) in counts::one_a_day(&cases) {
        let model = learnt(&distribution.views(12_000, seed, |_| true), quantile);
        let regions = model.regions().count();
        assert!(regions >= 3, "{regions}");
        let mut overall = [Share::default(); 2];
        let mut each = vec![[Share::default(); 2]; regions];
        let mut accepted = Share::default();
        for row in distribution.views(12_000, seed + 100, |_| true).rows {
            let Some(errors) = row.errors else { continue };
            let bounds = model.bounds_deg(row.at);
            accepted.count(bounds.is_some());
            let Some(bounds) = bounds else { continue };
            let region = model.region_deg(row.at).unwrap();
            for (which, bound) in [bounds.0, bounds.1].into_iter().enumerate() {
                overall[which].count(errors[which] <= bound);
                each[region][which].count(errors[which] <= bound);
            }
        }
        for shares in each.iter().chain([&overall]) {
            for share in shares {
                assert!(share.holds(quantile), "{quantile}, {seed}: {share:?}");
            }
        }
        // Nearly everything is accepted; the excess coverage is the cost of the confidence.
        assert!(accepted.value() > 0.98, "{accepted:?}");
        let excess = overall[0].value().max(overall[1].value()) - quantile;
        assert!(excess < 0.5 * (1.0 - quantile), "{quantile}: {excess}");
    }
}

/// Bounds are compared with the true quantile, place by place.
#[test]
fn bounds_are_tight() {
    let distribution = SQUARES;
    let model = learnt(&distribution.views(12_000, 11, |_| true), 0.95);
    let mut random = Random(12);
    let mut ratios = Vec::new();
    for _ in 0..4000 {
        let at = Distribution::place(&mut random);
        if let Some((translation, _)) = model.bounds_deg(at) {
            ratios.push(translation / distribution.quantile(at, 0.95));
        }
    }
    ratios.sort_by(f64::total_cmp);
    let nth = |share: f64| ratios[(share * (ratios.len() - 1) as f64) as usize];
    assert!(ratios.len() > 3900, "{}", ratios.len());
    assert!(
        nth(0.05) > 0.9 && nth(0.5) < 1.15 && nth(0.95) < 1.4 && nth(1.0) < 2.0,
        "{} {} {} {}",
        nth(0.05),
        nth(0.5),
        nth(0.95),
        nth(1.0)
    );
    assert!(nth(0.5) > 1.0, "{}", nth(0.5));
}

/// For any data, a bound never decreases with the distance.
#[test]
fn bounds_never_decrease_with_the_distance() {
    let model = learnt(&HEAD_ON.views(4000, 21, |_| true), 0.9);
    for psi in [3.0, 20.0, 41.0, 66.0] {
        for phi in [1.0, 13.0, 24.0] {
            let mut last = (0.0, 0.0);
            for k in 0..=600 {
                let Some(now) = model.bounds_deg([0.5 + 0.01 * f64::from(k), phi, psi]) else {
                    continue;
                };
                // Except for rounding where the bound is constant.
                let grown = |now: f64, last: f64| now >= last * (1.0 - 1e-12);
                assert!(
                    grown(now.0, last.0) && grown(now.1, last.1),
                    "{k} {phi} {psi}"
                );
                last = now;
            }
            assert!(last.0 > 0.0);
        }
    }
}

#[test]
fn detected_share_is_reported_with_limits() {
    let model = learnt(&SQUARES.views(12_000, 31, |_| true), 0.9);
    let mut random = Random(32);
    let (mut off, mut count, mut outside) = (0.0, 0.0, Share::default());
    for _ in 0..4000 {
        let at = Distribution::place(&mut random);
        let Some(found) = model.detectability_deg(at) else {
            continue;
        };
        off += (found.share - Distribution::detected(at)).abs();
        count += 1.0;
        let [low, high] = found.limits;
        outside.count(!(low - 0.02..=high + 0.02).contains(&found.share));
    }
    assert!(count > 3900.0 && off / count < 0.01, "{}", off / count);
    assert!(outside.value() < 0.15, "{outside:?}");
}

/// The result does not depend on the order of the rows.
#[test]
fn model_is_independent_of_the_row_order() {
    let detections = HEAD_ON.views(3000, 41, |_| true);
    let mut turned = detections.clone();
    turned.rows.reverse();
    assert_eq!(
        learnt(&detections, 0.9).write().unwrap(),
        learnt(&turned, 0.9).write().unwrap()
    );
    // Another seed splits the rows differently.
    let settings = BoundsSettings {
        quantile: 0.9,
        seed: 2,
        ..BoundsSettings::default()
    };
    let other = learn_bounds(&detections, &settings).unwrap();
    assert_ne!(
        learnt(&detections, 0.9).write().unwrap(),
        other.write().unwrap()
    );
}

/// There are no bounds beyond the data, in a hole of the data, or where there are few data.
#[test]
fn region_with_too_few_data_is_refused() {
    let hole = |[d, _, psi]: [f64; 3]| !(psi > 40.0 && d > 3.0);
    let model = learnt(&SQUARES.views(6000, 51, hole), 0.95);
    assert!(model.bounds_deg([2.0, 10.0, 30.0]).is_some());
    assert!(model.bounds_deg([5.0, 10.0, 20.0]).is_some());
    for beyond in [
        [5.5, 10.0, 60.0],
        [7.0, 10.0, 20.0],
        [0.3, 10.0, 20.0],
        [2.0, 26.0, 20.0],
        [2.0, 10.0, 71.0],
        [f64::NAN, 10.0, 20.0],
        [2.0, f64::NAN, 20.0],
    ] {
        assert_eq!(model.bounds_deg(beyond), None, "{beyond:?}");
    }
    assert!(model.refused().count() > 0);
    // The few rows left in the hole are not enough.
    let mut thin = SQUARES.views(6000, 51, hole);
    thin.rows.extend(SQUARES.views(12, 52, |at| !hole(at)).rows);
    assert_eq!(learnt(&thin, 0.95).bounds_deg([5.5, 10.0, 60.0]), None);

    let few = SQUARES.views(60, 53, |_| true);
    let settings = BoundsSettings::default();
    assert!(matches!(
        learn_bounds(&few, &settings),
        Err(LearnError::TooFew { .. })
    ));
    for bad in [0.0, 1.0, f64::NAN, -0.5] {
        let settings = BoundsSettings {
            quantile: bad,
            ..settings.clone()
        };
        assert!(learn_bounds(&few, &settings).is_err());
    }
}

/// There are no bounds in a gap of the data, although there are many rows on both sides.
#[test]
fn gap_of_the_data_is_refused() {
    const MARGIN: [f64; 3] = [0.05, 0.5, 0.5];
    let gaps = [
        (0, 2.3, 4.7, 0.9),
        (0, 2.0, 5.0, 0.95),
        (1, 5.0, 20.0, 0.9),
        (1, 10.0, 15.0, 0.95),
        (1, 16.0, 20.0, 0.99),
        (2, 20.0, 50.0, 0.9),
        (2, 10.0, 60.0, 0.95),
    ];
    let (skipped, step) = counts::part(4);
    for (axis, low, high, quantile) in gaps.into_iter().skip(skipped).step_by(step) {
        let gap = |at: [f64; 3]| at[axis] > low && at[axis] < high;
        let model = learnt(&SQUARES.views(6000, 54, |at| !gap(at)), quantile);
        let mut random = Random(55);
        let mut accepted = Share::default();
        for _ in 0..4000 {
            let at = Distribution::place(&mut random);
            let near = at[axis] > low - MARGIN[axis] && at[axis] < high + MARGIN[axis];
            if at[axis] > low + MARGIN[axis] && at[axis] < high - MARGIN[axis] {
                assert_eq!(model.bounds_deg(at), None, "{at:?}");
            } else if !near {
                accepted.count(model.bounds_deg(at).is_some());
            }
        }
        assert!(accepted.value() > 0.9, "{axis} {low}: {accepted:?}");
    }
    // A hole that is not a gap along any axis.
    let hole = |[d, _, psi]: [f64; 3], by: f64| {
        d > 2.0 + by && d < 3.5 - by && psi > 20.0 + 10.0 * by && psi < 40.0 - 10.0 * by
    };
    let model = learnt(&SQUARES.views(6000, 56, |at| !hole(at, 0.0)), 0.9);
    let mut random = Random(57);
    for _ in 0..8000 {
        let at = Distribution::place(&mut random);
        assert!(!hole(at, 0.3) || model.bounds_deg(at).is_none(), "{at:?}");
    }
}

/// Bounds from few rows hold overall, and are nowhere far below the errors that were observed nearby.
#[test]
fn bounds_of_few_rows_are_not_extrapolated() {
    for seed in 0..30 {
        let model = learnt(&SQUARES.views(120, seed, |_| true), 0.9);
        let mut random = Random(seed + 9);
        let (mut least, mut sum, mut count) = (1.0f64, 0.0, 0.0);
        for _ in 0..1000 {
            let at = Distribution::place(&mut random);
            if let Some((translation, _)) = model.bounds_deg(at) {
                let share = SQUARES.share_within(at, translation);
                least = least.min(share);
                sum += share;
                count += 1.0;
            }
        }
        assert!(
            least > 0.15 && sum / count > 0.9,
            "{seed}: {least} {}",
            sum / count
        );
    }
}

/// Head-on views differ from others and are not extrapolated from views nearby.
#[test]
fn bounds_are_not_extrapolated_to_head_on_views() {
    let model = learnt(&HEAD_ON.views(400, 58, |at| at[2] > 6.0), 0.9);
    for psi in [0.0, 2.0, 5.0] {
        assert_eq!(model.bounds_deg([2.0, 10.0, psi]), None);
    }
    assert!(model.bounds_deg([2.0, 10.0, 30.0]).is_some());
}

/// Distances and angles that are all the same, or one of a few values, have their own cells.
#[test]
fn repeated_distances_and_angles_have_their_own_cells() {
    let of = |place: fn([f64; 3]) -> [f64; 3]| {
        let mut detections = SQUARES.views(4000, 59, |_| true);
        for row in &mut detections.rows {
            row.at = place(row.at);
        }
        learnt(&detections, 0.9)
    };
    let model = of(|[d, _, psi]| [d, 10.0, psi]);
    assert!(model.bounds_deg([2.0, 10.0, 30.0]).is_some());
    for phi in [0.0, 9.0, 11.0] {
        assert_eq!(model.bounds_deg([2.0, phi, 30.0]), None);
    }
    let model = of(|[d, phi, psi]| [d.clamp(1.0, 4.0).round(), phi, psi]);
    for d in [1.0, 2.0, 3.0, 4.0] {
        assert!(model.bounds_deg([d, 10.0, 30.0]).is_some(), "{d}");
        assert_eq!(model.bounds_deg([d + 0.5, 10.0, 30.0]), None);
    }
}

/// Equal rows are split like other rows.
#[test]
fn equal_rows_are_split() {
    let mut detections = SQUARES.views(400, 60, |_| true);
    for row in &mut detections.rows {
        row.at = [2.0, 10.0, 30.0];
        row.errors = Some([0.03, 0.01]);
    }
    let (translation, yaw) = learnt(&detections, 0.9)
        .bounds_deg([2.0, 10.0, 30.0])
        .unwrap();
    assert!((0.03..0.032).contains(&translation) && (0.01..0.011).contains(&yaw));
}

/// Refused regions are reported with the reason.
#[test]
fn refused_regions_are_reported_with_the_reason() {
    let mut detections = SQUARES.views(4000, 62, |_| true);
    for (k, row) in detections.rows.iter_mut().enumerate() {
        row.at = [0, 1, 2].map(|axis| 1.0 + 0.5 * ((k >> (4 * axis)) % 16) as f64);
        row.at[0] *= row.at[0];
        row.at[2] *= row.at[2];
    }
    let error = learn_bounds(&detections, &BoundsSettings::default()).unwrap_err();
    assert!(
        matches!(&error, LearnError::Nowhere { found, .. } if *found > 3000),
        "{error}"
    );
    assert!(error.to_string().contains("cells: "), "{error}");
}

/// Flips stay in the data: if they are frequent, the bound is as large as their error.
#[test]
fn bounds_include_frequent_flips() {
    let distribution = Distribution {
        flips: |_| 0.2,
        ..SQUARES
    };
    let model = learnt(&distribution.views(6000, 61, |_| true), 0.9);
    let (translation, yaw) = model.bounds_deg([2.0, 10.0, 30.0]).unwrap();
    assert!(translation > 1.0 && yaw > 1.0, "{translation} {yaw}");
    let (_, detections, flip_share) = model.counts();
    // An error of 1 rad exceeds psi if psi is below 57 degrees: 47 of 60 of the views with psi of 10 degrees or more.
    let [low, high] = clopper_pearson((0.2 * 47.3 / 60.0 * 5000.0) as u64, 5000, 0.999);
    assert!(detections > 5000 && (low - 0.01..high + 0.01).contains(&flip_share));
}

/// In each box both bounds are within the limit, and little is left out.
#[test]
fn bounds_are_within_the_limit_in_every_box() {
    let model = learnt(&HEAD_ON.views(12_000, 71, |_| true), 0.9);
    for (translation, yaw_deg) in [(0.03, 1.0), (0.06, 1.0), (0.2, 30.0)] {
        let views = model.views(translation, yaw_deg);
        assert!((1..=8).contains(&views.len()), "{views:?}");
        let inside = |[d, phi, psi]: [f64; 3]| {
            views.iter().any(|b| {
                (b.d[0]..=b.d[1]).contains(&d)
                    && phi <= b.phi_max_deg
                    && (b.psi_deg[0]..=b.psi_deg[1]).contains(&psi)
            })
        };
        let mut random = Random(72);
        let mut found = Share::default();
        for _ in 0..20_000 {
            let at = Distribution::place(&mut random);
            let good = model
                .bounds_deg(at)
                .is_some_and(|b| b.0 <= translation && b.1.to_degrees() <= yaw_deg);
            assert!(good || !inside(at), "{at:?}");
            if good {
                found.count(inside(at));
            }
        }
        assert!(found.value() > 0.75, "{translation}: {found:?}");
        // The corners themselves, including borders of cells.
        for b in &views {
            for d in b.d {
                for psi in b.psi_deg {
                    let at = [d.max(0.51), b.phi_max_deg, psi];
                    let (t, y) = model.bounds_deg(at).unwrap();
                    assert!(t <= translation && y.to_degrees() <= yaw_deg, "{at:?}");
                }
            }
        }
    }
    assert!(model.views(1e-6, 1e-6).is_empty());
}

/// A written model reads back as the same model, and an inconsistent file is refused.
#[test]
fn inconsistent_model_file_is_refused() {
    let model = learnt(&SQUARES.views(2000, 81, |_| true), 0.9);
    let text = model.write().unwrap();
    assert_eq!(ErrorModel::parse(&text, "m.toml").unwrap(), model);
    let refused = |text: &str, with: &str| {
        let error = ErrorModel::parse(text, "m.toml").unwrap_err().to_string();
        assert!(
            error.starts_with("m.toml") && error.contains(with),
            "{error}"
        );
    };
    refused(&text.replace("kind", "king"), "king");
    refused(&text.replace("quantile = 0.9", "quantile = 1.5"), "above 0");
    refused(
        &text.replace("posegate_model = 1", "posegate_model = 2"),
        "version 1",
    );
    refused(
        &text.replace("seed = 1", "seed = 1\nunknown = 2"),
        "unknown",
    );
    refused(&text.replace("quantile = 0.9\n", ""), "quantile");
    refused(&text[..text.len() / 2], "m.toml:");
    let rank = text.find("\nrank = ").unwrap();
    let end = rank + text[rank + 1..].find('\n').unwrap() + 1;
    let unranked = format!("{}\nrank = 0{}", &text[..rank], &text[end..]);
    refused(&unranked, "calibrated region");
    let edge = text.find("d_m = [").unwrap() + 7;
    let stretched = format!("{}-1.0, {}", &text[..edge], &text[edge..]);
    refused(&stretched, "edges");
    // Nested shapes come together and ascend.
    let wider = text.find("[wider]").unwrap();
    let end = wider + text[wider + 1..].find("\n[").unwrap() + 2;
    refused(&format!("{}{}", &text[..wider], &text[end..]), "only one");
    let swapped = text
        .replace("[narrower]", "[other]")
        .replace("[wider]", "[narrower]")
        .replace("[other]", "[wider]");
    refused(&swapped, "do not ascend");
    let parts = text.replace("seed = 1\n", "seed = 1\nparts = [2, 0, 2]\n");
    refused(&parts, "edges");
}

/// With few rows a model has one shape and factors, which is also how files of earlier versions are written.
#[test]
fn model_of_few_rows_has_one_shape() {
    let model = learnt(&SQUARES.views(400, 82, |_| true), 0.9);
    let text = model.write().unwrap();
    assert!(
        !text.contains("[wider]") && !text.contains("[narrower]"),
        "{text}"
    );
    assert_eq!(ErrorModel::parse(&text, "m.toml").unwrap(), model);
    // A factor that is twice as large doubles the bounds.
    let key = text.find("\ntranslation = ").unwrap() + 15;
    let end = key + text[key..].find('\n').unwrap();
    let factor: f64 = text[key..end].parse().unwrap();
    let doubled = format!("{}{}{}", &text[..key], 2.0 * factor, &text[end..]);
    let doubled = ErrorModel::parse(&doubled, "m.toml").unwrap();
    let at = [1.0, 10.0, 20.0];
    let ratio = doubled.bounds_deg(at).unwrap().0 / model.bounds_deg(at).unwrap().0;
    assert!((ratio - 2.0).abs() < 1e-9, "{ratio}");
}
