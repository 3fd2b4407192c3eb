//! A counter of ticks as the milliseconds of a gate.

use super::call::init;
use super::memory::{Storage, object, separate, write};
use super::posegate_status;
use posegate::gate::Clock;

/// Number of 64-bit words of a `posegate_clock`.
pub const POSEGATE_CLOCK_WORDS: usize = 5;

/// Storage of a clock. It converts a wrapping counter of ticks to the `now_ms` of a gate, without drift, and reports a counter that stands still.
///
/// `posegate_clock_init` initialises it. Do not move it: a copy is refused. Only one context at a time may call its functions.
#[repr(C)]
pub struct posegate_clock {
    /// Private.
    pub words: [u64; POSEGATE_CLOCK_WORDS],
}

// SAFETY: integers.
unsafe impl Storage for posegate_clock {
    type Held = Clock;
    const MARK: u32 = 0x636c_6f6b;
}

/// Initialises a clock at 0 ms, for a counter that counts up `ticks_per_s` ticks per second, has `counter_bits` bits (from 1 to 32) and is at
/// `count` now.
///
/// After `most_still` calls of `posegate_clock_now` in a row with the count of the call before, the clock is stopped: 1 if the counter ticks at
/// least once per control cycle, 10 for a cycle of 1 kHz on ticks of 10 ms.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` if `ticks_per_s` or `most_still` is 0, or `counter_bits` is out of its range.
///
/// # Safety
/// The pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_clock_init(
    clock: *mut posegate_clock,
    ticks_per_s: u32,
    counter_bits: u32,
    most_still: u32,
    count: u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        init(clock, || {
            let made = Clock::new(ticks_per_s, counter_bits, most_still, count);
            made.ok_or(posegate_status::BadValue)
        })
    }
}

/// Takes the present count and writes the time in milliseconds. Call it in every control cycle, at least once per wrap of the counter: two wraps
/// between two calls are seen as one (16 bits at 32,768 Hz wrap in 2 s).
///
/// Errors: `POSEGATE_STATUS_CLOCK_STOPPED` if the counter stands still. The time is then written; call `posegate_gate_fault` with
/// `POSEGATE_REASON_CLOCK_STOPPED`, since no permit ends by its age while the clock stands still. After any other error the time is 0.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_clock_now(
    clock: *mut posegate_clock,
    count: u32,
    now_ms: *mut u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(clock, now_ms);
        write(now_ms, 0)?;
        apart?;
        let clock = object(clock)?;
        write(now_ms, clock.now_ms(count))?;
        if clock.is_stopped() {
            return Err(posegate_status::ClockStopped);
        }
        Ok(())
    })
}
