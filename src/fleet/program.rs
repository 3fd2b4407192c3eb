//! Which program builds.

use std::fs::File;
use std::io;
use std::path::Path;
use std::string::String;

use sha2::{Digest, Sha256};

use super::digest::hex;
use super::error::FleetError;
use super::store::fault;

/// The SHA-256 of a program's file, in hexadecimal digits: what another build makes is other work. It reads the file once.
///
/// # Errors
/// [`FleetError::File`].
pub fn program(path: &Path) -> Result<String, FleetError> {
    let mut digest = Sha256::new();
    let read = File::open(path).and_then(|mut file| io::copy(&mut file, &mut digest));
    read.map_err(fault(path))?;
    Ok(hex(&digest.finalize()))
}
