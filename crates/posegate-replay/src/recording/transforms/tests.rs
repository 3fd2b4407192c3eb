use super::*;
use crate::recording::yaw_of;

fn transform(stamp_s: f64, names: [&str; 2], [x, y, yaw]: [f64; 3]) -> Transform {
    let (sin, cos) = (0.5 * yaw).sin_cos();
    Transform {
        stamp_ns: (stamp_s * 1e9) as i64,
        parent: names[0].into(),
        child: names[1].into(),
        pose: Pose {
            position: [x, y, 0.0],
            orientation: [0.0, 0.0, sin, cos],
        },
    }
}

fn level(pose: &Pose) -> [f64; 3] {
    [pose.position[0], pose.position[1], yaw_of(pose.orientation)]
}

fn is_near(pose: &Pose, expected: [f64; 3]) -> bool {
    let near = |(a, b): (f64, f64)| (a - b).abs() < 1e-9;
    level(pose).into_iter().zip(expected).all(near)
}

const CORRECTION: [&str; 2] = ["map", "odom"];
const ODOMETRY: [&str; 2] = ["odom", "base_link"];

/// The correction is turned by a quarter: 1 m ahead in the odometry's frame is 1 m to the left in the world.
#[test]
fn pose_is_odometry_transformed_by_the_correction() {
    let quarter = core::f64::consts::FRAC_PI_2;
    let mut composer = Composer::default();
    assert_eq!(
        composer.add(&transform(1.0, ODOMETRY, [1.0, 0.0, 0.1])),
        None
    );
    // As AMCL: a second ahead of the odometry. At 1 s there is no correction yet.
    let ahead = transform(2.0, CORRECTION, [5.0, 7.0, quarter]);
    assert_eq!(composer.add(&ahead), None);
    assert_eq!(
        composer.add(&transform(1.5, ODOMETRY, [1.2, 0.0, 0.1])),
        None
    );
    let (time, pose) = composer
        .add(&transform(2.0, ODOMETRY, [1.4, 0.3, 0.1]))
        .unwrap();
    assert_eq!(time, 2_000_000_000);
    assert!(is_near(&pose, [4.7, 8.4, quarter + 0.1]), "{pose:?}");
}

/// Between two corrections the pose is interpolated. After the last correction the time does not advance.
#[test]
fn corrections_are_interpolated_and_never_extrapolated() {
    let mut composer = Composer::default();
    composer.add(&transform(1.0, CORRECTION, [0.0, 0.0, 0.0]));
    composer.add(&transform(2.0, CORRECTION, [0.2, 0.0, 0.4]));
    let (time, pose) = composer.add(&transform(1.25, ODOMETRY, [0.0; 3])).unwrap();
    assert_eq!(time, 1_250_000_000);
    assert!(is_near(&pose, [0.05, 0.0, 0.1]), "{pose:?}");
    let (time, pose) = composer
        .add(&transform(3.25, ODOMETRY, [1.0, 0.0, 0.0]))
        .unwrap();
    assert_eq!(time, 2_000_000_000);
    let along = 0.375;
    let (s, c) = 0.4f64.sin_cos();
    assert!(
        is_near(&pose, [0.2 + along * c, along * s, 0.4]),
        "{pose:?}"
    );
    assert_eq!(
        composer.add(&transform(4.0, ODOMETRY, [2.0, 0.0, 0.0])),
        None
    );
    // A transform with an earlier stamp is ignored.
    assert_eq!(
        composer.add(&transform(1.5, CORRECTION, [9.0, 0.0, 0.0])),
        None
    );
    let (time, _) = composer
        .add(&transform(5.0, CORRECTION, [0.2, 0.0, 0.4]))
        .unwrap();
    assert_eq!(time, 4_000_000_000);
}

#[test]
fn other_frames_are_ignored() {
    let mut composer = Composer::new(FrameNames {
        world: "hall".into(),
        odometry: "/odom".into(),
        base: Some("robot".into()),
    });
    assert!(
        composer
            .add(&transform(1.0, CORRECTION, [1.0, 0.0, 0.0]))
            .is_none()
    );
    assert!(!composer.is_odometry(&transform(1.0, ODOMETRY, [0.0; 3])));
    assert!(composer.is_odometry(&transform(1.0, ["odom", "/robot"], [0.0; 3])));
    // A child frame with another name does not become the robot's frame.
    let mut composer = Composer::default();
    assert!(!composer.is_odometry(&transform(1.0, ["odom", "imu"], [0.0; 3])));
    assert!(composer.is_odometry(&transform(1.0, ["odom", "base_footprint"], [0.0; 3])));
    assert!(!composer.is_odometry(&transform(1.0, ODOMETRY, [0.0; 3])));
}

/// A quaternion that is not of length 1 or not a number is not corrected.
#[test]
fn invalid_numbers_stay_invalid() {
    for factor in [0.5, f64::NAN] {
        let mut composer = Composer::default();
        let mut bad = transform(1.0, CORRECTION, [0.0; 3]);
        composer.add(&bad);
        bad.stamp_ns *= 3;
        bad.pose.orientation = bad.pose.orientation.map(|entry| factor * entry);
        composer.add(&bad);
        let (_, pose) = composer
            .add(&transform(2.0, ODOMETRY, [1.0, 0.0, 0.0]))
            .unwrap();
        let size = length(pose.orientation);
        assert!(!((size - 1.0).abs() < 0.1), "{pose:?}");
    }
}

/// A localization without odometry publishes the pose itself: each newer one counts once, and none does beside an odometry.
#[test]
fn transform_from_world_to_robot_is_the_pose() {
    const DIRECT: [&str; 2] = ["map", "base_link"];
    let mut composer = Composer::default();
    let (time, pose) = composer
        .add(&transform(1.0, DIRECT, [1.0, 2.0, 0.5]))
        .unwrap();
    assert_eq!(time, 1_000_000_000);
    assert!(is_near(&pose, [1.0, 2.0, 0.5]), "{pose:?}");
    assert_eq!(composer.add(&transform(1.0, DIRECT, [9.0; 3])), None);
    assert_eq!(
        composer.add(&transform(2.0, ["map", "camera"], [9.0; 3])),
        None
    );
    composer.add(&transform(2.0, ODOMETRY, [0.0; 3]));
    assert_eq!(composer.add(&transform(3.0, DIRECT, [9.0; 3])), None);
}
