//! Writes MCAP files: messages in plain chunks, indexes, statistics and checksums.
//!
//! Entry point: [`Writer`]. It holds one chunk in memory, about [`CHUNK`] bytes, and some 60 bytes of index for each finished one.

use super::{CRC_32, MAGIC, op};
use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Write};

/// A chunk ends before the next message if it has more bytes than this.
const CHUNK: usize = 1 << 20;

/// A file that is being written. It is complete after [`Writer::finish`].
pub(crate) struct Writer<W> {
    output: Output<W>,
    /// The records of the open chunk.
    chunk: Vec<u8>,
    /// The messages of the open chunk by channel: log time and offset in the chunk.
    index: BTreeMap<u16, Vec<(u64, u64)>>,
    chunk_times: Option<Times>,
    /// Records of the summary.
    schemas: Vec<u8>,
    channels: Vec<u8>,
    chunk_indexes: Vec<u8>,
    schema_count: u16,
    channel_count: u16,
    chunk_count: u32,
    /// Messages by channel.
    messages: BTreeMap<u16, u64>,
    times: Option<Times>,
}

/// A message without its data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Head {
    pub channel: u16,
    pub sequence: u32,
    /// Log time and publish time, nanoseconds.
    pub time_ns: u64,
}

impl<W: Write> Writer<W> {
    /// Begins a file. `library` names the program that writes it.
    ///
    /// # Errors
    /// The output cannot be written.
    pub(crate) fn new(output: W, library: &str) -> io::Result<Self> {
        let mut output = Output {
            output,
            written: 0,
            crc: CRC_32.digest(),
        };
        output.write(&MAGIC)?;
        let mut header = Vec::new();
        record(&mut header, op::HEADER, |body| {
            // The profile: none.
            put_text(body, "")?;
            put_text(body, library)
        })?;
        output.write(&header)?;
        Ok(Self {
            output,
            chunk: Vec::new(),
            index: BTreeMap::new(),
            chunk_times: None,
            schemas: Vec::new(),
            channels: Vec::new(),
            chunk_indexes: Vec::new(),
            schema_count: 0,
            channel_count: 0,
            chunk_count: 0,
            messages: BTreeMap::new(),
            times: None,
        })
    }

    /// Adds a message type and returns its number.
    ///
    /// # Errors
    /// [`ErrorKind::InvalidInput`] if there are too many, or a text is longer than a length of 32 bits can state.
    pub(crate) fn add_schema(
        &mut self,
        name: &str,
        encoding: &str,
        definition: &[u8],
    ) -> io::Result<u16> {
        // From 1: 0 means that a channel has no schema.
        let id = self.schema_count.checked_add(1).ok_or_else(too_large)?;
        let start = self.chunk.len();
        record(&mut self.chunk, op::SCHEMA, |body| {
            body.extend(id.to_le_bytes());
            put_text(body, name)?;
            put_text(body, encoding)?;
            put_bytes(body, definition)
        })?;
        self.schemas.extend(&self.chunk[start..]);
        self.schema_count = id;
        Ok(id)
    }

    /// Adds a topic and returns its number.
    ///
    /// # Errors
    /// As for [`Writer::add_schema`].
    pub(crate) fn add_channel(
        &mut self,
        schema: u16,
        topic: &str,
        message_encoding: &str,
    ) -> io::Result<u16> {
        let id = self.channel_count.checked_add(1).ok_or_else(too_large)?;
        let start = self.chunk.len();
        record(&mut self.chunk, op::CHANNEL, |body| {
            body.extend(id.to_le_bytes());
            body.extend(schema.to_le_bytes());
            put_text(body, topic)?;
            put_text(body, message_encoding)?;
            // No metadata.
            put_bytes(body, &[])
        })?;
        self.channels.extend(&self.chunk[start..]);
        self.channel_count = id;
        Ok(id)
    }

