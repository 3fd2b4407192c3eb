//! The state of the interlock over time, open or shut for a reason, in a limited number of spans.

use super::spans::{Joined, Spans};
use posegate::gate::Reason;

/// Open, and each code of a reason.
const STATES: usize = 64;

/// The time that each state took in a span, seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneSpan {
    seconds: [f64; STATES],
}

impl LaneSpan {
    /// Returns the time for which the interlock was open, seconds.
    #[must_use]
    pub fn open_s(&self) -> f64 {
        self.of(0)
    }

    /// Returns the time for which the interlock was shut for a reason, seconds.
    #[must_use]
    pub fn shut_s(&self, reason: Reason) -> f64 {
        self.of(usize::from(reason.code()))
    }

    /// Returns the time of all states, seconds.
    #[must_use]
    pub fn all_s(&self) -> f64 {
        self.seconds.iter().sum()
    }

    fn of(&self, state: usize) -> f64 {
        self.seconds.get(state).copied().unwrap_or(0.0)
    }
}

impl Joined for LaneSpan {
    const EMPTY: Self = Self {
        seconds: [0.0; STATES],
    };

    fn joined(&self, other: &Self) -> Self {
        let mut joined = *self;
        for (sum, more) in joined.seconds.iter_mut().zip(other.seconds) {
            *sum += more;
        }
        joined
    }
}

/// The states of the interlock over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lanes(Spans<LaneSpan>);

impl Lanes {
    /// Returns the time of the first step, seconds.
    #[must_use]
    pub const fn start_s(&self) -> f64 {
        self.0.start_s
    }

    /// Returns the length of a span, seconds.
    #[must_use]
    pub const fn width_s(&self) -> f64 {
        self.0.width_s
    }

    /// Returns the spans up to the last one with a state.
    #[must_use]
    pub fn spans(&self) -> &[LaneSpan] {
        self.0.spans()
    }

    /// Adds a state from one time to another: open, or shut for a reason.
    pub(super) fn add(&mut self, from_s: f64, to_s: f64, shut: Option<Reason>) {
        self.0.start(from_s);
        let (from, to) = (from_s - self.0.start_s, to_s - self.0.start_s);
        if !(from >= 0.0 && to > from && to.is_finite()) {
            return;
        }
        self.0.reach(to);
        let width = self.0.width_s;
        let state = shut.map_or(0, |reason| usize::from(reason.code()));
        for (index, span) in self.0.between(from, to) {
            let begins = index as f64 * width;
            let part = to.min(begins + width) - from.max(begins);
            if let Some(sum) = span.seconds.get_mut(state) {
                *sum += part.max(0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No second is lost in a recording of any length, and each second is in the span of its time.
    #[test]
    fn joined_spans_keep_all_seconds() {
        let mut lanes = Lanes::default();
        let mut time = 5.0;
        for k in 0..2_000u32 {
            let long = 0.01 * f64::from(1 + k % 40);
            let shut = (k % 4 != 0).then_some(if k < 1_000 {
                Reason::Stale
            } else {
                Reason::Silent
            });
            lanes.add(time, time + long, shut);
            time += long;
        }
        let sum = |of: &dyn Fn(&LaneSpan) -> f64| lanes.spans().iter().map(of).sum::<f64>();
        assert!((sum(&LaneSpan::all_s) - (time - 5.0)).abs() < 1e-6);
        assert!((sum(&LaneSpan::open_s) - 500.0 * 0.19).abs() < 1e-6);
        let middle = lanes.spans().len() / 2;
        for (index, span) in lanes.spans().iter().enumerate() {
            let of_other = span.shut_s(if index < middle - 1 {
                Reason::Silent
            } else {
                Reason::Stale
            });
            assert!(index.abs_diff(middle) < 2 || of_other == 0.0, "{index}");
            assert!(span.all_s() <= lanes.width_s() * 1.000_001);
        }
        // Times that go back or are not numbers are ignored.
        let before = lanes.clone();
        lanes.add(4.0, 4.5, None);
        lanes.add(6.0, f64::INFINITY, None);
        lanes.add(6.0, f64::NAN, None);
        assert_eq!(lanes, before);
    }
}
