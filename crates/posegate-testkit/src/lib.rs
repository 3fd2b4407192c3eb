//! Shared test code: an oracle that has no code in common with the core, random sites and pose-sets, runs of the command
//! line in a folder, emulated boards.

use std::path::PathBuf;

pub mod bags;
pub mod commands;
pub mod controller;
pub mod counts;
pub mod dock;
pub mod driven;
pub mod estimates;
pub mod firmware;
pub mod gate;
#[cfg(feature = "host")]
pub mod hall;
pub mod judge;
pub mod looks;
pub mod mcap;
pub mod mutants;
pub mod nature;
pub mod oracle;
pub mod picture;
pub mod planning_sites;
pub mod plant;
pub mod replay;
pub mod run;
#[cfg(feature = "host")]
pub mod sites;
pub mod stepped;
#[cfg(feature = "host")]
pub mod storages;
pub mod vectors;
pub mod warehouse;
pub mod wrapped;

/// Returns the repository's folder.
pub fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// Returns the program `posegate`, for the tests of `posegate-cli`: cargo builds it next to the folder of the tests.
///
/// # Panics
/// If the tests were started without cargo and it was not built.
pub fn program() -> PathBuf {
    let test = std::env::current_exe().expect("the path of the test");
    let built = test.ancestors().nth(2).expect("the folder of the build");
    let program = built.join(format!("posegate{}", std::env::consts::EXE_SUFFIX));
    assert!(
        program.is_file(),
        "{}: cargo build --bin posegate",
        program.display()
    );
    program
}
