//! Why a shard is not built, or nothing is merged.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::Piece;
use crate::plan::PlanError;
use crate::printable::printable;
use posegate::verify::BuildError;

/// Why a piece is not made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PieceError {
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
    #[error("{}: {cause}", shown(path))]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// Where the output goes is a file.
    #[error("{}: is a file, and a folder is needed", shown(.0))]
    NoFolder(PathBuf),
    /// A folder with results that are not of this program.
    #[error(
        "{}: there is a `{name}` already that is of no site build",
        shown(folder)
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// What is in it.
        name: &'static str,
    },
    /// Pieces that cannot be made; all others are there.
    #[error("{}", refused(.0))]
    Refused(Vec<(Piece, PieceError)>),
    /// Nothing to merge.
    #[error("{}: no shard has ended here", shown(.0))]
    NoShards(PathBuf),
    /// A file that this program has not written, or that was changed.
    #[error("{}: {why}", shown(path))]
    Damaged {
        /// Which.
        path: PathBuf,
        /// In what.
        why: String,
    },
    /// Shards of different sites.
    #[error("the site changed between shards: {} was built of the site {}, {} of {}{}", one.0, one.1, other.0, other.1, lines(sets))]
    MixedSites {
        /// A shard and the site's digest.
        one: (String, String),
        /// Another one with another digest.
        other: (String, String),
        /// The lists there are, by what they have in common, in words.
        sets: Vec<String>,
    },
    /// Shards by different programs, or asked for different plans.
    #[error(
        "shards are not alike: {one} and {other} differ in their program, or in what plans were asked for{}",
        lines(sets)
    )]
    MixedRecipes {
        /// A shard.
        one: String,
        /// Another one.
        other: String,
        /// The lists there are, by what they have in common, in words.
        sets: Vec<String>,
    },
    /// Shards of different numbers.
    #[error(
        "{one} and {other} are mixed: they cut the site into different numbers of shards{}",
        lines(sets)
    )]
    MixedCounts {
        /// A shard.
        one: String,
        /// Another one.
        other: String,
        /// The lists there are, by what they have in common, in words.
        sets: Vec<String>,
    },
    /// Parts of another site than the one that is named.
    #[error("the parts are of the site {parts}, and the site file is {site}")]
    OtherSite {
        /// The digest of the site that the parts are of.
        parts: String,
        /// That of the site that is named.
        site: String,
    },
    /// Parts by another program than the one that merges.
    #[error("the parts are by the program {} {}, and this one is {} {}", parts.0, parts.1, own.0, own.1)]
    OtherProgram {
        /// The version and the digest of the program that has made the parts.
        parts: (String, String),
        /// Those of the one that merges.
        own: (String, String),
    },
    /// Shards that have not ended.
    #[error("{}", counted("shards that have not ended", first, *count))]
    Gap {
        /// The first of them.
        first: Vec<String>,
        /// How many there are.
        count: usize,
    },
    /// A piece that is listed twice, or by a shard whose share it is not.
    #[error("{piece} is the share of {own} alone, and is listed by {}", by.join(" and by "))]
    Overlap {
        /// Which.
        piece: Piece,
        /// The list of the shard whose share it is.
        own: String,
        /// The lists that it is in.
        by: Vec<String>,
    },
    /// Tables that are not proven, with why.
    #[error("{}", listed("tables that are NOT proven", .0))]
    Unproven(Vec<String>),
    /// A file among the results that no merge has written.
    #[error("{}: no merge has written it, and what is beside it would be replaced", shown(.0))]
    Unlisted(PathBuf),
    /// Another merge that runs in the folder.
    #[error("{}: another merge is at work here: {by}", shown(path))]
    Locked {
        /// The file that it holds.
        path: PathBuf,
        /// Its machine and process.
        by: String,
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
            Self::MixedSites { .. } | Self::MixedRecipes { .. } => {
                "build every shard again with the same site file, options and program file, or into a fresh folder; where some are stale, `site merge DIR --site SITE` takes those of the site alone"
            }
            Self::MixedCounts { .. } => {
                "remove those files that are stale from `parts`, or build into a fresh folder; `site merge DIR --site SITE` leaves them out by itself where the others are complete"
            }
            Self::OtherSite { .. } => {
                "name the site file that was built, or build every shard again with this one"
            }
            Self::OtherProgram { .. } => {
                "merge with the program file that the shards ran, or build again with this one; --any-program takes the parts as they are"
            }
            Self::Gap { .. } => "run them, with --resume where they were begun",
            Self::Overlap { .. } => "build the shards that are named again",
            Self::Unproven(_) => {
                "the parts are not what this program makes of the site: build into a fresh folder that nobody else writes to"
            }
            Self::Unlisted(_) => "move it out of the way, or build into another folder",
            Self::Locked { .. } => {
                "wait until it has ended; if no merge runs, it was killed: remove that file and merge again"
            }
            Self::Threads(_) => "give a small number of threads",
        }
    }

    /// Whether it is a fault of this program: a table that was baked and is none of the order.
    #[must_use]
    pub fn is_internal(&self) -> bool {
        let fault = |(_, refused): &(Piece, PieceError)| matches!(refused, PieceError::Table(error) if error.is_internal());
        matches!(self, Self::Refused(all) if all.iter().any(fault))
    }
}

/// A path without line ends: a message of several lines has them as its own.
fn shown(path: &Path) -> String {
    printable(&path.to_string_lossy()).into_owned()
}

/// How many of a list are named.
pub(super) const NAMED: usize = 8;

fn listed(what: &str, names: &[String]) -> String {
    counted(what, names, names.len())
}

/// The first of so many names.
fn counted(what: &str, names: &[String], count: usize) -> String {
    let named = names.get(..NAMED).unwrap_or(names);
    let mut text = std::format!("{what}: {count}{}", lines(named));
    if count > named.len() {
        let _ = write!(text, "\n  and {} more", count - named.len());
    }
    text
}

fn lines(names: &[String]) -> String {
    names
        .iter()
        .map(|name| std::format!("\n  {}", printable(name)))
        .collect()
}

fn refused(all: &[(Piece, PieceError)]) -> String {
    let lines: Vec<String> = all
        .iter()
        .map(|(piece, why)| std::format!("{piece}: {why}"))
        .collect();
    listed("pieces that cannot be made", &lines)
}
