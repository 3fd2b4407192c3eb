//! Shards are put together.

use std::collections::BTreeMap;
use std::path::Path;
use std::string::String;
use std::vec::Vec;
use std::{format, io};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::build::{Ended, EndedPiece, inventory_name};
use super::digest::{hex, sha256};
use super::error::FleetError;
use super::finished::{Listed, decode};
use super::inventory::Inventory;
use super::piece::{FORMAT, Piece, Recipe};
use super::shard::Shard;
use super::store::{MANIFEST, RESULTS, Store, fault, json, parsed, settled, written};
use crate::table::Table;

/// What was merged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Merged {
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
}

/// The list of the results.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    format: u32,
    recipe: Recipe,
    tables: usize,
    plans: usize,
    without_plan: Vec<String>,
    files: Vec<Listed>,
}

/// Puts the pieces of all shards in `output` together: `tables`, `proofs`, `plans`, and last of all `manifest.json`, with the
/// SHA-256 of every file. Bytes are those that the shards have listed, and every table is read as a controller
/// reads it. `progress` is told of each piece that is done. Results of a merge before are replaced.
///
/// # Errors
/// [`FleetError`]: gaps, overlaps with different bytes, shards of different sites, versions, options or numbers, pieces that
/// are missing or damaged (all of them), and files that cannot be written. Results of a merge before are as they were,
/// unless the error comes of putting new ones in their place: then there is no manifest.
pub fn merge(output: &Path, progress: &(dyn Fn() + Sync)) -> Result<Merged, FleetError> {
    let store = Store::of(output)?;
    let shards = shards(&store, output)?;
    let inventory = inventory(&store, &shards)?;
    let listed = listed(&shards, &inventory)?;
    let stage = store.path(&format!(".merge-{}", std::process::id()));
    let staged = staged(&store, &stage, &inventory, &listed, shards.len(), progress)
        .and_then(|manifest| in_place(output, &stage, &manifest));
    let cleared = match std::fs::remove_dir_all(&stage) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(fault(&stage)(cause)),
        _ => Ok(()),
    };
    let merged = staged?;
    cleared?;
    Ok(merged)
}

/// The number of pieces that the shards in a folder list, for progress bars; 0 where nothing can be read.
#[must_use]
pub fn pieces(output: &Path) -> usize {
    let shards = Store::of(output).and_then(|store| shards(&store, output));
    shards.map_or(0, |shards| shards.iter().map(|(_, s)| s.pieces.len()).sum())
}

/// What all shards say of themselves, in order: one site, one recipe, one number, none missing.
fn shards(store: &Store, output: &Path) -> Result<Vec<(String, Ended)>, FleetError> {
    let mut found: Vec<(String, Ended)> = Vec::new();
    for name in store.names()? {
        if !(name.starts_with("shard-") && name.ends_with(".json")) {
            continue;
        }
        let path = store.path(&name);
        let bytes = store.read(&name)?.unwrap_or_default();
        let ended: Ended = parsed(&bytes, &path)?;
        let own = Shard::new(ended.shard, ended.of).map(Ended::name);
        if ended.format != FORMAT || own.as_deref() != Ok(&name) {
            return Err(FleetError::Damaged {
                path,
                why: "is not what a shard of this name writes".into(),
            });
        }
        found.push((name, ended));
    }
    found.sort_by_key(|(_, ended)| ended.shard);
    let Some((first, of)) = found.first() else {
        return Err(FleetError::NoShards(output.into()));
    };
    for (name, ended) in &found {
        let (one, other) = (&of.recipe, &ended.recipe);
        if one.site_digest != other.site_digest {
            return Err(FleetError::MixedSites {
                one: (first.clone(), one.site_digest.clone()),
                other: (name.clone(), other.site_digest.clone()),
            });
        }
    }
    for (name, ended) in &found {
        if of.recipe != ended.recipe || of.inventory != ended.inventory {
            return Err(FleetError::MixedRecipes(first.clone(), name.clone()));
        }
        if of.of != ended.of {
            return Err(FleetError::MixedCounts(first.clone(), name.clone()));
        }
    }
    let there = |index| found.iter().any(|(_, ended)| ended.shard == index);
    let missing: Vec<String> = (0..of.of)
        .filter(|index| !there(*index))
        .map(|index| format!("{index}/{}", of.of))
        .collect();
    if missing.is_empty() {
        Ok(found)
    } else {
        Err(FleetError::Gap(missing))
    }
}

