//! The folder that shards write into.

use std::fs::{File, OpenOptions};
use std::io;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::digest::digest_of;
use super::error::FleetError;
use super::manifest::{MANIFEST, PARTS, RESULTS, is_merged};
use super::random::random;
use super::shard::Shard;
use crate::input::{self, Limit};

/// How old what was half written is when nobody writes it any more.
const STALE_AFTER: Duration = Duration::from_secs(24 * 60 * 60);

/// The folder `parts` of an output folder.
pub(super) struct Store {
    folder: PathBuf,
    /// How the names of its temporary files begin, which nobody else's do, and how many there were.
    draft: String,
    drafts: AtomicU64,
}

pub(super) fn fault(path: &Path) -> impl FnOnce(io::Error) -> FleetError + '_ {
    |cause| FleetError::File {
        path: path.into(),
        cause,
    }
}

impl Store {
    /// Opens the parts of an output folder, for reading.
    pub(super) fn of(output: &Path) -> Result<Self, FleetError> {
        if output.exists() && !output.is_dir() {
            return Err(FleetError::NoFolder(output.into()));
        }
        Ok(Self {
            folder: output.join(PARTS),
            draft: String::new(),
            drafts: AtomicU64::new(0),
        })
    }

    /// Whether there are parts at all.
    pub(super) fn is_there(&self) -> bool {
        self.folder.is_dir()
    }

    /// Opens them for a shard to write to, makes them where they are missing, and clears away what shards that were killed a
    /// day ago or more have left half written: what is younger another process may be writing, of the same shard too.
    pub(super) fn for_shard(output: &Path, shard: Shard) -> Result<Self, FleetError> {
        let mut store = Self::of(output)?;
        if !store.is_there() {
            // Results of a merge have no need of their parts.
            let others = RESULTS.into_iter().chain([MANIFEST]);
            let merged = is_merged(output)?;
            for name in others {
                if !merged && output.join(name).exists() {
                    return Err(FleetError::Foreign {
                        folder: output.into(),
                        name,
                    });
                }
            }
            std::fs::create_dir_all(&store.folder).map_err(fault(&store.folder))?;
        }
        for name in store.names()? {
            if name.starts_with('.') && name.ends_with(".tmp") && store.is_forsaken(&name) {
                store.remove(&name)?;
            }
        }
        let (process, random) = (std::process::id(), random());
        store.draft = format!(
            ".{}-of-{}.{process}-{random:016x}",
            shard.index(),
            shard.count()
        );
        Ok(store)
    }

    /// Whether a file has not been written to for long.
    fn is_forsaken(&self, name: &str) -> bool {
        let changed = std::fs::symlink_metadata(self.path(name)).and_then(|data| data.modified());
        // What is of the future by this clock is young.
        let age = changed.ok().and_then(|changed| changed.elapsed().ok());
        age.is_some_and(|age| age >= STALE_AFTER)
    }

    /// The path of a file in it.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// The names in it, in order.
    pub(super) fn names(&self) -> Result<Vec<String>, FleetError> {
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

    /// The bytes of a file; `None` where it is not there.
    pub(super) fn read(&self, name: &str) -> Result<Option<Vec<u8>>, FleetError> {
        let path = self.path(name);
        match input::read_file(&path, Limit::PART) {
            Err(cause) if cause.is_not_found() => Ok(None),
            bytes => bytes
                .map(Some)
                .map_err(|cause| fault(&path)(cause.into_io())),
        }
    }

    /// The SHA-256 of a file; `None` where it is not there.
    pub(super) fn sha256(&self, name: &str) -> Result<Option<String>, FleetError> {
        let path = self.path(name);
        match digest_of(&path) {
            Err(cause) if cause.kind() == ErrorKind::NotFound => Ok(None),
            digest => digest.map(Some).map_err(fault(&path)),
        }
    }

    /// Removes a file where it is there.
    pub(super) fn remove(&self, name: &str) -> Result<(), FleetError> {
        let path = self.path(name);
        match std::fs::remove_file(&path) {
            Err(cause) if cause.kind() != ErrorKind::NotFound => Err(fault(&path)(cause)),
            _ => Ok(()),
        }
    }

    /// Writes a file whole or not at all: to a temporary name beside it, to the disk, then renamed.
    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), FleetError> {
        self.write_by(name, |file| file.write_all(bytes))
    }

    /// Writes a value as JSON with a line end ([`json`]), whole or not at all.
    pub(super) fn write_json(&self, name: &str, value: &impl Serialize) -> Result<(), FleetError> {
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
    ) -> Result<(), FleetError> {
        let number = self.drafts.fetch_add(1, Ordering::Relaxed);
        let draft = self.path(&format!("{}-{number}.tmp", self.draft));
        let path = self.path(name);
        // What another process has made is not this one's to remove.
        let file = new(&draft).map_err(fault(&path))?;
        let done = filled(file, write).and_then(|()| renamed(&draft, &path));
        if done.is_err() {
            // What is left of the attempt goes; the first error is the one to report.
            let _ = std::fs::remove_file(&draft);
        }
        done.map_err(fault(&path))
    }

    /// Sees that names are on the disk as well as bytes.
    pub(super) fn settle(&self) -> Result<(), FleetError> {
        settled(&self.folder)
    }
}

/// Sees that the names in a folder are on the disk.
pub(super) fn settled(folder: &Path) -> Result<(), FleetError> {
    #[cfg(test)]
    super::journal::step("sync", folder).map_err(fault(folder))?;
    let open = File::open(folder).map_err(fault(folder))?;
    open.sync_all().map_err(fault(folder))
}

/// Renames a file or a folder.
pub(super) fn renamed(from: &Path, to: &Path) -> io::Result<()> {
    #[cfg(test)]
    super::journal::step("rename", to)?;
    std::fs::rename(from, to)
}

/// Writes a new file to the disk.
pub(super) fn written(path: &Path, bytes: &[u8]) -> io::Result<()> {
    filled(new(path)?, |file| file.write_all(bytes))
}

/// A file that was not there.
fn new(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).create_new(true).open(path)
}

fn filled(mut file: File, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    write(&mut file)?;
    file.sync_all()
}

/// Writes a value as JSON with a line end: a large one is never in memory as text.
pub(super) fn json(mut to: impl Write, value: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut to, value)?;
    to.write_all(b"\n")
}

/// A value from JSON.
pub(super) fn parsed<T: DeserializeOwned>(bytes: &[u8], path: &Path) -> Result<T, FleetError> {
    serde_json::from_slice(bytes).map_err(damaged(path))
}

fn damaged(path: &Path) -> impl FnOnce(serde_json::Error) -> FleetError + '_ {
    |why| FleetError::Damaged {
        path: path.into(),
        why: format!("{why}"),
    }
}
