//! Misuse of the C boundary: null and misaligned pointers, zeroed, copied and overwritten storage, numbers
//! that are not in their enum. Each is an error with a denial. Valid calls give the answers of Rust.
//!
//! `cargo test -p posegate-c --test c_boundary`; under Miri as well, with `MIRIFLAGS=-Zmiri-ignore-leaks`, since
//! storage is leaked so that it stays where it is.

mod support;

use core::ffi::CStr;
use core::mem::MaybeUninit;
use posegate::gate::{Gate, Permission, Reason, Restart, Settings, Source, State, Verdict};
use posegate::motion::MotionBounds;
use posegate::recordings::Evaluator;
use posegate::report::{FrameId, Heading, PoseEstimate, Report, mavlink, ros};
use posegate::set::{
    CrossTerms, Estimate, PoseSet, RadiusSquared, SplitWeight, Trust, Uncertainty,
};
use posegate::table::{Table, checksum};
use posegate::wire::{LONGEST_BODY, Receiver, Reply, Request, encode};
use posegate_c::*;
use support::functions::{Kind, functions, memory, put};
use support::{
    DOCK, SEE_T7, evidence_of_c, in_c, leaked, message, misaligned, name, report_of_c, settings,
    zero, zeroed,
};

const fn age(until_ms: u32, inflation_q16: u32) -> posegate_age {
    posegate_age {
        until_ms,
        inflation_q16,
    }
}

/// Miri is a thousand times slower.
const ROUNDS: u32 = if cfg!(miri) { 60 } else { 20_000 };

fn settings_of_rust() -> &'static Settings<'static> {
    let sources = [
        Source::new(
            "map",
            1.0,
            CrossTerms::Filled,
            MotionBounds::new(0.001, 0.0, 0.0).unwrap(),
        )
        .unwrap(),
        Source::new(
            "odom",
            1.5,
            CrossTerms::YawUnknown(SplitWeight::HALF),
            MotionBounds::STANDS_STILL,
        )
        .unwrap(),
    ];
    Box::leak(Box::new(Settings {
        task: "dock",
        task_digest: Table::parse(DOCK).unwrap().task_digest(),
        sources: Box::leak(Box::new(sources)),
        maximum_age_ms: 200,
        response_ms: 30,
        report_period_ms: 50,
        permit_hold_ms: 100,
        inhibit_hold_ms: 40,
        permits_in_a_row: 3,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: Some(7),
    }))
}

fn init(settings: &posegate_settings, now_ms: u32) -> (*mut posegate_gate, posegate_status) {
    let gate = zeroed();
    // SAFETY: all point to values of their types.
    let status =
        unsafe { posegate_gate_init(gate, DOCK.as_ptr(), DOCK.len(), settings, counter(), now_ms) };
    (gate, status)
}

fn gate() -> *mut posegate_gate {
    let (gate, status) = init(&settings(), 0);
    assert_eq!(status, posegate_status::Ok);
    gate
}

fn good(sequence: u32, stamp_ms: u32) -> posegate_report {
    let belief = belief(0.01, posegate_spread::Gaussian, [1e-4, 1e-4, 1e-4]);
    report_of_c(sequence, stamp_ms, belief)
}

