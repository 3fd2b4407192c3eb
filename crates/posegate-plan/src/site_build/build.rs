//! Makes the pieces of a shard.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::panic::resume_unwind;
use std::path::Path;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::error::{PieceError, SiteBuildError};
use super::inventory::Inventory;
use super::make;
use super::piece::{Piece, PlanOptions, Recipe};
use super::piece_file::{Files, checked, encode};
use super::records;
use super::results::parts_to_build;
use super::shard::Shard;
use super::store::Store;
use crate::{PlanError, Prepared};
use posegate_site::Site;

/// The options of a shard's build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildOptions {
    /// The shard.
    pub shard: Shard,
    /// If `true`, valid existing pieces are kept.
    pub resume: bool,
    /// Number of pieces that are made in parallel, each on one thread; `None` for one per core. The results do not
    /// depend on this number.
    pub threads: Option<NonZeroUsize>,
}

/// The result of a shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildSummary {
    /// Number of the shard's pieces.
    pub pieces: usize,
    /// Number of the shard's pieces that were kept.
    pub kept: usize,
    /// Bytes of all files of the shard's pieces.
    pub bytes: u64,
}

/// Makes a shard's pieces and writes each into `output` atomically. Calls `progress` after each piece. Memory holds
/// the site, at most one piece per thread and, if plans are made, the planner's library of the site.
///
/// # Errors
/// [`SiteBuildError`]. Finished pieces remain, and a later build with `resume` keeps them. If some pieces cannot be
/// made, all others are made ([`SiteBuildError::Refused`]).
pub fn build(
    site: &Site,
    inventory: &Inventory,
    output: &Path,
    options: &BuildOptions,
    progress: &(dyn Fn() + Sync),
) -> Result<BuildSummary, SiteBuildError> {
    if site.tasks.is_empty() {
        return Err(SiteBuildError::NoTasks);
    }
    let parts = parts_to_build(output)?;
    records::write(&parts, inventory, options.shard)?;
    let pieces: Vec<&Piece> = inventory.share(options.shard).collect();
    let context = BuildContext {
        site,
        recipe: &inventory.recipe,
        parts: &parts,
        refused: Mutex::new(Vec::new()),
        kept: AtomicUsize::new(0),
        bytes: AtomicU64::new(0),
        progress,
    };
    context.run(&pieces, options)?;
    parts.sync()?;
    let refused = context.refused.into_inner();
    let mut refused = refused.unwrap_or_else(PoisonError::into_inner);
    refused.sort_by(|(one, _), (other, _)| one.cmp(other));
    if !refused.is_empty() {
        return Err(SiteBuildError::Refused(refused));
    }
    Ok(BuildSummary {
        pieces: pieces.len(),
        kept: context.kept.into_inner(),
        bytes: context.bytes.into_inner(),
    })
}

/// The data that all threads of a build share.
struct BuildContext<'a> {
    site: &'a Site,
    recipe: &'a Recipe,
    parts: &'a Store,
    refused: Mutex<Vec<(Piece, PieceError)>>,
    kept: AtomicUsize,
    bytes: AtomicU64,
    progress: &'a (dyn Fn() + Sync),
}

impl BuildContext<'_> {
    fn run(&self, pieces: &[&Piece], options: &BuildOptions) -> Result<(), SiteBuildError> {
        let threads = options.threads.map_or_else(
            || thread::available_parallelism().map_or(1, NonZeroUsize::get),
            NonZeroUsize::get,
        );
        let (mut tables, mut plans) = (Vec::new(), BTreeMap::<&str, Vec<_>>::new());
        for piece in pieces {
            if options.resume && self.has_valid_file(piece)? {
                (self.progress)();
                continue;
            }
            match piece {
                Piece::Table { task } => tables.push((*piece, task.as_str())),
                Piece::Plan { from, task } => {
                    // Plans share a library, unless the model of the drives depends on the chain.
                    let shared = self.site.navigation.model.is_some();
                    let group = plans.entry(if shared { "" } else { from.as_str() });
                    group
                        .or_default()
                        .push((*piece, from.as_str(), task.as_str()));
                }
            }
        }
        let table = |(): &mut (), (piece, task)| {
            self.finish(piece, make::table(self.site, self.recipe, task))
        };
        each(threads, &tables, || (), table)?;
        let Some(options) = &self.recipe.plans else {
            return Ok(());
        };
        for group in plans.into_values() {
            self.plans(options, &group, threads)?;
        }
        Ok(())
    }

    /// Makes plans that share a library.
    fn plans(
        &self,
        options: &PlanOptions,
        group: &[(&Piece, &str, &str)],
        threads: usize,
    ) -> Result<(), SiteBuildError> {
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
        let plan = |prepared: &mut Option<Prepared<'_>>, (piece, from, task)| {
            let made = make::plan(self.site, prepared.as_mut(), options, from, task);
            self.finish(piece, made)
        };
        each(threads, group, || prepared.clone(), plan)
    }

    /// Returns `true` if a valid file of a piece exists, and counts it.
    fn has_valid_file(&self, piece: &Piece) -> Result<bool, SiteBuildError> {
        let bytes = self.parts.read(&piece.key(self.recipe))?;
        let bytes = bytes.filter(|bytes| checked(bytes, piece, self.recipe).is_some());
        if let Some(bytes) = &bytes {
            self.kept.fetch_add(1, Ordering::Relaxed);
            self.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        }
        Ok(bytes.is_some())
    }

    /// Writes the results of a piece, or records the reason why there are none.
    fn finish(&self, piece: &Piece, made: Result<Files, PieceError>) -> Result<(), SiteBuildError> {
        match made {
            Ok(files) => {
                let key = piece.key(self.recipe);
                let bytes =
                    encode(piece, self.recipe, &files).map_err(|why| SiteBuildError::Damaged {
                        path: self.parts.path(&key),
                        why: format!("{why}"),
                    })?;
                self.parts.write(&key, &bytes)?;
                self.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
            }
            Err(why) => {
                let refused = self.refused.lock();
                let mut refused = refused.unwrap_or_else(PoisonError::into_inner);
                refused.push((piece.clone(), why));
            }
        }
        (self.progress)();
        Ok(())
    }
}

/// Calls `work` for each item, on `threads` threads with a state each, until a call fails. Each thread is a pool of
/// its own, so none begins another item while it waits within one.
fn each<Item: Copy + Sync, State: Send>(
    threads: usize,
    items: &[Item],
    state: impl Fn() -> State + Sync,
    work: impl Fn(&mut State, Item) -> Result<(), SiteBuildError> + Sync,
) -> Result<(), SiteBuildError> {
    let next = AtomicUsize::new(0);
    let turn = || {
        let mut state = state();
        while let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) {
            let done = work(&mut state, *item);
            done.inspect_err(|_| next.store(items.len(), Ordering::Relaxed))?;
        }
        Ok(())
    };
    let threads = threads.min(items.len());
    let pools: Vec<ThreadPool> = (0..threads).map(|_| pool(1)).collect::<Result<_, _>>()?;
    thread::scope(|scope| {
        let running: Vec<_> = pools
            .iter()
            .map(|pool| scope.spawn(|| pool.install(turn)))
            .collect();
        // The scope waits for the other threads.
        running.into_iter().try_for_each(|thread| {
            let ended = thread.join();
            ended.unwrap_or_else(|panic| resume_unwind(panic))
        })
    })
}

fn pool(threads: usize) -> Result<ThreadPool, SiteBuildError> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| SiteBuildError::Threads(format!("{error}")))
}
