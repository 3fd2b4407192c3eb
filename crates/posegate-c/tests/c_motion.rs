//! A robot that moves, in C: hypotheses, tracker and fitting settings act as in Rust, and no wrong argument opens a gate.

mod support;

use posegate::gate::{Evidence, Gate, Reason, Settings, Source, Verdict};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::{Aging, CrossTerms, Estimate, Growth, Inflation, Uncertainty};
use posegate::table::{Table, checksum_continued};
use posegate::task::Risk;
use posegate::track::{Increment, OdometryErrors, Tracker, TrackerSettings};
use posegate_c::*;
use std::collections::BTreeSet;
use support::{
    DOCK, SEE_T7, evidence_of_c, in_c, leaked, misaligned, name, report_of_c, source, zero, zeroed,
};

fn source_of_c() -> posegate_source {
    posegate_source {
        inflation: 1.25,
        along_m_s: 0.5,
        turn_rad_s: 1.0,
        ..source()
    }
}

fn settings_of_c(table: &Table<'_>) -> posegate_settings {
    let settings = zeroed();
    // SAFETY: a valid pointer.
    let mut settings = unsafe {
        let status = posegate_settings_for_source(20, 10, settings);
        assert_eq!(status, posegate_status::Ok);
        *settings
    };
    settings.task = name(table.task());
    settings.task_digest = table.task_digest();
    settings.sources[0] = posegate_source {
        inflation: 1.0,
        ..source_of_c()
    };
    settings.source_count = 1;
    settings
}

fn gate_of_c(bytes: &'static [u8]) -> *mut posegate_gate {
    let table = Table::parse(bytes).unwrap();
    let (gate, settings) = (zeroed(), leaked(settings_of_c(&table)));
    // SAFETY: valid pointers.
    let status =
        unsafe { posegate_gate_init(gate, bytes.as_ptr(), bytes.len(), settings, leaked(0), 0) };
    assert_eq!(status, posegate_status::Ok);
    gate
}