fn belief(x_m: f64, kind: posegate_spread, [xx, yy, tt]: [f64; 3]) -> posegate_belief {
    posegate_belief {
        x_m,
        y_m: 0.0,
        heading: [0.0; 4],
        spread: match kind {
            posegate_spread::Gaussian => [xx, 0.0, 0.0, 0.0, yy, 0.0, 0.0, 0.0, tt],
            _ => [xx, tt, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        },
        heading_kind: posegate_heading::Yaw as u32,
        spread_kind: kind as u32,
    }
}

/// Returns an open step, the opposite of what an error must leave.
fn open_step() -> posegate_step {
    let [verdict, complement, low, high, a, b, c, d] = permitted();
    posegate_step {
        permission: posegate_permission {
            verdict,
            complement,
            flow: [low, high],
            made_ms: [a, b, c, d],
        },
        state: posegate_state {
            kind: posegate_state_kind::Permitted as u32,
            ..zero()
        },
        reason: 0,
    }
}

fn permitted() -> [u8; 8] {
    let margin = posegate::contain::Margin::ONE;
    Permission::of_single(&Verdict::Permit { margin }, 100).to_bytes()
}

fn open_verdict() -> posegate_verdict {
    posegate_verdict {
        verdict: POSEGATE_PERMIT,
        has_margin: 1,
        margin_q16: 1 << 20,
        ..zero()
    }
}

/// Returns the word in which a gate counts its calls.
fn counter() -> *mut u32 {
    leaked(0x1234_5678)
}

/// Returns `true` if a step opens the interlock in its own cycle. In another cycle a step must never open it.
fn is_permit(step: &posegate_step) -> bool {
    let made_ms = u32::from_le_bytes(step.permission.made_ms);
    // SAFETY: a reference.
    unsafe {
        for later in [1, 1 << 16, 1 << 31, u32::MAX] {
            let kept = posegate_permission_is_permit(&step.permission, made_ms.wrapping_add(later));
            assert_eq!(kept, POSEGATE_DENY);
        }
        posegate_permission_is_permit(&step.permission, made_ms) == POSEGATE_PERMIT
    }
}

fn step(
    gate: *mut posegate_gate,
    now_ms: u32,
    report: *const posegate_report,
) -> (posegate_status, posegate_step) {
    let mut step = open_step();
    // SAFETY: the tests pass only gates and reports that the function must handle.
    let status = unsafe { posegate_gate_step(gate, now_ms, report, &mut step) };
    (status, step)
}

/// Returns a gate that is open at 100 ms, after reports 0 to 4.
fn open_gate() -> *mut posegate_gate {
    let gate = gate();
    for sequence in 0..=4 {
        let now = sequence * 25;
        let (status, output) = step(gate, now, &good(sequence, now));
        assert_eq!(status, posegate_status::Ok);
        assert_eq!(is_permit(&output), sequence >= 2, "{output:?}");
    }
    gate
}

#[test]
fn gate_opens_and_closes() {
    let gate = open_gate();
    let (status, output) = step(gate, 110, &good(5, 110));
    assert_eq!(
        (status, is_permit(&output), output.reason),
        (posegate_status::Ok, true, 0)
    );
    let mut output = open_step();
    // SAFETY: all point to values of their types.
    let status = unsafe { posegate_gate_tick(gate, 211, &mut output) };
    assert_eq!((status, is_permit(&output)), (posegate_status::Ok, false));
    assert_eq!(output.reason, u32::from(Reason::Silent.code()));
    assert_eq!(output.state.kind, posegate_state_kind::Inhibited as u32);
    assert_eq!(output.state.reason, u32::from(Reason::Silent.code()));
}

/// A call without a place for the answer returns an error, and its input still counts: a denial closes, an
/// invalid report closes, and time passes.
#[test]
fn gate_closes_even_if_output_cannot_be_written() {
    let outside = posegate_report {
        belief: belief(1.0, posegate_spread::Gaussian, [1e-4, 1e-4, 1e-4]),
        ..good(5, 110)
    };
    let is_open = |gate, now_ms| {
        let mut output = open_step();
        // SAFETY: valid pointers.
        let status = unsafe { posegate_gate_tick(gate, now_ms, &mut output) };
        assert_eq!(status, posegate_status::Ok);
        is_permit(&output)
    };
    for (nowhere, expected) in [
        (core::ptr::null_mut(), posegate_status::Null),
        (misaligned(), posegate_status::Misaligned),
    ] {
        for (report, stays) in [
            (&raw const outside, false),
            (core::ptr::null(), false),
            (&raw const *leaked(good(5, 110)), true),
        ] {
            let gate = open_gate();
            // SAFETY: each pointer is null, misaligned or valid.
            let status = unsafe { posegate_gate_step(gate, 110, report, nowhere) };
            assert_eq!(status, expected);
            // Beyond the hold time of the last permit.
            for now_ms in [111, 135, 160, 185, 205] {
                assert_eq!(is_open(gate, now_ms), stays);
            }
        }
        // A clock that goes backwards in between is detected.
        let gate = open_gate();
        // SAFETY: as above.
        let status = unsafe { posegate_gate_tick(gate, 50, nowhere) };
        assert_eq!(status, expected);
        assert!(!is_open(gate, 105));
    }
}

/// Every function with every pointer null, misaligned, or to zeroed storage: an error, a denial in each output, and an `init` function
/// leaves storage that is not in use.
#[test]
fn bad_pointers_are_errors() {
    let mut count = 0;
    for function in functions() {
        let arguments = &function.arguments;
        let makes = function.name.ends_with("_init") || function.name.ends_with("_change_table");
        for (at, bad) in arguments.iter().enumerate() {
            let length = bad.bytes.len();
            let unaligned = memory(length + 16).wrapping_add(1);
            for (pointer, expected) in [
                (core::ptr::null_mut(), posegate_status::Null),
                (unaligned, posegate_status::Misaligned),
                (memory(length), posegate_status::NotInitialised),
            ] {
                // Bytes are always aligned, and only storage can be missing.
                let is_bad = match expected {
                    posegate_status::Misaligned => bad.align > 1,
                    posegate_status::NotInitialised => {
                        bad.is_storage() && !function.name.ends_with("_init")
                    }
                    _ => true,
                };
                if !is_bad {
                    continue;
                }
                let mut places: Vec<_> = arguments.iter().map(|a| memory(a.bytes.len())).collect();
                for (argument, place) in arguments.iter().zip(&places) {
                    argument.set_up(*place);
                    if !argument.is_storage() {
                        put(*place, &argument.bytes);
                    }
                }
                places[at] = pointer;
                let what = format!("{}: argument {at}, {expected:?}", function.name);
                assert_eq!(function.call(&places), expected, "{what}");
                for (argument, place) in arguments.iter().zip(&places) {
                    if *place == pointer {
                        continue;
                    }
                    match argument.kind {
                        Kind::Output => {
                            assert!(
                                is_denial(function.name, at, *place, argument.bytes.len()),
                                "{what}"
                            );
                        }
                        Kind::Storage { .. } if makes => {
                            assert!(!argument.is_in_use(*place), "{what}");
                        }
                        _ => {}
                    }
                }
                count += 1;
            }
        }
    }
    assert!(count >= 225, "{count}");
    // SAFETY: null.
    let opens = unsafe { posegate_permission_is_permit(core::ptr::null(), 0) };
    assert_eq!(opens, POSEGATE_DENY);
}

/// Returns `true` if a function with a bad argument has written a denial to an output that had no zeros.
fn is_denial(function: &str, bad: usize, output: *mut u8, length: usize) -> bool {
    // SAFETY: an output of the type of the function.
    unsafe {
        let word = *output.cast::<u32>();
        match function {
            "posegate_gate_tick"
            | "posegate_gate_inhibit"
            | "posegate_gate_step"
            | "posegate_gate_step_on"
            | "posegate_gate_step_tracked" => {
                let step = &*output.cast::<posegate_step>();
                // A gate that is there closes, and says so.
                let kind = if bad == 0 {
                    0
                } else {
                    posegate_state_kind::Inhibited as u32
                };
                step.state.kind == kind && !is_permit(step)
            }
            "posegate_gate_advice" => {
                let advice = &*output.cast::<posegate_advice>();
                (advice.kind, advice.tag) == (0, POSEGATE_NO_TAG)
            }
            "posegate_sequencer_next" => {
                let next = &*output.cast::<posegate_instruction>();
                (next.kind, next.stop) == (posegate_instruction_kind::Inhibit as u32, 0)
            }
            "posegate_monitor_fix" => word == posegate_model::Contradicted as u32,
            "posegate_tracker_odometry" => word == u32::from(Reason::OdometryJump.code()),
            "posegate_tracker_fix" => word == u32::from(Reason::Silent.code()),
            "posegate_tracker_tracked" => {
                let tracked = &*output.cast::<posegate_tracked>();
                tracked.reason == u32::from(Reason::Silent.code())
                    && tracked.evidence.other_count > POSEGATE_OTHERS as u32
            }
            _ => support::functions::read(output, length)
                .iter()
                .all(|byte| *byte == 0),
        }
    }
}

/// Lengths that no memory has.
#[test]
fn invalid_lengths_are_errors() {
    const BAD: posegate_status = posegate_status::BadLength;
    let bytes = DOCK.as_ptr();
    // SAFETY: no byte of such lengths is read.
    unsafe {
        for length in [usize::MAX, usize::MAX / 2 + 1, usize::MAX - bytes.addr()] {
            assert_eq!(
                posegate_gate_init(gate(), bytes, length, &settings(), counter(), 0),
                BAD
            );
            assert_eq!(posegate_judge_init(zeroed(), bytes, length, 200), BAD);
            assert_eq!(posegate_table_check(bytes, length, zeroed()), BAD);
            assert_eq!(posegate_checksum(0, bytes, length, zeroed()), BAD);
            assert_eq!(posegate_frame_id(bytes.cast(), length, zeroed()), BAD);
            assert_eq!(posegate_request_decode(bytes, length, zeroed()), BAD);
        }
        let body = leaked(message(&[]));
        (*body).length = LONGEST_BODY as u8 + 1;
        assert_eq!(posegate_frame_encode(body, body), BAD);
        (*body).length = u8::MAX;
        assert_eq!(posegate_frame_encode(body, body), BAD);
    }
}

/// A copy of a gate is not a gate, nor is a gate with a flipped bit of its seal.
#[test]
fn moved_and_overwritten_storage_is_refused() {
    let gate = open_gate();
    // SAFETY: valid pointers; a copy is what C's assignment makes.
    unsafe {
        let copy = zeroed::<posegate_gate>();
        copy.cast::<MaybeUninit<posegate_gate>>()
            .copy_from_nonoverlapping(gate.cast(), 1);
        assert_eq!(
            step(copy, 100, &good(5, 100)).0,
            posegate_status::NotInitialised
        );
        for bit in 0..64 {
            (*gate).words[0] ^= 1 << bit;
            let (status, output) = step(gate, 100, &good(5, 100));
            assert_eq!(status, posegate_status::NotInitialised);
            assert!(!is_permit(&output));
            (*gate).words[0] ^= 1 << bit;
        }
        // A judge's storage is not a gate.
        let judge = judge(DOCK);
        (*gate).words[0] = (*judge).words[0];
        assert_eq!(
            step(gate, 100, &good(5, 100)).0,
            posegate_status::NotInitialised
        );
    }
}

/// An invalid report closes an open gate, and the gate can qualify again.
#[test]
fn invalid_report_closes_the_gate() {
    let mut bad = [good(5, 100); 4];
    bad[0].belief.heading_kind = 0;
    bad[1].belief.heading_kind = 4;
    bad[2].belief.spread_kind = 0;
    bad[3].belief.spread_kind = u32::MAX;
    for report in bad {
        let gate = open_gate();
        let (status, output) = step(gate, 100, &report);
        assert_eq!(status, posegate_status::BadValue);
        assert!(!is_permit(&output));
        let mut output = open_step();
        // SAFETY: valid pointers.
        let status = unsafe { posegate_gate_tick(gate, 101, &mut output) };
        assert_eq!(status, posegate_status::Ok);
        assert!(!is_permit(&output));
        assert_eq!(output.state.kind, posegate_state_kind::Inhibited as u32);
    }
    for source in [2, 3, 4, 255, 256, u32::MAX] {
        let gate = open_gate();
        let report = posegate_report {
            source,
            ..good(5, 100)
        };
        let (status, output) = step(gate, 100, &report);
        assert_eq!(status, posegate_status::Ok);
        assert!(!is_permit(&output));
        assert_eq!(
            output.reason,
            u32::from(Reason::SourceUnknown.code()),
            "{source}"
        );
    }
}

/// Each setting that would switch off a check has its own error, and leaves no gate.
#[test]
fn no_setting_disables_a_check() {
    type Change = fn(&mut posegate_settings);
    let wrong: [(Change, posegate_status); 40] = [
        (|s| s.report_period_ms = 0, posegate_status::ReportPeriod),
        (
            |s| s.report_period_ms = 1 << 31,
            posegate_status::ReportPeriod,
        ),
        (
            |s| s.report_period_ms = s.permit_hold_ms + 1,
            posegate_status::PermitHoldTooShort,
        ),
        (
            |s| s.maximum_age_ms = s.report_period_ms + s.response_ms - 1,
            posegate_status::MaximumAgeTooShort,
        ),
        (|s| s.response_ms = 0, posegate_status::ResponseTime),
        (|s| s.response_ms = 200, posegate_status::ResponseTime),
        (|s| s.task = [0; 32], posegate_status::Task),
        (|s| s.task[0] = -1i8 as _, posegate_status::Task),
        (|s| s.source_count = 0, posegate_status::Sources),
        (|s| s.source_count = 5, posegate_status::Sources),
        (|s| s.source_count = u32::MAX, posegate_status::Sources),
        (|s| s.source_count = 3, posegate_status::CrossTerms),
        (|s| s.sources[0].frame = [0; 32], posegate_status::Frame),
        (
            |s| s.sources[0].frame[1] = -1i8 as _,
            posegate_status::Frame,
        ),
        (|s| s.sources[1].frame = name("/"), posegate_status::Frame),
        (|s| s.sources[0].inflation = 0.0, posegate_status::Inflation),
        (
            |s| s.sources[0].inflation = f64::NAN,
            posegate_status::Inflation,
        ),
        (
            |s| s.sources[0].inflation = 0.99999,
            posegate_status::Inflation,
        ),
        (
            |s| s.sources[0].cross_terms = 0,
            posegate_status::CrossTerms,
        ),
        (
            |s| s.sources[0].cross_terms = 4,
            posegate_status::CrossTerms,
        ),
        (|s| s.sources[0].motion = 0, posegate_status::Motion),
        (|s| s.sources[0].motion = 3, posegate_status::Motion),
        (|s| s.sources[0].along_m_s = -0.1, posegate_status::Motion),
        (
            |s| s.sources[0].across_m_s = f64::NAN,
            posegate_status::Motion,
        ),
        (
            |s| s.sources[0].turn_rad_s = f64::INFINITY,
            posegate_status::Motion,
        ),
        (
            |s| s.sources[0].ages[0].until_ms = 64,
            posegate_status::Aging,
        ),
        (
            |s| s.sources[0].ages[0].inflation_q16 = 1 << 16,
            posegate_status::Aging,
        ),
        (
            |s| s.sources[0].ages[1] = age(640, 1 << 16),
            posegate_status::Aging,
        ),
        (
            |s| s.sources[0].ages = [age(640, 1 << 16); 4],
            posegate_status::Aging,
        ),
        (
            |s| s.sources[0].ages[0] = age(640, u32::MAX),
            posegate_status::Aging,
        ),
        (|s| s.sources[1].share_q8 = 0, posegate_status::CrossTerms),
        (|s| s.sources[1].share_q8 = 256, posegate_status::CrossTerms),
        (|s| s.maximum_age_ms = 0, posegate_status::MaximumAge),
        (|s| s.maximum_age_ms = 1 << 31, posegate_status::MaximumAge),
        (|s| s.permit_hold_ms = 0, posegate_status::PermitHold),
        (|s| s.inhibit_hold_ms = 0, posegate_status::InhibitHold),
        (|s| s.permits_in_a_row = 0, posegate_status::PermitsInARow),
        (
            |s| s.permits_in_a_row = 65_536,
            posegate_status::PermitsInARow,
        ),
        (|s| s.restart = 0, posegate_status::Restart),
        (|s| s.restart = 3, posegate_status::Restart),
    ];
    for (index, (change, expected)) in wrong.into_iter().enumerate() {
        let mut settings = settings();
        change(&mut settings);
        let (gate, status) = init(&settings, 0);
        assert_eq!(status, expected, "{index}");
        assert_eq!(
            step(gate, 0, &good(0, 0)).0,
            posegate_status::NotInitialised
        );
    }
    // Zeroed settings.
    // SAFETY: numbers.
    assert_ne!(init(unsafe { &*zeroed() }, 0).1, posegate_status::Ok);
}

/// With a damaged table, or a table of another task or site, the gate reports the reason.
#[test]
fn gate_without_its_table_latches_with_reason() {
    let mut damaged = DOCK.to_vec();
    damaged[200] ^= 1;
    let mut other_site = settings();
    other_site.task_digest[31] ^= 1;
    let cases: [(&[u8], posegate_settings, Reason); 4] = [
        (&[], settings(), Reason::TableDamaged),
        (&damaged, settings(), Reason::TableDamaged),
        (SEE_T7, settings(), Reason::WrongTask),
        (DOCK, other_site, Reason::WrongSite),
    ];
    for (table, settings, reason) in cases {
        let gate = zeroed();
        // SAFETY: valid pointers, as long as the table is there.
        unsafe {
            let status =
                posegate_gate_init(gate, table.as_ptr(), table.len(), &settings, counter(), 0);
            assert_eq!(status, posegate_status::Ok);
            let (_, output) = step(gate, 0, &good(0, 0));
            assert!(!is_permit(&output));
            assert_eq!(output.state.kind, posegate_state_kind::Latched as u32);
            assert_eq!(output.reason, u32::from(reason.code()));
        }
    }
}

#[test]
fn faults_are_latched_until_the_reset() {
    for (reported, expected) in [
        (33, Reason::InterlockFault),
        (30, Reason::CodeDamaged),
        (0, Reason::MemoryDamaged),
        (256 + 33, Reason::MemoryDamaged),
    ] {
        let gate = open_gate();
        // SAFETY: valid pointers.
        unsafe {
            let status = posegate_gate_fault(gate, reported);
            assert_eq!(status == posegate_status::Ok, (1..=35).contains(&reported));
            let mut state = open_step().state;
            assert_eq!(posegate_gate_state(gate, &mut state), posegate_status::Ok);
            assert_eq!(state.kind, posegate_state_kind::Latched as u32);
            assert_eq!(state.reason, u32::from(expected.code()));
            assert!(!is_permit(&step(gate, 100, &good(5, 100)).1));
            let mut advice = posegate_advice { kind: 0, tag: 0 };
            assert_eq!(posegate_gate_advice(gate, &mut advice), posegate_status::Ok);
            assert_eq!(advice.kind, posegate_advice_kind::Service as u32);
            assert_eq!(advice.tag, POSEGATE_NO_TAG);
            assert_eq!(posegate_gate_reset(gate, 200), posegate_status::Ok);
            for sequence in 0..=2 {
                let now = 240 + sequence;
                let (_, output) = step(gate, now, &good(sequence, now));
                assert_eq!(is_permit(&output), sequence == 2, "{output:?}");
            }
        }
    }
}

/// If something else has closed the interlock, the gate qualifies again. An invalid reason number latches.
#[test]
fn an_inhibited_gate_qualifies_again() {
    for (reason, kind, status) in [
        (35, posegate_state_kind::Inhibited, posegate_status::Ok),
        (0, posegate_state_kind::Latched, posegate_status::BadValue),
        (49, posegate_state_kind::Inhibited, posegate_status::Ok),
        (50, posegate_state_kind::Latched, posegate_status::BadValue),
        (291, posegate_state_kind::Latched, posegate_status::BadValue),
    ] {
        let gate = open_gate();
        // SAFETY: valid pointers; a step is optional.
        unsafe {
            let mut output = open_step();
            assert_eq!(
                posegate_gate_inhibit(gate, 100, reason, &mut output),
                status
            );
            assert!(!is_permit(&output));
            assert_eq!(output.state.kind, kind as u32, "{reason}");
            let gate = open_gate();
            let none = posegate_gate_inhibit(gate, 100, reason, core::ptr::null_mut());
            assert_eq!(none, posegate_status::Null);
            let mut state = open_step().state;
            assert_eq!(posegate_gate_state(gate, &mut state), posegate_status::Ok);
            assert_eq!(state.kind, kind as u32, "{reason}");
        }
    }
    let gate = open_gate();
    // SAFETY: valid pointers.
    unsafe {
        let mut output = open_step();
        let late = u32::from(Reason::CycleLate.code());
        assert_eq!(
            posegate_gate_inhibit(gate, 100, late, &mut output),
            posegate_status::Ok
        );
        assert_eq!(output.state.reason, late);
    }
    for sequence in 5..=7 {
        let now = 120 + 20 * sequence;
        let (_, output) = step(gate, now, &good(sequence, now));
        assert_eq!(is_permit(&output), sequence == 7, "{output:?}");
    }
}

/// A damaged number in the gate's copy of its settings does not become a setting at a reset.
#[test]
#[cfg_attr(
    miri,
    ignore = "looks for the number in storage, between whose words there is padding"
)]
fn a_reset_takes_no_damaged_settings() {
    const AGE_MS: u32 = 123_457;
    let mut found = 0;
    for bit in 0..32 {
        let given = posegate_settings {
            maximum_age_ms: AGE_MS,
            response_ms: 30,
            ..settings()
        };
        let (gate, status) = init(&given, 0);
        assert_eq!(status, posegate_status::Ok);
        let words = gate.cast::<u32>();
        // SAFETY: valid pointers, within the storage.
        unsafe {
            // The copy, and not the gate's own word, which its complement follows.
            for at in 0..size_of::<posegate_gate>() / 4 - 1 {
                if *words.add(at) == AGE_MS && *words.add(at + 1) != !AGE_MS {
                    *words.add(at) ^= 1 << bit;
                    found += 1;
                }
            }
            let status = posegate_gate_reset(gate, 0);
            assert_eq!(status, posegate_status::MemoryDamaged);
            let mut state = open_step().state;
            assert_eq!(posegate_gate_state(gate, &mut state), posegate_status::Ok);
            assert_eq!(state.kind, posegate_state_kind::Latched as u32);
            assert_eq!(state.reason, u32::from(Reason::MemoryDamaged.code()));
        }
    }
    assert_eq!(found, 32);
}

