//! The clock by which the gate looks at recorded stamps.

use crate::log::recording::Sample;
use crate::log::{clock_ms, clock_ms_of_ns};

/// Two clocks that are farther apart than this, seconds, are not one.
const SAME_CLOCK_S: f64 = 3600.0;

/// What is said where ages are not known.
pub const NOT_FRESH: &str = "not checked: ages are not known, every estimate counts as just made";

/// By which clock the gate looks at stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// When each estimate was recorded, or used (`now_s`): ages are known.
    Logged,
    /// The stamps themselves: every estimate counts as just made.
    Stamps,
}

/// The gate's time when it is given a sample.
pub(super) fn now_ms(clock: Option<Clock>, sample: &Sample) -> Option<u32> {
    match (clock, sample.exact_ns) {
        (Some(Clock::Logged), Some(exact)) => Some(clock_ms_of_ns(exact.logged)),
        (Some(Clock::Logged), None) => clock_ms(sample.logged_s?),
        _ => stamp_ms(sample),
    }
}

/// A sample's stamp on the controller's clock.
pub(super) fn stamp_ms(sample: &Sample) -> Option<u32> {
    match sample.exact_ns {
        Some(exact) => Some(clock_ms_of_ns(exact.stamp)),
        None => clock_ms(sample.t_s),
    }
}

/// By which clock the first estimates can be looked at: one strange stamp does not switch freshness off.
pub(super) fn clock_of(samples: &[Sample]) -> Clock {
    let apart = |sample: &Sample| Some((sample.logged_s? - sample.t_s).abs());
    let known = samples.iter().filter_map(apart).filter(|s| s.is_finite());
    let (mut all, mut other) = (0_usize, 0_usize);
    for apart in known {
        all += 1;
        other += usize::from(!(apart < SAME_CLOCK_S));
    }
    let has_logged = samples.iter().any(|sample| sample.logged_s.is_some());
    // Nine of ten, and none that can be compared only where there is no recorded time at all.
    let differ = if all == 0 {
        !has_logged
    } else {
        other * 10 >= all * 9
    };
    if differ { Clock::Stamps } else { Clock::Logged }
}
