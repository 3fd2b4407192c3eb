//! Plain CDR, the encoding of ROS 2 messages: numbers aligned to their size, texts and sequences after their length.
//!
//! Entry point: [`Cdr`]. It reserves nothing: every length is compared with the bytes that are there.

use crate::mcap::records::LONGEST_NAME;
use std::str;

/// The reason why bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum BadCdr {
    #[error("the message ends before its last field")]
    Short,
    #[error("a text of the message is not UTF-8")]
    NotText,
    #[error("a name in the message has more than {LONGEST_NAME} bytes")]
    Long,
}

/// The fields of a message, read from its start. Alignment counts from there.
pub(super) struct Cdr<'b> {
    body: &'b [u8],
    at: usize,
    is_big_endian: bool,
    /// ROS 1's own encoding: no alignment, and texts without a NUL.
    is_ros1: bool,
}

impl<'b> Cdr<'b> {
    /// `body` begins after the four bytes of the encapsulation header.
    pub(super) const fn new(body: &'b [u8], is_big_endian: bool) -> Self {
        Self {
            body,
            at: 0,
            is_big_endian,
            is_ros1: false,
        }
    }

    /// Reads a message of ROS 1, which has no encapsulation header.
    pub(super) const fn ros1(body: &'b [u8]) -> Self {
        Self {
            body,
            at: 0,
            is_big_endian: false,
            is_ros1: true,
        }
    }

    pub(super) const fn is_ros1(&self) -> bool {
        self.is_ros1
    }

    /// Returns the number of bytes after the last field that was read.
    pub(super) const fn left(&self) -> usize {
        self.body.len().saturating_sub(self.at)
    }

    fn bytes(&mut self, length: usize) -> Result<&'b [u8], BadCdr> {
        let rest = self.body.get(self.at..).ok_or(BadCdr::Short)?;
        let taken = rest.get(..length).ok_or(BadCdr::Short)?;
        self.at += length;
        Ok(taken)
    }

    /// Reads a number of `N` bytes, in little-endian order.
    fn number<const N: usize>(&mut self) -> Result<[u8; N], BadCdr> {
        if !self.is_ros1 {
            self.at = self.at.next_multiple_of(N);
        }
        let mut number = [0; N];
        number.copy_from_slice(self.bytes(N)?);
        if self.is_big_endian {
            number.reverse();
        }
        Ok(number)
    }

    pub(super) fn u32(&mut self) -> Result<u32, BadCdr> {
        self.number().map(u32::from_le_bytes)
    }

    pub(super) fn i32(&mut self) -> Result<i32, BadCdr> {
        self.number().map(i32::from_le_bytes)
    }

    /// Reads an array of `float64`, or the same number of fields.
    pub(super) fn floats<const N: usize>(&mut self) -> Result<[f64; N], BadCdr> {
        let mut floats = [0.0; N];
        for float in &mut floats {
            *float = f64::from_le_bytes(self.number()?);
        }
        Ok(floats)
    }

    /// Reads the rows of an array of `float64`.
    pub(super) fn rows<const N: usize, const M: usize>(&mut self) -> Result<[[f64; N]; M], BadCdr> {
        let mut rows = [[0.0; N]; M];
        for row in &mut rows {
            *row = self.floats()?;
        }
        Ok(rows)
    }

    /// Reads a text that will be stored, such as a frame's name: at most [`LONGEST_NAME`] bytes.
    pub(super) fn name(&mut self) -> Result<&'b str, BadCdr> {
        let text = self.text()?;
        if text.len() > LONGEST_NAME {
            return Err(BadCdr::Long);
        }
        Ok(text)
    }

    /// Reads a text. Its length counts the NUL at its end; some writers give an empty text the length 0.
    pub(super) fn text(&mut self) -> Result<&'b str, BadCdr> {
        let length = usize::try_from(self.u32()?).map_err(|_| BadCdr::Short)?;
        let bytes = self.bytes(length)?;
        let text = match bytes.split_last() {
            Some((_, text)) if !self.is_ros1 => text,
            _ => bytes,
        };
        str::from_utf8(text).map_err(|_| BadCdr::NotText)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_above_the_limit_are_refused() {
        for (length, is_name) in [(LONGEST_NAME, true), (LONGEST_NAME + 1, false)] {
            let mut bytes = (length as u32 + 1).to_le_bytes().to_vec();
            bytes.resize(4 + length, b'a');
            bytes.push(0);
            assert_eq!(Cdr::new(&bytes, false).name().is_ok(), is_name);
            assert!(Cdr::new(&bytes, false).text().is_ok());
        }
    }

    #[test]
    fn numbers_are_aligned_to_their_size() {
        let mut bytes = [0; 24];
        (bytes[0], bytes[4]) = (7, 9);
        bytes[16..].copy_from_slice(&1.5f64.to_le_bytes());
        let mut cdr = Cdr::new(&bytes, false);
        assert_eq!((cdr.i32(), cdr.u32()), (Ok(7), Ok(9)));
        assert_eq!(cdr.u32(), Ok(0));
        assert_eq!(cdr.floats(), Ok([1.5]));
        assert_eq!(cdr.left(), 0);
        assert_eq!(cdr.u32(), Err(BadCdr::Short));
        let mut cdr = Cdr::new(&[0, 0, 1, 2], true);
        assert_eq!(cdr.u32(), Ok(0x102));
    }

    #[test]
    fn text_excludes_its_nul() {
        let text = |bytes: &[u8]| Cdr::new(bytes, false).text().map(str::len);
        assert_eq!(text(&[4, 0, 0, 0, b'm', b'a', b'p', 0]), Ok(3));
        assert_eq!(text(&[1, 0, 0, 0, 0]), Ok(0));
        assert_eq!(text(&[0, 0, 0, 0]), Ok(0));
        assert_eq!(text(&[2, 0, 0, 0, 0xff, 0]), Err(BadCdr::NotText));
        for length in [2, 1 << 31, u32::MAX] {
            let bytes = [&length.to_le_bytes()[..], &[0]].concat();
            assert_eq!(text(&bytes), Err(BadCdr::Short));
        }
    }
}
