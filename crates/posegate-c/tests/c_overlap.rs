//! Calls every function of the C boundary with every pair of its pointers sharing memory, fully and in part. Structs of
//! numbers may overlap: the answer is that of the same call without overlap. Storage must not overlap: the call returns
//! an error, a denial in the output, and storage that is no longer in use.

use posegate::gate::Reason;
use posegate::report::FrameId;
use posegate::set::{Estimate, Uncertainty};
use posegate::table::Table;
use posegate::wire::Request;
use posegate_c::*;
use std::collections::BTreeSet;

const NO_AGES: [posegate_age; POSEGATE_MOST_AGES] = [posegate_age {
    until_ms: 0,
    inflation_q16: 0,
}; POSEGATE_MOST_AGES];

static RULES: &[u8] = include_bytes!("../../../examples/tables/contingent.rules");
static DOCK: &[u8] = include_bytes!("../../../examples/tables/dock.posegate");

/// The kind of an argument.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    /// Read.
    Input,
    /// Written.
    Output,
    /// Read and written: the counter of a gate.
    Word,
    /// A gate, a tracker, a monitor, a judge, a receiver, a sequencer, a clock; `posegate_request_judge` has two judges.
    Gate,
    Tracker,
    Monitor,
    Judge,
    Judges,
    Receiver,
    Sequencer,
    Clock,
}

struct Argument {
    kind: Kind,
    align: usize,
    bytes: Vec<u8>,
}

impl Argument {
    fn is_storage(&self) -> bool {
        !matches!(self.kind, Kind::Input | Kind::Output | Kind::Word)
    }
}

type Call = Box<dyn Fn(&[*mut u8]) -> posegate_status>;

/// A function, its pointer arguments, and a call of it with them.
struct Function {
    name: &'static str,
    arguments: Vec<Argument>,
    call: Call,
}

fn bytes_of<T>(value: &T) -> Vec<u8> {
    // SAFETY: structs of numbers without padding.
    unsafe { core::slice::from_raw_parts((&raw const *value).cast::<u8>(), size_of::<T>()) }
        .to_vec()
}

fn input<T>(value: T) -> Argument {
    Argument {
        kind: Kind::Input,
        align: align_of::<T>(),
        bytes: bytes_of(&value),
    }
}

fn raw(bytes: &[u8]) -> Argument {
    Argument {
        kind: Kind::Input,
        align: 1,
        bytes: bytes.to_vec(),
    }
}

/// Returns an output, filled with bytes that must not remain.
fn output<T>() -> Argument {
    Argument {
        kind: Kind::Output,
        align: align_of::<T>(),
        bytes: vec![0xa5; size_of::<T>()],
    }
}

fn storage<T>(kind: Kind, count: usize) -> Argument {
    Argument {
        kind,
        align: align_of::<T>(),
        bytes: vec![0; size_of::<T>() * count],
    }
}

fn name<const N: usize>(text: &str) -> [core::ffi::c_char; N] {
    let mut name = [0; N];
    for (to, byte) in name.iter_mut().zip(text.bytes()) {
        *to = core::ffi::c_char::from_ne_bytes([byte]);
    }
    name
}

fn settings() -> posegate_settings {
    let source = |frame| posegate_source {
        frame: name(frame),
        inflation: 1.0,
        cross_terms: posegate_cross_terms::Filled as u32,
        share_q8: 0,
        motion: posegate_motion::StandsStill as u32,
        reserved: 0,
        along_m_s: 0.0,
        across_m_s: 0.0,
        turn_rad_s: 0.0,
        ages: NO_AGES,
    };
    posegate_settings {
        task: name("dock"),
        task_digest: Table::parse(DOCK).unwrap().task_digest(),
        sources: ["map", "odom", "", ""].map(source),
        source_count: 2,
        maximum_age_ms: 200,
        response_ms: 30,
        report_period_ms: 50,
        permit_hold_ms: 100,
        inhibit_hold_ms: 40,
        permits_in_a_row: 3,
        restart: posegate_restart::Automatic as u32,
        look_at_tag: 7,
        most_runs: 0,
    }
}

fn belief(x_m: f64, y_m: f64) -> posegate_belief {
    posegate_belief {
        x_m,
        y_m,
        heading: [0.0; 4],
        spread: [1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-4],
        heading_kind: posegate_heading::Yaw as u32,
        spread_kind: posegate_spread::Gaussian as u32,
    }
}