/// A scrub reports its rounds, and latches the gate if the bytes do not match their checksum.
#[test]
fn scrub_reports_its_result() {
    let mut damaged = DOCK.to_vec();
    damaged[200] ^= 1;
    let length = damaged.len();
    for (table, found) in [
        (DOCK, posegate_scrubbed::Whole),
        (damaged.as_slice(), posegate_scrubbed::Damaged),
    ] {
        let gate = zeroed();
        let mut output = 0;
        // SAFETY: valid pointers.
        unsafe {
            let status =
                posegate_gate_init(gate, table.as_ptr(), length, &settings(), counter(), 0);
            assert_eq!(status, posegate_status::Ok);
            let status = posegate_gate_scrub(gate, 100, &mut output);
            assert_eq!(status, posegate_status::Ok);
            assert_eq!(output, posegate_scrubbed::UnderWay as u32);
            let status = posegate_gate_scrub(gate, length, &mut output);
            assert_eq!((status, output), (posegate_status::Ok, found as u32));
            // Without a place for the answer the round continues.
            let status = posegate_gate_scrub(gate, 100, core::ptr::null_mut());
            assert_eq!(status, posegate_status::Null);
            let status = posegate_gate_scrub(gate, length - 104, &mut output);
            assert_eq!((status, output), (posegate_status::Ok, found as u32));
        }
    }
}

