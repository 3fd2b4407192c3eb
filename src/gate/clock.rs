//! A counter of ticks as the milliseconds of a gate.
//!
//! All times of a gate are milliseconds. A gate that gets ticks of another length, or a clock that stands still, permits for longer than its
//! settings say, or for ever. [`Clock`] converts exactly and reports a counter that stands still.

use core::num::{NonZeroU32, NonZeroU64};

/// Converts a wrapping counter of ticks to wrapping milliseconds, without drift: the result is the number of whole milliseconds since the first
/// count, modulo 2^32, for any time of operation.
///
/// ```
/// use posegate::gate::{Clock, Reason};
///
/// # fn count() -> u32 { 0 }
/// # fn example(gate: &mut posegate::gate::Gate<'_>) -> Option<()> {
/// // A counter of 24 bits at 32,768 Hz. A control cycle of 100 Hz sees another count in every call.
/// let mut clock = Clock::new(32_768, 24, 1, count())?;
/// // In every control cycle:
/// let now_ms = clock.now_ms(count());
/// if clock.is_stopped() {
///     gate.fault(Reason::ClockStopped);
/// }
/// let step = gate.tick(now_ms);
/// # Some(()) }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Clock {
    ticks_per_s: NonZeroU32,
    /// The largest count of the counter.
    mask: u32,
    most_still: NonZeroU32,
    last: u32,
    now_ms: u32,
    /// The part of a millisecond that has begun, in units of 1 ms / `ticks_per_s`: less than `ticks_per_s`.
    rest: u32,
    /// The number of calls in a row with the count of the call before.
    still: u32,
}

impl Clock {
    /// Returns a clock at 0 ms, for a counter that counts up `ticks_per_s` ticks per second, has `counter_bits` bits and is at `count` now.
    ///
    /// After `most_still` calls in a row with the count of the call before, the clock is stopped. If the counter ticks at least once per
    /// control cycle, this is 1; a cycle of 1 kHz on ticks of 10 ms needs 10.
    ///
    /// `None` if `ticks_per_s` or `most_still` is 0, or `counter_bits` is not from 1 to 32.
    #[must_use]
    pub const fn new(
        ticks_per_s: u32,
        counter_bits: u32,
        most_still: u32,
        count: u32,
    ) -> Option<Self> {
        let (Some(ticks_per_s), Some(most_still)) =
            (NonZeroU32::new(ticks_per_s), NonZeroU32::new(most_still))
        else {
            return None;
        };
        let Some(unused) = 32_u32.checked_sub(counter_bits) else {
            return None;
        };
        // A counter of no bits would be shifted by 32.
        let Some(mask) = u32::MAX.checked_shr(unused) else {
            return None;
        };
        Some(Self {
            ticks_per_s,
            mask,
            most_still,
            last: count & mask,
            now_ms: 0,
            rest: 0,
            still: 0,
        })
    }

    /// Takes the present count and returns the time in milliseconds. Bits above those of the counter are ignored.
    ///
    /// Call it in every control cycle, at least once per wrap of the counter: a wrap between two calls is seen, two are seen as one. 16 bits
    /// at 32,768 Hz wrap in 2 s.
    pub fn now_ms(&mut self, count: u32) -> u32 {
        let count = count & self.mask;
        let ticks = count.wrapping_sub(self.last) & self.mask;
        self.last = count;
        self.still = if ticks == 0 {
            self.still.saturating_add(1)
        } else {
            0
        };
        // Below 2^32 * 1000 + 2^32: no overflow.
        let passed = u64::from(ticks)
            .wrapping_mul(1_000)
            .wrapping_add(u64::from(self.rest));
        let per_ms = NonZeroU64::from(self.ticks_per_s);
        // The time wraps, and the remainder is less than `ticks_per_s`.
        self.now_ms = self.now_ms.wrapping_add((passed / per_ms) as u32);
        self.rest = (passed % per_ms) as u32;
        self.now_ms
    }

    /// Returns `true` if the last `most_still` calls had the count of the call before: the counter stands still. Then close the gate with
    /// [`super::Gate::fault`] and [`super::Reason::ClockStopped`]: no permit ends by its age while the clock stands still.
    #[must_use]
    pub const fn is_stopped(&self) -> bool {
        self.still >= self.most_still.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_clocks_are_refused() {
        assert_eq!(Clock::new(0, 32, 1, 0), None);
        assert_eq!(Clock::new(1_000, 0, 1, 0), None);
        assert_eq!(Clock::new(1_000, 33, 1, 0), None);
        assert_eq!(Clock::new(1_000, 32, 0, 0), None);
        assert!(Clock::new(u32::MAX, 1, u32::MAX, u32::MAX).is_some());
    }

    /// A week at 32,768 Hz, in cycles of changing length: the counter wraps, and no part of a millisecond is lost.
    #[test]
    fn a_week_has_no_drift() {
        for (bits, first) in [(32, u32::MAX - 5), (24, 0xff_fff0), (16, 77)] {
            let mask = u32::MAX >> (32 - bits);
            let mut clock = Clock::new(32_768, bits, 1, first).unwrap();
            let (week, mut total, mut cycle) = (7 * 24 * 3600 * 32_768_u64, 0_u64, 0_u64);
            while total < week {
                cycle += 1;
                total += 1 + cycle * 7_919 % 60_001;
                let count = (u64::from(first) + total) as u32 & mask;
                let expected = u128::from(total) * 1_000 / 32_768;
                assert_eq!(clock.now_ms(count), expected as u32, "{bits} bits");
                assert!(!clock.is_stopped());
            }
        }
    }

    #[test]
    fn milliseconds_wrap_with_any_tick() {
        for ticks_per_s in [1, 3, 100, 999, 1_000, 1_024, 48_000_000, u32::MAX] {
            let mut clock = Clock::new(ticks_per_s, 32, 1, 0).unwrap();
            let mut total = 0_u128;
            for step in [1, 0x7fff_ffff, u32::MAX, u32::MAX, 12_345, 0xffff_0000].repeat(9) {
                total += u128::from(step);
                let expected = (total * 1_000 / u128::from(ticks_per_s)) as u32;
                assert_eq!(clock.now_ms(total as u32), expected, "{ticks_per_s}");
            }
        }
    }

    /// A counter that stands still is reported after the stated number of calls, and its time stands still.
    #[test]
    fn a_counter_that_stands_still_is_reported() {
        for most_still in [1, 10] {
            let mut clock = Clock::new(100, 32, most_still, 500).unwrap();
            assert_eq!(clock.now_ms(501), 10);
            for call in 1..=30 {
                assert_eq!(clock.now_ms(501), 10);
                assert_eq!(clock.is_stopped(), call >= most_still, "{call}");
            }
            assert_eq!(clock.now_ms(502), 20);
            assert!(!clock.is_stopped());
        }
        let mut clock = Clock::new(100, 32, u32::MAX, 500).unwrap();
        clock.still = u32::MAX - 1;
        clock.now_ms(500);
        clock.now_ms(500);
        assert!(clock.is_stopped());
    }
}
