//! ROS 2 bags in MCAP, read from start to end. No index is needed, and memory does not grow with the file.

use super::diagnostics::{ReaderDiagnostics, SkipReason, Skipped};
use super::message::{Content, Kind, Message, decoded};
use super::transforms::{Composer, FrameNames, Pose, Transform};
use super::{Exact, Item, Recording, RecordingError, Sample, TruePose};
use crate::log::mcap::chunk::{self, Budget, LARGEST};
use crate::log::mcap::records::{self, BadRecord};
use crate::log::mcap::{HEAD, MAGIC, op};
use posegate::report::{Heading, PoseEstimate, ros::PoseWithCovariance};
use posegate::set::Uncertainty;
use std::collections::BTreeMap;
use std::io::Read;
use std::sync::Arc;

/// The longest record of a schema or a channel that is read, bytes. Message definitions have some ten
/// thousand.
const LONGEST_NAMED: usize = 1 << 20;
/// The most bytes of schemas and channels that are stored.
const MOST_NAMED: usize = 1 << 25;
/// The longest record that is skipped, bytes: reading an endless input must stop.
const FARTHEST: u64 = 1 << 34;
/// The most pairs of frames of transforms that are counted by name.
const MOST_EDGES: usize = 64;
/// The length of a footer record, bytes.
const FOOTER: u64 = 20;

/// The role of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Estimates, from the source with this number.
    Estimates(u8),
    /// The true poses.
    Truth,
    /// The odometry: poses in its own frame, passed on as [`Item::Truth`].
    Odometry,
}

/// A topic to read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// The topic's name.
    pub topic: String,
    /// The topic's role.
    pub role: Role,
}

/// The use of a channel's messages.
enum Use {
    Read { kind: Kind, role: Role },
    Skip,
}

struct Channel {
    topic: String,
    used: Use,
}

struct Schema {
    name: String,
    encoding: String,
    definition: String,
    /// `true` if the type has the fields of a supported type. Checked at its first topic only, since it
    /// takes time.
    has_fields: Option<bool>,
}

/// A reader of a bag.
pub struct Bag<R> {
    input: R,
    file: String,
    notes: Notes,
    budget: Budget,
    /// The current record.
    body: Vec<u8>,
    /// The records of the current chunk, and the number of their bytes that were consumed.
    records: Vec<u8>,
    taken: usize,
    bytes: u64,
    chunks: u64,
    indices: u64,
    stage: Stage,
}

/// The progress of reading a bag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Start,
    Records,
    /// After the footer.
    Complete,
    Broken,
}

/// The reason why reading stops.
enum Stop {
    Broken(String),
    Io(std::io::Error),
}

impl<R: Read> Bag<R> {
    /// Returns a reader of these bytes; `file` names them in errors.
    pub fn new(input: R, file: &str, wanted: &[Wanted]) -> Self {
        Self {
            input,
            file: file.into(),
            notes: Notes {
                wanted: wanted.to_vec(),
                schemas: BTreeMap::new(),
                channels: BTreeMap::new(),
                kept: 0,
                frame: None,
                composers: BTreeMap::new(),
                names: FrameNames::default(),
                diagnostics: ReaderDiagnostics::default(),
            },
            budget: Budget::new(),
            body: Vec::new(),
            records: Vec::new(),
            taken: 0,
            bytes: 0,
            chunks: 0,
            indices: 0,
            stage: Stage::Start,
        }
    }

    /// Names the frames of which poses are composed where a topic has transforms (`/tf`).
    #[must_use]
    pub fn with_frames(mut self, names: FrameNames) -> Self {
        self.notes.names = names;
        self
    }

    /// Reports something that was left out. Only the first report keeps its place and reason.
    fn left_out(&mut self, what: &str, why: &str) {
        if self.notes.diagnostics.damage.is_none() {
            let bytes = self.bytes;
            self.notes.diagnostics.damage = Some(format!(
                "after {bytes} bytes: {why}; the {what} is left out"
            ));
        }
    }

