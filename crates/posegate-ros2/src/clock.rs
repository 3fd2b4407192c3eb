//! The node's clock: ROS time in milliseconds, as the gate counts them, and whether it was set.

use crate::message::Time;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// A clock that differs from the monotonic clock by more than this since the last check was set, milliseconds.
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
        self.ns
            .div_euclid(1_000_000)
            .wrapping_add(if self.ns.rem_euclid(1_000_000) == 0 {
                0
            } else {
                1
            }) as u32
    }

    /// Returns the moment as a stamp of a message.
    #[must_use]
    pub const fn time(self) -> Time {
        Time {
            sec: self.ns.div_euclid(1_000_000_000) as i32,
            nanosec: self.ns.rem_euclid(1_000_000_000) as u32,
        }
    }

    /// Returns the stamp of a message on the gate's clock, rounded down. `None` if it is not a time, or is farther from this moment
    /// than the gate's clock can tell (24.8 days).
    #[must_use]
    pub fn stamp_ms(self, stamp: Time) -> Option<u32> {
        if !(stamp.nanosec < 1_000_000_000) {
            return None;
        }
        let ns = i128::from(stamp.sec) * 1_000_000_000 + i128::from(stamp.nanosec);
        let is_near = (self.ns - ns).abs() < (1 << 31) * 1_000_000;
        is_near.then_some(ns.div_euclid(1_000_000) as u32)
    }

    /// Returns how old a stamp is, seconds; negative for a stamp of the future.
    #[must_use]
    pub fn age_s(self, stamp: Time) -> f64 {
        let ns = i128::from(stamp.sec) * 1_000_000_000 + i128::from(stamp.nanosec);
        (self.ns - ns) as f64 * 1e-9
    }
}

/// Compares the system's clock with the monotonic one.
///
/// A gate notices that its clock goes backwards between two steps. It cannot notice a clock that is set forward, or back by less
/// than a cycle; then stamps from before and after are not of one clock.
#[derive(Clone, Copy, Debug)]
pub struct ClockWatch {
    last: Option<(Now, Instant)>,
}

impl ClockWatch {
    /// Returns a watch that has not seen a moment.
    #[must_use]
    pub const fn new() -> Self {
        Self { last: None }
    }

    /// Takes the next moment of both clocks. Returns `true` if the system's clock was set since the one before.
    pub fn was_set(&mut self, now: Now, monotonic: Instant) -> bool {
        let before = self.last.replace((now, monotonic));
        let Some((last, since)) = before else {
            return false;
        };
        let passed = monotonic.saturating_duration_since(since);
        let drift = now.ns - last.ns - nanoseconds(passed);
        !(drift.abs() <= STEP_MS * 1_000_000)
    }
}

impl Default for ClockWatch {
    fn default() -> Self {
        Self::new()
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
    fn ages_are_never_rounded_down() {
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
    fn stamps_that_are_no_time_or_far_away_have_no_place_on_the_clock() {
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
    fn a_clock_that_is_set_is_found() {
        let start = Instant::now();
        let mut watch = ClockWatch::new();
        assert!(!watch.was_set(Now::from_ns(0), start));
        assert!(!watch.was_set(Now::from_ns(SECOND), start + Duration::from_secs(1)));
        assert!(!watch.was_set(
            Now::from_ns(SECOND + 10_000_000),
            start + Duration::from_secs(1)
        ));
        assert!(watch.was_set(Now::from_ns(3 * SECOND), start + Duration::from_secs(2)));
        assert!(watch.was_set(Now::from_ns(SECOND), start + Duration::from_secs(3)));
        assert!(!watch.was_set(Now::from_ns(2 * SECOND), start + Duration::from_secs(4)));
    }
}
