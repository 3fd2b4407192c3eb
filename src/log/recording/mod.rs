//! Recordings, one estimate after the other: CSV, TUM and MCAP (ROS 2), read as streams.
//!
//! Nothing is dropped in silence. What can be a report is handed on, however impossible its numbers are: the gate
//! denies it with its reason, and [`Findings`] counts it. What cannot (another type, bytes that are no message)
//! is counted here by topic ([`Told`]).

pub use self::bag::{Bag, Role, Wanted};
pub use self::findings::Findings;
pub use self::kind::{Format, format_of};
pub use self::looks::Looks;
pub use self::message::{Detection, Kind};
pub use self::text::Text;
pub use self::told::{Skipped, Told, Why};

mod bag;
mod findings;
mod kind;
mod layout;
mod looks;
mod message;
mod text;
mod told;

pub(crate) use self::bag::yaw_of;

use super::LogError;
use super::tum::TumError;
use crate::report::Belief;
use std::string::String;
use std::sync::Arc;
use std::vec::Vec;

/// An estimate as it was recorded. As it came: any bits.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Which of the wanted topics; 0 for files without topics.
    pub source: u8,
    /// When it was made, seconds.
    pub t_s: f64,
    /// When it was recorded, or used (`now_s`), seconds; `None` where the file does not tell.
    pub logged_s: Option<f64>,
    /// The frame of its numbers; `None` where files have none: the world's.
    pub frame: Option<Arc<str>>,
    /// What it says.
    pub belief: Belief,
    /// The true pose (m, m, rad), where it stands in the same row.
    pub truth: Option<[f64; 3]>,
}

/// What comes next in a recording.
#[derive(Clone, Debug)]
pub enum Item {
    /// An estimate.
    Estimate(Sample),
    /// A true pose (m, m, rad), of a topic that was named as the truth.
    Truth {
        /// Seconds.
        t_s: f64,
        /// x, y, yaw.
        pose: [f64; 3],
    },
    /// A look at tags: to be made an estimate by who knows the cameras.
    Detections {
        /// Which of the wanted topics.
        source: u8,
        /// When the image was taken, seconds.
        t_s: f64,
        /// When it was recorded, seconds.
        logged_s: Option<f64>,
        /// What was found in it.
        found: Vec<Detection>,
    },
}

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A CSV.
    #[error(transparent)]
    Csv(#[from] LogError),
    /// A trajectory.
    #[error(transparent)]
    Tum(#[from] TumError),
    /// The bytes cannot be read.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: String,
        /// Why.
        source: std::io::Error,
    },
}

/// A source of [`Item`]s.
pub trait Recording {
    /// The next item; `None` at the end, or where a bag breaks ([`Told::damage`]).
    ///
    /// # Errors
    /// [`RecordingError`]: the file is none, or cannot be read.
    fn next(&mut self) -> Result<Option<Item>, RecordingError>;

    /// What was met beside the items.
    fn told(&self) -> &Told;

    /// Bytes of the file that were read.
    fn bytes(&self) -> u64;
}