    fn chunk_left_out(&mut self, why: &str) {
        self.notes.diagnostics.bad_chunks += 1;
        self.left_out("chunk", why);
    }

    fn record_left_out(&mut self, why: &str) {
        self.notes.diagnostics.bad_records += 1;
        self.left_out("record", why);
    }

    /// Stops at a damaged place. All items before it remain valid.
    fn broken(&mut self, why: &str) {
        self.stage = Stage::Broken;
        self.notes.diagnostics.damage = Some(format!("after {} bytes: {why}", self.bytes));
    }

    /// Reads `length` bytes into [`Self::body`], or as many as exist. Memory is reserved only for existing bytes.
    fn read(&mut self, length: usize, what: &str) -> Result<(), Stop> {
        self.body.clear();
        let count = (&mut self.input)
            .take(length as u64)
            .read_to_end(&mut self.body);
        self.bytes += self.body.len() as u64;
        match count {
            Ok(count) if count == length => Ok(()),
            Ok(_) => Err(Stop::Broken(format!("the file ends {what}"))),
            Err(error) => Err(Stop::Io(error)),
        }
    }

    /// Skips the body of a record.
    fn pass_over(&mut self, length: u64) -> Result<(), Stop> {
        if length > FARTHEST {
            return Err(Stop::Broken(format!("a record of {length} bytes")));
        }
        let count = std::io::copy(&mut (&mut self.input).take(length), &mut std::io::sink());
        let count = count.map_err(Stop::Io)?;
        self.bytes += count;
        if count == length {
            Ok(())
        } else {
            Err(Stop::Broken("the file ends within a record".into()))
        }
    }

    /// Reads up to the end of a record. Returns its item, if it yields one immediately.
    fn step(&mut self) -> Result<Option<Item>, Stop> {
        if self.stage == Stage::Start {
            self.read(MAGIC.len(), "before the first bytes of MCAP")?;
            if self.body != MAGIC {
                return Err(Stop::Broken("its first bytes are not those of MCAP".into()));
            }
            self.stage = Stage::Records;
        }
        self.read(HEAD, "before its footer")?;
        let (opcode, length) = match *self.body {
            [opcode, ref length @ ..] => (opcode, length.try_into().map_or(0, u64::from_le_bytes)),
            [] => return Err(Stop::Broken("a record without a head".into())),
        };
        let longest = match opcode {
            op::SCHEMA | op::CHANNEL => LONGEST_NAMED,
            op::MESSAGE | op::CHUNK => LARGEST,
            op::CHUNK_INDEX => {
                self.indices += 1;
                0
            }
            op::FOOTER => return self.footer(length).map(|()| None),
            0 => {
                return Err(Stop::Broken(
                    "a record of the kind 0, which does not exist".into(),
                ));
            }
            _ => 0,
        };
        self.chunks += u64::from(opcode == op::CHUNK);
        let Some(fits) = usize::try_from(length)
            .ok()
            .filter(|length| *length <= longest)
        else {
            self.pass_over(length)?;
            let why = format!("{length} bytes; at most {longest} bytes are read");
            match opcode {
                op::CHUNK => self.chunk_left_out(&why),
                _ if longest > 0 => self.record_left_out(&why),
                // Attachments, metadata and indexes are not needed here.
                _ => {}
            }
            return Ok(None);
        };
        self.read(fits, "within a record")?;
        if opcode == op::CHUNK {
            match chunk::records(&self.body, &mut self.budget) {
                Ok(records) => (self.records, self.taken) = (records, 0),
                Err(why) => self.chunk_left_out(&why.to_string()),
            }
            return Ok(None);
        }
        match self.notes.take(opcode, &self.body) {
            Ok(item) => Ok(item),
            Err(why) => {
                self.record_left_out(&why.to_string());
                Ok(None)
            }
        }
    }

