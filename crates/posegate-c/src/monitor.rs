//! Compares every accepted fix with its prediction: are the errors that a source claims still valid?

use super::call::{answer_or, init};
use super::evidence::Read;
use super::memory::{Storage, object, read, separate};
use super::{posegate_evidence, posegate_report, posegate_status};
use posegate::gate::{Innovation, ModelStanding, Monitor};

/// Number of 64-bit words of a `posegate_monitor`.
pub const POSEGATE_MONITOR_WORDS: usize = 5;

/// Storage of a monitor. It compares the fixes of a source with predictions, and reports when they contradict the errors that the source
/// claims: a camera was knocked, or a tag has moved.
///
/// `posegate_monitor_init` initialises it. Do not move it: a copy is refused. Only one context at a time may call its functions.
#[repr(C)]
pub struct posegate_monitor {
    /// Private.
    pub words: [u64; POSEGATE_MONITOR_WORDS],
}

// SAFETY: integers.
unsafe impl Storage for posegate_monitor {
    type Held = Monitor;
    const MARK: u32 = 0x6d6f_6e69;
}

/// How the errors of a fix and of its prediction depend on each other. 0 is not a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_dependence {
    /// Independent: a fix from a tag, and a pose that odometry carried from an earlier tag.
    Independent = 1,
    /// Unknown: a filter shares its past with the prediction, for example. A wrong model is detected later.
    Unknown = 2,
}

/// How well a model agrees with the fixes so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_model {
    /// No sign of a contradiction.
    Holds = 0,
    /// The logarithm of the evidence has reached half of the limit for a contradiction: check camera and tags soon.
    InDoubt = 1,
    /// The fixes contradict the model: keep the gate closed (`posegate_gate_inhibit` with
    /// `POSEGATE_REASON_MODEL_CONTRADICTED` instead of a step) until the cause was removed and `posegate_monitor_reset` was called.
    Contradicted = 2,
}

const CONTRADICTED: u32 = posegate_model::Contradicted as u32;

fn model(standing: ModelStanding) -> u32 {
    let model = match standing {
        ModelStanding::Holds => posegate_model::Holds,
        ModelStanding::InDoubt => posegate_model::InDoubt,
        ModelStanding::Contradicted => posegate_model::Contradicted,
    };
    model as u32
}

/// Initialises a monitor. While the model is valid, a false alarm comes on average once in `fixes_between_false_alarms` fixes (at least
/// 100), or less often. At 10 fixes per second, a million means once in 28 hours, 100 million once in four months.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` if the number is below 100.
///
/// # Safety
/// The pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_monitor_init(
    monitor: *mut posegate_monitor,
    fixes_between_false_alarms: u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        init(monitor, || {
            Monitor::new(fixes_between_false_alarms).ok_or(posegate_status::BadValue)
        })
    }
}

/// Takes an accepted fix and its prediction for the same time. With a tracker call `posegate_tracker_tracked` before and after
/// `posegate_tracker_fix`, for the same time: the first evidence is the prediction, the second report is the fix.
/// `dependence` is a `posegate_dependence`. Writes a `posegate_model`.
///
/// Errors: those of a report, and `POSEGATE_STATUS_BAD_VALUE` if fix or prediction has no valid covariance, or if `dependence` is not in its enum. The
/// fix is then ignored, and `POSEGATE_MODEL_CONTRADICTED` is written.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_monitor_fix(
    monitor: *mut posegate_monitor,
    fix: *const posegate_report,
    prediction: *const posegate_evidence,
    dependence: u32,
    model: *mut u32,
) -> posegate_status {
    const INDEPENDENT: u32 = posegate_dependence::Independent as u32;
    const UNKNOWN: u32 = posegate_dependence::Unknown as u32;
    // SAFETY: the caller's promise.
    unsafe {
        answer_or(model, CONTRADICTED, || {
            separate(monitor, fix)
                .and(separate(monitor, prediction))
                .and(separate(monitor, model))?;
            let monitor = object(monitor)?;
            let fix = read(fix)?.report()?;
            let prediction = Read::from(prediction)?;
            let prediction = prediction.evidence();
            let (belief, beside) = (&prediction.report.belief, prediction.beside);
            let innovation = match dependence {
                INDEPENDENT => Innovation::of_independent(&fix.belief, belief, beside),
                UNKNOWN => Innovation::of_dependent(&fix.belief, belief, beside),
                _ => return Err(posegate_status::BadValue),
            };
            let standing = innovation.and_then(|innovation| monitor.fix(&innovation));
            Ok(self::model(
                standing.map_err(|_| posegate_status::BadValue)?,
            ))
        })
    }
}

/// Discards all fixes of a monitor. A manual action: call it after the cause was removed.
///
/// # Safety
/// The pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_monitor_reset(monitor: *mut posegate_monitor) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe { object(monitor).map(Monitor::reset) })
}
