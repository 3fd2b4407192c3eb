use super::*;
use nalgebra::{UnitQuaternion, Vector3};
use posegate_site::{SAMPLE, Site};

/// A curve in space, sampled from a start time.
fn curve(count: u32, step: f64, offset: f64) -> Vec<Stamped> {
    let at = |k: u32| {
        let t_s = 10.0 + offset + step * f64::from(k);
        Stamped {
            t_s,
            position: Vector3::new(
                libm::cos(t_s),
                libm::sin(2.0 * t_s),
                0.3 * libm::sin(3.0 * t_s),
            ),
            rotation: UnitQuaternion::from_euler_angles(0.1 * t_s, 0.2, -0.7 * t_s),
        }
    };
    (0..count).map(at).collect()
}

/// The same curve rotated, shifted and scaled.
fn moved(poses: &[Stamped], scale: f64) -> Vec<Stamped> {
    let turn = UnitQuaternion::from_euler_angles(0.3, -1.2, 2.5);
    let shift = Vector3::new(4.0, -5.0, 0.5);
    let one = |pose: &Stamped| Stamped {
        position: turn * (scale * pose.position) + shift,
        rotation: turn * pose.rotation,
        ..*pose
    };
    poses.iter().map(one).collect()
}

fn rmse(reference: &[Stamped], estimate: &[Stamped], align: Align) -> [f64; 2] {
    let matched = associated(reference, estimate, 0.01).unwrap();
    let errors = absolute(&aligned(&matched, align).unwrap());
    let of = |errors: &[f64]| Statistics::of(errors).unwrap().rmse;
    [of(&errors.translation), of(&errors.rotation)]
}

#[test]
fn alignment_removes_rotation_shift_and_scale() {
    let reference = curve(50, 0.1, 0.0);
    for (scale, align, exact) in [
        (1.0, Align::Se3, true),
        (1.0, Align::Sim3, true),
        (1.0, Align::Origin, true),
        (1.0, Align::None, false),
        (2.5, Align::Sim3, true),
        (2.5, Align::Se3, false),
        (2.5, Align::Origin, false),
    ] {
        let [translation, rotation] = rmse(&reference, &moved(&reference, scale), align);
        assert_eq!(
            translation < 1e-12,
            exact,
            "{scale} {align:?}: {translation}"
        );
        assert_eq!(
            rotation < 1e-12,
            align != Align::None,
            "{align:?}: {rotation}"
        );
    }
    // In a plane the third direction follows from the other two. The result must be a rotation, not
    // a reflection.
    let flat = |z: f64| {
        let mut poses = curve(50, 0.1, 0.0);
        poses.iter_mut().for_each(|pose| pose.position.z = z);
        poses
    };
    assert!(rmse(&flat(0.0), &moved(&flat(3.0), 1.0), Align::Se3)[0] < 1e-12);
    let mut mirrored = curve(50, 0.1, 0.0);
    mirrored.iter_mut().for_each(|pose| pose.position.z *= -1.0);
    assert!(rmse(&reference, &mirrored, Align::Se3)[0] > 0.05);
    // Along a line all rotations about the line fit equally well.
    let mut line = curve(50, 0.1, 0.0);
    line.iter_mut()
        .for_each(|pose| pose.position = Vector3::new(pose.t_s, 0.0, 0.0));
    let matched = associated(&line, &line, 0.01).unwrap();
    assert_eq!(aligned(&matched, Align::Se3), Err(AlignError::Degenerate));
    assert!(aligned(&matched, Align::Origin).is_ok());
}

#[test]
fn poses_are_matched_to_the_nearest_time() {
    let (reference, estimate) = (curve(100, 0.1, 0.0), curve(30, 0.25, 0.04));
    // 0.04, 0.29, 0.54, ...: 0.04 or 0.01 away.
    assert_eq!(
        associated(&reference, &estimate, 0.05)
            .unwrap()
            .estimate
            .len(),
        30
    );
    let matched = associated(&reference, &estimate, 0.02).unwrap();
    assert_eq!(matched.estimate.len(), 15);
    assert!(matched.reference[0].t_s == reference[3].t_s);
    // With the arguments swapped, the reference is the shorter one.
    let other = associated(&estimate, &reference, 0.02).unwrap();
    assert_eq!(
        (other.reference, other.estimate),
        (matched.estimate, matched.reference)
    );
    let later = curve(30, 0.25, 100.0);
    assert!(matches!(
        associated(&reference, &later, 0.02),
        Err(PairError::None { .. })
    ));
    let one = &estimate[..1];
    assert_eq!(associated(&reference, one, 0.05), Err(PairError::TooFew(1)));
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            associated(&reference, one, bad),
            Err(PairError::Difference(_))
        ));
    }
}