fn report(sequence: u32, stamp_ms: u32, x_m: f64, y_m: f64) -> posegate_report {
    posegate_report {
        belief: belief(x_m, y_m),
        frame: FrameId::of("map").digest(),
        source: 0,
        sequence,
        stamp_ms,
        reserved: 0,
    }
}

/// Returns memory that never moves, aligned for every type.
fn memory(length: usize) -> *mut u8 {
    vec![0u128; length / 16 + 1].leak().as_mut_ptr().cast()
}

/// Opens a gate by good reports from 0 to 75 ms.
///
/// # Safety
/// The pointer must be that of a gate.
unsafe fn open(gate: *mut posegate_gate) {
    // SAFETY: guaranteed by the caller.
    unsafe {
        let mut step = core::mem::zeroed();
        for sequence in 0..4 {
            let now_ms = 25 * sequence;
            let good = report(sequence, now_ms, 0.0, 0.0);
            let status = posegate_gate_step(gate, now_ms, &good, &mut step);
            assert_eq!(status, posegate_status::Ok);
        }
        assert_eq!(
            posegate_permission_is_permit(&step.permission, 75),
            POSEGATE_PERMIT
        );
    }
}

/// Sets up an open gate, and returns its counter.
fn set_up_gate(gate: *mut posegate_gate) -> *mut u32 {
    let counter = memory(4).cast();
    // SAFETY: the place is large enough, aligned, and stays.
    unsafe {
        let (table, length) = (DOCK.as_ptr(), DOCK.len());
        let status = posegate_gate_init(gate, table, length, &settings(), counter, 0);
        assert_eq!(status, posegate_status::Ok);
        open(gate);
    }
    counter
}

fn tracker_settings() -> posegate_tracker_settings {
    posegate_tracker_settings {
        errors: posegate_odometry_errors {
            m_per_sqrt_m: 0.01,
            rad_per_sqrt_rad: 0.02,
            rad_per_sqrt_m: 0.01,
            m_per_sqrt_s: 0.0,
            rad_per_sqrt_s: 0.0,
            slip: 0.02,
            turn_slip: 0.02,
            turn_slip_per_m: 0.0,
        },
        source: posegate_source {
            motion: posegate_motion::Moves as u32,
            along_m_s: 0.5,
            across_m_s: 0.0,
            turn_rad_s: 1.0,
            ages: NO_AGES,
            ..settings().sources[0]
        },
        maximum_gap_ms: 60,
        maximum_fix_age_ms: 1500,
    }
}

fn increment(stamp_ms: u32) -> posegate_increment {
    posegate_increment {
        ahead_m: 0.004,
        left_m: 0.0,
        turn_rad: 0.001,
        begins_ms: stamp_ms.saturating_sub(20),
        stamp_ms,
    }
}

/// Returns a report with two more hypotheses and some slip.
fn evidence(report: posegate_report) -> posegate_evidence {
    // SAFETY: numbers.
    let mut evidence: posegate_evidence = unsafe { core::mem::zeroed() };
    evidence.report = report;
    evidence.others[0] = belief(0.01, 0.0);
    evidence.others[1] = belief(0.0, 0.01);
    evidence.other_count = 2;
    evidence.beside_um = 1000;
    evidence.beside_q24 = 1000;
    evidence
}

/// Sets up a tracker with a fix at 20 ms and odometry up to 60 ms.
fn set_up_tracker(tracker: *mut posegate_tracker) {
    let (table, length) = (DOCK.as_ptr(), DOCK.len());
    let mut reason = 0;
    // SAFETY: valid pointers.
    unsafe {
        let status = posegate_tracker_init(tracker, table, length, &tracker_settings());
        assert_eq!(status, posegate_status::Ok);
        for stamp_ms in [0, 20, 40, 60] {
            let status = posegate_tracker_odometry(tracker, &increment(stamp_ms), &mut reason);
            assert_eq!((status, reason), (posegate_status::Ok, 0));
        }
        let fix = report(1, 20, 0.0, 0.0);
        let status = posegate_tracker_fix(tracker, &fix, &mut reason);
        assert_eq!((status, reason), (posegate_status::Ok, 0));
    }
}

