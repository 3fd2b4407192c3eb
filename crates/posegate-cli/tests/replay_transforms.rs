//! `posegate replay` on a bag without `/odom`: `/tf` is the odometry, or the source of poses; and a frame that does not match is named.

use posegate_testkit::bags::{Bag, Pose};
use posegate_testkit::run::{Case, Ended, lines};
use serde_json::Value;

const SITE: &str = include_str!("../../../examples/sites/dock.toml");
/// The odometry's frame in the world: turned and displaced.
const CORRECTION: [f64; 3] = [-3.0, 2.0, 0.7];
const MOVING: &str = "--max-speed 0.1 --max-yaw-rate 5";

/// The place of a robot that drives at 0.05 m/s through the middle of the dock.
fn place(t_s: f64) -> f64 {
    0.05 * (t_s - 4.0)
}

/// That place in the odometry's frame.
fn in_odometry(x: f64) -> [f64; 3] {
    let [cx, cy, turn] = CORRECTION;
    let (s, c) = turn.sin_cos();
    let (dx, dy) = (x - cx, -cy);
    [c * dx + s * dy, c * dy - s * dx, -turn]
}

/// Returns a drive with AMCL's poses twice a second in `frame`, and transforms at 50 Hz as Nav2 writes them. The correction is a
/// second ahead, and messages also contain a wheel.
fn drive(frame: &'static str, base: &str) -> Vec<u8> {
    let mut bag = Bag::new(None, true);
    for k in 0..400u32 {
        let t_s = 1.0 + 0.02 * f64::from(k);
        let odometry = (t_s, "odom", base, in_odometry(place(t_s)));
        let wheel = (t_s, base, "left_wheel", [0.0, 0.1, 0.0]);
        bag.transforms("/tf", t_s, &[wheel, odometry]);
        if k % 5 == 0 {
            bag.transforms("/tf", t_s, &[(t_s + 1.0, "map", "odom", CORRECTION)]);
        }
        if k % 25 == 0 {
            let pose = Pose {
                t_s,
                x: place(t_s),
                frame,
                covariance: [1e-6; 3],
                ..Pose::AT_DOCK
            };
            bag.pose("/amcl_pose", &pose);
        }
    }
    bag.finish()
}

fn replay(bag: &[u8], arguments: &str) -> (Ended, Vec<Value>) {
    let case = Case::new(&[("site.toml", SITE.as_bytes()), ("drive.mcap", bag)]);
    let line = format!("replay site.toml drive.mcap --task dock --rows rows.jsonl {arguments}");
    let ended = case.run(&line);
    let rows = std::fs::read_to_string(case.path().join("rows.jsonl")).unwrap_or_default();
    (ended, lines(&rows))
}

#[test]
fn transforms_replace_a_missing_odometry_topic() {
    for base in ["base_link", "base_footprint"] {
        let bag = drive("map", base);
        let fixes = format!("--json --topic /amcl_pose {MOVING}");
        let (output, _) = replay(&bag, &fixes);
        assert_eq!(output.json(0)["interlock"]["openings"], 0);
        let (output, _) = replay(&bag, &format!("{fixes} --odom /tf"));
        let summary = output.json(0);
        // The correction and the odometry, not the wheel.
        let driven = &summary["odometry"];
        assert_eq!(driven["poses"], 400);
        // What is used is not listed as skipped.
        let recording = &summary["recording"];
        assert!(recording["skipped_topics"]["/tf"].is_null(), "{recording}");
        assert!(
            recording["topics"]["/tf"]
                .as_u64()
                .is_some_and(|count| count >= 400)
        );
        let most = driven["most_m_s"].as_f64().expect("a speed");
        assert!((most - 0.05).abs() < 1e-6, "{driven}");
        let interlock = &summary["interlock"];
        assert_eq!(interlock["openings"], 1, "{interlock}");
        // The dock is 16 cm long: 3.2 s, less the sets and the allowed drive.
        let open = interlock["open_s"].as_f64().expect("seconds");
        assert!((1.5..3.1).contains(&open), "{interlock}");
    }
}

