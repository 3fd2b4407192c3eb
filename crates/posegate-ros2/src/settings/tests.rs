use super::*;
use crate::fixtures::{TABLE, arguments};
use posegate::set::{CrossTerms, Inflation};

fn settings(line: &str) -> Result<NodeSettings, SettingsError> {
    NodeSettings::new(&arguments(&format!("dock.posegate {line}")), TABLE)
}

const STILL: &str = "--ros-args -p stands_still:=true";
const DETECTIONS: &str = "--ros-args -p stands_still:=true -p use_detections:=true";

/// The site of the table.
fn site() -> String {
    concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/sites/dock.toml"
    )
    .into()
}

fn other_site() -> String {
    concat!(env!("CARGO_MANIFEST_DIR"), "/tests/live/tags.toml").into()
}

#[test]
fn site_file_gives_the_detector() {
    let line = format!("--site {} {DETECTIONS} -p max_hamming:=1", site());
    let given = settings(&line).unwrap();
    let detector = given.detector.as_ref().unwrap();
    assert_eq!(detector.camera_name(), "front");
    assert_eq!(detector.settings().corner_sigma_px, 0.5);
    assert_eq!(detector.settings().max_hamming, 1);
    assert!(given.site_is_checked);
    assert_eq!(given.trust.cross_terms, CrossTerms::Filled);
    let [detections, camera_info] = [given.detections_delivery, given.camera_info_delivery];
    assert!(detections.reliable && !detections.transient_local && !camera_info.reliable);
    // The site file is also checked without detections.
    let alone = settings(&format!("--site {} {STILL}", site())).unwrap();
    assert!(alone.site_is_checked && alone.detector.is_none());
}

#[test]
fn parameters_become_settings() {
    let moving = settings(
        "--ros-args -p max_speed:=0.3 -p max_yaw_rate_deg:=30.0 -p inflation:=2 -p restart:=on_reset -p look_at:=7",
    )
    .unwrap();
    let gate = moving.gate();
    assert_eq!(gate.task, "dock");
    assert_eq!(gate.restart, Restart::OnReset);
    assert_eq!(gate.look_at, Some(7));
    assert_eq!((gate.response_ms, gate.maximum_age_ms), (290, 1_500));
    assert_eq!(
        gate.sources[0].motion,
        MotionBounds::in_any_direction(0.3, 30f64.to_radians()).unwrap()
    );
    assert_eq!(
        gate.sources[0].trust.inflation,
        Inflation::new(2.0).unwrap()
    );
    assert!(matches!(
        gate.sources[0].trust.cross_terms,
        CrossTerms::YawUnknown(_)
    ));
    assert!(!moving.site_is_checked && moving.tracker.is_none());
    let along =
        settings("--ros-args -p max_speed:=0.3 -p max_speed_across:=0.0 -p max_yaw_rate_deg:=30.0");
    assert_eq!(
        along.unwrap().bounds,
        MotionBounds::new(0.3, 0.0, 30f64.to_radians()).unwrap()
    );
    let still = settings(STILL).unwrap();
    assert_eq!(still.bounds, MotionBounds::STANDS_STILL);
}

#[test]
fn movement_in_a_set_is_told() {
    // 0.3 m/s for the hold, 800 ms, the response, 290 ms, and 1 ms.
    let moving = settings("--ros-args -p max_speed:=0.3 -p max_yaw_rate_deg:=30.0").unwrap();
    let words = moving.movement().unwrap();
    assert!(words.contains("0.327 m and 32.7 degrees"), "{words}");
    let turning = settings("--ros-args -p max_speed:=0.0 -p max_yaw_rate_deg:=30.0").unwrap();
    assert!(turning.movement().is_some());
    assert!(settings(STILL).unwrap().movement().is_none());
}

/// Exactly one of the tracker and the gate's source must apply the trust.
#[test]
fn trust_is_applied_once() {
    let line = format!(
        "{STILL} -p use_odometry:=true -p odometry_m_per_sqrt_m:=0.01 -p odometry_rad_per_sqrt_rad:=0.02 \
         -p odometry_rad_per_sqrt_m:=0.01 -p odometry_slip:=0.02 -p inflation:=3.0"
    );
    let carried = settings(&line).unwrap();
    assert_eq!(carried.gate().sources[0].trust, Trust::FULL);
    assert_eq!(carried.tracker.unwrap().trust, carried.trust);
    assert_eq!(
        settings(&format!("{STILL} -p inflation:=3.0"))
            .unwrap()
            .gate()
            .sources[0]
            .trust,
        carried.trust
    );
}

