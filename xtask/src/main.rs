//! Every check of Posegate as a named job: `cargo xtask JOB [ARGUMENTS]`. Without a job, all that a change must pass without
//! recordings. Logs go to stderr, results to stdout as JSON lines. Missing tools are installed, or the job fails with the
//! command that installs them.

mod archive;
mod arguments;
mod board;
mod files;
mod jobs;
mod lanes;
mod need;
mod report;
mod shell;
mod stack;

use crate::arguments::Arguments;
use crate::shell::{Result, say};
use std::path::Path;
use std::process::ExitCode;

/// A check that runs alone.
struct Job {
    name: &'static str,
    /// Its arguments, as in a usage line.
    usage: &'static str,
    about: &'static str,
    run: fn(&Arguments) -> Result,
}

const fn job(
    name: &'static str,
    usage: &'static str,
    about: &'static str,
    run: fn(&Arguments) -> Result,
) -> Job {
    Job {
        name,
        usage,
        about,
        run,
    }
}

/// Every job. To add one: a function in `jobs/`, and a line here.
const JOBS: &[Job] = &[
    job(
        "all",
        "",
        "all that a change must pass without recordings (also without a job)",
        all,
    ),
    job(
        "full",
        "",
        "`all`, and the jobs that rarely find what those do not: before a release, and after a change of the core",
        full,
    ),
    job("fmt", "", "formatting", jobs::lint::fmt),
    job(
        "clippy",
        "",
        "lints of every crate, feature and target, with warnings as errors",
        jobs::lint::clippy,
    ),
    job(
        "lines",
        "",
        "lines of code of each room, without comments, blanks and tests, against the ceilings of xtask/lines.txt",
        jobs::lines::lines,
    ),
    job(
        "msrv",
        "",
        "the library and the program on the oldest compiler that Cargo.toml names",
        jobs::msrv::msrv,
    ),
    job("test", "", "the fast suite", jobs::test::test),
    job(
        "quick",
        "",
        "formatting, lints and the fast suite: what to run after a change",
        quick,
    ),
    job(
        "alone",
        "",
        "the core's tests without the feature std; examples in API documents",
        jobs::test::alone,
    ),
    job(
        "peers",
        "",
        "MCAP files and defmt's log, compared with other programs",
        jobs::test::peers,
    ),
    job(
        "docs",
        "",
        "API documents without warnings, and every command of the README and docs/",
        jobs::docs::docs,
    ),
    job(
        "deep",
        "",
        "the full tests of which the fast suite runs a part",
        jobs::test::deep,
    ),
    job(
        "error_budgets",
        "",
        "every row of every error budget: the largest error that a search finds, over its bound",
        jobs::test::error_budgets,
    ),
    job(
        "stamps",
        "",
        "the deep jobs whose figures docs/measured.md states have run with the present sources",
        jobs::stamps::stamps,
    ),
    job(
        "no_panic",
        "",
        "no panic can be reached in the firmware",
        jobs::no_panic::no_panic,
    ),
    job(
        "vectors",
        "",
        "the decisions of the vector file on five emulated cores",
        jobs::vectors::vectors,
    ),
    job(
        "adversarial",
        "[N [SEED [LAYOUT]]]",
        "random and searched pose-sets against the exact oracle",
        jobs::test::adversarial,
    ),
    job(
        "accuracy",
        "[N [SEED]]",
        "accepted scale over true scale, on random pose-sets",
        jobs::test::accuracy,
    ),
    job(
        "sets",
        "[SETS [SAMPLES]]",
        "random success sets: a table holds only poses of its set",
        jobs::test::sets,
    ),
    job(
        "headings",
        "",
        "cosine and sine of all 2^32 headings",
        jobs::test::headings,
    ),
    job(
        "cases",
        "DIR",
        "the reference cases of an independent implementation",
        jobs::test::cases,
    ),
    job(
        "field",
        "DIR",
        "files as people have them, and the right answers to each",
        jobs::test::field,
    ),
    job(
        "recorded",
        "DIR",
        "recordings: replayed, learnt from, and compared with usual rules",
        jobs::recorded::recorded,
    ),
    job(
        "faults",
        "[N [SEED]]",
        "every fault injected: tried, and wrongly permitted",
        jobs::faults::faults,
    ),
    job(
        "hostile",
        "[FLIPS [MUTANTS [SEED]]]",
        "the program on damaged files",
        jobs::test::hostile,
    ),
    job(
        "fuzz",
        "SECONDS [TARGET..]",
        "every fuzz target, or those named",
        jobs::fuzz::fuzz,
    ),
    job(
        "miri",
        "",
        "tests under an interpreter: no undefined behaviour, on three machines",
        jobs::miri::miri,
    ),
    job(
        "mutants",
        "[MODULE..]",
        "mutants of the core that no test finds",
        jobs::mutants::mutants,
    ),
    job(
        "gate_mutants",
        "[PART|--texts]",
        "checks of the gate removed one at a time: each must fail a fast test",
        jobs::mutants::gate_mutants,
    ),
    job(
        "steady",
        "[RUNS]",
        "tests that wait or read a clock, repeated idle and under load",
        jobs::steady::steady,
    ),
    job(
        "c",
        "",
        "the C boundary: header, archive, and C firmware by Make and by CMake",
        jobs::c::c,
    ),
    job(
        "costs",
        "",
        "flash, stack and instructions of a gate in C on three cores, against the figures that `posegate table cost` has",
        jobs::robot::costs,
    ),
    job(
        "robot",
        "",
        "a whole program in C with the archive as released: flash, stack, instructions of each call, on three cores",
        jobs::robot::robot,
    ),
    job(
        "wasm",
        "",
        "the core as WebAssembly: its size, and that it imports nothing",
        jobs::wasm::wasm,
    ),
    job(
        "wasm_bytes",
        "",
        "the committed core.wasm is what the pinned compiler makes of the source",
        jobs::wasm::wasm_bytes,
    ),
    job(
        "browser",
        "[FOLDER]",
        "the page of `posegate report` in chromium; screenshots into FOLDER",
        jobs::browser::browser,
    ),
    job(
        "mcap",
        "",
        "what `replay --mcap` writes, read by the Python package mcap",
        jobs::mcap::mcap,
    ),
    job(
        "python",
        "[SETS]",
        "the Python wheel in a fresh environment: equal to the program, speed, memory, types, docs/for-python.md",
        jobs::python::python,
    ),
    job(
        "ros2",
        "[RUNS]",
        "the ROS 2 node with rclpy and Fast DDS from wheels: permits, their end, damaged payloads, a controller on a serial line",
        jobs::ros2::ros2,
    ),
    job(
        "nav2",
        "DIR",
        "a recording of Nav2 played to the ROS 2 node in real time and faster: verdicts equal to `replay`",
        jobs::ros2::nav2,
    ),
    job(
        "behaviortree",
        "",
        "the condition PosePermitted, compiled and run with BehaviorTree.CPP",
        jobs::ros2::behaviortree,
    ),
    job(
        "budgets",
        "",
        "every figure of the budgets: bytes, time, instructions, stack, flash",
        jobs::budgets::budgets,
    ),
    job(
        "counts",
        "",
        "the figures of the budgets that are equal on every machine: instructions, stack, flash, accuracy",
        jobs::budgets::counts,
    ),
    job(
        "parts",
        "",
        "a gate without some of its parts denies more and never less",
        jobs::flash::parts,
    ),
    job(
        "replay_speed",
        "",
        "how fast recordings are read, and in how much memory",
        jobs::budgets::replay_speed,
    ),
    job(
        "paving",
        "[SMALLEST]",
        "how much of a set is proven and how fast, compared with codac",
        jobs::compare::paving,
    ),
    job(
        "lenses",
        "",
        "lens models and windows, compared with OpenCV",
        jobs::compare::lenses,
    ),
    job(
        "placement",
        "[RUNS [ITERATIONS]]",
        "placement of a tag, compared with SciPy",
        jobs::compare::placement,
    ),
    job(
        "planning",
        "[PLOT]",
        "chains and plans: correctness, cost, emulation",
        jobs::planning::planning,
    ),
    job(
        "cover",
        "",
        "the fewest tags for a warehouse, to a proven gap",
        jobs::planning::cover,
    ),
    job(
        "package",
        "[FOLDER]",
        "the crates as a user gets them: contents, installation, firmware",
        jobs::package::package,
    ),
    job(
        "packages",
        "",
        "the release for C as CMake, pkg-config, Zephyr, PlatformIO, Arduino and CMSIS-Pack read it; a gate by the first two",
        jobs::packages::packages,
    ),
    job(
        "dist",
        "[FOLDER [BUILDS]]",
        "the files of a release: built twice with equal bytes, installed into empty roots, and run there",
        jobs::dist::dist,
    ),
    job(
        "slurm",
        "[ENDPOINTS]",
        "a site on four nodes of Slurm, one of which is killed",
        jobs::slurm::slurm,
    ),
    job(
        "scale",
        "[PLOT..]",
        "what a site takes as it grows to 100,000 endpoints",
        jobs::planning::scale,
    ),
    job(
        "figures",
        "DIR",
        "every picture, and that those of docs/ are current",
        jobs::figures::figures,
    ),
];

