//! Output files that are written atomically.

use std::error::Error;
use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::FileError;

/// Largest number of temporary names that are tried.
const TRIES: u32 = 100;

/// A file that is being written under a temporary name in its folder. It is removed unless [`Draft::keep`] renames
/// it. A device, a pipe, or an output that is already open (`/dev/stdout`) is written directly. If the path is a link
/// to a file, that file is replaced.
#[derive(Debug)]
pub struct Draft {
    /// The open file.
    pub file: File,
    path: PathBuf,
    temporary: Option<PathBuf>,
}

impl Draft {
    pub(super) fn new(path: &Path) -> Result<Self, FileError> {
        let real = path.canonicalize();
        if real.is_err() && path.is_symlink() && path.metadata().is_err() {
            let cause = io::Error::other("a link to a file that does not exist");
            return Err(FileError::unwritten(path, cause));
        }
        let open_already = ["/dev/stdout", "/dev/stderr", "/dev/fd", "/proc"];
        let as_it_is = open_already.iter().any(|root| path.starts_with(root))
            || path
                .metadata()
                .is_ok_and(|data| real.is_err() || !data.is_file());
        let path = real.unwrap_or_else(|_| path.into());
        let opened = if as_it_is {
            File::options()
                .append(true)
                .open(&path)
                .map(|file| (file, None))
        } else {
            temporary(&path).map(|(file, name)| (file, Some(name)))
        };
        let (file, temporary) = opened.map_err(|cause| FileError::unwritten(&path, cause))?;
        Ok(Self {
            file,
            path,
            temporary,
        })
    }

    /// Writes to the file.
    ///
    /// # Errors
    /// [`FileError::Unwritten`] if writing fails.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), FileError> {
        let written = self.file.write_all(bytes);
        written.map_err(|cause| self.fault(cause))
    }

    /// Converts an error of writing to the file, with the file's name.
    #[must_use]
    pub fn fault(&self, cause: impl Into<Box<dyn Error + Send + Sync>>) -> FileError {
        FileError::unwritten(&self.path, io::Error::other(cause))
    }

    /// Renames the file to its final name.
    ///
    /// # Errors
    /// [`FileError::Unwritten`] if the file cannot be synchronized or renamed.
    pub fn keep(mut self) -> Result<(), FileError> {
        let Some(temporary) = &self.temporary else {
            return Ok(());
        };
        let done = self
            .file
            .sync_all()
            .and_then(|()| std::fs::rename(temporary, &self.path));
        done.map_err(|cause| self.fault(cause))?;
        self.temporary = None;
        Ok(())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            // Remove the incomplete file; the first error is the one to report.
            let _ = std::fs::remove_file(temporary);
        }
    }
}

/// Creates a new file in the folder of another file. Never opens an existing file, because it may be an input.
fn temporary(path: &Path) -> io::Result<(File, PathBuf)> {
    for number in 0..TRIES {
        let mut name: OsString = path.file_name().unwrap_or_default().into();
        name.push(format!(".{}-{number}.tmp", std::process::id()));
        let name = path.with_file_name(name);
        match File::options().write(true).create_new(true).open(&name) {
            Err(cause) if cause.kind() == ErrorKind::AlreadyExists => {}
            opened => return Ok((opened?, name)),
        }
    }
    Err(io::Error::other("all temporary names are taken"))
}
