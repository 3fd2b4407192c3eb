//! Recordings in: estimates and poses as CSV.

pub use self::estimates::{Covariances, LogError, Row, clock_ms, estimates};

mod estimates;
