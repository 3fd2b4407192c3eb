//! Shards are put together.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::build::EndedPiece;
use super::digest::sha256;
use super::error::FleetError;
use super::finished::{Holds, Listed, taken};
use super::inventory::Inventory;
use super::lists::{self, ListedPiece};
use super::lock::Lock;
use super::manifest::{MANIFEST, Manifest, nothing_else};
use super::piece::{FORMAT, Piece, Recipe};
use super::proof::Counts;
use super::stage::Stage;
use super::store::{Store, fault, json, written};
use crate::site::Site;
use posegate::verify::{ExpectedTable, verify};

/// What a merge believes.
#[derive(Clone, Copy, Debug)]
pub enum MergeChecks<'a> {
    /// All that shards have written into the folder: whoever can write there can forge it.
    Folder,
    /// The same, of this site alone: all of its pieces, and of no other.
    Site(&'a Site),
    /// No table: each one is proven again, against this site. (Of plans there is no proof: they are believed.)
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

/// What was merged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MergeSummary {
    /// Tables, each with the result of its proof.
    pub tables: usize,
    /// Plans, those included that say that there is none.
    pub plans: usize,
    /// Of which chain and work task there is no plan.
    pub without_plan: Vec<String>,
    /// Files, the manifest not included.
    pub files: usize,
    /// Their bytes.
    pub bytes: u64,
    /// SHA-256 of the manifest.
    pub manifest_sha256: String,
    /// What could not be cleared away when all was done: a folder of the merge, or of one before it, and why.
    pub left: Option<String>,
}

/// Puts the pieces of all shards in `output` together: `tables`, `proofs`, `plans`, and last of all `manifest.json`, with the
/// SHA-256 of every file. Bytes are those that the shards have listed, every table is read as a controller
/// reads it, and its proof file must be of this very table; what else is believed, `trust` says. Parts of other
/// programs than `program` ([`program()`](super::program())) are refused, where one is given. `progress` is told of
/// each piece that is done. Results of a merge before are replaced.
///
/// # Errors
/// [`FleetError`]: gaps, overlaps, shards of different sites, versions, options or numbers, pieces that are missing or damaged
/// or not proven (all of them), another merge that runs, files among the results that no merge has written, and files that
/// cannot be written. Results of a merge before are as they were; where this process is killed while it replaces them, the
/// next merge puts them back first.
pub fn merge(
    output: &Path,
    trust: MergeChecks<'_>,
    program: Option<&str>,
    progress: &(dyn Fn() + Sync),
) -> Result<MergeSummary, FleetError> {
    let store = Store::of(output)?;
    if !store.is_there() {
        return Err(FleetError::NoShards(output.into()));
    }
    let _lock = Lock::take(&store)?;
    let mut left = None;
    for stale in Stage::stale(output)? {
        stale.put_back()?;
        left = stale.clear().err().or(left);
    }
    nothing_else(output)?;
    let shards = lists::shards(&store, output, trust.site())?;
    let inventory = lists::inventory(&store, &shards, trust.site())?;
    is_by(&inventory.recipe, program)?;
    let listed = lists::listed(&shards, &inventory)?;
    let stage = Stage::new(output)?;
    let work = Work {
        store: &store,
        stage: &stage,
        inventory: &inventory,
        recipe: &inventory.recipe,
        trust,
        shards: shards.len(),
        progress,
    };
    let done = work.all(&listed).and_then(|(manifest, folders)| {
        let mut bytes = Vec::new();
        json(&mut bytes, &manifest).map_err(fault(&output.join(MANIFEST)))?;
        nothing_else(output)?;
        stage.put_in_place(&bytes, &folders)?;
        Ok((manifest, sha256(&bytes)))
    });
    let (manifest, manifest_sha256) = match done {
        Ok(done) => done,
        Err(error) => {
            // The first error is the one to report. What cannot be put back now is put back by the next merge.
            if stage.put_back().is_ok() {
                let _ = stage.clear();
            }
            return Err(error);
        }
    };
    Ok(MergeSummary {
        tables: manifest.tables,
        plans: manifest.plans,
        files: manifest.files.len(),
        bytes: manifest.files.iter().map(|file| file.bytes).sum(),
        without_plan: manifest.without_plan,
        manifest_sha256,
        left: stage.clear().err().or(left).map(|why| format!("{why}")),
    })
}

/// The number of pieces that the shards in a folder list, for progress bars; 0 where nothing can be read.
#[must_use]
pub fn pieces(output: &Path, trust: MergeChecks<'_>) -> usize {
    let shards = Store::of(output).and_then(|store| lists::shards(&store, output, trust.site()));
    shards.map_or(0, |shards| shards.iter().map(|(_, s)| s.pieces.len()).sum())
}

/// Whether parts are by a program, of this version.
fn is_by(recipe: &Recipe, program: Option<&str>) -> Result<(), FleetError> {
    let version = env!("CARGO_PKG_VERSION");
    match program {
        Some(program) if recipe.program != program || recipe.tool_version != version => {
            Err(FleetError::OtherProgram {
                parts: (recipe.tool_version.clone(), recipe.program.clone()),
                own: (version.into(), program.into()),
            })
        }
        _ => Ok(()),
    }
}