    /// Reads the footer and the end of the file.
    fn footer(&mut self, length: u64) -> Result<(), Stop> {
        if length != FOOTER {
            return Err(Stop::Broken(format!("a footer of {length} bytes")));
        }
        self.pass_over(length)?;
        self.read(MAGIC.len(), "after its footer")?;
        if self.body != MAGIC {
            return Err(Stop::Broken("its last bytes are not those of MCAP".into()));
        }
        self.stage = Stage::Complete;
        let diagnostics = &mut self.notes.diagnostics;
        diagnostics.indexed = Some(self.indices > 0);
        if let Some(lost) = self
            .indices
            .checked_sub(self.chunks)
            .filter(|lost| *lost > 0)
        {
            diagnostics.bad_chunks += lost;
            diagnostics.damage.get_or_insert_with(|| {
                format!("somewhere: {lost} chunks that its index names are missing")
            });
        }
        Ok(())
    }
}

impl<R: Read> Recording for Bag<R> {
    fn next(&mut self) -> Result<Option<Item>, RecordingError> {
        loop {
            while let Some((opcode, data, rest)) =
                chunk::next(self.records.get(self.taken..).unwrap_or_default())
            {
                self.taken = self.records.len() - rest.len();
                // The chunk's records were checked when it was read. An error now means that a limit is
                // exceeded.
                match self.notes.take(opcode, data) {
                    Ok(Some(item)) => return Ok(Some(item)),
                    Ok(None) => {}
                    Err(why) => self.record_left_out(&why.to_string()),
                }
            }
            if matches!(self.stage, Stage::Complete | Stage::Broken) {
                return Ok(None);
            }
            match self.step() {
                Ok(Some(item)) => return Ok(Some(item)),
                Ok(None) => {}
                Err(Stop::Broken(why)) => self.broken(&why),
                Err(Stop::Io(source)) => {
                    return Err(RecordingError::Io {
                        file: self.file.clone(),
                        source,
                    });
                }
            }
        }
    }

    fn diagnostics(&self) -> &ReaderDiagnostics {
        &self.notes.diagnostics
    }

    fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// The state while records are read.
struct Notes {
    wanted: Vec<Wanted>,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    /// Bytes of the schemas and channels that are stored.
    kept: usize,
    frame: Option<Arc<str>>,
    /// The transforms of each channel that has them.
    composers: BTreeMap<u16, Composer>,
    names: FrameNames,
    diagnostics: ReaderDiagnostics,
}

/// The reason why a record of a schema, a channel or a message is left out.
#[derive(Debug, thiserror::Error)]
enum NotTaken {
    #[error(transparent)]
    Record(#[from] BadRecord),
    #[error("schemas and topics of more than {MOST_NAMED} bytes in all")]
    TooMuch,
}

impl Notes {
    /// Processes a record.
    fn take(&mut self, opcode: u8, data: &[u8]) -> Result<Option<Item>, NotTaken> {
        match opcode {
            op::SCHEMA => {
                let record = records::schema(data)?;
                if !self.schemas.contains_key(&record.id) {
                    self.keep(data)?;
                    let schema = Schema {
                        name: record.name.into(),
                        encoding: record.encoding.into(),
                        definition: String::from_utf8_lossy(record.definition).into_owned(),
                        has_fields: None,
                    };
                    self.schemas.insert(record.id, schema);
                }
            }
            op::CHANNEL => {
                let channel = records::channel(data)?;
                if !self.channels.contains_key(&channel.id) {
                    self.keep(data)?;
                    self.open(&channel);
                }
            }
            op::MESSAGE => {
                let message = records::message(data)?;
                self.diagnostics.message_bytes += message.data.len() as u64;
                return Ok(self.message(message.channel_id, message.logged_ns, message.data));
            }
            _ => {}
        }
        Ok(None)
    }

