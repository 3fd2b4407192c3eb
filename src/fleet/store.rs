//! The folder that shards write into.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::string::String;
use std::sync::atomic::{AtomicU64, Ordering};
use std::vec::Vec;
use std::{format, io};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::error::FleetError;
use super::shard::Shard;

/// What is in the folder of the results, without the parts.
pub(super) const RESULTS: [&str; 3] = ["tables", "proofs", "plans"];
/// The list of the results.
pub(super) const MANIFEST: &str = "manifest.json";
/// What shards write.
const PARTS: &str = "parts";

/// The folder `parts` of an output folder.
pub(super) struct Store {
    folder: PathBuf,
    /// How temporary files begin, and how many there were.
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
            draft: format!(".merge.{}", std::process::id()),
            drafts: AtomicU64::new(0),
        })
    }

    /// Opens them for a shard to write to, makes them where they are missing, and clears away what a shard of the same
    /// number that was killed has left half written.
    pub(super) fn for_shard(output: &Path, shard: Shard) -> Result<Self, FleetError> {
        let mut store = Self::of(output)?;
        if !store.folder.is_dir() {
            let others = RESULTS.into_iter().chain([MANIFEST]);
            for name in others {
                if output.join(name).exists() {
                    return Err(FleetError::Foreign {
                        folder: output.into(),
                        name,
                    });
                }
            }
            std::fs::create_dir_all(&store.folder).map_err(fault(&store.folder))?;
        }
        let own = format!(".{}-of-{}.", shard.index(), shard.count());
        for name in store.names()? {
            if name.starts_with(&own) {
                store.remove(&name)?;
            }
        }
        store.draft = format!("{own}{}", std::process::id());
        Ok(store)
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
        match std::fs::read(&path) {
            Err(cause) if cause.kind() == ErrorKind::NotFound => Ok(None),
            bytes => bytes.map(Some).map_err(fault(&path)),
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
        let number = self.drafts.fetch_add(1, Ordering::Relaxed);
        let draft = self.path(&format!("{}-{number}.tmp", self.draft));
        let path = self.path(name);
        let done = written(&draft, bytes).and_then(|()| std::fs::rename(&draft, &path));
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
    let open = File::open(folder).map_err(fault(folder))?;
    open.sync_all().map_err(fault(folder))
}

/// Writes a new file to the disk.
pub(super) fn written(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// A value as JSON with a line end.
pub(super) fn json(value: &impl Serialize, path: &Path) -> Result<Vec<u8>, FleetError> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(damaged(path))?;
    bytes.push(b'\n');
    Ok(bytes)
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
