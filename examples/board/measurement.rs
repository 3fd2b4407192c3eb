//! The end of a program that measures in the emulator. A panic or a fault is a failure.

use crate::board::counter::Failure;
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hprintln;

/// Measures, prints the failure if there is one, and ends the emulator with exit code 0 or 1.
pub fn run(measure: impl FnOnce() -> Result<(), Failure>) -> ! {
    match measure() {
        Ok(()) => stop(EXIT_SUCCESS),
        Err(failure) => {
            hprintln!("{{\"error\":\"{}\"}}", failure);
            stop(EXIT_FAILURE)
        }
    }
}

fn stop(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    stop(EXIT_FAILURE)
}

#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    stop(EXIT_FAILURE)
}