/// Sets up a storage: an open gate, a tracker with a fix, a judge of the dock, or a receiver within a frame.
fn set_up(kind: Kind, at: *mut u8) {
    // SAFETY: the place is large enough, aligned, and stays.
    unsafe {
        match kind {
            Kind::Gate => {
                set_up_gate(at.cast());
            }
            Kind::Tracker => set_up_tracker(at.cast()),
            Kind::Monitor => {
                let status = posegate_monitor_init(at.cast(), 1_000_000);
                assert_eq!(status, posegate_status::Ok);
            }
            Kind::Judge | Kind::Judges => {
                let count = if kind == Kind::Judges { 2 } else { 1 };
                for k in 0..count {
                    let judge = at.cast::<posegate_judge>().add(k);
                    let status = posegate_judge_init(judge, DOCK.as_ptr(), DOCK.len(), 200);
                    assert_eq!(status, posegate_status::Ok);
                }
            }
            Kind::Receiver => {
                let status = posegate_receiver_init(at.cast());
                assert_eq!(status, posegate_status::Ok);
            }
            Kind::Sequencer => {
                let status = posegate_sequencer_init(at.cast(), RULES.as_ptr(), RULES.len());
                assert_eq!(status, posegate_status::Ok);
            }
            Kind::Clock => {
                let status = posegate_clock_init(at.cast(), 1_000, 32, 1, 0);
                assert_eq!(status, posegate_status::Ok);
            }
            _ => {}
        }
    }
}

/// Returns `true` if a storage is still in use.
fn is_in_use(kind: Kind, at: *mut u8) -> bool {
    // SAFETY: as above; refused storage is not dereferenced.
    let status = unsafe {
        match kind {
            Kind::Gate => posegate_gate_tick(at.cast(), 76, memory(64).cast()),
            Kind::Tracker => {
                let tracked = memory(size_of::<posegate_tracked>());
                posegate_tracker_tracked(at.cast(), 76, tracked.cast())
            }
            Kind::Monitor => posegate_monitor_reset(at.cast()),
            Kind::Judge | Kind::Judges => {
                let estimate = estimate();
                posegate_judge_permits(at.cast(), &estimate, memory(64).cast())
            }
            Kind::Receiver => posegate_receiver_push(at.cast(), 1, memory(256).cast()),
            Kind::Sequencer => posegate_sequencer_failed(at.cast()),
            Kind::Clock => posegate_clock_now(at.cast(), 9, memory(64).cast()),
            _ => return true,
        }
    };
    match status {
        posegate_status::Ok => true,
        posegate_status::NotInitialised => false,
        other => panic!("{other:?}"),
    }
}

fn estimate() -> posegate_estimate {
    posegate_estimate {
        belief: belief(0.01, 0.0),
        stamp_ms: 0,
        now_ms: 5,
        radius_squared_q16: 0,
        reserved: 0,
    }
}

fn wire_request() -> Request {
    Request {
        sequence: 7,
        table: 1,
        stamp_ms: 3,
        now_ms: 5,
        radius_squared: Table::parse(DOCK).unwrap().radius_squared(),
        estimate: Estimate {
            x_m: 0.01,
            y_m: 0.0,
            yaw_rad: 0.0,
        },
        spread: Uncertainty::Gaussian([[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]]),
    }
}

fn message(bytes: &[u8]) -> posegate_message {
    let mut message = posegate_message {
        is_complete: 0,
        reserved: [0; 2],
        length: bytes.len() as u8,
        bytes: [0; POSEGATE_LONGEST_MESSAGE],
    };
    message.bytes[..bytes.len()].copy_from_slice(bytes);
    message
}

