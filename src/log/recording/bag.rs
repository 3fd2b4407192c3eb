//! ROS 2 bags in MCAP, read from start to end: no index is needed, and memory does not grow with the file.

use super::message::{Content, Kind, Message, decoded};
use super::told::{Skipped, Told, Why};
use super::{Exact, Item, Recording, RecordingError, Sample, TruePose};
use crate::report::{Belief, Heading, ros::PoseWithCovariance};
use crate::set::Spread;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::format;
use std::io::Read;
use std::string::{String, ToString};
use std::sync::Arc;

/// The longest record that is taken, bytes: a damaged length must not ask for all memory.
const LONGEST: usize = 1 << 29;
/// At least so much is read at a time, bytes.
const PIECE: usize = 1 << 18;

/// What a topic is wanted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Estimates, of a source.
    Estimates(u8),
    /// The truth.
    Truth,
}

/// A topic that is wanted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// Its name.
    pub topic: String,
    /// What for.
    pub role: Role,
}

/// What is done with a channel's messages.
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
}

/// A bag that is being read.
pub struct Bag<R> {
    input: R,
    file: String,
    reader: LinearReader,
    wanted: std::vec::Vec<Wanted>,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    frame: Option<Arc<str>>,
    told: Told,
    /// The records of a whole chunk that are not taken yet.
    records: std::vec::IntoIter<Record<'static>>,
    bytes: u64,
    footer: bool,
    over: bool,
    is_broken: bool,
}

impl<R: Read> Bag<R> {
    /// A bag of these bytes; `file` names it in errors.
    pub fn new(input: R, file: &str, wanted: &[Wanted]) -> Self {
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_record_length_limit(LONGEST);
        Self {
            input,
            file: file.into(),
            reader: LinearReader::new_with_options(options),
            wanted: wanted.to_vec(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            frame: None,
            told: Told::default(),
            records: std::vec::Vec::new().into_iter(),
            bytes: 0,
            footer: false,
            over: false,
            is_broken: false,
        }
    }

    /// What a record says.
    fn take(&mut self, record: Record<'_>) -> Option<Item> {
        let mut notes = Notes {
            wanted: &self.wanted,
            schemas: &mut self.schemas,
            channels: &mut self.channels,
            frame: &mut self.frame,
            told: &mut self.told,
            footer: &mut self.footer,
        };
        notes.take(record)
    }

    /// A chunk was left out.
    fn chunk_left_out(&mut self, why: &str) {
        self.told.bad_chunks += 1;
        if self.told.damage.is_none() {
            let bytes = self.bytes;
            self.told.damage = Some(format!("after {bytes} bytes: {why}; the chunk is left out"));
        }
    }

    /// The bag broke here: what came before stands.
    fn broken(&mut self, why: &str) {
        self.over = true;
        self.is_broken = true;
        self.told.damage = Some(format!("after {} bytes: {why}", self.bytes));
    }
}

impl<R: Read> Recording for Bag<R> {
    fn next(&mut self) -> Result<Option<Item>, RecordingError> {
        loop {
            while let Some(record) = self.records.next() {
                if let Some(item) = self.take(record) {
                    return Ok(Some(item));
                }
            }
            if self.over {
                break;
            }
            let Some(event) = self.reader.next_event() else {
                self.over = true;
                break;
            };
            match event {
                Ok(LinearReadEvent::ReadRequest(wish)) => {
                    let room = self.reader.insert(wish.max(PIECE));
                    let count = self.input.read(room).map_err(|source| RecordingError::Io {
                        file: self.file.clone(),
                        source,
                    })?;
                    self.bytes += count as u64;
                    self.reader.notify_read(count);
                }
                Ok(LinearReadEvent::Record { data, opcode }) => {
                    // No borrow of the reader is kept.
                    let parsed = match mcap::parse_record(opcode, data) {
                        Ok(Record::Chunk { header, data }) => Ok(whole(header, &data)),
                        Ok(record) => Ok(Ok(std::vec::Vec::from([record.into_owned()]))),
                        Err(error) if opcode == mcap::records::op::CHUNK => Ok(Err(words(&error))),
                        Err(error) => Err(error),
                    };
                    match parsed {
                        Ok(Ok(records)) => self.records = records.into_iter(),
                        Ok(Err(why)) => self.chunk_left_out(&why),
                        Err(error) => {
                            let why = words(&error);
                            self.broken(&why);
                        }
                    }
                }
                Err(error) => {
                    let why = words(&error);
                    self.broken(&why);
                }
            }
        }
        if !self.footer && !self.is_broken {
            self.broken("the file ends before its footer");
        }
        if self.footer {
            self.told.indexed.get_or_insert(false);
        }
        Ok(None)
    }

    fn told(&self) -> &Told {
        &self.told
    }

    fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// The records of a chunk, once all of it is known to be good.
fn whole(
    header: mcap::records::ChunkHeader,
    data: &[u8],
) -> Result<std::vec::Vec<Record<'static>>, String> {
    if header.uncompressed_size > LONGEST as u64 {
        return Err(format!("a chunk of {} bytes", header.uncompressed_size));
    }
    let records = mcap::read::ChunkReader::new(header, data).map_err(|error| words(&error))?;
    let owned = records.map(|record| record.map(Record::into_owned));
    let all: Result<_, _> = owned.collect();
    all.map_err(|error| words(&error))
}

/// An error with its cause, where that says more.
fn words(error: &mcap::McapError) -> String {
    match error {
        mcap::McapError::Parse(cause) => format!("{error}: {cause}"),
        mcap::McapError::Io(cause) => format!("{error}: {cause}"),
        _ => error.to_string(),
    }
}

/// What is known while records come.
struct Notes<'b> {
    wanted: &'b [Wanted],
    schemas: &'b mut BTreeMap<u16, Schema>,
    channels: &'b mut BTreeMap<u16, Channel>,
    frame: &'b mut Option<Arc<str>>,
    told: &'b mut Told,
    footer: &'b mut bool,
}

