//! `flash` and `parts`: a gate with all of its parts, and without some.

use crate::arguments::Arguments;
use crate::board::{self, Level};
use crate::files::{self, Scratch, target_folder};
use crate::jobs::test::ran;
use crate::need;
use crate::report::Report;
use crate::shell::{Result, cmd};
use std::path::{Path, PathBuf};

const ALL_PARTS: &str = "cells,headings,sight,unions";
/// Sets of parts, as a firmware chooses them for its tables.
const PARTS: [(&str, &str); 6] = [
    ("facets alone", ""),
    ("facets that turn", "headings"),
    ("facets and cells", "cells"),
    ("facets in several pieces", "unions"),
    ("facets in several pieces that turn", "headings,unions"),
    ("all parts", ALL_PARTS),
];
/// The functions that a gate in C calls, and those that a gate with a tracker calls in addition.
pub const GATE: [&str; 4] = [
    "posegate_gate_init",
    "posegate_gate_step",
    "posegate_gate_tick",
    "posegate_permission_is_permit",
];
pub const TRACKER: [&str; 4] = [
    "posegate_tracker_init",
    "posegate_tracker_odometry",
    "posegate_tracker_fix",
    "posegate_gate_step_tracked",
];
/// A linker script that places all sections one after the other.
const LAYOUT: &str = "SECTIONS {
    . = 0;
    .flash : { *(.text .text.*) *(.rodata .rodata.* .srodata .srodata.*) *(.data .data.* .sdata .sdata.*) }
    .bss (NOLOAD) : { *(.bss .bss.* .sbss .sbss.* COMMON) }
    /DISCARD/ : { *(.ARM.exidx .ARM.exidx.* .ARM.extab .ARM.extab.* .ARM.attributes .eh_frame .llvmbc .llvmcmd) }
}
";
const TARGETS: [&str; 3] = [
    "thumbv7em-none-eabihf",
    "thumbv6m-none-eabi",
    "riscv32imc-unknown-none-elf",
];
/// A core, a level of optimization, and how many bytes facets alone and all parts may take.
const CEILINGS: [(&str, &str, [u64; 2]); 6] = [
    ("thumbv7em-none-eabihf", "s", [37_000, 67_500]),
    ("thumbv7em-none-eabihf", "3", [54_500, 87_000]),
    ("thumbv6m-none-eabi", "s", [40_000, 73_000]),
    ("thumbv6m-none-eabi", "3", [56_500, 92_500]),
    ("riscv32imc-unknown-none-elf", "s", [48_500, 88_500]),
    ("riscv32imc-unknown-none-elf", "3", [71_500, 114_000]),
];

/// Builds a gate without some of its parts and checks it against the decisions of one that has all.
pub fn parts(_: &Arguments) -> Result {
    for (_, features) in PARTS {
        let test = cmd("cargo test -p posegate --no-default-features --test parts");
        ran(test.arg(format!("--features={features}")), 3)?;
    }
    Ok(())
}

/// Prints the bytes of flash of a complete gate in C, without its table, by part, core and level of optimization. On a Cortex-M4F
/// also prints the bytes of code of the parts of a decision.
pub fn flash(_: &Arguments) -> Result {
    let mut report = Report::default();
    of_gates(&mut report, &PARTS)?;
    of_decisions(&mut report)?;
    report.finish()
}

/// Prints what [`flash`] prints without the parts between the smallest and the largest gate.
pub fn smallest_and_largest(_: &Arguments) -> Result {
    let mut report = Report::default();
    let [smallest, .., largest] = PARTS;
    of_gates(&mut report, &[smallest, largest])?;
    of_decisions(&mut report)?;
    report.finish()
}

fn of_gates(report: &mut Report, parts: &[(&str, &str)]) -> Result {
    need::targets(&TARGETS)?;
    for level in ["s", "3"] {
        for &(name, features) in parts {
            // One core shows what each part takes; for the others the smallest and the largest gate are enough.
            let targets = match (features, level) {
                ("" | ALL_PARTS, _) => &TARGETS[..],
                (_, "s") => &TARGETS[..1],
                _ => continue,
            };
            build_archives(targets, level, features)?;
            for target in targets {
                let archive = archive(target);
                let bytes = of(&archive, &GATE)?;
                let name = format!("flash of a gate in C, {name}, {target}, opt-level {level}");
                match (features, ceilings(target, level)) {
                    ("", [alone, _]) => report.at_most(&name, bytes, "B", alone),
                    (ALL_PARTS, [_, all]) => report.at_most(&name, bytes, "B", all),
                    _ => report.note(&name, bytes, "B"),
                }
                if features.is_empty() {
                    let functions: Vec<&str> = GATE.into_iter().chain(TRACKER).collect();
                    let more = of(&archive, &functions)? - bytes;
                    report.note(&format!("{name}: its tracker"), more, "B");
                }
            }
        }
    }
    Ok(())
}