#[test]
fn pairs_are_frames_or_metres_apart() {
    let line: Vec<Stamped> = (0..11)
        .map(|k| Stamped {
            t_s: f64::from(k),
            position: Vector3::new(0.25 * f64::from(k), 0.0, 0.0),
            rotation: UnitQuaternion::identity(),
        })
        .collect();
    assert_eq!(Pairs::Frames(4).of(&line), [(0, 4), (4, 8)]);
    assert_eq!(Pairs::AllFrames(9).of(&line), [(0, 9), (1, 10)]);
    assert_eq!(Pairs::Metres(0.5).of(&line)[..2], [(0, 2), (2, 4)]);
    assert_eq!(Pairs::Metres(0.6).of(&line), [(0, 3), (3, 6), (6, 9)]);
    assert!(Pairs::Metres(5.0).of(&line).is_empty());
    // A path that is a tenth too long.
    let long = line.iter().map(|pose| Stamped {
        position: 1.1 * pose.position,
        ..*pose
    });
    let matched = Matched {
        reference: line.clone(),
        estimate: long.collect(),
    };
    let errors = relative(&matched, Pairs::Frames(2));
    assert!(
        errors
            .translation
            .iter()
            .all(|error| (error - 0.05).abs() < 1e-12)
    );
    assert_eq!(errors.rotation, [0.0; 5]);
    assert!(
        relative(&matched, Pairs::Metres(9.0))
            .statistics()
            .is_none()
    );
}

#[test]
fn statistics_of_four_errors_equal_hand_computed_ones() {
    let of = Statistics::of(&[4.0, 1.0, 2.0, 2.0]).unwrap();
    assert_eq!(
        (of.count, of.mean, of.median, of.min, of.max),
        (4, 2.25, 2.0, 1.0, 4.0)
    );
    assert_eq!((of.sse, of.rmse, of.sum_norm), (25.0, 2.5, 5.0));
    assert!((of.std - libm::sqrt(1.1875)).abs() < 1e-15);
    assert_eq!(Statistics::of(&[3.0, 1.0, 2.0]).unwrap().median, 2.0);
    assert_eq!(Statistics::of(&[]), None);
    let errors = Errors {
        translation: std::vec![0.02, 0.01, 0.01],
        rotation: std::vec![0.01, 0.01, 0.2],
        full: std::vec![0.0; 3],
    };
    // Below, not at, the thresholds.
    assert_eq!(correct_rate(&errors, 0.02, 5.0), 1.0 / 3.0);
    assert_eq!(correct_rate(&errors, 0.021, 180.0), 1.0);
}

/// An error in the estimate's own frame, compared with a set that is longer than wide.
#[test]
fn errors_are_compared_with_the_success_set() {
    let site = Site::parse(SAMPLE, "site.toml").unwrap();
    let dock = &site.tasks["dock"].success;
    let at = |x: f64, y: f64, yaw: f64| Stamped {
        t_s: 0.0,
        position: Vector3::new(x, y, 0.0),
        rotation: UnitQuaternion::from_euler_angles(0.0, 0.0, yaw),
    };
    let quarter = core::f64::consts::FRAC_PI_2;
    // 7 cm ahead of the estimate is inside, 7 cm to its side is not.
    let matched = Matched {
        reference: std::vec![
            at(5.0, 3.07, quarter),
            at(5.07, 3.0, quarter),
            at(0.07, 0.0, 0.0),
            at(0.0, 0.0, 0.0)
        ],
        estimate: std::vec![
            at(5.0, 3.0, quarter),
            at(5.0, 3.0, quarter),
            at(0.0, 0.0, 0.0),
            at(0.0, 0.0, 0.02)
        ],
    };
    let shares = in_set(&matched, dock);
    assert_eq!(
        shares,
        InSet {
            errors: 0.75,
            estimate: 0.5,
            reference: 0.5
        }
    );
}
