//! The tracker: a fix carried forward by odometry, in caller-owned storage.

use super::call::{act, answer, answer_or};
use super::evidence::posegate_evidence;
use super::gate::{held, posegate_gate, posegate_step};
use super::memory::{Plain, Storage, apart, bytes_apart, close, object, read, separate, take};
use super::reason::code;
use super::report::no_report;
use super::{posegate_belief, posegate_report, posegate_source, posegate_status};
use posegate::gate::Reason;
use posegate::report::Report;
use posegate::table::Table;
use posegate::track::{Increment, OdometryErrors, Tracked, Tracker, TrackerSettings};

// The core's errors are plain numbers in the layout of C. `cbindgen.toml` has their name, too.
pub use posegate::track::OdometryErrors as posegate_odometry_errors;

/// Number of 64-bit words of a `posegate_tracker`.
pub const POSEGATE_TRACKER_WORDS: usize = 192;
/// Number of increments that a tracker keeps; those that together last at most 8 ms are kept as one. A fix with a stamp before the oldest
/// one is refused (`POSEGATE_REASON_ODOMETRY_TOO_SHORT`): see `posegate_tracker_reach`.
pub const POSEGATE_TRACKER_INCREMENTS: usize = 64;

/// Storage of a tracker, which carries the newest fix of a slow source along the odometry. So a gate can evaluate a
/// report for now in every control cycle.
///
/// `posegate_tracker_init` initialises it. Do not move it: a copy is refused. Only one context at a time may call its functions.
#[repr(C)]
pub struct posegate_tracker {
    /// Private.
    pub words: [u64; POSEGATE_TRACKER_WORDS],
}

// SAFETY: integers.
unsafe impl Storage for posegate_tracker {
    type Held = Tracker<POSEGATE_TRACKER_INCREMENTS>;
    const MARK: u32 = 0x7472_6163;
}

/// The settings of a tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_tracker_settings {
    /// The errors of the odometry.
    pub errors: OdometryErrors,
    /// The source of the fixes: the trust in its covariances, and the largest speeds of the robot (a larger increment is a
    /// jump). The tracker applies the trust, so the gate's source of the carried reports has inflation 1 and all terms filled. Its
    /// frame is not used.
    pub source: posegate_source,
    /// The longest time between two increments, and from the newest to now, milliseconds: from 1 to 2^31 - 1.
    pub maximum_gap_ms: u32,
    /// The oldest fix that is carried, milliseconds: from 1 to 2^31 - 1. The growth of its set usually ends its use much earlier.
    pub maximum_fix_age_ms: u32,
}

/// A movement of the odometry since the previous increment, in the robot's axes at its start. The robot keeps its speeds ahead, to the left and
/// of its turn meanwhile.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_increment {
    /// Ahead, metres: from -4 to 4.
    pub ahead_m: f64,
    /// To the left, metres: from -4 to 4.
    pub left_m: f64,
    /// Counter-clockwise, radians: at most an eighth of a turn, 0.785.
    pub turn_rad: f64,
    /// The time at which the movement begins, milliseconds of the controller's clock. If it is not the end of the previous
    /// increment, one was lost.
    pub begins_ms: u32,
    /// The time at which the movement ends, milliseconds of the same clock.
    pub stamp_ms: u32,
}

/// The report for now, or the reason why there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_tracked {
    /// For `posegate_gate_step_on`. Without a report it is invalid and closes a gate.
    pub evidence: posegate_evidence,
    /// 0, or the `posegate_reason` why there is no report.
    pub reason: u32,
    /// Reserved: 0.
    pub reserved: u32,
}

// SAFETY: numbers.
unsafe impl Plain for posegate_tracked {
    const DENIED: Self = Self {
        evidence: posegate_evidence::NONE,
        reason: Reason::Silent.code() as u32,
        reserved: 0,
    };
}
// SAFETY: numbers.
unsafe impl Plain for posegate_tracker_settings {}
// SAFETY: numbers.
unsafe impl Plain for posegate_increment {}

