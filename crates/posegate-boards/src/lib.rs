//! Tests of the firmware examples on emulated boards: `cargo test -p posegate-boards`.
//!
//! They are a package of their own because `defmt-decoder` switches on a feature of `serde_json` that reads numbers in another
//! way. The program is never built with it.
