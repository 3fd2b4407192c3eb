//! Reads complete files, up to a stated limit: an endless input (`/dev/zero`, an endless pipe) is an error and does
//! not use all memory.
//!
//! Recordings are read as streams (`log::recording`); there, [`Lines`] limits the length of a line.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// The largest size of a kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// Bytes.
    pub bytes: u64,
    /// Advice if a file is longer.
    pub help: &'static str,
}

const MIB: u64 = 1 << 20;

impl Limit {
    /// A file that a command names: site files, estimates, tables, firmware.
    pub const FILE: Self = Self {
        bytes: 256 * MIB,
        help: "check that it is the correct file; a longer recording is read by `posegate replay`, or in parts",
    };
    /// A map of tags or docks that a site file names.
    pub const MAP: Self = Self {
        bytes: 64 * MIB,
        help: "check that it is the correct file; split the map into several imports",
    };
    /// A learnt model.
    pub const MODEL: Self = Self {
        bytes: 16 * MIB,
        help: "check that it is the correct file; make the model again with `posegate learn`",
    };
    /// A camera's calibration.
    pub const CALIBRATION: Self = Self {
        // PhotonVision adds its observations.
        bytes: 16 * MIB,
        help: "check that it is the correct file; a calibration has some kilobytes",
    };
    /// A finished part or a manifest of a site build.
    pub const PART: Self = Self {
        bytes: 256 * MIB,
        help: "check that it is the correct folder; remove the file and build it again",
    };
}

/// The reason why a file cannot be read completely.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// An error of the operating system.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The file is longer than the limit.
    #[error("it has more than {} MiB, the limit for such a file; {}", .0.bytes / MIB, .0.help)]
    TooLong(Limit),
    /// A pipe or a device instead of a file.
    #[error("it is not a regular file; name a file, or a link to one")]
    NotAFile,
}

impl InputError {
    /// Returns `true` if the file does not exist.
    #[must_use]
    pub fn is_not_found(&self) -> bool {
        matches!(self, Self::Io(cause) if cause.kind() == ErrorKind::NotFound)
    }

    /// Converts the error to an [`io::Error`].
    #[must_use]
    pub fn into_io(self) -> io::Error {
        match self {
            Self::Io(cause) => cause,
            other => io::Error::new(ErrorKind::InvalidData, other),
        }
    }
}

/// Reads a complete file or pipe, up to a limit.
///
/// # Errors
/// [`InputError::Io`], [`InputError::TooLong`].
pub fn read(path: &Path, limit: Limit) -> Result<Vec<u8>, InputError> {
    read_from(File::open(path)?, limit)
}

/// Like [`read`], for files that another file names. Pipes and devices are refused before they are opened, because the
/// read could block forever.
///
/// # Errors
/// [`InputError`] if the file cannot be read, is too long, or is a pipe or a device.
pub fn read_file(path: &Path, limit: Limit) -> Result<Vec<u8>, InputError> {
    let data = path.metadata()?;
    // For a folder, the system's own message is used.
    if !data.is_file() && !data.is_dir() {
        return Err(InputError::NotAFile);
    }
    read(path, limit)
}

/// Reads an input to its end, up to a limit. Allocates memory only for bytes that exist.
///
/// # Errors
/// [`InputError::Io`], [`InputError::TooLong`].
pub fn read_from(input: impl Read, limit: Limit) -> Result<Vec<u8>, InputError> {
    let mut bytes = Vec::new();
    let most = limit.bytes.saturating_add(1);
    if input.take(most).read_to_end(&mut bytes)? as u64 > limit.bytes {
        return Err(InputError::TooLong(limit));
    }
    Ok(bytes)
}

/// A reader of text in lines, which end with a line feed. A line longer than [`Lines::LONGEST`] is
/// an error.
#[derive(Debug)]
pub struct Lines<R> {
    input: R,
    /// Bytes since the last line end.
    since: usize,
}

impl<R: Read> Lines<R> {
    /// Length of the longest line, bytes.
    pub const LONGEST: usize = 1 << 20;

    /// Creates the reader of an input.
    pub const fn new(input: R) -> Self {
        Self { input, since: 0 }
    }
}

impl<R: Read> Read for Lines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.input.read(buffer)?;
        let mut pieces = buffer[..count].split(|byte| *byte == b'\n');
        let mut longest = self.since + pieces.next().map_or(0, <[u8]>::len);
        self.since = longest;
        for piece in pieces {
            self.since = piece.len();
            longest = longest.max(piece.len());
        }
        if longest > Self::LONGEST {
            let message = format!(
                "a line of more than {} bytes: this is not a text file",
                Self::LONGEST
            );
            return Err(io::Error::new(ErrorKind::InvalidData, message));
        }
        Ok(count)
    }
}

/// Returns a text shortened to `most` characters, for messages: names in a file may have any length.
#[must_use]
pub fn shortened(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        None => text.into(),
        Some((end, _)) => format!("{}...", &text[..end]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader, repeat};

    const SHORT: Limit = Limit {
        bytes: 4,
        help: "cut it",
    };

    #[test]
    fn inputs_are_read_up_to_the_limit() {
        assert_eq!(read_from(&b"four"[..], SHORT).unwrap(), b"four");
        assert!(matches!(
            read_from(&b"fours"[..], SHORT),
            Err(InputError::TooLong(limit)) if limit == SHORT
        ));
        let endless = read_from(repeat(0), Limit::CALIBRATION).unwrap_err();
        assert!(
            endless.to_string().starts_with("it has more than 16 MiB"),
            "{endless}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn devices_and_pipes_are_refused() {
        assert!(matches!(
            read_file(Path::new("/dev/zero"), SHORT),
            Err(InputError::NotAFile)
        ));
        assert!(matches!(
            read(Path::new("/dev/zero"), SHORT),
            Err(InputError::TooLong(_))
        ));
        assert!(
            read(Path::new("/nowhere"), SHORT)
                .unwrap_err()
                .is_not_found()
        );
    }

    #[test]
    fn each_line_is_limited() {
        let longest = Lines::<&[u8]>::LONGEST;
        let mut text = std::vec![b'a'; longest];
        text.push(b'\n');
        let twice = [text.as_slice(), text.as_slice()].concat();
        let mut read = Vec::new();
        assert_eq!(
            Lines::new(twice.as_slice()).read_to_end(&mut read).unwrap(),
            twice.len()
        );
        text.insert(0, b'a');
        assert!(Lines::new(text.as_slice()).read_to_end(&mut read).is_err());
        for byte in [0, b'\r'] {
            let mut endless = BufReader::new(Lines::new(repeat(byte).take(4 << 20)));
            assert!(endless.read_until(b'\n', &mut Vec::new()).is_err());
        }
    }

    #[test]
    fn texts_are_cut_between_characters() {
        assert_eq!(shortened("äöü", 3), "äöü");
        assert_eq!(shortened("äöü", 2), "äö...");
    }
}