fn functions() -> Vec<Function> {
    let mut functions = Vec::new();
    macro_rules! function {
        ($name:ident, [$($argument:expr),+], |$p:ident| $($call:expr),+) => {
            functions.push(Function {
                name: stringify!($name),
                arguments: vec![$($argument),+],
                // SAFETY: pointers to what their types say.
                call: Box::new(move |$p| unsafe { $name($($call),+) }),
            });
        };
    }
    let ros = posegate_ros_pose {
        position: [0.1, 0.2, 0.0],
        orientation: [0.0, 0.0, 0.0, 1.0],
        covariance: core::array::from_fn(|k| if k % 7 == 0 { 1e-3 } else { 0.0 }),
    };
    let odometry = posegate_mavlink_odometry {
        position: [0.1, 0.2, 0.0],
        q: [1.0, 0.0, 0.0, 0.0],
        pose_covariance: [1e-3; 21],
    };
    let vision = posegate_mavlink_vision {
        position: [0.1, 0.2, 0.0],
        angles: [0.0, 0.0, 0.3],
        covariance: [1e-3; 21],
    };
    let compact = posegate_compact {
        x_m: 1.0,
        y_m: 2.0,
        yaw_rad: 0.3,
        xx: 1e-3,
        xy: 0.0,
        x_yaw: 0.0,
        yy: 1e-3,
        y_yaw: 0.0,
        yaw_yaw: 1e-4,
    };
    let bad = report(4, 100, 7.0, -3.0);
    let judge = || storage::<posegate_judge>(Kind::Judge, 1);
    let gate = || storage::<posegate_gate>(Kind::Gate, 1);
    let tracker = || storage::<posegate_tracker>(Kind::Tracker, 1);
    let monitor = || storage::<posegate_monitor>(Kind::Monitor, 1);
    let word = || Argument {
        kind: Kind::Word,
        align: 4,
        bytes: vec![9, 0, 0, 0],
    };
    let request = wire_request();
    let body = request.body();
    let mut decoded = core::mem::MaybeUninit::<posegate_request>::uninit();
    // SAFETY: valid pointers.
    let decoded = unsafe {
        let status = posegate_request_decode(body.as_ptr(), body.len(), decoded.as_mut_ptr());
        assert_eq!(status, posegate_status::Ok);
        decoded.assume_init()
    };
    let reply = posegate_reply {
        sequence: 7,
        status: 0,
        // SAFETY: numbers.
        verdict: posegate_verdict {
            reason: u32::from(Reason::Stale.code()),
            ..unsafe { core::mem::zeroed() }
        },
        interlock_high: 0,
    };
    let length = body.len();

    function!(
        posegate_belief_from_ros,
        [input(ros), output::<posegate_belief>()],
        |p| p[0].cast(),
        p[1].cast()
    );
    function!(
        posegate_belief_from_mavlink_odometry,
        [input(odometry), output::<posegate_belief>()],
        |p| p[0].cast(),
        1,
        p[1].cast()
    );
    function!(
        posegate_belief_from_mavlink_vision,
        [input(vision), output::<posegate_belief>()],
        |p| p[0].cast(),
        2,
        p[1].cast()
    );
    function!(
        posegate_belief_from_compact,
        [input(compact), output::<posegate_belief>()],
        |p| p[0].cast(),
        p[1].cast()
    );
    function!(
        posegate_gate_init,
        [gate(), raw(DOCK), input(settings()), word()],
        |p| p[0].cast(),
        p[1],
        DOCK.len(),
        p[2].cast(),
        p[3].cast(),
        0
    );
    function!(
        posegate_gate_step,
        [gate(), input(bad), output::<posegate_step>()],
        |p| p[0].cast(),
        100,
        p[1].cast(),
        p[2].cast()
    );
    function!(
        posegate_gate_change_table,
        [gate(), raw(DOCK), input(settings())],
        |p| p[0].cast(),
        p[1],
        DOCK.len(),
        p[2].cast(),
        100
    );
    function!(
        posegate_gate_step,
        [
            gate(),
            input(report(4, 100, 0.0, 0.0)),
            output::<posegate_step>()
        ],
        |p| p[0].cast(),
        100,
        p[1].cast(),
        p[2].cast()
    );
    for report in [bad, report(4, 100, 0.0, 0.0)] {
        function!(
            posegate_gate_step_on,
            [gate(), input(evidence(report)), output::<posegate_step>()],
            |p| p[0].cast(),
            100,
            p[1].cast(),
            p[2].cast()
        );
    }
    function!(
        posegate_gate_examine_on,
        [gate(), input(evidence(bad)), output::<posegate_examined>()],
        |p| p[0].cast(),
        p[1].cast(),
        p[2].cast()
    );
    function!(
        posegate_tracker_init,
        [tracker(), raw(DOCK), input(tracker_settings())],
        |p| p[0].cast(),
        p[1],
        DOCK.len(),
        p[2].cast()
    );
    function!(
        posegate_tracker_odometry,
        [tracker(), input(increment(80)), output::<u32>()],
        |p| p[0].cast(),
        p[1].cast(),
        p[2].cast()
    );
    function!(
        posegate_tracker_fix,
        [tracker(), input(report(2, 40, 0.01, 0.0)), output::<u32>()],
        |p| p[0].cast(),
        p[1].cast(),
        p[2].cast()
    );
    function!(
        posegate_tracker_reach,
        [tracker(), output::<u32>()],
        |p| p[0].cast(),
        p[1].cast()
    );
    function!(
        posegate_tracker_tracked,
        [tracker(), output::<posegate_tracked>()],
        |p| p[0].cast(),
        70,
        p[1].cast()
    );
    function!(
        posegate_gate_step_tracked,
        [gate(), tracker(), output::<posegate_step>()],
        |p| p[0].cast(),
        100,
        p[1].cast(),
        p[2].cast()
    );
    function!(
        posegate_monitor_fix,
        [
            monitor(),
            input(report(2, 40, 0.01, 0.0)),
            input(evidence(report(1, 40, 0.0, 0.0))),
            output::<u32>()
        ],
        |p| p[0].cast(),
        p[1].cast(),
        p[2].cast(),
        posegate_dependence::Independent as u32,
        p[3].cast()
    );
    function!(
        posegate_gate_tick,
        [gate(), output::<posegate_step>()],
        |p| p[0].cast(),
        100,
        p[1].cast()
    );
    function!(
        posegate_gate_inhibit,
        [gate(), output::<posegate_step>()],
        |p| p[0].cast(),
        100,
        33,
        p[1].cast()
    );
    function!(
        posegate_gate_scrub,
        [gate(), output::<u32>()],
        |p| p[0].cast(),
        1000,
        p[1].cast()
    );
    function!(
        posegate_gate_state,
        [gate(), output::<posegate_state>()],
        |p| p[0].cast(),
        p[1].cast()
    );
    function!(
        posegate_gate_advice,
        [gate(), output::<posegate_advice>()],
        |p| p[0].cast(),
        p[1].cast()
    );
    function!(
        posegate_gate_examine,
        [gate(), input(bad), output::<posegate_verdict>()],
        |p| p[0].cast(),
        p[1].cast(),
        p[2].cast()
    );
    function!(
        posegate_judge_init,
        [judge(), raw(DOCK)],
        |p| p[0].cast(),
        p[1],
        DOCK.len(),
        200
    );
    function!(
        posegate_judge_permits,
        [judge(), input(estimate()), output::<posegate_verdict>()],
        |p| p[0].cast(),
        p[1].cast(),
        p[2].cast()
    );
    function!(
        posegate_judge_examine,
        [judge(), input(estimate()), output::<posegate_verdict>()],
        |p| p[0].cast(),
        p[1].cast(),
        p[2].cast()
    );
    function!(
        posegate_frame_id,
        [raw(b"/map/of_a_hall"), output::<u64>()],
        |p| p[0].cast(),
        14,
        p[1].cast()
    );
    function!(
        posegate_table_check,
        [raw(DOCK), output::<posegate_table_info>()],
        |p| p[0],
        DOCK.len(),
        p[1].cast()
    );
    function!(
        posegate_checksum,
        [raw(b"123456789"), output::<u32>()],
        |p| 0,
        p[0],
        9,
        p[1].cast()
    );
    function!(
        posegate_receiver_push,
        [
            storage::<posegate_receiver>(Kind::Receiver, 1),
            output::<posegate_message>()
        ],
        |p| p[0].cast(),
        0,
        p[1].cast()
    );
    function!(
        posegate_request_decode,
        [raw(&body), output::<posegate_request>()],
        |p| p[0],
        length,
        p[1].cast()
    );
    function!(
        posegate_request_judge,
        [
            input(decoded),
            storage::<posegate_judge>(Kind::Judges, 2),
            output::<posegate_verdict>()
        ],
        |p| p[0].cast(),
        p[1].cast(),
        2,
        p[2].cast()
    );
    function!(
        posegate_reply_encode,
        [input(reply), output::<posegate_message>()],
        |p| p[0].cast(),
        p[1].cast()
    );
    function!(
        posegate_frame_encode,
        [input(message(&body)), output::<posegate_message>()],
        |p| p[0].cast(),
        p[1].cast()
    );
    function!(
        posegate_sequencer_init,
        [
            storage::<posegate_sequencer>(Kind::Sequencer, 1),
            raw(RULES)
        ],
        |p| p[0].cast(),
        p[1],
        RULES.len()
    );
    function!(
        posegate_sequencer_next,
        [
            storage::<posegate_sequencer>(Kind::Sequencer, 1),
            input(belief(0.0, 0.0)),
            output::<posegate_instruction>()
        ],
        |p| p[0].cast(),
        p[1].cast(),
        743_498,
        p[2].cast()
    );
    function!(
        posegate_clock_now,
        [storage::<posegate_clock>(Kind::Clock, 1), output::<u32>()],
        |p| p[0].cast(),
        5,
        p[1].cast()
    );
    functions
}

