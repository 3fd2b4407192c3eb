//! Errors of building and merging.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::Piece;
use crate::PlanError;
use posegate::verify::BuildError;
use posegate_files::printable::printable;

/// The reason why a piece cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PieceError {
    /// The table has no extent: the success set is unbounded or empty, and the task has no `expected`.
    #[error(
        "no extent can be chosen for its success set, which has no bound, or no pose: add `expected = {{ translation = .., yaw_deg = .. }}` to the task, or an extent in [table]"
    )]
    NoExtent,
    /// The table cannot be made or proven.
    #[error(transparent)]
    Table(#[from] BuildError),
    /// The planner rejects the task.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

/// The reason why a shard is not built, or why shards are not merged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SiteBuildError {
    /// A file cannot be read or written.
    #[error("{}: {cause}", shown(path))]
    File {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: std::io::Error,
    },
    /// The output folder is a file.
    #[error("{}: is a file, and a folder is needed", shown(.0))]
    NoFolder(PathBuf),
    /// The output folder has results of another program.
    #[error(
        "{}: there is a `{name}` already that is of no site build",
        shown(folder)
    )]
    Foreign {
        /// The output folder.
        folder: PathBuf,
        /// The name of the results.
        name: &'static str,
    },
    /// The site has no task.
    #[error("the site has no task, so there is no table to build: add one ([task.NAME])")]
    NoTasks,
    /// Pieces cannot be made. All others were made.
    #[error("{}", refused(.0))]
    Refused(Vec<(Piece, PieceError)>),
    /// No shard was started in the folder of a merge.
    #[error("{}: no shard was built here", shown(.0))]
    NoShards(PathBuf),
    /// A file was not written by this program, or was changed.
    #[error("{}: {why}", shown(path))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The fault of the file.
        why: String,
    },
    /// Shards of different sites, programs or options.
    #[error("shards are of different sites, programs or options{}", lines(.0))]
    Mixed(Vec<String>),
    /// The pieces are of another site than the given one.
    #[error("the parts are of the site {parts}, and the site file is {site}")]
    OtherSite {
        /// The digest of the site of the pieces.
        parts: String,
        /// The digest of the given site.
        site: String,
    },
    /// The pieces are of another program than the one that merges.
    #[error("the parts are by the program {} {}, and this one is {} {}", parts.0, parts.1, own.0, own.1)]
    OtherProgram {
        /// The version and the digest of the program that made the pieces.
        parts: (String, String),
        /// The version and the digest of the program that merges.
        own: (String, String),
    },
    /// Tables are not proven, with the reason of each.
    #[error("{}", listed("tables that are NOT proven", .0))]
    Unproven(Vec<String>),
    /// A file among the results was not written by a merge.
    #[error("{}: no merge has written it, and what is beside it would be replaced", shown(.0))]
    Unlisted(PathBuf),
    /// Another merge is running in the folder.
    #[error("{}: another merge is at work here", shown(.0))]
    Locked(PathBuf),
    /// Pieces are missing or damaged.
    #[error("{}", listed("pieces that are missing or damaged", .0))]
    Missing(Vec<String>),
    /// The threads cannot be started.
    #[error("threads: {0}")]
    Threads(String),
}

impl SiteBuildError {
    /// Returns advice for the user.
    #[must_use]
    pub const fn help(&self) -> &'static str {
        match self {
            Self::File { .. } => {
                "make room, or check that it can be read and written; finished pieces are kept: run the same again with --resume"
            }
            Self::NoFolder(_) | Self::Foreign { .. } => {
                "name another folder, or one that is not there yet"
            }
            Self::NoTasks => "`posegate check SITE` says what the site has",
            Self::Refused(_) => {
                "fix the site file; `posegate table build` and `posegate plan` say more about a single task"
            }
            Self::NoShards(_) => "run `posegate site build SITE -o DIR` first, each shard of it",
            Self::Damaged { .. } | Self::Missing(_) => {
                "build the shards that are named again with --resume: only what is missing is made"
            }
            Self::Mixed(_) => {
                "build every shard again with the same site file, options and program file, or into a fresh folder; `site merge DIR --site SITE` leaves out shards of other sites; remove stale shard files from `parts`"
            }
            Self::OtherSite { .. } => {
                "name the site file that was built, or build every shard again with this one"
            }
            Self::OtherProgram { .. } => {
                "merge with the program file that the shards ran, or build again with this one; --any-program takes the parts as they are"
            }
            Self::Unproven(_) => {
                "the parts are not what this program makes of the site: build into a fresh folder that nobody else writes to"
            }
            Self::Unlisted(_) => "move it out of the way, or build into another folder",
            Self::Locked(_) => "wait until it has ended",
            Self::Threads(_) => "give a small number of threads",
        }
    }

    /// Returns `true` if it is an internal error: a baked table that does not match its input.
    #[must_use]
    pub fn is_internal(&self) -> bool {
        let fault = |(_, refused): &(Piece, PieceError)| matches!(refused, PieceError::Table(error) if error.is_internal());
        matches!(self, Self::Refused(all) if all.iter().any(fault))
    }
}

/// Returns a path without line ends, because messages have several lines.
fn shown(path: &Path) -> String {
    printable(&path.to_string_lossy()).into_owned()
}

/// The largest number of names in a message.
pub(super) const MAX_NAMED: usize = 8;

fn listed(what: &str, names: &[String]) -> String {
    let named = names.get(..MAX_NAMED).unwrap_or(names);
    let mut text = std::format!("{what}: {}{}", names.len(), lines(named));
    if names.len() > named.len() {
        let _ = write!(text, "\n  and {} more", names.len() - named.len());
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
