//! All tables, proofs and plans of a site, made in shards that any scheduler can run.
//!
//! Entry points: [`build()`] makes the [`Piece`]s of a [`Shard`], [`merge()`] writes the results. A piece is one
//! file, written atomically and named by the digest of all its inputs ([`Recipe`]). A merge checks that every piece
//! of the [`Inventory`] exists and is valid. Its results are the same bytes for any number of shards and threads.
//!
//! ```
//! use posegate_site::Site;
//! use posegate_plan::site_build::{
//!     BuildOptions, Inventory, MergeChecks, Recipe, Shard, build, merge, program,
//! };
//! # const SITE: &str = include_str!("../../../../examples/sites/dock.toml");
//! # let folder = tempfile::tempdir()?;
//! # let output = folder.path();
//!
//! let site = Site::parse(SITE, "dock.toml")?;
//! // The digest of the program that runs: pieces of another one are not merged.
//! let program = program(&std::env::current_exe()?)?;
//! let inventory = Inventory::new(&site, Recipe::new(&site, None, &program));
//! // Two shards, which may run on two machines that share the folder.
//! for index in 0..2 {
//!     let options = BuildOptions { shard: Shard::new(index, 2)?, resume: true, threads: None };
//!     build(&site, &inventory, output, &options, &|| ())?;
//! }
//! let summary = merge(output, MergeChecks::Proof(&site), Some(&program), &|| ())?;
//! assert_eq!((summary.tables, summary.plans), (2, 0));
//! assert!(output.join("manifest.json").is_file());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use self::build::{BuildOptions, BuildSummary, build};
pub use self::error::{PieceError, SiteBuildError};
pub use self::inventory::Inventory;
pub use self::merge::{MergeChecks, MergeSummary, merge, pieces};
pub use self::merged_plans::{MergedPlan, MergedRoute, merged_plans};
pub use self::piece::{Piece, PlanOptions, Recipe};
pub use self::program::program;
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
mod merged_plans;
mod piece;
mod piece_file;
mod program;
mod proof;
mod records;
mod results;
mod shard;
mod store;

#[cfg(test)]
mod merge_tests;
#[cfg(test)]
mod tests;
