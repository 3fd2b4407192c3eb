//! ROS 2 bags in MCAP, read from start to end. No index is needed, and memory does not grow with the file.

use super::intake::{Intake, Schema, TooMuch};
use super::{Item, RecordingError, storage::Storage};
use crate::mcap::chunk::{self, Budget, LARGEST};
use crate::mcap::records::{self, BadRecord};
use crate::mcap::{HEAD, MAGIC, op};
use std::io::Read;

/// The longest record of a schema or a channel that is read, bytes. Message definitions have some ten
/// thousand.
const LONGEST_NAMED: usize = 1 << 20;
/// The longest record that is skipped, bytes: reading an endless input must stop.
const FARTHEST: u64 = 1 << 34;
/// The length of a footer record, bytes.
const FOOTER: u64 = 20;

/// A reader of an MCAP file.
pub(super) struct McapFile<R> {
    input: R,
    file: String,
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
    Recording(RecordingError),
}

impl<R: Read> McapFile<R> {
    /// Returns a reader of these bytes; `file` names them in errors.
    pub fn new(input: R, file: &str) -> Self {
        Self {
            input,
            file: file.into(),
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

    /// Reports something that was left out. Only the first report keeps its place and reason.
    fn left_out(&self, intake: &mut Intake, what: &str, why: &str) {
        if intake.diagnostics.damage.is_none() {
            let bytes = self.bytes;
            intake.diagnostics.damage = Some(format!(
                "after {bytes} bytes: {why}; the {what} is left out"
            ));
        }
    }

    fn chunk_left_out(&self, intake: &mut Intake, why: &str) {
        intake.diagnostics.bad_chunks += 1;
        self.left_out(intake, "chunk", why);
    }

    fn record_left_out(&self, intake: &mut Intake, why: &str) {
        intake.diagnostics.bad_records += 1;
        self.left_out(intake, "record", why);
    }

    /// Returns the item of a record. Counts a record that is left out.
    fn taken_or_left_out(
        &self,
        intake: &mut Intake,
        taken: Result<Option<Item>, NotTaken>,
    ) -> Result<Option<Item>, Stop> {
        match taken {
            Ok(item) => Ok(item),
            Err(NotTaken::Recording(error)) => Err(Stop::Recording(error)),
            Err(why) => {
                self.record_left_out(intake, &why.to_string());
                Ok(None)
            }
        }
    }

    fn error(&self, stop: Stop) -> RecordingError {
        let source = match stop {
            Stop::Recording(error) => return error,
            Stop::Io(source) => source,
            Stop::Broken(why) => std::io::Error::other(why),
        };
        RecordingError::Io {
            file: self.file.clone(),
            source,
        }
    }

    /// Stops at a damaged place. All items before it remain valid.
    fn broken(&mut self, intake: &mut Intake, why: &str) {
        self.stage = Stage::Broken;
        intake.diagnostics.damage = Some(format!("after {} bytes: {why}", self.bytes));
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
    fn step(&mut self, intake: &mut Intake) -> Result<Option<Item>, Stop> {
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
            op::FOOTER => return self.footer(intake, length).map(|()| None),
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
                op::CHUNK => self.chunk_left_out(intake, &why),
                _ if longest > 0 => self.record_left_out(intake, &why),
                // Attachments, metadata and indexes are not needed here.
                _ => {}
            }
            return Ok(None);
        };
        self.read(fits, "within a record")?;
        if opcode == op::CHUNK {
            match chunk::records(&self.body, &mut self.budget) {
                Ok(records) => (self.records, self.taken) = (records, 0),
                Err(why) => self.chunk_left_out(intake, &why.to_string()),
            }
            return Ok(None);
        }
        let taken = take(intake, opcode, &self.body);
        self.taken_or_left_out(intake, taken)
    }

    /// Reads the footer and the end of the file.
    fn footer(&mut self, intake: &mut Intake, length: u64) -> Result<(), Stop> {
        if length != FOOTER {
            return Err(Stop::Broken(format!("a footer of {length} bytes")));
        }
        self.pass_over(length)?;
        self.read(MAGIC.len(), "after its footer")?;
        if self.body != MAGIC {
            return Err(Stop::Broken("its last bytes are not those of MCAP".into()));
        }
        self.stage = Stage::Complete;
        let diagnostics = &mut intake.diagnostics;
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

impl<R: Read + Send> Storage for McapFile<R> {
    fn next(&mut self, intake: &mut Intake) -> Result<Option<Item>, RecordingError> {
        loop {
            while let Some((opcode, data, rest)) =
                chunk::next(self.records.get(self.taken..).unwrap_or_default())
            {
                self.taken = self.records.len() - rest.len();
                // The chunk's records were checked when it was read. An error now means that a limit is
                // exceeded.
                let taken = take(intake, opcode, data);
                match self.taken_or_left_out(intake, taken) {
                    Ok(Some(item)) => return Ok(Some(item)),
                    Ok(None) => {}
                    Err(stop) => return Err(self.error(stop)),
                }
            }
            if matches!(self.stage, Stage::Complete | Stage::Broken) {
                return Ok(None);
            }
            match self.step(intake) {
                Ok(Some(item)) => return Ok(Some(item)),
                Ok(None) => {}
                Err(Stop::Broken(why)) => self.broken(intake, &why),
                Err(stop) => return Err(self.error(stop)),
            }
        }
    }

    fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// The reason why a record is not taken.
#[derive(Debug, thiserror::Error)]
enum NotTaken {
    #[error(transparent)]
    Record(#[from] BadRecord),
    #[error(transparent)]
    TooMuch(#[from] TooMuch),
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

/// Processes a record.
fn take(intake: &mut Intake, opcode: u8, data: &[u8]) -> Result<Option<Item>, NotTaken> {
    match opcode {
        op::SCHEMA => {
            let record = records::schema(data)?;
            let schema = Schema {
                name: record.name.into(),
                encoding: record.encoding.into(),
                definition: String::from_utf8_lossy(record.definition).into_owned(),
                has_fields: None,
            };
            intake.schema(record.id.into(), data.len(), schema)?;
        }
        op::CHANNEL => {
            let channel = records::channel(data)?;
            intake.channel(
                channel.id.into(),
                data.len(),
                channel.topic,
                channel.schema_id.into(),
                channel.message_encoding,
            )?;
        }
        op::MESSAGE => {
            let message = records::message(data)?;
            // A time in the year 2262 or later does not fit, and is replaced by the largest one.
            let logged_ns = i64::try_from(message.logged_ns).unwrap_or(i64::MAX);
            return Ok(intake.message(message.channel_id.into(), logged_ns, message.data)?);
        }
        _ => {}
    }
    Ok(None)
}

#[cfg(test)]
mod tests;
