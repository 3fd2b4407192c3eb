use super::*;
use posegate_testkit::counts;
use rayon::prelude::*;

/// The chi-square quantile for 3 degrees of freedom at 0.99.
const R2: f64 = 11.3449;

fn eye() -> MountedCamera {
    MountedCamera {
        camera: Camera::pinhole([640.0, 480.0], [615.0, 615.0], [320.0, 240.0]),
        mount: Pose3Deg {
            x: 0.25,
            y: 0.05,
            z: 0.5,
            roll_deg: 0.0,
            pitch_deg: -5.0,
            yaw_deg: 10.0,
        },
        mount_tolerance: Tolerance::NONE,
    }
}

fn tag(x: f64, y: f64, yaw_deg: f64) -> Tag {
    Tag {
        id: 7,
        size: 0.3,
        pose: Pose3Deg {
            x,
            y,
            z: 0.6,
            roll_deg: 0.0,
            pitch_deg: 0.0,
            yaw_deg,
        },
    }
}

/// Returns the corners that the camera sees from a pose, each moved by `noise`.
fn corners(
    eye: &MountedCamera,
    tag: &Tag,
    pose: [f64; 3],
    noise: &mut impl FnMut() -> f64,
) -> [[f64; 2]; 4] {
    let blank = TagObservation {
        tolerance: Tolerance::NONE,
        tag,
        corners_px: [[0.0; 2]; 4],
    };
    let view = View::of(eye, &[blank]);
    let pixels = view.residuals(&Vector3::from(pose)).unwrap();
    core::array::from_fn(|k| [pixels[2 * k] + noise(), pixels[2 * k + 1] + noise()])
}

/// Normal noise by Box and Muller over xorshift.
fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        ((state >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0
    };
    move || {
        let (a, b) = (uniform(), uniform());
        libm::sqrt(-2.0 * libm::log(a)) * libm::cos(core::f64::consts::TAU * b)
    }
}

/// The image for Reference set A's camera and tag, computed by hand: a tag straight ahead is a square of 615 * 0.3 /
/// 3.75 pixels around the image centre. The first corner is the bottom left one.
#[test]
fn projected_corners_equal_hand_computed_ones() {
    let eye = MountedCamera {
        mount: Pose3Deg {
            x: 0.25,
            y: 0.0,
            z: 0.5,
            roll_deg: 0.0,
            pitch_deg: 0.0,
            yaw_deg: 0.0,
        },
        ..eye()
    };
    let mut ahead = tag(4.0, 0.0, 180.0);
    ahead.pose.z = 0.5;
    let seen = corners(&eye, &ahead, [0.0; 3], &mut || 0.0);
    let half = 0.5 * 615.0 * 0.3 / 3.75;
    let by_hand = [[-half, half], [half, half], [half, -half], [-half, -half]];
    for ([u, v], [du, dv]) in seen.iter().zip(by_hand) {
        assert!(
            (u - 320.0 - du).abs() < 1e-9 && (v - 240.0 - dv).abs() < 1e-9,
            "{seen:?}"
        );
    }
}

#[test]
fn exact_corners_give_the_true_pose() {
    let eye = eye();
    for (pose, tag) in [
        ([0.0, 0.0, 0.0], tag(2.0, 0.8, 205.0)),
        ([1.0, -2.0, 2.9], tag(-1.0, -1.2, -50.0)),
        ([3.0, 1.0, -1.5], tag(3.0, -1.0, 60.0)),
    ] {
        let seen = TagObservation {
            tolerance: Tolerance::NONE,
            tag: &tag,
            corners_px: corners(&eye, &tag, pose, &mut || 0.0),
        };
        let fix = locate(&eye, &[seen], 0.2, R2).unwrap();
        for (got, wanted) in fix.pose.iter().zip(pose) {
            assert!((got - wanted).abs() < 1e-6, "{:?} for {pose:?}", fix.pose);
        }
        assert!(fix.rms_px < 1e-6);
    }
}