fn judge(table: &'static [u8]) -> *mut posegate_judge {
    let judge = zeroed();
    // SAFETY: valid pointers.
    let status = unsafe { posegate_judge_init(judge, table.as_ptr(), table.len(), 200) };
    assert_eq!(status, posegate_status::Ok);
    judge
}

fn estimate(
    belief: &posegate_belief,
    now_ms: u32,
    stamp_ms: u32,
    radius: u32,
) -> posegate_estimate {
    posegate_estimate {
        belief: *belief,
        stamp_ms,
        now_ms,
        radius_squared_q16: radius,
        reserved: 0,
    }
}

/// Random numbers from a seed, the same on every machine (Marsaglia's xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, limit: u32) -> u32 {
        (self.next() >> 32) as u32 % limit
    }

    /// Returns a number from -1 to 1.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Returns a number up to `scale`, and sometimes a float of random bits.
    fn number(&mut self, scale: f64) -> f64 {
        match self.below(40) {
            0 => f64::from_bits(self.next()),
            _ => self.unit() * scale,
        }
    }

    fn belief(&mut self) -> PoseEstimate {
        let variance = |random: &mut Self, scale: f64| random.number(scale).abs();
        let yaw = self.number(0.08);
        let (s, c) = (yaw / 2.0).sin_cos();
        let half = self.below(2) == 0;
        PoseEstimate {
            x_m: self.number(0.1),
            y_m: self.number(0.08),
            heading: match self.below(4) {
                0 => Heading::Quaternion([self.number(0.01), self.number(0.01), s, c]),
                1 => Heading::RollPitchYaw([self.number(0.05), self.number(0.05), yaw]),
                _ => Heading::Radians(yaw),
            },
            spread: match self.below(8) {
                0 => None,
                1..=3 => Some(Uncertainty::Bounded {
                    translation_m: variance(self, 0.05),
                    yaw_rad: variance(self, 0.03),
                }),
                _ => {
                    let (xx, yy, tt) = (
                        variance(self, 4e-4),
                        variance(self, 4e-4),
                        variance(self, 2e-4),
                    );
                    let xy = if half { 0.0 } else { self.number(1e-4) };
                    Some(Uncertainty::Gaussian([
                        [xx, xy, 0.0],
                        [xy, yy, 0.0],
                        [0.0, 0.0, tt],
                    ]))
                }
            },
        }
    }
}

