//! All pieces of a site, and the shard that makes each.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::piece::{FORMAT, Piece, Recipe};
use super::shard::Shard;
use posegate_site::{ChainStep, Site, StartFrame, TaskKind};

/// Each shard that makes plans makes at least this many, if there are enough. Plans share a library of the complete
/// site, which is more expensive than some dozens of plans.
const PLANS_PER_SHARD: usize = 64;

/// All pieces of a site in the order in which shards take turns: tables, then plans, each sorted by key. Sorting by
/// key distributes tasks with similar names over the shards. The numbers of tables of two shards differ by at most
/// one. The last shards make the plans, as few shards as have 64 plans each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inventory {
    format: u32,
    /// The inputs that the results depend on.
    pub recipe: Recipe,
    pieces: Vec<Piece>,
}

impl Inventory {
    /// Returns the pieces of a site: one table per task and, if the recipe has plans, a plan to each work task from its
    /// own `from`, and from each chain to the work task that it ends with.
    #[must_use]
    pub fn new(site: &Site, recipe: Recipe) -> Self {
        let mut plans = BTreeSet::new();
        if recipe.plans.is_some() {
            for (task, of) in &site.tasks {
                if let Some(from) = &of.from {
                    let (from, task) = (from.clone(), task.clone());
                    plans.insert(Piece::Plan { from, task });
                }
            }
            for (from, chain) in &site.chains {
                // A start in the goal's frame has no pose in the world.
                let last = match chain.steps.last() {
                    Some(ChainStep::Task(task)) if chain.start.frame == StartFrame::World => task,
                    _ => continue,
                };
                let work = site.tasks.get(last);
                if work.is_some_and(|task| task.kind == TaskKind::Work) {
                    let (from, task) = (from.clone(), last.clone());
                    plans.insert(Piece::Plan { from, task });
                }
            }
        }
        let task = |task: &String| Piece::Table { task: task.clone() };
        let tables = site.tasks.keys().map(task).collect();
        let mut pieces = sorted_by_key(tables, &recipe);
        pieces.extend(sorted_by_key(plans.into_iter().collect(), &recipe));
        Self {
            format: FORMAT,
            recipe,
            pieces,
        }
    }

    /// Returns all pieces.
    #[must_use]
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Returns the pieces of a shard: a function of the recipe, the shard's index and the number of shards.
    pub fn share(&self, shard: Shard) -> impl Iterator<Item = &Piece> {
        let numbered = self.pieces.iter().enumerate();
        let (index, count) = (shard.index() as usize, shard.count() as usize);
        let own = numbered.filter(move |(number, _)| self.owner(*number, count) == index);
        own.map(|(_, piece)| piece)
    }

    /// Returns the index of the shard that makes a piece, from the piece's place in [`Self::pieces`]. `count` is 1 or more.
    pub(super) fn owner(&self, number: usize, count: usize) -> usize {
        let is_table = |piece: &Piece| matches!(piece, Piece::Table { .. });
        let tables = self.pieces.partition_point(is_table);
        match number.checked_sub(tables) {
            None => number % count,
            Some(plan) => {
                let plans = self.pieces.len() - tables;
                let with_plans = count.min(plans.div_ceil(PLANS_PER_SHARD)).max(1);
                count - 1 - plan % with_plans
            }
        }
    }
}

/// Returns pieces sorted by key.
fn sorted_by_key(mut pieces: Vec<Piece>, recipe: &Recipe) -> Vec<Piece> {
    pieces.sort_by_cached_key(|piece| piece.digest(recipe));
    pieces
}
