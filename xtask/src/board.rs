//! Firmware examples: builds them, and runs them in QEMU.

use crate::files::target_folder;
use crate::shell::{Cmd, Result, cmd};
use std::path::{Path, PathBuf};

/// The cores that most jobs run firmware on: a target of Rust and a machine of QEMU.
pub const CORES: [(&str, &str); 2] = [
    ("thumbv7em-none-eabihf", "mps2-an386"),
    ("thumbv6m-none-eabi", "mps2-an385"),
];

/// The folder and the level of optimization of a build.
#[derive(Clone, Copy)]
pub enum Level {
    /// 3, in the usual folder.
    Fast,
    /// "s", in a separate folder.
    Small,
}

impl Level {
    fn folder(self) -> PathBuf {
        match self {
            Self::Fast => target_folder(),
            Self::Small => target_folder().join("small"),
        }
    }
}

/// Firmware examples that are built.
pub struct Built(Level);

impl Built {
    /// Returns the ELF file of an example.
    pub fn elf(&self, target: &str, example: &str) -> PathBuf {
        let folder = self.0.folder().join(target);
        folder.join("firmware/examples").join(example)
    }

    /// Runs an example under an emulated clock that makes its counts repeatable, and prints its lines. Returns `true` if it succeeds.
    pub fn count(&self, target: &str, machine: &str, example: &str) -> Result<bool> {
        let code = emulate(machine, &self.elf(target, example), 600)
            .words("-icount shift=6")
            .print_code()?;
        Ok(code == 0)
    }
}

/// Builds firmware examples in one command: the link of a firmware occupies one processor core, and cargo makes several at once.
pub fn build_all(level: Level, targets: &[&str], examples: &[&str]) -> Result<Built> {
    let mut build = cmd("cargo build -p posegate --profile firmware --features firmware");
    for target in targets {
        build = build.args(["--target", target]);
    }
    for example in examples {
        build = build.args(["--example", example]);
    }
    if let Level::Small = level {
        build = build.words("--config profile.firmware.opt-level=\"s\"");
    }
    build.arg("--target-dir").arg(level.folder()).run()?;
    Ok(Built(level))
}

/// Builds a firmware example and returns its ELF file.
pub fn build(level: Level, target: &str, example: &str) -> Result<PathBuf> {
    Ok(build_all(level, &[target], &[example])?.elf(target, example))
}

/// Returns the command that runs a firmware in QEMU, for this many seconds at most.
pub fn emulate(machine: &str, elf: &Path, seconds: u64) -> Cmd {
    let line = format!(
        "qemu-system-arm -M {machine} -display none -monitor none -serial none -semihosting-config enable=on,target=native -kernel"
    );
    cmd(&line).arg(elf).limit(seconds)
}
