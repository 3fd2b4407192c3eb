//! The archive for C as it is released: one object, of which only the functions of the header are global, so that a firmware keeps its own
//! C library and its own mathematics.

use crate::files;
use crate::need;
use crate::shell::{Cmd, Result, cmd};
use std::path::{Path, PathBuf};

/// A core for which there is an archive.
pub struct Core {
    /// Rust's target, the folder of the archive.
    pub target: &'static str,
    /// As a user names it.
    pub name: &'static str,
    /// The prefix of the tools of C, and the package that has them.
    pub tools: (&'static str, &'static str),
    /// What the compiler of C must be given to agree with the target.
    pub flags: &'static str,
}

const ARM: (&str, &str) = ("arm-none-eabi", "gcc-arm-none-eabi");

pub const CORES: [Core; 6] = [
    Core {
        target: "thumbv6m-none-eabi",
        name: "cortex-m0plus",
        tools: ARM,
        flags: "-mcpu=cortex-m0plus -mthumb -mfloat-abi=soft",
    },
    Core {
        target: "thumbv7m-none-eabi",
        name: "cortex-m3",
        tools: ARM,
        flags: "-mcpu=cortex-m3 -mthumb -mfloat-abi=soft",
    },
    Core {
        target: "thumbv7em-none-eabi",
        name: "cortex-m4",
        tools: ARM,
        flags: "-mcpu=cortex-m4 -mthumb -mfloat-abi=soft",
    },
    Core {
        target: "thumbv7em-none-eabihf",
        name: "cortex-m4f",
        tools: ARM,
        flags: "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard",
    },
    Core {
        target: "thumbv8m.main-none-eabihf",
        name: "cortex-m33",
        tools: ARM,
        flags: "-mcpu=cortex-m33 -mthumb -mfpu=fpv5-sp-d16 -mfloat-abi=hard",
    },
    Core {
        target: "riscv32imc-unknown-none-elf",
        name: "rv32imc",
        tools: ("riscv64-unknown-elf", "gcc-riscv64-unknown-elf"),
        flags: "-march=rv32imc -mabi=ilp32 -msmall-data-limit=0 --specs=picolibc.specs",
    },
];

/// The targets of the cores.
pub const TARGETS: [&str; CORES.len()] = {
    let mut targets = [""; CORES.len()];
    let mut at = 0;
    while at < CORES.len() {
        targets[at] = CORES[at].target;
        at += 1;
    }
    targets
};

/// The sets of parts for which there is an archive: a name, and the features.
pub const PARTS: [(&str, &str); 3] = [
    ("boxes", ""),
    ("turning", "headings,unions"),
    ("all", "cells,headings,sight,unions"),
];

/// The levels of optimization for which there is an archive.
pub const LEVELS: [&str; 2] = ["3", "s"];
/// The set of parts and the level of the archive that a user takes who does not choose.
pub const USUAL: &str = "all-3";
pub const FILE: &str = "libposegate_c.a";

impl Core {
    /// Returns the core that a user names.
    pub fn named(name: &str) -> Result<&'static Self> {
        CORES
            .iter()
            .find(|core| core.name == name)
            .ok_or_else(|| format!("no core {name}").into())
    }

    /// Returns the command of a tool of C, which is installed if it is missing.
    pub fn tool(&self, name: &str) -> Result<Cmd> {
        let (prefix, package) = self.tools;
        let command = format!("{prefix}-{name}");
        need::command(&command, package)?;
        Ok(cmd(&command))
    }

    /// Returns the bytes of code, constants and initial values of a program.
    pub fn flash(&self, elf: &Path) -> Result<u64> {
        let sizes = self.tool("size")?.arg(elf).read()?;
        let line = sizes.lines().nth(1).unwrap_or_default();
        let mut numbers = line.split_whitespace().map(str::parse::<u64>);
        match (numbers.next(), numbers.next()) {
            (Some(Ok(text)), Some(Ok(data))) => Ok(text + data),
            _ => Err(format!("no sizes in: {sizes}").into()),
        }
    }
}

/// Returns the words after `cargo` that build the library of a core with some features at a level of optimization. A library that is
/// built as an archive alone is optimized as one program.
pub fn words(core: &Core, features: &str, level: &str) -> Vec<String> {
    let level = match level {
        "3" => "3".to_owned(),
        named => format!("\"{named}\""),
    };
    let mut all: Vec<String> =
        "rustc -p posegate-c --lib --profile firmware --crate-type staticlib --no-default-features"
            .split_whitespace()
            .map(Into::into)
            .collect();
    all.extend([
        format!("--target={}", core.target),
        format!("--features={features}"),
        format!("--config=profile.firmware.opt-level={level}"),
    ]);
    all
}

/// Returns what cargo builds below a target folder.
pub fn built(core: &Core, target_folder: &Path) -> PathBuf {
    target_folder.join(core.target).join("firmware").join(FILE)
}

/// Makes one object of an archive of cargo, without debug information, in which only the functions of the header are global. It needs
/// no other library.
pub fn localize(core: &Core, from: &Path, to: &Path) -> Result {
    let symbols = core
        .tool("nm")?
        .words("-g --defined-only")
        .arg(from)
        .read()?;
    let own = symbols
        .lines()
        .filter_map(|line| line.rsplit_once(" T "))
        .map(|(_, name)| name)
        .filter(|name| name.starts_with("posegate_"));
    let one = to.with_extension("one.o");
    let alone = to.with_extension("o");
    files::make_folder(to.parent().ok_or("an archive has a folder")?)?;
    need::linker()?
        .words("-flavor gnu -r --gc-sections")
        .args(own.map(|name| format!("--undefined={name}")))
        .arg(from)
        .arg("-o")
        .arg(&one)
        .run()?;
    core.tool("objcopy")?
        .words("-D --strip-debug --wildcard --keep-global-symbol=posegate_*")
        .words("--remove-section=.llvmbc --remove-section=.llvmcmd --remove-section=.ARM.exidx* --remove-section=.rel.ARM.exidx*")
        .args([&one, &alone])
        .run()?;
    let undefined = core.tool("nm")?.arg("-u").arg(&alone).read()?;
    if !undefined.trim().is_empty() {
        return Err(format!("the archive for {} needs {undefined}", core.name).into());
    }
    files::remove(to)?;
    core.tool("ar")?.words("rcsD").args([to, &alone]).run()?;
    for part in [&one, &alone] {
        files::remove(part)?;
    }
    Ok(())
}

/// Builds the released archive of a core with some features at a level of optimization, below a target folder of its own.
pub fn build(core: &Core, features: &str, level: &str) -> Result<PathBuf> {
    need::targets(&[core.target])?;
    let folder = files::target_folder().join("archives");
    cmd("cargo")
        .args(words(core, features, level))
        .arg("--target-dir")
        .arg(&folder)
        .run()?;
    let parts = if features.is_empty() {
        "boxes"
    } else {
        features
    };
    let name = format!("{}-{parts}-{level}.a", core.target);
    let to = folder.join("localized").join(name);
    localize(core, &built(core, &folder), &to)?;
    Ok(to)
}
