use super::*;
use crate::fixtures::{self, ODOMETRY, TABLE, at, header, odometry, origin, with_variances};
use crate::message::Header;
use posegate::gate::self_test;

const STILL: &str = "-p stands_still:=true -p cross_terms:=filled";
const VARIANCES: [f64; 3] = [1e-4, 1e-4, 1e-5];

fn settings(line: &str) -> NodeSettings {
    fixtures::settings(TABLE, &format!("--ros-args {line}"))
}

fn pose_at(ms: u32, x: f64, frame: &str) -> PoseReport {
    PoseReport {
        stamp: at(ms).time(),
        frame: frame.into(),
        pose: Ok(estimate(&with_variances(x, VARIANCES))),
    }
}

fn odometry_at(ms: u32, x: f64) -> Odometry {
    odometry(
        header(at(ms), "odom"),
        "base_link",
        with_variances(x, VARIANCES),
    )
}

/// The moment up to which valid poses have opened the gate, milliseconds after the start.
const OPENED: u32 = 1_000;

fn opened<'a>(settings: &'a NodeSettings, gate: &'a Settings<'a>) -> PermitGate<'a> {
    let mut node = PermitGate::new(self_test(), TABLE, settings, gate, at(0)).unwrap();
    for ms in (0..=OPENED).step_by(20) {
        let _ = node.odometry(at(ms), &odometry_at(ms, 0.0), origin(i64::from(ms / 20)));
        if ms % 100 == 0 {
            let _ = node.pose(
                at(ms),
                &pose_at(ms, 0.0, "map"),
                origin(i64::from(ms / 100)),
            );
        }
        let _ = node.tick(at(ms));
    }
    assert!(node.tick(at(OPENED)).is_open);
    node
}

#[test]
fn valid_poses_open_and_silence_closes() {
    let settings = settings(STILL);
    let gate = settings.gate();
    let mut node = opened(&settings, &gate);
    assert!(node.tick(at(OPENED + 20)).is_open);
    let mut ms = OPENED + 20;
    while node.tick(at(ms)).is_open {
        ms += 20;
    }
    // The last permit is held for 800 ms.
    assert_eq!(ms - OPENED, 820);
    assert_eq!(node.tick(at(ms)).reason(), Some(Reason::Silent));
}

/// With odometry, a pose without a known time would be carried from a guessed time.
#[test]
fn pose_without_a_time_is_not_carried() {
    let settings = settings(&format!("{STILL} {ODOMETRY}"));
    let gate = settings.gate();
    let next = i64::from(OPENED / 100) + 1;
    let now = OPENED + 20;
    for nanosec in [0, u32::MAX] {
        let mut node = opened(&settings, &gate);
        let mut message = pose_at(now, 0.0, "map");
        message.stamp = Time { sec: 0, nanosec };
        let answer = node.pose(at(now), &message, origin(next));
        assert!(!answer.is_open, "{nanosec}");
        // The next odometry has no fix to carry.
        for ms in (now + 20..now + 400).step_by(20) {
            let _ = node.odometry(at(ms), &odometry_at(ms, 0.0), origin(i64::from(ms / 20)));
            assert!(!node.tick(at(ms)).is_open, "{nanosec} {ms}");
        }
    }
}

#[test]
fn invalid_reports_close_the_gate() {
    let settings = settings(STILL);
    let gate = settings.gate();
    let next = i64::from(OPENED / 100) + 1;
    let now = OPENED + 20;
    let mut no_time = pose_at(now, 0.0, "map");
    no_time.stamp.nanosec = u32::MAX;
    let mut lost = pose_at(now, 0.0, "map");
    lost.stamp = Time::default();
    for (message, number, expected) in [
        (pose_at(now, 0.3, "map"), next, Reason::OutsideTable),
        (pose_at(now, 0.07, "map"), next, Reason::NotContained),
        (pose_at(now, 0.0, "odom"), next, Reason::FrameMismatch),
        (pose_at(now, 0.0, ""), next, Reason::FrameMismatch),
        (pose_at(now, 0.0, "map"), next + 1, Reason::SequenceGap),
        (pose_at(now, 0.0, "map"), next - 5, Reason::SequenceGap),
        (pose_at(now, 0.0, "map"), i64::MIN, Reason::SequenceGap),
        (
            pose_at(now, f64::NAN, "map"),
            next,
            Reason::EstimateNotFinite,
        ),
        (no_time, next, Reason::TimeBackwards),
        (lost, next, Reason::TimeBackwards),
        (pose_at(now + 2, 0.0, "map"), next, Reason::Stale),
    ] {
        let mut node = opened(&settings, &gate);
        let answer = node.pose(at(now), &message, origin(number));
        assert!(!answer.is_open, "{expected}");
        assert_eq!(answer.reason(), Some(expected), "{message:?}");
    }
}

