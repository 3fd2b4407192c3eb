//! Handles panics of a program: one line for the user, and an exit code.
//!
//! ```
//! use posegate_files::guard::guarded;
//! use std::process::ExitCode;
//!
//! fn main() -> ExitCode {
//!     // A panic in here is one line on stderr, and exit code 3.
//!     guarded(|| {
//!         println!("permitted");
//!         ExitCode::SUCCESS
//!     })
//! }
//! ```

use std::io::Write;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::printable::printable;

/// The exit code of a program that has panicked: internal error.
const INTERNAL: u8 = 3;
/// Largest number of characters printed of a panic's message.
const LONGEST: usize = 500;

/// Set by the first panic of any thread.
static PANICKED: AtomicBool = AtomicBool::new(false);

/// Runs a program. If any of its threads panics, the first panic is printed as one line on stderr that asks for a
/// report, and the exit code is 3. If `RUST_BACKTRACE` is set (and not 0), Rust's own message follows. Call it once,
/// from `main`.
///
/// A failed allocation or a stack overflow ends the process without a panic.
pub fn guarded(program: impl FnOnce() -> ExitCode) -> ExitCode {
    let standard = take_hook();
    let backtrace = std::env::var_os("RUST_BACKTRACE").is_some_and(|value| value != "0");
    set_hook(Box::new(move |info| {
        // A panic of a worker thread continues in the thread that waits for it.
        if PANICKED.swap(true, Ordering::SeqCst) {
            return;
        }
        // An error here cannot be reported anywhere.
        let _ = writeln!(std::io::stderr(), "{}", line(info));
        if backtrace {
            standard(info);
        }
    }));
    match catch_unwind(AssertUnwindSafe(program)) {
        Ok(code) if !PANICKED.load(Ordering::SeqCst) => code,
        _ => INTERNAL.into(),
    }
}

fn line(info: &PanicHookInfo<'_>) -> String {
    let message = info.payload_as_str().unwrap_or("no message");
    let short: String = message.chars().take(LONGEST).collect();
    let place = info
        .location()
        .map_or_else(String::new, |at| at.to_string());
    std::format!(
        "internal error: {} ({}); please report it with the command and its input files",
        printable(&short),
        printable(&place)
    )
}

#[cfg(test)]
mod tests;
