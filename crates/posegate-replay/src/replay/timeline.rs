//! Verdicts over time, in a limited number of spans.

use super::Row;
use super::spans::{Joined, Spans};

/// A span of time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bucket {
    /// Estimates in the span.
    pub estimates: u64,
    /// Estimates with a permit as their verdict.
    pub permits: u64,
    /// Steps after which the gate was open.
    pub open: u64,
    /// Permits with the true pose outside of the success set.
    pub false_permits: u64,
    /// The smallest margin; infinite if there is none.
    pub least_margin: f64,
    /// The largest age, seconds; 0 if ages are not known.
    pub most_age_s: f64,
    /// The permits of the rules in [`super::RULES`].
    pub rules: [RuleCounts; 3],
}

/// The permits of a rule in a span.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RuleCounts {
    /// Estimates that the rule can judge.
    pub judged: u64,
    /// Estimates that the rule permits.
    pub permits: u64,
    /// Permits with the true pose outside of the success set.
    pub false_permits: u64,
}

impl RuleCounts {
    const NONE: Self = Self {
        judged: 0,
        permits: 0,
        false_permits: 0,
    };

    const fn joined(self, other: Self) -> Self {
        Self {
            judged: self.judged + other.judged,
            permits: self.permits + other.permits,
            false_permits: self.false_permits + other.false_permits,
        }
    }

    fn of(permits: Option<bool>, is_outside: bool) -> Self {
        permits.map_or(Self::NONE, |permits| Self {
            judged: 1,
            permits: u64::from(permits),
            false_permits: u64::from(permits && is_outside),
        })
    }
}

impl Joined for Bucket {
    const EMPTY: Self = Self {
        estimates: 0,
        permits: 0,
        open: 0,
        false_permits: 0,
        least_margin: f64::INFINITY,
        most_age_s: 0.0,
        rules: [RuleCounts::NONE; 3],
    };

    fn joined(&self, other: &Self) -> Self {
        Self {
            estimates: self.estimates + other.estimates,
            permits: self.permits + other.permits,
            open: self.open + other.open,
            false_permits: self.false_permits + other.false_permits,
            least_margin: self.least_margin.min(other.least_margin),
            most_age_s: self.most_age_s.max(other.most_age_s),
            rules: core::array::from_fn(|rule| {
                let of = |bucket: &Self| bucket.rules.get(rule).copied().unwrap_or_default();
                of(self).joined(of(other))
            }),
        }
    }
}

/// Verdicts over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timeline {
    spans: Spans<Bucket>,
    without_time: u64,
}

impl Timeline {
    /// Returns the first estimate's time, seconds.
    #[must_use]
    pub const fn start_s(&self) -> f64 {
        self.spans.start_s
    }

    /// Returns the length of a span, seconds.
    #[must_use]
    pub const fn width_s(&self) -> f64 {
        self.spans.width_s
    }

    /// Returns the spans up to the last one with an estimate. The first span also holds everything before the first
    /// estimate's time.
    #[must_use]
    pub fn buckets(&self) -> &[Bucket] {
        self.spans.spans()
    }

    /// Returns the number of estimates in no span: their time is not finite.
    #[must_use]
    pub const fn without_time(&self) -> u64 {
        self.without_time
    }

    pub(super) fn note(&mut self, row: &Row) {
        let now_s = row.now_s();
        // The difference of two finite times may overflow.
        let is_first = self.spans.is_empty();
        if !(now_s.is_finite() && (is_first || (now_s - self.spans.start_s).is_finite())) {
            self.without_time += 1;
            return;
        }
        self.spans.start(now_s);
        let since_s = now_s - self.spans.start_s;
        let is_outside = row.against.is_some_and(|against| !against.inside);
        let one = Bucket {
            estimates: 1,
            permits: u64::from(row.verdict.is_permit()),
            open: u64::from(row.permitted),
            false_permits: u64::from(row.verdict.is_permit() && is_outside),
            least_margin: row.margin().unwrap_or(f64::INFINITY),
            most_age_s: row.age_s().unwrap_or(0.0),
            rules: row.rules.map(|permits| RuleCounts::of(permits, is_outside)),
        };
        self.spans.reach(since_s);
        for (_, bucket) in self.spans.between(since_s, since_s) {
            *bucket = bucket.joined(&one);
        }
    }
}
