//! Reads files whole, up to a stated limit: an input without an end (`/dev/zero`, a pipe that goes on) is an error, not all memory.
//!
//! Recordings are read as streams (`log::recording`); what is limited there is a line, by [`Lines`].

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// The most that is read of a kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// Bytes.
    pub bytes: u64,
    /// What to do about a file that is longer.
    pub help: &'static str,
}

const MIB: u64 = 1 << 20;

impl Limit {
    /// A file that a command names: site files, estimates, tables, firmware.
    pub const FILE: Self = Self {
        bytes: 256 * MIB,
        help: "check that it is the file that is meant; a longer recording is read by `posegate replay`, or in parts",
    };
    /// A map of tags or docks that a site file names.
    pub const MAP: Self = Self {
        bytes: 64 * MIB,
        help: "check that it is the file that is meant; cut the map into several imports",
    };
    /// A learnt model.
    pub const MODEL: Self = Self {
        bytes: 16 * MIB,
        help: "check that it is the file that is meant; make the model again with `posegate learn`",
    };
    /// A camera's calibration.
    pub const CALIBRATION: Self = Self {
        bytes: MIB,
        help: "check that it is the file that is meant; a calibration has some kilobytes",
    };
    /// A finished part or a manifest of a site build.
    pub const PART: Self = Self {
        bytes: 256 * MIB,
        help: "check that it is the folder that is meant; remove the file and build it again",
    };
}

/// Why a file cannot be read whole.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// The system's answer.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It is longer than the limit.
    #[error("it has more than {} MiB, which is the most that is read of such a file; {}", .0.bytes / MIB, .0.help)]
    TooLong(Limit),
    /// A pipe or a device where a file is needed.
    #[error("it is not a regular file; name a file, or a link to one")]
    NotAFile,
}

impl InputError {
    /// Whether there is no such file.
    #[must_use]
    pub fn is_not_found(&self) -> bool {
        matches!(self, Self::Io(cause) if cause.kind() == ErrorKind::NotFound)
    }

    /// The same as an error of the system.
    #[must_use]
    pub fn into_io(self) -> io::Error {
        match self {
            Self::Io(cause) => cause,
            other => io::Error::new(ErrorKind::InvalidData, other),
        }
    }
}

/// Reads a file or a pipe whole, up to a limit.
///
/// # Errors
/// [`InputError::Io`], [`InputError::TooLong`].
pub fn read(path: &Path, limit: Limit) -> Result<Vec<u8>, InputError> {
    read_from(File::open(path)?, limit)
}

/// The same for files that another file names: pipes and devices are refused before they are opened, because nobody may write to
/// them.
///
/// # Errors
/// [`InputError`].
pub fn read_file(path: &Path, limit: Limit) -> Result<Vec<u8>, InputError> {
    let data = path.metadata()?;
    // The system's own words for a folder.
    if !data.is_file() && !data.is_dir() {
        return Err(InputError::NotAFile);
    }
    read(path, limit)
}

/// Reads an input to its end, up to a limit. Nothing is reserved for bytes that are not there.
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

/// A text of lines, which end with a line feed or a carriage return: one that is longer than [`Lines::LONGEST`] is an error.
#[derive(Debug)]
pub struct Lines<R> {
    input: R,
    /// Bytes since the last line end.
    since: usize,
}

impl<R: Read> Lines<R> {
    /// The longest line, bytes.
    pub const LONGEST: usize = 1 << 20;

    /// The lines of an input.
    pub const fn new(input: R) -> Self {
        Self { input, since: 0 }
    }
}

impl<R: Read> Read for Lines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.input.read(buffer)?;
        let mut pieces = buffer[..count].split(|byte| matches!(byte, b'\n' | b'\r'));
        let mut longest = self.since + pieces.next().map_or(0, <[u8]>::len);
        self.since = longest;
        for piece in pieces {
            self.since = piece.len();
            longest = longest.max(piece.len());
        }
        if longest > Self::LONGEST {
            let message = format!(
                "a line of more than {} bytes: this is no text of lines",
                Self::LONGEST
            );
            return Err(io::Error::new(ErrorKind::InvalidData, message));
        }
        Ok(count)
    }
}

/// A text that is shortened to so many characters, for messages: whoever wrote the file decides how long its names are.
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
            endless.to_string().starts_with("it has more than 1 MiB"),
            "{endless}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_no_files() {
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
    fn lines_are_limited_one_by_one() {
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
        let mut endless = BufReader::new(Lines::new(repeat(0)));
        assert!(endless.read_until(b'\n', &mut Vec::new()).is_err());
    }

    #[test]
    fn texts_are_cut_between_characters() {
        assert_eq!(shortened("äöü", 3), "äöü");
        assert_eq!(shortened("äöü", 2), "äö...");
    }
}
