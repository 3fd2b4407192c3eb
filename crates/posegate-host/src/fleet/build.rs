//! A shard is built.

use std::collections::BTreeMap;
use std::io;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::digest::{hex, sha256};
use super::error::{FleetError, PieceError};
use super::finished::{Files, encode, taken};
use super::inventory::Inventory;
use super::make;
use super::piece::{Asked, FORMAT, Piece, Recipe};
use super::shard::Shard;
use super::store::{Store, fault, json};
use crate::plan::{PlanError, Prepared};
use crate::site::Site;

/// How a shard is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildOptions {
    /// Which.
    pub shard: Shard,
    /// Whether pieces that are there, whole, are kept.
    pub resume: bool,
    /// Pieces that are made at once, each on one thread; one a core where nothing is said. No byte depends on it.
    pub threads: Option<NonZeroUsize>,
}

/// What came of a shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildSummary {
    /// Its pieces.
    pub pieces: usize,
    /// Those of them that were there.
    pub kept: usize,
    /// Bytes of all of its finished pieces.
    pub bytes: u64,
}

/// What a shard says of itself when it has ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShardManifest {
    pub format: u32,
    pub recipe: Recipe,
    pub shard: u32,
    pub of: u32,
    /// SHA-256 of the inventory, which names its file.
    pub inventory: String,
    pub pieces: Vec<EndedPiece>,
}

/// A finished piece as its shard lists it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EndedPiece {
    /// Of the piece; the name of its file.
    pub key: String,
    pub bytes: u64,
    /// Of the whole file.
    pub sha256: String,
}

impl ShardManifest {
    /// The name of a shard's file.
    pub(super) fn name(shard: Shard) -> String {
        format!("shard-{}-of-{}.json", shard.index(), shard.count())
    }
}

/// The name of an inventory's file.
pub(super) fn inventory_name(sha256: &str) -> String {
    format!("inventory-{sha256}.json")
}

/// Makes a shard's pieces and writes each into `output`, whole or not at all; its own list comes last. `progress` is told of
/// each piece that is done. At most as many pieces as there are threads are in memory, beside the site and, where there are
/// plans to make, the planner's library of it.
///
/// # Errors
/// [`FleetError`]. Pieces that were finished stay, and are kept by a later run that resumes. Where single pieces cannot be
/// made, all others are; only the list is not written.
pub fn build(
    site: &Site,
    inventory: &Inventory,
    output: &Path,
    order: &BuildOptions,
    progress: &(dyn Fn() + Sync),
) -> Result<BuildSummary, FleetError> {
    let store = Store::for_shard(output, order.shard)?;
    let name = ShardManifest::name(order.shard);
    // A shard that is being built has not ended.
    store.remove(&name)?;
    let inventory_sha256 = json_sha256(inventory).map_err(fault(&store.path("inventory")))?;
    let inventory_file = inventory_name(&inventory_sha256);
    if store.sha256(&inventory_file)?.as_ref() != Some(&inventory_sha256) {
        store.write_json(&inventory_file, inventory)?;
    }
    let share: Vec<&Piece> = inventory.share(order.shard).collect();
    let mut shop = BuildContext {
        site,
        recipe: &inventory.recipe,
        store: &store,
        ended: Mutex::new(BTreeMap::new()),
        refused: Mutex::new(Vec::new()),
        kept: AtomicUsize::new(0),
        progress,
    };
    shop.run(&share, order)?;
    let mut refused = core::mem::take(shop.refused.get_mut().unwrap_or_else(poisoned));
    refused.sort_by(|(one, _), (other, _)| one.cmp(other));
    if !refused.is_empty() {
        return Err(FleetError::Refused(refused));
    }
    let ended = core::mem::take(shop.ended.get_mut().unwrap_or_else(poisoned));
    let pieces: Vec<EndedPiece> = ended.into_values().collect();
    let built = BuildSummary {
        pieces: pieces.len(),
        kept: shop.kept.into_inner(),
        bytes: pieces.iter().map(|piece| piece.bytes).sum(),
    };
    let ended = ShardManifest {
        format: FORMAT,
        recipe: inventory.recipe.clone(),
        shard: order.shard.index(),
        of: order.shard.count(),
        inventory: inventory_sha256,
        pieces,
    };
    // What is listed is on the disk.
    store.settle()?;
    store.write_json(&name, &ended)?;
    store.settle()?;
    Ok(built)
}

/// The SHA-256 of a value as it is written.
fn json_sha256(value: &impl Serialize) -> io::Result<String> {
    let mut digest = Sha256::new();
    json(&mut digest, value)?;
    Ok(hex(&digest.finalize()))
}

/// A panic of another thread is on its way already.
fn poisoned<T>(error: std::sync::PoisonError<T>) -> T {
    error.into_inner()
}

/// What all workers share.
struct BuildContext<'a> {
    site: &'a Site,
    recipe: &'a Recipe,
    store: &'a Store,
    /// Finished pieces by their keys.
    ended: Mutex<BTreeMap<String, EndedPiece>>,
    refused: Mutex<Vec<(Piece, PieceError)>>,
    kept: AtomicUsize,
    progress: &'a (dyn Fn() + Sync),
}

