//! The records of a chunk, after the complete chunk was checked.

use super::records::{BadRecord, channel, chunk, message, schema};
use super::unpack::{BadData, Compression, unpacked};
use super::{CRC_32, HEAD, op};

/// The largest chunk that is read, bytes, compressed or not. Writers make chunks of some MiB; larger ones only for a
/// larger message.
pub(crate) const LARGEST: usize = 1 << 26;
/// The largest ratio of a chunk's size to its compressed bytes, per compression: zstd states 128 KiB in 4 bytes at
/// best, lz4 255 bytes in 1. (Checked before memory is reserved.)
const MOST_ZSTD: u64 = 1 << 15;
const MOST_LZ4: u64 = 255;

/// The reason why a chunk is left out.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BadChunk {
    /// A fault in its header, or in one of its records.
    #[error(transparent)]
    Record(#[from] BadRecord),
    /// An unknown compression.
    #[error("the compression {0:?} is not known")]
    Compression(String),
    /// The stated size is larger than the reader supports.
    #[error("a chunk of {size} bytes; at most {LARGEST} bytes are read")]
    Large { size: u64 },
    /// The stated size is larger than its compressed bytes can hold.
    #[error("a chunk of {size} bytes in {compressed} compressed ones")]
    Ratio { size: u64, compressed: usize },
    /// All chunks together exceed the allowed ratio to the size of the file.
    #[error(
        "the chunks are together more than {times} times as large as the file: a chunk of {size} bytes"
    )]
    Bomb { size: u64, times: u64 },
    /// The chunk's records cannot be decompressed.
    #[error(transparent)]
    Data(#[from] BadData),
    /// The records do not have the stated checksum.
    #[error("the CRC of a chunk is {calculated:08x}, and {stated:08x} is stated")]
    Crc { stated: u32, calculated: u32 },
}

/// The number of bytes that may come out of chunks, relative to those that went in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    left: u64,
}

impl Budget {
    /// Recordings of robots that do not move compress by a factor of some hundred.
    const TIMES: u64 = 1000;
    /// The number of bytes that even a small file may produce.
    const AT_LEAST: u64 = 1 << 28;

    pub(crate) const fn new() -> Self {
        Self {
            left: Self::AT_LEAST,
        }
    }

    pub(crate) fn spend(&mut self, size: u64, compressed: usize) -> Result<(), BadChunk> {
        self.left = self
            .left
            .saturating_add(Self::TIMES.saturating_mul(compressed as u64));
        self.left = self.left.checked_sub(size).ok_or(BadChunk::Bomb {
            size,
            times: Self::TIMES,
        })?;
        Ok(())
    }
}

/// Returns the records of a chunk in the order of the file; `body` is the chunk's record. All its schemas, channels and
/// messages are readable.
///
/// # Errors
/// [`BadChunk`]: no part of the chunk may be used.
pub(crate) fn records(body: &[u8], budget: &mut Budget) -> Result<Vec<u8>, BadChunk> {
    let chunk = chunk(body)?;
    let size = chunk.uncompressed_size;
    let compressed = chunk.data.len();
    let (compression, most) = match chunk.compression {
        "" => (Compression::None, compressed as u64),
        "zstd" => (
            Compression::Zstd,
            (compressed as u64).saturating_mul(MOST_ZSTD),
        ),
        "lz4" => (
            Compression::Lz4,
            (compressed as u64).saturating_mul(MOST_LZ4),
        ),
        other => return Err(BadChunk::Compression(other.chars().take(32).collect())),
    };
    if size > LARGEST as u64 {
        return Err(BadChunk::Large { size });
    }
    if size > most {
        return Err(BadChunk::Ratio { size, compressed });
    }
    budget.spend(size, compressed)?;

    let all = unpacked(compression, chunk.data, size as usize)?;
    // 0 means that the writer stated no checksum.
    if chunk.crc != 0 {
        let calculated = CRC_32.checksum(&all);
        if calculated != chunk.crc {
            let stated = chunk.crc;
            return Err(BadChunk::Crc { stated, calculated });
        }
    }
    let mut rest = &all[..];
    while !rest.is_empty() {
        let (opcode, data, others) = next(rest).ok_or(BadRecord::Short("data"))?;
        match opcode {
            op::SCHEMA => schema(data).map(drop)?,
            op::CHANNEL => channel(data).map(drop)?,
            op::MESSAGE => message(data).map(drop)?,
            _ => {}
        }
        rest = others;
    }
    Ok(all)
}

/// Splits off the first of consecutive records; `None` at their end.
pub(crate) fn next(records: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (head, rest) = records.split_first_chunk::<HEAD>()?;
    let [opcode, length @ ..] = *head;
    let length = usize::try_from(u64::from_le_bytes(length)).ok()?;
    let (data, rest) = rest.split_at_checked(length)?;
    Some((opcode, data, rest))
}