fn gate_of_rust(bytes: &'static [u8]) -> Gate<'static> {
    let table = Table::parse(bytes).unwrap();
    let bounds = MotionBounds::new(0.5, 0.0, 1.0).unwrap();
    let sources = [Source::new("map", 1.0, CrossTerms::Filled, bounds).unwrap()];
    let settings = Settings {
        task: String::leak(table.task().to_owned()),
        task_digest: table.task_digest(),
        sources: Box::leak(Box::new(sources)),
        ..Settings::for_source(20, 10)
    };
    Gate::new(bytes, Box::leak(Box::new(settings)), 0).unwrap()
}

fn errors_of_c() -> posegate_odometry_errors {
    posegate_odometry_errors {
        m_per_sqrt_m: 0.01,
        rad_per_sqrt_rad: 0.02,
        rad_per_sqrt_m: 0.015,
        m_per_sqrt_s: 0.001,
        rad_per_sqrt_s: 0.002,
        slip: 0.02,
        turn_slip: 0.03,
        turn_slip_per_m: 0.001,
    }
}

fn tracker_settings_of_c() -> posegate_tracker_settings {
    posegate_tracker_settings {
        errors: errors_of_c(),
        source: source_of_c(),
        maximum_gap_ms: 60,
        maximum_fix_age_ms: 800,
    }
}

fn tracker_of_c() -> *mut posegate_tracker {
    let (tracker, settings) = (zeroed(), leaked(tracker_settings_of_c()));
    // SAFETY: valid pointers.
    let status = unsafe { posegate_tracker_init(tracker, SEE_T7.as_ptr(), SEE_T7.len(), settings) };
    assert_eq!(status, posegate_status::Ok);
    tracker
}

fn tracker_of_rust() -> Tracker<64> {
    Tracker::new(TrackerSettings {
        errors: OdometryErrors {
            m_per_sqrt_m: 0.01,
            rad_per_sqrt_rad: 0.02,
            rad_per_sqrt_m: 0.015,
            m_per_sqrt_s: 0.001,
            rad_per_sqrt_s: 0.002,
            slip: 0.02,
            turn_slip: 0.03,
            turn_slip_per_m: 0.001,
        },
        bounds: MotionBounds::new(0.5, 0.0, 1.0).unwrap(),
        trust: Source::new("map", 1.25, CrossTerms::Filled, MotionBounds::STANDS_STILL)
            .unwrap()
            .trust,
        radius_squared: Table::parse(SEE_T7).unwrap().radius_squared(),
        maximum_gap_ms: 60,
        maximum_fix_age_ms: 800,
    })
    .unwrap()
}

fn belief(x_m: f64, y_m: f64, yaw_rad: f64) -> PoseEstimate {
    let covariance = [[4e-4, 1e-4, 0.0], [1e-4, 3e-4, 0.0], [0.0, 0.0, 1e-4]];
    let estimate = Estimate { x_m, y_m, yaw_rad };
    PoseEstimate::new(estimate, Uncertainty::Gaussian(covariance))
}

fn belief_of_c(x_m: f64, y_m: f64, yaw_rad: f64) -> posegate_belief {
    in_c(&belief(x_m, y_m, yaw_rad))
}

fn step_on(
    gate: *mut posegate_gate,
    now_ms: u32,
    evidence: *const posegate_evidence,
) -> (posegate_status, posegate_step) {
    // SAFETY: the tests pass what the function must handle.
    unsafe {
        let mut step = zero();
        let status = posegate_gate_step_on(gate, now_ms, evidence, &mut step);
        (status, step)
    }
}

/// A drive with odometry at 50 Hz, late fixes, and a gate at every increment: each answer in C equals that in Rust.
#[test]
fn c_tracker_equals_rust_tracker() {
    let (gate_c, mut gate) = (gate_of_c(SEE_T7), gate_of_rust(SEE_T7));
    let (gate_direct, mut gate_of_direct) = (gate_of_c(SEE_T7), gate_of_rust(SEE_T7));
    let (tracker_c, mut tracker) = (tracker_of_c(), tracker_of_rust());
    let mut seen = BTreeSet::new();
    let (mut opened, mut sequence, mut newest) = (0, 0, 0);
    for cycle in 1..2_000u32 {
        let now = 20 * cycle;
        // Now and then the odometry stops or jumps.
        let ahead =
            if cycle % 701 == 0 { 0.2 } else { 0.004 } * f64::from(cycle % 40) / 40.0 - 0.002;
        let turn = 0.001 * (f64::from(cycle % 13) - 6.0);
        if cycle % 503 > 4 {
            let increment = posegate_increment {
                ahead_m: ahead,
                left_m: 0.0002,
                turn_rad: turn,
                begins_ms: newest,
                stamp_ms: now,
            };
            let expected =
                tracker.odometry(Increment::of(ahead, 0.0002, turn, [newest, now]).unwrap());
            let mut reason = 77;
            // SAFETY: valid pointers.
            let status = unsafe { posegate_tracker_odometry(tracker_c, &increment, &mut reason) };
            assert_eq!(status, posegate_status::Ok);
            let expected = expected.map_or_else(|reason| u32::from(reason.code()), |()| 0);
            assert_eq!(reason, expected, "{cycle}");
            seen.insert(reason);
            newest = now;
        }
        if cycle % 23 == 0 {
            sequence += 1;
            let stamp_ms = now - 100 - cycle % 31;
            let [x, y] = [0.01 * f64::from(cycle % 7), 0.02];
            let fix = Report {
                source: 0,
                frame: FrameId::of("map"),
                sequence,
                stamp_ms,
                belief: belief(x, y, 0.0),
            };
            let expected = tracker.fix(&fix);
            let fix = report_of_c(sequence, stamp_ms, belief_of_c(x, y, 0.0));
            let mut reason = 77;
            // SAFETY: valid pointers.
            let status = unsafe { posegate_tracker_fix(tracker_c, &fix, &mut reason) };
            assert_eq!(status, posegate_status::Ok);
            let expected = expected.map_or_else(|reason| u32::from(reason.code()), |()| 0);
            assert_eq!(reason, expected, "{cycle}");
            seen.insert(reason);
        }
        // A second gate, which steps on the tracker itself.
        let direct = zeroed::<posegate_step>();
        // SAFETY: valid pointers.
        let direct = unsafe {
            let status = posegate_gate_step_tracked(gate_direct, now, tracker_c, direct);
            assert_eq!(status, posegate_status::Ok);
            *direct
        };
        let found = zeroed::<posegate_tracked>();
        // SAFETY: valid pointers.
        let found = unsafe {
            let status = posegate_tracker_tracked(tracker_c, now, found);
            assert_eq!(status, posegate_status::Ok);
            *found
        };
        seen.insert(found.reason);
        let mut reach_ms = 77;
        // SAFETY: valid pointers.
        let status = unsafe { posegate_tracker_reach(tracker_c, &mut reach_ms) };
        assert_eq!(
            (status, reach_ms),
            (posegate_status::Ok, tracker.reach_ms())
        );
        let tracked = tracker.tracked(now);
        let expected = match &tracked {
            Ok(tracked) => gate_of_direct.step_on(now, &tracked.evidence()),
            Err(_) => gate_of_direct.tick(now),
        };
        let verdict = tracked
            .as_ref()
            .map_or_else(|reason| Err(*reason), |_| expected.verdict);
        let reason = verdict.map_or_else(|reason| reason.code(), |()| 0);
        assert_eq!(direct.reason, u32::from(reason), "{cycle}");
        // SAFETY: a valid pointer.
        let permits = unsafe { posegate_permission_is_permit(&direct.permission, now) };
        assert_eq!(permits == POSEGATE_PERMIT, expected.permission.is_permit());
        match tracked {
            Ok(tracked) => {
                assert_eq!(found.reason, 0, "{cycle}");
                let step = gate.step_on(now, &tracked.evidence());
                let (status, step_c) = step_on(gate_c, now, &found.evidence);
                assert_eq!(status, posegate_status::Ok);
                let reason = step.verdict.map_or_else(|reason| reason.code(), |()| 0);
                assert_eq!(step_c.reason, u32::from(reason), "{cycle}");
                // SAFETY: a valid pointer.
                let permits = unsafe { posegate_permission_is_permit(&step_c.permission, now) };
                assert_eq!(permits == POSEGATE_PERMIT, step.permission.is_permit());
                opened += u32::from(step.permission.is_permit());
                // SAFETY: valid pointers.
                let examined = unsafe {
                    let examined = zeroed::<posegate_examined>();
                    let status = posegate_gate_examine_on(gate_c, &found.evidence, examined);
                    assert_eq!(status, posegate_status::Ok);
                    *examined
                };
                let (hypothesis, verdict) = gate.examine_on(&tracked.evidence());
                assert_eq!(examined.hypothesis, u32::from(hypothesis));
                let margin = match verdict {
                    Verdict::Permit { margin } => Some(margin),
                    Verdict::Deny { margin, .. } => margin,
                };
                let margin = margin.map_or(0, |margin| margin.q16());
                assert_eq!(examined.verdict.margin_q16, margin, "{cycle}");
            }
            Err(reason) => {
                assert_eq!(found.reason, u32::from(reason.code()), "{cycle}");
                let (status, step) = step_on(gate_c, now, &found.evidence);
                assert_ne!(status, posegate_status::Ok);
                assert_eq!(step.state.kind, posegate_state_kind::Inhibited as u32);
                // The Rust gate gets the same: a report of a source that does not exist.
                let none = Report {
                    source: u8::MAX,
                    frame: FrameId::UNNAMED,
                    sequence: 0,
                    stamp_ms: 0,
                    belief: belief(0.0, 0.0, 0.0),
                };
                let _ = gate.step(now, &none);
            }
        }
    }
    assert!(opened > 500, "{opened}");
    for reason in [Reason::OdometryGap, Reason::OdometryJump, Reason::Silent] {
        assert!(
            seen.contains(&u32::from(reason.code())),
            "{reason} {seen:?}"
        );
    }
}

/// Inflations by age: each answer in C equals that in Rust, at every age. Without a stated age the source's own inflation applies.
#[test]
fn c_inflation_by_age_equals_rust() {
    let table = Table::parse(SEE_T7).unwrap();
    let steps = [(512, 1 << 16), (4992, 9 << 16), (59_968, 100 << 16)];
    let mut of_c = settings_of_c(&table);
    of_c.sources[0].inflation = 400.0;
    for (age, (until_ms, inflation_q16)) in of_c.sources[0].ages.iter_mut().zip(steps) {
        *age = posegate_age {
            until_ms,
            inflation_q16,
        };
    }
    let of_c = leaked(of_c);
    let bounds = MotionBounds::new(0.5, 0.0, 1.0).unwrap();
    let steps = steps.map(|(until_ms, q16)| (until_ms, Inflation::from_q16(q16).unwrap()));
    let sources = [Source {
        aging: Aging::new(&steps).unwrap(),
        ..Source::new("map", 400.0, CrossTerms::Filled, bounds).unwrap()
    }];
    let settings = Settings {
        task: table.task(),
        task_digest: table.task_digest(),
        sources: &sources,
        ..Settings::for_source(20, 10)
    };
    let mut permits = BTreeSet::new();
    for y_m in [0.0, 0.4, 0.8, 1.2, 1.6] {
        for since_fix_ms in [0, 1, 512, 513, 4992, 4993, 59_968, 59_969, u32::MAX] {
            let gate_c = zeroed();
            // SAFETY: valid pointers.
            let status = unsafe {
                posegate_gate_init(gate_c, SEE_T7.as_ptr(), SEE_T7.len(), of_c, leaked(0), 0)
            };
            assert_eq!(status, posegate_status::Ok);
            let mut gate = Gate::new(SEE_T7, &settings, 0).unwrap();
            let mut evidence = evidence_of_c(report_of_c(1, 100, belief_of_c(0.0, y_m, 0.0)), &[]);
            evidence.since_fix_ms = since_fix_ms;
            let (status, step) = step_on(gate_c, 110, &evidence);
            assert_eq!(status, posegate_status::Ok);
            let report = Report {
                source: 0,
                frame: FrameId::of("map"),
                sequence: 1,
                stamp_ms: 100,
                belief: belief(0.0, y_m, 0.0),
            };
            let evidence = Evidence {
                since_fix_ms: (since_fix_ms > 0).then_some(since_fix_ms),
                ..Evidence::of(&report)
            };
            let verdict = gate.step_on(110, &evidence).verdict;
            let reason = verdict.err().map_or(0, |reason| u32::from(reason.code()));
            assert_eq!(step.reason, reason, "{y_m} {since_fix_ms}");
            permits.insert((since_fix_ms, verdict.is_ok()));
        }
    }
    assert!(permits.contains(&(512, true)) && permits.contains(&(59_969, false)));
    assert!(!permits.contains(&(0, true)) && !permits.contains(&(u32::MAX, true)));
}

/// Each hypothesis must be inside, the slip counts, and more than seven other hypotheses are an error.
#[test]
fn c_hypotheses_equal_rust() {
    let good = belief_of_c(0.0, 0.0, 0.0);
    let beyond = belief_of_c(1.9, 1.5, 0.0);
    for (others, beside_um, reason) in [
        (vec![], 0, None),
        (vec![good; 7], 0, None),
        (vec![good, beyond], 0, Some(Reason::NotContained)),
        (
            vec![good, good, good, good, good, good, beyond],
            0,
            Some(Reason::NotContained),
        ),
        (vec![good], 3_000_000, Some(Reason::PoseSetTooLarge)),
    ] {
        let (gate_c, mut gate) = (gate_of_c(SEE_T7), gate_of_rust(SEE_T7));
        let mut evidence = evidence_of_c(report_of_c(1, 100, good), &others);
        evidence.beside_um = beside_um;
        let (status, step) = step_on(gate_c, 110, &evidence);
        assert_eq!(status, posegate_status::Ok);
        let expected: Vec<PoseEstimate> = others
            .iter()
            .map(|other| belief(other.x_m, other.y_m, 0.0))
            .collect();
        let report = Report {
            source: 0,
            frame: FrameId::of("map"),
            sequence: 1,
            stamp_ms: 100,
            belief: belief(0.0, 0.0, 0.0),
        };
        let answer = gate.step_on(
            110,
            &Evidence {
                report: &report,
                others: &expected,
                beside: Growth::new(beside_um, 0),
                since_fix_ms: None,
                elsewhere: Risk::NONE,
            },
        );
        assert_eq!(answer.verdict.err(), reason, "{} {beside_um}", others.len());
        assert_eq!(
            step.reason,
            reason.map_or(0, |reason| u32::from(reason.code()))
        );
    }
    let mut evidence = evidence_of_c(report_of_c(1, 100, good), &[good; 7]);
    // Probability outside of the hypotheses: 0.001 is compensated; 0.02 exceeds the 0.01 that a confidence of 0.99 leaves.
    for (elsewhere_q32, reason) in [
        (u32::MAX / 1000, 0),
        (u32::MAX / 50, u32::from(Reason::ElsewhereTooLikely.code())),
    ] {
        evidence.elsewhere_q32 = elsewhere_q32;
        let (status, step) = step_on(gate_of_c(SEE_T7), 110, &evidence);
        assert_eq!((status, step.reason), (posegate_status::Ok, reason));
    }
    evidence.elsewhere_q32 = 0;
    let gate = gate_of_c(SEE_T7);
    for count in [8, 255, u32::MAX] {
        evidence.other_count = count;
        let (status, step) = step_on(gate, 110, &evidence);
        assert_eq!(status, posegate_status::BadLength);
        assert_eq!(step.reason, u32::from(Reason::SourceUnknown.code()));
    }
    evidence.other_count = 3;
    evidence.others[2].heading_kind = 9;
    assert_eq!(step_on(gate, 110, &evidence).0, posegate_status::BadValue);
    // Entries beyond the count are not read.
    evidence.other_count = 2;
    assert_eq!(step_on(gate, 110, &evidence).0, posegate_status::Ok);
}

/// A gate closes at evidence or a tracker that is not there, and says so.
#[test]
fn a_gate_closes_without_evidence_or_tracker() {
    let settings = tracker_settings_of_c();
    // SAFETY: pointers are null, misaligned, to zeroed storage, or valid.
    unsafe {
        for (evidence, expected) in [
            (core::ptr::null_mut(), posegate_status::Null),
            (misaligned(), posegate_status::Misaligned),
        ] {
            let (status, step) = step_on(gate_of_c(DOCK), 0, evidence);
            assert_eq!(status, expected);
            assert_eq!(step.reason, u32::from(Reason::SourceUnknown.code()));
        }
        let (gate, step) = (gate_of_c(SEE_T7), zeroed::<posegate_step>());
        for (tracker, expected) in [
            (zeroed(), posegate_status::NotInitialised),
            (core::ptr::null_mut(), posegate_status::Null),
        ] {
            let status = posegate_gate_step_tracked(gate, 2_000, tracker, step);
            assert_eq!(status, expected);
            assert_eq!((*step).reason, u32::from(Reason::Silent.code()));
        }
        let (table, length) = (DOCK.as_ptr(), DOCK.len() - 1);
        let status = posegate_tracker_init(zeroed(), table, length, &settings);
        assert_eq!(status, posegate_status::TableInvalid);
    }
}

/// A step that is written into the tracker is an error, after which an open gate does not stay open.
#[test]
fn a_step_in_the_tracker_closes_the_gate() {
    let (gate, tracker) = (gate_of_c(SEE_T7), tracker_of_c());
    let mut belief = belief_of_c(0.0, 0.0, 0.0);
    belief.spread = [1e-6, 0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 1e-7];
    let opened = (1..40).find(|sequence| {
        let sequence = *sequence;
        let report = report_of_c(sequence, 10 * sequence, belief);
        let step = step_on(gate, 10 * sequence, &evidence_of_c(report, &[])).1;
        step.state.kind == posegate_state_kind::Permitted as u32
    });
    let now = 10 * opened.expect("the gate opens");
    let step = zeroed::<posegate_step>();
    // SAFETY: valid pointers.
    unsafe {
        let status = posegate_gate_step_tracked(gate, now, tracker, tracker.cast());
        assert_eq!(status, posegate_status::Overlap);
        assert_eq!(posegate_gate_tick(gate, now, step), posegate_status::Ok);
        assert_ne!((*step).state.kind, posegate_state_kind::Permitted as u32);
    }
}

#[test]
fn invalid_odometry_ends_the_path() {
    let tracker = tracker_of_c();
    let mut reason = 0;
    let increment = |stamp_ms: u32, ahead_m| posegate_increment {
        ahead_m,
        left_m: 0.0,
        turn_rad: 0.0,
        begins_ms: stamp_ms.saturating_sub(20),
        stamp_ms,
    };
    // SAFETY: valid pointers.
    unsafe {
        for stamp_ms in [0, 20, 40] {
            let status = posegate_tracker_odometry(tracker, &increment(stamp_ms, 0.0), &mut reason);
            assert_eq!((status, reason), (posegate_status::Ok, 0));
        }
        let fix = report_of_c(1, 20, belief_of_c(0.0, 0.0, 0.0));
        assert_eq!(
            posegate_tracker_fix(tracker, &fix, &mut reason),
            posegate_status::Ok
        );
        assert_eq!(reason, 0);
        let tracked = zeroed::<posegate_tracked>();
        assert_eq!(
            posegate_tracker_tracked(tracker, 45, tracked),
            posegate_status::Ok
        );
        assert_eq!((*tracked).reason, 0);
        let status = posegate_tracker_odometry(tracker, &increment(60, f64::NAN), &mut reason);
        assert_eq!(status, posegate_status::BadValue);
        assert_eq!(reason, u32::from(Reason::OdometryJump.code()));
        assert_eq!(
            posegate_tracker_tracked(tracker, 65, tracked),
            posegate_status::Ok
        );
        assert_eq!((*tracked).reason, u32::from(Reason::Silent.code()));
    }
}

/// Zeroed and wrong settings of a tracker are refused.
#[test]
fn zeroed_and_wrong_tracker_settings_are_refused() {
    type Change = fn(&mut posegate_tracker_settings);
    let wrong: [(Change, posegate_status); 9] = [
        (|s| s.errors = zero(), posegate_status::Odometry),
        (
            |s| (s.source.along_m_s, s.source.turn_rad_s) = (0.0, 0.0),
            posegate_status::Motion,
        ),
        (|s| s.errors.slip = -1.0, posegate_status::Odometry),
        (
            |s| s.errors.m_per_sqrt_m = f64::NAN,
            posegate_status::Odometry,
        ),
        (|s| s.maximum_gap_ms = 0, posegate_status::Odometry),
        (
            |s| s.maximum_fix_age_ms = 1 << 31,
            posegate_status::Odometry,
        ),
        (|s| s.source.motion = 0, posegate_status::Motion),
        (|s| s.source.inflation = 0.0, posegate_status::Inflation),
        (|s| s.source.cross_terms = 0, posegate_status::CrossTerms),
    ];
    for (change, expected) in wrong {
        let mut settings = tracker_settings_of_c();
        change(&mut settings);
        let tracker = zeroed();
        // SAFETY: valid pointers.
        unsafe {
            let status = posegate_tracker_init(tracker, SEE_T7.as_ptr(), SEE_T7.len(), &settings);
            assert_eq!(status, expected);
            let status = posegate_tracker_tracked(tracker, 0, zeroed());
            assert_eq!(status, posegate_status::NotInitialised);
        }
    }
}

/// The times equal those of Rust, and zeroed times make no gate.
#[test]
fn c_settings_check_equals_rust() {
    for (period_ms, jitter_ms) in [(20, 10), (500, 100), (0, 0), (u32::MAX, 7)] {
        let times = Settings::for_source(period_ms, jitter_ms);
        let found = zeroed::<posegate_settings>();
        // SAFETY: a valid pointer.
        let found = unsafe {
            let status = posegate_settings_for_source(period_ms, jitter_ms, found);
            assert_eq!(status, posegate_status::Ok);
            *found
        };
        assert_eq!(
            [
                found.maximum_age_ms,
                found.response_ms,
                found.report_period_ms,
                found.permit_hold_ms,
                found.inhibit_hold_ms
            ],
            [
                times.maximum_age_ms,
                times.response_ms,
                times.report_period_ms,
                times.permit_hold_ms,
                times.inhibit_hold_ms
            ],
        );
        assert_eq!(found.permits_in_a_row, u32::from(times.permits_in_a_row));
        let status = {
            // SAFETY: valid pointers.
            unsafe { posegate_gate_init(zeroed(), DOCK.as_ptr(), DOCK.len(), &found, leaked(0), 0) }
        };
        assert_ne!(status, posegate_status::Ok);
    }
}

/// A monitor in C equals one in Rust after each fix, refuses invalid innovations, and stays contradicted until its reset.
#[test]
fn c_monitor_equals_rust_monitor() {
    use posegate::gate::{Innovation, ModelStanding, Monitor};
    // SAFETY: storage and values of their types, which stay where they are.
    unsafe {
        let mut monitor: posegate_monitor = core::mem::zeroed();
        assert_eq!(
            posegate_monitor_init(&mut monitor, 99),
            posegate_status::BadValue
        );
        assert_eq!(
            posegate_monitor_init(&mut monitor, 10_000),
            posegate_status::Ok
        );
        let mut of_rust = Monitor::new(10_000).unwrap();
        let mut prediction: posegate_evidence = core::mem::zeroed();
        prediction.report = report_of_c(1, 20, belief_of_c(0.0, 0.0, 0.0));
        prediction.beside_um = 1_000;
        let mut seen = [0_u32; 3];
        let known = [
            posegate_dependence::Independent,
            posegate_dependence::Unknown,
        ];
        for at in 0..60 {
            // Good fixes, then some that are far off.
            let x_m = if at < 30 { 0.004 } else { 0.09 };
            let fix = report_of_c(2 + at, 40, belief_of_c(x_m, 0.0, 0.0));
            let mut model = 9;
            let dependence = known[at as usize % 2];
            let status = posegate_monitor_fix(
                &mut monitor,
                &fix,
                &prediction,
                dependence as u32,
                &mut model,
            );
            assert_eq!(status, posegate_status::Ok);
            let of = if at % 2 == 0 {
                Innovation::of_independent
            } else {
                Innovation::of_dependent
            };
            let (fix, from) = (belief(x_m, 0.0, 0.0), belief(0.0, 0.0, 0.0));
            let innovation = of(&fix, &from, posegate::set::Growth::new(1_000, 0)).unwrap();
            let expected = match of_rust.fix(&innovation).unwrap() {
                ModelStanding::Holds => 0,
                ModelStanding::InDoubt => 1,
                ModelStanding::Contradicted => 2,
            };
            assert_eq!(model, expected, "{at}");
            seen[expected as usize] += 1;
        }
        assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
        let contradicted = posegate_model::Contradicted as u32;
        let good = report_of_c(99, 40, belief_of_c(0.0, 0.0, 0.0));
        let fix = |monitor: &mut posegate_monitor, fix: &posegate_report, dependence| {
            let mut model = 0;
            let status = posegate_monitor_fix(monitor, fix, &prediction, dependence, &mut model);
            (status, model)
        };
        let ok = posegate_status::Ok;
        assert_eq!(fix(&mut monitor, &good, 1), (ok, contradicted));
        assert_eq!(posegate_monitor_reset(&mut monitor), ok);
        assert_eq!(fix(&mut monitor, &good, 1), (ok, 0));
        let refused = (posegate_status::BadValue, contradicted);
        assert_eq!(fix(&mut monitor, &good, 0), refused);
        assert_eq!(fix(&mut monitor, &good, 3), refused);
        let mut moved = posegate_monitor {
            words: monitor.words,
        };
        let status = posegate_monitor_reset(&mut moved);
        assert_eq!(status, posegate_status::NotInitialised);
    }
}

/// A gate that is given another table is closed, and then answers as a new gate with that table.
#[test]
fn a_changed_gate_is_a_new_one_with_the_other_table() {
    let of = |bytes: &'static [u8]| {
        let mut settings = settings_of_c(&Table::parse(bytes).unwrap());
        // The robot stands still, so both docks fit.
        settings.sources[0].motion = posegate_motion::StandsStill as u32;
        settings.sources[0].along_m_s = 0.0;
        settings.sources[0].turn_rad_s = 0.0;
        leaked(settings) as *const posegate_settings
    };
    let [gate, fresh] = [(SEE_T7, 0), (DOCK, 3005)].map(|(bytes, now_ms): (&'static [u8], u32)| {
        let gate = zeroed();
        let (table, length) = (bytes.as_ptr(), bytes.len());
        // SAFETY: valid pointers.
        let status =
            unsafe { posegate_gate_init(gate, table, length, of(bytes), leaked(0), now_ms) };
        assert_eq!(status, posegate_status::Ok);
        gate
    });
    let change = |gate: *mut posegate_gate, bytes: &'static [u8], settings, now_ms| {
        // SAFETY: valid pointers, or null for the settings.
        unsafe { posegate_gate_change_table(gate, bytes.as_ptr(), bytes.len(), settings, now_ms) }
    };
    let step = |gate, sequence: u32| {
        let now = 10 * sequence;
        // Inside both success sets.
        let mut belief = belief_of_c(0.0, 0.0, 0.0);
        belief.spread = [1e-6, 0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 1e-7];
        step_on(
            gate,
            now,
            &evidence_of_c(report_of_c(sequence, now, belief), &[]),
        )
    };
    for sequence in 1..300 {
        let _ = step(gate, sequence);
    }
    let is_permit = |(status, step): (posegate_status, posegate_step), now_ms| {
        assert_eq!(status, posegate_status::Ok);
        // SAFETY: a valid pointer.
        unsafe { posegate_permission_is_permit(&step.permission, now_ms) == POSEGATE_PERMIT }
    };
    let opened = step(gate, 300);
    assert_eq!(opened.1.reason, 0);
    assert!(is_permit(opened, 3000));
    assert_eq!(change(gate, DOCK, of(DOCK), 3005), posegate_status::Ok);
    for sequence in 301..600 {
        let (changed, expected) = (step(gate, sequence), step(fresh, sequence));
        assert_eq!(changed.1.reason, expected.1.reason, "{sequence}");
        let now = 10 * sequence;
        assert_eq!(
            is_permit(changed, now),
            is_permit(expected, now),
            "{sequence}"
        );
    }
    assert!(is_permit(step(gate, 600), 6000));
    // The settings are those of another task.
    assert_eq!(change(gate, DOCK, of(SEE_T7), 6005), posegate_status::Ok);
    assert!(!is_permit(step(gate, 601), 6010));
    // A latched fault outlives every change.
    // SAFETY: a valid pointer.
    let status = unsafe { posegate_gate_fault(fresh, Reason::InterlockFault as u32) };
    assert_eq!(status, posegate_status::Ok);
    for bytes in [SEE_T7, DOCK] {
        assert_eq!(change(fresh, bytes, of(bytes), 6005), posegate_status::Ok);
        let (status, denied) = step(fresh, 601);
        assert_eq!(status, posegate_status::Ok);
        assert_eq!(denied.state.kind, posegate_state_kind::Latched as u32);
        assert_eq!(denied.state.reason, Reason::InterlockFault as u32);
    }
    // After an error nothing is left that could permit.
    assert_eq!(
        change(gate, DOCK, core::ptr::null(), 6015),
        posegate_status::Null
    );
    let (status, denied) = step(gate, 602);
    assert_eq!(status, posegate_status::NotInitialised);
    // SAFETY: a valid pointer.
    let permits = unsafe { posegate_permission_is_permit(&denied.permission, 6020) };
    assert_ne!(permits, POSEGATE_PERMIT);
}

