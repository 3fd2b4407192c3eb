//! `posegate gate` with movements and with several hypotheses: the contract of the command line.

use posegate_testkit::run::{Case, Ended};
use serde_json::Value;

const DOCK: &[u8] = include_bytes!("../../../examples/tables/dock.posegate");
const HEADER: &str =
    "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,hypothesis\n";

fn gate(estimates: &str, arguments: &str) -> Ended {
    let case = Case::new(&[("dock.posegate", DOCK), ("e.csv", estimates.as_bytes())]);
    case.run(&format!(
        "gate dock.posegate --estimates e.csv --json {arguments}"
    ))
}

/// A movement makes a cylinder wider, exactly.
#[test]
fn bounded_set_grows_by_speed_times_time() {
    let poses = "x_m,y_m,yaw_rad\n0.0,0.0,0.0\n0.02,0.0,0.0\n0.0,0.03,-0.01\n0.04,0.0,0.0\n";
    for (translation, yaw_deg, speed, rate) in [
        (0.01, 0.5, 0.1, 5.0),
        (0.02, 1.0, 0.2, 0.0),
        (0.001, 0.1, 0.0, 10.0),
    ] {
        let grown = gate(
            poses,
            &format!(
                "--set bounded --translation {translation} --yaw-deg {yaw_deg} --max-speed {speed} --max-yaw-rate {rate} --horizon-ms 200"
            ),
        );
        let (translation, yaw_deg) = (translation + 0.2 * speed, yaw_deg + 0.2 * rate);
        let wider = gate(
            poses,
            &format!("--set bounded --translation {translation} --yaw-deg {yaw_deg}"),
        );
        assert_eq!(grown.code, wider.code);
        for (grown, wider) in grown.lines().iter().zip(wider.lines()) {
            assert_eq!(grown["verdict"], wider["verdict"]);
            let margins = [grown, &wider].map(|line| line["margin"].as_f64().expect("a margin"));
            assert!((margins[0] / margins[1] - 1.0).abs() < 2e-3, "{margins:?}");
        }
    }
}

/// A robot whose speed across its axis is not stated may drive sideways: the dock ends at y = 0.06 m, the set at 0.048 m, and it may drive 2 cm.
#[test]
fn set_grows_in_any_direction() {
    let estimates = format!("{HEADER}0,0,0.045,0,1e-6,0,0,1e-6,0,1e-6,0\n");
    let still = gate(&estimates, "");
    assert_eq!(still.code, 0, "{}", still.err);
    let moving = gate(
        &estimates,
        "--max-speed 0.1 --max-yaw-rate 1 --horizon-ms 200",
    );
    assert_eq!(moving.code, 1, "{}", moving.err);
}

/// The dock ends at 0.08 m: an ellipsoid of 1 cm at 99 % reaches 3.37 cm.
#[test]
fn ellipsoid_grows_by_speed_times_time() {
    let estimate = |x: f64| format!("{HEADER}0,{x},0,0,1e-4,0,0,1e-6,0,1e-6,0\n");
    let code = |x: f64, arguments: &str| gate(&estimate(x), arguments).code;
    let moving = "--max-speed 0.1 --max-yaw-rate 1 --horizon-ms 200";
    assert_eq!(code(0.046, ""), 0);
    assert_eq!(code(0.026, moving), 0);
    assert_eq!(code(0.0264, moving), 1);
    let denied = gate(&estimate(0.03), moving).lines();
    assert_eq!(denied[0]["reason"], "not_contained");
    let worst = denied[0]["worst_pose"][0].as_f64().expect("a pose");
    assert!(worst > 0.0795 && worst < 0.0838, "{worst}");
}

#[test]
fn report_is_permitted_if_every_hypothesis_is_inside() {
    let small = "1e-6,0,0,1e-6,0,1e-6";
    let estimates = format!(
        "{HEADER}1,0,0,0,{small},0\n1,0.03,0,0,{small},1\n2,0,0,0,{small},0\n2,0.5,0,0,{small},1\n2,0.6,0,0,{small},2\n3,0,0,0,{small},0\n"
    );
    let output = gate(&estimates, "");
    assert_eq!(output.code, 1);
    let lines = output.lines();
    assert_eq!(lines.len(), 3);
    let verdicts: Vec<&Value> = lines.iter().map(|line| &line["verdict"]).collect();
    assert_eq!(verdicts, ["permit", "deny", "permit"]);
    assert_eq!(lines[1]["index"], 1);
    assert_eq!(lines[1]["hypothesis"], 1);
    assert_eq!(lines[0]["hypothesis"], 1);
    // The margin is that of the hypothesis nearest to the border.
    assert!(lines[0]["margin"].as_f64() < lines[2]["margin"].as_f64());
}

#[test]
fn invalid_movement_or_report_is_refused() {
    let small = "1e-6,0,0,1e-6,0,1e-6";
    let good = format!("{HEADER}1,0,0,0,{small},0\n");
    for (arguments, expected) in [
        ("--max-speed 0.1", "--horizon-ms"),
        ("--horizon-ms 100", "--max-speed"),
        ("--max-speed=-0.1 --horizon-ms 100", "--max-speed"),
        ("--max-speed nan --horizon-ms 100", "--max-speed"),
        ("--max-yaw-rate 1e9 --horizon-ms 100", "--max-yaw-rate"),
        ("--max-speed 0.1 --horizon-ms=-1", "--horizon-ms"),
    ] {
        gate(&good, arguments).is_refused_with(&[expected]);
    }
    let broken = format!("{good}1,0,0,0,{small},2\n");
    gate(&broken, "").is_refused_with(&["e.csv:3"]);
}
