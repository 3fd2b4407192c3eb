//! Output files that are written whole or not at all.

use std::error::Error;
use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::FileError;

/// Temporary names that are tried.
const TRIES: u32 = 100;

/// A file that is being written under a temporary name in its folder. It is removed unless [`Draft::keep`] renames it. A device, a pipe,
/// or an output that is open already (`/dev/stdout`) is written to directly. If the path is a link to a file, that file is replaced.
#[derive(Debug)]
pub struct Draft {
    /// What is written to.
    pub file: File,
    path: PathBuf,
    temporary: Option<PathBuf>,
}

impl Draft {
    pub(super) fn new(path: &Path) -> Result<Self, FileError> {
        let real = path.canonicalize();
        if real.is_err() && path.is_symlink() && path.metadata().is_err() {
            let cause = io::Error::other("a link that leads to no file");
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
    /// [`FileError::Unwritten`].
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), FileError> {
        let written = self.file.write_all(bytes);
        written.map_err(|cause| self.fault(cause))
    }

    /// An error of writing to it, with its name.
    #[must_use]
    pub fn fault(&self, cause: impl Into<Box<dyn Error + Send + Sync>>) -> FileError {
        FileError::unwritten(&self.path, io::Error::other(cause))
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// [`FileError::Unwritten`].
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
            // What is left of the attempt goes; the first error is the one to report.
            let _ = std::fs::remove_file(temporary);
        }
    }
}

/// A new file in the folder of another one. A file that exists is never opened: it may be an input.
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
