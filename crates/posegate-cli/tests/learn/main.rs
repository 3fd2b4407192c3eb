//! Learnt models hold on rows that they were not learnt from: bounds for their share of the detections, overall and
//! in every accepted region; inflated sets for their share of the estimates. They are not looser than necessary.

mod assumptions;
mod bounds;
mod by_age;
mod command;
mod dependence;
mod drift;
mod fleets;
mod flips;
mod inflation;
mod law;
mod provenance;
mod recorded;
mod site;
mod survey;

use posegate_host::learn::acceptance;

/// A count of hits in a number of trials.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    trials: u64,
    hits: u64,
}

impl Share {
    fn count(&mut self, hit: bool) {
        self.trials += 1;
        self.hits += u64::from(hit);
    }

    fn value(self) -> f64 {
        self.hits as f64 / self.trials.max(1) as f64
    }

    /// Returns `true` if a share of at least `q` is plausible: the hits are not below the binomial 99 % interval.
    fn holds(self, q: f64) -> bool {
        self.hits >= acceptance(self.trials, q, 0.99)[0]
    }
}
