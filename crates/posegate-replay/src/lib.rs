//! Reads recordings (estimates and poses as CSV, trajectories in the TUM format, ROS 2 bags). Converts
//! verdicts to readable numbers and computes metrics. [`replay`] runs a recording through the gate.
//!
//! ```
//! use posegate_replay::{Columns, estimates};
//!
//! let csv = "t_s,x_m,y_m,yaw_rad,true_x_m,true_y_m,true_yaw_rad\n0.5,1.0,0.0,0.1,1.02,0.0,0.1\n";
//! let rows = estimates(csv.as_bytes(), "run.csv", Columns::TimedPoses)?;
//! assert_eq!((rows[0].t_s, rows[0].truth), (Some(0.5), Some([1.02, 0.0, 0.1])));
//!
//! // An error states file, line and column.
//! let error = estimates("x_m,y_m,yaw_rad\n1,2,east\n".as_bytes(), "run.csv", Columns::Poses).unwrap_err();
//! assert!(error.to_string().starts_with("run.csv:2:3: `east`"));
//! # Ok::<(), posegate_replay::LogError>(())
//! ```
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod corners;
pub mod detector;
pub mod metrics;
pub mod recording;
pub mod replay;
pub mod tables;
pub mod trajectories;
pub mod tum;

pub use self::covariance::covariance;
pub use self::estimates::{Columns, LogError, Row, clock_ms, estimates};
pub use self::known_tags::{AlikeTags, KnownTags};
pub use posegate_files::sheet::{SheetError, SheetFault};

pub use self::hypotheses::{MOST_HYPOTHESES, reports};

use self::estimates::clock_ms_of_ns;

pub use self::track::{Trajectory, TruthLookup};

pub use self::verdict::{coordinates, factor, factor_text, remembers};

mod covariance;
mod estimates;
mod hypotheses;
mod known_tags;
mod mcap;
mod track;
mod verdict;
