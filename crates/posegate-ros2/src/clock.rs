//! The node's clock: ROS time in the gate's milliseconds, and a check for changes of the clock.

use crate::message::Time;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// If the system's clock differs from the monotonic clock by more than this since the last check, it was set;
/// milliseconds.
const STEP_MS: i128 = 20;

/// A moment of the system's clock, which is ROS time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Now {
    /// Nanoseconds since 1970.
    ns: i128,
}

impl Now {
    /// Returns a moment from nanoseconds since 1970.
    #[must_use]
    pub const fn from_ns(ns: i128) -> Self {
        Self { ns }
    }

    /// Returns the current moment of the system's clock.
    #[must_use]
    pub fn read() -> Self {
        let ns = match SystemTime::now().duration_since(UNIX_EPOCH) {
            Ok(since) => since.as_nanos() as i128,
            Err(before) => -(before.duration().as_nanos() as i128),
        };
        Self { ns }
    }

    /// Returns the gate's clock: wrapping milliseconds, rounded up, so that no estimate appears younger than it is.
    #[must_use]
    pub const fn ms(self) -> u32 {
        (-(-self.ns).div_euclid(1_000_000)) as u32
    }

    /// Returns the moment as the stamp of a message.
    #[must_use]
    pub const fn time(self) -> Time {
        Time::from_ns(self.ns as i64)
    }

    /// Returns the stamp of a message on the gate's clock, rounded down. `None` if it is not a time, or is farther
    /// from this moment than the range of the gate's clock (24.8 days).
    #[must_use]
    pub fn stamp_ms(self, stamp: Time) -> Option<u32> {
        if !(stamp.nanosec < 1_000_000_000) {
            return None;
        }
        let ns = i128::from(stamp.ns());
        let is_near = (self.ns - ns).abs() < (1 << 31) * 1_000_000;
        is_near.then_some(ns.div_euclid(1_000_000) as u32)
    }

    /// Returns the age of a stamp, nanoseconds; negative for a stamp in the future.
    #[must_use]
    pub const fn age_ns(self, stamp: Time) -> i128 {
        self.ns - stamp.ns() as i128
    }

    /// Returns the age of a stamp, seconds; negative for a stamp in the future.
    #[must_use]
    pub fn age_s(self, stamp: Time) -> f64 {
        self.age_ns(stamp) as f64 * 1e-9
    }
}

/// Compares the system's clock with the monotonic one.
///
/// A gate detects that its clock goes backwards between two steps. It cannot detect a clock that is set forward, or
/// back by less than a cycle; then stamps from before and after are not of one clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClockWatch {
    last: Option<(Now, [Instant; 2])>,
}

impl ClockWatch {
    /// Reads both clocks. Returns `true` if the system's clock was set since the last time.
    pub fn check(&mut self) -> bool {
        let before = Instant::now();
        let now = Now::read();
        self.was_set(now, [before, Instant::now()])
    }

    /// Adds a reading of the system's clock, with the monotonic clock just before and just after it. If the program
    /// did not run in between, the monotonic time is less certain, but the clock was not set.
    fn was_set(&mut self, now: Now, [before, after]: [Instant; 2]) -> bool {
        let Some((last, [last_before, last_after])) = self.last.replace((now, [before, after]))
        else {
            return false;
        };
        let shortest = nanoseconds(before.saturating_duration_since(last_after));
        let longest = nanoseconds(after.saturating_duration_since(last_before));
        let passed = now.ns - last.ns;
        let most = STEP_MS * 1_000_000;
        !(passed >= shortest - most && passed <= longest + most)
    }
}

const fn nanoseconds(time: Duration) -> i128 {
    time.as_nanos() as i128
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i128 = 1_000_000_000;

    #[test]
    fn ages_are_rounded_up() {
        let now = Now::from_ns(5 * SECOND + 1);
        let stamp = Time {
            sec: 4,
            nanosec: 999_999_999,
        };
        assert_eq!(now.ms() - now.stamp_ms(stamp).unwrap(), 2);
        let whole = Now::from_ns(5 * SECOND);
        assert_eq!(whole.ms(), 5_000);
        assert_eq!(whole.time(), Time { sec: 5, nanosec: 0 });
    }

    #[test]
    fn invalid_and_distant_stamps_are_not_on_the_clock() {
        let now = Now::from_ns(1_800_000_000 * SECOND);
        assert_eq!(now.stamp_ms(Time { sec: 0, nanosec: 0 }), None);
        assert_eq!(
            now.stamp_ms(Time {
                sec: 1_800_000_000,
                nanosec: 1_000_000_000
            }),
            None
        );
        // 2^32 ms earlier: the same number of the gate's clock, 49.7 days old.
        assert_eq!(
            now.stamp_ms(Time {
                sec: 1_800_000_000 - 4_294_967,
                nanosec: 0
            }),
            None
        );
        assert!(
            now.stamp_ms(Time {
                sec: 1_800_000_000,
                nanosec: 999_999_999
            })
            .is_some()
        );
    }

    #[test]
    fn setting_the_clock_is_detected() {
        let start = Instant::now();
        let mut watch = ClockWatch::default();
        let mut was_set = |system_ms: i128, monotonic_ms: u64, late_ms: u64| {
            let at = |ms| start + Duration::from_millis(ms);
            let monotonic = [at(monotonic_ms), at(monotonic_ms + late_ms)];
            watch.was_set(Now::from_ns(system_ms * 1_000_000), monotonic)
        };
        assert!(!was_set(0, 0, 0));
        assert!(!was_set(1_000, 1_000, 0));
        assert!(!was_set(1_010, 1_000, 0));
        // The program did not run for 300 ms between two readings, before or after that of the system's clock.
        assert!(!was_set(2_300, 2_000, 300));
        assert!(!was_set(3_000, 3_000, 300));
        assert!(!was_set(4_000, 4_000, 0));
        assert!(was_set(6_000, 5_000, 0));
        assert!(was_set(4_000, 6_000, 0));
        assert!(!was_set(5_000, 7_000, 0));
    }
}
