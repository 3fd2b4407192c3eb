//! `planning`, `cover` and `scale`: plans, choices of tags, and large sites.

use crate::arguments::Arguments;
use crate::board::{self, CORES, Level};
use crate::files::release;
use crate::jobs::test::ran;
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Result, cmd, program_at};

/// Runs plans a million times by an independent judge. Measures plans on sites of 10 to 1,000 tags, with a plot if a file for it is
/// named. Counts instructions of a chain on both cores, and runs a plan under emulation.
pub fn planning(given: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::qemu()?;
    cmd("cargo test --release -p posegate-plan --test planning -- --nocapture").json_of_both()?;
    let mut report = Report::default();
    let host = cmd("cargo run --release -p posegate-show --example planning --")
        .args(given.path(0))
        .print_code()?;
    report.require(host == 0, "host");
    ran(cmd("cargo test -p posegate-plan --test contingent_plan"), 1)?;
    let built = board::build_all(
        Level::Fast,
        &CORES.map(|(target, _)| target),
        &["count_chain"],
    )?;
    for (target, machine) in CORES {
        report.require(built.count(target, machine, "count_chain")?, target);
    }
    report.finish()
}

/// Chooses the fewest tags for a warehouse of 100 docks and 2,000 candidates, to a proven gap. Plans are made again on the written site,
/// and executed by the judge of the planning job. Small sites are compared with all subsets by `test`.
pub fn cover(_: &Arguments) -> Result {
    cmd("cargo run --release -p posegate-show --example cover").print()
}

/// Measures the tables and proofs of sites from 10 to 100,000 endpoints and for several nodes, with plots if files for them are named. The
/// model for what is not measured is in crates/posegate-show/examples/scale.rs.
pub fn scale(given: &Arguments) -> Result {
    cmd("cargo build --release -p posegate-cli -p posegate-show --bin posegate --example scale")
        .run()?;
    let plots = (0..given.all().len()).filter_map(|index| given.path(index));
    program_at(&release("examples/scale"))
        .arg(release("posegate"))
        .args(plots)
        .print()
}
