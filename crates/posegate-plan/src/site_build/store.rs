//! A folder whose files are written atomically.

use std::fs::{File, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::error::SiteBuildError;
use posegate_files::input::{self, Limit};

/// First bytes of the names of temporary files.
const TEMPORARY: &str = ".posegate-";
/// Age at which no process writes to a temporary file any more: its process was killed.
pub(super) const STALE_AFTER: Duration = Duration::from_secs(24 * 60 * 60);

/// A folder that processes on several machines may write to in parallel.
pub(super) struct Store {
    folder: PathBuf,
    /// Prefix of the names of this store's temporary files. It is random, because processes in containers share their numbers.
    prefix: String,
    written: AtomicU64,
}

/// Returns a function that adds a path to an error of the system.
pub(super) fn fault(path: &Path) -> impl FnOnce(io::Error) -> SiteBuildError + '_ {
    |cause| SiteBuildError::File {
        path: path.into(),
        cause,
    }
}

impl Store {
    /// Returns a store of a folder, which need not exist.
    pub(super) fn new(folder: PathBuf) -> Self {
        let random = RandomState::new().hash_one((std::process::id(), SystemTime::now()));
        Self {
            folder,
            prefix: format!("{TEMPORARY}{random:016x}"),
            written: AtomicU64::new(0),
        }
    }

    /// Returns the folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the path of a file in the folder.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Returns the names in the folder, sorted; empty if it does not exist.
    pub(super) fn names(&self) -> Result<Vec<String>, SiteBuildError> {
        let entries = match std::fs::read_dir(&self.folder) {
            Err(cause) if cause.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries.map_err(fault(&self.folder))?,
        };
        let mut names = Vec::new();
        for entry in entries {
            let entry = entry.map_err(fault(&self.folder))?;
            names.extend(entry.file_name().into_string());
        }
        names.sort();
        Ok(names)
    }

    /// Returns the bytes of a file; `None` if it does not exist.
    pub(super) fn read(&self, name: &str) -> Result<Option<Vec<u8>>, SiteBuildError> {
        let path = self.path(name);
        match input::read_file(&path, Limit::PART) {
            Err(cause) if cause.is_not_found() => Ok(None),
            bytes => bytes
                .map(Some)
                .map_err(|cause| fault(&path)(cause.into_io())),
        }
    }

    /// Removes a file if it exists.
    pub(super) fn remove(&self, name: &str) -> Result<(), SiteBuildError> {
        let path = self.path(name);
        match std::fs::remove_file(&path) {
            Err(cause) if cause.kind() != ErrorKind::NotFound => Err(fault(&path)(cause)),
            _ => Ok(()),
        }
    }

    /// Removes temporary files that have not changed for `age`. A running process may write to files younger than [`STALE_AFTER`].
    pub(super) fn remove_temporary(&self, age: Duration) -> Result<(), SiteBuildError> {
        for name in self.names()? {
            if name.starts_with(TEMPORARY) && name.ends_with(".tmp") && self.is_older(&name, age) {
                self.remove(&name)?;
            }
        }
        Ok(())
    }

    fn is_older(&self, name: &str, than: Duration) -> bool {
        let changed = std::fs::symlink_metadata(self.path(name)).and_then(|data| data.modified());
        // A modification time in the future gives no age, so the file is kept.
        let age = changed.ok().and_then(|changed| changed.elapsed().ok());
        age.is_some_and(|age| age >= than)
    }

    /// Writes a file atomically: under a temporary name, to the disk, then renamed. `name` may be in a subfolder.
    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), SiteBuildError> {
        self.write_by(name, |file| file.write_all(bytes))
    }

    /// Writes a value atomically by [`json`].
    pub(super) fn write_json(
        &self,
        name: &str,
        value: &impl Serialize,
    ) -> Result<(), SiteBuildError> {
        self.write_by(name, |file| {
            let mut buffer = BufWriter::new(file);
            json(&mut buffer, value)?;
            buffer.flush()
        })
    }

    fn write_by(
        &self,
        name: &str,
        write: impl FnOnce(&mut File) -> io::Result<()>,
    ) -> Result<(), SiteBuildError> {
        let number = self.written.fetch_add(1, Ordering::Relaxed);
        let temporary = self.path(&format!("{}-{number}.tmp", self.prefix));
        let path = self.path(name);
        let new = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&temporary);
        let mut file = new.map_err(fault(&path))?;
        let done = write(&mut file)
            .and_then(|()| file.sync_all())
            .and_then(|()| std::fs::rename(&temporary, &path));
        if done.is_err() {
            // The first error is the one to report.
            let _ = std::fs::remove_file(&temporary);
        }
        done.map_err(fault(&path))
    }

    /// Synchronizes the names in the folder to the disk.
    pub(super) fn sync(&self) -> Result<(), SiteBuildError> {
        sync(&self.folder)
    }
}

/// Synchronizes the names in a folder to the disk.
pub(super) fn sync(folder: &Path) -> Result<(), SiteBuildError> {
    let done = File::open(folder).and_then(|open| open.sync_all());
    done.map_err(fault(folder))
}

/// Writes a value as JSON with a line end. Memory does not hold the complete text.
pub(super) fn json(mut to: impl Write, value: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut to, value)?;
    to.write_all(b"\n")
}

/// Reads a value from JSON.
///
/// # Errors
/// [`SiteBuildError::Damaged`] if the bytes are not such a value.
pub(super) fn parsed<T: DeserializeOwned>(bytes: &[u8], path: &Path) -> Result<T, SiteBuildError> {
    serde_json::from_slice(bytes).map_err(|why| SiteBuildError::Damaged {
        path: path.into(),
        why: format!("{why}"),
    })
}
