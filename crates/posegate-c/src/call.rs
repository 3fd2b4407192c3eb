//! The order in which a call checks its pointers, reads its inputs and writes its answer: the same for most functions. Those that
//! change storage in their own order state it.

use super::memory::{Plain, Storage, check, close, take, write};
use super::posegate_status;
use super::status::Done;

/// Writes the answer of a call, or a denial after an error. `made` reads all inputs, which may share bytes with the answer, and
/// refuses storage that does. If the answer cannot be written, nothing is done.
///
/// # Safety
/// As for [`write`].
pub(super) unsafe fn answer<A: Plain>(
    to: *mut A,
    made: impl FnOnce() -> Result<A, posegate_status>,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe { answer_or(to, A::DENIED, made) }
}

/// As [`answer`], for a number that has its own denial.
///
/// # Safety
/// As for [`write`].
pub(super) unsafe fn answer_or<A: Plain>(
    to: *mut A,
    denied: A,
    made: impl FnOnce() -> Result<A, posegate_status>,
) -> posegate_status {
    posegate_status::of(|| {
        check(to)?;
        // SAFETY: checked, except for the caller's promise.
        made()
            .map(|answer| unsafe { to.write(answer) })
            .inspect_err(|_| unsafe { to.write(denied) })
    })
}

/// Writes the answer of a call that counts even if its answer cannot be written: a gate closes, and time passes. The inputs have been
/// read, since the denial is written first; `apart` says whether the storage shares no bytes with an argument.
///
/// # Safety
/// As for [`write`].
pub(super) unsafe fn act<A: Plain, M: Into<A>>(
    apart: Done,
    to: *mut A,
    denied: A,
    made: impl FnOnce() -> Result<M, posegate_status>,
) -> Done {
    // SAFETY: the caller's promise.
    let written = unsafe { write(to, denied) };
    apart?;
    let made = made();
    written?;
    // SAFETY: it was written before.
    unsafe { to.write(made?.into()) };
    Ok(())
}

/// Initialises storage with an object. After an error the storage is not initialised.
///
/// # Safety
/// As for [`write`].
pub(super) unsafe fn init<S: Storage>(
    storage: *mut S,
    made: impl FnOnce() -> Result<S::Held, posegate_status>,
) -> posegate_status {
    // SAFETY: the caller's promise; an object has been written when the storage is closed.
    posegate_status::of(|| unsafe {
        let held = take(storage)?;
        held.write(made()?);
        close(storage);
        Ok(())
    })
}
