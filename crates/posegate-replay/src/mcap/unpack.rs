//! Decompression of a chunk's records: zstd by `ruzstd`, LZ4 frames by `lz4_flex`, bzip2 by `bzip2`, all without C.
//!
//! Entry point: [`unpacked`]. Its result has exactly the stated size. A chunk that holds more or fewer bytes is an error, so
//! the output never grows beyond the size that the caller has checked.

use lz4_flex::frame::FrameDecoder as Lz4;
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder as Zstd};
use std::io::Read;

/// Most frames of one chunk. Writers make one, and a frame without content still costs a decoder.
const MOST_FRAMES: u32 = 1024;
/// Largest window of a zstd frame, bytes: the limit of libzstd. Nothing is reserved for it.
const LARGEST_WINDOW: u64 = 1 << 27;
/// Bytes of a zstd frame that are decoded before they are taken from the decoder.
const STEP: usize = 1 << 20;
/// First magic number of a skippable frame, in zstd and in LZ4. Its last four bits are free.
const SKIPPABLE: u32 = 0x184D_2A50;

/// The reason why the records of a chunk cannot be decompressed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BadData {
    /// The decoder refuses a frame.
    #[error("its compressed records are damaged: {0}")]
    Frame(String),
    /// The content of a zstd frame does not have the frame's checksum.
    #[error("its compressed records are damaged: wrong checksum of a zstd frame")]
    Checksum,
    /// The frames end before the stated size.
    #[error("its records end after {found} of {size} bytes")]
    Short { size: usize, found: usize },
    /// The frames hold more than the stated size.
    #[error("its records are more than the {size} bytes that it states")]
    Long { size: usize },
    /// More than [`MOST_FRAMES`].
    #[error("its records are in more than {MOST_FRAMES} frames")]
    Frames,
}

/// Compression of a chunk's records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compression {
    None,
    Zstd,
    Lz4,
    Bzip2,
}

/// Returns the decompressed records, `size` bytes. Bytes after the frame that completes them are padding.
///
/// # Errors
/// [`BadData`] if the frames are damaged or do not hold exactly `size` bytes.
pub(crate) fn unpacked(
    compression: Compression,
    mut data: &[u8],
    size: usize,
) -> Result<Vec<u8>, BadData> {
    let frame = match compression {
        Compression::None if data.len() > size => return Err(BadData::Long { size }),
        Compression::None if data.len() < size => {
            let found = data.len();
            return Err(BadData::Short { size, found });
        }
        Compression::None => return Ok(data.to_vec()),
        Compression::Zstd => zstd_frame,
        Compression::Lz4 => lz4_frame,
        Compression::Bzip2 => bzip2_stream,
    };
    let mut output = Vec::with_capacity(size);
    for _ in 0..MOST_FRAMES {
        if output.len() == size {
            return Ok(output);
        }
        if data.is_empty() {
            let found = output.len();
            return Err(BadData::Short { size, found });
        }
        match after_skippable(data) {
            Some(rest) => data = rest,
            None => frame(&mut data, &mut output, size)?,
        }
    }
    if output.len() == size {
        Ok(output)
    } else {
        Err(BadData::Frames)
    }
}

/// Returns the bytes after a skippable frame; `None` if another frame comes first.
fn after_skippable(data: &[u8]) -> Option<&[u8]> {
    let (magic, rest) = data.split_first_chunk()?;
    let (length, rest) = rest.split_first_chunk()?;
    if u32::from_le_bytes(*magic) & !0xf != SKIPPABLE {
        return None;
    }
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    // A truncated frame skips everything: the records are then too short.
    Some(rest.get(length..).unwrap_or_default())
}

/// Decodes one zstd frame. The decoder holds at most the frame's window, one step and one block, and never much more than
/// the bytes that `output` still needs.
fn zstd_frame(data: &mut &[u8], output: &mut Vec<u8>, size: usize) -> Result<(), BadData> {
    let damaged = |error: &dyn core::fmt::Display| BadData::Frame(error.to_string());
    // A new decoder: a decoder that is reset reserves the window that the next frame states.
    let mut decoder = Zstd::new();
    decoder.set_max_window_size(LARGEST_WINDOW);
    decoder.init(&mut *data).map_err(|error| damaged(&error))?;
    let needed = size - output.len();
    // A lower bound of the frame's decoded bytes, whether or not the decoder has released them.
    let mut decoded = 0;
    loop {
        let step = STEP.min(needed - decoded + 1);
        let is_complete = decoder
            .decode_blocks(&mut *data, BlockDecodingStrategy::UptoBytes(step))
            .map_err(|error| damaged(&error))?;
        if !is_complete {
            decoded += step;
        }
        if decoded > needed || decoder.can_collect() > size - output.len() {
            return Err(BadData::Long { size });
        }
        decoder
            .collect_to_writer(&mut *output)
            .map_err(|error| damaged(&error))?;
        if is_complete {
            break;
        }
    }
    let stated = decoder.get_checksum_from_data();
    if stated.is_some() && stated != decoder.get_calculated_checksum() {
        return Err(BadData::Checksum);
    }
    Ok(())
}

/// Decodes one LZ4 frame. The decoder holds a few blocks, at most 4 MiB each (8 MiB in the legacy format).
fn lz4_frame(data: &mut &[u8], output: &mut Vec<u8>, size: usize) -> Result<(), BadData> {
    // One extra byte distinguishes a longer frame from a frame of the stated size. `take` limits the output.
    let needed = (size - output.len()) as u64 + 1;
    Lz4::new(data)
        .take(needed)
        .read_to_end(output)
        .map_err(|error| BadData::Frame(error.to_string()))?;
    if output.len() > size {
        return Err(BadData::Long { size });
    }
    Ok(())
}

/// Decodes all bzip2 streams. The decoder holds a block of at most 900 kB, and what it needs to sort it.
fn bzip2_stream(data: &mut &[u8], output: &mut Vec<u8>, size: usize) -> Result<(), BadData> {
    let needed = (size - output.len()) as u64 + 1;
    bzip2::bufread::MultiBzDecoder::new(data)
        .take(needed)
        .read_to_end(output)
        .map_err(|error| BadData::Frame(error.to_string()))?;
    if output.len() > size {
        return Err(BadData::Long { size });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
