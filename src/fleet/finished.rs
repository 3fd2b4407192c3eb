//! What comes of a piece, as one file: a line of JSON that says what is in it, and the files that it holds.

use std::string::String;
use std::vec::Vec;

use serde::{Deserialize, Serialize};

use super::digest::sha256;
use super::piece::{FORMAT, Piece, Recipe};

/// A file of the results.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Listed {
    /// Its place in the folder of the results.
    pub path: String,
    /// How long it is.
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
    files: Vec<Listed>,
}

/// A piece's files with their places.
pub(super) type Files = Vec<(String, Vec<u8>)>;

/// A finished piece as bytes.
pub(super) fn encode(
    piece: &Piece,
    recipe: &Recipe,
    files: &Files,
) -> Result<Vec<u8>, serde_json::Error> {
    let listed = files.iter().map(|(path, bytes)| Listed {
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

/// The files of a finished piece with what is listed of them; `None` where the bytes are not those of this piece, whole.
pub(super) fn decode<'a>(
    bytes: &'a [u8],
    piece: &Piece,
    key: &str,
) -> Option<Vec<(Listed, &'a [u8])>> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    let (head, mut rest) = bytes.split_at_checked(end)?;
    let head: Head = serde_json::from_slice(head).ok()?;
    rest = rest.get(1..)?;
    if head.format != FORMAT || head.key != key || head.piece != *piece {
        return None;
    }
    let mut files = Vec::new();
    for listed in head.files {
        let (own, others) = rest.split_at_checked(usize::try_from(listed.bytes).ok()?)?;
        if sha256(own) != listed.sha256 || !belongs(piece, &listed.path) {
            return None;
        }
        files.push((listed, own));
        rest = others;
    }
    (rest.is_empty() && !files.is_empty()).then_some(files)
}

/// Whether a file is one of a piece's own: nothing else is ever written.
fn belongs(piece: &Piece, path: &str) -> bool {
    match piece {
        Piece::Table { task } => path == Piece::table_path(task) || path == Piece::proof_path(task),
        Piece::Plan { from, task } => path == Piece::plan_path(from, task),
    }
}
