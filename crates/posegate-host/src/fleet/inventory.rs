//! All pieces of a site, and which are whose.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::piece::{FORMAT, Piece, Recipe};
use super::shard::Shard;
use crate::site::{ChainStep, Site, StartFrame, TaskKind};

/// Plans that one shard makes before another one has plans too: the library of the whole site that they share is dearer than
/// some dozens of them.
const TOGETHER: usize = 64;

/// All pieces of a site in the order in which shards take turns: tables, then plans, each by their keys. So what is alike in a
/// site's names comes to no shard alone, and shards differ by one table at most. Plans are made by the last shards, as few of them as
/// have 64 plans each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inventory {
    format: u32,
    /// What the results depend on.
    pub recipe: Recipe,
    pieces: Vec<Piece>,
}

impl Inventory {
    /// Of a site: a table a task, and where the recipe has them plans: to each work task from its own `from`, and from
    /// each chain to the work task that it ends with.
    #[must_use]
    pub fn of(site: &Site, recipe: Recipe) -> Self {
        let mut plans = BTreeSet::new();
        if recipe.plans.is_some() {
            for (task, of) in &site.tasks {
                if let Some(from) = &of.from {
                    let (from, task) = (from.clone(), task.clone());
                    plans.insert(Piece::Plan { from, task });
                }
            }
            for (from, chain) in &site.chains {
                // A start in the goal's frame is for whoever names it.
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
        let mut inventory = Self::of_tables(site.tasks.keys().cloned(), recipe);
        let plans = plans.into_iter().collect();
        inventory.pieces.extend(in_turn(plans, &inventory.recipe));
        inventory
    }

    /// Of tasks, each named once: a table each and no plan.
    #[must_use]
    pub fn of_tables(tasks: impl Iterator<Item = String>, recipe: Recipe) -> Self {
        let tables = tasks.map(|task| Piece::Table { task }).collect();
        Self {
            format: FORMAT,
            pieces: in_turn(tables, &recipe),
            recipe,
        }
    }

    /// All pieces.
    #[must_use]
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// The pieces of a shard: a function of the site's digest (and the rest of the recipe), the shard's number and how
    /// many there are.
    pub fn share(&self, shard: Shard) -> impl Iterator<Item = &Piece> {
        let numbered = self.pieces.iter().enumerate();
        let (index, count) = (shard.index() as usize, shard.count() as usize);
        let own = numbered.filter(move |(number, _)| self.owner(*number, count) == index);
        own.map(|(_, piece)| piece)
    }

    /// The index of the shard, of `count` at least 1, whose piece it is.
    pub(super) fn owner(&self, number: usize, count: usize) -> usize {
        let is_table = |piece: &Piece| matches!(piece, Piece::Table { .. });
        let tables = self.pieces.partition_point(is_table);
        match number.checked_sub(tables) {
            None => number % count,
            Some(plan) => {
                let plans = self.pieces.len() - tables;
                let with_plans = count.min(plans.div_ceil(TOGETHER)).max(1);
                count - 1 - plan % with_plans
            }
        }
    }
}

/// Pieces in the order of their keys.
fn in_turn(mut pieces: Vec<Piece>, recipe: &Recipe) -> Vec<Piece> {
    pieces.sort_by_cached_key(|piece| piece.digest(recipe));
    pieces
}
