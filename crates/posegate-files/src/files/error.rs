//! Errors of reading and writing files.

use std::io;
use std::path::Path;
use std::str::Utf8Error;

/// The reason why a file is not read or not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// An input cannot be read.
    #[error("{name}: {cause}")]
    Unread {
        /// The file's name.
        name: String,
        /// The reason.
        cause: io::Error,
    },
    /// An input is not text in UTF-8.
    #[error("{name}: not UTF-8: {cause}")]
    NotText {
        /// The file's name.
        name: String,
        /// The place of the first wrong byte.
        cause: Utf8Error,
    },
    /// An output cannot be written.
    #[error("{name}: {cause}")]
    Unwritten {
        /// The file's name.
        name: String,
        /// The reason.
        cause: io::Error,
    },
    /// An output is an input of the same command.
    #[error("the output {output} would replace the input {input}: they are the same file")]
    ReplacesInput {
        /// The output.
        output: String,
        /// The input.
        input: String,
    },
    /// Two outputs are the same file.
    #[error("the outputs {one} and {other} are the same file")]
    OneForTwo {
        /// The first.
        one: String,
        /// The second.
        other: String,
    },
    /// More than one argument is standard input.
    #[error("standard input can be read only once")]
    StandardInputTwice,
    /// Standard output cannot be written.
    #[error("standard output cannot be written: {0}")]
    StandardOutput(io::Error),
    /// Standard output is closed: its reader has ended (`| head`).
    #[error("standard output is closed")]
    Closed,
}

impl FileError {
    pub(super) fn unwritten(path: &Path, cause: io::Error) -> Self {
        Self::Unwritten {
            name: path.display().to_string(),
            cause,
        }
    }

    /// Returns advice for the user.
    #[must_use]
    pub const fn help(&self) -> &'static str {
        match self {
            Self::Unread { .. } => "check the path; `-` reads standard input",
            Self::NotText { .. } => "save the file in the encoding UTF-8",
            Self::Unwritten { .. } => "check that the folder exists and can be written",
            Self::ReplacesInput { .. } => "name another output",
            Self::OneForTwo { .. } => "name another file for one of them",
            Self::StandardInputTwice => "use files for the other inputs",
            Self::StandardOutput(_) => "redirect it to a file on a disk with free space",
            Self::Closed => "let the reader of the pipe read to the end",
        }
    }
}
