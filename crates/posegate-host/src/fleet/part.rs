//! What one shard needs of a large site file.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use super::inventory::Inventory;
use super::piece::{Piece, Recipe};
use super::shard::Shard;
use crate::site::{Site, SiteIndex};

/// Name of the kind of sections that are tasks.
const TASK: &str = "task";

/// For a shard that makes tables alone: the site with its own tasks and what they name, and the inventory of the whole site. All that
/// is in memory of other tasks is their names.
///
/// Every section of the file is read by one of the shards at least, as a whole reading would: so a faulty site is not built. `None`
/// where the file must be read whole ([`SiteIndex`]), as where there is but one shard.
#[must_use]
pub fn part(path: &Path, shard: Shard, program: &str) -> Option<(Site, Inventory)> {
    if shard.count() == 1 {
        return None;
    }
    let contents = SiteIndex::read(path)?;
    let recipe = Recipe::of_digest(contents.digest(), None, program);
    let inventory = Inventory::of_tables(contents.tasks().iter().cloned(), recipe);
    let own = || {
        inventory.share(shard).filter_map(|piece| match piece {
            Piece::Table { task } => Some(task.as_str()),
            Piece::Plan { .. } => None,
        })
    };
    let tasks: BTreeSet<&str> = own().collect();
    let site = contents.part(|kind, name| match kind {
        TASK => tasks.contains(name),
        _ => turn(name) % u64::from(shard.count()) == u64::from(shard.index()),
    })?;
    let whole = own().all(|task| site.tasks.contains_key(task));
    whole.then_some((site, inventory))
}

/// A number by which shards take turns: sections of one name have the same one.
fn turn(name: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    name.hash(&mut hasher);
    hasher.finish()
}