/// 4,000 noisy observations per pose (1,000 in the fast suite): the reported covariance is that of the fixes, and the mean of e' P^-1 e is 3.
#[test]
fn covariance_equals_that_of_simulated_noise() {
    let eye = eye();
    let pose = [0.3, -0.2, 0.1];
    let (one, two) = (tag(2.2, 0.5, 240.0), tag(2.4, -0.1, 150.0));
    let cases = [(&[one][..], 0.3, 1), (&[one, two][..], 0.5, 2)];
    for (tags, sigma, seed) in counts::one_a_day(&cases) {
        // The variance of 4,000 draws has a standard deviation of 2.2 %, that of 1,000 draws 4.5 %.
        let (rounds, most) = if counts::is_deep() {
            (4000, 0.09)
        } else {
            (1000, 0.18)
        };
        let mut noise = normal(0x9e37_79b9_7f4a_7c15 + seed);
        let mut scaled = || sigma * noise();
        let mut sum = Matrix3::<f64>::zeros();
        let mut reported = Matrix3::<f64>::zeros();
        let mut nees = 0.0;
        for _ in 0..rounds {
            let seen: Vec<TagObservation<'_>> = tags
                .iter()
                .map(|tag| TagObservation {
                    tolerance: Tolerance::NONE,
                    tag,
                    corners_px: corners(&eye, tag, pose, &mut scaled),
                })
                .collect();
            let fix = locate(&eye, &seen, sigma, R2).unwrap();
            // To first order: without the reported growth.
            let covariance = Matrix3::from_fn(|r, c| fix.covariance[r][c]) / fix.grown;
            let error = Vector3::from_fn(|r, _| fix.pose[r] - pose[r]);
            sum += error * error.transpose();
            reported += covariance;
            nees += (covariance.try_inverse().unwrap() * error).dot(&error);
        }
        let (sum, reported) = (sum / f64::from(rounds), reported / f64::from(rounds));
        for axis in 0..3 {
            let ratio = sum[(axis, axis)] / reported[(axis, axis)];
            assert!((ratio - 1.0).abs() < most, "axis {axis}: {ratio}");
        }
        for (r, c) in [(0, 1), (0, 2), (1, 2)] {
            let size = libm::sqrt(reported[(r, r)] * reported[(c, c)]);
            assert!(
                (sum[(r, c)] - reported[(r, c)]).abs() < most * size,
                "{r} {c}"
            );
        }
        // Its standard deviation is sqrt(6 / rounds).
        let mean = nees / f64::from(rounds);
        assert!((mean - 3.0).abs() < 16.0 / 9.0 * most, "{mean}");
    }
}

/// Far away and head-on, noise hides the difference between the tag's two possible orientations.
#[test]
fn ambiguous_pixels_give_no_fix() {
    let eye = eye();
    let far = tag(6.0, 1.2, 190.0);
    let mut noise = normal(77);
    let mut ambiguous = 0;
    for _ in 0..20 {
        let seen = TagObservation {
            tolerance: Tolerance::NONE,
            tag: &far,
            corners_px: corners(&eye, &far, [0.0; 3], &mut || 0.5 * noise()),
        };
        ambiguous += u32::from(locate(&eye, &[seen], 0.5, R2) == Err(FixError::Ambiguous));
    }
    assert!(ambiguous >= 15, "{ambiguous}");
}

#[test]
fn corners_that_do_not_fit_are_an_error() {
    let eye = eye();
    let near = tag(2.0, 0.4, 205.0);
    let mut pixels = corners(&eye, &near, [0.0; 3], &mut || 0.0);
    assert_eq!(locate(&eye, &[], 0.3, R2), Err(FixError::NoTag));
    pixels[2] = [pixels[2][0] + 40.0, pixels[2][1] - 15.0];
    let seen = |corners_px| TagObservation {
        tolerance: Tolerance::NONE,
        tag: &near,
        corners_px,
    };
    assert_eq!(
        locate(&eye, &[seen(pixels)], 0.3, R2),
        Err(FixError::Misfit)
    );
    pixels[0][0] = f64::NAN;
    assert_eq!(
        locate(&eye, &[seen(pixels)], 0.3, R2),
        Err(FixError::NotFinite)
    );
    let good = corners(&eye, &near, [0.0; 3], &mut || 0.0);
    for sigma in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(
            locate(&eye, &[seen(good)], sigma, R2),
            Err(FixError::NotFinite)
        );
    }
}

/// Six poses in front of the dock's camera and tag, from oblique to head-on, with 600 observations each and exactly
/// the stated noise. At each pose, 99 % of the sets of accepted fixes contain the truth.
#[test]
fn sets_of_accepted_fixes_contain_the_truth() {
    let level = Pose3Deg {
        x: 0.25,
        y: 0.0,
        z: 0.5,
        roll_deg: 0.0,
        pitch_deg: 0.0,
        yaw_deg: 0.0,
    };
    let eye = MountedCamera {
        mount: level,
        ..eye()
    };
    let mut dock = tag(4.0, 0.0, 180.0);
    dock.pose.z = 0.5;
    let poses = [
        [1.7, 0.7, -0.25],
        [2.0, 0.2, 0.0],
        [0.5, -1.5, 0.4],
        [0.0, 1.2, -0.3],
        [0.0, 0.0, 0.0],
        [-1.0, 1.5, -0.3],
    ];
    let counts: Vec<(f64, f64)> = poses
        .par_iter()
        .enumerate()
        .map(|(k, pose)| {
            let mut noise = normal(0x9e37_79b9_7f4a_7c15 + 2 * k as u64);
            let (mut accepted, mut held) = (0.0, 0.0);
            for _ in 0..600 {
                let seen = TagObservation {
                    tolerance: Tolerance::NONE,
                    tag: &dock,
                    corners_px: corners(&eye, &dock, *pose, &mut || 0.3 * noise()),
                };
                let Ok(fix) = locate(&eye, &[seen], 0.3, R2) else {
                    continue;
                };
                let covariance = Matrix3::from_fn(|r, c| fix.covariance[r][c]);
                let error = Vector3::from_fn(|r, _| fix.pose[r] - pose[r]);
                let form = (covariance.try_inverse().unwrap() * error).dot(&error);
                accepted += 1.0;
                held += f64::from(u8::from(form <= R2));
            }
            (accepted, held)
        })
        .collect();
    for ((accepted, held), pose) in counts.iter().zip(poses) {
        // With a coverage of 99 %, fewer hits than this happen once in 1,000 times (3.1 standard deviations, and one).
        let least = 0.99 * accepted - 3.1 * libm::sqrt(0.0099 * accepted) - 1.0;
        assert!(*held >= least, "{pose:?}: {held} of {accepted}; {counts:?}");
    }
    // Oblique observations are accepted.
    assert!(counts[0].0 > 300.0, "{counts:?}");
}