/// An odometry faster than the stated bounds is a jump. The message has the bounds that are sufficient.
#[test]
fn too_fast_odometry_is_reported_with_the_sufficient_speed() {
    let bag = drive("map", "base_link");
    let slow = "--topic /amcl_pose --odom /tf --max-speed 0.03 --max-yaw-rate 5";
    let (output, _) = replay(&bag, slow);
    let text = output.out;
    assert!(text.contains("odometry_jump"), "{text}");
    assert!(text.contains("up to 0.050 m/s"), "{text}");
    assert!(text.contains("give --max-speed 0.051 or more"), "{text}");
    let (output, _) = replay(&bag, &slow.replace("0.03", "0.051"));
    let text = output.out;
    assert!(
        !text.contains("odometry_jump") && !text.contains("or more"),
        "{text}"
    );
}

#[test]
fn pose_is_the_correction_composed_with_the_odometry() {
    let bounded = "--json --topic /tf --set bounded --translation 0.01 --yaw-deg 0.5";
    let (output, rows) = replay(&drive("map", "base_link"), &format!("{bounded} {MOVING}"));
    // The first second has no valid correction.
    assert_eq!(rows.len(), 350);
    for row in &rows {
        let t_s = row["t_s"].as_f64().expect("a time");
        let wanted = [place(t_s), 0.0, 0.0];
        for (found, wanted) in row["pose"].as_array().expect("a pose").iter().zip(wanted) {
            let found = found.as_f64().expect("a number");
            assert!((found - wanted).abs() < 1e-9, "{row}");
        }
    }
    assert_eq!(output.json(0)["interlock"]["openings"], 1);
    // Without a bound there is no uncertainty.
    let (output, _) = replay(&drive("map", "base_link"), "--json --topic /tf");
    assert_eq!(output.json(0)["reasons"]["covariance_unknown"], 350);
}

#[test]
fn missing_odometry_or_frame_is_named() {
    let bag = drive("map", "base_link");
    let (output, _) = replay(&bag, &format!("--topic /amcl_pose --odom /odom {MOVING}"));
    let error = output.with(2).words();
    assert!(error.contains("drive.mcap has no topic /odom"), "{error}");
    assert!(error.contains("--odom /tf"), "{error}");
    let robot = drive("map", "robot");
    for arguments in [
        format!("--topic /amcl_pose --odom /tf {MOVING}"),
        "--topic /tf --set bounded --translation 0.01 --yaw-deg 0.5".into(),
    ] {
        let (output, _) = replay(&robot, &arguments);
        let error = output.with(2).words();
        for words in [
            "map -> odom, 80 times",
            "odom -> robot, 400 times",
            "robot -> left_wheel, 400 times",
            "odom -> base_link or base_footprint",
            "name the frames with --frame, --odom-frame",
        ] {
            assert!(error.contains(words), "{arguments}: {words}: {error}");
        }
        let (output, _) = replay(&robot, &format!("{arguments} --base-frame robot --json"));
        output.json(0);
    }
}

#[test]
fn mismatched_frame_is_named() {
    let bag = drive("odom", "base_link");
    let (output, _) = replay(&bag, "--json --topic /amcl_pose");
    let summary = output.json(0);
    assert_eq!(summary["reasons"]["frame_mismatch"], 16);
    let mismatch = &summary["frame_mismatch"];
    assert_eq!(mismatch["expected"], "map");
    assert_eq!(mismatch["saw"]["odom"], 16, "{mismatch}");
    let (output, _) = replay(&bag, "--topic /amcl_pose");
    let text = output.out;
    assert!(
        text.contains("the frames seen are `odom` (16); expected `map`"),
        "{text}"
    );
    // The text has it also if the fixes are carried along an odometry.
    let (output, _) = replay(&bag, &format!("--topic /amcl_pose --odom /tf {MOVING}"));
    let text = output.out;
    assert!(text.contains("the frames seen are `odom` (16)"), "{text}");
}
