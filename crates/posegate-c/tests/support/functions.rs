//! Every function of the C boundary with a pointer, called with pointers of the test's choice.

use super::*;
use posegate::gate::Reason;
use posegate::set::{Estimate, Uncertainty};
use posegate::table::Table;
use posegate::wire::Request;

/// The kind of an argument.
#[derive(Clone, Copy)]
pub enum Kind {
    /// Read.
    Input,
    /// Written.
    Output,
    /// Read and written: the counter of a gate.
    Word,
    Storage {
        /// Bytes of one storage: `posegate_request_judge` has two judges.
        size: usize,
        set_up: fn(*mut u8),
        /// Calls a function on the storage.
        ask: fn(*mut u8) -> posegate_status,
    },
}

pub struct Argument {
    pub kind: Kind,
    pub align: usize,
    pub bytes: Vec<u8>,
}

impl Argument {
    pub fn is_storage(&self) -> bool {
        matches!(self.kind, Kind::Storage { .. })
    }

    /// Sets up the storages at a place: an open gate, a tracker with a fix, a judge of the dock, a receiver within a frame.
    pub fn set_up(&self, place: *mut u8) {
        if let Kind::Storage { size, set_up, .. } = self.kind {
            for at in (0..self.bytes.len()).step_by(size) {
                set_up(place.wrapping_add(at));
            }
        }
    }

    /// Returns `true` if the storage at a place is still in use.
    pub fn is_in_use(&self, place: *mut u8) -> bool {
        let Kind::Storage { ask, .. } = self.kind else {
            return true;
        };
        match ask(place) {
            posegate_status::Ok => true,
            posegate_status::NotInitialised => false,
            other => panic!("{other:?}"),
        }
    }
}

/// The pointers of a call. Without places it collects the arguments, and every pointer is null.
#[derive(Default)]
pub struct Pointers {
    places: Option<Vec<*mut u8>>,
    arguments: Vec<Argument>,
}

impl Pointers {
    fn next<T>(&mut self, kind: Kind, align: usize, bytes: Vec<u8>) -> *mut T {
        let place = match &self.places {
            Some(places) => places[self.arguments.len()],
            None => core::ptr::null_mut(),
        };
        self.arguments.push(Argument { kind, align, bytes });
        place.cast()
    }

    fn input<T: Copy>(&mut self, value: T) -> *const T {
        // SAFETY: structs of numbers without padding.
        let bytes =
            unsafe { core::slice::from_raw_parts((&raw const value).cast::<u8>(), size_of::<T>()) };
        self.next(Kind::Input, align_of::<T>(), bytes.to_vec())
    }

    fn raw(&mut self, bytes: &[u8]) -> *const u8 {
        self.next::<u8>(Kind::Input, 1, bytes.to_vec())
    }

    /// Returns an output, filled with bytes that must not remain.
    fn output<T>(&mut self) -> *mut T {
        self.next(Kind::Output, align_of::<T>(), vec![0xa5; size_of::<T>()])
    }

    fn word(&mut self) -> *mut u32 {
        self.next(Kind::Word, 4, vec![9, 0, 0, 0])
    }

    fn storage<T: Storage>(&mut self) -> *mut T {
        self.storages(1)
    }

    fn storages<T: Storage>(&mut self, count: usize) -> *mut T {
        let size = size_of::<T>();
        let kind = Kind::Storage {
            size,
            set_up: |place| assert_eq!(T::set_up(place.cast()), posegate_status::Ok),
            ask: |place| T::ask(place.cast()),
        };
        self.next(kind, align_of::<T>(), vec![0; size * count])
    }
}

/// A function, its pointer arguments, and a call of it with them.
pub struct Function {
    pub name: &'static str,
    pub arguments: Vec<Argument>,
    call: Box<dyn Fn(&mut Pointers) -> posegate_status>,
}

impl Function {
    fn new(name: &'static str, call: impl Fn(&mut Pointers) -> posegate_status + 'static) -> Self {
        let mut described = Pointers::default();
        assert_eq!(call(&mut described), posegate_status::Null, "{name}");
        Self {
            name,
            arguments: described.arguments,
            call: Box::new(call),
        }
    }

    pub fn call(&self, places: &[*mut u8]) -> posegate_status {
        (self.call)(&mut Pointers {
            places: Some(places.to_vec()),
            arguments: Vec::new(),
        })
    }

    /// Returns the bytes of the outputs.
    pub fn outputs(&self, places: &[*mut u8]) -> Vec<Vec<u8>> {
        let each = self.arguments.iter().zip(places);
        each.filter(|(argument, _)| matches!(argument.kind, Kind::Output))
            .map(|(argument, place)| read(*place, argument.bytes.len()))
            .collect()
    }
}

/// Returns memory that never moves, aligned for every type.
pub fn memory(length: usize) -> *mut u8 {
    vec![0u128; length / 16 + 1].leak().as_mut_ptr().cast()
}

