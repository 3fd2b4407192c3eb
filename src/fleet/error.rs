//! Why a shard is not built, or nothing is merged.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::string::String;
use std::vec::Vec;

use super::Piece;
use crate::plan::PlanError;
use crate::verify::BuildError;

/// Why a piece is not made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refused {
    /// Nothing says what the table is to cover.
    #[error(
        "no extent can be chosen for its success set, which has no bound, or no pose: add `expected = {{ translation = .., yaw_deg = .. }}` to the task, or an extent in [table]"
    )]
    NoExtent,
    /// A table that cannot be made or proven.
    #[error(transparent)]
    Table(#[from] BuildError),
    /// A plan that cannot be asked for.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

/// Why a shard is not built, or nothing is merged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FleetError {
    /// A file that cannot be read or written.
    #[error("{}: {cause}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// Where the output goes is a file.
    #[error("{}: is a file, and a folder is needed", .0.display())]
    NoFolder(PathBuf),
    /// A folder with results that are not of this program.
    #[error("{}: there is a `{name}` already that is of no site build", folder.display())]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// What is in it.
        name: &'static str,
    },
    /// Pieces that cannot be made; all others are there.
    #[error("{}", refused(.0))]
    Refused(Vec<(Piece, Refused)>),
    /// Nothing to merge.
    #[error("{}: no shard has ended here", .0.display())]
    NoShards(PathBuf),
    /// A file that this program has not written, or that was changed.
    #[error("{}: {why}", path.display())]
    Damaged {
        /// Which.
        path: PathBuf,
        /// In what.
        why: String,
    },
    /// Shards of different sites.
    #[error("the site changed between shards: {} was built of the site {}, {} of {}", one.0, one.1, other.0, other.1)]
    MixedSites {
        /// A shard and the site's digest.
        one: (String, String),
        /// Another one with another digest.
        other: (String, String),
    },
    /// Shards by different versions, or asked for different plans.
    #[error(
        "shards are not alike: {0} and {1} differ in their version, or in what plans were asked for"
    )]
    MixedRecipes(String, String),
    /// Shards of different numbers.
    #[error("{0} and {1} are mixed: they cut the site into different numbers of shards")]
    MixedCounts(String, String),
    /// Shards that have not ended.
    #[error("{}", listed("shards that have not ended", .0))]
    Gap(Vec<String>),
    /// A piece that two shards have made differently.
    #[error("{piece}: {one} and {other} have different bytes of it")]
    Overlap {
        /// Which.
        piece: Piece,
        /// A shard.
        one: String,
        /// Another one.
        other: String,
    },
    /// Pieces that are not there, or whose bytes are not those that were written.
    #[error("{}", listed("pieces that are missing or damaged", .0))]
    Missing(Vec<String>),
    /// A number of threads that cannot be had.
    #[error("threads: {0}")]
    Threads(String),
}

impl FleetError {
    /// How to mend it.
    #[must_use]
    pub const fn help(&self) -> &'static str {
        match self {
            Self::File { .. } => {
                "make room, or check that it can be read and written; finished pieces are kept: run the same again with --resume"
            }
            Self::NoFolder(_) | Self::Foreign { .. } => {
                "name another folder, or one that is not there yet"
            }
            Self::Refused(_) => {
                "mend the site file; `posegate table build` and `posegate plan` say more of a single task"
            }
            Self::NoShards(_) => "run `posegate site build SITE -o DIR` first, each shard of it",
            Self::Damaged { .. } | Self::Missing(_) => {
                "build the shards that are named again with --resume: only what is missing is made"
            }
            Self::MixedSites { .. } | Self::MixedRecipes(..) => {
                "build every shard again with the same site file, options and program"
            }
            Self::MixedCounts(..) => {
                "remove the shard files of the one number from `parts`, or build into a new folder"
            }
            Self::Gap(_) => "run them, with --resume where they were begun",
            Self::Overlap { .. } => "build both again, without --resume",
            Self::Threads(_) => "give a small number of threads",
        }
    }

    /// Whether it is a fault of this program: a table that was baked and is not proven.
    #[must_use]
    pub fn is_internal(&self) -> bool {
        let fault = |(_, refused): &(Piece, Refused)| {
            matches!(refused, Refused::Table(BuildError::Verify(_)))
        };
        matches!(self, Self::Refused(all) if all.iter().any(fault))
    }
}

/// How many of a list are named.
const NAMED: usize = 8;

fn listed(what: &str, names: &[String]) -> String {
    let mut text = std::format!("{what}: {}", names.len());
    for name in names.iter().take(NAMED) {
        let _ = write!(text, "\n  {name}");
    }
    if names.len() > NAMED {
        let _ = write!(text, "\n  and {} more", names.len() - NAMED);
    }
    text
}

fn refused(all: &[(Piece, Refused)]) -> String {
    let lines: Vec<String> = all
        .iter()
        .map(|(piece, why)| std::format!("{piece}: {why}"))
        .collect();
    listed("pieces that cannot be made", &lines)
}
