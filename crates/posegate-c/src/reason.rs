//! The texts of the reasons, zero-terminated for C.

use core::ffi::c_char;
use posegate::gate::Reason;

/// Returns the number of bytes of the texts of every reason, with a zero after each.
macro_rules! length {
    ($text:path) => {{
        let (mut total, mut rest) = (0usize, Reason::ALL.as_slice());
        while let [reason, after @ ..] = rest {
            total = total.saturating_add($text(*reason).len()).saturating_add(1);
            rest = after;
        }
        total
    }};
}

/// Returns the texts of every reason in the order of the codes, with a zero after each.
macro_rules! texts {
    ($text:path) => {{
        let mut texts = [0u8; length!($text)];
        let (mut to, mut reasons) = (texts.as_mut_slice(), Reason::ALL.as_slice());
        while let [reason, after @ ..] = reasons {
            let mut text = $text(*reason).as_bytes();
            // The loop uses one slot more than the text has bytes: the zero.
            let mut ended = false;
            while !ended && let [slot, slots @ ..] = to {
                match text {
                    [byte, bytes @ ..] => (*slot, text) = (*byte, bytes),
                    [] => ended = true,
                }
                to = slots;
            }
            reasons = after;
        }
        texts
    }};
}

static NAMES: [u8; length!(Reason::name)] = texts!(Reason::name);
static MEANINGS: [u8; length!(Reason::meaning)] = texts!(Reason::meaning);
static ACTIONS: [u8; length!(Reason::action)] = texts!(Reason::action);

/// Returns the text of a code, or an empty text for a code without a reason.
fn text(texts: &'static [u8], reason: u32) -> *const c_char {
    let place = reason
        .checked_sub(1)
        .and_then(|at| usize::try_from(at).ok());
    let found = place.and_then(|at| texts.split_inclusive(|byte| *byte == 0).nth(at));
    found.unwrap_or(&[0]).as_ptr().cast()
}

/// Returns the name of a `posegate_reason` in `snake_case`, the same in every output. Empty for a number
/// that is not a reason.
#[unsafe(no_mangle)]
pub extern "C" fn posegate_reason_name(reason: u32) -> *const c_char {
    text(&NAMES, reason)
}

/// Returns a sentence that says what happened. Empty for a number that is not a reason.
#[unsafe(no_mangle)]
pub extern "C" fn posegate_reason_meaning(reason: u32) -> *const c_char {
    text(&MEANINGS, reason)
}

/// Returns a sentence with the required manual action. Empty for a number that is not a reason.
#[unsafe(no_mangle)]
pub extern "C" fn posegate_reason_action(reason: u32) -> *const c_char {
    text(&ACTIONS, reason)
}
