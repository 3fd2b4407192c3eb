//! The end of a program that runs once in the emulator: its exit code. A panic or a fault is a failure.

use core::fmt::Display;
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hprintln;

/// Runs the program and ends the emulator with exit code 0, or prints the error as a JSON line and ends it with exit code 1.
pub fn run<E: Display>(program: impl FnOnce() -> Result<(), E>) -> ! {
    match program() {
        Ok(()) => loop {
            debug::exit(EXIT_SUCCESS);
        },
        Err(error) => fail(error),
    }
}

fn fail(error: impl Display) -> ! {
    hprintln!("{{\"error\":\"{}\"}}", error);
    loop {
        debug::exit(EXIT_FAILURE);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    fail("panic")
}

#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    fail("fault")
}
