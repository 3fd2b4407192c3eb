//! Link arguments of the firmware examples, and the configurations `narrow_products` and `small_code`.
//!
//! A Cortex-M0+ multiplies 32 by 32 bits to 32: a product of 64 bits is a call of some 45 instructions. With
//! `narrow_products`, such products are made of halves in place. Rust has no other sign of such a core.
//!
//! At the levels of optimization "s" and "z", `small_code` selects one shared function where level 3 has a copy at each call, or a faster
//! and larger one. Both give the same results.
//!
//! The link arguments apply only to this package's examples: with `rustc-link-search`, a firmware without its own
//! `memory.x` would silently be linked at this package's addresses.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rerun-if-changed=memory/an505.x");
    let variable = |name| std::env::var(name).unwrap_or_else(|error| panic!("{name}: {error}"));
    println!("cargo::rustc-check-cfg=cfg(narrow_products)");
    let target = variable("TARGET");
    if target.starts_with("thumbv6m") || target.starts_with("thumbv8m.base") {
        println!("cargo::rustc-cfg=narrow_products");
    }
    println!("cargo::rustc-check-cfg=cfg(small_code)");
    if ["s", "z"].contains(&variable("OPT_LEVEL").as_str()) {
        println!("cargo::rustc-cfg=small_code");
    }
    if variable("CARGO_CFG_TARGET_OS") != "none" {
        return;
    }
    let directory = variable("CARGO_MANIFEST_DIR");
    for argument in [&format!("-L{directory}"), "--nmagic", "-Tlink.x"] {
        println!("cargo::rustc-link-arg-examples={argument}");
    }
    // `defmt` keeps its strings in this section. Cargo cannot pass arguments to a single example; for
    // examples without logs this adds an empty section.
    if std::env::var_os("CARGO_FEATURE_DEFMT").is_some() {
        println!("cargo::rustc-link-arg-examples=-Tdefmt.x");
    }
    // The linker prefers a `memory.x` in its working directory to any other, so another search
    // directory cannot replace it; rust-lld can read another file instead.
    if target.starts_with("thumbv8m.main") {
        println!(
            "cargo::rustc-link-arg-examples=--remap-inputs=*memory.x={directory}/memory/an505.x"
        );
    }
}
