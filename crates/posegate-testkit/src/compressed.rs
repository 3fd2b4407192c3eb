//! Compression of the chunks of an MCAP file, by the encoders of `ruzstd` and `lz4_flex`. The crate `mcap` writes the file;
//! its own compression needs two C libraries.

use mcap::records::op;
use std::collections::BTreeMap;
use std::io::{self, Read, Write};

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

    fn of(self, records: &[u8]) -> io::Result<Vec<u8>> {
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

/// Copies an MCAP file with plain chunks and compresses them. All offsets and lengths are corrected; the checksums of the data
/// section and of the summary become 0, which means none.
pub fn compressed(
    mut input: impl Read,
    mut output: impl Write,
    compression: Compression,
) -> io::Result<()> {
    let mut magic = [0; 8];
    input.read_exact(&mut magic)?;
    output.write_all(&magic)?;
    let mut at = Offsets::default();
    (at.old, at.new) = (8, 8);
    loop {
        let mut head = [0; 9];
        input.read_exact(&mut head)?;
        let [opcode, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        let mut body = Vec::new();
        (&mut input).take(length).read_to_end(&mut body)?;
        let start = at.old;
        at.begins(length);
        match opcode {
            op::CHUNK => {
                body = chunk(&body, compression)?;
                at.chunks.insert(start, body.len() as u64);
            }
            op::CHUNK_INDEX => body = chunk_index(&body, &at, compression),
            op::DATA_END => body.fill(0),
            op::SUMMARY_OFFSET => {
                // The group's opcode, its start and its length.
                let [from, count] = [1, 9].map(|place| u64_at(&body, place));
                let [from, end] = [from, from + count].map(|offset| at.moved(offset));
                put(&mut body, 1, from);
                put(&mut body, 9, end - from);
            }
            op::FOOTER => {
                for place in [0, 8] {
                    let moved = at.moved(u64_at(&body, place));
                    put(&mut body, place, moved);
                }
                body[16..].fill(0);
            }
            _ => {}
        }
        output.write_all(&[opcode])?;
        output.write_all(&(body.len() as u64).to_le_bytes())?;
        output.write_all(&body)?;
        at.new += 9 + body.len() as u64;
        if opcode == op::FOOTER {
            output.write_all(&magic)?;
            return output.flush();
        }
    }
}

/// Where records begin in the old file and in the new one.
#[derive(Default)]
struct Offsets {
    old: u64,
    new: u64,
    moved: BTreeMap<u64, u64>,
    /// The new length of each chunk, by its old start.
    chunks: BTreeMap<u64, u64>,
}

impl Offsets {
    fn begins(&mut self, length: u64) {
        self.moved.insert(self.old, self.new);
        self.old += 9 + length;
    }

    /// The new offset of a record; 0 stays 0, which means none.
    fn moved(&self, old: u64) -> u64 {
        if old == self.old {
            return self.new;
        }
        self.moved.get(&old).copied().unwrap_or(0)
    }
}

fn u64_at(body: &[u8], place: usize) -> u64 {
    body[place..place + 8]
        .try_into()
        .map_or(0, u64::from_le_bytes)
}

fn put(body: &mut [u8], place: usize, value: u64) {
    body[place..place + 8].copy_from_slice(&value.to_le_bytes());
}

/// A chunk record: times, size and checksum stay, then the compression and the records.
fn chunk(body: &[u8], compression: Compression) -> io::Result<Vec<u8>> {
    let (head, records) = (&body[..28], &body[40..]);
    assert_eq!(body[28..32], [0; 4], "a plain chunk");
    let records = compression.of(records)?;
    let mut all = head.to_vec();
    text(&mut all, compression.name());
    all.extend((records.len() as u64).to_le_bytes());
    all.extend(records);
    Ok(all)
}

/// A chunk index record: times, the chunk's start and length, a map of offsets, its length, compression and sizes.
fn chunk_index(body: &[u8], at: &Offsets, compression: Compression) -> Vec<u8> {
    let start = u64_at(body, 16);
    let length = at.chunks[&start];
    let map = 36 + u64_at(body, 32) as u32 as usize;
    let mut all = body[..map].to_vec();
    put(&mut all, 16, at.moved(start));
    put(&mut all, 24, 9 + length);
    for entry in (36..map).step_by(10) {
        let moved = at.moved(u64_at(body, entry + 2));
        put(&mut all, entry + 2, moved);
    }
    all.extend(&body[map..map + 8]);
    text(&mut all, compression.name());
    all.extend((length - 40 - compression.name().len() as u64).to_le_bytes());
    // The uncompressed size.
    all.extend(&body[body.len() - 8..]);
    all
}

fn text(to: &mut Vec<u8>, text: &str) {
    to.extend((text.len() as u32).to_le_bytes());
    to.extend(text.as_bytes());
}