#[test]
fn two_publishers_never_open_the_gate() {
    let settings = settings("-p stands_still:=true -p permits_in_a_row:=1");
    let gate = settings.gate();
    let mut node = PermitGate::new(self_test(), TABLE, &settings, &gate, at(0)).unwrap();
    for k in 0..200u32 {
        let ms = k * 50;
        let origin = Origin {
            publisher: [(k % 2) as u8; 16],
            number: i64::from(k / 2),
        };
        assert!(!node.pose(at(ms), &pose_at(ms, 0.0, "map"), origin).is_open);
    }
}

#[test]
fn motion_bounds_enlarge_the_set() {
    let still = settings(STILL);
    let moving = settings("-p max_speed:=0.02 -p max_yaw_rate_deg:=1.0 -p cross_terms:=filled");
    let margins = [&still, &moving].map(|settings| {
        let gate = settings.gate();
        let mut node = PermitGate::new(self_test(), TABLE, settings, &gate, at(0)).unwrap();
        let _ = node.pose(at(10), &pose_at(0, 0.0, "map"), origin(0));
        match node.last().unwrap().verdict {
            Verdict::Permit { margin } => margin,
            verdict => panic!("{verdict:?}"),
        }
    });
    assert!(margins[1] < margins[0], "{margins:?}");
}

#[test]
fn fix_is_carried_and_a_broken_path_closes() {
    let settings = settings(
        &format!("{STILL} {ODOMETRY} -p odometry_maximum_gap_ms:=60")
            .replace(
                "-p stands_still:=true",
                "-p max_speed:=0.11 -p max_yaw_rate_deg:=1.0",
            )
            // Short times, so that the movement fits.
            .replace(
                "-p cross_terms:=filled",
                "-p cross_terms:=filled -p valid_ms:=100 -p heartbeat_ms:=20 -p permit_hold_ms:=60",
            ),
    );
    let gate = settings.gate();
    let number = i64::from(OPENED / 20);

    // Without a new fix the permit remains, because the odometry carries the old one, until the robot is too far
    // away.
    let mut node = opened(&settings, &gate);
    let mut answer = node.tick(at(OPENED));
    let mut steps = 0;
    while answer.is_open && steps < 100 {
        steps += 1;
        let ms = OPENED + 20 * steps;
        let x = 0.002 * f64::from(steps);
        answer = node.odometry(
            at(ms),
            &odometry_at(ms, x),
            origin(number + i64::from(steps)),
        );
    }
    assert!((5..30).contains(&steps), "{steps}");
    assert_eq!(answer.reason(), Some(Reason::NotContained));

    // A jump, another publisher, another frame, another point of the robot, a gap, a message that cannot be decoded.
    let next = number + 1;
    let now = OPENED + 20;
    let elsewhere = Odometry {
        header: Header {
            frame_id: "odom2".into(),
            ..odometry_at(now, 0.0).header
        },
        ..odometry_at(now, 0.0)
    };
    let of_another_point = Odometry {
        child_frame_id: "camera_link".into(),
        ..odometry_at(now, 0.0)
    };
    let other = Origin {
        publisher: [2; 16],
        number: next,
    };
    for (message, origin, expected) in [
        (odometry_at(now, 0.05), origin(next), Reason::OdometryJump),
        (odometry_at(now, 5.0), origin(next), Reason::OdometryJump),
        (
            odometry_at(now, f64::NAN),
            origin(next),
            Reason::EstimateNotFinite,
        ),
        (odometry_at(now, 0.0), other, Reason::OdometryJump),
        (elsewhere, origin(next), Reason::OdometryJump),
        (of_another_point, origin(next), Reason::OdometryJump),
        (
            odometry_at(OPENED, 0.0),
            origin(next),
            Reason::OdometryBackwards,
        ),
    ] {
        let mut node = opened(&settings, &gate);
        let answer = node.odometry(at(now), &message, origin);
        assert_eq!(
            (answer.is_open, answer.reason()),
            (false, Some(expected)),
            "{message:?}"
        );
        // The path is broken: odometry alone never opens the gate again.
        for k in 1..100u32 {
            let ms = now + 20 * k;
            let answer = node.odometry(at(ms), &odometry_at(ms, 0.0), origin);
            assert!(!answer.is_open);
        }
    }
    let mut node = opened(&settings, &gate);
    assert!(!node.odometry_lost(at(now)).is_open);
    let mut node = opened(&settings, &gate);
    let mut ms = OPENED;
    while node.tick(at(ms)).is_open {
        ms += 20;
    }
    // The possible motion since the last odometry may close the gate before the gap does.
    assert!(ms - OPENED <= 80, "{ms}");
    let later = node.tick(at(OPENED + 100));
    assert_eq!(later.reason(), Some(Reason::OdometryGap));
}