fn assert_same(output: &posegate_verdict, verdict: &Verdict, place: &str) {
    match verdict {
        Verdict::Permit { margin } => {
            assert_eq!(
                (output.verdict, output.reason),
                (POSEGATE_PERMIT, 0),
                "{place}"
            );
            assert_eq!(
                (output.has_margin, output.has_worst_pose),
                (1, 0),
                "{place}"
            );
            assert_eq!(output.margin_q16, margin.q16(), "{place}");
        }
        Verdict::Deny {
            reason,
            margin,
            worst_pose,
        } => {
            assert_eq!(output.verdict, POSEGATE_DENY, "{place}");
            assert_eq!(output.reason, u32::from(reason.code()), "{place}");
            let has = (margin.is_some(), worst_pose.is_some());
            assert_eq!(
                (output.has_margin == 1, output.has_worst_pose == 1),
                has,
                "{place}"
            );
            assert_eq!(output.margin_q16, margin.map_or(0, |m| m.q16()), "{place}");
            let pose = worst_pose.unwrap_or_default();
            let found = &output.worst_pose;
            assert_eq!(
                (found.x_um, found.y_um, found.yaw_turn_q32),
                (pose.x_um, pose.y_um, pose.yaw.0),
                "{place}"
            );
        }
    }
}

/// A gate in C and a gate in Rust with the same reports, ticks and faults agree at every step.
#[test]
fn c_gate_equals_rust_gate() {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (in_c, mut in_rust) = (gate(), Gate::new(DOCK, settings_of_rust(), 0).unwrap());
    let (mut now, mut sequence) = (0u32, 0u32);
    let (mut permits, mut denials, mut examined) = (0, 0, 0);
    for round in 0..ROUNDS {
        now = now.wrapping_add(random.below(30));
        // Rounds with good reports, so that the gate opens, and other rounds.
        let calm = round / 16 % 2 == 0;
        let mut output = open_step();
        let (expected, place) = if random.below(6) == 0 {
            // SAFETY: valid pointers.
            let status = unsafe { posegate_gate_tick(in_c, now, &mut output) };
            assert_eq!(status, posegate_status::Ok);
            (in_rust.tick(now), format!("tick {round} at {now}"))
        } else {
            let belief = if calm {
                PoseEstimate::diagonal(
                    Estimate {
                        x_m: random.unit() * 0.01,
                        y_m: 0.0,
                        yaw_rad: 0.0,
                    },
                    [1e-4, 1e-4, 1e-4],
                )
            } else {
                random.belief()
            };
            let odd = !calm && random.below(8) == 0;
            sequence = sequence.wrapping_add(if odd { random.below(3) } else { 1 });
            let source = if odd { random.below(4) as u8 } else { 0 };
            let frame = match (odd, random.below(3)) {
                (true, 0) => FrameId::UNNAMED,
                _ if source == 1 => FrameId::of("odom"),
                _ => FrameId::of("map"),
            };
            let age = if odd { random.below(300) } else { 0 };
            let report = Report {
                source,
                frame,
                sequence,
                stamp_ms: now.wrapping_sub(age),
                belief,
            };
            let given = posegate_report {
                belief: self::in_c(&belief),
                frame: frame.digest(),
                source: u32::from(source),
                sequence,
                stamp_ms: report.stamp_ms,
                reserved: 0,
            };
            if round % 7 == 0 {
                let mut verdict = open_verdict();
                // SAFETY: valid pointers.
                let status = unsafe { posegate_gate_examine(in_c, &given, &mut verdict) };
                assert_eq!(status, posegate_status::Ok);
                assert_same(&verdict, &in_rust.examine(&report), "examined");
                examined += 1;
            }
            let (status, step) = step(in_c, now, &given);
            assert_eq!(status, posegate_status::Ok);
            output = step;
            (
                in_rust.step(now, &report),
                format!("{round} at {now}: {report:?}"),
            )
        };
        let [verdict, complement, low, high, a, b, c, d] = expected.permission.to_bytes();
        let permission = posegate_permission {
            verdict,
            complement,
            flow: [low, high],
            made_ms: [a, b, c, d],
        };
        assert_eq!(output.permission, permission, "{place}");
        assert_eq!(
            is_permit(&output),
            expected.permission.is_permit(),
            "{place}"
        );
        let (kind, reason, count) = match expected.state {
            State::Inhibited(reason) => (1, reason.code(), 0),
            State::Qualifying(count) => (2, 0, count),
            State::Permitted => (3, 0, 0),
            State::Latched(reason) => (4, reason.code(), 0),
            other => panic!("{other:?}"),
        };
        let state = posegate_state {
            kind,
            reason: u32::from(reason),
            permits: u32::from(count),
        };
        assert_eq!(output.state, state, "{place}");
        let reason = expected.verdict.map_or_else(Reason::code, |()| 0);
        assert_eq!(output.reason, u32::from(reason), "{place}");
        if is_permit(&output) {
            permits += 1;
        } else {
            denials += 1;
        }
    }
    println!("{permits} permits, {denials} denials, {examined} examined");
    let share = ROUNDS / 20;
    assert!(
        permits >= share && denials >= share && examined > 0,
        "{permits} {denials}"
    );
}