    /// Adds a message of a channel that [`Writer::add_channel`] returned.
    ///
    /// # Errors
    /// The output cannot be written.
    pub(crate) fn write(&mut self, head: Head, data: &[u8]) -> io::Result<()> {
        if self.chunk.len() > CHUNK {
            self.end_chunk()?;
        }
        let offset = self.chunk.len() as u64;
        record(&mut self.chunk, op::MESSAGE, |body| {
            body.extend(head.channel.to_le_bytes());
            body.extend(head.sequence.to_le_bytes());
            // Logged and published.
            body.extend(head.time_ns.to_le_bytes());
            body.extend(head.time_ns.to_le_bytes());
            body.extend(data);
            Ok(())
        })?;
        let entry = (head.time_ns, offset);
        self.index.entry(head.channel).or_default().push(entry);
        *self.messages.entry(head.channel).or_insert(0) += 1;
        Times::add(&mut self.chunk_times, head.time_ns);
        Times::add(&mut self.times, head.time_ns);
        Ok(())
    }

    /// Writes the open chunk and the index of its messages.
    fn end_chunk(&mut self) -> io::Result<()> {
        if self.chunk.is_empty() {
            return Ok(());
        }
        let times = self.chunk_times.take().unwrap_or_default();
        let size = self.chunk.len() as u64;
        let start = self.output.written;
        let mut head = Vec::new();
        head.extend(times.first.to_le_bytes());
        head.extend(times.last.to_le_bytes());
        head.extend(size.to_le_bytes());
        head.extend(CRC_32.checksum(&self.chunk).to_le_bytes());
        // Every reader opens plain chunks.
        put_text(&mut head, "")?;
        head.extend(size.to_le_bytes());
        self.output.write(&[op::CHUNK])?;
        self.output
            .write(&(head.len() as u64 + size).to_le_bytes())?;
        self.output.write(&head)?;
        self.output.write(&self.chunk)?;
        self.chunk.clear();

        let end = self.output.written;
        let mut indexes = Vec::new();
        let mut offsets = Vec::new();
        for (channel, entries) in core::mem::take(&mut self.index) {
            offsets.extend(channel.to_le_bytes());
            offsets.extend((end + indexes.len() as u64).to_le_bytes());
            record(&mut indexes, op::MESSAGE_INDEX, |body| {
                body.extend(channel.to_le_bytes());
                let pairs = entries.iter().flat_map(|(time, offset)| [time, offset]);
                let pairs: Vec<u8> = pairs.flat_map(|number| number.to_le_bytes()).collect();
                put_bytes(body, &pairs)
            })?;
        }
        self.output.write(&indexes)?;

        record(&mut self.chunk_indexes, op::CHUNK_INDEX, |body| {
            body.extend(times.first.to_le_bytes());
            body.extend(times.last.to_le_bytes());
            body.extend(start.to_le_bytes());
            body.extend((end - start).to_le_bytes());
            put_bytes(body, &offsets)?;
            body.extend((indexes.len() as u64).to_le_bytes());
            put_text(body, "")?;
            // Compressed and uncompressed.
            body.extend(size.to_le_bytes());
            body.extend(size.to_le_bytes());
            Ok(())
        })?;
        self.chunk_count = self.chunk_count.checked_add(1).ok_or_else(too_large)?;
        Ok(())
    }

    /// Ends the file and returns the output, which is not flushed.
    ///
    /// # Errors
    /// The output cannot be written.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.end_chunk()?;
        let data_crc = self.output.crc.clone().finalize();
        let mut end = Vec::new();
        record(&mut end, op::DATA_END, |body| {
            body.extend(data_crc.to_le_bytes());
            Ok(())
        })?;
        self.output.write(&end)?;
        let statistics = self.statistics()?;

