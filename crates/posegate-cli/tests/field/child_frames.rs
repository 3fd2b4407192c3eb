//! Poses of a frame that is not the robot's base.

use posegate_testkit::bags::{Bag, Pose};
use posegate_testkit::run::Case;

const SITE: &str = include_str!("../../../../examples/sites/dock.toml");
/// The antenna's place on the robot.
const FRAME: &str = "\n[frame.antenna]\nx = 0.6\ny = 0.1\nz = 1.2\nroll_deg = 0.0\npitch_deg = 0.0\nyaw_deg = 90.0\n";

/// Poses of a frame on a robot at these places, which stands still.
fn drive(child: &str, [x, y, yaw]: [f64; 3], is_static: bool) -> Vec<u8> {
    let mut bag = Bag::new(None, true);
    for k in 0..20u32 {
        let t_s = 1.0 + 0.1 * f64::from(k);
        let pose = Pose {
            t_s,
            x,
            y,
            yaw,
            covariance: [1e-6; 3],
            ..Pose::AT_DOCK
        };
        bag.odometry_of(child, "/odometry", &pose);
    }
    if is_static {
        let mast = (0.0, "base_link", "mast", [0.6, 0.1, 0.0]);
        let antenna = (
            0.0,
            "mast",
            "antenna",
            [0.0, 0.0, std::f64::consts::FRAC_PI_2],
        );
        bag.transforms("/tf_static", 3.0, &[mast, antenna]);
    }
    bag.finish()
}

const REPLAY: &str = "replay site.toml drive.mcap --task dock --topic /odometry --json";
/// The antenna of a robot at the dock, turned as it is mounted.
const AT_DOCK: [f64; 3] = [0.6, 0.1, std::f64::consts::FRAC_PI_2];

fn permits(site: &str, bag: &[u8], arguments: &str) -> [u64; 2] {
    let case = Case::new(&[("site.toml", site.as_bytes()), ("drive.mcap", bag)]);
    let summary = case.run(&format!("{REPLAY} {arguments}")).json(0);
    let all = &summary["rules"]["gate"];
    let permits = all["permits"]
        .as_u64()
        .unwrap_or_else(|| panic!("{summary:#}"));
    [permits, summary["estimates"].as_u64().expect("a count")]
}

#[test]
fn unknown_child_frame_is_refused_with_advice() {
    let bag = drive("antenna", [0.0; 3], false);
    let case = Case::new(&[("site.toml", SITE.as_bytes()), ("drive.mcap", &bag)]);
    case.run(REPLAY).is_refused_with(&[
        "/odometry has poses of the frame `antenna`",
        "[frame.antenna]",
        "--child-frame antenna",
    ]);
    let summary = case.run(&format!("{REPLAY} --child-frame antenna")).json(0);
    assert_eq!(summary["child_frames"], serde_json::json!(["antenna"]));
    let text = case.run(&REPLAY.replace("--json", "--child-frame antenna"));
    assert!(
        text.out
            .contains("child frames: `antenna`, as the robot's base"),
        "{}",
        text.out
    );
    let fixes = "replay site.toml drive.mcap --task dock --topic /odometry --child-frame antenna";
    assert_eq!(
        case.run(&format!(
            "{fixes} --set bounded --translation 0.01 --yaw-deg 1"
        ))
        .code,
        0
    );
}

/// The advice is what a site and a command can have.
#[test]
fn advice_fits_names_with_slashes_and_empty_names() {
    let bag = drive("robot1/antenna", AT_DOCK, false);
    let case = Case::new(&[("site.toml", SITE.as_bytes()), ("drive.mcap", &bag)]);
    case.run(REPLAY)
        .is_refused_with(&["[frame.\"robot1/antenna\"]", "frame robot1/antenna"]);
    let frame = FRAME.replace("antenna", "\"robot1/antenna\"");
    assert_eq!(permits(&format!("{SITE}{frame}"), &bag, ""), [20, 20]);
    let bag = drive("", [0.0; 3], false);
    let case = Case::new(&[("site.toml", SITE.as_bytes()), ("drive.mcap", &bag)]);
    case.run(REPLAY)
        .is_refused_with(&["name no child frame", "--child-frame base_link"]);
    assert_eq!(permits(SITE, &bag, "--child-frame base_link"), [20, 20]);
}

#[test]
fn child_frame_with_a_place_gives_the_pose_of_the_base() {
    let with_frame = format!("{SITE}{FRAME}");
    let bag = drive("antenna", AT_DOCK, false);
    let [permits_at_dock, all] = permits(&with_frame, &bag, "");
    assert_eq!([permits_at_dock, all], [20, 20]);
    let case = Case::new(&[("site.toml", with_frame.as_bytes()), ("drive.mcap", &bag)]);
    let text = case.run(&REPLAY.replace("--json", ""));
    let words = "child frames: `antenna` at (0.600 m, 0.100 m, 90.0 deg) on the robot";
    assert!(text.out.contains(words), "{}", text.out);
    // The antenna at the dock: the robot is 0.6 m away.
    assert_eq!(
        permits(&with_frame, &drive("antenna", [0.0; 3], false), ""),
        [0, 20]
    );
    assert_eq!(
        permits(&with_frame, &drive("/antenna", AT_DOCK, false), ""),
        [20, 20]
    );
    assert_eq!(
        permits(SITE, &drive("base_footprint", [0.0; 3], false), ""),
        [20, 20]
    );
}

