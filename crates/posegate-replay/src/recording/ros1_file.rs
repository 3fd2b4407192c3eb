//! ROS 1 bags (version 2.0), read from start to end: <http://wiki.ros.org/Bags/Format/2.0>.
//!
//! Every length is compared with the existing bytes before memory is reserved for it.

use super::intake::{Intake, Schema};
use super::storage::Storage;
use super::{Item, RecordingError};
use crate::mcap::chunk::{Budget, LARGEST};
use crate::mcap::unpack::{self, Compression};
use std::io::Read;

/// The first bytes of a file.
const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// The longest header of a record, bytes.
const LONGEST_HEAD: usize = 1 << 20;
/// The longest record that is skipped, bytes.
const FARTHEST: u64 = 1 << 32;

/// The kinds of records, by the field `op`.
mod op {
    pub const MESSAGE: u8 = 0x02;
    pub const CHUNK: u8 = 0x05;
    pub const CONNECTION: u8 = 0x07;
}

/// A reader of a file.
pub(super) struct Ros1File<R> {
    input: R,
    file: String,
    budget: Budget,
    head: Vec<u8>,
    body: Vec<u8>,
    /// The records of the current chunk, and the number of their bytes that were consumed.
    records: Vec<u8>,
    taken: usize,
    bytes: u64,
    has_started: bool,
    is_over: bool,
}

/// The reason why reading stops.
enum Stop {
    Broken(String),
    Recording(RecordingError),
}

impl<R: Read> Ros1File<R> {
    /// Returns a reader of these bytes; `file` names them in errors.
    pub fn new(input: R, file: &str) -> Self {
        Self {
            input,
            file: file.into(),
            budget: Budget::new(),
            head: Vec::new(),
            body: Vec::new(),
            records: Vec::new(),
            taken: 0,
            bytes: 0,
            has_started: false,
            is_over: false,
        }
    }

    /// Reads `length` bytes, or as many as exist: returns their number.
    fn read(&mut self, length: u64, into_head: bool) -> Result<u64, Stop> {
        let buffer = if into_head {
            &mut self.head
        } else {
            &mut self.body
        };
        buffer.clear();
        let count = (&mut self.input).take(length).read_to_end(buffer);
        let count = count.map_err(|source| {
            Stop::Recording(RecordingError::Io {
                file: self.file.clone(),
                source,
            })
        })?;
        self.bytes += count as u64;
        Ok(count as u64)
    }

    /// Reads a length; `None` at the end of the file.
    fn length(&mut self) -> Result<Option<u64>, Stop> {
        match self.read(4, true)? {
            0 => Ok(None),
            4 => Ok(self
                .head
                .first_chunk()
                .map(|bytes| u32::from_le_bytes(*bytes).into())),
            _ => Err(Stop::Broken("the file ends within a length".into())),
        }
    }

