//! A quantity over time in a limited number of spans of one length. If the time does not fit, each pair of spans becomes one, so a
//! picture of an hour is not larger than that of a minute.

/// The most spans.
const MOST: usize = 512;
/// The length of a span at first, seconds.
const SHORTEST_S: f64 = 1.0 / 1024.0;

/// What a span has.
pub(super) trait Joined {
    /// The content of a span in which nothing happened.
    const EMPTY: Self;

    /// Returns the content of two spans together.
    fn joined(&self, other: &Self) -> Self;
}

/// The spans, which begin with the first time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spans<T> {
    pub(super) start_s: f64,
    /// The length of each span, seconds; 0 before the first time.
    pub(super) width_s: f64,
    spans: Vec<T>,
    /// The last span with a content.
    last: usize,
}

impl<T> Default for Spans<T> {
    fn default() -> Self {
        Self {
            start_s: 0.0,
            width_s: 0.0,
            spans: Vec::new(),
            last: 0,
        }
    }
}

impl<T: Joined + Clone> Spans<T> {
    /// Returns `true` if there was no time yet.
    pub(super) const fn is_empty(&self) -> bool {
        self.spans.is_empty()
    }

    /// Starts at a time, seconds, if it is the first one.
    pub(super) fn start(&mut self, start_s: f64) {
        if self.is_empty() {
            (self.start_s, self.width_s) = (start_s, SHORTEST_S);
            self.spans = vec![T::EMPTY; MOST];
        }
    }

    /// Returns the spans up to the last one with a content.
    pub(super) fn spans(&self) -> &[T] {
        self.spans.get(..=self.last).unwrap_or(&[])
    }

    /// Makes the spans reach a time, in seconds since the start.
    pub(super) fn reach(&mut self, since_s: f64) {
        while since_s >= self.width_s * MOST as f64 {
            self.halve();
        }
        self.last = self.last.max(self.place(since_s));
    }

    /// Returns the spans from one time to another, both in seconds since the start, with their numbers. The first span has all times
    /// before the start, too.
    pub(super) fn between(
        &mut self,
        from_s: f64,
        to_s: f64,
    ) -> impl Iterator<Item = (usize, &mut T)> {
        let (first, last) = (self.place(from_s), self.place(to_s));
        self.spans.iter_mut().enumerate().take(last + 1).skip(first)
    }

    fn place(&self, since_s: f64) -> usize {
        ((since_s / self.width_s).max(0.0) as usize).min(MOST - 1)
    }

    /// Joins each pair of spans into one.
    fn halve(&mut self) {
        self.width_s *= 2.0;
        self.last /= 2;
        let (pairs, _) = self.spans.as_chunks::<2>();
        let mut joined: Vec<T> = pairs.iter().map(|[a, b]| a.joined(b)).collect();
        joined.resize(MOST, T::EMPTY);
        self.spans = joined;
    }
}
