//! The texts of the reasons, zero-terminated for C.

use core::ffi::c_char;
use posegate::gate::Reason;

/// Returns 0, or the code of a reason.
pub(super) fn code(outcome: Result<(), Reason>) -> u32 {
    outcome.map_or_else(|reason| u32::from(reason.code()), |()| 0)
}

/// Returns the text of a code, or an empty text for a code without a reason.
fn text(texts: &'static str, reason: u32) -> *const c_char {
    let place = reason
        .checked_sub(1)
        .and_then(|at| usize::try_from(at).ok());
    let found = place.and_then(|at| texts.as_bytes().split_inclusive(|byte| *byte == 0).nth(at));
    found.unwrap_or(&[0]).as_ptr().cast()
}

/// Returns the name of a `posegate_reason` in `snake_case`, the same in every output. Empty for a number
/// that is not a reason.
#[unsafe(no_mangle)]
pub extern "C" fn posegate_reason_name(reason: u32) -> *const c_char {
    text(Reason::NAMES, reason)
}

/// Returns a sentence that says what happened. Empty for a number that is not a reason.
#[unsafe(no_mangle)]
pub extern "C" fn posegate_reason_meaning(reason: u32) -> *const c_char {
    text(Reason::MEANINGS, reason)
}

/// Returns a sentence with the required manual action. Empty for a number that is not a reason.
#[unsafe(no_mangle)]
pub extern "C" fn posegate_reason_action(reason: u32) -> *const c_char {
    text(Reason::ACTIONS, reason)
}
