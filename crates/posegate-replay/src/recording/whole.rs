//! Files that are compressed as a whole by zstd, unpacked while they are read.

use crate::mcap::chunk::Budget;
use ruzstd::decoding::StreamingDecoder;
use std::io::{BufRead, BufReader, Error, Read};

/// Largest window of a frame, bytes: the limit of libzstd.
const LARGEST_WINDOW: u64 = 1 << 27;

/// A reader of the unpacked bytes. They are at most a thousand times as many as the packed ones.
pub(super) struct Unpacked<R: Read> {
    frame: Option<StreamingDecoder<BufReader<R>, ruzstd::decoding::FrameDecoder>>,
    next: Option<BufReader<R>>,
    budget: Budget,
}

impl<R: Read> Unpacked<R> {
    pub fn new(input: R) -> Self {
        Self {
            frame: None,
            next: Some(BufReader::new(input)),
            budget: Budget::new(),
        }
    }
}

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        loop {
            if let Some(mut input) = self.next.take() {
                if input.fill_buf()?.is_empty() {
                    self.next = Some(input);
                    return Ok(0);
                }
                let frame = StreamingDecoder::new_with_max_window_size(input, LARGEST_WINDOW);
                let frame = frame.map_err(|error| Error::other(format!("zstd: {error}")))?;
                self.frame = Some(frame);
            }
            let Some(frame) = &mut self.frame else {
                return Ok(0);
            };
            let before = frame.decoder.bytes_read_from_source();
            let count = frame.read(buffer)?;
            let packed = frame
                .decoder
                .bytes_read_from_source()
                .saturating_sub(before);
            let spent = self.budget.spend(count as u64, packed as usize);
            spent.map_err(|error| Error::other(error.to_string()))?;
            if count > 0 || buffer.is_empty() {
                return Ok(count);
            }
            // Another frame may follow.
            self.next = self.frame.take().map(StreamingDecoder::into_inner);
        }
    }
}
