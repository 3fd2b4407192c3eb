//! Names that nobody else takes.

use std::hash::{BuildHasher, RandomState};

/// 64 random bits. The number of a process is no name of it: in containers many have the same.
pub(super) fn random() -> u64 {
    RandomState::new().hash_one((std::process::id(), std::time::SystemTime::now()))
}
