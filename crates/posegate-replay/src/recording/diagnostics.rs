//! Counts of everything in a recording that is not an estimate.

use std::collections::BTreeMap;

/// The reason why messages of a topic are not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SkipReason {
    /// The topic was not requested.
    NotWanted,
    /// The message type is not supported.
    UnknownSchema,
    /// The type has a known name, but other fields.
    OtherFields,
    /// The messages are not CDR, or their schema is not ROS 2's text.
    UnknownEncoding,
    /// The topic has no schema.
    NoSchema,
    /// The topic is the truth, but its messages are tag detections.
    NoPose,
}

impl SkipReason {
    /// Returns the reason's name, in snake case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotWanted => "not_wanted",
            Self::UnknownSchema => "unknown_schema",
            Self::OtherFields => "other_fields",
            Self::UnknownEncoding => "unknown_encoding",
            Self::NoSchema => "no_schema",
            Self::NoPose => "no_pose",
        }
    }
}

/// A topic that is not read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Skipped {
    /// The message's type.
    pub schema: String,
    /// The encodings of schema and messages.
    pub encoding: String,
    /// The reason.
    pub why: SkipReason,
    /// The number of messages.
    pub messages: u64,
}

/// Counts of everything in a recording that is not an estimate.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReaderDiagnostics {
    /// Topics that are not read, by name.
    pub skipped: BTreeMap<String, Skipped>,
    /// Number of messages of the topics that are read, by name.
    pub read: BTreeMap<String, u64>,
    /// Number of transforms between two frames, parent and child, on the topics of transforms that are read.
    pub transforms: BTreeMap<(String, String), u64>,
    /// Child frames of the poses that are read, in the order of the recording, at most 32.
    pub child_frames: Vec<String>,
    /// Number of messages of requested topics that could not be decoded.
    pub undecodable: u64,
    /// The first message that could not be decoded: its description. `None` if every message was decoded.
    pub first_undecodable: Option<String>,
    /// Bytes of all messages, uncompressed.
    pub message_bytes: u64,
    /// Chunks that were left out completely: their checksum, a length or a record is wrong, they are too large, or
    /// they are missing although the index names them.
    pub bad_chunks: u64,
    /// Schemas, channels and messages that were left out: too long, or with a wrong length in them.
    pub bad_records: u64,
    /// Where and how a bag is damaged: the place where reading stopped, else the first part that was left out. All
    /// undamaged parts were read. `None` if there is no damage.
    pub damage: Option<String>,
    /// `true` if a bag has an index; `None` for other files, and for bags that end before it.
    pub indexed: Option<bool>,
}

/// The most child frames that are named.
const MOST_CHILDREN: usize = 32;

impl ReaderDiagnostics {
    /// Records the child frame of a pose.
    pub(super) fn note_child(&mut self, child: &str) {
        let children = &mut self.child_frames;
        if children.len() < MOST_CHILDREN && !children.iter().any(|known| known == child) {
            children.push(child.to_owned());
        }
    }
}
