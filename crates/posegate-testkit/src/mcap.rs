//! A small writer of MCAP files, <https://mcap.dev/spec>, that shares no code with the reader under test. Chunks are compressed
//! by the encoders of `ruzstd` and `lz4_flex`. Files of the crate `mcap` are read in `crates/posegate-peers`.

use std::io::{self, Write};

/// First and last bytes of a file.
pub const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// First byte of a record.
pub mod op {
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const MESSAGE_INDEX: u8 = 0x07;
    pub const CHUNK_INDEX: u8 = 0x08;
    pub const ATTACHMENT: u8 = 0x09;
    pub const METADATA: u8 = 0x0c;
    pub const STATISTICS: u8 = 0x0b;
    pub const DATA_END: u8 = 0x0f;
}

/// Compression of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    Lz4,
    Zstd,
}

impl Compression {
    fn name(self) -> &'static str {
        match self {
            Self::Lz4 => "lz4",
            Self::Zstd => "zstd",
        }
    }

    fn apply(self, records: &[u8]) -> io::Result<Vec<u8>> {
        match self {
            Self::Lz4 => {
                let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
                encoder.write_all(records)?;
                Ok(encoder.finish()?)
            }
            Self::Zstd => {
                let level = ruzstd::encoding::CompressionLevel::Fastest;
                Ok(ruzstd::encoding::compress_to_vec(records, level))
            }
        }
    }
}

/// How a file is laid out.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    pub compression: Option<Compression>,
    /// A chunk ends after this many bytes of records.
    pub chunk_size: usize,
    /// `true` to write message indexes, chunk indexes and a summary.
    pub index: bool,
}

/// Time, then offset in its chunk, of each message of a channel.
type MessageTimes = Vec<(u64, u64)>;

/// A file that is being written. Times are nanoseconds.
pub struct Writer<W: Write> {
    output: W,
    /// Bytes written.
    length: u64,
    layout: Layout,
    chunk: Vec<u8>,
    times: Option<(u64, u64)>,
    /// By channel number less 1.
    messages: Vec<MessageTimes>,
    /// Name and data of each schema, then schema and topic of each channel. Equal ones are written once.
    schemas: Vec<(String, Vec<u8>)>,
    channels: Vec<(u16, String)>,
    /// Schemas, channels and chunk indexes, for the summary.
    definitions: Vec<u8>,
    chunk_indexes: Vec<u8>,
    counts: [u64; 2],
    span: Option<(u64, u64)>,
}

impl<W: Write> Writer<W> {
    pub fn new(output: W, layout: Layout) -> io::Result<Self> {
        let mut writer = Self {
            output,
            length: 0,
            layout,
            chunk: vec![],
            times: None,
            messages: vec![],
            schemas: vec![],
            channels: vec![],
            definitions: vec![],
            chunk_indexes: vec![],
            counts: [0; 2],
            span: None,
        };
        writer.put(&MAGIC)?;
        let mut head = text("ros2");
        head.extend(text("posegate-testkit"));
        writer.put(&record(op::HEADER, &head))?;
        Ok(writer)
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.length += bytes.len() as u64;
        self.output.write_all(bytes)
    }

    /// Returns the number of a schema with the encoding `ros2msg`.
    pub fn schema(&mut self, name: &str, definition: &[u8]) -> u16 {
        let entry = (name.to_owned(), definition.to_vec());
        if let Some(at) = self.schemas.iter().position(|known| *known == entry) {
            return at as u16 + 1;
        }
        self.schemas.push(entry);
        let id = self.schemas.len() as u16;
        let mut body = id.to_le_bytes().to_vec();
        body.extend(text(name));
        body.extend(text("ros2msg"));
        body.extend(bytes(definition));
        self.define(&record(op::SCHEMA, &body));
        id
    }

    /// Returns the number of a channel of CDR messages.
    pub fn channel(&mut self, schema: u16, topic: &str) -> u16 {
        let entry = (schema, topic.to_owned());
        if let Some(at) = self.channels.iter().position(|known| *known == entry) {
            return at as u16 + 1;
        }
        self.channels.push(entry);
        self.messages.push(vec![]);
        let id = self.channels.len() as u16;
        let mut body = [id.to_le_bytes(), schema.to_le_bytes()].concat();
        body.extend(text(topic));
        body.extend(text("cdr"));
        body.extend(0_u32.to_le_bytes());
        self.define(&record(op::CHANNEL, &body));
        id
    }

    fn define(&mut self, record: &[u8]) {
        self.chunk.extend(record);
        self.definitions.extend(record);
    }

