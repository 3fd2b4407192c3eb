//! What comes of a piece, as one file: a line of JSON that says what is in it, and the files that it holds.

use serde::{Deserialize, Serialize};

use super::digest::sha256;
use super::piece::{FORMAT, Piece, Recipe};
use super::proof::{Counts, counted};

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
    // All of its own files, each once, and no other: nothing else is ever written.
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

/// What a finished piece holds.
pub(super) struct Finished<'a> {
    /// Its files with what is listed of them.
    pub files: Vec<(Listed, &'a [u8])>,
    pub holds: Holds<'a>,
}

/// What a finished piece is.
pub(super) enum Holds<'a> {
    /// A table, and what was counted when it was proven.
    Table(&'a [u8], Counts),
    /// A plan, or, where it is `false`, that there is none.
    Plan(bool),
}

/// A finished piece of a recipe; `None` where the bytes are not those of this piece, whole, or where what it holds does not
/// belong together: a proof that is of another table, a table of another task, site or version, a plan that does not
/// say whether it is one.
pub(super) fn taken<'a>(bytes: &'a [u8], piece: &Piece, recipe: &Recipe) -> Option<Finished<'a>> {
    let files = decode(bytes, piece, &piece.key(recipe))?;
    let holds = match (piece, files.as_slice()) {
        (Piece::Table { task }, [(_, table), (_, proof)]) => {
            Holds::Table(table, counted(task, table, proof, recipe)?)
        }
        (Piece::Plan { .. }, [(_, plan)]) => {
            let told: serde_json::Value = serde_json::from_slice(plan).ok()?;
            Holds::Plan(told.get("success")?.as_bool()?)
        }
        _ => return None,
    };
    Some(Finished { files, holds })
}