/// A judge in C and one in Rust agree on the same estimates.
#[test]
fn c_judge_equals_rust_evaluator() {
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    let (in_c, in_rust) = (judge(DOCK), Evaluator::new(DOCK, 200).unwrap());
    let (mut permits, mut denials, mut refused) = (0, 0, 0);
    for round in 0..ROUNDS {
        let belief = random.belief();
        let site = in_rust.radius_squared().q16();
        let radius = match random.below(4) {
            0 | 1 => 0,
            2 => 65_536 + random.below(site - 65_536),
            _ => site + random.below(1 << 18),
        };
        let used = RadiusSquared::from_q16(radius).unwrap_or(in_rust.radius_squared());
        let (now, stamp) = (random.below(220), random.below(20));
        // The answer of a bench in Rust for the same numbers.
        let set = match (belief.heading, belief.spread) {
            (Heading::Radians(yaw_rad), Some(spread)) => {
                let estimate = Estimate {
                    x_m: belief.x_m,
                    y_m: belief.y_m,
                    yaw_rad,
                };
                match spread {
                    Uncertainty::Gaussian(covariance) => {
                        PoseSet::gaussian(estimate, covariance, used)
                    }
                    Uncertainty::Bounded {
                        translation_m,
                        yaw_rad,
                    } => PoseSet::bounded(estimate, translation_m, yaw_rad),
                }
            }
            _ => belief.pose_set(used, Trust::FULL),
        };
        let asked = estimate(&self::in_c(&belief), now, stamp, radius);
        let place = format!("{round}: {belief:?} {now} {stamp} {radius}");
        let mut output = open_verdict();
        // SAFETY: valid pointers.
        let status = unsafe { posegate_judge_permits(in_c, &asked, &mut output) };
        if radius > 0 && radius < site && matches!(belief.spread, Some(Uncertainty::Gaussian(_))) {
            // Less strict than the site.
            assert_eq!(status, posegate_status::BadValue, "{place}");
            assert_eq!(output.verdict, POSEGATE_DENY, "{place}");
            refused += 1;
            continue;
        }
        assert_eq!(status, posegate_status::Ok, "{place}");
        let expected = in_rust.permits(now, stamp, set);
        assert_eq!(
            output.verdict == POSEGATE_PERMIT,
            expected.is_ok(),
            "{place}"
        );
        assert_eq!(
            output.verdict == POSEGATE_DENY,
            expected.is_err(),
            "{place}"
        );
        let reason = expected.map_or_else(Reason::code, |()| 0);
        assert_eq!(output.reason, u32::from(reason), "{place}");
        assert_eq!(
            (output.has_margin, output.has_worst_pose),
            (0, 0),
            "{place}"
        );
        if round % 7 == 0 {
            // SAFETY: valid pointers.
            let status = unsafe { posegate_judge_examine(in_c, &asked, &mut output) };
            assert_eq!(status, posegate_status::Ok, "{place}");
            assert_same(&output, &in_rust.evaluate(now, stamp, set), &place);
        }
        if expected.is_ok() {
            permits += 1;
        } else {
            denials += 1;
        }
    }
    println!("{permits} permits, {denials} denials");
    let share = ROUNDS / 20;
    assert!(
        permits >= share && denials >= share && refused >= share,
        "{permits} {denials} {refused}"
    );
    // A radius that switches off the check, and one just below the site's.
    let below = in_rust.radius_squared().q16() - 1;
    for radius in [1, 65_535, below, 1 << 24, u32::MAX] {
        let mut output = open_verdict();
        let asked = estimate(&good(0, 0).belief, 0, 0, radius);
        // SAFETY: valid pointers.
        let status = unsafe { posegate_judge_permits(in_c, &asked, &mut output) };
        assert_eq!(
            (status, output.verdict),
            (posegate_status::BadValue, POSEGATE_DENY)
        );
    }
}

#[test]
fn c_messages_become_same_estimates_as_in_rust() {
    let mut random = Random(0x1234_5678_9abc_def1);
    for _ in 0..ROUNDS.min(500) {
        let mut made = leaked(in_c(&random.belief()));
        let mut float = || random.unit() as f32;
        let position = [float(), float(), float()];
        let q = [float(), float(), float(), float()];
        let pose_covariance = core::array::from_fn(|_| float());
        let angles = [float(), float(), float()];
        // SAFETY: valid pointers.
        let check =
            |expected: PoseEstimate, status: posegate_status, made: *mut posegate_belief| unsafe {
                assert_eq!(status, posegate_status::Ok);
                let (got, expected) = (&*made, in_c(&expected));
                assert_eq!((got.x_m, got.y_m), (expected.x_m, expected.y_m));
                assert_eq!(got.heading_kind, expected.heading_kind);
                assert_eq!(got.spread_kind, expected.spread_kind);
                assert_eq!(got.spread, expected.spread);
                let used = [1, 3, 4][got.heading_kind as usize - 1];
                assert_eq!(got.heading[..used], expected.heading[..used]);
            };
        for (axes, side) in [(1, mavlink::Axes::Up), (2, mavlink::Axes::Down)] {
            let message = posegate_mavlink_odometry {
                position,
                q,
                pose_covariance,
            };
            // SAFETY: valid pointers.
            let status = unsafe { posegate_belief_from_mavlink_odometry(&message, axes, made) };
            let odometry = mavlink::Odometry {
                position,
                q,
                pose_covariance,
            };
            check(odometry.belief(side), status, made);
            let message = posegate_mavlink_vision {
                position,
                angles,
                covariance: pose_covariance,
            };
            // SAFETY: valid pointers.
            let status = unsafe { posegate_belief_from_mavlink_vision(&message, axes, made) };
            let vision = mavlink::VisionPositionEstimate {
                position,
                angles,
                covariance: pose_covariance,
            };
            check(vision.belief(side), status, made);
        }
        let numbers: [f32; 9] = core::array::from_fn(|_| float());
        let [x_m, y_m, yaw_rad, xx, xy, x_yaw, yy, y_yaw, yaw_yaw] = numbers;
        let compact = posegate_compact {
            x_m,
            y_m,
            yaw_rad,
            xx,
            xy,
            x_yaw,
            yy,
            y_yaw,
            yaw_yaw,
        };
        // SAFETY: valid pointers.
        let status = unsafe { posegate_belief_from_compact(&compact, made) };
        check(PoseEstimate::compact(numbers), status, made);
        let message = posegate_ros_pose {
            position: position.map(f64::from),
            orientation: q.map(f64::from),
            covariance: core::array::from_fn(|_| random.unit()),
        };
        // SAFETY: valid pointers.
        let status = unsafe { posegate_belief_from_ros(&message, made) };
        let same = ros::PoseWithCovariance {
            position: message.position,
            orientation: message.orientation,
            covariance: message.covariance,
        };
        check(PoseEstimate::from(&same), status, made);
        // Invalid axes give no belief that a gate would accept.
        for axes in [0, 3, u32::MAX] {
            made = leaked(in_c(&PoseEstimate::compact(numbers)));
            // SAFETY: valid pointers.
            unsafe {
                let status = posegate_belief_from_mavlink_odometry(zeroed(), axes, made);
                assert_eq!(status, posegate_status::BadValue);
                assert_eq!(((*made).heading_kind, (*made).spread_kind), (0, 0));
            }
        }
    }
    // A source without a known covariance.
    let (message, made) = (zeroed::<posegate_mavlink_odometry>(), zeroed());
    // SAFETY: valid pointers.
    unsafe {
        (*message).pose_covariance[0] = f32::NAN;
        let status = posegate_belief_from_mavlink_odometry(message, 2, made);
        assert_eq!(status, posegate_status::Ok);
        assert_eq!((*made).spread_kind, posegate_spread::Unknown as u32);
    }
}

fn request() -> posegate_request {
    posegate_request {
        belief: belief(0.01, posegate_spread::Bounded, [0.01, 0.0, 0.005]),
        sequence: 9,
        table: 0,
        stamp_ms: 5,
        now_ms: 15,
        radius_squared_q16: 743_498,
        reserved: 0,
    }
}

