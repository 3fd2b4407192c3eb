//! Results on their way: a folder beside them, and how new results take the place of old ones.

use std::fs::DirBuilder;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::error::FleetError;
use super::manifest::{MANIFEST, RESULTS};
use super::random::random;
use super::store::{fault, renamed, settled, written};

/// How the names of stages begin.
const NAME: &str = ".merge-";
/// Where a stage holds the results of a merge before. While it is there, new results are on their way; while the stage's own
/// manifest is there, they have not arrived.
const BEFORE: &str = "before";

/// A folder beside the results, on their disk, in which a merge writes new ones.
pub(super) struct Stage {
    output: PathBuf,
    folder: PathBuf,
}

impl Stage {
    /// A new one.
    pub(super) fn new(output: &Path) -> Result<Self, FleetError> {
        let folder = output.join(format!("{NAME}{:016x}", random()));
        made(&folder)?;
        for name in RESULTS {
            made(&folder.join(name))?;
        }
        Ok(Self {
            output: output.into(),
            folder,
        })
    }

    /// Those that merges that were killed have left. To be called by whoever has the lock.
    pub(super) fn stale(output: &Path) -> Result<Vec<Self>, FleetError> {
        let mut found = Vec::new();
        for entry in std::fs::read_dir(output).map_err(fault(output))? {
            let entry = entry.map_err(fault(output))?;
            let name = entry.file_name();
            let own = |name: &str| name.strip_prefix(NAME).is_some_and(|rest| rest.len() == 16);
            let kind = entry.file_type().map_err(fault(output))?;
            if kind.is_dir() && name.to_str().is_some_and(own) {
                found.push(Self {
                    output: output.into(),
                    folder: entry.path(),
                });
            }
        }
        Ok(found)
    }

    /// The place of a file in it.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Puts all that was staged in the place of the results of a merge before. `folders` are those within the folders of the
    /// results. There is a manifest only where all of its files are, on the disk too.
    ///
    /// # Errors
    /// [`FleetError::File`]; then [`put_back`](Self::put_back) is to be called.
    pub(super) fn put_in_place(
        &self,
        manifest: &[u8],
        folders: &[PathBuf],
    ) -> Result<(), FleetError> {
        let draft = self.path(MANIFEST);
        written(&draft, manifest).map_err(fault(&draft))?;
        for folder in folders {
            settled(folder)?;
        }
        for name in RESULTS {
            settled(&self.path(name))?;
        }
        let before = self.path(BEFORE);
        made(&before)?;
        settled(&self.folder)?;
        settled(&self.output)?;
        let own = self.output.join(MANIFEST);
        if_there(&own, &before.join(MANIFEST))?;
        settled(&before)?;
        settled(&self.output)?;
        for name in RESULTS {
            let own = self.output.join(name);
            if_there(&own, &before.join(name))?;
            renamed(&self.path(name), &own).map_err(fault(&own))?;
        }
        for folder in [&before, &self.folder, &self.output] {
            settled(folder)?;
        }
        renamed(&draft, &own).map_err(fault(&own))?;
        settled(&self.output)
    }

    /// Where new results were on their way and have not arrived, puts those before where they were. Nothing is lost where
    /// this ends early too: it is to be called again.
    ///
    /// # Errors
    /// [`FleetError::File`]; then the stage may hold the only copy of results.
    pub(super) fn put_back(&self) -> Result<(), FleetError> {
        let before = self.path(BEFORE);
        if !(before.exists() && self.path(MANIFEST).exists()) {
            return Ok(());
        }
        for name in RESULTS {
            let (staged, own) = (self.path(name), self.output.join(name));
            if !staged.exists() {
                if_there(&own, &staged)?;
            }
            if_there(&before.join(name), &own)?;
        }
        if_there(&before.join(MANIFEST), &self.output.join(MANIFEST))?;
        settled(&self.output)?;
        // From here on the stage is waste.
        std::fs::remove_dir(&before).map_err(fault(&before))?;
        settled(&self.folder)
    }

    /// Removes it.
    pub(super) fn clear(&self) -> Result<(), FleetError> {
        #[cfg(test)]
        super::journal::step("remove", &self.folder).map_err(fault(&self.folder))?;
        match std::fs::remove_dir_all(&self.folder) {
            Err(cause) if cause.kind() != ErrorKind::NotFound => Err(fault(&self.folder)(cause)),
            _ => Ok(()),
        }
    }
}

fn made(folder: &Path) -> Result<(), FleetError> {
    DirBuilder::new().create(folder).map_err(fault(folder))
}

/// Renames what is there.
fn if_there(from: &Path, to: &Path) -> Result<(), FleetError> {
    match renamed(from, to) {
        Err(cause) if cause.kind() == ErrorKind::NotFound => Ok(()),
        done => done.map_err(fault(to)),
    }
}
