//! For recordings and benches only: evaluates single estimates, each on its own, as [`Evaluator`] does.

use super::call::{answer, init};
use super::memory::{Plain, Storage, bytes_apart, open, read, separate, unused};
use super::{POSEGATE_PERMIT, posegate_belief, posegate_status, posegate_verdict};
use posegate::gate::Verdict;
use posegate::recordings::Evaluator;
use posegate::report::{Heading, PoseEstimate};
use posegate::set::{Estimate, InputError, PoseSet, RadiusSquared, Trust, Uncertainty};

/// Number of 64-bit words of a `posegate_judge`.
pub const POSEGATE_JUDGE_WORDS: usize = 20;
/// Number of pointers of a `posegate_judge`.
pub const POSEGATE_JUDGE_POINTERS: usize = 12;

/// For recordings and benches only. A controller that drives an interlock uses a `posegate_gate`: a judge does not wait
/// for consecutive permits, has no second evaluation, checks no settings and keeps no state.
///
/// Storage of a judge: a table and a maximum age, to evaluate estimates, each on its own.
///
/// `posegate_judge_init` initialises it. Do not move it: a copy is refused.
#[repr(C)]
pub struct posegate_judge {
    /// Private.
    pub words: [u64; POSEGATE_JUDGE_WORDS],
    /// Private.
    pub pointers: [*const u8; POSEGATE_JUDGE_POINTERS],
}

// SAFETY: integers and pointers.
unsafe impl Storage for posegate_judge {
    type Held = Evaluator<'static>;
    const MARK: u32 = 0x6a75_6467;
}

/// An estimate with its time and the time of its use.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_estimate {
    /// The estimate.
    pub belief: posegate_belief,
    /// The time of the estimate, milliseconds of a wrapping clock.
    pub stamp_ms: u32,
    /// The time at which the estimate is used, milliseconds of the same clock.
    pub now_ms: u32,
    /// The squared radius of a Gaussian set, unit 2^-16: at least that of the table, or 0 for that of the table.
    pub radius_squared_q16: u32,
    /// Reserved: must be 0.
    pub reserved: u32,
}

// SAFETY: numbers.
unsafe impl Plain for posegate_estimate {}

/// Returns the pose-set of an estimate. With a yaw in radians, the checks are in the order of [`PoseSet::gaussian`], as
/// for requests.
pub(super) fn pose_set(
    belief: &PoseEstimate,
    radius: RadiusSquared,
) -> Result<PoseSet, InputError> {
    let Heading::Radians(yaw_rad) = belief.heading else {
        return belief.pose_set(radius, Trust::FULL);
    };
    let estimate = Estimate {
        x_m: belief.x_m,
        y_m: belief.y_m,
        yaw_rad,
    };
    match belief.spread {
        Some(Uncertainty::Gaussian(covariance)) => PoseSet::gaussian(estimate, covariance, radius),
        Some(Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        }) => PoseSet::bounded(estimate, translation_m, yaw_rad),
        None => belief.pose_set(radius, Trust::FULL),
    }
}

/// For recordings and benches only.
///
/// Initialises storage for a table and a maximum age (from 1 to 2^31 - 1 ms). Bytes that are not a table are not an
/// error: they give a judge that denies (`POSEGATE_REASON_TABLE_DAMAGED` and others), because a controller with damaged flash must
/// still answer. The table is borrowed: it must not change while the judge is used.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type; `length` bytes of the table can be
/// read, now and as long as the judge is used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_judge_init(
    judge: *mut posegate_judge,
    table: *const u8,
    length: usize,
    maximum_age_ms: u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        init(judge, || {
            let table = bytes_apart(judge, table, length)?;
            Ok(Evaluator::new(table, maximum_age_ms)?)
        })
    }
}

/// Evaluates an estimate and writes the verdict.
///
/// # Safety
/// As for [`open`], [`read`] and [`answer`].
unsafe fn judged(
    judge: *const posegate_judge,
    estimate: *const posegate_estimate,
    verdict: *mut posegate_verdict,
    by: impl FnOnce(&Evaluator<'_>, u32, u32, Result<PoseSet, InputError>) -> posegate_verdict,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(verdict, || {
            let storage = judge.cast_mut();
            separate(storage, estimate).and(separate(storage, verdict))?;
            let (judge, estimate) = (&*open(storage)?, read(estimate)?);
            unused(estimate.reserved)?;
            let radius = match estimate.radius_squared_q16 {
                0 => judge.radius_squared(),
                raw => RadiusSquared::from_q16(raw).ok_or(posegate_status::BadValue)?,
            };
            let belief = estimate.belief.belief()?;
            let is_gaussian = matches!(belief.spread, Some(Uncertainty::Gaussian(_)));
            // A request may be stricter than the site, but not less strict.
            if is_gaussian && !(radius.q16() >= judge.radius_squared().q16()) {
                return Err(posegate_status::BadValue);
            }
            let set = pose_set(&belief, radius);
            Ok(by(judge, estimate.now_ms, estimate.stamp_ms, set))
        })
    }
}

/// For recordings and benches only.
///
/// Writes the verdict on an estimate: one decision, without margin and worst pose.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE`, among others, if the radius is below the table's: the caller may be stricter
/// than the site, but not less strict.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_judge_permits(
    judge: *const posegate_judge,
    estimate: *const posegate_estimate,
    verdict: *mut posegate_verdict,
) -> posegate_status {
    let by = |judge: &Evaluator<'_>, now, stamp, set| match judge.permits(now, stamp, set) {
        Ok(()) => posegate_verdict {
            verdict: POSEGATE_PERMIT,
            ..Plain::ZERO
        },
        Err(reason) => posegate_verdict::of(Verdict::deny(reason)),
    };
    // SAFETY: the caller's promise.
    unsafe { judged(judge, estimate, verdict, by) }
}

/// For recordings and benches only.
///
/// Writes the verdict on an estimate with its margin and worst pose, at the cost of 30 to 500 decisions. Errors as for
/// `posegate_judge_permits`.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_judge_examine(
    judge: *const posegate_judge,
    estimate: *const posegate_estimate,
    verdict: *mut posegate_verdict,
) -> posegate_status {
    let by = |judge: &Evaluator<'_>, now, stamp, set| {
        posegate_verdict::of(judge.evaluate(now, stamp, set))
    };
    // SAFETY: the caller's promise.
    unsafe { judged(judge, estimate, verdict, by) }
}