/// What all pieces are merged with.
struct Work<'a> {
    store: &'a Store,
    stage: &'a Stage,
    inventory: &'a Inventory,
    recipe: &'a Recipe,
    trust: MergeChecks<'a>,
    shards: usize,
    progress: &'a (dyn Fn() + Sync),
}

/// What came of a piece.
enum Outcome {
    /// Its files are written; whether it says that there is no plan.
    Written {
        files: Vec<Listed>,
        without_plan: bool,
    },
    /// It is not there, or not what was listed.
    Missing(String),
    /// Its table is not proven.
    Unproven(String),
}

impl Work<'_> {
    /// Writes the results of all pieces; with the folders that were made within those of the results.
    fn all(&self, listed: &[ListedPiece<'_>]) -> Result<(Manifest, Vec<PathBuf>), FleetError> {
        let mut folders = Vec::new();
        for (piece, _) in listed {
            if let Piece::Plan { from, task } = piece
                && let Some(folder) = self.stage.path(&Piece::plan_path(from, task)).parent()
            {
                folders.push(folder.to_path_buf());
            }
        }
        folders.sort();
        folders.dedup();
        for folder in &folders {
            std::fs::create_dir(folder).map_err(fault(folder))?;
        }
        let numbered = listed.par_iter().enumerate();
        let done: Vec<Outcome> = numbered
            .map(|(number, listed)| {
                let done = self.one(number, listed);
                (self.progress)();
                done
            })
            .collect::<Result<_, FleetError>>()?;
        let mut manifest = Manifest {
            format: FORMAT,
            recipe: self.recipe.clone(),
            tables: 0,
            plans: 0,
            without_plan: Vec::new(),
            files: Vec::new(),
        };
        let (mut missing, mut unproven) = (Vec::new(), Vec::new());
        for ((piece, _), done) in listed.iter().zip(done) {
            match (piece, done) {
                (_, Outcome::Missing(why)) => missing.push(why),
                (_, Outcome::Unproven(why)) => unproven.push(why),
                (Piece::Table { .. }, Outcome::Written { files, .. }) => {
                    manifest.tables += 1;
                    manifest.files.extend(files);
                }
                (
                    Piece::Plan { from, task },
                    Outcome::Written {
                        files,
                        without_plan,
                    },
                ) => {
                    manifest.plans += 1;
                    manifest.files.extend(files);
                    if without_plan {
                        manifest.without_plan.push(format!("{from}: {task}"));
                    }
                }
            }
        }
        if !missing.is_empty() {
            return Err(FleetError::Missing(missing));
        }
        if !unproven.is_empty() {
            return Err(FleetError::Unproven(unproven));
        }
        manifest.files.sort();
        manifest.without_plan.sort();
        Ok((manifest, folders))
    }

    /// Writes a piece's files.
    fn one(&self, number: usize, (piece, ended): &ListedPiece<'_>) -> Result<Outcome, FleetError> {
        let missing = || {
            let shards = self.shards;
            let shard = self.inventory.owner(number, shards);
            Outcome::Missing(format!(
                "{piece}: shard {shard}/{shards}, parts/{}",
                ended.key
            ))
        };
        let Some(bytes) = self.read(ended)? else {
            return Ok(missing());
        };
        let Some(finished) = taken(&bytes, piece, self.recipe) else {
            return Ok(missing());
        };
        let without_plan = match (&finished.holds, piece, self.trust) {
            (Holds::Table(table, counts), Piece::Table { task }, MergeChecks::Proof(site)) => {
                if let Some(why) = unproven(table, *counts, task, site) {
                    return Ok(Outcome::Unproven(format!("{piece}: {why}")));
                }
                false
            }
            (Holds::Table(..), ..) => false,
            (Holds::Plan(succeeds), ..) => !succeeds,
        };
        let mut files = Vec::new();
        for (listed, bytes) in finished.files {
            let path = self.stage.path(&listed.path);
            written(&path, bytes).map_err(fault(&path))?;
            files.push(listed);
        }
        Ok(Outcome::Written {
            files,
            without_plan,
        })
    }

    /// The bytes that a shard has listed.
    fn read(&self, ended: &EndedPiece) -> Result<Option<Vec<u8>>, FleetError> {
        let bytes = self.store.read(&ended.key)?;
        Ok(bytes.filter(|bytes| sha256(bytes) == ended.sha256))
    }
}

/// Proves a table again: why it is not what was written beside it.
fn unproven(table: &[u8], counts: Counts, task: &str, site: &Site) -> Option<String> {
    let Some(of) = site.tasks.get(task) else {
        return Some("the site has no such task".into());
    };
    let claim = ExpectedTable {
        task,
        success: &of.success,
        epsilon: site.epsilon,
        site_digest: site.digest,
    };
    match verify(table, &claim, &|| ()) {
        Err(why) => Some(format!("{why}")),
        Ok(proof) if Counts::from(proof) != counts => {
            Some("its proof counts other cells, runs or corners".into())
        }
        Ok(_) => None,
    }
}
