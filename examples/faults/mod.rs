//! What the targets of fault injection share: the schedule, the markers that the harness stops at, the
//! way to end.
#![allow(dead_code)] // Each target uses a part.

pub mod schedule;

use crate::board::Led;
use core::arch::global_asm;
use posegate::gate::Reason;

// Markers: the harness stops at their first instruction, reads the arguments in their registers, and passes
// over it. They have a page of memory of their own: the emulator is slow on a page with a breakpoint.
global_asm!(
    ".section .text.markers, \"ax\", %progbits",
    ".balign 4096",
    ".irp marker, cycle_begins, cycle_done, schedule_over, halted",
    ".global \\marker",
    ".type \\marker, %function",
    ".thumb_func",
    "\\marker:",
    "nop",
    "bx lr",
    ".endr",
    // For the harness alone: its debugger writes no device's register.
    ".global store",
    ".type store, %function",
    ".thumb_func",
    "store:",
    "str r1, [r0]",
    "nop",
    ".balign 4096",
    ".text",
);

unsafe extern "C" {
    /// A cycle begins. Where the gate's memory is, and how long.
    pub safe fn cycle_begins(number: u32, gate: *const (), length: usize);
    /// A cycle is over: the output stands as it shall until the next one.
    pub safe fn cycle_done(number: u32, reason: u32);
    /// The schedule is over.
    pub safe fn schedule_over();
    /// Closed for good, until a reset.
    pub safe fn halted();
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