#[test]
fn static_transforms_of_the_bag_give_the_place() {
    assert_eq!(
        permits(SITE, &drive("antenna", AT_DOCK, true), ""),
        [20, 20]
    );
    assert_eq!(
        permits(SITE, &drive("antenna", [0.0; 3], true), ""),
        [0, 20]
    );
    // A name accepts a frame, and does not hide its place.
    let named = "--child-frame antenna";
    assert_eq!(
        permits(SITE, &drive("antenna", AT_DOCK, true), named),
        [20, 20]
    );
}

#[test]
fn heading_error_of_a_lever_widens_the_set() {
    // 1.5 degrees of heading at 0.6 m are 16 mm: the covariance of the base has it, and the dock is 6 cm wide.
    let site = format!("{SITE}{FRAME}");
    let mut bag = Bag::new(None, true);
    let pose = |t_s| Pose {
        t_s,
        x: 0.6,
        y: 0.1,
        yaw: std::f64::consts::FRAC_PI_2,
        covariance: [1e-6, 1e-6, 7e-4],
        ..Pose::AT_DOCK
    };
    bag.odometry_of("antenna", "/odometry", &pose(1.0));
    let bag = bag.finish();
    let case = Case::new(&[("site.toml", site.as_bytes()), ("drive.mcap", &bag)]);
    let summary = case
        .run(&format!(
            "{REPLAY} --set bounded --translation 0.05 --yaw-deg 1.5"
        ))
        .json(0);
    // 5 cm and 16 mm.
    assert_eq!(summary["reasons"]["not_contained"], 1, "{summary:#}");
    let summary = case
        .run(&format!(
            "{REPLAY} --set bounded --translation 0.04 --yaw-deg 1.5"
        ))
        .json(0);
    assert_eq!(summary["reasons"], serde_json::json!({}), "{summary:#}");
    case.run(&format!("{REPLAY} --cross-terms yaw-unknown"))
        .is_refused_with(&["without cross terms", "--set bounded"]);
}

#[test]
fn poses_of_a_camera_use_the_named_frame() {
    let site = format!("{SITE}{FRAME}");
    let trajectory = "1.0 0.6 0.1 0 0 0 0.70710678118654752 0.70710678118654752\n";
    let mut bag = Bag::new(None, true);
    let [x, y, yaw] = AT_DOCK;
    bag.truth(
        "/slam",
        &Pose {
            x,
            y,
            yaw,
            ..Pose::AT_DOCK
        },
    );
    let bag = bag.finish();
    let case = Case::new(&[
        ("site.toml", site.as_bytes()),
        ("drive.mcap", &bag),
        ("slam.txt", trajectory.as_bytes()),
    ]);
    let bounded = "--task dock --json --set bounded --translation 0.01 --yaw-deg 0.5";
    for log in ["drive.mcap --topic /slam", "slam.txt"] {
        for (named, reasons) in [
            ("--child-frame antenna", serde_json::json!({})),
            ("", serde_json::json!({"outside_table": 1})),
        ] {
            let summary = case
                .run(&format!("replay site.toml {log} {bounded} {named}"))
                .json(0);
            assert_eq!(summary["reasons"], reasons, "{log} {named}");
        }
    }
}

/// An optical frame looks along z: its poses are tilted by 90 degrees until its place is named.
#[test]
fn tilt_of_a_camera_is_reported_with_the_option() {
    let frame = "\n[frame.optical]\nx = 0.2\ny = 0.0\nz = 0.5\nroll_deg = -90.0\npitch_deg = 0.0\nyaw_deg = -90.0\n";
    let site = format!("{SITE}{frame}");
    // The optical frame of a robot at the dock: z ahead, x right, y down.
    let trajectory = "1.0 0.2 0 0.5 -0.5 0.5 -0.5 0.5\n";
    let case = Case::new(&[
        ("site.toml", site.as_bytes()),
        ("slam.txt", trajectory.as_bytes()),
    ]);
    let replay =
        "replay site.toml slam.txt --task dock --set bounded --translation 0.01 --yaw-deg 0.5";
    let tilted = case.run(replay);
    for words in ["tilted", "by up to 90.0 deg", "--child-frame"] {
        assert!(tilted.out.contains(words), "{}", tilted.out);
    }
    let found = case
        .run(&format!("{replay} --json --child-frame optical"))
        .json(0);
    assert_eq!(found["reasons"], serde_json::json!({}), "{found:#}");
}