/// Returns the address of each argument: all separate, or one of a pair the given number of bytes after the other.
fn places(arguments: &[Argument], pair: Option<(usize, usize, isize)>) -> Vec<*mut u8> {
    let mut places: Vec<_> = arguments
        .iter()
        .map(|argument| memory(argument.bytes.len()))
        .collect();
    if let Some((first, second, offset)) = pair {
        // Space before and after.
        let size = arguments[first].bytes.len() + 2 * arguments[second].bytes.len() + 64;
        let before = arguments[second].bytes.len().next_multiple_of(16) + 16;
        places[first] = memory(size + before).wrapping_add(before);
        places[second] = places[first].wrapping_offset(offset);
    }
    places
}

fn read(place: *mut u8, length: usize) -> Vec<u8> {
    // SAFETY: bytes of `memory`.
    unsafe { core::slice::from_raw_parts(place, length) }.to_vec()
}

fn put(place: *mut u8, bytes: &[u8]) {
    // SAFETY: bytes of `memory`.
    unsafe { core::ptr::copy(bytes.as_ptr(), place, bytes.len()) }
}

/// Returns the answer of a function with separate arguments: its status and its outputs.
fn apart(function: &Function, given: &[Vec<u8>], set: bool) -> (posegate_status, Vec<Vec<u8>>) {
    let places = places(&function.arguments, None);
    for ((argument, place), bytes) in function.arguments.iter().zip(&places).zip(given) {
        if argument.is_storage() {
            if set {
                set_up(argument.kind, *place);
            }
        } else {
            put(*place, bytes);
        }
    }
    let status = (function.call)(&places);
    (status, outputs(function, &places))
}

