//! `fmt` and `clippy`.

use crate::arguments::Arguments;
use crate::need::{self, THUMBS};
use crate::shell::{Result, cmd};

/// Sets of features of the library alone; the workspace has the other one, `std,defmt`.
const FEATURES: [&str; 3] = ["", "std", "defmt"];

pub fn fmt(_: &Arguments) -> Result {
    cmd("cargo fmt --all --check").run()
}

/// The library alone with each set of features; all other crates with theirs; and what runs on a controller.
pub fn clippy(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    let lint = |words: &str| {
        cmd("cargo clippy")
            .words(words)
            .words("-- -D warnings")
            .run()
    };
    for features in FEATURES {
        lint(&format!("-p posegate --lib --features={features}"))?;
    }
    // Nothing is run, so it does not matter which features packages have from each other.
    lint("--workspace --all-targets")?;
    for target in THUMBS {
        lint(&format!("-p posegate-c --lib --target {target}"))?;
    }
    for features in ["firmware", "firmware,defmt"] {
        lint(&format!(
            "-p posegate --examples --target thumbv7em-none-eabihf --features {features}"
        ))?;
    }
    Ok(())
}
