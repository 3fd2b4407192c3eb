//! What a site is cut into.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::digest::{hex, of_texts};
use super::names::file_name;
use crate::plan::Options;
use crate::site::Site;

/// The version of all files of this module.
pub(super) const FORMAT: u32 = 2;

/// A part of a site's work that is done whole or not at all.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
#[non_exhaustive]
pub enum Piece {
    /// A task's table with the result of its proof.
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
    /// Where its table goes, for a table.
    pub(super) fn table_path(task: &str) -> String {
        format!("tables/{}.posegate", file_name(task))
    }

    /// Where the result of a table's proof goes.
    pub(super) fn proof_path(task: &str) -> String {
        format!("proofs/{}.json", file_name(task))
    }

    /// Where a plan goes.
    pub(super) fn plan_path(from: &str, task: &str) -> String {
        format!("plans/{}/{}.json", file_name(from), file_name(task))
    }

    /// Where all that comes of it goes, in the order in which it is written.
    pub(super) fn paths(&self) -> Vec<String> {
        match self {
            Self::Table { task } => vec![Self::table_path(task), Self::proof_path(task)],
            Self::Plan { from, task } => vec![Self::plan_path(from, task)],
        }
    }

    /// Its key: SHA-256 over all that what comes of it depends on, in hexadecimal digits.
    #[must_use]
    pub fn key(&self, recipe: &Recipe) -> String {
        hex(&self.digest(recipe))
    }

    /// Its key as bytes.
    pub(super) fn digest(&self, recipe: &Recipe) -> [u8; 32] {
        let format = format!("posegate piece {FORMAT}");
        let common = [
            format.as_str(),
            &recipe.site_digest,
            &recipe.tool_version,
            &recipe.program,
        ];
        match self {
            Self::Table { task } => {
                let [a, b, c, d] = common;
                of_texts(&[a, b, c, d, "table", task])
            }
            Self::Plan { from, task } => {
                let [a, b, c, d] = common;
                let asked = recipe.plans.as_ref().map(Asked::as_text);
                of_texts(&[a, b, c, d, "plan", from, task, &asked.unwrap_or_default()])
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

/// All that the results depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// SHA-256 of the site, in hexadecimal digits.
    pub site_digest: String,
    /// The version of this program.
    pub tool_version: String,
    /// SHA-256 of the program's file ([`program()`](super::program())), in hexadecimal digits: a version may have many builds.
    pub program: String,
    /// What plans are asked for; none are made without it.
    pub plans: Option<Asked>,
}

/// What every plan is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    /// The largest chance that a plan fails although no step does.
    pub most_risk: f64,
    /// Whether there must be a plan after the loss of any one tag.
    pub survive_a_lost_tag: bool,
    /// Labels that a search may look at.
    pub limit: usize,
}

impl Asked {
    fn as_text(&self) -> String {
        format!(
            "{:?} {} {}",
            self.most_risk, self.survive_a_lost_tag, self.limit
        )
    }

    /// As the planner is asked; drives cost what the site says.
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
    /// Of a site and the digest of the program that builds it; without `plans` its tables and proofs alone. Costs of drives
    /// that a user gives ([`Options::costs`]) are not part of it, and are left out.
    #[must_use]
    pub fn of(site: &Site, plans: Option<&Options>, program: &str) -> Self {
        Self::of_digest(site.digest, plans, program)
    }

    /// Of a site's digest ([`Site::digest`]), as [`Self::of`] is of the site.
    #[must_use]
    pub fn of_digest(site: [u8; 32], plans: Option<&Options>, program: &str) -> Self {
        Self {
            site_digest: hex(&site),
            tool_version: env!("CARGO_PKG_VERSION").into(),
            program: program.into(),
            plans: plans.map(|options| Asked {
                most_risk: options.most_risk,
                survive_a_lost_tag: options.survive_a_lost_tag,
                limit: options.limit,
            }),
        }
    }
}