fn outputs(function: &Function, places: &[*mut u8]) -> Vec<Vec<u8>> {
    let each = function.arguments.iter().zip(places);
    each.filter(|(argument, _)| argument.kind == Kind::Output)
        .map(|(argument, place)| read(*place, argument.bytes.len()))
        .collect()
}

#[test]
fn overlapping_arguments_are_read_first_or_refused() {
    let (mut same, mut refused) = (0, 0);
    for function in functions() {
        let arguments = &function.arguments;
        let as_given: Vec<_> = arguments.iter().map(|a| a.bytes.clone()).collect();
        // The answer of an error: for storage that was never in use.
        let denied = apart(&function, &as_given, false).1;
        for first in 0..arguments.len() {
            for second in first + 1..arguments.len() {
                let (a, b) = (&arguments[first], &arguments[second]);
                let align = b.align.max(1) as isize;
                let lowest = -(b.bytes.len() as isize - 1) / align * align;
                for offset in (lowest..a.bytes.len() as isize).step_by(b.align.max(1)) {
                    let what = format!("{}: {first} and {second} at {offset}", function.name);
                    let places = places(arguments, Some((first, second, offset)));
                    let with_storage = a.is_storage() || b.is_storage();
                    for (k, (argument, place)) in arguments.iter().zip(&places).enumerate() {
                        if argument.is_storage() {
                            set_up(argument.kind, *place);
                        } else if !(with_storage && (k == first || k == second)) {
                            put(*place, &argument.bytes);
                        }
                    }
                    let given: Vec<_> = arguments
                        .iter()
                        .zip(&places)
                        .map(|(argument, place)| read(*place, argument.bytes.len()))
                        .collect();
                    let status = (function.call)(&places);
                    let written = outputs(&function, &places);
                    // A gate borrows its table, and writes its counter as long as it is used.
                    let borrowed =
                        function.name == "posegate_gate_init" && (first, second) == (1, 3);
                    if with_storage || borrowed {
                        assert_eq!(status, posegate_status::Overlap, "{what}");
                        assert_eq!(written, denied, "{what}");
                        for (k, argument) in arguments.iter().enumerate() {
                            if argument.is_storage() && (k == first || k == second) {
                                let other = if k == first { second } else { first };
                                let begins = places[other].addr();
                                let ends = begins + arguments[other].bytes.len();
                                // Elements of an array that are not overlapped do not change.
                                let size = match argument.kind {
                                    Kind::Judges => size_of::<posegate_judge>(),
                                    _ => argument.bytes.len(),
                                };
                                for element in 0..argument.bytes.len() / size {
                                    let place = places[k].wrapping_add(element * size);
                                    let touched =
                                        place.addr() < ends && begins < place.addr() + size;
                                    assert_eq!(is_in_use(argument.kind, place), !touched, "{what}");
                                }
                            }
                        }
                        refused += 1;
                    } else {
                        let expected = apart(&function, &given, true);
                        assert_eq!((status, written), expected, "{what}");
                        same += 1;
                    }
                }
            }
        }
    }
    assert!(same > 1000 && refused > 3000, "{same} {refused}");
}

