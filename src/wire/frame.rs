//! Frames: COBS and a checksum around a body.

use super::cobs;
use super::{Frame, LONGEST_BODY, WireError};
use crate::table::checksum;
use heapless::Vec;

/// Returns the frame of a body of at most [`LONGEST_BODY`] bytes, with the closing zero. For a longer body
/// the frame is empty.
#[must_use]
pub fn encode(body: &[u8]) -> Frame {
    // The body is not cut, because the checksum can hold for a cut body: after four bytes 0xff it does not
    // count zeros.
    if body.len() > LONGEST_BODY {
        return Frame::new();
    }
    let mut plain: Vec<u8, { LONGEST_BODY + 4 }> = Vec::new();
    let _ = cobs::append(&mut plain, body);
    let _ = cobs::append(&mut plain, &checksum(body).to_le_bytes());
    // A body of this length always has an encoding. Without one the frame would be empty.
    cobs::encode(&plain).unwrap_or_default()
}

/// Collects bytes of a serial line into frames.
#[derive(Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Receiver {
    bytes: Frame,
    overlong: bool,
}

impl Receiver {
    /// Returns an empty receiver.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bytes: Frame::new(),
            overlong: false,
        }
    }

    /// Takes one byte. At the end of a frame, returns its body or the reason why it has none. Empty frames
    /// (a zero after a zero) are skipped, so a sender may begin with a zero to clear the line.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame, WireError>> {
        if byte != 0 {
            self.overlong |= self.bytes.push(byte).is_err();
            return None;
        }
        let overlong = core::mem::take(&mut self.overlong);
        let bytes = core::mem::take(&mut self.bytes);
        if overlong {
            return Some(Err(WireError::Frame));
        }
        (!bytes.is_empty()).then(|| open(&bytes))
    }
}

/// Returns the body of a frame without its zero.
fn open(bytes: &Frame) -> Result<Frame, WireError> {
    let mut plain = cobs::decode(bytes).ok_or(WireError::Frame)?;
    let (body, crc) = plain.split_last_chunk::<4>().ok_or(WireError::Frame)?;
    if u32::from_le_bytes(*crc) != checksum(body) {
        return Err(WireError::Checksum);
    }
    let length = body.len();
    plain.truncate(length);
    Ok(plain)
}
