//! `counts`, `budgets` and `replay_speed`: the figures of the budgets.

use crate::arguments::Arguments;
use crate::board::{self, CORES, Level};
use crate::files::{Scratch, release};
use crate::jobs::robot::costs_of_small_code;
use crate::jobs::test::accuracy;
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Result, cmd, program_at};
use std::time::Instant;

/// Firmware examples that count instructions.
const COUNTS: [&str; 3] = ["count_instructions", "count_gate", "count_tracker"];

/// Prints bytes, seconds, voxels per second, instructions, stack, flash, and the accepted scale over the true one.
pub fn budgets(given: &Arguments) -> Result {
    let mut report = Report::default();
    // In one command, so that both have the same features.
    cmd("cargo build --release -p posegate-cli -p posegate-site --bin posegate --example budgets")
        .run()?;
    let host = program_at(&release("examples/budgets")).print_code()?;
    report.require(host == 0, "host");
    let folder = Scratch::new()?;
    let begun = Instant::now();
    program_at(&release("posegate"))
        .words("demo -o")
        .arg(folder.join("demo"))
        .run()?;
    report.less_than("demo", begun.elapsed().as_millis(), "ms", 5_000, 20_000);
    if let Err(error) = counts(given) {
        report.require(false, error);
    }
    report.finish()
}

/// Prints the figures of the budgets that are equal on every machine: instructions, stack, flash, and the accepted scale over the
/// true one.
pub fn counts(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::qemu()?;
    let mut report = Report::default();
    let built = board::build_all(Level::Fast, &CORES.map(|(target, _)| target), &COUNTS)?;
    for (target, machine) in CORES {
        for example in COUNTS {
            report.require(built.count(target, machine, example)?, target);
        }
    }
    // The goals are those of 60 sets a row, which 600 gives.
    let sets = Arguments::new(vec!["600".into()], ".".into(), "accuracy", "[SETS]")?;
    for (name, ended) in [
        ("costs", costs_of_small_code()),
        ("accuracy", accuracy(&sets)),
    ] {
        if let Err(error) = ended {
            report.require(false, format_args!("{name} ({error})"));
        }
    }
    report.finish()
}

/// Prints estimates per second through the gate, and megabytes of a bag per second of one core. Checks that memory does not
/// grow with the bag (1 GB against 100 MB, in a temporary folder).
pub fn replay_speed(_: &Arguments) -> Result {
    cmd("cargo build --release -p posegate-replay --example replay_speed").run()?;
    program_at(&release("examples/replay_speed")).print()
}