/// A union of the report and the step, as in a controller with little memory: the denial that is written
/// first must not be evaluated as the report.
#[test]
fn report_overlapping_its_answer_is_read_before_the_write() {
    let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
    let counter = memory(4).cast();
    let union = memory(size_of::<posegate_report>());
    // SAFETY: valid pointers.
    unsafe {
        let (table, length) = (DOCK.as_ptr(), DOCK.len());
        let status = posegate_gate_init(gate, table, length, &settings(), counter, 0);
        assert_eq!(status, posegate_status::Ok);
        for sequence in 0..10 {
            let now_ms = 20 * sequence;
            union
                .cast::<posegate_report>()
                .write(report(sequence, now_ms, 7.0, -3.0));
            let step = union.cast::<posegate_step>();
            let status = posegate_gate_step(gate, now_ms, union.cast(), step);
            assert_eq!(status, posegate_status::Ok);
            let permission = &raw const (*step).permission;
            assert_eq!(
                posegate_permission_is_permit(permission, now_ms),
                POSEGATE_DENY
            );
            assert_eq!((*step).reason, u32::from(Reason::OutsideTable.code()));
        }
    }
}

/// Settings that share memory with the counter or the table are used as given: the gate opens as usual.
#[test]
fn settings_overlapping_the_counter_are_read_first() {
    for offset in (0..size_of::<posegate_settings>()).step_by(4) {
        let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
        let shared = memory(size_of::<posegate_settings>());
        // SAFETY: valid pointers.
        unsafe {
            let given = shared.cast::<posegate_settings>();
            given.write(settings());
            let counter = shared.add(offset).cast();
            let (table, length) = (DOCK.as_ptr(), DOCK.len());
            let status = posegate_gate_init(gate, table, length, given, counter, 0);
            assert_eq!(status, posegate_status::Ok, "{offset}");
            open(gate);
        }
    }
}

/// A later call that overwrites the counter is detected: the gate latches.
#[test]
fn an_output_in_the_counter_latches_the_gate() {
    let step = memory(size_of::<posegate_step>());
    for offset in (0..size_of::<posegate_step>()).step_by(4) {
        let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
        // SAFETY: valid pointers.
        unsafe {
            let (table, length) = (DOCK.as_ptr(), DOCK.len());
            let counter = step.add(offset).cast();
            let status = posegate_gate_init(gate, table, length, &settings(), counter, 0);
            assert_eq!(status, posegate_status::Ok);
            let step = step.cast::<posegate_step>();
            for sequence in 0..4 {
                let now_ms = 25 * sequence;
                let good = report(sequence, now_ms, 0.0, 0.0);
                let _ = posegate_gate_step(gate, now_ms, &good, step);
                let permission = &raw const (*step).permission;
                let permit = posegate_permission_is_permit(permission, now_ms);
                assert_eq!(permit, POSEGATE_DENY, "{offset}");
            }
        }
    }
}

