//! What a reader met beside estimates.

use std::collections::BTreeMap;

/// Why messages of a topic are not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SkipReason {
    /// Nobody asked for the topic.
    NotWanted,
    /// The message's type is none that is known.
    UnknownSchema,
    /// The type has a known name, and fields that are not those.
    OtherFields,
    /// The messages are not CDR, or their schema is not ROS 2's text.
    UnknownEncoding,
    /// The topic has no schema.
    NoSchema,
    /// A topic for the truth whose messages tell of tags.
    NoPose,
}

impl SkipReason {
    /// Its name, in snake case.
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
    /// How schema and messages are written.
    pub encoding: String,
    /// Why.
    pub why: SkipReason,
    /// How many messages.
    pub messages: u64,
}

/// What a reader met beside estimates.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReaderDiagnostics {
    /// Topics that are not read, by name.
    pub skipped: BTreeMap<String, Skipped>,
    /// Topics that are read, by name: messages.
    pub read: BTreeMap<String, u64>,
    /// Messages of wanted topics whose bytes are no message of their type.
    pub undecodable: u64,
    /// What the first of them was.
    pub first_undecodable: Option<String>,
    /// Bytes of all messages, uncompressed.
    pub message_bytes: u64,
    /// Chunks that were left out, whole: their checksum, a length or a record is wrong, they are too large, or they
    /// are not there although the index names them.
    pub bad_chunks: u64,
    /// Schemas, channels and messages that were left out: a length in them is wrong, or they are too long.
    pub bad_records: u64,
    /// Where and how a bag broke: its end, else what was left out first. What is whole was read.
    pub damage: Option<String>,
    /// Whether a bag has an index; `None` for other files, and for bags that end before it.
    pub indexed: Option<bool>,
}