#[test]
fn reset_closes_and_the_gate_qualifies_again() {
    let settings = settings(&format!("{STILL} -p restart:=on_reset"));
    let gate = settings.gate();
    let mut node = opened(&settings, &gate);
    let _ = node.inhibit(at(OPENED), Reason::Silent);
    let mut number = i64::from(OPENED / 100);
    let mut open_after = |node: &mut PermitGate<'_>, from: u32| {
        (1..=20u32).any(|k| {
            number += 1;
            let ms = from + 100 * k;
            node.pose(at(ms), &pose_at(ms, 0.0, "map"), origin(number))
                .is_open
        })
    };
    assert!(!open_after(&mut node, OPENED));
    node.reset(at(3_100)).unwrap();
    assert!(!node.tick(at(3_100)).is_open);
    assert!(open_after(&mut node, 3_100));
}

/// AMCL reports every 0.6 s while the robot moves.
#[test]
fn poses_of_amcl_open_with_the_default_hold() {
    for (more, opens) in [("", true), ("-p permit_hold_ms:=500", false)] {
        let settings = settings(&format!("{STILL} {more}"));
        let gate = settings.gate();
        let mut node = PermitGate::new(self_test(), TABLE, &settings, &gate, at(0)).unwrap();
        let mut opened = false;
        for ms in (100..10_000).step_by(20) {
            if (ms - 100) % 600 == 0 {
                let number = i64::from(ms / 600);
                let pose = pose_at(ms - 100, 0.0, "map");
                let _ = node.pose(at(ms), &pose, origin(number));
            }
            opened |= node.tick(at(ms)).is_open;
        }
        assert_eq!(opened, opens, "{more}");
    }
}

/// A pose that is refused closes with its reason, and costs no gap in the sequence.
#[test]
fn refused_pose_closes_with_its_reason() {
    let settings = settings(STILL);
    let gate = settings.gate();
    let mut node = opened(&settings, &gate);
    let next = i64::from(OPENED / 100) + 1;
    let now = OPENED + 20;
    let refused = PoseReport {
        pose: Err(crate::poses::RefusedPose::FixedCovariance(20)),
        ..pose_at(now, 0.0, "map")
    };
    let answer = node.pose(at(now), &refused, origin(next));
    let reason = Some(Reason::CovarianceUnknown);
    assert_eq!((answer.is_open, answer.reason()), (false, reason));
    let mut opened = false;
    for k in 1..=12 {
        let ms = now + 100 * k;
        let answer = node.pose(
            at(ms),
            &pose_at(ms, 0.0, "map"),
            origin(next + i64::from(k)),
        );
        assert_ne!(answer.reason(), Some(Reason::SequenceGap));
        opened |= answer.is_open;
    }
    assert!(opened);
}
