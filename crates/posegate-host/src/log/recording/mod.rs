//! Recordings, one estimate after the other: CSV, TUM and MCAP (ROS 2), read as streams.
//!
//! Nothing is dropped in silence. What can be a report is handed on, however impossible its numbers are: the gate
//! denies it with its reason, and [`Findings`] counts it. What cannot (another type, bytes that are no message)
//! is counted here by topic ([`ReaderDiagnostics`]).

pub use self::bag::{Bag, Role, Wanted};
pub use self::findings::Findings;
pub use self::kind::{Format, format_of};
pub use self::looks::TagLocalizer;
pub use self::message::{Detection, Kind};
pub use self::text::Text;
pub use self::told::{ReaderDiagnostics, SkipReason, Skipped};

mod bag;
mod cdr;
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
use posegate::report::PoseEstimate;
use std::sync::Arc;

/// An estimate as it was recorded. As it came: any bits.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Which of the wanted topics; 0 for files without topics.
    pub source: u8,
    /// When it was made, seconds.
    pub t_s: f64,
    /// When it was recorded, or used (`now_s`), seconds; `None` where the file does not tell.
    pub logged_s: Option<f64>,
    /// Both in nanoseconds, where the file has them as such: since 1970 a float's steps are 0.2 microseconds, and equal
    /// times must not differ by a millisecond.
    pub exact_ns: Option<Exact>,
    /// The frame of its numbers; `None` where files have none: the world's.
    pub frame: Option<Arc<str>>,
    /// Height, metres: no part of the estimate, but a number where a message has one.
    pub z_m: f64,
    /// What it says.
    pub belief: PoseEstimate,
    /// The true pose (m, m, rad), where it stands in the same row.
    pub truth: Option<[f64; 3]>,
}

/// Times in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exact {
    /// When the estimate was made.
    pub stamp: i64,
    /// When it was recorded.
    pub logged: i64,
}

impl Exact {
    /// A time in seconds.
    #[must_use]
    pub fn seconds(nanoseconds: i64) -> f64 {
        let whole = nanoseconds.div_euclid(1_000_000_000);
        whole as f64 + nanoseconds.rem_euclid(1_000_000_000) as f64 * 1e-9
    }

    /// How old the estimate was when it was recorded, seconds.
    #[must_use]
    pub fn age_s(&self) -> f64 {
        Self::seconds(self.logged.saturating_sub(self.stamp))
    }
}

/// A true pose as it was recorded. As it came: any bits.
#[derive(Clone, Debug)]
pub struct TruePose {
    /// Seconds.
    pub t_s: f64,
    /// The frame of its numbers.
    pub frame: Arc<str>,
    /// Metres.
    pub position: [f64; 3],
    /// The quaternion x, y, z, w.
    pub orientation: [f64; 4],
}

/// What comes next in a recording.
#[derive(Clone, Debug)]
pub enum Item {
    /// An estimate.
    Estimate(Sample),
    /// A true pose, of a topic that was named as the truth.
    Truth(TruePose),
    /// A look at tags: to be made an estimate by who knows the cameras.
    Detections {
        /// Which of the wanted topics.
        source: u8,
        /// When the image was taken, seconds.
        t_s: f64,
        /// When that was, and when it was recorded, nanoseconds.
        exact_ns: Option<Exact>,
        /// The camera's frame.
        frame: Arc<str>,
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
    /// The next item; `None` at the end, or where a bag breaks ([`ReaderDiagnostics::damage`]).
    ///
    /// # Errors
    /// [`RecordingError`]: the file is none, or cannot be read.
    fn next(&mut self) -> Result<Option<Item>, RecordingError>;

    /// What was met beside the items.
    fn told(&self) -> &ReaderDiagnostics;

    /// Bytes of the file that were read.
    fn bytes(&self) -> u64;
}