impl posegate_report {
    const fn of(report: &Report) -> Self {
        Self {
            belief: posegate_belief::of(&report.belief),
            frame: report.frame.digest(),
            source: report.source as u32,
            sequence: report.sequence,
            stamp_ms: report.stamp_ms,
            reserved: 0,
        }
    }
}

impl posegate_evidence {
    const fn of(tracked: &Tracked) -> Self {
        Self {
            report: posegate_report::of(&tracked.report),
            other_count: 0,
            beside_um: tracked.beside.translation_um().unsigned_abs(),
            beside_q24: tracked.beside.yaw_q24().unsigned_abs(),
            ..Self::ZERO
        }
    }
}

/// Initialises storage for a tracker without odometry and without a fix, whose reports go to a gate on this table. With several tables, give the one with
/// the largest confidence; `posegate_gate_step_tracked` also follows the gate's table, `posegate_tracker_tracked` does not know it.
///
/// Errors: `POSEGATE_STATUS_ODOMETRY`, also if all errors are zero; those of a source; those of `posegate_table_check`, since the table states the
/// confidence.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type; `length` bytes of the table can be read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_tracker_init(
    tracker: *mut posegate_tracker,
    table: *const u8,
    length: usize,
    settings: *const posegate_tracker_settings,
) -> posegate_status {
    // SAFETY: the caller's promise. The table is not borrowed for longer than the call.
    // Not by `init`: the stack has no space for a second copy of the object.
    posegate_status::of(|| unsafe {
        let held = take(tracker)?;
        let given = read(settings)?;
        apart(tracker, settings)?;
        let table = Table::parse(bytes_apart(tracker, table, length)?)?;
        let source = given.source.source()?;
        // Odometry without any error does not exist: the errors were forgotten.
        if given.errors == OdometryErrors::NONE {
            return Err(posegate_status::Odometry);
        }
        let made = Tracker::new(TrackerSettings {
            errors: given.errors,
            bounds: source.motion,
            trust: source.trust,
            radius_squared: table.radius_squared(),
            maximum_gap_ms: given.maximum_gap_ms,
            maximum_fix_age_ms: given.maximum_fix_age_ms,
        });
        held.write(made.ok_or(posegate_status::Odometry)?);
        close(tracker);
        Ok(())
    })
}

