//! Firmware examples: builds them, and runs them in QEMU.

use crate::files::target_folder;
use crate::shell::{Cmd, Result, cmd};
use std::path::{Path, PathBuf};

/// The cores that most jobs run firmware on: a target of Rust and a machine of QEMU.
pub const CORES: [(&str, &str); 2] = [
    ("thumbv7em-none-eabihf", "mps2-an386"),
    ("thumbv6m-none-eabi", "mps2-an385"),
];

/// Builds a firmware example and returns its ELF file.
pub fn build(target: &str, example: &str) -> Result<PathBuf> {
    build_into(&target_folder(), "", target, example)
}

/// As [`build`], for size: at the level "s", in a separate folder.
pub fn build_small(target: &str, example: &str) -> Result<PathBuf> {
    let level = "--config profile.firmware.opt-level=\"s\"";
    build_into(&target_folder().join("small"), level, target, example)
}

fn build_into(folder: &Path, more: &str, target: &str, example: &str) -> Result<PathBuf> {
    cmd(&format!("cargo build -p posegate --profile firmware --target {target} --features firmware --example {example}"))
        .words(more)
        .arg("--target-dir")
        .arg(folder)
        .run()?;
    Ok(folder.join(target).join("firmware/examples").join(example))
}

/// Returns the command that runs a firmware in QEMU, for this many seconds at most.
pub fn emulate(machine: &str, elf: &Path, seconds: u64) -> Cmd {
    let line = format!(
        "qemu-system-arm -M {machine} -display none -monitor none -serial none -semihosting-config enable=on,target=native -kernel"
    );
    cmd(&line).arg(elf).limit(seconds)
}

/// Builds an example that counts instructions, runs it so that counts repeat, and prints its lines. Returns `true` if it succeeds.
pub fn count(target: &str, machine: &str, example: &str) -> Result<bool> {
    let elf = build(target, example)?;
    let code = emulate(machine, &elf, 600)
        .words("-icount shift=6")
        .print_code()?;
    Ok(code == 0)
}
