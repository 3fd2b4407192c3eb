//! Recordings, read one estimate at a time: CSV, trajectories, and bags of ROS 2 (MCAP, SQLite) and ROS 1, as streams.
//!
//! Nothing is dropped silently. Every message that can be a report is passed on, even with impossible numbers: the gate
//! denies it with a reason, and [`Findings`] counts it. Every other message (another type, or undecodable bytes) is
//! counted by topic in [`ReaderDiagnostics`].
//!
//! ```
//! use posegate_replay::recording::{Item, Recording, Text};
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
//! # Ok::<(), posegate_replay::recording::RecordingError>(())
//! ```

pub use self::body::BodyFrames;
pub use self::diagnostics::{ReaderDiagnostics, SkipReason, Skipped};
pub use self::findings::Findings;
pub use self::folder::{BAD_FOLDER, files_of, is_folder};
pub use self::intake::{Role, Wanted};
pub use self::kind::{Format, format_of};
pub use self::live::{LivePose, LivePoses, LiveTransform};
pub use self::looks::TagLocalizer;
pub use self::message::{Detection, Kind};
pub use self::storage::{Bag, BagFile};
pub use self::text::Text;
pub use self::transforms::FrameNames;

mod body;
mod cdr;
mod diagnostics;
mod findings;
mod folder;
mod intake;
mod kind;
mod layout;
mod live;
mod looks;
mod mcap_file;
mod message;
mod ros1_file;
mod sqlite_file;
mod storage;
mod text;
mod transforms;
mod whole;

pub(crate) use self::body::of_base;
pub(crate) use self::intake::yaw_of;

use super::LogError;
use super::tum::TumError;
use posegate::gate::Reason;
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
    /// How far the frame of the recorded pose is from the robot's vertical axis, metres. The pose and its covariance are those of the
    /// base; what the covariance's derivative leaves out grows with this lever.
    pub lever_m: f64,
    /// A second pose that fits a detection as well; the robot is at one of the two.
    pub other: Option<Box<PoseEstimate>>,
    /// `true` if poses that are far apart fit a detection: two poses, or all poses between them.
    pub is_ambiguous: bool,
    /// The reason why a detection gives no pose; the estimate's numbers are NaN then.
    pub fault: Option<Reason>,
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
    /// A pose is that of a frame with an unknown place on the robot.
    #[error(
        "the topic {topic} has poses of the frame `{child}`, and its place on the robot is not known"
    )]
    ChildFrame {
        /// The topic.
        topic: String,
        /// The child frame that a message names.
        child: String,
        /// The frames with a known place.
        known: String,
    },
    /// The file is not a bag of the format that its first bytes say.
    #[error("{file}: {why}")]
    NotABag {
        /// The file.
        file: String,
        /// The fault.
        why: String,
    },
    /// A covariance without all its terms is that of a frame beside the robot's base.
    #[error(
        "the topic {topic} has poses of the frame `{child}`, and covariances without cross terms: that of the base does not follow"
    )]
    PartialCovariance {
        /// The topic.
        topic: String,
        /// The child frame that a message names.
        child: String,
    },
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