    pub fn message(&mut self, channel: u16, time: u64, data: &[u8]) -> io::Result<()> {
        let mut body = channel.to_le_bytes().to_vec();
        body.extend(0_u32.to_le_bytes());
        body.extend([time.to_le_bytes(); 2].concat());
        body.extend(data);
        self.messages[usize::from(channel) - 1].push((time, self.chunk.len() as u64));
        self.chunk.extend(record(op::MESSAGE, &body));
        self.times = widened(self.times, time);
        self.span = widened(self.span, time);
        self.counts[0] += 1;
        if self.chunk.len() > self.layout.chunk_size {
            self.end_chunk()?;
        }
        Ok(())
    }

    fn end_chunk(&mut self) -> io::Result<()> {
        let records = std::mem::take(&mut self.chunk);
        if records.is_empty() {
            return Ok(());
        }
        let (first, last) = self.times.take().unwrap_or((0, 0));
        let compression = self.layout.compression;
        let name = compression.map_or("", Compression::name);
        let data = compression.map_or(Ok(records.clone()), |how| how.apply(&records))?;
        let times = [first.to_le_bytes(), last.to_le_bytes()].concat();
        let mut body = times.clone();
        body.extend((records.len() as u64).to_le_bytes());
        body.extend(CRC_32.checksum(&records).to_le_bytes());
        body.extend(text(name));
        body.extend((data.len() as u64).to_le_bytes());
        body.extend(&data);
        let start = self.length;
        self.put(&record(op::CHUNK, &body))?;
        let chunk_length = self.length - start;
        let (index_start, mut offsets) = (self.length, vec![]);
        for channel in 0..self.messages.len() {
            let messages = std::mem::take(&mut self.messages[channel]);
            if messages.is_empty() || !self.layout.index {
                continue;
            }
            let id = (channel as u16 + 1).to_le_bytes();
            offsets.extend(id);
            offsets.extend(self.length.to_le_bytes());
            let entries: Vec<u8> = messages
                .into_iter()
                .flat_map(|(time, offset)| [time.to_le_bytes(), offset.to_le_bytes()].concat())
                .collect();
            let mut body = id.to_vec();
            body.extend(bytes(&entries));
            self.put(&record(op::MESSAGE_INDEX, &body))?;
        }
        let mut body = times;
        body.extend(start.to_le_bytes());
        body.extend(chunk_length.to_le_bytes());
        body.extend(bytes(&offsets));
        body.extend((self.length - index_start).to_le_bytes());
        body.extend(text(name));
        body.extend((data.len() as u64).to_le_bytes());
        body.extend((records.len() as u64).to_le_bytes());
        self.chunk_indexes.extend(record(op::CHUNK_INDEX, &body));
        self.counts[1] += 1;
        Ok(())
    }

    /// Writes the rest and returns the output.
    pub fn finish(mut self) -> io::Result<W> {
        self.end_chunk()?;
        self.put(&record(op::DATA_END, &[0; 4]))?;
        let mut footer = [0; 20];
        if self.layout.index {
            footer[..8].copy_from_slice(&self.length.to_le_bytes());
            let summary = [self.definitions.clone(), self.chunk_indexes.clone()].concat();
            let statistics = record(op::STATISTICS, &self.statistics());
            self.put(&summary)?;
            self.put(&statistics)?;
        }
        self.put(&record(op::FOOTER, &footer))?;
        self.put(&MAGIC)?;
        self.output.flush()?;
        Ok(self.output)
    }

    fn statistics(&self) -> Vec<u8> {
        let (first, last) = self.span.unwrap_or((0, 0));
        let [messages, chunks] = self.counts;
        let mut body = messages.to_le_bytes().to_vec();
        body.extend((self.schemas.len() as u16).to_le_bytes());
        body.extend((self.channels.len() as u32).to_le_bytes());
        body.extend([0; 8]); // attachments and metadata
        body.extend((chunks as u32).to_le_bytes());
        body.extend(first.to_le_bytes());
        body.extend(last.to_le_bytes());
        body.extend([0; 4]); // messages by channel: not given
        body
    }
}

/// CRC-32 of a chunk's records.
const CRC_32: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

fn widened(span: Option<(u64, u64)>, time: u64) -> Option<(u64, u64)> {
    let (first, last) = span.unwrap_or((time, time));
    Some((first.min(time), last.max(time)))
}

/// Returns a record of that opcode and body.
pub fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

/// Returns bytes with their length before them.
fn bytes(content: &[u8]) -> Vec<u8> {
    [&(content.len() as u32).to_le_bytes()[..], content].concat()
}

fn text(content: &str) -> Vec<u8> {
    bytes(content.as_bytes())
}
