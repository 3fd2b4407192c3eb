//! The file of a finished piece: a line of JSON that lists the results in it, then their bytes.

use serde::{Deserialize, Serialize};

use super::digest::sha256;
use super::piece::{FORMAT, Piece, Recipe};
use super::proof::{Counts, checked_counts};

/// A file of the results.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ResultFile {
    /// The file's path below the results' folder.
    pub path: String,
    /// The file's length, bytes.
    pub bytes: u64,
    /// The SHA-256 of the file's bytes.
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
    let mut file = serde_json::to_vec(&head)?;
    file.push(b'\n');
    for (_, bytes) in files {
        file.extend_from_slice(bytes);
    }
    Ok(file)
}

/// Returns the results in a piece's file; `None` if the bytes are not the complete file of this piece, or a checksum
/// is wrong.
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
    // The results of the piece, each once, and no other path, so that no other file is ever written.
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

/// The results of a finished piece, and their content.
pub(super) struct Finished<'a> {
    pub files: Vec<(ResultFile, &'a [u8])>,
    pub content: Content<'a>,
}

/// The content of a piece's results.
pub(super) enum Content<'a> {
    /// A table and the counts of its proof.
    Table(&'a [u8], Counts),
    /// `true` if there is a plan.
    Plan(bool),
}

/// Returns the content of a piece's file. `None` if [`decode`] returns it, if the proof is not of this table, or if
/// the table is of another task, site or version. Also `None` if the plan does not state if there is one.
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
