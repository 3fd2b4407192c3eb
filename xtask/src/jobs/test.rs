//! `test`, and the jobs that run one test with larger counts.

mod programs;

use crate::arguments::Arguments;
use crate::files::target_folder;
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Cmd, Result, cmd};
use std::time::{SystemTime, UNIX_EPOCH};

/// Returns `cargo test` with packages and features of the fast suite, so that all jobs use the same build. The tests of
/// `posegate-peers` are separate: their dependencies take longer to build than the rest.
pub fn suite(arguments: &str) -> Cmd {
    cmd("cargo test --workspace --exclude posegate-peers").words(arguments)
}

/// Returns the command that builds programs with the features of the fast suite, so that nothing is built twice. Cargo counts the
/// features of dependencies for tests only if an example or a test is built, so there is always one.
pub fn build_suite(arguments: &str) -> Cmd {
    cmd("cargo build --workspace --exclude posegate-peers --profile test --example may_dock")
        .words(arguments)
}

/// Firmware that tests of the fast suite run in the emulator.
const FIRMWARE: [&str; 6] = [
    "contingent_plan",
    "docking_gate",
    "estimate_bench",
    "fault_target",
    "fault_target_unprotected",
    "interrupt_gate",
];

/// Runs the fast suite. (Examples are built by clippy, and run by the jobs that need them.)
pub fn test(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::qemu()?;
    build_firmware()?;
    programs::run(suite("--lib --bins --tests"))
}

/// Builds the firmware of the tests at once, where they look for it (`posegate_testkit::firmware`). Each test would build its own
/// otherwise, on one processor core.
fn build_firmware() -> Result {
    let mut build = cmd(
        "cargo build --locked -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware",
    );
    for example in FIRMWARE {
        build = build.args(["--example", example]);
    }
    build.words("--target-dir target/firmware").run()
}

/// Runs the tests that are not in the fast suite: the core's tests without the feature `std`, and the examples in the API documents.
/// Checks what only a build of one crate shows: links in the core's API documents, and the features of an example.
pub fn alone(_: &Arguments) -> Result {
    cmd("cargo test -p posegate --lib").run()?;
    // In a folder of their own: those of the workspace have the same names.
    for features in ["", "std,defmt"] {
        cmd("cargo doc --no-deps -p posegate --features")
            .arg(features)
            .env("CARGO_TARGET_DIR", target_folder().join("alone"))
            .env("RUSTDOCFLAGS", "-D warnings")
            .run()?;
    }
    // The pages name it with the features of its crate.
    cmd("cargo check -p posegate-replay --example drive_bag").run()?;
    suite("--doc").run()
}

/// Compares MCAP files and defmt's log with independent programs.
pub fn peers(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::qemu()?;
    build_suite("--bin posegate").run()?;
    cmd("cargo test -p posegate-peers").run()
}

/// Runs the tests with random cases with all of their cases; the fast suite runs a part of them.
pub fn deep(_: &Arguments) -> Result {
    cmd("cargo test --release -p posegate --features posegate/std --lib")
        .words("-p posegate-files -p posegate-learn -p posegate-site -p posegate-replay -p posegate-place -p posegate-plan -p posegate-show")
        .words("--test second_opinion --test success_sets --test planning --test moving_robot --test tracked_robot --test driven_robot")
        .words("--test cheapest_chains --test other_tags --test pose_set_proofs --test stricter_sets --test worst_pose")
        .words("--test table_faults")
        .env("POSEGATE_DEEP", "1")
        .run()?;
    // Those of recordings are run by `recorded`.
    cmd("cargo test --release -p posegate-cli --test learn -- --include-ignored --skip recorded::")
        .env("POSEGATE_DEEP", "1")
        .run()?;
    let tests = [
        "chains",
        "cover",
        "demo",
        "outputs_and_inputs",
        "place",
        "standard_output",
        "tag_tolerance",
        "valid_sites",
    ];
    cmd("cargo test --release -p posegate-cli")
        .words(&tests.map(|name| format!("--test {name}")).join(" "))
        .words("-- --include-ignored")
        .env("POSEGATE_DEEP", "1")
        .run()?;
    cmd("cargo test --release -p posegate-cli --test hostile_files crafted")
        .env("POSEGATE_DEEP", "1")
        .run()?;
    for (count, layout) in [("1000000", "grid"), ("10000000", "facets")] {
        cmd("cargo test --release -p posegate --features std --test adversarial --")
            .args([count, "1", layout])
            .print()?;
    }
    Ok(())
}

/// Measures every row of every error budget with its full counts: the largest error that a search finds, over its bound. A ratio above 1
/// fails, and one below 0.3 without a stated reason.
pub fn error_budgets(_: &Arguments) -> Result {
    // The rows of two tests would share a line of one thread.
    cmd("cargo test --release -p posegate --features std --lib error_budget --")
        .words("--nocapture --test-threads 2")
        .env("POSEGATE_DEEP", "1")
        .json()
        .map(|_| ())
}

