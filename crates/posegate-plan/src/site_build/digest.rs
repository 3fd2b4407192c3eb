//! SHA-256 as text.

pub(super) use posegate_files::printable::hex;
use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::Path;

use sha2::{Digest, Sha256};

/// Returns the SHA-256 of some bytes as hexadecimal digits.
pub(super) fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Returns the SHA-256 of a file as hexadecimal digits. Memory does not hold the complete file.
pub(super) fn sha256_of_file(path: &Path) -> io::Result<String> {
    let mut digest = Sha256::new();
    // Opening a pipe would wait for a writer.
    if !path.metadata()?.is_file() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "not a file"));
    }
    io::copy(&mut File::open(path)?, &mut digest)?;
    Ok(hex(&digest.finalize()))
}

/// Returns the SHA-256 of several texts. The length of each text precedes it, so different lists of texts have
/// different inputs.
pub(super) fn sha256_of_texts(texts: &[&str]) -> [u8; 32] {
    let mut all = Sha256::new();
    for text in texts {
        all.update((text.len() as u64).to_le_bytes());
        all.update(text.as_bytes());
    }
    all.finalize().into()
}
