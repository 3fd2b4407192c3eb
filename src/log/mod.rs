//! Recordings in: estimates and poses as CSV, trajectories in the TUM format; verdicts out, in the numbers that
//! people read, and metrics.

pub mod metrics;
pub mod tum;

pub use self::covariance::covariance;
pub use self::estimates::{Columns, LogError, Row, clock_ms, estimates};

pub use self::verdict::{coordinates, factor, factor_text};

mod covariance;
mod estimates;
mod verdict;
