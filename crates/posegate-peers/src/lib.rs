//! The tests of this package compare formats with other programs: `cargo xtask peers`. They are a package of their own
//! because those programs take longer to build than Posegate does.