#[test]
fn invalid_parameters_have_their_own_errors() {
    let digest = settings(STILL).unwrap().site();
    let other = digest.replace(|c: char| c != '0', "0");
    for (line, words) in [
        ("".to_owned(), "how fast the robot moves"),
        (
            "--ros-args -p max_speed:=0.3".into(),
            "how fast the robot moves",
        ),
        (
            "--ros-args -p max_speed:=0.0 -p max_yaw_rate_deg:=0.0".into(),
            "how fast the robot moves",
        ),
        (format!("{STILL} -p max_speed:=0.3"), "one or the other"),
        (
            "--ros-args -p max_speed:=-0.3 -p max_yaw_rate_deg:=3".into(),
            "not below zero",
        ),
        (
            "--ros-args -p max_speed:=.nan -p max_yaw_rate_deg:=3".into(),
            "not below zero",
        ),
        (
            "--ros-args -p max_speed:=2000 -p max_yaw_rate_deg:=3".into(),
            "up to 1000 m/s",
        ),
        (
            format!("{STILL} -p inflaton:=2.0"),
            "did you mean `inflation`?",
        ),
        (format!("{STILL} -p inflation:=0.5"), "from 1 to 4096"),
        (format!("{STILL} -p cross_terms:=none"), "`yaw_unknown`"),
        (format!("{STILL} -p maximum_age_ms:=0"), "from 1 to 60000"),
        (format!("{STILL} -p maximum_age_ms:=1.5"), "whole number"),
        (
            format!("{STILL} -p maximum_age_ms:=290"),
            "maximum_age_ms is not above",
        ),
        (format!("{STILL} -p valid_ms:=99"), "twice heartbeat_ms"),
        (
            format!("{STILL} -p cycle_ms:=60"),
            "heartbeat_ms is less than cycle_ms",
        ),
        (format!("{STILL} -p permits_in_a_row:=0"), "from 1 to 65535"),
        (format!("{STILL} -p frame_id:=/"), "no frame"),
        (format!("{STILL} -p restart:=never"), "`on_reset`"),
        (
            format!("{STILL} -p use_odometry:=true"),
            "errors of the odometry",
        ),
        (
            format!("{STILL} -p use_sim_time:=true"),
            "clock that cannot stop",
        ),
        (
            format!("{STILL} -p use_detections:=true"),
            "give --site FILE",
        ),
        (
            format!("{STILL} -p corner_sigma_px:=0.3"),
            "is for detections of tags: leave it out, or set use_detections to true",
        ),
        (
            format!("{STILL} -p use_detections:=true -p cross_terms:=filled"),
            "is for poses",
        ),
        (
            format!("--site {} {STILL}", other_site()),
            "made from another site file",
        ),
        (
            format!("--site /no/such.toml {STILL}"),
            "the site file cannot be used",
        ),
        (
            format!("--site {} {DETECTIONS} -p camera:=rear", site()),
            "no camera `rear`: it has front",
        ),
        (
            format!("--site {} {DETECTIONS} -p corner_sigma_px:=0", site()),
            "pixels from 0.01 to 100",
        ),
        (
            format!("--site {} {DETECTIONS} -p max_hamming:=4", site()),
            "from 0 to 3",
        ),
        (format!("{STILL} -p task:=park"), "for the task `dock`"),
        (
            format!("{STILL} -p task_digest:=abc"),
            "64 hexadecimal digits",
        ),
        (
            format!("--task-digest {other} {STILL}"),
            "another site file",
        ),
    ] {
        let message = match settings(&line) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("accepted: {line}"),
        };
        assert!(message.contains(words), "{line}: {message}");
    }
    assert!(
        settings(&format!("--task-digest {digest} {STILL}"))
            .unwrap()
            .site_is_checked
    );
}

#[test]
fn invalid_table_bytes_are_refused() {
    let refused = NodeSettings::new(&arguments("x"), &TABLE[..100]);
    assert!(matches!(refused, Err(SettingsError::Table(_))));
}

/// The gate is on the controller: settings of a gate in the node would have no effect, so they are refused.
#[test]
fn with_a_controller_only_settings_of_the_node_are_accepted() {
    let line = "--serial /dev/ttyUSB0 --baud 921600 --ros-args -p link_timeout_ms:=200 -p valid_ms:=300 -p task:=dock";
    let serial = settings(line).unwrap().serial.unwrap();
    assert_eq!(
        (serial.path.to_str(), serial.baud, serial.link_timeout_ms),
        (Some("/dev/ttyUSB0"), 921_600, 200)
    );
    let serial = settings("--serial /dev/ttyS1").unwrap().serial.unwrap();
    assert_eq!((serial.baud, serial.link_timeout_ms), (115_200, 150));
    for name in [
        "max_speed:=0.3",
        "stands_still:=true",
        "inflation:=2.0",
        "permit_hold_ms:=100",
        "use_odometry:=true",
        "markers:=true",
    ] {
        let error = settings(&format!("--serial /dev/ttyS1 --ros-args -p {name}")).unwrap_err();
        assert!(
            matches!(error, SettingsError::OfTheController { .. }),
            "{name}: {error}"
        );
    }
    for (line, words) in [
        (
            "--serial /dev/ttyS1 --ros-args -p task:=park",
            "is for the task `dock`",
        ),
        (
            "--serial /dev/ttyS1 --ros-args -p link_timeout_ms:=0",
            "from 1 to 500",
        ),
        (
            "--serial /dev/ttyS1 --ros-args -p use_sim_time:=true",
            "use_sim_time is true",
        ),
        (
            "--serial /dev/ttyS1 --ros-args -p valid_ms:=60",
            "twice heartbeat_ms",
        ),
        (
            "--ros-args -p stands_still:=true -p link_timeout_ms:=9",
            "without --serial",
        ),
    ] {
        let message = settings(line).unwrap_err().to_string();
        assert!(message.contains(words), "{line}: {message}");
    }
}
