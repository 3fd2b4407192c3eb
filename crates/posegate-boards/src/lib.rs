//! Tests of the firmware examples on emulated boards: `cargo test -p posegate-boards`.
//!
//! They are a separate package because `defmt-decoder` enables a feature of `serde_json` that reads numbers differently.
//! The program is never built with that feature.
