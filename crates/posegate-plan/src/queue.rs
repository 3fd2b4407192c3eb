//! The order in which a search takes labels from its queue.

use std::cmp;

/// A queue entry, ordered by the smallest bound first.
#[derive(PartialEq)]
pub(super) struct Queued {
    pub bound: f64,
    pub label: usize,
    pub done: bool,
}

impl Eq for Queued {}

impl Ord for Queued {
    fn cmp(&self, other: &Self) -> cmp::Ordering {
        // The heap pops the greatest entry: the smallest bound, then a finished plan, then the oldest label.
        other
            .bound
            .total_cmp(&self.bound)
            .then(self.done.cmp(&other.done))
            .then(other.label.cmp(&self.label))
    }
}

impl PartialOrd for Queued {
    fn partial_cmp(&self, other: &Self) -> Option<cmp::Ordering> {
        Some(self.cmp(other))
    }
}
