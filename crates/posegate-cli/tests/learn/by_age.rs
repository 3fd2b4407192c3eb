//! Factors by the time since the last fix, from rows to the gate.

use crate::command::{Case, lines, run};
use crate::distribution::Random;
use std::fmt::Write;

const HEADER: &str = "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,true_x_m,true_y_m,true_yaw_rad,since_fix_s";

/// Estimates at the dock that state deviations of 4 mm and 4 mrad: true within a second of a fix, ten times too small later. Each tenth row has an
/// old fix.
fn estimates(count: u32, seed: u64) -> String {
    estimates_from(0.0, count, seed)
}

/// The same, each age larger by `youngest` seconds.
fn estimates_from(youngest: f64, count: u32, seed: u64) -> String {
    let mut random = Random(seed);
    let mut text = format!("{HEADER}\n");
    for k in 0..count {
        let is_old = k % 10 == 9;
        let since = youngest + if is_old { 5.0 } else { 0.0 } + random.even();
        let sigma = 0.004 * if is_old { 10.0 } else { 1.0 };
        let [x, y, yaw] = [0; 3].map(|_| sigma * random.normal());
        let t = 0.05 * f64::from(k);
        writeln!(
            text,
            "{t},0,0,0,1.6e-5,0,0,1.6e-5,0,1.6e-5,{x},{y},{yaw},{since:.3}"
        )
        .unwrap();
    }
    text
}

#[test]
fn replay_uses_the_factor_of_the_age_of_each_estimate() {
    let folder = Case::new(&[]);
    let site = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/sites/dock.toml"
    );
    folder.write("e.csv", estimates(6000, 3));
    folder.write("new.csv", estimates(500, 4));
    let learn = |epsilon: &str| {
        run(
            &folder,
            &format!("learn inflation e.csv --epsilon {epsilon} -o m.toml --json"),
        )
    };
    let (code, out, err) = learn("0.99");
    assert_eq!(code, 0, "{err}");
    let source = &lines(&out)[0]["source"];
    let largest = source["inflation"].as_f64().unwrap();
    let ages = source["ages"].as_array().unwrap();
    assert!(largest > 80.0 && !ages.is_empty(), "{source}");
    assert!(ages[0]["inflation"].as_f64().unwrap() < 1.5, "{source}");

    let replay = |file: &str, options: &str| {
        let line = format!("replay {site} {file} --task dock --json --fast {options}");
        let (code, out, err) = run(&folder, &line);
        assert!(code < 2, "{err}");
        let summary = lines(&out).pop().unwrap();
        let gate = &summary["rules"]["gate"];
        let [permits, falsely] =
            ["permits", "false_permits"].map(|key| gate[key].as_u64().unwrap());
        (
            permits,
            falsely,
            summary["truth"]["coverage"].as_f64().unwrap(),
            err,
        )
    };
    let (permits, falsely, coverage, _) = replay("new.csv", "--inflation-model m.toml");
    // Nine of ten rows are fresh. Which rows lie near a border of the learnt conditions depends on the data.
    assert!(
        (380..=450).contains(&permits) && falsely == 0,
        "{permits} {falsely}"
    );
    assert!(coverage >= 0.98, "{coverage}");
    let (permits, ..) = replay("new.csv", &format!("--inflation {largest}"));
    assert_eq!(permits, 0);
    let (permits, _, coverage, _) = replay("new.csv", "--inflation 1");
    assert!(permits == 500 && coverage < 0.93, "{permits} {coverage}");
    // Without the column each estimate has the largest factor.
    let without = estimates(500, 4).replace("since_fix_s", "since");
    folder.write("without.csv", &without);
    let (permits, _, _, err) = replay("without.csv", "--inflation-model m.toml");
    assert!(
        permits == 0 && err.contains("no column `since_fix_s`"),
        "{err}"
    );

    let line = format!("replay {site} new.csv --task dock --inflation-model m.toml");
    for (more, message) in [
        (" --epsilon 0.95", "learnt at epsilon 0.99"),
        (" --inflation 4", "cannot be used with"),
        (
            " --set bounded --translation 0.1 --yaw-deg 1",
            "--set bounded",
        ),
    ] {
        folder
            .run(&format!("{line}{more}"))
            .is_refused_with(&[message]);
    }
}

/// Rows from 2 s after a fix contain no information about fresh estimates.
#[test]
fn age_below_the_data_has_the_largest_factor() {
    let folder = Case::new(&[]);
    let site = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/sites/dock.toml"
    );
    folder.write("e.csv", estimates_from(2.0, 6000, 3));
    let (out, _err) = folder.expect(0, "learn inflation e.csv --epsilon 0.99 -o m.toml");
    assert!(
        out.contains("the data begin 2 s after a fix") && !out.contains("up to"),
        "{out}"
    );
    let (out, _err) = folder.expect(0, "learn inflation e.csv --epsilon 0.99 -o m.toml --json");
    let source = &lines(&out)[0]["source"];
    assert_eq!(source["ages"], serde_json::json!([]));
    assert!(source["inflation"].as_f64().unwrap() > 80.0, "{source}");

    folder.write("fresh.csv", estimates(500, 4));
    let (code, out, err) = run(
        &folder,
        &format!("replay {site} fresh.csv --task dock --json --fast --inflation-model m.toml"),
    );
    assert!(code < 2, "{err}");
    let summary = lines(&out).pop().unwrap();
    assert_eq!(summary["rules"]["gate"]["permits"], 0, "{summary}");
    assert!(err.contains("the data begin 2 s after a fix"), "{err}");
    const COVARIANCE: &str = "cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw";
    let numbers = "1.6e-5,0,0,1.6e-5,0,1.6e-5";
    // A prediction below the data is refused, not extrapolated.
    folder.write(
        "at.csv",
        format!("{COVARIANCE},since_fix_s\n{numbers},1.9\n{numbers},2.1\n"),
    );
    let (_, out, err) = run(&folder, "predict m.toml --at at.csv --json");
    let predicted = lines(&out);
    assert_eq!(predicted.len(), 2, "{out} {err}");
    assert!(
        predicted[0]["inflation"].is_null() && predicted[1]["inflation"].is_f64(),
        "{out} {err}"
    );
}
