//! Checks all pieces and writes the results.

use std::collections::BTreeSet;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rayon::prelude::*;

use super::digest::sha256;
use super::error::SiteBuildError;
use super::inventory::Inventory;
use super::piece::{FORMAT, Piece, Recipe};
use super::piece_file::{Content, ResultFile, checked, decode};
use super::proof::Counts;
use super::records;
use super::results::{MANIFEST, Manifest, REPLACING, parts_to_merge, replaceable};
use super::store::{STALE_AFTER, Store, fault, json, sync};
use posegate::verify::{ExpectedTable, verify};
use posegate_site::Site;

/// The checks of a merge beyond checksums.
#[derive(Clone, Copy, Debug)]
pub enum MergeChecks<'a> {
    /// No further checks: a program with write access to the folder can forge a piece.
    Folder,
    /// The pieces are exactly those of this site.
    Site(&'a Site),
    /// As for `Site`, and every table is proven again. Plans have no proof.
    Proof(&'a Site),
}

impl<'a> MergeChecks<'a> {
    const fn site(self) -> Option<&'a Site> {
        match self {
            Self::Folder => None,
            Self::Site(site) | Self::Proof(site) => Some(site),
        }
    }
}

/// The result of a merge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MergeSummary {
    /// Number of tables, each with the result of its proof.
    pub tables: usize,
    /// Number of plans, including results that state that there is no plan.
    pub plans: usize,
    /// Chains and work tasks without a plan, as `CHAIN: TASK`.
    pub without_plan: Vec<String>,
    /// Number of files, without the manifest.
    pub files: usize,
    /// Bytes of these files.
    pub bytes: u64,
    /// SHA-256 of the manifest.
    pub manifest_sha256: String,
}

/// Checks that every piece is in `output` and valid, then writes `tables`, `proofs`, `plans` and, last of all,
/// `manifest.json` with the SHA-256 of every file. Every table is parsed as on a controller, and its proof file must
/// be of this table; `checks` selects further checks. If `program` is given, pieces of another program
/// ([`program()`](super::program())) are refused. Calls `progress` after each piece that is checked.
///
/// # Errors
/// [`SiteBuildError`]. If pieces are missing, damaged or not proven, the error names all of them, and the results of
/// an earlier merge are unchanged. A merge that is killed or fails while it writes leaves no manifest; the next merge
/// completes it.
pub fn merge(
    output: &Path,
    checks: MergeChecks<'_>,
    program: Option<&str>,
    progress: &(dyn Fn() + Sync),
) -> Result<MergeSummary, SiteBuildError> {
    let parts = parts_to_merge(output)?;
    let lock = lock(&parts)?;
    replaceable(output, &parts)?;
    let (inventory, shards) = records::inventory(&parts, checks.site())?;
    check_program(&inventory.recipe, program)?;
    let output = Store::new(output.into());
    // With the lock, no other process writes results.
    output.remove_temporary(lock.as_ref().map_or(STALE_AFTER, |_| Duration::ZERO))?;
    let merge = Merge {
        output: &output,
        parts: &parts,
        inventory: &inventory,
        shards,
        checks,
    };
    let manifest = merge.check(progress)?;
    let manifest_sha256 = merge.write(&manifest)?;
    Ok(MergeSummary {
        tables: manifest.tables,
        plans: manifest.plans,
        files: manifest.files.len(),
        bytes: manifest.files.iter().map(|file| file.bytes).sum(),
        without_plan: manifest.without_plan,
        manifest_sha256,
    })
}

/// Returns the number of pieces that a merge checks, for progress bars; 0 if it cannot be read.
#[must_use]
pub fn pieces(output: &Path, checks: MergeChecks<'_>) -> usize {
    let parts = parts_to_merge(output);
    let inventory = parts.and_then(|parts| records::inventory(&parts, checks.site()));
    inventory.map_or(0, |(inventory, _)| inventory.pieces().len())
}