/// Returns a table with another squared radius, 2^-16.
fn of_radius(bytes: &[u8], radius_q16: u32) -> &'static [u8] {
    let mut bytes = bytes.to_vec();
    bytes[64..68].copy_from_slice(&radius_q16.to_le_bytes());
    let end = bytes.len() - 4;
    let crc = checksum_continued(0, &bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&crc);
    bytes.leak()
}

/// A tracker bounds the curvature of the path's error by the confidence. A gate on a table of a larger one permits nothing that it would not permit with a
/// tracker of that table.
#[test]
fn a_tracker_follows_the_confidence_of_the_gates_table() {
    let [less, more] = [1 << 16, 20 << 16].map(|radius_q16| of_radius(DOCK, radius_q16));
    let mut decisions = BTreeSet::new();
    for across in 0..120 {
        let verdicts = [less, more].map(|bytes| {
            let gate = gate_of_c(less);
            let mut settings = settings_of_c(&Table::parse(more).unwrap());
            settings.sources[0].motion = posegate_motion::StandsStill as u32;
            let settings = leaked(settings);
            let mut given = tracker_settings_of_c();
            given.errors.slip = 0.0;
            given.errors.turn_slip_per_m = 0.0;
            given.errors.m_per_sqrt_m = 1e-4;
            given.errors.rad_per_sqrt_m = 1e-4;
            given.errors.m_per_sqrt_s = 1e-4;
            given.errors.rad_per_sqrt_s = 1e-4;
            given.source.along_m_s = 5.0;
            given.source.turn_rad_s = 0.1;
            given.source.inflation = 1.0;
            let tracker = zeroed::<posegate_tracker>();
            let mut belief = belief_of_c(-1.0, 0.0005 * f64::from(across), 0.0);
            belief.spread = [1e-6, 0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 1e-4];
            let fix = report_of_c(1, 0, belief);
            let step = zeroed::<posegate_step>();
            let mut reason = 77;
            // SAFETY: valid pointers.
            unsafe {
                let status =
                    posegate_tracker_init(tracker, bytes.as_ptr(), bytes.len(), leaked(given));
                assert_eq!(status, posegate_status::Ok);
                for number in 0..11 {
                    let increment = posegate_increment {
                        ahead_m: 0.1,
                        left_m: 0.0,
                        turn_rad: 0.0,
                        begins_ms: if number == 0 { 0 } else { 20 * (number - 1) },
                        stamp_ms: 20 * number,
                    };
                    let status = posegate_tracker_odometry(tracker, &increment, &mut reason);
                    assert_eq!((status, reason), (posegate_status::Ok, 0));
                    if number == 0 {
                        let status = posegate_tracker_fix(tracker, &fix, &mut reason);
                        assert_eq!((status, reason), (posegate_status::Ok, 0));
                    }
                }
                let status =
                    posegate_gate_change_table(gate, more.as_ptr(), more.len(), settings, 190);
                assert_eq!(status, posegate_status::Ok);
                let status = posegate_gate_step_tracked(gate, 200, tracker, step);
                assert_eq!(status, posegate_status::Ok);
                (*step).reason
            }
        });
        assert_eq!(verdicts[0], verdicts[1], "{across}");
        decisions.insert(verdicts[0]);
    }
    assert!(decisions.len() > 1, "{decisions:?}");
}