impl Notes<'_> {
    fn take(&mut self, record: Record<'_>) -> Option<Item> {
        match record {
            Record::Schema { header, data } => {
                let schema = Schema {
                    name: header.name,
                    encoding: header.encoding,
                    definition: String::from_utf8_lossy(&data).into_owned(),
                };
                self.schemas.entry(header.id).or_insert(schema);
            }
            Record::Channel(channel) => self.open(channel),
            Record::Message { header, data } => {
                self.told.message_bytes += data.len() as u64;
                return self.message(header.channel_id, header.log_time, &data);
            }
            Record::ChunkIndex(_) => self.told.indexed = Some(true),
            Record::Footer(_) => *self.footer = true,
            _ => {}
        }
        None
    }

    fn open(&mut self, channel: mcap::records::Channel) {
        if self.channels.contains_key(&channel.id) {
            return;
        }
        let schema = self.schemas.get(&channel.schema_id);
        let wanted = self.wanted.iter().find(|w| w.topic == channel.topic);
        let used = match (wanted, schema) {
            (None, _) => Err(Why::NotWanted),
            (Some(_), None) => Err(Why::NoSchema),
            (Some(wanted), Some(schema)) => use_of(schema, &channel.message_encoding, wanted.role),
        };
        let used = match used {
            Ok(used) => {
                self.told.read.entry(channel.topic.clone()).or_insert(0);
                used
            }
            Err(why) => {
                let encoding = schema.map_or("", |schema| schema.encoding.as_str());
                let skipped = Skipped {
                    schema: schema.map_or(String::new(), |schema| schema.name.clone()),
                    encoding: format!("{encoding}, {}", channel.message_encoding),
                    why,
                    messages: 0,
                };
                let topic = channel.topic.clone();
                self.told.skipped.entry(topic).or_insert(skipped);
                Use::Skip
            }
        };
        let channel_id = channel.id;
        self.channels.insert(
            channel_id,
            Channel {
                topic: channel.topic,
                used,
            },
        );
    }

    fn message(&mut self, channel: u16, logged_ns: u64, data: &[u8]) -> Option<Item> {
        let Some(channel) = self.channels.get(&channel) else {
            self.undecodable(|| format!("a message of channel {channel}, which was not announced"));
            return None;
        };
        let Use::Read { kind, role } = channel.used else {
            if let Some(skipped) = self.told.skipped.get_mut(&channel.topic) {
                skipped.messages += 1;
            }
            return None;
        };
        if let Some(count) = self.told.read.get_mut(&channel.topic) {
            *count += 1;
        }
        match decoded(kind, data) {
            Ok(message) => self.item(message, role, logged_ns),
            Err(why) => {
                let topic = channel.topic.clone();
                self.undecodable(|| format!("{topic}: {why}"));
                None
            }
        }
    }

    fn undecodable(&mut self, words: impl FnOnce() -> String) {
        self.told.undecodable += 1;
        if self.told.first_undecodable.is_none() {
            self.told.first_undecodable = Some(words());
        }
    }

    fn item(&mut self, message: Message, role: Role, logged_ns: u64) -> Option<Item> {
        let Message {
            stamp_ns,
            frame,
            content,
        } = message;
        let t_s = Exact::seconds(stamp_ns);
        let exact_ns = Some(Exact {
            stamp: stamp_ns,
            // A time of the year 2262 or later is none.
            logged: i64::try_from(logged_ns).unwrap_or(i64::MAX),
        });
        let item = match (content, role) {
            (
                Content::Pose {
                    position,
                    orientation,
                    ..
                },
                Role::Truth,
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
            }),
            (Content::Detections(found), Role::Estimates(source)) => Item::Detections {
                source,
                t_s,
                exact_ns,
                frame: self.shared(frame),
                found,
            },
            // Such a channel is not opened.
            (Content::Detections(_), Role::Truth) => return None,
        };
        Some(item)
    }

    /// One copy of a frame's name for all messages that follow with it.
    fn shared(&mut self, name: String) -> Arc<str> {
        match self.frame {
            Some(frame) if **frame == *name => frame.clone(),
            _ => self.frame.insert(Arc::from(name)).clone(),
        }
    }
}

/// Whether the messages of a channel can be read.
fn use_of(schema: &Schema, encoding: &str, role: Role) -> Result<Use, Why> {
    let kind = Kind::of(&schema.name).ok_or(Why::UnknownSchema)?;
    if schema.encoding != "ros2msg" || encoding != "cdr" {
        return Err(Why::UnknownEncoding);
    }
    if !kind.has_fields_of(&schema.definition) {
        return Err(Why::OtherFields);
    }
    if kind == Kind::Detections && role == Role::Truth {
        return Err(Why::NoPose);
    }
    Ok(Use::Read { kind, role })
}

fn belief(position: [f64; 3], orientation: [f64; 4], covariance: Option<[[f64; 6]; 6]>) -> Belief {
    match covariance {
        Some(rows) => {
            let mut covariance = [0.0; 36];
            for (to, from) in covariance.iter_mut().zip(rows.as_flattened()) {
                *to = *from;
            }
            Belief::from(&PoseWithCovariance {
                position,
                orientation,
                covariance,
            })
        }
        None => Belief {
            x_m: position[0],
            y_m: position[1],
            heading: Heading::Quaternion(orientation),
            spread: None::<Spread>,
        },
    }
}

/// The yaw of a quaternion x, y, z, w of any length, radians.
pub(crate) fn yaw_of([x, y, z, w]: [f64; 4]) -> f64 {
    libm::atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
}