    /// Reads a record. Returns its item, if it yields one immediately.
    fn step(&mut self, intake: &mut Intake) -> Result<Option<Item>, Stop> {
        if !self.has_started {
            self.has_started = true;
            self.read(MAGIC.len() as u64, true)?;
            if self.head != MAGIC {
                return Err(Stop::Broken(
                    "its first bytes are not those of a ROS 1 bag 2.0".into(),
                ));
            }
        }
        let Some(length) = self.length()? else {
            self.is_over = true;
            return Ok(None);
        };
        if length > LONGEST_HEAD as u64 {
            return Err(Stop::Broken(format!("a header of {length} bytes")));
        }
        if self.read(length, true)? < length {
            return Err(Stop::Broken("the file ends within a header".into()));
        }
        let head = std::mem::take(&mut self.head);
        let size = self
            .length()?
            .ok_or_else(|| Stop::Broken("the file ends after a header".into()))?;
        let kind = byte(&head, b"op");
        let is_read = matches!(kind, Some(op::MESSAGE | op::CHUNK | op::CONNECTION));
        if size > LARGEST as u64 || !is_read {
            if size > FARTHEST {
                return Err(Stop::Broken(format!("a record of {size} bytes")));
            }
            let count = std::io::copy(&mut (&mut self.input).take(size), &mut std::io::sink());
            let count = count.map_err(|error| Stop::Broken(error.to_string()))?;
            self.bytes += count;
            if count < size {
                return Err(Stop::Broken("the file ends within a record".into()));
            }
            if is_read {
                left_out(
                    intake,
                    kind == Some(op::CHUNK),
                    self.bytes,
                    "it is too large",
                );
            }
            self.head = head;
            return Ok(None);
        }
        if self.read(size, false)? < size {
            return Err(Stop::Broken("the file ends within a record".into()));
        }
        let item = if kind == Some(op::CHUNK) {
            match chunk(&head, &self.body, &mut self.budget) {
                Ok(records) => (self.records, self.taken) = (records, 0),
                Err(why) => left_out(intake, true, self.bytes, &why),
            }
            None
        } else {
            take(intake, &head, &self.body, self.bytes).map_err(Stop::Recording)?
        };
        self.head = head;
        Ok(item)
    }
}

impl<R: Read + Send> Storage for Ros1File<R> {
    fn next(&mut self, intake: &mut Intake) -> Result<Option<Item>, RecordingError> {
        loop {
            while let Some((head, body, rest)) =
                record(self.records.get(self.taken..).unwrap_or_default())
            {
                self.taken = self.records.len() - rest.len();
                if let Some(item) = take(intake, head, body, self.bytes)? {
                    return Ok(Some(item));
                }
            }
            if self.is_over {
                return Ok(None);
            }
            match self.step(intake) {
                Ok(Some(item)) => return Ok(Some(item)),
                Ok(None) => {}
                Err(Stop::Broken(why)) => {
                    self.is_over = true;
                    let damage = format!("after {} bytes: {why}", self.bytes);
                    intake.diagnostics.damage = Some(damage);
                }
                Err(Stop::Recording(error)) => return Err(error),
            }
        }
    }

    fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// Counts a part that is left out.
fn left_out(intake: &mut Intake, is_chunk: bool, bytes: u64, why: &str) {
    let diagnostics = &mut intake.diagnostics;
    let (count, what) = if is_chunk {
        (&mut diagnostics.bad_chunks, "chunk")
    } else {
        (&mut diagnostics.bad_records, "record")
    };
    *count += 1;
    let damage = || format!("after {bytes} bytes: {why}; the {what} is left out");
    diagnostics.damage.get_or_insert_with(damage);
}

/// Splits off the first of consecutive records: its header, its data and the rest. `None` at their end.
fn record(records: &[u8]) -> Option<(&[u8], &[u8], &[u8])> {
    let (head, rest) = part(records)?;
    let (data, rest) = part(rest)?;
    Some((head, data, rest))
}

/// Splits off a part that begins with its length.
fn part(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    rest.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)
}

/// Returns the value of a field of a header.
fn field<'b>(mut head: &'b [u8], name: &[u8]) -> Option<&'b [u8]> {
    while let Some((field, rest)) = part(head) {
        let at = field.iter().position(|byte| *byte == b'=')?;
        let (key, value) = field.split_at_checked(at)?;
        if key == name {
            return value.get(1..);
        }
        head = rest;
    }
    None
}

fn byte(head: &[u8], name: &[u8]) -> Option<u8> {
    match field(head, name)? {
        [byte] => Some(*byte),
        _ => None,
    }
}

fn number(head: &[u8], name: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(field(head, name)?.try_into().ok()?))
}

fn text<'b>(head: &'b [u8], name: &[u8]) -> Option<&'b str> {
    std::str::from_utf8(field(head, name)?).ok()
}

