//! The state of the interlock over time, open or shut for a reason, in a limited number of spans.

use posegate::gate::Reason;

/// The most spans.
const MOST: usize = 512;
/// Open, and each code of a reason.
const STATES: usize = 64;

/// The time that each state took in a span, seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneSpan {
    seconds: [f64; STATES],
}

impl LaneSpan {
    const EMPTY: Self = Self {
        seconds: [0.0; STATES],
    };

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
pub struct Lanes {
    start_s: f64,
    width_s: f64,
    spans: Vec<LaneSpan>,
    /// The last span with a state.
    last: usize,
}

impl Lanes {
    /// Returns the time of the first step, seconds.
    #[must_use]
    pub const fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Returns the length of a span, seconds.
    #[must_use]
    pub const fn width_s(&self) -> f64 {
        self.width_s
    }

    /// Returns the spans up to the last one with a state.
    #[must_use]
    pub fn spans(&self) -> &[LaneSpan] {
        self.spans.get(..=self.last).unwrap_or(&[])
    }

    /// Adds a state from one time to another: open, or shut for a reason.
    pub(super) fn add(&mut self, from_s: f64, to_s: f64, shut: Option<Reason>) {
        if self.spans.is_empty() {
            self.start_s = from_s;
            self.width_s = 1.0 / 1024.0;
            self.spans = vec![LaneSpan::EMPTY; MOST];
        }
        let (from, to) = (from_s - self.start_s, to_s - self.start_s);
        if !(from >= 0.0 && to > from && to.is_finite()) {
            return;
        }
        while to >= self.width_s * MOST as f64 {
            self.halve();
        }
        let state = shut.map_or(0, |reason| usize::from(reason.code()));
        let place = |time: f64| ((time / self.width_s) as usize).min(MOST - 1);
        let (first, last) = (place(from), place(to));
        self.last = self.last.max(last);
        let width = self.width_s;
        let within = self.spans.iter_mut().enumerate().take(last + 1).skip(first);
        for (index, span) in within {
            let begins = index as f64 * width;
            let part = to.min(begins + width) - from.max(begins);
            if let Some(sum) = span.seconds.get_mut(state) {
                *sum += part.max(0.0);
            }
        }
    }

    /// Joins each pair of spans into one.
    fn halve(&mut self) {
        self.width_s *= 2.0;
        self.last /= 2;
        let (pairs, _) = self.spans.as_chunks::<2>();
        let mut joined: Vec<LaneSpan> = pairs.iter().map(|[a, b]| a.joined(b)).collect();
        joined.resize(MOST, LaneSpan::EMPTY);
        self.spans = joined;
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
