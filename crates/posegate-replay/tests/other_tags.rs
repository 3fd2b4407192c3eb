//! A model that was learnt with tags of one size, scaled to tags of another size that the same camera sees. A model of one mount of
//! the camera is not valid for another mount.

use posegate::shape::{Camera, Pose3Deg, Tag, Tolerance};
use posegate_learn::{
    BoundsSettings, Detection, Detections, ErrorModel, Runs, TakenWith, learn_bounds,
};
use posegate_replay::corners::{MountedCamera, TagObservation, locate};
use posegate_testkit::counts;
use posegate_testkit::oracle::Rng;
use rayon::prelude::*;
use std::sync::LazyLock;

const QUANTILE: f64 = 0.9;
const FOCAL: f64 = 615.0;
/// The camera is behind the robot's reference point, so the robot is between camera and tag.
const MOUNT: Pose3Deg = Pose3Deg {
    x: -1.0,
    y: 0.0,
    z: 0.5,
    roll_deg: 0.0,
    pitch_deg: 0.0,
    yaw_deg: 0.0,
};

/// Returns the detections of tags of a size (m): corners with an error of 0.3 px, at distances of 8 to 24 times the size.
fn detections(size: f64, seed: u64, rows: u64) -> Detections {
    detections_of(MOUNT, size, seed, rows)
}

/// The same for a camera at another `x` and `yaw_deg` on the robot.
fn detections_of(mount: Pose3Deg, size: f64, seed: u64, rows: u64) -> Detections {
    let camera = MountedCamera {
        camera: Camera::pinhole([1280.0, 960.0], [FOCAL; 2], [640.0, 480.0]),
        mount,
        mount_tolerance: Tolerance::NONE,
    };
    let tag = Tag {
        id: 1,
        size,
        pose: Pose3Deg { x: 0.0, ..MOUNT },
    };
    let row = |row: u64| {
        let mut rng = Rng::new(seed * 1_000_000 + row);
        let (d, psi, phi) = (
            size * rng.within(8.0, 24.0),
            rng.within(-60.0, 60.0),
            rng.within(-20.0, 20.0),
        );
        // The tag's normal is along x; the camera is at an angle psi from it.
        let angle = psi.to_radians();
        let camera_at = [d * angle.cos(), d * angle.sin()];
        let yaw = angle + core::f64::consts::PI + f64::to_radians(phi);
        let (sin, cos) = yaw.sin_cos();
        let mut noise = || 0.3 * (0..12).map(|_| rng.unit() - 0.5).sum::<f64>();
        let half = 0.5 * size;
        // AprilTag's order: from the bottom left, counterclockwise in the view of the tag.
        let corners_px = [[1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].map(|[y, z]| {
            let off = [-camera_at[0], -half * y - camera_at[1]];
            let ahead = cos * off[0] + sin * off[1];
            let left = -sin * off[0] + cos * off[1];
            [
                640.0 - FOCAL * left / ahead + noise(),
                480.0 - FOCAL * half * z / ahead + noise(),
            ]
        });
        let seen = TagObservation {
            tag: &tag,
            tolerance: Tolerance::NONE,
            corners_px,
        };
        let heading = yaw - mount.yaw_deg.to_radians();
        let (sin, cos) = heading.sin_cos();
        let robot = [
            camera_at[0] - cos * mount.x,
            camera_at[1] - sin * mount.x,
            heading,
        ];
        let errors = locate(&camera, &[seen], 0.3, 11.3449).ok().map(|fix| {
            let [x, y, turned] = [0, 1, 2].map(|i| fix.pose[i] - robot[i]);
            let turned = turned.sin().atan2(turned.cos());
            [x.hypot(y), turned.abs()]
        });
        Detection {
            at: [d, phi.abs(), psi.abs()],
            errors,
        }
    };
    Detections {
        rows: (0..rows).into_par_iter().map(row).collect(),
        runs: Runs::default(),
        ..Detections::default()
    }
}

/// Returns the model of detections of tags of 0.1 m, which is learnt once.
fn learnt_of_small_tags() -> &'static ErrorModel {
    static MODEL: LazyLock<ErrorModel> = LazyLock::new(|| learnt(0.1));
    &MODEL
}

fn learnt(size: f64) -> ErrorModel {
    let settings = BoundsSettings {
        quantile: QUANTILE,
        taken_with: Some(TakenWith {
            tag_size: Some(size),
            ..TakenWith::default()
        }),
        ..BoundsSettings::default()
    };
    learn_bounds(&detections(size, 1, 8_000), &settings).unwrap()
}

/// Returns the share of the detections within both bounds, the shares within each of them, and their number.
fn held(model: &ErrorModel, later: &Detections) -> ([f64; 3], f64) {
    let (mut held, mut count) = ([0.0; 3], 0.0);
    for Detection { at, errors } in &later.rows {
        let (Some([translation, yaw]), Some(bounds)) = (errors, model.bounds_deg(*at)) else {
            continue;
        };
        let within = [*translation <= bounds.0, *yaw <= bounds.1];
        held[0] += f64::from(u8::from(within[0] && within[1]));
        held[1] += f64::from(u8::from(within[0]));
        held[2] += f64::from(u8::from(within[1]));
        count += 1.0;
    }
    (held.map(|held| held / f64::max(count, 1.0)), count)
}

