//! The clock with which the gate checks recorded stamps.

use crate::recording::Sample;
use crate::{clock_ms, clock_ms_of_ns};

/// If two times differ by more than this, seconds, they come from different clocks.
const SAME_CLOCK_S: f64 = 3600.0;

/// The text that states that freshness is not checked.
pub const NOT_FRESH: &str = "not checked: ages are not known, every estimate counts as just made";

/// The clock with which the gate checks stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// The time when each estimate was recorded or used (`now_s`): ages are known.
    Logged,
    /// The stamps themselves: every estimate counts as just made.
    Stamps,
}

/// Returns the gate's time when it gets a sample.
pub(super) fn now_ms(clock: Option<Clock>, sample: &Sample) -> Option<u32> {
    match (clock, sample.exact_ns) {
        (Some(Clock::Logged), Some(exact)) => Some(clock_ms_of_ns(exact.logged)),
        (Some(Clock::Logged), None) => clock_ms(sample.logged_s?),
        _ => stamp_ms(sample),
    }
}

/// Returns a sample's stamp on the controller's clock.
pub(super) fn stamp_ms(sample: &Sample) -> Option<u32> {
    match sample.exact_ns {
        Some(exact) => Some(clock_ms_of_ns(exact.stamp)),
        None => clock_ms(sample.t_s),
    }
}

/// Returns the clock for a recording from its first estimates. A single wrong stamp does not disable the
/// freshness check.
pub(super) fn clock_of(samples: &[Sample]) -> Clock {
    let apart = |sample: &Sample| Some((sample.logged_s? - sample.t_s).abs());
    let known = samples.iter().filter_map(apart).filter(|s| s.is_finite());
    let (mut all, mut other) = (0_usize, 0_usize);
    for apart in known {
        all += 1;
        other += usize::from(!(apart < SAME_CLOCK_S));
    }
    let has_logged = samples.iter().any(|sample| sample.logged_s.is_some());
    // Stamps if nine of ten differ. If no times can be compared, stamps only if no time was recorded at
    // all.
    let differ = if all == 0 {
        !has_logged
    } else {
        other * 10 >= all * 9
    };
    if differ { Clock::Stamps } else { Clock::Logged }
}
