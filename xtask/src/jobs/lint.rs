//! `fmt` and `clippy`.

use crate::arguments::Arguments;
use crate::need::{self, THUMBS};
use crate::shell::{Result, cmd};

/// Sets of features for the library alone, besides none and `std,defmt`.
const FEATURES: [&str; 2] = ["std", "defmt"];

pub fn fmt(_: &Arguments) -> Result {
    cmd("cargo fmt --all --check").run()
}

fn lint(words: &str) -> Result {
    cmd("cargo clippy")
        .words(words)
        .words("-- -D warnings")
        .run()
}

/// Checks the code that most changes touch: every crate that the fast suite builds, with all its targets; the core without `std`, for
/// which it has lints of its own; and the lock files of the workspaces that only their own jobs build.
pub fn quick(_: &Arguments) -> Result {
    lint("--workspace --exclude posegate-peers --all-targets")?;
    lint("-p posegate --lib")?;
    lock_files()
}

/// Checks the library alone with each set of features, all other crates with their features, the code for controllers, and the fuzz
/// targets, which no other build includes.
pub fn clippy(given: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    quick(given)?;
    lint("-p posegate-peers --all-targets")?;
    for features in FEATURES {
        lint(&format!("-p posegate --lib --features={features}"))?;
    }
    for parts in ["", "cells", "headings,unions"] {
        lint(&format!(
            "-p posegate-c --lib --no-default-features --features={parts}"
        ))?;
    }
    for target in THUMBS {
        lint(&format!("-p posegate-c --lib --target {target}"))?;
    }
    for features in ["firmware", "firmware,defmt"] {
        lint(&format!(
            "-p posegate --examples --target thumbv7em-none-eabihf --features {features}"
        ))?;
    }
    need::command("c++", "g++")?;
    super::fuzz::check()
}

/// Checks that the lock files of the workspaces that only their own jobs build are current.
fn lock_files() -> Result {
    for name in ["python", "ros2"] {
        let manifest = format!("crates/posegate-{name}/Cargo.toml");
        cmd("cargo metadata --locked --format-version 1 --manifest-path")
            .arg(&manifest)
            .read()
            .map_err(|error| format!("{manifest}: {error}; run `cargo metadata` without --locked, and commit the lock file"))?;
    }
    Ok(())
}
