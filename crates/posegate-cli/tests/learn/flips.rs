//! Bounds where tags flip: the quantile of the errors jumps from the size of noise to that of a mirrored solution.

use crate::in_regions;
use crate::law::{Law, Random};
use posegate_host::learn::{BoundsSettings, ErrorModel, learn_bounds};

/// Errors are a few centimetres, and a metre more with a probability that falls with psi and rises with the distance.
const FLIPPING: Law = Law {
    sigma: |[d, _, psi]| 0.002 + 0.002 * d * d / (0.3 + psi / 30.0),
    flips: |[d, _, psi]| {
        let away = psi - 22.0 - 4.0 * (d - 6.5);
        0.2 / (1.0 + (away / 2.5).exp())
    },
};

fn learnt(quantile: f64, seed: u64) -> ErrorModel {
    let settings = BoundsSettings {
        quantile,
        ..BoundsSettings::default()
    };
    learn_bounds(&FLIPPING.views(12_000, seed, |_| true), &settings).unwrap()
}

/// Returns the ratios of the bounds to the true quantile, ascending.
fn ratios(model: &ErrorModel, quantile: f64, takes: impl Fn([f64; 3]) -> bool) -> Vec<f64> {
    let mut random = Random(977);
    let places = (0..20_000).map(|_| Law::place(&mut random));
    let mut ratios: Vec<f64> = places
        .filter(|at| takes(*at))
        .filter_map(|at| Some(model.bounds_deg(at)?.0 / FLIPPING.quantile(at, quantile)))
        .collect();
    ratios.sort_by(f64::total_cmp);
    ratios
}

fn nth(sorted: &[f64], share: f64) -> f64 {
    sorted[(share * (sorted.len() - 1) as f64) as usize]
}

/// At 0.99 the quantile falls by a factor of ten within a few degrees. Bounds follow it on both sides, and hold in each region.
#[test]
fn bounds_are_tight_where_tags_flip() {
    let quantile = 0.99;
    for seed in [5, 6] {
        let model = learnt(quantile, seed);
        let all = ratios(&model, quantile, |_| true);
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        assert!(
            all.len() > 19_000
                && nth(&all, 0.05) > 0.6
                && nth(&all, 0.5) < 1.15
                && nth(&all, 0.95) < 2.8
                && mean < 1.42,
            "{seed}: {} {} {} {mean}",
            nth(&all, 0.05),
            nth(&all, 0.5),
            nth(&all, 0.95)
        );
        // Where flips are frequent, a bound is not much larger than a flip.
        let flipped = ratios(&model, quantile, |at| (FLIPPING.flips)(at) > 0.025);
        assert!(
            flipped.len() > 1000 && nth(&flipped, 0.5) < 1.4 && nth(&flipped, 0.95) < 2.2,
            "{seed}: {} {}",
            nth(&flipped, 0.5),
            nth(&flipped, 0.95)
        );
        let each = in_regions(&model, &FLIPPING.views(24_000, seed + 100, |_| true));
        assert!(each.len() >= 3, "{}", each.len());
        for share in each.iter().flatten() {
            assert!(share.holds(quantile), "{seed}: {share:?}");
        }
    }
}
