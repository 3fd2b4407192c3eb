//! Link arguments of the firmware examples.
//!
//! They are given to this package's examples alone: with `rustc-link-search` a firmware that forgot
//! its `memory.x` would be linked at this package's addresses without a word.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rerun-if-changed=memory/an505.x");
    let variable = |name| std::env::var(name).unwrap_or_else(|error| panic!("{name}: {error}"));
    if variable("CARGO_CFG_TARGET_OS") != "none" {
        return;
    }
    let directory = variable("CARGO_MANIFEST_DIR");
    for argument in [&format!("-L{directory}"), "--nmagic", "-Tlink.x"] {
        println!("cargo::rustc-link-arg-examples={argument}");
    }
    // Where `defmt` keeps its strings. Cargo gives no arguments to one example alone; to those that log
    // nothing this adds an empty section.
    if std::env::var_os("CARGO_FEATURE_DEFMT").is_some() {
        println!("cargo::rustc-link-arg-examples=-Tdefmt.x");
    }
    // The linker takes a `memory.x` of the directory that it runs in before any other, so another
    // directory cannot take its place; rust-lld can read another file in its stead.
    if variable("TARGET").starts_with("thumbv8m.main") {
        println!(
            "cargo::rustc-link-arg-examples=--remap-inputs=*memory.x={directory}/memory/an505.x"
        );
    }
}