/// Compares N random and searched pose-sets with the exact oracle. The seed `today` is another one on each day of the year.
pub fn adversarial(given: &Arguments) -> Result {
    let seed = match given.or(1, "1") {
        "today" => today()?.to_string(),
        seed => seed.to_owned(),
    };
    suite("--test adversarial --")
        .args([given.or(0, "1000000"), &seed, given.or(2, "grid")])
        .print()
}

/// Returns the number of the day in a cycle of 366 days, from 1.
fn today() -> Result<u64> {
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_err(|error| error.to_string())?;
    Ok(now.as_secs() / 86_400 % 366 + 1)
}

/// Measures the accepted scale over the true one on N random pose-sets of reference set A.
pub fn accuracy(given: &Arguments) -> Result {
    suite("--test accuracy --")
        .args([given.or(0, "2000"), given.or(1, "1")])
        .print()
}

/// Checks that every pose of a table is in its success set, for random success sets. Arguments: sets, and samples per set. 1000 1000
/// is the deep job's, of which the fast suite tries a part; 1000 100000 takes hours.
pub fn sets(given: &Arguments) -> Result {
    cmd("cargo test --release -p posegate-site --test success_sets -- --nocapture")
        .env("POSEGATE_SETS", given.or(0, "1000"))
        .env("POSEGATE_SAMPLES", given.or(1, "100000"))
        .json()?;
    Ok(())
}

/// Compares the cosine and sine of each of the 2^32 headings with their digest. Takes minutes.
pub fn headings(_: &Arguments) -> Result {
    ran(
        cmd("cargo test --release -p posegate --lib every_heading -- --ignored"),
        1,
    )?;
    let mut report = Report::default();
    let all = 1_u64 << 32;
    report.at_least(
        "headings whose cosine and sine are as noted",
        all,
        "headings",
        all,
    );
    report.finish()
}

/// Compares with the reference cases of an independent implementation.
pub fn cases(given: &Arguments) -> Result {
    let folder = given.folder(0, "the folder of the reference cases")?;
    suite("--test cases --test oracle_agrees -- --include-ignored --nocapture")
        .env("POSEGATE_CASES", folder)
        .run()
}

/// Compares with the right answers to files as people have them, and runs the tests of these kinds on own inputs.
pub fn field(given: &Arguments) -> Result {
    let folder = given.folder(0, "the folder of the files as people have them")?;
    suite("--test field -- --include-ignored --nocapture")
        .env("POSEGATE_FIELD", folder)
        .run()
}

/// Tries hostile files: single-bit flips of a bag, and mutants of good files of every format, each in a separate process. Fails at
/// an abort, a panic, another exit code than 0 to 3, more than 512 MiB or more than 20 s of processor time. With POSEGATE_RECORDED,
/// the folder of the recordings, the flips are of its bag of Nav2; without, of a synthetic one.
pub fn hostile(given: &Arguments) -> Result {
    cmd("cargo test --release -p posegate-cli --test hostile_files -- --include-ignored --exact --nocapture hostile_files_end_with_a_valid_exit_code")
        .env("POSEGATE_FLIPS", given.or(0, "2000"))
        .env("POSEGATE_MUTANTS", given.or(1, "20000"))
        .env("POSEGATE_SEED", given.or(2, "1"))
        .json()?;
    Ok(())
}

/// Runs tests and returns how many passed.
///
/// # Errors
/// If one fails, or fewer than `least` ran: a filter that matches nothing would pass.
pub fn ran(tests: Cmd, least: u64) -> Result<u64> {
    let outcome = tests.logged()?;
    let count = passed(&outcome.text);
    if outcome.code != 0 {
        return Err(format!("the tests failed with {}: see above", outcome.code).into());
    }
    if count < least {
        return Err(format!("{count} tests ran, of at least {least}").into());
    }
    Ok(count)
}

/// Returns how many tests passed, by the lines that end a run of tests.
pub fn passed(log: &str) -> u64 {
    let counts = log.lines().filter_map(|line| {
        line.strip_prefix("test result: ok. ")?
            .split(' ')
            .next()?
            .parse::<u64>()
            .ok()
    });
    counts.sum()
}

#[cfg(test)]
mod tests {
    use super::passed;

    #[test]
    fn passed_tests_are_summed_over_targets() {
        let log = "running 2 tests\ntest result: ok. 12 passed; 0 failed\n{\"a\"}\ntest result: ok. 3 passed; 0 failed\n";
        assert_eq!(passed(log), 15);
        assert_eq!(passed("test result: FAILED. 12 passed; 1 failed"), 0);
    }
}
