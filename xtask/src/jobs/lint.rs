//! `fmt` and `clippy`.

use crate::arguments::Arguments;
use crate::need::{self, THUMBS};
use crate::shell::{Result, cmd};

/// Sets of features of the library.
const FEATURES: [&str; 4] = ["", "std", "defmt", "std,defmt"];
/// Those that a controller may use.
const FIRMWARE_FEATURES: [&str; 2] = ["", "defmt"];

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
    lint("--workspace --exclude posegate-boards --all-targets")?;
    // Alone, since its decoder of defmt switches on a feature of serde_json that the program must not have.
    lint("-p posegate-boards --all-targets")?;
    for target in THUMBS {
        for features in FIRMWARE_FEATURES {
            lint(&format!(
                "-p posegate --lib --target {target} --features={features}"
            ))?;
        }
        lint(&format!("-p posegate-c --lib --target {target}"))?;
    }
    for features in ["firmware", "firmware,defmt"] {
        lint(&format!(
            "-p posegate --examples --target thumbv7em-none-eabihf --features {features}"
        ))?;
    }
    Ok(())
}