/// What a change must pass without recordings: jobs with their arguments, those of this machine in this order, and beside them those of
/// firmware. (The fast suite has a small share of `faults`.)
const ON_THIS_MACHINE: &[&str] = &["quick", "docs"];
const OF_FIRMWARE: &[&str] = &["lines", "gate_mutants --texts", "no_panic", "c"];
/// The jobs that `full` adds.
const MORE_ON_THIS_MACHINE: &[&str] = &[
    "clippy",
    "alone",
    "peers",
    "adversarial 250000 today grid",
    "adversarial 250000 today facets",
];
const MORE_OF_FIRMWARE: &[&str] = &["vectors", "wasm", "parts", "counts"];

fn main() -> ExitCode {
    let mut given = std::env::args().skip(1);
    let name = given.next().unwrap_or_else(|| "all".into());
    if ["--list", "--help", "-h", "help"].contains(&name.as_str()) {
        for job in JOBS {
            let call = format!("{} {}", job.name, job.usage);
            println!("{call:<34} {}", job.about);
        }
        return ExitCode::SUCCESS;
    }
    let Some(job) = find(&name) else {
        let names: Vec<&str> = JOBS.iter().map(|job| job.name).collect();
        eprintln!("no job {name}; jobs: {}", names.join(" "));
        return ExitCode::from(2);
    };
    match start(job, given.collect()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("cargo xtask {name}: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs a job in the folder of the repository.
fn start(job: &Job, given: Vec<String>) -> Result {
    let folder = std::env::current_dir()?;
    let arguments = Arguments::new(given, folder, job.name, job.usage)?;
    std::env::set_current_dir(files::root())?;
    (job.run)(&arguments)
}

fn find(name: &str) -> Option<&'static Job> {
    JOBS.iter().find(|job| job.name == name)
}

fn quick(given: &Arguments) -> Result {
    run_line("fmt")?;
    say("clippy, of the fast suite's packages");
    jobs::lint::quick(given)?;
    say("the fast suite");
    run_line("test")
}

fn all(_: &Arguments) -> Result {
    lanes::run(ON_THIS_MACHINE, OF_FIRMWARE, run_line)
}

fn full(given: &Arguments) -> Result {
    all(given)?;
    lanes::run(MORE_ON_THIS_MACHINE, MORE_OF_FIRMWARE, run_line)
}

/// Runs a job with its arguments, all in one line.
fn run_line(line: &str) -> Result {
    let mut words = line.split(' ').map(str::to_owned);
    let name = words.next().unwrap_or_default();
    let job = find(&name).ok_or_else(|| format!("no job {name}"))?;
    let arguments = Arguments::new(words.collect(), Path::new(".").into(), job.name, job.usage)?;
    (job.run)(&arguments)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn jobs_have_distinct_names_and_descriptions() {
        let names: BTreeSet<&str> = JOBS.iter().map(|job| job.name).collect();
        let descriptions: BTreeSet<&str> = JOBS.iter().map(|job| job.about).collect();
        assert_eq!((names.len(), descriptions.len()), (JOBS.len(), JOBS.len()));
    }

    #[test]
    fn all_names_jobs_with_valid_arguments() {
        let more = MORE_ON_THIS_MACHINE.iter().chain(MORE_OF_FIRMWARE);
        for line in ON_THIS_MACHINE.iter().chain(OF_FIRMWARE).chain(more) {
            let mut words = line.split(' ').map(str::to_owned);
            let job = find(&words.next().unwrap()).expect(line);
            assert!(!["all", "full"].contains(&job.name));
            assert!(
                Arguments::new(words.collect(), ".".into(), job.name, job.usage).is_ok(),
                "{line}"
            );
        }
    }
}
