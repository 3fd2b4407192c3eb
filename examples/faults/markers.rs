//! The markers that the harness stops at or reads from the emulator's log, and the way to end.

use crate::board::Led;
use core::arch::global_asm;
use posegate::gate::Reason;

// Markers: each tells the emulator's log what happens, by a write to a register of the board that has no
// meaning here. `cycle_begins` comes to `stop`, where the harness has a breakpoint, in the cycle whose number
// the harness has put far above the variables. They have a page of memory of their own: the emulator is slow
// on a page with a breakpoint.
global_asm!(
    ".section .text.markers, \"ax\", %progbits",
    ".balign 4096",
    ".irp marker, cycle_begins, cycle_done, stop, schedule_over, halted, store, markers_end",
    ".global \\marker",
    ".type \\marker, %function",
    ".endr",
    ".thumb_func",
    "cycle_begins:",
    "uxth r12, r0",
    "orr r12, #0x40000000",
    "movw r3, #0x804c",
    "movt r3, #0x4002",
    "str r12, [r3]",
    "movw r3, #0",
    "movt r3, #0x2030",
    "ldr r3, [r3]",
    "cmp r3, r0",
    "bne 1f",
    ".thumb_func",
    "stop:",
    "nop",
    "1: bx lr",
    ".thumb_func",
    "cycle_done:",
    "uxth r12, r0",
    "orr r12, r12, r1, lsl #16",
    "orr r12, #0x80000000",
    "movw r3, #0x804c",
    "movt r3, #0x4002",
    "str r12, [r3]",
    "bx lr",
    ".thumb_func",
    "schedule_over:",
    "nop",
    "bx lr",
    ".thumb_func",
    "halted:",
    "nop",
    "bx lr",
    // For the harness alone: its debugger writes no device's register.
    ".thumb_func",
    "store:",
    "str r1, [r0]",
    "nop",
    ".thumb_func",
    "markers_end:",
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
