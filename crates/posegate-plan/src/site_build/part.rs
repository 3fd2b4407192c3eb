//! The part of a large site file that one shard needs.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use super::inventory::Inventory;
use super::piece::{Piece, Recipe};
use super::shard::Shard;
use posegate_site::{Site, SiteIndex};

/// The kind of sections that are tasks.
const TASK: &str = "task";

/// Returns, for a shard that makes only tables, the site with the shard's own tasks and the entries that they refer
/// to, and the inventory of the complete site. Memory holds only the names of all other tasks.
///
/// At least one shard reads each section of the file, so a fault in any section stops the build. Returns `None` if
/// the file needs the full parser ([`SiteIndex`]), or if there is only one shard.
#[must_use]
pub fn part(path: &Path, shard: Shard, program: &str) -> Option<(Site, Inventory)> {
    if shard.count() == 1 {
        return None;
    }
    let contents = SiteIndex::read(path)?;
    let recipe = Recipe::from_digest(contents.digest(), None, program);
    let inventory = Inventory::from_tasks(contents.tasks().iter().cloned(), recipe);
    let own = || {
        inventory.share(shard).filter_map(|piece| match piece {
            Piece::Table { task } => Some(task.as_str()),
            Piece::Plan { .. } => None,
        })
    };
    let tasks: BTreeSet<&str> = own().collect();
    // A section belongs to a piece, not to a shard: the process that makes the piece reads the section, for any
    // number of shards. So a fault in the section leaves that piece missing, and the merge is refused.
    let pieces = inventory.pieces().len().max(1) as u64;
    let owner =
        |name: &str| inventory.owner((turn(name) % pieces) as usize, shard.count() as usize);
    let site = contents.part(|kind, name| match kind {
        TASK => tasks.contains(name),
        _ => owner(name) == shard.index() as usize,
    })?;
    let whole = own().all(|task| site.tasks.contains_key(task));
    whole.then_some((site, inventory))
}

/// Returns the number that assigns a section to a piece. Sections with the same name have the same number.
fn turn(name: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    name.hash(&mut hasher);
    hasher.finish()
}
