//! The file with the result of a table's proof.

use serde::{Deserialize, Serialize};

use super::digest::{hex, sha256};
use super::piece::{Piece, Recipe};
use posegate::table::{Table, TableError};
use posegate::verify::Proof;

/// The counts of a proof.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Counts {
    cells: u64,
    corners: u64,
    runs: u64,
}

impl From<Proof> for Counts {
    fn from(proof: Proof) -> Self {
        Self {
            cells: proof.cells,
            corners: proof.corners,
            runs: proof.runs,
        }
    }
}

/// The content of the file, members sorted by name.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ProofRecord {
    bytes: u64,
    crc32c: String,
    layout: String,
    proven: Counts,
    sha256: String,
    site_digest: String,
    table: String,
    task: String,
    /// What a controller compares ([`Table::task_digest`]).
    task_digest: String,
    tool_version: String,
}

/// Returns the proof file of a task's table.
///
/// # Errors
/// [`TableError`] if the bytes are not a table.
pub(super) fn encode(
    task: &str,
    table: &[u8],
    proven: Counts,
    recipe: &Recipe,
) -> Result<Vec<u8>, TableError> {
    let made = Table::parse(table)?;
    let layout = if made.facets().is_some() {
        "facets"
    } else {
        "grid"
    };
    let record = ProofRecord {
        bytes: table.len() as u64,
        crc32c: format!("{:08x}", made.crc()),
        layout: layout.into(),
        proven,
        sha256: sha256(table),
        site_digest: recipe.site_digest.clone(),
        table: Piece::table_path(task),
        task: task.into(),
        task_digest: hex(&made.task_digest()),
        tool_version: recipe.tool_version.clone(),
    };
    // Text and numbers always have a JSON form.
    let mut bytes = serde_json::to_vec(&record).unwrap_or_default();
    bytes.push(b'\n');
    Ok(bytes)
}

/// Returns the counts in a proof file. `None` if the table is not of this task, site and version, or if the file is
/// not, byte for byte, the output of [`encode`] for this table. This proves nothing.
pub(super) fn checked_counts(
    task: &str,
    table: &[u8],
    proof: &[u8],
    recipe: &Recipe,
) -> Option<Counts> {
    let made = Table::parse(table).ok()?;
    let own = made.task() == task && made.tool_version() == recipe.tool_version;
    let given: ProofRecord = serde_json::from_slice(proof).ok()?;
    let expected = encode(task, table, given.proven, recipe).ok()?;
    (own && expected == proof).then_some(given.proven)
}
