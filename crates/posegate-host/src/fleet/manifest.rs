//! The list of the results.

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::FleetError;
use super::finished::Listed;
use super::piece::{FORMAT, Recipe};
use super::store::fault;
use crate::input::{self, Limit};

/// The folder of the parts that shards write.
pub(super) const PARTS: &str = "parts";
/// What [`build`](super::build) writes in its folder: nothing else of it is touched.
pub const BUILD_WRITES: [&str; 1] = [PARTS];
/// The same of [`merge`](super::merge).
pub const MERGE_WRITES: [&str; 5] = [PARTS, "tables", "proofs", "plans", MANIFEST];
/// The folders of the results.
pub(super) const RESULTS: [&str; 3] = ["tables", "proofs", "plans"];
/// The name of the list.
pub(super) const MANIFEST: &str = "manifest.json";

/// What a merge says of its results.
#[derive(Serialize)]
pub(super) struct Manifest {
    pub format: u32,
    pub recipe: Recipe,
    pub tables: usize,
    pub plans: usize,
    pub without_plan: Vec<String>,
    pub files: Vec<Listed>,
}

/// Of a manifest of this program, or of an older one, what is needed to replace what it lists.
#[derive(Deserialize)]
struct PreviousManifest {
    format: u32,
    files: Vec<Listed>,
}

impl PreviousManifest {
    /// That of an output folder; `None` where there is none, or one of something else.
    fn of(output: &Path) -> Result<Option<Self>, FleetError> {
        let path = output.join(MANIFEST);
        match input::read_file(&path, Limit::PART) {
            Err(cause) if cause.is_not_found() => Ok(None),
            bytes => {
                let bytes = bytes.map_err(|cause| fault(&path)(cause.into_io()))?;
                let known: Option<Self> = serde_json::from_slice(&bytes).ok();
                Ok(known.filter(|known| known.format <= FORMAT))
            }
        }
    }
}

/// Whether a folder holds the results of a merge.
pub(super) fn is_merged(output: &Path) -> Result<bool, FleetError> {
    Ok(PreviousManifest::of(output)?.is_some())
}

/// Sees that nothing would go with the results of a merge before but what its manifest lists.
///
/// # Errors
/// [`FleetError::Foreign`] for a manifest of something else, [`FleetError::Unlisted`] for a file that no merge has written.
pub(super) fn nothing_else(output: &Path) -> Result<(), FleetError> {
    let known = PreviousManifest::of(output)?;
    if known.is_none() && output.join(MANIFEST).exists() {
        return Err(FleetError::Foreign {
            folder: output.into(),
            name: MANIFEST,
        });
    }
    let files = known.map(|known| known.files).unwrap_or_default();
    let listed: BTreeSet<PathBuf> = files.iter().map(|file| output.join(&file.path)).collect();
    let mut open: Vec<PathBuf> = RESULTS.iter().map(|name| output.join(name)).collect();
    while let Some(path) = open.pop() {
        let kind = match std::fs::symlink_metadata(&path) {
            Err(cause) if cause.kind() == ErrorKind::NotFound => continue,
            kind => kind.map_err(fault(&path))?,
        };
        if kind.is_dir() {
            for entry in std::fs::read_dir(&path).map_err(fault(&path))? {
                open.push(entry.map_err(fault(&path))?.path());
            }
        } else if !listed.contains(&path) {
            return Err(FleetError::Unlisted(path));
        }
    }
    Ok(())
}
