//! The folder of the results: the manifest, and the files that a merge may replace.

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::SiteBuildError;
use super::piece::{FORMAT, Recipe};
use super::piece_file::ResultFile;
use super::store::{STALE_AFTER, Store, fault};
use posegate_files::input::{self, Limit};

/// The folder of the pieces.
const PARTS: &str = "parts";
/// Names in the output folder that [`build`](super::build) writes to.
pub const BUILD_WRITES: [&str; 1] = [PARTS];
/// Names in the output folder that [`merge`](super::merge) writes to.
pub const MERGE_WRITES: [&str; 5] = [PARTS, "tables", "proofs", "plans", MANIFEST];
/// The folders of the results.
const RESULTS: [&str; 3] = ["tables", "proofs", "plans"];
/// The list of the results.
pub(super) const MANIFEST: &str = "manifest.json";
/// A file among the parts that exists while a merge replaces results: the paths of the results before and after. If
/// the merge is killed, the next one may replace these.
pub(super) const REPLACING: &str = "replacing.json";

/// The content of the list of the results.
#[derive(Serialize)]
pub(super) struct Manifest {
    pub format: u32,
    pub recipe: Recipe,
    pub tables: usize,
    pub plans: usize,
    pub without_plan: Vec<String>,
    /// Sorted.
    pub files: Vec<ResultFile>,
}

/// The part of a manifest, of this version or an older one, that is needed to replace its files.
#[derive(Deserialize)]
struct PreviousManifest {
    format: u32,
    files: Vec<ResultFile>,
}

impl PreviousManifest {
    /// Reads the manifest in an output folder; `None` if there is none, or if it is not of a merge.
    fn read(output: &Path) -> Result<Option<Self>, SiteBuildError> {
        let path = output.join(MANIFEST);
        match input::read_file(&path, Limit::PART) {
            Err(cause) if cause.is_not_found() => Ok(None),
            bytes => {
                let bytes = bytes.map_err(|cause| fault(&path)(cause.into_io()))?;
                let manifest: Option<Self> = serde_json::from_slice(&bytes).ok();
                Ok(manifest.filter(|manifest| manifest.format <= FORMAT))
            }
        }
    }
}

/// Returns the parts of an output folder.
fn parts(output: &Path) -> Result<Store, SiteBuildError> {
    if output.exists() && !output.is_dir() {
        return Err(SiteBuildError::NoFolder(output.into()));
    }
    Ok(Store::new(output.join(PARTS)))
}

/// Returns the parts of an output folder for a shard, without temporary files of killed shards. Makes the folder if
/// it does not exist.
///
/// # Errors
/// [`SiteBuildError::Foreign`] if the output folder has results, but neither parts nor a manifest.
pub(super) fn parts_to_build(output: &Path) -> Result<Store, SiteBuildError> {
    let parts = parts(output)?;
    if !parts.folder().is_dir() {
        // A merge does not need its parts any more: they may have been removed.
        let merged = PreviousManifest::read(output)?.is_some();
        let mut names = RESULTS.into_iter().chain([MANIFEST]);
        if let Some(name) = names.find(|name| !merged && output.join(name).exists()) {
            return Err(SiteBuildError::Foreign {
                folder: output.into(),
                name,
            });
        }
        std::fs::create_dir_all(parts.folder()).map_err(fault(parts.folder()))?;
    }
    parts.remove_temporary(STALE_AFTER)?;
    Ok(parts)
}

/// Returns the parts of an output folder for a merge.
///
/// # Errors
/// [`SiteBuildError::NoShards`] if there are none.
pub(super) fn parts_to_merge(output: &Path) -> Result<Store, SiteBuildError> {
    let parts = parts(output)?;
    match parts.folder().is_dir() {
        true => Ok(parts),
        false => Err(SiteBuildError::NoShards(output.into())),
    }
}

/// Returns the paths of all files among the results. A merge wrote all of them, so the next merge may replace them.
///
/// # Errors
/// [`SiteBuildError::Foreign`] for a manifest of another program, [`SiteBuildError::Unlisted`] for a file that no
/// merge wrote.
pub(super) fn replaceable(
    output: &Path,
    parts: &Store,
) -> Result<BTreeSet<String>, SiteBuildError> {
    let manifest = PreviousManifest::read(output)?;
    if manifest.is_none() && output.join(MANIFEST).exists() {
        return Err(SiteBuildError::Foreign {
            folder: output.into(),
            name: MANIFEST,
        });
    }
    let replacing = parts.read(REPLACING)?.unwrap_or_default();
    let mut listed: BTreeSet<String> = serde_json::from_slice(&replacing).unwrap_or_default();
    let files = manifest.into_iter().flat_map(|manifest| manifest.files);
    listed.extend(files.map(|file| file.path));
    let mut found = BTreeSet::new();
    let mut open: Vec<String> = RESULTS.map(String::from).into();
    while let Some(name) = open.pop() {
        let path = output.join(&name);
        let kind = match std::fs::symlink_metadata(&path) {
            Err(cause) if cause.kind() == ErrorKind::NotFound => continue,
            kind => kind.map_err(fault(&path))?,
        };
        if kind.is_dir() {
            for entry in std::fs::read_dir(&path).map_err(fault(&path))? {
                let entry = entry.map_err(fault(&path))?;
                let Ok(below) = entry.file_name().into_string() else {
                    return Err(SiteBuildError::Unlisted(entry.path()));
                };
                open.push(format!("{name}/{below}"));
            }
        } else if listed.contains(&name) {
            found.insert(name);
        } else {
            return Err(SiteBuildError::Unlisted(path));
        }
    }
    Ok(found)
}