/// Frames, good and damaged, are decoded and encoded as by `posegate::wire`.
#[test]
fn c_wire_bytes_equal_rust_bytes() {
    let mut random = Random(77);
    let receiver = zeroed();
    let judges = leaked([[0u64; size_of::<posegate_judge>() / 8]; 2]).cast::<posegate_judge>();
    let in_rust = [DOCK, SEE_T7].map(|table| Evaluator::new(table, 200).unwrap());
    let mut plain = Receiver::new();
    let (mut answered, mut refused) = (0, 0);
    // SAFETY: valid pointers.
    unsafe {
        assert_eq!(posegate_receiver_init(receiver), posegate_status::Ok);
        for (index, table) in [DOCK, SEE_T7].into_iter().enumerate() {
            let judge = judges.add(index);
            let status = posegate_judge_init(judge, table.as_ptr(), table.len(), 200);
            assert_eq!(status, posegate_status::Ok);
        }
        for _ in 0..ROUNDS.min(4_000) {
            let mut belief = random.belief();
            belief.heading = Heading::Radians(random.number(0.1));
            let asked = Request {
                sequence: random.below(65_536) as u16,
                table: random.below(3) as u8,
                stamp_ms: 0,
                now_ms: random.below(240),
                radius_squared: RadiusSquared::from_q16(743_000 + random.below(1000)).unwrap(),
                estimate: Estimate {
                    x_m: belief.x_m,
                    y_m: belief.y_m,
                    yaw_rad: random.number(0.1),
                },
                spread: belief.spread.unwrap_or(Uncertainty::Bounded {
                    translation_m: 0.01,
                    yaw_rad: 0.01,
                }),
            };
            let mut frame = encode(&asked.body()).to_vec();
            if random.below(4) == 0 {
                let at = random.below(frame.len() as u32 - 1) as usize;
                frame[at] ^= 1 << random.below(8);
            }
            for byte in frame {
                let mut body = message(&[1, 2, 3]);
                let status = posegate_receiver_push(receiver, byte, &mut body);
                match plain.push(byte) {
                    None => assert_eq!((status, body.is_complete), (posegate_status::Ok, 0)),
                    Some(Ok(expected)) => {
                        assert_eq!((status, body.is_complete), (posegate_status::Ok, 1));
                        assert_eq!(body.bytes[..usize::from(body.length)], expected);
                        answered += usize::from(answer(&body, &expected, judges, &in_rust));
                    }
                    Some(Err(error)) => {
                        assert_eq!(status as i32, -30 - error as i32);
                        assert_eq!((body.is_complete, body.length), (1, 0));
                        refused += 1;
                    }
                }
            }
        }
    }
    println!("{answered} answered, {refused} refused");
    let share = ROUNDS.min(4_000) as usize / 20;
    assert!(
        answered >= share && refused >= share,
        "{answered} {refused}"
    );
}