    /// Counts the text of a record that will be stored, if the limit allows.
    fn keep(&mut self, data: &[u8]) -> Result<(), NotTaken> {
        let kept = self.kept + data.len();
        if kept > MOST_NAMED {
            return Err(NotTaken::TooMuch);
        }
        self.kept = kept;
        Ok(())
    }

    fn open(&mut self, channel: &records::Channel<'_>) {
        let mut schema = self.schemas.get_mut(&channel.schema_id);
        let wanted = self.wanted.iter().find(|w| w.topic == channel.topic);
        let used = match (wanted, schema.as_deref_mut()) {
            (None, _) => Err(SkipReason::NotWanted),
            (Some(_), None) => Err(SkipReason::NoSchema),
            (Some(wanted), Some(schema)) => use_of(schema, channel.message_encoding, wanted.role),
        };
        let used = match used {
            Ok(used) => {
                self.diagnostics
                    .read
                    .entry(channel.topic.into())
                    .or_insert(0);
                used
            }
            Err(why) => {
                let schema = schema.as_deref();
                let encoding = schema.map_or("", |schema| schema.encoding.as_str());
                let skipped = Skipped {
                    schema: schema.map_or(String::new(), |schema| schema.name.clone()),
                    encoding: format!("{encoding}, {}", channel.message_encoding),
                    why,
                    messages: 0,
                };
                let topic = channel.topic.into();
                self.diagnostics.skipped.entry(topic).or_insert(skipped);
                Use::Skip
            }
        };
        self.channels.insert(
            channel.id,
            Channel {
                topic: channel.topic.into(),
                used,
            },
        );
    }

    fn message(&mut self, number: u16, logged_ns: u64, data: &[u8]) -> Option<Item> {
        let Some(channel) = self.channels.get(&number) else {
            self.undecodable(|| format!("a message of channel {number}, which was not announced"));
            return None;
        };
        let Use::Read { kind, role } = channel.used else {
            if let Some(skipped) = self.diagnostics.skipped.get_mut(&channel.topic) {
                skipped.messages += 1;
            }
            return None;
        };
        if let Some(count) = self.diagnostics.read.get_mut(&channel.topic) {
            *count += 1;
        }
        match decoded(kind, data) {
            Ok(message) => self.item(number, message, role, logged_ns),
            Err(why) => {
                let topic = channel.topic.clone();
                self.undecodable(|| format!("{topic}: {why}"));
                None
            }
        }
    }

    fn undecodable(&mut self, words: impl FnOnce() -> String) {
        self.diagnostics.undecodable += 1;
        if self.diagnostics.first_undecodable.is_none() {
            self.diagnostics.first_undecodable = Some(words());
        }
    }

    /// Returns the newest pose of a message of transforms: that of the robot in the world, or in the odometry's frame.
    fn composed(&mut self, channel: u16, transforms: &[Transform], role: Role) -> Option<Message> {
        let composer = self.composers.entry(channel);
        let composer = composer.or_insert_with(|| Composer::new(self.names.clone()));
        let mut newest: Option<(i64, String, Pose)> = None;
        for transform in transforms {
            let edge = (transform.parent.clone(), transform.child.clone());
            let named = &mut self.diagnostics.transforms;
            if named.len() < MOST_EDGES || named.contains_key(&edge) {
                *named.entry(edge).or_insert(0) += 1;
            }
            let found = match role {
                Role::Odometry => composer
                    .is_odometry(transform)
                    .then(|| (transform.stamp_ns, transform.parent.clone(), transform.pose)),
                _ => composer
                    .add(transform)
                    .map(|(stamp_ns, pose)| (stamp_ns, composer.world().into(), pose)),
            };
            newest = found.or(newest);
        }
        newest.map(|(stamp_ns, frame, pose)| Message {
            stamp_ns,
            frame,
            content: Content::Pose {
                position: pose.position,
                orientation: pose.orientation,
                covariance: None,
            },
        })
    }

