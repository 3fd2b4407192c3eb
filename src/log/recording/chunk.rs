//! The records of a chunk, once all of it is known to be good.

use super::records::{BadRecord, HEAD, channel, chunk, message, schema};
use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::string::String;
use std::vec::Vec;

/// The largest chunk that is read, bytes, compressed or not. Writers make chunks of some MiB, and larger ones only for a message
/// that is larger itself.
pub(super) const LARGEST: usize = 1 << 26;
/// So many times larger than its compressed bytes no chunk is, by compression: zstd says 128 KiB in 4 bytes at best, lz4 255
/// bytes in 1. (Checked before anything is reserved.)
const MOST_ZSTD: u64 = 1 << 15;
const MOST_LZ4: u64 = 255;

/// Why a chunk is left out.
#[derive(Debug, thiserror::Error)]
pub(super) enum BadChunk {
    /// Its header, or a record in it.
    #[error(transparent)]
    Record(#[from] BadRecord),
    /// A compression that is not known.
    #[error("the compression {0:?} is not known")]
    Compression(String),
    /// It says that it is larger than what is read.
    #[error("a chunk of {size} bytes, of which {LARGEST} are the most that is read")]
    Large { size: u64 },
    /// It says that it is larger than its compressed bytes can be.
    #[error("a chunk of {size} bytes in {compressed} compressed ones")]
    Ratio { size: u64, compressed: usize },
    /// All chunks together are too many times larger than the file.
    #[error(
        "the chunks are together more than {times} times as large as the file: a chunk of {size} bytes"
    )]
    Bomb { size: u64, times: u64 },
    /// Its bytes are damaged.
    #[error("{}", words(.0))]
    Mcap(#[from] McapError),
}

/// An error with its cause, where that says more.
fn words(error: &McapError) -> String {
    use std::format;
    use std::string::ToString;
    match error {
        McapError::Parse(cause) => format!("{error}: {cause}"),
        McapError::Io(cause) => format!("{error}: {cause}"),
        _ => error.to_string(),
    }
}

/// How many bytes may come out of chunks, in proportion to those that went in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    left: u64,
}

impl Budget {
    /// Recordings of standing robots shrink by some hundred times.
    const TIMES: u64 = 1000;
    /// What even a small file may bring.
    const AT_LEAST: u64 = 1 << 28;

    pub(super) const fn new() -> Self {
        Self {
            left: Self::AT_LEAST,
        }
    }

    fn spend(&mut self, size: u64, compressed: usize) -> Result<(), BadChunk> {
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

/// The schemas, channels and messages of a chunk, one after the other as they lie in a file; `body` is the chunk's record. They
/// can be read, all of them.
///
/// # Errors
/// [`BadChunk`]: nothing of the chunk is to be used.
pub(super) fn records(body: &[u8], budget: &mut Budget) -> Result<Vec<u8>, BadChunk> {
    let (chunk, length) = chunk(body)?;
    let size = chunk.uncompressed_size;
    let compressed = chunk.data.len();
    let most = match chunk.compression {
        "" => compressed as u64,
        "zstd" => (compressed as u64).saturating_mul(MOST_ZSTD),
        "lz4" => (compressed as u64).saturating_mul(MOST_LZ4),
        other => return Err(BadChunk::Compression(other.chars().take(32).collect())),
    };
    if size > LARGEST as u64 {
        return Err(BadChunk::Large { size });
    }
    if size > most {
        return Err(BadChunk::Ratio { size, compressed });
    }
    budget.spend(size, compressed)?;

    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(LARGEST);
    let mut reader = LinearReader::new_with_options(options);
    // The chunk alone, without padding behind it: no length in it can reach beyond.
    let body = &body[..length];
    let mut head = [op::CHUNK; HEAD];
    head[1..].copy_from_slice(&(length as u64).to_le_bytes());
    let mut rest = [&head[..], body].into_iter();
    let mut input: &[u8] = &[];
    let mut all = Vec::with_capacity(size as usize);
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(wish) => {
                if input.is_empty() {
                    input = rest.next().unwrap_or_default();
                }
                let (now, later) = input.split_at(wish.min(input.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                input = later;
            }
            LinearReadEvent::Record { data, opcode } => {
                match opcode {
                    op::SCHEMA => schema(data).map(drop)?,
                    op::CHANNEL => channel(data).map(drop)?,
                    op::MESSAGE => message(data).map(drop)?,
                    _ => continue,
                }
                all.push(opcode);
                all.extend((data.len() as u64).to_le_bytes());
                all.extend(data);
            }
        }
    }
    Ok(all)
}

/// The first of records that lie one after the other, and the others; `None` at their end.
pub(super) fn next(records: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (head, rest) = records.split_first_chunk::<HEAD>()?;
    let [opcode, length @ ..] = *head;
    let length = usize::try_from(u64::from_le_bytes(length)).ok()?;
    let (data, rest) = rest.split_at_checked(length)?;
    Some((opcode, data, rest))
}
