//! Recordings, read one estimate at a time: CSV, TUM and MCAP (ROS 2), as streams.
//!
//! Nothing is dropped silently. Every message that can be a report is passed on, even with impossible numbers: the gate
//! denies it with a reason, and [`Findings`] counts it. Every other message (another type, or undecodable bytes) is
//! counted by topic in [`ReaderDiagnostics`].
//!
//! ```
//! use posegate_host::log::recording::{Item, Recording, Text};
//!
//! let trajectory = "12.5 1 2 0 0 0 0 1\n12.6 1.1 2 0 0 0 0 1\n";
//! let mut recording = Text::tum(trajectory.as_bytes(), "run.txt");
//! let mut times = Vec::new();
//! while let Some(item) = recording.next()? {
//!     if let Item::Estimate(sample) = item {
//!         // A trajectory has no covariance: a gate denies it, unless a bounded set is given.
//!         assert!(sample.belief.spread.is_none());
//!         times.push(sample.t_s);
//!     }
//! }
//! assert_eq!(times, [12.5, 12.6]);
//! # Ok::<(), posegate_host::log::recording::RecordingError>(())
//! ```

pub use self::bag::{Bag, Role, Wanted};
pub use self::diagnostics::{ReaderDiagnostics, SkipReason, Skipped};
pub use self::findings::Findings;
pub use self::kind::{Format, format_of};
pub use self::looks::TagLocalizer;
pub use self::message::{Detection, Kind};
pub use self::text::Text;
pub use self::transforms::FrameNames;

mod bag;
mod cdr;
mod diagnostics;
mod findings;
mod kind;
mod layout;
mod looks;
mod message;
mod text;
mod transforms;

pub(crate) use self::bag::yaw_of;

use super::LogError;
use super::tum::TumError;
use posegate::report::PoseEstimate;
use std::sync::Arc;

/// An estimate as recorded. Its numbers are unchecked: any bits.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Index of the wanted topic; 0 for files without topics.
    pub source: u8,
    /// Time of the estimate, seconds.
    pub t_s: f64,
    /// Time at which the estimate was recorded or used (`now_s`), seconds; `None` if the file does not contain it.
    pub logged_s: Option<f64>,
    /// Both times in nanoseconds, if the file has integers. An `f64` of seconds since 1970 has steps of 0.2
    /// microseconds, so equal times could differ by a millisecond after rounding.
    pub exact_ns: Option<Exact>,
    /// The frame of the estimate; `None` means the world frame, for files without frames.
    pub frame: Option<Arc<str>>,
    /// Height in the frame of the estimate, metres. Not part of the estimate, but messages have it.
    pub z_m: f64,
    /// The estimate's pose and uncertainty.
    pub belief: PoseEstimate,
    /// The true pose in the world (m, m, rad), if it is in the same row.
    pub truth: Option<[f64; 3]>,
    /// The time since the last fix of the source, milliseconds, rounded up; `None` if it is not known.
    pub since_fix_ms: Option<u32>,
}

/// Times in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exact {
    /// Time of the estimate.
    pub stamp: i64,
    /// Time at which the estimate was recorded.
    pub logged: i64,
}

impl Exact {
    /// Converts a time to seconds.
    #[must_use]
    pub fn seconds(nanoseconds: i64) -> f64 {
        let whole = nanoseconds.div_euclid(1_000_000_000);
        whole as f64 + nanoseconds.rem_euclid(1_000_000_000) as f64 * 1e-9
    }

    /// Returns the age of the estimate when it was recorded, seconds.
    #[must_use]
    pub fn age_s(&self) -> f64 {
        Self::seconds(self.logged.saturating_sub(self.stamp))
    }
}

/// A true pose as recorded. Its numbers are unchecked: any bits.
#[derive(Clone, Debug)]
pub struct TruePose {
    /// Time of the pose, seconds.
    pub t_s: f64,
    /// The frame of the pose.
    pub frame: Arc<str>,
    /// x, y, z in `frame`, metres.
    pub position: [f64; 3],
    /// The orientation in `frame`: a quaternion x, y, z, w.
    pub orientation: [f64; 4],
}

impl TruePose {
    /// Returns the pose on the floor: x, y (m) and yaw (rad). Unchecked.
    #[must_use]
    pub fn level(&self) -> [f64; 3] {
        let [x, y, _] = self.position;
        [x, y, yaw_of(self.orientation)]
    }
}

/// The next item of a recording.
#[derive(Clone, Debug)]
pub enum Item {
    /// An estimate.
    Estimate(Sample),
    /// A true pose, from the topic that was named as the truth, or a pose of the odometry in its own frame.
    Truth(TruePose),
    /// An observation of tags. The caller turns it into an estimate ([`TagLocalizer`]).
    Detections {
        /// Index of the wanted topic.
        source: u8,
        /// Time of the image, seconds.
        t_s: f64,
        /// Time of the image, and time at which it was recorded, nanoseconds.
        exact_ns: Option<Exact>,
        /// The camera's frame.
        frame: Arc<str>,
        /// The detected tags.
        found: Vec<Detection>,
    },
}

/// The reason why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A fault in a CSV file.
    #[error(transparent)]
    Csv(#[from] LogError),
    /// A fault in a trajectory.
    #[error(transparent)]
    Tum(#[from] TumError),
    /// The bytes cannot be read.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: String,
        /// The cause.
        source: std::io::Error,
    },
}

/// A source of [`Item`]s.
pub trait Recording {
    /// Returns the next item; `None` at the end, or at a damaged place of a bag ([`ReaderDiagnostics::damage`]).
    ///
    /// # Errors
    /// [`RecordingError`]: the file is not a recording, or cannot be read.
    fn next(&mut self) -> Result<Option<Item>, RecordingError>;

    /// Returns the counts of all messages that are not items.
    fn diagnostics(&self) -> &ReaderDiagnostics;

    /// Returns the number of bytes that were read from the file.
    fn bytes(&self) -> u64;
}