/// Bounds are valid for tags twice and half as large; without the scale, or without the lever, they are not.
#[test]
fn bounds_are_scaled_to_tags_of_another_size() {
    let lever = MOUNT.x.abs();
    let small = learnt_of_small_tags();
    let large = detections(0.2, 2, 6_000);
    let scaled = small.for_tags_of(0.2, lever, 0.0).unwrap();
    let (share, count) = held(&scaled, &large);
    println!("twice as large: {share:?} of {count}");
    assert!(
        count > 1_000.0 && share[0] >= 2.0 * QUANTILE - 1.0,
        "{share:?}"
    );
    assert!(
        share[1] >= QUANTILE - 0.01 && share[2] >= QUANTILE - 0.01,
        "{share:?}"
    );
    // At short range the robot is between camera and tag, so its position errs by less than the camera's.
    let (share, _) = held(&small.for_tags_of(0.2, 0.0, 0.0).unwrap(), &large);
    println!("without the lever: {share:?}");
    assert!(share[1] < QUANTILE - 0.02, "{share:?}");

    let large = learnt(0.2);
    let small = detections(0.1, 3, 6_000);
    let (share, count) = held(&large.for_tags_of(0.1, lever, 0.0).unwrap(), &small);
    println!("half as large: {share:?} of {count}");
    assert!(
        count > 1_000.0 && share[0] >= 2.0 * QUANTILE - 1.0,
        "{share:?}"
    );
    let (share, _) = held(&large, &small);
    println!("not scaled: {share:?}");
    assert!(share[0] < 0.6, "{share:?}");

    // A tilt of the detector's pose adds its part, and only if the size differs.
    let [flat, leaning] = [0.0, 0.3].map(|rise| large.for_tags_of(0.1, lever, rise).unwrap());
    let mut compared = 0;
    for row in &small.rows {
        if let (Some(flat), Some(leaning)) = (flat.bounds_deg(row.at), leaning.bounds_deg(row.at)) {
            // Half of 0.3 m; between corners the logarithm of a sum is slightly more than that of its parts.
            let more = leaning.0 - flat.0;
            assert!(
                (0.15 - 1e-9..0.17).contains(&more) && flat.1 == leaning.1,
                "{more}"
            );
            compared += 1;
        }
    }
    assert!(compared > 1_000, "{compared}");
    // The size is that of the data again: nothing changes. A model that was scaled is not written.
    let same = large.for_tags_of(0.2, lever, 0.0).unwrap();
    assert_eq!(
        same.bounds_deg([3.0, 10.0, 30.0]),
        large.bounds_deg([3.0, 10.0, 30.0])
    );
    assert_eq!(
        scaled.reach()[0][0],
        2.0 * learnt_of_small_tags().reach()[0][0]
    );
    assert!(same.write().is_err() && large.write().is_ok());
    for (size, lever) in [
        (0.0, 0.0),
        (f64::NAN, 0.0),
        (0.2, -1.0),
        (0.2, f64::INFINITY),
    ] {
        assert!(large.for_tags_of(size, lever, 0.0).is_none());
    }
}

/// Bounds are valid for the mount of the data, and for one that differs by no more than two files of one mount may. If the camera is
/// before the reference point instead of behind it, or a metre farther away, they are not.
#[test]
fn bounds_are_not_valid_for_another_mount() {
    let model = learnt_of_small_tags();
    let of = |x: f64, yaw_deg: f64| {
        let mount = Pose3Deg {
            x,
            yaw_deg,
            ..MOUNT
        };
        let (share, count) = held(model, &detections_of(mount, 0.1, 4, 6_000));
        println!("mounted at {x} m, {yaw_deg} deg: {share:?} of {count}");
        assert!(count > 1_000.0, "{count}");
        share
    };
    let mounted_alike = [
        (MOUNT.x, 0.0),
        (MOUNT.x - 0.001, 0.1),
        (MOUNT.x + 0.001, -0.1),
    ];
    for (x, yaw_deg) in counts::one_a_day(&mounted_alike) {
        let share = of(x, yaw_deg);
        assert!(
            share[1] >= QUANTILE - 0.01 && share[2] >= QUANTILE - 0.01,
            "{share:?}"
        );
    }
    let mounted_elsewhere = [(-MOUNT.x, 0.0), (MOUNT.x - 1.0, 0.0), (MOUNT.x, 90.0)];
    for (x, yaw_deg) in counts::one_a_day(&mounted_elsewhere) {
        let share = of(x, yaw_deg);
        assert!(share[1] < QUANTILE - 0.05, "{share:?}");
    }
}
