//! The flash of functions of an archive; `parts`: a gate without some of its parts.

use crate::arguments::Arguments;
use crate::files::{self, Scratch};
use crate::jobs::test::ran;
use crate::need;
use crate::shell::{Result, cmd};
use std::path::Path;

/// Sets of parts, as a firmware chooses them for its tables.
const PARTS: [&str; 6] = [
    "",
    "headings",
    "cells",
    "unions",
    "headings,unions",
    "cells,headings,sight,unions",
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
/// Builds a gate without some of its parts and checks it against the decisions of one that has all.
pub fn parts(_: &Arguments) -> Result {
    for features in PARTS {
        let test = cmd("cargo test -p posegate --no-default-features --test parts");
        ran(test.arg(format!("--features={features}")), 3)?;
    }
    Ok(())
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