/// All pieces of the site, as every shard had them.
fn inventory(store: &Store, shards: &[(String, Ended)]) -> Result<Inventory, FleetError> {
    let of = shards.first().map(|(_, ended)| ended);
    let name = inventory_name(of.map_or("", |ended| &ended.inventory));
    let path = store.path(&name);
    let damaged = |why: &str| FleetError::Damaged {
        path: path.clone(),
        why: why.into(),
    };
    let bytes = store.read(&name)?;
    let bytes = bytes.ok_or_else(|| damaged("is missing: every shard writes it"))?;
    if inventory_name(&sha256(&bytes)) != name {
        return Err(damaged("was changed"));
    }
    let inventory: Inventory = parsed(&bytes, &path)?;
    if of.is_some_and(|ended| ended.recipe == inventory.recipe) {
        Ok(inventory)
    } else {
        Err(damaged("is of another site"))
    }
}

/// A piece, its key, and what a shard says of it.
type ListedPiece<'a> = (&'a Piece, &'a EndedPiece);

/// What the shards say of each piece: each in its own shard's list, and where another lists it too with the same bytes.
fn listed<'a>(
    shards: &'a [(String, Ended)],
    inventory: &'a Inventory,
) -> Result<Vec<ListedPiece<'a>>, FleetError> {
    let mut by_key: BTreeMap<&str, Vec<(&String, &EndedPiece)>> = BTreeMap::new();
    for (name, ended) in shards {
        for piece in &ended.pieces {
            by_key.entry(&piece.key).or_default().push((name, piece));
        }
    }
    let count = shards.len();
    let (mut all, mut missing) = (Vec::new(), Vec::new());
    for (number, piece) in inventory.pieces().iter().enumerate() {
        let key = piece.key(&inventory.recipe);
        let Some(found) = by_key.remove(key.as_str()) else {
            let own = number % count;
            missing.push(format!("{piece}: shard {own}/{count} does not list it"));
            continue;
        };
        let mut found = found.into_iter();
        let Some((one, first)) = found.next() else {
            continue;
        };
        if let Some((other, _)) = found.find(|(_, other)| other.sha256 != first.sha256) {
            return Err(FleetError::Overlap {
                piece: piece.clone(),
                one: one.clone(),
                other: other.clone(),
            });
        }
        all.push((piece, first));
    }
    if !missing.is_empty() {
        return Err(FleetError::Missing(missing));
    }
    // What is no piece of the site.
    if let Some((name, piece)) = by_key.into_values().flatten().next() {
        return Err(FleetError::Damaged {
            path: name.into(),
            why: format!("lists {}, which is no piece of the site", piece.key),
        });
    }
    Ok(all)
}

/// What is in a piece.
struct Unpacked {
    files: Vec<Listed>,
    /// Whether it says that there is no plan.
    without_plan: bool,
}

