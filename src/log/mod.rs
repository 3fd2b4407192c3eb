//! Recordings in: estimates and poses as CSV; verdicts out, in the numbers that people read.

pub use self::covariance::covariance;
pub use self::estimates::{Columns, LogError, Row, clock_ms, estimates};

pub use self::verdict::{coordinates, factor, factor_text};

mod covariance;
mod estimates;
mod verdict;
