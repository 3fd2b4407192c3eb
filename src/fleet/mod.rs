//! All tables, proofs and plans of a site, in shards that any scheduler can run.
//!
//! A site is cut into [`Piece`]s. Each shard ([`Shard`]) makes its own ones ([`build()`]), and what comes of a piece is one
//! file, written whole or not at all, named by all that it depends on ([`Recipe`]). [`merge()`] puts them together, or says
//! what is missing: the same bytes for any number of shards and threads.

pub use self::build::{Built, Order, build};
pub use self::error::{FleetError, Refused};
pub use self::inventory::Inventory;
pub use self::merge::{Merged, merge, pieces};
pub use self::piece::{Asked, Piece, Recipe};
pub use self::shard::{BadShard, Shard};

#[doc = include_str!("language.md")]
pub mod language {}

mod build;
mod digest;
mod error;
mod finished;
mod inventory;
mod make;
mod merge;
mod names;
mod piece;
mod shard;
mod store;
#[cfg(test)]
mod tests;