/// Locks the folder of the parts. The system releases the lock if the process ends for any reason. `None` if the file
/// system has no locks.
///
/// # Errors
/// [`SiteBuildError::Locked`] if another merge has the lock.
fn lock(parts: &Store) -> Result<Option<File>, SiteBuildError> {
    let Ok(folder) = File::open(parts.folder()) else {
        return Ok(None);
    };
    match folder.try_lock() {
        Ok(()) => Ok(Some(folder)),
        Err(TryLockError::WouldBlock) => Err(SiteBuildError::Locked(parts.folder().into())),
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

fn check_program(recipe: &Recipe, program: Option<&str>) -> Result<(), SiteBuildError> {
    let version = env!("CARGO_PKG_VERSION");
    match program {
        Some(program) if recipe.program != program || recipe.tool_version != version => {
            Err(SiteBuildError::OtherProgram {
                parts: (recipe.tool_version.clone(), recipe.program.clone()),
                own: (version.into(), program.into()),
            })
        }
        _ => Ok(()),
    }
}

/// A merge that has found its inventory.
struct Merge<'a> {
    output: &'a Store,
    parts: &'a Store,
    inventory: &'a Inventory,
    /// Number of shards, if it is equal in all records: then errors name the shard of a piece.
    shards: Option<u32>,
    checks: MergeChecks<'a>,
}

/// The result of checking a piece.
enum Outcome {
    Valid {
        files: Vec<ResultFile>,
        has_plan: bool,
    },
    /// Missing or damaged.
    Missing(String),
    Unproven(String),
}

impl Merge<'_> {
    /// Checks all pieces and returns the manifest of their results. Nothing is written.
    fn check(&self, progress: &(dyn Fn() + Sync)) -> Result<Manifest, SiteBuildError> {
        let pieces = self.inventory.pieces();
        let numbered = pieces.par_iter().enumerate();
        let outcomes: Vec<Outcome> = numbered
            .map(|(number, piece)| {
                let outcome = self.check_piece(number, piece);
                progress();
                outcome
            })
            .collect::<Result<_, SiteBuildError>>()?;
        let mut manifest = Manifest {
            format: FORMAT,
            recipe: self.inventory.recipe.clone(),
            tables: 0,
            plans: 0,
            without_plan: Vec::new(),
            files: Vec::new(),
        };
        let (mut missing, mut unproven) = (Vec::new(), Vec::new());
        for (piece, outcome) in pieces.iter().zip(outcomes) {
            let (own, has_plan) = match outcome {
                Outcome::Valid { files, has_plan } => (files, has_plan),
                Outcome::Missing(why) => {
                    missing.push(why);
                    continue;
                }
                Outcome::Unproven(why) => {
                    unproven.push(why);
                    continue;
                }
            };
            manifest.files.extend(own);
            match piece {
                Piece::Table { .. } => manifest.tables += 1,
                Piece::Plan { from, task } => {
                    manifest.plans += 1;
                    if !has_plan {
                        manifest.without_plan.push(format!("{from}: {task}"));
                    }
                }
            }
        }
        if !missing.is_empty() {
            return Err(SiteBuildError::Missing(missing));
        }
        if !unproven.is_empty() {
            return Err(SiteBuildError::Unproven(unproven));
        }
        manifest.files.sort();
        manifest.without_plan.sort();
        Ok(manifest)
    }

    fn check_piece(&self, number: usize, piece: &Piece) -> Result<Outcome, SiteBuildError> {
        let recipe = &self.inventory.recipe;
        let bytes = self.parts.read(&piece.key(recipe))?;
        let finished = bytes
            .as_ref()
            .and_then(|bytes| checked(bytes, piece, recipe));
        let Some(finished) = finished else {
            return Ok(Outcome::Missing(self.place(number, piece)));
        };
        let has_plan = match (&finished.content, piece, self.checks) {
            (Content::Table(table, counts), Piece::Table { task }, MergeChecks::Proof(site)) => {
                if let Some(why) = unproven(table, *counts, task, site) {
                    return Ok(Outcome::Unproven(format!("{piece}: {why}")));
                }
                false
            }
            (Content::Table(..), ..) => false,
            (Content::Plan(has_plan), ..) => *has_plan,
        };
        let files = finished.files.into_iter().map(|(listed, _)| listed);
        Ok(Outcome::Valid {
            files: files.collect(),
            has_plan,
        })
    }

    /// Returns a piece with its shard and its file, for errors.
    fn place(&self, number: usize, piece: &Piece) -> String {
        let key = piece.key(&self.inventory.recipe);
        let Some(count) = self.shards else {
            return format!("{piece}: parts/{key}");
        };
        let shard = self.inventory.owner(number, count as usize);
        format!("{piece}: shard {shard}/{count}, parts/{key}")
    }

    /// Replaces the results of an earlier merge and returns the SHA-256 of the manifest. The manifest exists only
    /// while all files that it lists exist on the disk.
    fn write(&self, manifest: &Manifest) -> Result<String, SiteBuildError> {
        let output = self.output.folder();
        let old = replaceable(output, self.parts)?;
        let new: BTreeSet<&str> = manifest.files.iter().map(|file| &*file.path).collect();
        let either: BTreeSet<&str> = old.iter().map(|path| &**path).chain(new.clone()).collect();
        self.parts.write_json(REPLACING, &either)?;
        self.parts.sync()?;
        self.output.remove(MANIFEST)?;
        self.output.sync()?;
        let folders: BTreeSet<PathBuf> = new
            .iter()
            .flat_map(|path| Path::new(path).ancestors().skip(1))
            .map(|folder| output.join(folder))
            .collect();
        for folder in &folders {
            std::fs::create_dir_all(folder).map_err(fault(folder))?;
        }
        let numbered = self.inventory.pieces().par_iter().enumerate();
        numbered.try_for_each(|(number, piece)| self.write_piece(number, piece, manifest))?;
        for path in old.iter().filter(|path| !new.contains(path.as_str())) {
            self.output.remove(path)?;
            // The folder of a chain's plans, if it is empty now.
            let _ = Path::new(path)
                .parent()
                .map(|folder| std::fs::remove_dir(output.join(folder)));
        }
        for folder in &folders {
            sync(folder)?;
        }
        let mut bytes = Vec::new();
        json(&mut bytes, manifest).map_err(fault(output))?;
        self.output.write(MANIFEST, &bytes)?;
        self.output.sync()?;
        // If this file remains, it names only results that are also in the manifest.
        let _ = self.parts.remove(REPLACING);
        Ok(sha256(&bytes))
    }

    /// Writes a piece's results, if they are still those that were checked.
    fn write_piece(
        &self,
        number: usize,
        piece: &Piece,
        manifest: &Manifest,
    ) -> Result<(), SiteBuildError> {
        let key = piece.key(&self.inventory.recipe);
        let bytes = self.parts.read(&key)?.unwrap_or_default();
        let files = decode(&bytes, piece, &key).filter(|files| {
            let is_listed = |listed| manifest.files.binary_search(listed).is_ok();
            files.iter().all(|(listed, _)| is_listed(listed))
        });
        let Some(files) = files else {
            return Err(SiteBuildError::Missing(vec![self.place(number, piece)]));
        };
        files
            .into_iter()
            .try_for_each(|(listed, bytes)| self.output.write(&listed.path, bytes))
    }
}

/// Proves a table again. Returns the reason why it is not proven, or how the counts of its proof file differ.
fn unproven(table: &[u8], counts: Counts, task: &str, site: &Site) -> Option<String> {
    let Some(of) = site.tasks.get(task) else {
        return Some("the site has no such task".into());
    };
    let expected = ExpectedTable {
        task,
        success: &of.success,
        epsilon: site.epsilon,
    };
    match verify(table, &expected, &|| ()) {
        Err(why) => Some(format!("{why}")),
        Ok(proof) if Counts::from(proof) != counts => {
            Some("its proof counts other cells, runs or corners".into())
        }
        Ok(_) => None,
    }
}
