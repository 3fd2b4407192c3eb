//! A request to end searches early.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Ends searches if a flag is set, or at a time. A search that it ends reports that its limit was reached. The
/// default signal never ends a search.
#[derive(Clone, Debug, Default)]
pub struct StopSignal {
    flag: Option<Arc<AtomicBool>>,
    until: Option<Instant>,
}

impl StopSignal {
    /// Creates a signal that is set if the flag is set, or from a time on.
    #[must_use]
    pub const fn new(flag: Arc<AtomicBool>, until: Option<Instant>) -> Self {
        Self {
            flag: Some(flag),
            until,
        }
    }

    /// Returns `true` if searches should end.
    #[must_use]
    pub fn is_set(&self) -> bool {
        let flag = self.flag.as_ref();
        flag.is_some_and(|flag| flag.load(Ordering::Relaxed))
            || self.until.is_some_and(|until| Instant::now() >= until)
    }
}
