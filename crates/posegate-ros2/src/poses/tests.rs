use super::*;
use crate::fixtures::{self, TABLE, pose, with_variances};
use crate::message::{Header, Odometry, PoseWithCovariance, TransformStamped};
use posegate::set::Uncertainty;
use std::fs;

fn poses(line: &str) -> Poses {
    Poses::new(&fixtures::settings(TABLE, line).poses, "/pose")
}

const STILL: &str = "--ros-args -p stands_still:=true";

fn header(frame: &str) -> Header {
    Header {
        stamp: Time { sec: 9, nanosec: 5 },
        frame_id: frame.into(),
    }
}

fn odometry(child: &str, x: f64, variance: f64) -> Odometry {
    fixtures::odometry(header("map"), child, with_variances(x, [variance; 3]))
}

impl Poses {
    fn odometry(&mut self, message: Odometry) -> PoseReport {
        let PoseWithCovariance { pose, covariance } = message.pose;
        self.pose(
            message.header,
            Some(message.child_frame_id),
            &pose,
            Some(covariance),
        )
    }
}

/// The site of the table, with the place of an antenna and an origin.
fn site() -> std::path::PathBuf {
    let text = include_str!("../../../../examples/sites/dock.toml");
    let added = "[origin]\nx = 1000.0\ny = 0.0\n\n[frame.antenna]\nx = 0.5\ny = 0.0\nz = 1.0\nroll_deg = 0.0\npitch_deg = 0.0\nyaw_deg = 0.0\n";
    let path = std::env::temp_dir().join(format!("posegate-poses-{}.toml", std::process::id()));
    fs::write(&path, format!("{text}\n{added}")).unwrap();
    path
}

#[test]
fn pose_of_another_frame_is_refused_or_moved_to_the_base() {
    let mut plain = poses(STILL);
    for base in ["base_link", "/base_footprint"] {
        assert!(plain.odometry(odometry(base, 0.0, 1e-4)).pose.is_ok());
    }
    let refused = plain
        .odometry(odometry("antenna", 0.0, 1e-4))
        .pose
        .unwrap_err();
    assert_eq!(refused.reason(), Reason::FrameMismatch);
    let words = refused.to_string();
    assert!(
        words.contains("[frame.antenna]") && words.contains("child_frame_id:=antenna"),
        "{words}"
    );
    let refused = plain.odometry(odometry("robot1/gps", 0.0, 1e-4)).pose;
    let words = refused.unwrap_err().to_string();
    assert!(words.contains("[frame.\"robot1/gps\"]"), "{words}");
    let mut named = poses(&format!("{STILL} -p child_frame_id:=robot1/base_link"));
    assert!(
        named
            .odometry(odometry("robot1/base_link", 0.0, 1e-4))
            .pose
            .is_ok()
    );
}

#[test]
fn pose_without_covariance_has_the_stated_bound() {
    let mut bounded = poses(&format!(
        "{STILL} -p pose_type:=pose -p set_translation_m:=0.02 -p set_yaw_deg:=1"
    ));
    let report = bounded.pose(header("map"), None, &pose(0.25), None);
    let estimate = report.pose.unwrap();
    assert_eq!((report.frame.as_str(), estimate.x_m), ("map", 0.25));
    let Some(Uncertainty::Bounded {
        translation_m,
        yaw_rad,
    }) = estimate.spread
    else {
        panic!("{estimate:?}");
    };
    assert_eq!((translation_m, yaw_rad), (0.02, 1f64.to_radians()));
}

#[test]
fn covariances_of_zero_and_fixed_ones_are_refused_by_name() {
    let mut plain = poses(STILL);
    let zero = plain
        .odometry(odometry("base_link", 0.0, 0.0))
        .pose
        .unwrap_err();
    assert_eq!(zero, RefusedPose::ZeroCovariance);
    assert!(zero.to_string().contains("set_translation_m"));
    // The same pose may come any number of times.
    for _ in 0..50 {
        assert!(
            plain
                .odometry(odometry("base_link", 0.0, 1e-4))
                .pose
                .is_ok()
        );
    }
    let mut accepted = 0;
    let refused = loop {
        accepted += 1;
        match plain
            .odometry(odometry("base_link", 0.01 * f64::from(accepted), 1e-4))
            .pose
        {
            Ok(_) => assert!(accepted < 50),
            Err(refused) => break refused,
        }
    };
    assert_eq!((accepted, refused), (19, RefusedPose::FixedCovariance(20)));
    // Another covariance is an uncertainty again; a stated bound replaces a fixed one.
    assert!(
        plain
            .odometry(odometry("base_link", 0.0, 2e-4))
            .pose
            .is_ok()
    );
    let mut bounded = poses(&format!(
        "{STILL} -p set_translation_m:=0.02 -p set_yaw_deg:=1"
    ));
    for k in 0..50 {
        let report = bounded.odometry(odometry("base_link", 0.01 * f64::from(k), 0.0));
        assert!(matches!(
            report.pose.unwrap().spread,
            Some(Uncertainty::Bounded { .. })
        ));
    }
}

#[test]
fn transforms_of_one_robot_give_its_pose() {
    let mut tf = poses(&format!(
        "{STILL} -p pose_type:=tf -p set_translation_m:=0.02 -p set_yaw_deg:=1"
    ));
    let message = |parent: &str, child: &str, sec: i32, x: f64| {
        [TransformStamped {
            header: Header {
                stamp: Time { sec, nanosec: 7 },
                frame_id: parent.into(),
            },
            child_frame_id: child.into(),
            translation: [x, 0.0, 0.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
        }]
    };
    let [localization, wheels, other] = [[1; 16], [2; 16], [3; 16]];
    assert!(
        tf.transforms(&message("odom", "base_link", 10, 0.5), wheels)
            .is_none()
    );
    let report = tf
        .transforms(&message("map", "odom", 10, 1.0), localization)
        .unwrap();
    assert_eq!(
        (report.stamp, report.frame.as_str()),
        (
            Time {
                sec: 10,
                nanosec: 7
            },
            "map"
        )
    );
    assert!((report.pose.unwrap().x_m - 1.5).abs() < 1e-9);
    // The odometry of another robot with the same frames, and of this one again: both are refused.
    for (k, publisher) in [other, wheels].into_iter().enumerate() {
        let report = tf.transforms(&message("odom", "base_link", 11 + k as i32, 0.5), publisher);
        let refused = report.unwrap().pose.unwrap_err();
        assert_eq!(refused.reason(), Reason::SourceChanged);
    }
}

#[test]
fn place_and_origin_of_the_site_are_used() {
    let path = site();
    let site = posegate_site::Site::read(&path).unwrap();
    fs::remove_file(&path).unwrap();
    let settings = PoseSettings {
        kind: PoseType::Odometry,
        bound: None,
        body: BodyFrames::new(&site.frames).with_origin(site.map_origin),
        names: FrameNames::default(),
        radius_squared: 11.3449,
    };
    let mut poses = Poses::new(&settings, "/pose");
    let estimate = poses
        .odometry(odometry("antenna", 1000.6, 1e-4))
        .pose
        .unwrap();
    assert!((estimate.x_m - 0.1).abs() < 1e-9, "{estimate:?}");
}
