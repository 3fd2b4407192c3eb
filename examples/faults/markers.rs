//! Markers at which the harness stops or which it reads from the emulator's log, and the functions that end a
//! run.

use crate::board::Led;
use core::arch::global_asm;
use posegate::gate::Reason;

// Each marker writes an event to the emulator's log, by a write to a board register that has no other use
// here. `cycle_begins` calls `stop`, where the harness has a breakpoint, in the cycle whose number the
// harness has stored far above the variables. The markers have a memory page of their own, because the
// emulator is slow on a page with a breakpoint.
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
    // For the harness only, because its debugger cannot write device registers.
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
    /// A cycle begins. Reports the address and length of the gate's memory.
    pub safe fn cycle_begins(number: u32, gate: *const (), length: usize);
    /// A cycle is over: the output stays at its level until the next one.
    pub safe fn cycle_done(number: u32, reason: u32);
    /// The schedule is over.
    pub safe fn schedule_over();
    /// The program has halted: closed until a reset.
    pub safe fn halted();
}

/// Halts with the output closed. In a product the watchdog resets.
pub fn halt() -> ! {
    cortex_m::interrupt::disable();
    loop {
        Led::force_low();
        halted();
    }
}

/// Returns the number of a verdict; 0 for a permit.
pub fn code(verdict: Result<(), Reason>) -> u32 {
    verdict.map_or_else(|reason| u32::from(reason.code()), |()| 0)
}