pub fn read(place: *mut u8, length: usize) -> Vec<u8> {
    // SAFETY: bytes of `memory`.
    unsafe { core::slice::from_raw_parts(place, length) }.to_vec()
}

pub fn put(place: *mut u8, bytes: &[u8]) {
    // SAFETY: bytes of `memory`.
    unsafe { core::ptr::copy(bytes.as_ptr(), place, bytes.len()) }
}

/// A storage: how it is set up, and a call that shows whether it is in use.
pub trait Storage: Sized {
    fn set_up(at: *mut Self) -> posegate_status;
    fn ask(at: *mut Self) -> posegate_status;
}

// SAFETY: the place is large enough, aligned, and stays; refused storage is not dereferenced.
macro_rules! storage {
    ($storage:ident, |$at:ident| $set_up:expr, $ask:expr) => {
        impl Storage for $storage {
            fn set_up($at: *mut Self) -> posegate_status {
                $set_up
            }

            fn ask($at: *mut Self) -> posegate_status {
                unsafe { $ask }
            }
        }
    };
}

storage!(
    posegate_gate,
    |at| set_up_gate(at, memory(4).cast()),
    posegate_gate_tick(at, 76, zeroed())
);
storage!(
    posegate_tracker,
    |at| set_up_tracker(at),
    posegate_tracker_tracked(at, 76, zeroed())
);
storage!(
    posegate_monitor,
    |at| unsafe { posegate_monitor_init(at, 1_000_000) },
    posegate_monitor_reset(at)
);
storage!(
    posegate_judge,
    |at| unsafe { posegate_judge_init(at, DOCK.as_ptr(), DOCK.len(), 200) },
    posegate_judge_permits(at, &estimate(), zeroed())
);
storage!(
    posegate_receiver,
    |at| unsafe { posegate_receiver_init(at) },
    posegate_receiver_push(at, 1, zeroed())
);
storage!(
    posegate_sequencer,
    |at| unsafe { posegate_sequencer_init(at, RULES.as_ptr(), RULES.len()) },
    posegate_sequencer_failed(at)
);
storage!(
    posegate_clock,
    |at| unsafe { posegate_clock_init(at, 1_000, 32, 1, 0) },
    posegate_clock_now(at, 9, zeroed())
);

fn belief(x_m: f64, y_m: f64) -> posegate_belief {
    let yaw_rad = 0.0;
    in_c(&PoseEstimate::diagonal(
        Estimate { x_m, y_m, yaw_rad },
        [1e-4; 3],
    ))
}

pub fn report(sequence: u32, stamp_ms: u32, x_m: f64, y_m: f64) -> posegate_report {
    report_of_c(sequence, stamp_ms, belief(x_m, y_m))
}