/// Returns `true` if a body was a request. Checks that the reply is that of Rust, to the last byte.
///
/// # Safety
/// `judges` must point to two judges.
unsafe fn answer(
    body: &posegate_message,
    plain: &[u8],
    judges: *const posegate_judge,
    in_rust: &[Evaluator<'_>],
) -> bool {
    let mut request = self::request();
    let mut reply = posegate_reply {
        sequence: 0xffff,
        status: 0,
        verdict: open_verdict(),
        interlock_high: 0,
    };
    // SAFETY: valid pointers.
    let mut status =
        unsafe { posegate_request_decode(body.bytes.as_ptr(), body.length.into(), &mut request) };
    if status == posegate_status::Ok {
        // SAFETY: valid pointers, two judges.
        status = unsafe { posegate_request_judge(&request, judges, 2, &mut reply.verdict) };
    }
    reply.status = status as i32;
    if status == posegate_status::Ok {
        reply.sequence = request.sequence;
        reply.interlock_high = u32::from(reply.verdict.verdict == POSEGATE_PERMIT);
    }
    let expected = Request::from_body(plain).and_then(|r| Ok((r.sequence, r.evaluate(in_rust)?)));
    let expected = match expected {
        Ok((sequence, verdict)) => Reply {
            sequence,
            verdict: Ok(verdict),
            interlock_high: verdict.is_permit(),
        },
        Err(error) => {
            if status == posegate_status::Ok {
                panic!("{error:?} expected");
            }
            Reply::refused(error)
        }
    };
    let mut output = message(&[]);
    // SAFETY: valid pointers.
    unsafe {
        assert_eq!(
            posegate_reply_encode(&reply, &mut output),
            posegate_status::Ok
        );
        assert_eq!(output.bytes[..usize::from(output.length)], expected.body());
        let pointer = &raw mut output;
        assert_eq!(posegate_frame_encode(pointer, pointer), posegate_status::Ok);
    }
    assert_eq!(
        output.bytes[..usize::from(output.length)],
        encode(&expected.body())
    );
    status == posegate_status::Ok
}

/// Inconsistent replies are not sent; invalid requests made in C are not evaluated.
#[test]
fn contradictions_are_refused() {
    type Change = fn(&mut posegate_reply);
    let wrong: [Change; 9] = [
        |r| r.sequence = 65_536,
        |r| r.status = -1,
        |r| r.status = 1,
        |r| r.interlock_high = 2,
        |r| r.verdict.verdict = 1,
        |r| r.verdict.reason = 1,
        |r| r.verdict.has_margin = 0,
        |r| r.verdict.has_worst_pose = 1,
        |r| (r.verdict.verdict, r.verdict.reason) = (POSEGATE_DENY, 200),
    ];
    for change in wrong {
        let mut reply = posegate_reply {
            sequence: 1,
            status: 0,
            verdict: open_verdict(),
            interlock_high: 0,
        };
        let mut body = message(&[1]);
        // SAFETY: valid pointers.
        unsafe {
            assert_eq!(
                posegate_reply_encode(&reply, &mut body),
                posegate_status::Ok
            );
            change(&mut reply);
            assert_eq!(
                posegate_reply_encode(&reply, &mut body),
                posegate_status::BadValue
            );
        }
        assert_eq!(body.length, 0);
    }
    type Made = fn(&mut posegate_request);
    let wrong: [(Made, posegate_status); 8] = [
        (|r| r.sequence = 65_536, posegate_status::BadValue),
        (|r| r.table = 256, posegate_status::BadValue),
        (|r| r.table = 1, posegate_status::WireTable),
        (|r| r.radius_squared_q16 = 0, posegate_status::BadValue),
        (|r| r.belief.heading_kind = 3, posegate_status::BadValue),
        (|r| r.belief.spread_kind = 3, posegate_status::BadValue),
        (|r| r.belief.spread_kind = 9, posegate_status::BadValue),
        (
            |r| (r.belief.spread_kind, r.radius_squared_q16) = (1, 743_497),
            posegate_status::WireContent,
        ),
    ];
    for (change, expected) in wrong {
        let mut request = request();
        let mut verdict = open_verdict();
        let judge = judge(DOCK);
        // SAFETY: valid pointers.
        unsafe {
            let status = posegate_request_judge(&request, judge, 1, &mut verdict);
            assert_eq!(
                (status, verdict.verdict),
                (posegate_status::Ok, POSEGATE_PERMIT)
            );
            change(&mut request);
            let status = posegate_request_judge(&request, judge, 1, &mut verdict);
            assert_eq!((status, verdict.verdict), (expected, POSEGATE_DENY));
        }
    }
}

#[test]
fn c_reasons_have_texts_of_rust_crate() {
    // SAFETY: a static text that ends with a zero.
    let text = |text| unsafe { CStr::from_ptr(text) }.to_str().unwrap();
    for reason in Reason::ALL {
        let code = u32::from(reason.code());
        assert_eq!(text(posegate_reason_name(code)), reason.name());
        assert_eq!(text(posegate_reason_meaning(code)), reason.meaning());
        assert_eq!(text(posegate_reason_action(code)), reason.action());
    }
    let beyond = u32::from(Reason::ALL[Reason::ALL.len() - 1].code()) + 1;
    for none in [0, beyond, 255, 256, 257, u32::MAX] {
        assert_eq!(text(posegate_reason_name(none)), "");
        assert_eq!(text(posegate_reason_meaning(none)), "");
        assert_eq!(text(posegate_reason_action(none)), "");
    }
}

/// A later version may give a reserved field a meaning, so no program may have left anything there.
#[test]
fn reserved_fields_must_be_zero() {
    let bad = posegate_status::BadValue;
    let mut step = open_step();
    let mut verdict = open_verdict();
    // SAFETY: valid pointers, as long as the table is there.
    unsafe {
        for source in 0..2 {
            let mut given = settings();
            given.sources[source].reserved = 1;
            let status =
                posegate_gate_init(zeroed(), DOCK.as_ptr(), DOCK.len(), &given, counter(), 0);
            assert_eq!(status, bad, "source {source}");
        }
        let report = posegate_report {
            reserved: 1,
            ..good(0, 0)
        };
        let gate = open_gate();
        assert_eq!(posegate_gate_step(gate, 0, &report, &mut step), bad);
        assert!(!is_permit(&step));
        let mut evidence = evidence_of_c(good(0, 0), &[]);
        let gate = open_gate();
        assert_ne!(posegate_gate_step_on(gate, 0, &evidence, &mut step), bad);
        evidence.reserved = 1 << 31;
        assert_eq!(posegate_gate_step_on(gate, 0, &evidence, &mut step), bad);
        assert!(!is_permit(&step));
        let judge = judge(DOCK);
        let mut estimate = estimate(&good(0, 0).belief, 0, 0, 0);
        let status = posegate_judge_permits(judge, &estimate, &mut verdict);
        assert_eq!(status, posegate_status::Ok);
        estimate.reserved = 1;
        let status = posegate_judge_permits(judge, &estimate, &mut verdict);
        assert_eq!((status, verdict.verdict), (bad, POSEGATE_DENY));
        let body = posegate_message {
            reserved: [0, 1],
            ..message(&[0; 3])
        };
        assert_eq!(posegate_frame_encode(&body, zeroed()), bad);
        let mut reply: posegate_reply = zero();
        reply.verdict.reason = 1;
        let status = posegate_reply_encode(&reply, zeroed());
        assert_eq!(status, posegate_status::Ok);
        reply.verdict.reserved = 1;
        assert_eq!(posegate_reply_encode(&reply, zeroed()), bad);
        let mut request = posegate_request {
            belief: good(0, 0).belief,
            ..request()
        };
        let status = posegate_request_judge(&request, judge, 1, &mut verdict);
        assert_eq!(status, posegate_status::Ok);
        request.reserved = 1;
        let status = posegate_request_judge(&request, judge, 1, &mut verdict);
        assert_eq!((status, verdict.verdict), (bad, POSEGATE_DENY));
    }
}

#[test]
fn table_info_frames_and_checksums_equal_rust() {
    let info = zeroed::<posegate_table_info>();
    let table = Table::parse(DOCK).unwrap();
    // SAFETY: valid pointers.
    unsafe {
        let status = posegate_table_check(DOCK.as_ptr(), DOCK.len(), info);
        assert_eq!(status, posegate_status::Ok);
        let text =
            |text: &[core::ffi::c_char]| CStr::from_ptr(text.as_ptr()).to_str().unwrap().to_owned();
        assert_eq!(text(&(*info).task), "dock");
        assert_eq!(text(&(*info).tool_version), table.tool_version());
        assert_eq!((*info).task_digest, table.task_digest());
        assert_eq!((*info).crc, table.crc());
        assert_eq!((*info).radius_squared_q16, table.radius_squared().q16());
        assert_eq!(((*info).parts, (*info).missing_parts), (0, 0));
        for (table, part) in [
            ("examples/tables/see-t7.posegate", posegate_part::Sight),
            ("examples/tables/see-t7-grid.posegate", posegate_part::Cells),
            ("tests/data/corner.posegate", posegate_part::Unions),
            ("tests/data/turning.posegate", posegate_part::Headings),
        ] {
            let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
            let bytes = std::fs::read(format!("{root}/{table}")).unwrap();
            let status = posegate_table_check(bytes.as_ptr(), bytes.len(), info);
            assert_eq!(status, posegate_status::Ok);
            assert_ne!((*info).parts & part as u32, 0, "{table}");
            assert_eq!((*info).missing_parts, 0, "this build has all parts");
        }
        let mut newer = DOCK.to_vec();
        newer[8] = 2;
        let (content, crc) = newer.split_last_chunk_mut().unwrap();
        *crc = checksum(content).to_le_bytes();
        let status = posegate_table_check(newer.as_ptr(), newer.len(), info);
        assert_eq!(status, posegate_status::TableTooNew);
        let status = posegate_table_check(DOCK.as_ptr(), DOCK.len() - 1, info);
        assert_eq!(status, posegate_status::TableInvalid);
        assert_eq!(((*info).crc, (*info).task[0]), (0, 0));
        let mut found = 1;
        let status = posegate_checksum(0, DOCK.as_ptr(), 100, &mut found);
        assert_eq!(
            (status, found),
            (posegate_status::Ok, checksum(&DOCK[..100]))
        );
        let status = posegate_checksum(found, DOCK[100..].as_ptr(), 34, &mut found);
        assert_eq!(
            (status, found),
            (posegate_status::Ok, checksum(&DOCK[..134]))
        );
        let mut frame = 1;
        for (name, length, expected) in [
            (c"map", 3, FrameId::of("map")),
            (c"/map", 4, FrameId::of("map")),
            (c"map", 2, FrameId::of("ma")),
            (c"map", 0, FrameId::UNNAMED),
        ] {
            let status = posegate_frame_id(name.as_ptr(), length, &mut frame);
            assert_eq!((status, frame), (posegate_status::Ok, expected.digest()));
        }
        let status = posegate_frame_id(c"\xff".as_ptr(), 1, &mut frame);
        assert_eq!((status, frame), (posegate_status::BadValue, 0));
    }
    assert_eq!(posegate_abi_version(), POSEGATE_ABI_VERSION);
    assert_eq!(posegate_self_test(), posegate_status::Ok);
}
