//! `faults`: injects every fault.

use crate::arguments::Arguments;
use crate::jobs::stamps;
use crate::jobs::test::{passed, ran, suite};
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::Result;

/// Injects damaged tables, stale and wrapped stamps, faulty pins, garbage and flipped bits on the wire, also in the emulated
/// controller. Flips single bits of the running firmware's code, registers and memory (N of each kind, with a seed). Counts trials and
/// wrong permits. With fewer than 700 of a kind the controller's line also has its small counts: a quick check, not the stated
/// figures.
pub fn faults(given: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::qemu()?;
    let of_a_kind = given.number(0, 700)?;
    suite("--test table_faults -- --nocapture").json()?;
    let mut count = 0;
    for tests in ["--lib gate::", "--lib wire::", "--test uart_replay refused"] {
        let mut tests = suite(tests);
        if of_a_kind >= 700 {
            tests = tests.env("POSEGATE_DEEP", "1");
        }
        count += ran(tests, 1)?;
    }
    // The controller that runs by interrupts: a million random bytes, ten thousand mutants, a flood, and internal faults.
    let mut controller = suite("--test interrupt_gate --test interrupt_faults -- --nocapture");
    if of_a_kind >= 700 {
        for (name, value) in [
            ("GARBAGE_BYTES", "1000000"),
            ("MUTANTS", "10000"),
            ("FLOOD_SECONDS", "10"),
        ] {
            controller = controller.env(&format!("POSEGATE_{name}"), value);
        }
    }
    count += passed(&controller.json_of_both()?);
    let mut report = Report::default();
    report.at_least(
        "fault tests of stamps, pins, frames and the controller passed",
        count,
        "tests",
        50,
    );
    report.finish()?;
    suite("--test fault_injection --")
        .arg(of_a_kind.to_string())
        .arg(given.or(1, "1"))
        .print()?;
    if of_a_kind < 700 {
        return Ok(());
    }
    stamps::record("faults")
}
