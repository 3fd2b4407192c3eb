//! The state of a gate.

use super::Reason;

/// The state of a gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum State {
    /// Closed: the last report was denied, or there was no report yet.
    Inhibited(Reason),
    /// Closed: this number of consecutive reports have permitted. More must permit, or the hold time is not over.
    Qualifying(u16),
    /// Open.
    Permitted,
    /// Closed until [`Gate::reset`](super::Gate::reset).
    Latched(Reason),
}

impl State {
    /// Returns the state's name in snake case, as JSON lines write it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Inhibited(_) => "inhibited",
            Self::Qualifying(_) => "qualifying",
            Self::Permitted => "permitted",
            Self::Latched(_) => "latched",
        }
    }
}