    fn item(
        &mut self,
        channel: u16,
        mut message: Message,
        role: Role,
        logged_ns: u64,
    ) -> Option<Item> {
        if let Content::Transforms(transforms) = &message.content {
            message = self.composed(channel, transforms, role)?;
        }
        let Message {
            stamp_ns,
            frame,
            content,
        } = message;
        let t_s = Exact::seconds(stamp_ns);
        let exact_ns = Some(Exact {
            stamp: stamp_ns,
            // A time in the year 2262 or later does not fit, and is replaced by the largest one.
            logged: i64::try_from(logged_ns).unwrap_or(i64::MAX),
        });
        let item = match (content, role) {
            (
                Content::Pose {
                    position,
                    orientation,
                    ..
                },
                Role::Truth | Role::Odometry,
            ) => Item::Truth(TruePose {
                t_s,
                frame: self.shared(frame),
                position,
                orientation,
            }),
            (
                Content::Pose {
                    position,
                    orientation,
                    covariance,
                },
                Role::Estimates(source),
            ) => Item::Estimate(Sample {
                source,
                t_s,
                logged_s: exact_ns.map(|exact| Exact::seconds(exact.logged)),
                exact_ns,
                frame: Some(self.shared(frame)),
                z_m: position[2],
                belief: belief(position, orientation, covariance),
                truth: None,
                since_fix_ms: None,
            }),
            (Content::Detections(found), Role::Estimates(source)) => Item::Detections {
                source,
                t_s,
                exact_ns,
                frame: self.shared(frame),
                found,
            },
            // Unreachable: [`use_of`] refuses such a channel.
            (Content::Detections(_), Role::Truth | Role::Odometry) => return None,
            // Replaced by a pose above.
            (Content::Transforms(_), _) => return None,
        };
        Some(item)
    }

    /// Returns a shared copy of a frame's name. Consecutive messages with the same frame share it.
    fn shared(&mut self, name: String) -> Arc<str> {
        match &self.frame {
            Some(frame) if **frame == *name => frame.clone(),
            _ => self.frame.insert(Arc::from(name)).clone(),
        }
    }
}

/// Returns how to use the messages of a channel.
///
/// # Errors
///
/// The reason why they cannot be read.
fn use_of(schema: &mut Schema, encoding: &str, role: Role) -> Result<Use, SkipReason> {
    let kind = Kind::of(&schema.name).ok_or(SkipReason::UnknownSchema)?;
    if schema.encoding != "ros2msg" || encoding != "cdr" {
        return Err(SkipReason::UnknownEncoding);
    }
    let definition = &schema.definition;
    let has_fields = schema.has_fields;
    let has_fields = has_fields.unwrap_or_else(|| kind.has_fields_of(definition));
    schema.has_fields = Some(has_fields);
    if !has_fields {
        return Err(SkipReason::OtherFields);
    }
    if kind == Kind::Detections && !matches!(role, Role::Estimates(_)) {
        return Err(SkipReason::NoPose);
    }
    Ok(Use::Read { kind, role })
}

fn belief(
    position: [f64; 3],
    orientation: [f64; 4],
    covariance: Option<[[f64; 6]; 6]>,
) -> PoseEstimate {
    match covariance {
        Some(rows) => {
            let mut covariance = [0.0; 36];
            for (to, from) in covariance.iter_mut().zip(rows.as_flattened()) {
                *to = *from;
            }
            PoseEstimate::from(&PoseWithCovariance {
                position,
                orientation,
                covariance,
            })
        }
        None => PoseEstimate {
            x_m: position[0],
            y_m: position[1],
            heading: Heading::Quaternion(orientation),
            spread: None::<Uncertainty>,
        },
    }
}

/// Returns the yaw of a quaternion x, y, z, w of any length, radians.
pub(crate) fn yaw_of([x, y, z, w]: [f64; 4]) -> f64 {
    libm::atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
}

#[cfg(test)]
mod tests;