/// Opens a gate by good reports from 0 to 75 ms.
///
/// # Safety
/// The pointer must be that of a gate.
pub unsafe fn open(gate: *mut posegate_gate) {
    // SAFETY: guaranteed by the caller.
    unsafe {
        let mut step = zero();
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

/// Sets up an open gate with a counter.
pub fn set_up_gate(gate: *mut posegate_gate, counter: *mut u32) -> posegate_status {
    // SAFETY: the place is large enough, aligned, and stays.
    unsafe {
        let (table, length) = (DOCK.as_ptr(), DOCK.len());
        let status = posegate_gate_init(gate, table, length, &settings(), counter, 0);
        open(gate);
        status
    }
}

fn tracker_settings() -> posegate_tracker_settings {
    posegate_tracker_settings {
        errors: posegate_odometry_errors {
            m_per_sqrt_m: 0.01,
            rad_per_sqrt_rad: 0.02,
            rad_per_sqrt_m: 0.01,
            slip: 0.02,
            turn_slip: 0.02,
            ..zero()
        },
        source: posegate_source {
            along_m_s: 0.5,
            turn_rad_s: 1.0,
            ..source()
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
    posegate_evidence {
        beside_um: 1000,
        beside_q24: 1000,
        ..evidence_of_c(report, &[belief(0.01, 0.0), belief(0.0, 0.01)])
    }
}

/// Sets up a tracker with a fix at 20 ms and odometry up to 60 ms.
fn set_up_tracker(tracker: *mut posegate_tracker) -> posegate_status {
    let (table, length) = (DOCK.as_ptr(), DOCK.len());
    let mut reason = 0;
    // SAFETY: valid pointers.
    unsafe {
        let status = posegate_tracker_init(tracker, table, length, &tracker_settings());
        for stamp_ms in [0, 20, 40, 60] {
            let status = posegate_tracker_odometry(tracker, &increment(stamp_ms), &mut reason);
            assert_eq!((status, reason), (posegate_status::Ok, 0));
        }
        let fix = report(1, 20, 0.0, 0.0);
        assert_eq!(
            posegate_tracker_fix(tracker, &fix, &mut reason),
            posegate_status::Ok
        );
        assert_eq!(reason, 0);
        status
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

/// Makes the list of functions from calls of them, in which `p` gives the pointers.
macro_rules! functions {
    ($p:ident => $($name:ident($($argument:expr),+);)+) => {
        // SAFETY: pointers to what their types say, null or misaligned.
        vec![$(Function::new(stringify!($name), move |$p| unsafe { $name($($argument),+) })),+]
    };
}

/// Returns every function with a pointer that returns a status.
pub fn functions() -> Vec<Function> {
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
    let (good, bad) = (report(4, 100, 0.0, 0.0), report(4, 100, 7.0, -3.0));
    let (fix, predicted) = (report(2, 40, 0.01, 0.0), report(1, 40, 0.0, 0.0));
    let body: &'static [u8] = wire_request().body().to_vec().leak();
    let mut decoded: posegate_request = zero();
    // SAFETY: valid pointers.
    let status = unsafe { posegate_request_decode(body.as_ptr(), body.len(), &mut decoded) };
    assert_eq!(status, posegate_status::Ok);
    let reply = posegate_reply {
        sequence: 7,
        verdict: posegate_verdict {
            reason: u32::from(Reason::Stale.code()),
            ..zero()
        },
        ..zero()
    };
    let (table, length) = (DOCK, DOCK.len());
    let independent = posegate_dependence::Independent as u32;

    functions! { p =>
        posegate_belief_from_ros(p.input(ros), p.output());
        posegate_belief_from_mavlink_odometry(p.input(odometry), 1, p.output());
        posegate_belief_from_mavlink_vision(p.input(vision), 2, p.output());
        posegate_belief_from_compact(p.input(compact), p.output());
        posegate_settings_for_source(20, 10, p.output());
        posegate_gate_init(p.storage(), p.raw(table), length, p.input(settings()), p.word(), 0);
        posegate_gate_change_table(p.storage(), p.raw(table), length, p.input(settings()), 100);
        posegate_gate_step(p.storage(), 100, p.input(bad), p.output());
        posegate_gate_step(p.storage(), 100, p.input(good), p.output());
        posegate_gate_step_on(p.storage(), 100, p.input(evidence(bad)), p.output());
        posegate_gate_step_on(p.storage(), 100, p.input(evidence(good)), p.output());
        posegate_gate_step_tracked(p.storage(), 100, p.storage(), p.output());
        posegate_gate_tick(p.storage(), 100, p.output());
        posegate_gate_reset(p.storage(), 100);
        posegate_gate_inhibit(p.storage(), 100, 33, p.output());
        posegate_gate_fault(p.storage(), 33);
        posegate_gate_scrub(p.storage(), 1000, p.output());
        posegate_gate_state(p.storage(), p.output());
        posegate_gate_advice(p.storage(), p.output());
        posegate_gate_examine(p.storage(), p.input(bad), p.output());
        posegate_gate_examine_on(p.storage(), p.input(evidence(bad)), p.output());
        posegate_tracker_init(p.storage(), p.raw(table), length, p.input(tracker_settings()));
        posegate_tracker_odometry(p.storage(), p.input(increment(80)), p.output());
        posegate_tracker_reach(p.storage(), p.output());
        posegate_tracker_fix(p.storage(), p.input(fix), p.output());
        posegate_tracker_tracked(p.storage(), 70, p.output());
        posegate_monitor_init(p.storage(), 1_000_000);
        posegate_monitor_fix(
            p.storage(), p.input(fix), p.input(evidence(predicted)), independent, p.output()
        );
        posegate_monitor_reset(p.storage());
        posegate_judge_init(p.storage(), p.raw(table), length, 200);
        posegate_judge_permits(p.storage(), p.input(estimate()), p.output());
        posegate_judge_examine(p.storage(), p.input(estimate()), p.output());
        posegate_frame_id(p.raw(b"/map/of_a_hall").cast(), 14, p.output());
        posegate_table_check(p.raw(table), length, p.output());
        posegate_checksum(0, p.raw(b"123456789"), 9, p.output());
        posegate_receiver_init(p.storage());
        posegate_receiver_push(p.storage(), 0, p.output());
        posegate_request_decode(p.raw(body), body.len(), p.output());
        posegate_request_judge(p.input(decoded), p.storages(2), 2, p.output());
        posegate_reply_encode(p.input(reply), p.output());
        posegate_frame_encode(p.input(message(body)), p.output());
        posegate_sequencer_init(p.storage(), p.raw(RULES), RULES.len());
        posegate_sequencer_next(p.storage(), p.input(belief(0.0, 0.0)), 743_498, p.output());
        posegate_sequencer_succeeded(p.storage());
        posegate_sequencer_failed(p.storage());
        posegate_clock_init(p.storage(), 1_000, 32, 1, 0);
        posegate_clock_now(p.storage(), 5, p.output());
    }
}