        let start = self.output.written;
        let mut summary = Vec::new();
        let mut offsets = Vec::new();
        for (opcode, group) in [
            (op::SCHEMA, &self.schemas),
            (op::CHANNEL, &self.channels),
            (op::STATISTICS, &statistics),
            (op::CHUNK_INDEX, &self.chunk_indexes),
        ] {
            if group.is_empty() {
                continue;
            }
            record(&mut offsets, op::SUMMARY_OFFSET, |body| {
                body.push(opcode);
                body.extend((start + summary.len() as u64).to_le_bytes());
                body.extend((group.len() as u64).to_le_bytes());
                Ok(())
            })?;
            summary.extend(group);
        }
        let offsets_start = start + summary.len() as u64;
        summary.extend(&offsets);
        record(&mut summary, op::FOOTER, |body| {
            body.extend(start.to_le_bytes());
            body.extend(offsets_start.to_le_bytes());
            // The checksum, which covers all of the summary before itself.
            body.extend([0; 4]);
            Ok(())
        })?;
        let crc_at = summary.len() - 4;
        let crc = CRC_32.checksum(&summary[..crc_at]);
        summary[crc_at..].copy_from_slice(&crc.to_le_bytes());
        self.output.write(&summary)?;
        self.output.write(&MAGIC)?;
        Ok(self.output.output)
    }

    fn statistics(&self) -> io::Result<Vec<u8>> {
        let times = self.times.unwrap_or_default();
        let mut statistics = Vec::new();
        record(&mut statistics, op::STATISTICS, |body| {
            body.extend(self.messages.values().sum::<u64>().to_le_bytes());
            body.extend(self.schema_count.to_le_bytes());
            body.extend(u32::from(self.channel_count).to_le_bytes());
            // No attachments, no metadata.
            body.extend([0; 8]);
            body.extend(self.chunk_count.to_le_bytes());
            body.extend(times.first.to_le_bytes());
            body.extend(times.last.to_le_bytes());
            let mut counts = Vec::new();
            for (channel, count) in &self.messages {
                counts.extend(channel.to_le_bytes());
                counts.extend(count.to_le_bytes());
            }
            put_bytes(body, &counts)
        })?;
        Ok(statistics)
    }
}

/// The output, with the number of written bytes and their checksum.
struct Output<W> {
    output: W,
    written: u64,
    crc: crc::Digest<'static, u32, crc::Table<16>>,
}

impl<W: Write> Output<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.output.write_all(bytes)?;
        self.crc.update(bytes);
        self.written += bytes.len() as u64;
        Ok(())
    }
}

/// Log times of messages, nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Times {
    first: u64,
    last: u64,
}

impl Times {
    fn add(times: &mut Option<Self>, time: u64) {
        let times = times.get_or_insert(Self {
            first: time,
            last: time,
        });
        times.first = times.first.min(time);
        times.last = times.last.max(time);
    }
}

/// Appends a record. If its body is refused, nothing is appended.
fn record(
    to: &mut Vec<u8>,
    opcode: u8,
    body: impl FnOnce(&mut Vec<u8>) -> io::Result<()>,
) -> io::Result<()> {
    let start = to.len();
    to.push(opcode);
    to.extend([0; 8]);
    let begin = to.len();
    if let Err(error) = body(to) {
        to.truncate(start);
        return Err(error);
    }
    let length = (to.len() - begin) as u64;
    to[start + 1..begin].copy_from_slice(&length.to_le_bytes());
    Ok(())
}

/// Appends bytes after their length of 32 bits.
fn put_bytes(to: &mut Vec<u8>, bytes: &[u8]) -> io::Result<()> {
    let length = u32::try_from(bytes.len()).map_err(|_| too_large())?;
    to.extend(length.to_le_bytes());
    to.extend(bytes);
    Ok(())
}

fn put_text(to: &mut Vec<u8>, text: &str) -> io::Result<()> {
    put_bytes(to, text.as_bytes())
}

fn too_large() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "more than an MCAP file holds")
}

#[cfg(test)]
mod tests;
