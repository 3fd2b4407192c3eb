//! Panics of a program: one line for its user, and an exit code.

use std::io::Write;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::printable::printable;

/// The exit code of a program that has panicked: internal error.
const INTERNAL: u8 = 3;
/// Characters of a panic's message that are printed.
const LONGEST: usize = 500;

/// Set by the first panic of any thread.
static PANICKED: AtomicBool = AtomicBool::new(false);

/// Runs a program. If any of its threads panics, the first panic is printed as one line on stderr that asks for a report, and the exit code is 3.
/// Where `RUST_BACKTRACE` is set (and not 0), Rust's own message follows. To be called once, from `main`.
///
/// An allocation that fails and a stack that overflows end a process without a panic.
pub fn guarded(program: impl FnOnce() -> ExitCode) -> ExitCode {
    let standard = take_hook();
    let backtrace = std::env::var_os("RUST_BACKTRACE").is_some_and(|value| value != "0");
    set_hook(Box::new(move |info| {
        // A panic of a worker thread goes on in the thread that waits for it.
        if PANICKED.swap(true, Ordering::SeqCst) {
            return;
        }
        // There is nowhere to report an error to.
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
