//! What the targets of fault injection share: the schedule, the markers that the harness stops at, the
//! way to end.
#![allow(dead_code)] // Each target uses a part.

pub mod schedule;

use crate::board::Led;
use core::arch::naked_asm;
use posegate::gate::Reason;

// Markers: the harness stops at their first instruction, reads the arguments in their registers, and passes
// over it. Each ends in another number, so that no two are merged.

/// A cycle begins.
#[unsafe(naked)]
#[unsafe(no_mangle)]
pub extern "C" fn cycle_begins(number: u32) {
    naked_asm!("nop", "bx lr", ".short 1");
}

/// A cycle is over: the output stands as it shall until the next one.
#[unsafe(naked)]
#[unsafe(no_mangle)]
pub extern "C" fn cycle_done(number: u32, reason: u32) {
    naked_asm!("nop", "bx lr", ".short 2");
}

/// The schedule is over.
#[unsafe(naked)]
#[unsafe(no_mangle)]
pub extern "C" fn schedule_over() {
    naked_asm!("nop", "bx lr", ".short 3");
}

/// Closed for good, until a reset.
#[unsafe(naked)]
#[unsafe(no_mangle)]
pub extern "C" fn halted() {
    naked_asm!("nop", "bx lr", ".short 4");
}

/// Closed for good. A product lets its watchdog reset it.
pub fn halt() -> ! {
    cortex_m::interrupt::disable();
    loop {
        Led::force_low();
        halted();
    }
}

/// The number of a verdict; 0 for a permit.
pub fn code(verdict: Result<(), Reason>) -> u32 {
    verdict.map_or_else(|reason| u32::from(reason.code()), |()| 0)
}