/// Takes an increment of the odometry. Writes 0, or the `posegate_reason` that breaks the path:
/// `POSEGATE_REASON_ODOMETRY_GAP`, `_JUMP` or `_BACKWARDS`. The tracker then restarts and waits for a newer fix; close the gate
/// with the reason (`posegate_gate_inhibit`).
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` if a number of the increment is not finite or too large. This also breaks the path, as a jump
/// does.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_tracker_odometry(
    tracker: *mut posegate_tracker,
    increment: *const posegate_increment,
    reason: *mut u32,
) -> posegate_status {
    const JUMP: u32 = Reason::OdometryJump.code() as u32;
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(tracker, increment).and(separate(tracker, reason));
        let given = read(increment);
        let of = |given: posegate_increment| {
            let times = [given.begins_ms, given.stamp_ms];
            Increment::of(given.ahead_m, given.left_m, given.turn_rad, times)
                .ok_or(posegate_status::BadValue)
        };
        act(apart, reason, JUMP, || {
            let tracker = object(tracker)?;
            match given.and_then(of) {
                Ok(increment) => Ok(code(tracker.odometry(increment))),
                Err(status) => {
                    tracker.forget();
                    Err(status)
                }
            }
        })
    })
}

/// Writes how far back the kept increments reach from the newest, milliseconds: 64 times the period of the odometry, and at least 256 ms at
/// a shorter period than 8 ms. An older fix is refused (`POSEGATE_REASON_ODOMETRY_TOO_SHORT`).
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_tracker_reach(
    tracker: *mut posegate_tracker,
    reach_ms: *mut u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(reach_ms, || {
            separate(tracker, reach_ms)?;
            Ok(object(tracker)?.reach_ms())
        })
    }
}

/// Takes a fix, also a late one: it is carried along the increments since its stamp. All fixes come from one source, each with
/// another sequence number. Writes 0, or the `posegate_reason` why the fix is not used. After `POSEGATE_REASON_SEQUENCE_STUCK`,
/// `_SOURCE_CHANGED` and `_FRAME_MISMATCH` nothing is carried until the next fix; otherwise the previous fix remains in use.
///
/// Errors: those of a report. Nothing is carried until the next fix.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_tracker_fix(
    tracker: *mut posegate_tracker,
    report: *const posegate_report,
    reason: *mut u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer_or(reason, u32::from(Reason::Silent.code()), || {
            separate(tracker, report).and(separate(tracker, reason))?;
            let tracker = object(tracker)?;
            match read(report).and_then(|report| report.report()) {
                Ok(report) => Ok(code(tracker.fix(&report))),
                Err(status) => {
                    tracker.drop_fix();
                    Err(status)
                }
            }
        })
    }
}

/// Writes the report for now: the newest fix, carried to the newest odometry. For records, margins and monitors; a control cycle calls
/// `posegate_gate_step_tracked`, which takes fewer instructions.
///
/// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
/// ever (`posegate_clock`).
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_tracker_tracked(
    tracker: *mut posegate_tracker,
    now_ms: u32,
    tracked: *mut posegate_tracked,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(tracked, || {
            separate(tracker, tracked)?;
            Ok(match object(tracker)?.tracked(now_ms) {
                Ok(found) => posegate_tracked {
                    evidence: posegate_evidence::of(&found),
                    reason: 0,
                    reserved: 0,
                },
                Err(reason) => posegate_tracked {
                    reason: u32::from(reason.code()),
                    ..posegate_tracked::DENIED
                },
            })
        })
    }
}

/// Evaluates the newest fix, carried to the newest odometry, at the controller's time `now_ms`: the step of a control cycle between two
/// fixes. Without a report for now, the time advances as in `posegate_gate_tick`, so a permit ends by itself; the step's `reason` then says why
/// the report is missing, and `posegate_gate_inhibit` with it ends a permit at once.
///
/// Errors: those of `posegate_gate_tick`. Without an initialised tracker, the gate closes as at a report of an unknown source.
///
/// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
/// ever (`posegate_clock`).
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_step_tracked(
    gate: *mut posegate_gate,
    now_ms: u32,
    tracker: *mut posegate_tracker,
    step: *mut posegate_step,
) -> posegate_status {
    // SAFETY: the caller's promise. The two storages are apart, so both objects may be used at once.
    posegate_status::of(|| unsafe {
        let apart = separate(gate, step)
            .and(separate(gate, tracker))
            .and(separate(tracker, gate));
        // A tracker that the step shares is no longer initialised, so the gate closes.
        let of_tracker = separate(tracker, step);
        let mut tracker = object(tracker);
        act(apart, step, posegate_step::DENIED, || {
            let gate = held(gate)?;
            let found = match &mut tracker {
                Ok(tracker) => {
                    // The gate may have another table since the tracker was initialised.
                    if let Ok(table) = gate.table() {
                        tracker.cover(table.radius_squared());
                    }
                    tracker.tracked(now_ms)
                }
                Err(_) => Err(Reason::Silent),
            };
            let mut result = match &found {
                Ok(tracked) => gate.step_on(now_ms, &tracked.evidence()),
                Err(_) if tracker.is_ok() => gate.tick(now_ms),
                Err(_) => gate.step(now_ms, &no_report()),
            };
            if let Err(reason) = found {
                result.verdict = Err(reason);
            }
            of_tracker?;
            Ok(result)
        })?;
        tracker.map(|_| ())
    })
}