/// Returns the records of a chunk.
fn chunk(head: &[u8], data: &[u8], budget: &mut Budget) -> Result<Vec<u8>, String> {
    let size = number(head, b"size").ok_or("a chunk without its size")?;
    let size = usize::try_from(size).unwrap_or(usize::MAX);
    if size > LARGEST {
        return Err(format!("a chunk of {size} bytes"));
    }
    let compression = match text(head, b"compression") {
        Some("none") => Compression::None,
        Some("lz4") => Compression::Lz4,
        Some("bz2") => Compression::Bzip2,
        other => return Err(format!("the compression {other:?} is not known")),
    };
    budget
        .spend(size as u64, data.len())
        .map_err(|error| error.to_string())?;
    unpack::unpacked(compression, data, size).map_err(|error| error.to_string())
}

/// Processes a record of a connection or a message.
fn take(
    intake: &mut Intake,
    head: &[u8],
    data: &[u8],
    bytes: u64,
) -> Result<Option<Item>, RecordingError> {
    let connection = number(head, b"conn");
    match (byte(head, b"op"), connection) {
        (Some(op::CONNECTION), Some(id)) => {
            let topic = text(head, b"topic");
            let kind = text(data, b"type");
            let (Some(topic), Some(kind)) = (topic, kind) else {
                left_out(intake, false, bytes, "a connection without topic and type");
                return Ok(None);
            };
            let definition = field(data, b"message_definition").unwrap_or_default();
            let schema = Schema {
                name: kind.into(),
                encoding: "ros1msg".into(),
                definition: String::from_utf8_lossy(definition).into_owned(),
                has_fields: None,
            };
            let size = head.len() + data.len();
            let stored = intake.schema(id, size, schema);
            let stored = stored.and_then(|()| intake.channel(id, 0, topic, id, "ros1"));
            if let Err(why) = stored {
                left_out(intake, false, bytes, &why.to_string());
            }
            Ok(None)
        }
        (Some(op::MESSAGE), Some(id)) => {
            let time = field(head, b"time").and_then(<[u8]>::first_chunk::<8>);
            let Some([a, b, c, d, e, f, g, h]) = time.copied() else {
                left_out(intake, false, bytes, "a message without its time");
                return Ok(None);
            };
            let seconds = i64::from(u32::from_le_bytes([a, b, c, d]));
            let logged_ns = seconds * 1_000_000_000 + i64::from(u32::from_le_bytes([e, f, g, h]));
            intake.message(id, logged_ns, data)
        }
        _ => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Role, Wanted};
    use super::*;
    use posegate_testkit::counts;
    use proptest::prelude::*;

    fn read(bytes: &[u8]) {
        let wanted = Wanted {
            topic: "/t".into(),
            role: Role::Estimates(0),
        };
        let (mut file, mut intake) = (Ros1File::new(bytes, "a.bag"), Intake::new(&[wanted]));
        let mut count = 0;
        while let Ok(Some(_)) = file.next(&mut intake) {
            count += 1;
            assert!(count <= bytes.len());
        }
        assert!(file.body.capacity() <= 2 * bytes.len() + 64);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(counts::rounds(2_000, 7)))]

        #[test]
        fn random_records_are_read_to_their_end(
            records in prop::collection::vec((0u8..9, 0u32..3, prop::collection::vec(any::<u8>(), 0..80)), 0..12),
        ) {
            let mut bytes = MAGIC.to_vec();
            let part = |bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat();
            for (kind, id, body) in records {
                let mut head = part(&[b"op=".as_slice(), &[kind]].concat());
                head.extend(part(&[b"conn=".as_slice(), &id.to_le_bytes()].concat()));
                head.extend(part(&[b"size=".as_slice(), &id.to_le_bytes()].concat()));
                head.extend(part(b"compression=bz2"));
                head.extend(part(b"topic=/t"));
                bytes.extend(part(&head));
                bytes.extend(part(&body));
            }
            read(&bytes);
            read(&bytes[..bytes.len() - bytes.len() / 3]);
        }
    }
}
