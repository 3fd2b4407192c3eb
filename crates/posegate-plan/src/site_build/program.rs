//! The digest of the program that builds a site.

use std::path::Path;

use super::digest::sha256_of_file;
use super::error::SiteBuildError;
use super::store::fault;

/// Returns the SHA-256 of a program's file as hexadecimal digits. It is part of every key, because another build of
/// the program may make other results.
///
/// # Errors
/// [`SiteBuildError::File`] if the file cannot be read.
pub fn program(path: &Path) -> Result<String, SiteBuildError> {
    sha256_of_file(path).map_err(fault(path))
}
