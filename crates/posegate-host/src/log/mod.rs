//! Reads recordings (estimates and poses as CSV, trajectories in the TUM format, ROS 2 bags). Converts
//! verdicts to readable numbers and computes metrics. [`replay`] runs a recording through the gate.

pub mod corners;
pub mod metrics;
pub mod recording;
pub mod replay;
pub mod tum;

pub use self::covariance::covariance;
pub use self::estimates::{Columns, LogError, Row, clock_ms, clock_ms_of_ns, estimates};

pub use self::track::{Trajectory, TruthLookup};

pub use self::verdict::{coordinates, factor, factor_text};

mod covariance;
mod estimates;
mod mcap;
mod track;
mod verdict;
