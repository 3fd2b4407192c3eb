//! The accuracy of the integral over a pose-set, and the work that it may take.

use super::quadrature::Sum;
use core::cell::Cell;

/// The accuracy to reach.
#[derive(Clone, Copy, Debug)]
pub(super) struct AccuracyTarget<'a> {
    /// Relative error of the integral.
    pub accuracy: f64,
    pub miss: MissCost,
    /// Least number of parts of a disc, if a body in it needs more than usual.
    pub looks: u32,
    pub work: &'a Work,
}

/// The cost of misses.
#[derive(Clone, Copy, Debug)]
pub(super) struct MissCost {
    /// Cost of one miss.
    pub c_high: f64,
    /// Cost of the misses that are certain, in addition to the integral.
    pub sure: f64,
}

/// The number of views whose cost was evaluated, and the current limit.
#[derive(Debug)]
pub(super) struct Work {
    pub asked: Cell<u64>,
    pub most: Cell<u64>,
}

impl AccuracyTarget<'_> {
    /// Returns the allowed errors, given the sums so far. Each is half of the integral's error; outside of a search,
    /// the mass outside also has a relative error of at most ten times the accuracy. So the mass outside is useful even
    /// if its part of the integral is small.
    pub(super) fn allowed(&self, sum: &Sum) -> [f64; 2] {
        if self.work.asked.get() >= self.work.most.get() {
            return [f64::INFINITY; 2];
        }
        let [seen, outside] = sum.both().map(|part| part.value);
        let MissCost { c_high, sure } = self.miss;
        let half = 0.5 * self.accuracy * (seen + c_high * outside + sure);
        let own = if self.is_rough() {
            f64::INFINITY
        } else {
            10.0 * self.accuracy * outside
        };
        let shared = if c_high > 0.0 { half / c_high } else { own };
        // Smaller errors are rounding.
        [half.max(1e-14 * seen), own.min(shared).max(1e-15)]
    }

    /// Returns `true` for a search: the mass outside matters only as a part of the integral.
    fn is_rough(&self) -> bool {
        self.accuracy > 3e-5
    }

    /// Returns the number of equal parts to start with.
    pub(super) fn parts(&self, rough: u32, fine: u32) -> u32 {
        let parts = if self.is_rough() { rough } else { fine };
        parts.max(self.looks)
    }
}
