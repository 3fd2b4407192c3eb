//! The pieces of a site, and their dependencies.

use std::fmt::{self, Write as _};

use serde::{Deserialize, Serialize};

use super::digest::{hex, sha256_of_texts};
use crate::Options;
use posegate_site::Site;

/// The version of all files of this module.
pub(super) const FORMAT: u32 = 2;

/// A part of a site's work whose results are one file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
#[non_exhaustive]
pub enum Piece {
    /// The table of a task and the result of its proof.
    Table {
        /// The task.
        task: String,
    },
    /// A plan from a chain's start to a work task.
    Plan {
        /// The chain.
        from: String,
        /// The work task.
        task: String,
    },
}

impl Piece {
    /// Returns the path of a task's table, below the results' folder.
    pub(super) fn table_path(task: &str) -> String {
        format!("tables/{}.posegate", file_name(task))
    }

    /// Returns the path of the result of a table's proof.
    pub(super) fn proof_path(task: &str) -> String {
        format!("proofs/{}.json", file_name(task))
    }

    /// Returns the path of a plan.
    pub(super) fn plan_path(from: &str, task: &str) -> String {
        format!("plans/{}/{}.json", file_name(from), file_name(task))
    }

    /// Returns the paths of all the piece's results, in the order in which the piece's file contains them.
    pub(super) fn paths(&self) -> Vec<String> {
        match self {
            Self::Table { task } => vec![Self::table_path(task), Self::proof_path(task)],
            Self::Plan { from, task } => vec![Self::plan_path(from, task)],
        }
    }

    /// Returns the piece's key: the SHA-256 of all inputs of its results, as hexadecimal digits.
    #[must_use]
    pub fn key(&self, recipe: &Recipe) -> String {
        hex(&self.digest(recipe))
    }

    /// Returns the piece's key as bytes.
    pub(super) fn digest(&self, recipe: &Recipe) -> [u8; 32] {
        let format = format!("posegate piece {FORMAT}");
        let common = [
            format.as_str(),
            &recipe.site_digest,
            &recipe.tool_version,
            &recipe.program,
        ];
        let [a, b, c, d] = common;
        match self {
            Self::Table { task } => sha256_of_texts(&[a, b, c, d, "table", task]),
            Self::Plan { from, task } => {
                let plans = recipe.plans.as_ref().map(PlanOptions::as_text);
                sha256_of_texts(&[a, b, c, d, "plan", from, task, &plans.unwrap_or_default()])
            }
        }
    }
}

impl fmt::Display for Piece {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Table { task } => write!(f, "the table of `{task}`"),
            Self::Plan { from, task } => write!(f, "the plan from `{from}` to `{task}`"),
        }
    }
}

/// Returns a name in which every byte other than a letter, a digit, `-`, `_` and an inner `.` is replaced by `%` and
/// two digits.
pub(super) fn file_name(name: &str) -> String {
    let mut safe = String::with_capacity(name.len());
    for (at, byte) in name.bytes().enumerate() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' => safe.push(char::from(byte)),
            b'.' if at > 0 => safe.push('.'),
            _ => {
                // Writing to a string does not fail.
                let _ = write!(safe, "%{byte:02X}");
            }
        }
    }
    safe
}

/// The inputs that the results depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// SHA-256 of the site, as hexadecimal digits.
    pub site_digest: String,
    /// The version of this program.
    pub tool_version: String,
    /// SHA-256 of the program's file ([`program()`](super::program())), as hexadecimal digits, because a version may
    /// have several builds.
    pub program: String,
    /// Options of the plans; `None` if no plan is made.
    pub plans: Option<PlanOptions>,
}

/// Options of every plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanOptions {
    /// The largest chance that a plan fails although no step does.
    pub most_risk: f64,
    /// If `true`, there must be a plan after the loss of any one tag.
    pub survive_a_lost_tag: bool,
    /// The largest number of labels of a search.
    pub limit: usize,
}

impl PlanOptions {
    fn as_text(&self) -> String {
        format!(
            "{:?} {} {}",
            self.most_risk, self.survive_a_lost_tag, self.limit
        )
    }

    /// Returns the planner's options. The costs of drives are those of the site.
    pub(super) fn options(&self) -> Options {
        Options {
            most_risk: self.most_risk,
            survive_a_lost_tag: self.survive_a_lost_tag,
            limit: self.limit,
            ..Options::default()
        }
    }
}

impl Recipe {
    /// Returns the recipe of a site and the digest of the program that builds it. Without `plans` it has only tables
    /// and proofs. Costs of drives that a user gives ([`Options::costs`]) are not used.
    #[must_use]
    pub fn new(site: &Site, plans: Option<&Options>, program: &str) -> Self {
        Self {
            site_digest: hex(&site.digest),
            tool_version: env!("CARGO_PKG_VERSION").into(),
            program: program.into(),
            plans: plans.map(|options| PlanOptions {
                most_risk: options.most_risk,
                survive_a_lost_tag: options.survive_a_lost_tag,
                limit: options.limit,
            }),
        }
    }
}