/// Returns how many bytes facets alone and all parts may take.
fn ceilings(target: &str, level: &str) -> [u64; 2] {
    CEILINGS
        .into_iter()
        .find(|(core, built, _)| (*core, *built) == (target, level))
        .map_or([0, 0], |(_, _, most)| most)
}

/// Other jobs use the archive with all parts at level 3, and must not find another one in its place.
fn archive_folder() -> PathBuf {
    target_folder().join("flash")
}

/// Builds the archives with some parts in one command, so that all processor cores work.
fn build_archives(targets: &[&str], level: &str, features: &str) -> Result {
    let level = match level {
        "3" => "3".to_owned(),
        named => format!("\"{named}\""),
    };
    let mut build = cmd("cargo build -p posegate-c --profile firmware --no-default-features");
    for target in targets {
        build = build.args(["--target", target]);
    }
    build
        .arg("--target-dir")
        .arg(archive_folder())
        .arg(format!("--features={features}"))
        .arg("--config")
        .arg(format!("profile.firmware.opt-level={level}"))
        .run()
}

/// Returns the archive that was built last.
fn archive(target: &str) -> PathBuf {
    archive_folder()
        .join(target)
        .join("firmware/libposegate_c.a")
}

/// Returns the bytes of code, constants and initial values of a program that contains these functions and what they call.
pub fn of(archive: &Path, functions: &[&str]) -> Result<u64> {
    let folder = Scratch::new()?;
    let image = folder.join("gate.bin");
    link(archive, functions, "--oformat=binary", &image)?;
    files::size(&image)
}

/// Links a program that contains these functions and what they call.
pub fn link(archive: &Path, functions: &[&str], format: &str, image: &Path) -> Result {
    let layout = image.with_extension("ld");
    files::write(&layout, LAYOUT)?;
    need::linker()?
        .words("-flavor gnu --gc-sections --entry=posegate_abi_version")
        .words(format)
        .arg("-T")
        .arg(layout)
        .args(
            functions
                .iter()
                .map(|function| format!("--undefined={function}")),
        )
        .arg(archive)
        .arg("-o")
        .arg(image)
        .run()
}

/// Parts of a decision, and the functions, types and modules of `posegate::contain` that are in each.
const DECISION: [(&str, &[&str]); 3] = [
    (
        "the decision on facets",
        &["facets", "decide", "placed", "slab", "touching"],
    ),
    ("several pieces together", &["union"]),
    (
        "the walk of a grid",
        &["grid", "decide_on_cells", "fits", "GoalFramePoseSet"],
    ),
];

fn of_decisions(report: &mut Report) -> Result {
    need::command("arm-none-eabi-nm", "binutils-arm-none-eabi")?;
    let elf = board::build(Level::Fast, "thumbv7em-none-eabihf", "flash")?;
    let symbols = cmd("arm-none-eabi-nm -C -S").arg(elf).read()?;
    for (name, modules) in DECISION {
        let bytes = size(&symbols, |module| modules.contains(&module));
        report.require(bytes > 1_000, format_args!("no symbols of {name}"));
        let line = format!("m4f flash of {name}");
        if modules.contains(&"facets") {
            report.at_most(&line, bytes, "B", 7_500);
        } else {
            report.note(&line, bytes, "B");
        }
    }
    let belongs = |module: &str| {
        DECISION
            .iter()
            .any(|(_, modules)| modules.contains(&module))
    };
    let rest = size(&symbols, |module| !belongs(module));
    report.at_most("m4f flash of functions that are in no part", rest, "B", 0);
    Ok(())
}

/// Returns the bytes of code of those functions, types and modules of `posegate::contain` that count.
fn size(symbols: &str, counts: impl Fn(&str) -> bool) -> u64 {
    symbols
        .lines()
        .filter_map(|line| {
            // Address, size, kind, and a name that may contain spaces.
            let mut words = line.splitn(4, ' ');
            let (_, size, kind) = (words.next()?, words.next()?, words.next()?);
            let (_, path) = words.next()?.split_once("posegate::contain::")?;
            let module = path
                .split(|c: char| !c.is_alphanumeric() && c != '_')
                .next()?;
            let is_code = ["t", "T"].contains(&kind);
            (is_code && counts(module)).then(|| u64::from_str_radix(size, 16).ok())?
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::{DECISION, size};

    #[test]
    fn sizes_are_summed_by_the_names_of_functions() {
        let symbols = "00000400 00000010 T posegate::contain::decide\n00000410 00000020 t posegate::contain::facets::a<b, c>\n\
                       00000430 00000008 t <posegate::contain::grid::Walk as Iterator>::next\n20000000 00000100 B posegate::contain::grid\n\
                       00000440 00000004 t posegate::contain::decide_on_cells\n00000000 a posegate::contain::y\n";
        let sizes = DECISION.map(|(_, modules)| size(symbols, |module| modules.contains(&module)));
        assert_eq!(sizes, [0x30, 0, 12]);
        assert_eq!(size(symbols, |module| module == "many"), 0);
        assert_eq!(size(symbols, |_| true), 0x3c);
    }
}
