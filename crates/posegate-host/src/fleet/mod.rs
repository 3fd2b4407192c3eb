//! All tables, proofs and plans of a site, in shards that any scheduler can run.
//!
//! A site is cut into [`Piece`]s. Each shard ([`Shard`]) makes its own ones ([`build()`]), and what comes of a piece is one
//! file, written whole or not at all, named by all that it depends on ([`Recipe`]). [`merge()`] puts them together, or says
//! what is missing: the same bytes for any number of shards and threads.

pub use self::build::{BuildOptions, BuildSummary, build};
pub use self::error::{FleetError, PieceError};
pub use self::inventory::Inventory;
pub use self::manifest::{BUILD_WRITES, MERGE_WRITES};
pub use self::merge::{MergeChecks, MergeSummary, merge, pieces};
pub use self::part::part;
pub use self::piece::{Asked, Piece, Recipe};
pub use self::program::program;
pub use self::shard::{ParseShardError, Shard, number};

#[doc = include_str!("language.md")]
pub mod language {}

mod build;
mod digest;
mod error;
mod finished;
mod inventory;
#[cfg(test)]
mod journal;
mod lists;
mod lock;
mod make;
mod manifest;
mod merge;
mod names;
mod part;
mod piece;
mod program;
mod proof;
mod random;
mod shard;
mod stage;
mod store;
#[cfg(test)]
mod swap_tests;
#[cfg(test)]
mod tests;
