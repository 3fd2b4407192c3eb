//! Costs to go that searches of one problem share.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// The costs to go of one problem, by the look that is not allowed: many searches need the same ones.
#[derive(Debug, Default)]
pub(super) struct Horizons {
    known: Mutex<BTreeMap<Option<usize>, Arc<Vec<f64>>>>,
}

impl Horizons {
    /// Returns the costs to go without a look; computes them at most once.
    pub fn of(&self, banned: Option<usize>, make: impl FnOnce() -> Vec<f64>) -> Arc<Vec<f64>> {
        let Ok(mut known) = self.known.lock() else {
            return Arc::new(make());
        };
        known
            .entry(banned)
            .or_insert_with(|| Arc::new(make()))
            .clone()
    }
}
