//! The file of a finished piece: a line of JSON that lists the results in it, then their bytes.

use serde::{Deserialize, Serialize};

use super::digest::sha256;
use super::piece::{FORMAT, Piece, Recipe};
use super::proof::{Counts, checked_counts};

/// A file of the results.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ResultFile {
    /// Its path below the results' folder.
    pub path: String,
    /// Its length, bytes.
    pub bytes: u64,
    /// The SHA-256 of its bytes.
    pub sha256: String,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    format: u32,
    key: String,
    piece: Piece,
    files: Vec<ResultFile>,
}

/// The results of a piece: paths and bytes.
pub(super) type Files = Vec<(String, Vec<u8>)>;

/// Returns the file of a finished piece.
pub(super) fn encode(
    piece: &Piece,
    recipe: &Recipe,
    files: &Files,
) -> Result<Vec<u8>, serde_json::Error> {
    let listed = files.iter().map(|(path, bytes)| ResultFile {
        path: path.clone(),
        bytes: bytes.len() as u64,
        sha256: sha256(bytes),
    });
    let head = Head {
        format: FORMAT,
        key: piece.key(recipe),
        piece: piece.clone(),
        files: listed.collect(),
    };
    let mut whole = serde_json::to_vec(&head)?;
    whole.push(b'\n');
    for (_, bytes) in files {
        whole.extend_from_slice(bytes);
    }
    Ok(whole)
}

/// Returns the results in a piece's file; `None` if the bytes are not the whole file of this piece, or a checksum is wrong.
pub(super) fn decode<'a>(
    bytes: &'a [u8],
    piece: &Piece,
    key: &str,
) -> Option<Vec<(ResultFile, &'a [u8])>> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    let (head, mut rest) = bytes.split_at_checked(end)?;
    let head: Head = serde_json::from_slice(head).ok()?;
    rest = rest.get(1..)?;
    if head.format != FORMAT || head.key != key || head.piece != *piece {
        return None;
    }
    // All results of the piece, each once, and no other path: nothing else is ever written.
    let paths = head.files.iter().map(|listed| &listed.path);
    if !paths.eq(&piece.paths()) {
        return None;
    }
    let mut files = Vec::new();
    for listed in head.files {
        let (own, others) = rest.split_at_checked(usize::try_from(listed.bytes).ok()?)?;
        if sha256(own) != listed.sha256 {
            return None;
        }
        files.push((listed, own));
        rest = others;
    }
    rest.is_empty().then_some(files)
}

/// The results of a finished piece, and what they say.
pub(super) struct Finished<'a> {
    pub files: Vec<(ResultFile, &'a [u8])>,
    pub content: Content<'a>,
}

/// What the results of a piece say.
pub(super) enum Content<'a> {
    /// A table and the counts of its proof.
    Table(&'a [u8], Counts),
    /// Whether there is a plan.
    Plan(bool),
}

/// Returns what a piece's file holds. `None` if [`decode`] returns it, if the proof is not of this table, if the table is of
/// another task, site or version, or if the plan does not say whether there is one.
pub(super) fn checked<'a>(bytes: &'a [u8], piece: &Piece, recipe: &Recipe) -> Option<Finished<'a>> {
    let files = decode(bytes, piece, &piece.key(recipe))?;
    let content = match (piece, files.as_slice()) {
        (Piece::Table { task }, [(_, table), (_, proof)]) => {
            Content::Table(table, checked_counts(task, table, proof, recipe)?)
        }
        (Piece::Plan { .. }, [(_, plan)]) => {
            let plan: serde_json::Value = serde_json::from_slice(plan).ok()?;
            Content::Plan(plan.get("success")?.as_bool()?)
        }
        _ => return None,
    };
    Some(Finished { files, content })
}
