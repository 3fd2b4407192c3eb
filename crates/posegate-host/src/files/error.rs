//! Why a file is not read or not written.

use std::io;
use std::path::Path;

/// Why a file is not read or not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// An input that cannot be read.
    #[error("{name}: {cause}")]
    Unread {
        /// Its name.
        name: String,
        /// Why.
        cause: io::Error,
    },
    /// An output that cannot be written.
    #[error("{name}: {cause}")]
    Unwritten {
        /// Its name.
        name: String,
        /// Why.
        cause: io::Error,
    },
    /// An output that is an input of the same command.
    #[error("the output {output} would replace the input {input}: they are the same file")]
    ReplacesInput {
        /// The output.
        output: String,
        /// The input.
        input: String,
    },
    /// Two outputs that are one file.
    #[error("the outputs {one} and {other} are the same file")]
    OneForTwo {
        /// The first.
        one: String,
        /// The second.
        other: String,
    },
    /// More than one argument that is standard input.
    #[error("standard input can be read once only")]
    StandardInputTwice,
    /// Standard output that cannot be written.
    #[error("standard output cannot be written: {0}")]
    StandardOutput(io::Error),
    /// Standard output whose reader has ended (`| head`).
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

    /// What to do about it.
    #[must_use]
    pub const fn help(&self) -> &'static str {
        match self {
            Self::Unread { .. } => "check the path; `-` reads standard input",
            Self::Unwritten { .. } => "check that the folder exists and can be written",
            Self::ReplacesInput { .. } => "name another output",
            Self::OneForTwo { .. } => "name another file for one of them",
            Self::StandardInputTwice => "give files for the others",
            Self::StandardOutput(_) => "redirect it to a file on a disk with free space",
            Self::Closed => "let the reader of the pipe read to the end",
        }
    }
}
