//! Measures the stack use of a call: the words below the caller are painted, and examined afterwards.

use core::arch::asm;

/// Size of the painted area below the caller, bytes.
const DEPTH: u32 = 16 * 1024;
const PAINT: u32 = 0xa5a5_a5a5;

fn stack_pointer() -> u32 {
    let pointer: u32;
    // SAFETY: reads a register.
    unsafe {
        asm!("mov {}, sp", out(reg) pointer, options(nomem, nostack));
    }
    pointer
}

/// Returns the number of bytes below the caller's frame that `work` has written, to a word. Bytes
/// that a frame reserves but never writes are not counted.
#[inline(never)]
pub fn used_by<T>(work: impl FnOnce() -> T) -> (u32, T) {
    let top = stack_pointer();
    paint(top);
    let result = work();
    (top - lowest_written(top), result)
}

#[inline(never)]
fn paint(top: u32) {
    // This function's own frame lies just below `top`.
    let mut at = top - DEPTH;
    while at < stack_pointer() - 64 {
        // SAFETY: RAM below the stack pointer that nothing else uses: the board has 4 MB for it.
        unsafe { (at as *mut u32).write_volatile(PAINT) };
        at += 4;
    }
}

#[inline(never)]
fn lowest_written(top: u32) -> u32 {
    let mut at = top - DEPTH;
    // SAFETY: as above; only read.
    while at < top && unsafe { (at as *const u32).read_volatile() } == PAINT {
        at += 4;
    }
    at
}