impl BuildContext<'_> {
    fn run(&self, share: &[&Piece], order: &BuildOptions) -> Result<(), FleetError> {
        let threads = order.threads.map_or_else(
            || thread::available_parallelism().map_or(1, NonZeroUsize::get),
            NonZeroUsize::get,
        );
        let (mut tables, mut plans) = (Vec::new(), BTreeMap::<&str, Vec<_>>::new());
        for piece in share {
            if order.resume && self.keeps(piece)? {
                (self.progress)();
                continue;
            }
            match piece {
                Piece::Table { task } => tables.push((*piece, task.as_str())),
                Piece::Plan { from, task } => {
                    // The model of a site's drives is its own, or one that depends on the chain.
                    let own = self.site.navigation.model.is_some();
                    let group = plans.entry(if own { "" } else { from.as_str() });
                    group
                        .or_default()
                        .push((*piece, from.as_str(), task.as_str()));
                }
            }
        }
        let pools = pools(threads)?;
        self.each(
            &pools,
            &tables,
            |_: &mut (), (piece, task)| {
                self.finish(piece, make::table(self.site, self.recipe, task))
            },
            || (),
        )?;
        let Some(asked) = &self.recipe.plans else {
            return Ok(());
        };
        for group in plans.into_values() {
            self.plans(asked, &group, threads, &pools)?;
        }
        Ok(())
    }

    /// Makes plans that have one library.
    fn plans(
        &self,
        asked: &Asked,
        group: &[(&Piece, &str, &str)],
        threads: usize,
        pools: &[ThreadPool],
    ) -> Result<(), FleetError> {
        let Some((_, from, _)) = group.first() else {
            return Ok(());
        };
        let prepared = match pool(threads)?.install(|| Prepared::of(self.site, Some(from))) {
            Ok(prepared) => Some(prepared),
            Err(PlanError::NoLooks(_)) => None,
            Err(error) => {
                for (piece, ..) in group {
                    self.finish(piece, Err(error.clone().into()))?;
                }
                return Ok(());
            }
        };
        self.each(
            pools,
            group,
            |prepared: &mut Option<Prepared<'_>>, (piece, from, task)| {
                let made = make::plan(self.site, prepared.as_mut(), asked, from, task);
                self.finish(piece, made)
            },
            || prepared.clone(),
        )
    }

    /// Does something with each, a pool each its own, until one fails.
    fn each<Item: Copy + Sync, Own>(
        &self,
        pools: &[ThreadPool],
        items: &[Item],
        work: impl Fn(&mut Own, Item) -> Result<(), FleetError> + Sync,
        own: impl Fn() -> Own + Sync,
    ) -> Result<(), FleetError>
    where
        Own: Send,
    {
        let next = AtomicUsize::new(0);
        let failed = Mutex::new(None);
        let turn = || {
            let mut own = own();
            while let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) {
                if let Err(error) = work(&mut own, *item) {
                    next.store(items.len(), Ordering::Relaxed);
                    failed.lock().unwrap_or_else(poisoned).get_or_insert(error);
                }
            }
        };
        thread::scope(|scope| {
            for pool in pools.iter().take(items.len()) {
                scope.spawn(|| pool.install(turn));
            }
        });
        match failed.into_inner().unwrap_or_else(poisoned) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    /// Whether a piece is there, whole; then it is listed.
    fn keeps(&self, piece: &Piece) -> Result<bool, FleetError> {
        let key = piece.key(self.recipe);
        let Some(bytes) = self.store.read(&key)? else {
            return Ok(false);
        };
        if taken(&bytes, piece, self.recipe).is_none() {
            return Ok(false);
        }
        self.list(key, &bytes);
        self.kept.fetch_add(1, Ordering::Relaxed);
        Ok(true)
    }

    /// Writes what came of a piece.
    fn finish(&self, piece: &Piece, made: Result<Files, PieceError>) -> Result<(), FleetError> {
        match made {
            Ok(files) => {
                let key = piece.key(self.recipe);
                let path = self.store.path(&key);
                let bytes =
                    encode(piece, self.recipe, &files).map_err(|why| FleetError::Damaged {
                        path,
                        why: format!("{why}"),
                    })?;
                self.store.write(&key, &bytes)?;
                self.list(key, &bytes);
            }
            Err(why) => {
                let mut refused = self.refused.lock().unwrap_or_else(poisoned);
                refused.push((piece.clone(), why));
            }
        }
        (self.progress)();
        Ok(())
    }

    fn list(&self, key: String, bytes: &[u8]) {
        let listed = EndedPiece {
            key: key.clone(),
            bytes: bytes.len() as u64,
            sha256: sha256(bytes),
        };
        let mut ended = self.ended.lock().unwrap_or_else(poisoned);
        ended.insert(key, listed);
    }
}

/// A pool of so many threads.
fn pool(threads: usize) -> Result<ThreadPool, FleetError> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| FleetError::Threads(format!("{error}")))
}

/// As many pools of one thread: a piece is made on one of them, so that no thread begins another piece while it waits.
fn pools(threads: usize) -> Result<Vec<ThreadPool>, FleetError> {
    (0..threads).map(|_| pool(1)).collect()
}
