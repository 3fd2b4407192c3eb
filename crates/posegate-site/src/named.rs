//! Files that a site file names.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// A file that a site file names, at the time of reading.
#[derive(Clone, Debug)]
pub(super) struct NamedFile {
    pub(super) path: PathBuf,
    /// SHA-256 of the file's bytes.
    pub(super) digest: [u8; 32],
}

impl NamedFile {
    pub(super) fn new(path: &Path, bytes: &[u8]) -> Self {
        Self {
            path: path.into(),
            digest: Sha256::digest(bytes).into(),
        }
    }
}
