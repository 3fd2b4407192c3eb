//! Bounds for tags that flip: the quantile of the errors jumps from the size of noise to that of a mirrored solution.

use crate::command::{Case, lines, run};
use crate::distribution::{Distribution, Random};
use crate::in_regions;
use posegate_learn::{BoundsSettings, ErrorModel, learn_bounds};
use posegate_site::SAMPLE;
use std::fmt::Write;

/// Errors are a few centimetres, and a metre more with a probability that falls with psi and rises with the distance.
const FLIPPING: Distribution = Distribution {
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
    let places = (0..20_000).map(|_| Distribution::place(&mut random));
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
        // If flips are frequent, a bound is not much larger than a flip.
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

/// Rows with the errors of both poses that fit a tag's image: the detector's own, which may be the flipped one, and the other one.
fn of_both_poses(seed: u64, rows: u32) -> Vec<([f64; 3], [[f64; 2]; 2])> {
    let noise = Distribution {
        flips: |_| 0.0,
        ..FLIPPING
    };
    let mut random = Random(seed);
    let row = |_| {
        let at = Distribution::place(&mut random);
        let good = noise.errors(at, &mut random);
        let flipped = [good[0] + 1.0, good[1] + 1.0];
        let is_flipped = random.even() < (FLIPPING.flips)(at);
        let both = if is_flipped {
            [flipped, good]
        } else {
            [good, flipped]
        };
        (at, both)
    };
    (0..rows).map(row).collect()
}

/// With both poses as hypotheses a bound is as tight as if no tag flipped, and one of the two is within it.
#[test]
fn bounds_for_both_poses_ignore_flips() {
    let folder = Case::new(&[]);
    let mut both =
        "d_m,phi_deg,psi_deg,detected,err_translation_m,err_yaw_rad,second_err_translation_m,second_err_yaw_rad\n"
            .to_owned();
    let mut one = "d_m,phi_deg,psi_deg,detected,err_translation_m,err_yaw_rad\n".to_owned();
    for ([d, phi, psi], [first, second]) in of_both_poses(31, 12_000) {
        let start = format!("{d},{phi},{psi},1,{},{}", first[0], first[1]);
        writeln!(both, "{start},{},{}", second[0], second[1]).unwrap();
        writeln!(one, "{start}").unwrap();
    }
    let site = SAMPLE.to_owned()
        + "[error_model.m]\nfile = \"both.toml\"\n\n[task.look]\nkind = \"localization\"\ngoal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }\nsuccess = { shape = \"visibility\", camera = \"front\", tag = \"t7\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 60.0, error_model = \"m\", r = { translation = 0.1, yaw_deg = 5.0 } }\n";
    folder.write("both.csv", &both);
    folder.write("one.csv", &one);
    folder.write("site.toml", &site);
    let model = |name: &str| {
        let line = format!("learn bounds {name}.csv --quantile 0.99 -o {name}.toml --json");
        let (out, _err) = folder.expect(0, &line);
        assert_eq!(lines(&out)[0]["of_better_pose"], name == "both", "{out}");
        let text = folder.text(&format!("{name}.toml"));
        ErrorModel::parse(&text, name).unwrap()
    };
    let (of_both, of_one) = (model("both"), model("one"));
    // A view at which a tenth of the tags flip.
    let flipping = [6.0, 5.0, 20.0];
    let ratio = of_one.bounds_deg(flipping).unwrap().0 / of_both.bounds_deg(flipping).unwrap().0;
    assert!(ratio > 5.0, "{ratio}");
    let (mut held, mut tried) = (0, 0);
    // Where tags flip: the views, and those in which the detector's own pose is within both bounds.
    let (mut own, mut far) = (0, 0);
    for (at, poses) in of_both_poses(33, 20_000) {
        let Some((translation, yaw)) = of_both.bounds_deg(at) else {
            continue;
        };
        tried += 1;
        let within = poses
            .iter()
            .any(|pose| pose[0] <= translation && pose[1] <= yaw);
        held += u32::from(within);
        if at[0] > 5.0 && at[2] < 20.0 {
            far += 1;
            own += u32::from(poses[0][0] <= translation && poses[0][1] <= yaw);
        }
    }
    assert!(
        far > 500 && f64::from(own) < 0.95 * f64::from(far),
        "{own} of {far}"
    );
    assert!(
        tried > 15_000 && f64::from(held) >= 0.98 * f64::from(tried),
        "{held} of {tried}"
    );
    // `predict` reports for which pose its bounds hold.
    folder.write("at.csv", "d_m,phi_deg,psi_deg\n3,5,30\n");
    for (name, warns) in [("both", true), ("one", false)] {
        let (code, _, err) = run(&folder, &format!("predict {name}.toml --at at.csv --json"));
        assert_eq!((code, err.contains("better one")), (0, warns), "{err}");
    }
    // A look gives one pose, so a site cannot use such a model. Rows of one pose cannot test it.
    folder
        .run("check site.toml")
        .is_refused_with(&["better one"]);
    for (name, data) in [("both", "one"), ("one", "both")] {
        folder
            .run(&format!("learn check {name}.toml {data}.csv"))
            .is_refused_with(&["second_err_yaw_rad"]);
        let (_, _err) = folder.expect(0, &format!("learn check {name}.toml {name}.csv"));
    }
}
