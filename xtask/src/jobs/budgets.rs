//! `budgets`, `flash` and `replay_speed`: the figures of the budgets.

use crate::arguments::Arguments;
use crate::board::{self, CORES};
use crate::files::{Scratch, release};
use crate::jobs::docs::release_program;
use crate::jobs::test::accuracy;
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Result, cmd, program_at};
use std::time::Instant;

/// Prints bytes, seconds, voxels per second, instructions, stack, flash, and the accepted scale over the true one.
pub fn budgets(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::qemu()?;
    let none = Arguments::new(Vec::new(), ".".into(), "budgets", "")?;
    let mut report = Report::default();
    release_program()?;
    let host = cmd("cargo run --release -p posegate-host --example budgets").print_code()?;
    report.require(host == 0, "host");
    let folder = Scratch::new()?;
    let begun = Instant::now();
    program_at(&release("posegate"))
        .words("demo -o")
        .arg(folder.join("demo"))
        .run()?;
    report.less_than("demo", begun.elapsed().as_millis(), "ms", 5_000, 20_000);
    for (target, machine) in CORES {
        for example in ["count_instructions", "count_gate", "count_tracker"] {
            report.require(board::count(target, machine, example)?, target);
        }
    }
    for (name, job) in [
        ("flash", flash as fn(&Arguments) -> Result),
        ("accuracy", accuracy),
    ] {
        if let Err(error) = job(&none) {
            report.require(false, format_args!("{name} ({error})"));
        }
    }
    report.finish()
}

/// Prints the bytes of code of a decision on a Cortex-M4F: on facets, including the reason of a denial, and the walk of a grid.
pub fn flash(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::command("arm-none-eabi-nm", "binutils-arm-none-eabi")?;
    let elf = board::build("thumbv7em-none-eabihf", "flash")?;
    let symbols = cmd("arm-none-eabi-nm -C -S").arg(elf).read()?;
    let (facets, grid) = sizes(&symbols);
    let mut report = Report::default();
    report.at_most("m4f flash of the decision on facets", facets, "B", 4_000);
    report.note("m4f flash of the walk of a grid", grid, "B");
    report.require(facets > 1_000, "no symbols of the decision were found");
    report.finish()
}

/// Returns the bytes of functions that decide on facets, and of the others of containment.
fn sizes(symbols: &str) -> (u64, u64) {
    let (mut facets, mut grid) = (0, 0);
    for line in symbols.lines() {
        // Address, size, kind, and a name that may contain spaces.
        let mut words = line.splitn(4, ' ');
        let (Some(_), Some(size), Some("t" | "T"), Some(name)) =
            (words.next(), words.next(), words.next(), words.next())
        else {
            continue;
        };
        let Ok(size) = u64::from_str_radix(size, 16) else {
            continue;
        };
        if name.starts_with("posegate::contain::facets::")
            || name.starts_with("posegate::contain::decide")
        {
            facets += size;
        } else if name.contains("posegate::contain::") {
            grid += size;
        }
    }
    (facets, grid)
}

/// Prints estimates per second through the gate and megabytes of a bag per second of one core, and checks that memory does not
/// grow with the bag (1 GB against 100 MB, made in a temporary folder).
pub fn replay_speed(_: &Arguments) -> Result {
    cmd("cargo build --release -p posegate-host --example replay_speed").run()?;
    program_at(&release("examples/replay_speed")).print()
}

#[cfg(test)]
mod tests {
    use super::sizes;

    #[test]
    fn sizes_are_summed_by_the_names_of_functions() {
        let symbols = "00000400 00000010 T posegate::contain::decide\n00000410 00000020 t posegate::contain::facets::a<b, c>\n\
                       00000430 00000008 t <posegate::contain::grid::Walk as Iterator>::next\n20000000 00000100 B posegate::contain::X\n\
                       00000000 a posegate::contain::y\n";
        assert_eq!(sizes(symbols), (0x30, 8));
    }
}