/// An address of the counter with a flipped bit is not dereferenced.
#[test]
fn corrupted_counter_address_latches_the_gate() {
    let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
    let counter = set_up_gate(gate);
    let whole = read(gate.cast(), size_of::<posegate_gate>());
    let address = counter.addr().to_le_bytes();
    let at = whole
        .windows(address.len())
        .position(|bytes| bytes == address)
        .expect("the address of the counter");
    for bit in 0..8 * address.len() {
        let mut fallen = whole.clone();
        fallen[at + bit / 8] ^= 1 << (bit % 8);
        put(gate.cast(), &fallen);
        // SAFETY: valid pointers.
        unsafe {
            let mut step = core::mem::zeroed();
            assert_eq!(posegate_gate_tick(gate, 76, &mut step), posegate_status::Ok);
            let reason = u32::from(Reason::MemoryDamaged.code());
            assert_eq!(step.state.reason, reason, "{bit}");
        }
    }
}

/// The tests above cover all functions of the header with two or more pointers.
#[test]
fn every_function_with_two_pointers_is_tested() {
    let header = include_str!("../../../include/posegate.h");
    let (_, declared) = header.split_once("extern \"C\" {").unwrap();
    let mut tried: BTreeSet<_> = functions().iter().map(|f| f.name.to_owned()).collect();
    for declaration in declared.split(';') {
        let code: String = declaration
            .split("*/")
            .last()
            .unwrap()
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        let Some((head, parameters)) = code.split_once('(') else {
            continue;
        };
        let name = head.rsplit([' ', '*']).next().unwrap();
        if name.starts_with("posegate_") && parameters.matches('*').count() >= 2 {
            assert!(tried.remove(name), "{name} is not tried");
        }
    }
    assert_eq!(tried, BTreeSet::new());
}

/// A saved gate that is restored after a fault does not contain the fault, but its counter shows it.
#[test]
fn restored_gate_copy_is_refused() {
    let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
    set_up(Kind::Gate, gate.cast());
    let step = memory(size_of::<posegate_step>()).cast::<posegate_step>();
    let open = |now_ms| {
        // SAFETY: valid pointers.
        unsafe {
            let status = posegate_gate_tick(gate, now_ms, step);
            assert_eq!(status, posegate_status::Ok);
            let permission = &raw const (*step).permission;
            posegate_permission_is_permit(permission, now_ms) == POSEGATE_PERMIT
        }
    };
    assert!(open(76));
    let saved = read(gate.cast(), size_of::<posegate_gate>());
    // SAFETY: a valid pointer.
    let status = unsafe { posegate_gate_fault(gate, u32::from(Reason::CodeDamaged.code())) };
    assert_eq!(status, posegate_status::Ok);
    assert!(!open(77));
    for _ in 0..3 {
        put(gate.cast(), &saved);
        assert!(!open(78));
        // SAFETY: a valid pointer.
        let state = unsafe { (*step).state };
        assert_eq!(state.kind, posegate_state_kind::Latched as u32);
        assert_eq!(state.reason, u32::from(Reason::MemoryDamaged.code()));
    }
    // After another start, successful or not, an old copy is refused, too.
    let mut latched = settings();
    latched.task_digest[0] ^= 1;
    let mut refused = settings();
    refused.permits_in_a_row = 0;
    for (settings, expected) in [
        (latched, posegate_status::Ok),
        (refused, posegate_status::PermitsInARow),
    ] {
        let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
        let counter = set_up_gate(gate);
        let saved = read(gate.cast(), size_of::<posegate_gate>());
        // SAFETY: valid pointers.
        unsafe {
            let (table, length) = (DOCK.as_ptr(), DOCK.len());
            let status = posegate_gate_init(gate, table, length, &settings, counter, 76);
            assert_eq!(status, expected);
            put(gate.cast(), &saved);
            assert_eq!(posegate_gate_tick(gate, 77, step), posegate_status::Ok);
            assert_eq!(
                (*step).state.reason,
                u32::from(Reason::MemoryDamaged.code())
            );
        }
    }
    // A manual reset ends it, as for any latched fault.
    // SAFETY: a valid pointer.
    assert_eq!(
        unsafe { posegate_gate_reset(gate, 80) },
        posegate_status::Ok
    );
    assert!(!open(81));
    // SAFETY: a valid pointer.
    assert_eq!(
        unsafe { (*step).state.kind },
        posegate_state_kind::Inhibited as u32
    );
}