/// A change of the table is no end of a permit that waits for a reset; an inhibit before it is.
#[test]
fn a_change_of_the_table_waits_for_no_reset() {
    let mut settings = settings_of_c(&Table::parse(SEE_T7).unwrap());
    settings.sources[0].motion = posegate_motion::StandsStill as u32;
    settings.restart = posegate_restart::OnReset as u32;
    let settings = leaked(settings);
    let (table, length) = (SEE_T7.as_ptr(), SEE_T7.len());
    for is_inhibited in [false, true] {
        let gate = zeroed();
        // SAFETY: valid pointers.
        let status = unsafe { posegate_gate_init(gate, table, length, settings, leaked(0), 0) };
        assert_eq!(status, posegate_status::Ok);
        let opened = |from: u32| {
            let states = (from..from + 30).map(|sequence| {
                let now = 10 * sequence;
                let mut belief = belief_of_c(0.0, 0.0, 0.0);
                belief.spread = [1e-6, 0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 1e-7];
                let report = report_of_c(sequence, now, belief);
                step_on(gate, now, &evidence_of_c(report, &[])).1.state.kind
            });
            states.collect::<Vec<_>>().pop()
        };
        assert_eq!(opened(1), Some(posegate_state_kind::Permitted as u32));
        // SAFETY: valid pointers.
        unsafe {
            if is_inhibited {
                let reason = Reason::Silent as u32;
                let status = posegate_gate_inhibit(gate, 305, reason, zeroed());
                assert_eq!(status, posegate_status::Ok);
            }
            let status = posegate_gate_change_table(gate, table, length, settings, 305);
            assert_eq!(status, posegate_status::Ok);
        }
        let expected = if is_inhibited {
            posegate_state_kind::Latched
        } else {
            posegate_state_kind::Permitted
        };
        assert_eq!(opened(31), Some(expected as u32));
    }
}
