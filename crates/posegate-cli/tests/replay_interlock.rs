//! `posegate replay`: the reasons of a shut interlock, and the setting that opens it.

use posegate_testkit::run::Case;
use serde_json::Value;

const SITE: &str = include_str!("../../../examples/sites/dock.toml");

/// Replays estimates at the dock: one line `t_s x_m` each, with a standard deviation of 1 mm and 0.001 rad.
fn replay(estimates: &[(f64, f64)], arguments: &str) -> Value {
    let header = "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n";
    let rows = estimates
        .iter()
        .map(|(t, x)| format!("{t},{x},0,0,1e-6,0,0,1e-6,0,1e-6\n"));
    let text = header.to_string() + &rows.collect::<String>();
    let case = Case::new(&[("site.toml", SITE.as_bytes()), ("log.csv", text.as_bytes())]);
    let line = format!("replay site.toml log.csv --task dock --json {arguments}");
    case.json(0, &line)
}

fn every(period_s: f64, count: u32, x: f64) -> Vec<(f64, f64)> {
    (0..count).map(|k| (f64::from(k) * period_s, x)).collect()
}

fn openings(summary: &Value) -> u64 {
    summary["interlock"]["openings"].as_u64().expect("a count")
}

/// The report names the least value with which the interlock opens.
#[test]
fn deciding_setting_is_reported_with_the_least_value_that_opens() {
    let slow = every(0.5, 20, 0.0);
    let mut lost = every(0.02, 40, 0.0);
    for (index, estimate) in lost.iter_mut().enumerate() {
        if index % 4 == 3 {
            // Outside of the dock.
            estimate.1 = 1.0;
        }
    }
    for (estimates, name, given, flag, other) in [
        (
            &slow,
            "permit_hold_ms",
            100,
            "--permit-hold-ms",
            "--max-age-ms 900",
        ),
        (
            &slow,
            "max_age_ms",
            200,
            "--max-age-ms",
            "--permit-hold-ms 900",
        ),
        (
            &lost,
            "permits_in_a_row",
            4,
            "--permits-in-a-row",
            "--inhibit-hold-ms 1",
        ),
    ] {
        let with = |value: u64| replay(estimates, &format!("{flag} {value} {other}"));
        let summary = with(given);
        let interlock = &summary["interlock"];
        assert_eq!(openings(&summary), 0);
        assert_eq!(interlock["setting"]["name"], name, "{interlock}");
        assert_eq!(interlock["setting"]["value"], given);
        let opens_with = interlock["setting"]["opens_with"]
            .as_u64()
            .expect("a value");
        assert!(openings(&with(opens_with)) > 0, "{name} {opens_with}");
        let not_enough = if name == "permits_in_a_row" {
            opens_with + 1
        } else {
            opens_with - 2
        };
        assert_eq!(openings(&with(not_enough)), 0, "{name} {not_enough}");
        let words = interlock["why"].as_str().expect("words");
        assert!(words.contains(&format!("{flag} {opens_with}")), "{words}");
    }
}

#[test]
fn open_and_shut_seconds_add_up() {
    let summary = replay(&every(0.02, 200, 0.0), "");
    let interlock = &summary["interlock"];
    assert_eq!(openings(&summary), 1);
    assert!(interlock.get("why").is_none());
    let open = interlock["open_s"].as_f64().expect("seconds");
    let shut = interlock["shut_s_by"].as_object().expect("reasons");
    let sum: f64 = shut
        .values()
        .map(|value| value.as_f64().expect("seconds"))
        .sum();
    let recorded = summary["gate"]["recorded_s"].as_f64().expect("seconds");
    assert!((open + sum - recorded).abs() < 1e-9, "{interlock}");
    assert!(open > 3.0 && shut.contains_key("qualifying"), "{interlock}");
}

/// The dock is 8 cm deep. At 0.3 m/s the robot drives 6 cm until the permission ends.
#[test]
fn moving_robot_is_denied_where_a_still_robot_is_permitted() {
    let near = every(0.02, 100, 0.04);
    let long = "--permit-hold-ms 180";
    assert!(openings(&replay(&near, long)) > 0);
    let moving = replay(&near, &format!("{long} --max-speed 0.3 --max-yaw-rate 10"));
    assert_eq!(openings(&moving), 0);
    assert_eq!(moving["reasons"]["not_contained"], 100);
    let centred = every(0.02, 100, 0.0);
    let moving = replay(&centred, "--max-speed 0.2 --max-yaw-rate 5");
    assert!(openings(&moving) > 0);
}