/// Writes the results of all pieces into a folder beside them.
fn staged(
    store: &Store,
    stage: &Path,
    inventory: &Inventory,
    listed: &[ListedPiece<'_>],
    shards: usize,
    progress: &(dyn Fn() + Sync),
) -> Result<Manifest, FleetError> {
    let made = |folder: &Path| std::fs::create_dir_all(folder).map_err(fault(folder));
    for folder in RESULTS {
        made(&stage.join(folder))?;
    }
    for (piece, _) in listed {
        if let Piece::Plan { from, task } = piece
            && let Some(folder) = stage.join(Piece::plan_path(from, task)).parent()
        {
            made(folder)?;
        }
    }
    let one = |(number, (piece, ended)): (usize, &ListedPiece<'_>)| {
        let unpacked = unpacked(store, stage, inventory, piece, ended)?;
        progress();
        Ok(unpacked.ok_or_else(|| {
            let shard = number % shards;
            format!("{piece}: shard {shard}/{shards}, parts/{}", ended.key)
        }))
    };
    let numbered = listed.par_iter().enumerate();
    let done: Vec<Result<Unpacked, String>> =
        numbered.map(one).collect::<Result<_, FleetError>>()?;
    let mut manifest = Manifest {
        format: FORMAT,
        recipe: inventory.recipe.clone(),
        tables: 0,
        plans: 0,
        without_plan: Vec::new(),
        files: Vec::new(),
    };
    let mut missing = Vec::new();
    for ((piece, _), done) in listed.iter().zip(done) {
        let unpacked = match done {
            Ok(unpacked) => unpacked,
            Err(why) => {
                missing.push(why);
                continue;
            }
        };
        match piece {
            Piece::Table { .. } => manifest.tables += 1,
            Piece::Plan { from, task } => {
                manifest.plans += 1;
                if unpacked.without_plan {
                    manifest.without_plan.push(format!("{from}: {task}"));
                }
            }
        }
        manifest.files.extend(unpacked.files);
    }
    if !missing.is_empty() {
        return Err(FleetError::Missing(missing));
    }
    manifest.files.sort();
    manifest.without_plan.sort();
    Ok(manifest)
}

/// Writes a piece's files; `None` where the piece is not there, or not what was listed.
fn unpacked(
    store: &Store,
    stage: &Path,
    inventory: &Inventory,
    piece: &Piece,
    ended: &EndedPiece,
) -> Result<Option<Unpacked>, FleetError> {
    let Some(bytes) = store.read(&ended.key)? else {
        return Ok(None);
    };
    let files = decode(&bytes, piece, &ended.key);
    let Some(files) = files.filter(|_| sha256(&bytes) == ended.sha256) else {
        return Ok(None);
    };
    let mut unpacked = Unpacked {
        files: Vec::new(),
        without_plan: false,
    };
    for (listed, bytes) in files {
        match piece {
            Piece::Table { task } if listed.path == Piece::table_path(task) => {
                if !is_table_of(bytes, task, &inventory.recipe) {
                    return Ok(None);
                }
            }
            Piece::Table { .. } => {}
            Piece::Plan { .. } => {
                let told: Option<serde_json::Value> = serde_json::from_slice(bytes).ok();
                let succeeds = told.and_then(|told| told.get("success")?.as_bool());
                unpacked.without_plan = succeeds != Some(true);
            }
        }
        let path = stage.join(&listed.path);
        written(&path, bytes).map_err(fault(&path))?;
        unpacked.files.push(listed);
    }
    Ok(Some(unpacked))
}

/// Whether bytes are a table of a task of this site, as a controller reads it.
fn is_table_of(bytes: &[u8], task: &str, recipe: &Recipe) -> bool {
    Table::parse(bytes)
        .is_ok_and(|table| table.task() == task && hex(&table.site_digest()) == recipe.site_digest)
}

/// Puts the results in the place of those of a merge before; there is a manifest only where all of them are.
fn in_place(output: &Path, stage: &Path, manifest: &Manifest) -> Result<Merged, FleetError> {
    let bytes = json(manifest, &output.join(MANIFEST))?;
    let draft = stage.join(MANIFEST);
    written(&draft, &bytes).map_err(fault(&draft))?;
    let renamed = |from: &Path, to: &Path| match std::fs::rename(from, to) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(()),
        done => done.map_err(fault(to)),
    };
    renamed(&output.join(MANIFEST), &stage.join("before.json"))?;
    for folder in RESULTS {
        let own = output.join(folder);
        renamed(&own, &stage.join(format!("before-{folder}")))?;
        std::fs::rename(stage.join(folder), &own).map_err(fault(&own))?;
    }
    let own = output.join(MANIFEST);
    std::fs::rename(&draft, &own).map_err(fault(&own))?;
    settled(output)?;
    Ok(Merged {
        tables: manifest.tables,
        plans: manifest.plans,
        without_plan: manifest.without_plan.clone(),
        files: manifest.files.len(),
        bytes: manifest.files.iter().map(|file| file.bytes).sum(),
        manifest_sha256: sha256(&bytes),
    })
}