/// Tag and camera at the ends of their tolerances or within them: the set around the fix contains the true pose. The
/// set computed without the tolerances does not.
#[test]
fn set_contains_pose_for_tag_and_camera_within_tolerance() {
    let mut state = normal(77);
    let mut direction = move || loop {
        let v = Vector3::from_fn(|_, _| state());
        if v.norm() > 1e-3 {
            return v.normalize();
        }
    };
    let (off, leaning) = (
        Tolerance {
            translation: 0.02,
            turn_deg: 2.0,
        },
        Tolerance {
            translation: 0.01,
            turn_deg: 0.5,
        },
    );
    let exact = eye();
    let tolerant = MountedCamera {
        mount_tolerance: leaning,
        ..exact
    };
    let (mut fixes, mut missed, mut farthest) = (0, 0, 0.0f64);
    for round in 0..800 {
        let pose = [0.3, -0.2, 0.1];
        let mounted = [tag(2.2, 0.5, 240.0), tag(2.4, -0.1, 150.0)];
        let mounted = &mounted[..1 + round % 2];
        // The true places of tag and camera.
        let turned = |pose: &Pose3Deg, turn: Vector3<f64>, way: Vector3<f64>| {
            let own = isometry(pose);
            let turn = Rotation3::from_scaled_axis(turn) * own.rotation;
            let (roll_deg, pitch_deg, yaw_deg) = turn.euler_angles();
            Pose3Deg {
                x: pose.x + way.x,
                y: pose.y + way.y,
                z: pose.z + way.z,
                roll_deg: roll_deg.to_degrees(),
                pitch_deg: pitch_deg.to_degrees(),
                yaw_deg: yaw_deg.to_degrees(),
            }
        };
        let size = if round % 3 == 0 { 0.6 } else { 1.0 };
        let real = MountedCamera {
            mount: turned(
                &exact.mount,
                direction() * leaning.turn_deg.to_radians() * size,
                direction() * leaning.translation * size,
            ),
            ..exact
        };
        let looks: Vec<[[f64; 2]; 4]> = mounted
            .iter()
            .map(|tag| {
                let sign = if direction().x > 0.0 { 1.0 } else { -1.0 };
                let up = Vector3::z() * off.turn_deg.to_radians() * sign * size;
                let real_tag = Tag {
                    pose: turned(&tag.pose, up, direction() * off.translation * size),
                    ..*tag
                };
                corners(&real, &real_tag, pose, &mut || 0.0)
            })
            .collect();
        // The square of the pose's relative position between the centre (0) and the border (1) of the set.
        let share = |eye: &MountedCamera, tolerance: Tolerance| {
            let seen: Vec<TagObservation<'_>> = mounted
                .iter()
                .zip(&looks)
                .map(|(tag, corners_px)| TagObservation {
                    tolerance,
                    tag,
                    corners_px: *corners_px,
                })
                .collect();
            let fix = locate(eye, &seen, 1.0, R2).ok()?;
            let mut away = Vector3::from(pose) - Vector3::from(fix.pose);
            away.z = wrapped(away.z);
            let covariance = Matrix3::from_fn(|r, c| fix.covariance[r][c]);
            Some((away.transpose() * covariance.cholesky()?.solve(&away)).x / R2)
        };
        let share_without = |eye: &MountedCamera| share(eye, Tolerance::NONE).unwrap_or(0.0);
        // No pose may fit a displaced tag: then neither variant has a fix.
        if let Some(share) = share(&tolerant, off) {
            assert!(share <= 1.0, "round {round}: {share}");
            farthest = farthest.max(share);
            fixes += 1;
            missed += u32::from(share_without(&exact) > 1.0);
        }
    }
    std::println!(
        "{fixes} fixes, {missed} missed without the tolerances, the farthest at {farthest}"
    );
    assert!(
        fixes > 200 && missed > 100,
        "{fixes} fixes, {missed} missed"
    );
    // All five balls at their worst ends at once: few draws come near.
    assert!(farthest > 0.25, "{farthest}");
}
