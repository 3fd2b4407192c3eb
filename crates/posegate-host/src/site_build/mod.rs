//! All tables, proofs and plans of a site, made in shards that any scheduler can run.
//!
//! Entry points: [`build()`] makes the [`Piece`]s of a [`Shard`], [`merge()`] writes the results. A piece is one file, written
//! atomically and named by the digest of all that it depends on ([`Recipe`]). A merge checks that every piece of the
//! [`Inventory`] is there and valid. Its results are the same bytes for any number of shards and threads.

pub use self::build::{BuildOptions, BuildSummary, build};
pub use self::digest::program;
pub use self::error::{PieceError, SiteBuildError};
pub use self::inventory::Inventory;
pub use self::merge::{MergeChecks, MergeSummary, merge, pieces};
pub use self::part::part;
pub use self::piece::{Piece, PlanOptions, Recipe};
pub use self::results::{BUILD_WRITES, MERGE_WRITES};
pub use self::shard::{ParseShardError, Shard, number};

#[doc = include_str!("language.md")]
pub mod language {}

mod build;
mod digest;
mod error;
mod inventory;
mod make;
mod merge;
mod part;
mod piece;
mod piece_file;
mod proof;
mod records;
mod results;
mod shard;
mod store;

#[cfg(test)]
mod merge_tests;
#[cfg(test)]
mod tests;
