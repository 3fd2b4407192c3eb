//! Which program builds.

use std::path::Path;

use super::digest::digest_of;
use super::error::FleetError;
use super::store::fault;

/// The SHA-256 of a program's file, in hexadecimal digits: what another build makes is other work. It reads the file once.
///
/// # Errors
/// [`FleetError::File`].
pub fn program(path: &Path) -> Result<String, FleetError> {
    digest_of(path).map_err(fault(path))
}
