//! `fuzz`: the fuzz targets of tests/fuzz.

use crate::arguments::Arguments;
use crate::files::target_folder;
use crate::need;
use crate::report::{Report, print_with};
use crate::shell::{Result, cmd, say};
use std::path::PathBuf;

/// The workspace of the fuzz targets.
const FOLDER: &str = "tests/fuzz";
/// Least number of code edges that a target must reach: with fewer it is not past the checksums. In 10 s from the seeds alone the targets
/// reach 903, 912 and 799. Without a repaired checksum the table target reaches 31; a wire harness that neither decodes nor sends anything
/// reaches 647.
const FLOORS: [(&str, u64); 4] = [
    ("table", 800),
    ("wire", 850),
    ("estimate", 700),
    ("report", 700),
];

/// Returns the folder for what is built of it.
fn built() -> PathBuf {
    target_folder().join("fuzz")
}

/// Checks the code of the fuzz targets, a workspace of its own.
pub fn check() -> Result {
    cmd(&format!(
        "cargo clippy --locked --manifest-path {FOLDER}/Cargo.toml --all-targets --target-dir"
    ))
    .arg(built())
    .words("-- -D warnings")
    .run()
}

/// Runs every fuzz target (or those named) for a number of seconds each. Seeds are real tables, recorded estimates, and earlier finds in
/// tests/fuzz/corpus. Prints a line for each target. Fails on a finding, and if a target reached too few edges.
pub fn fuzz(given: &Arguments) -> Result {
    let seconds = given.required(0, "seconds for each target")?;
    given.number(0, 0)?;
    need::command("c++", "g++")?;
    need::cargo_command("cargo-fuzz")?;
    let built = built();
    let manifest = format!("--manifest-path {FOLDER}/Cargo.toml");
    cmd(&format!("cargo fmt {manifest} --check")).run()?;
    check()?;
    cmd(&format!(
        "cargo run {manifest} --example seeds --target-dir"
    ))
    .arg(&built)
    .arg("--")
    .arg(format!("{FOLDER}/corpus"))
    .run()?;
    let listed = cmd(&format!("cargo fuzz list --fuzz-dir {FOLDER}")).read()?;
    let listed: Vec<&str> = listed.split_whitespace().collect();
    if listed.len() != FLOORS.len() {
        return Err(format!("cargo fuzz lists: {}", listed.join(" ")).into());
    }
    let named: Vec<&str> = given.all().iter().skip(1).map(String::as_str).collect();
    let mut report = Report::default();
    for target in if named.is_empty() { listed } else { named } {
        say(&format!("fuzz {target}"));
        let floor = FLOORS
            .iter()
            .find(|(name, _)| *name == target)
            .map(|(_, floor)| *floor);
        let floor = floor.ok_or_else(|| format!("{target}: no such target"))?;
        // There is no unsafe code for a sanitizer to check. Without a sanitizer the target runs on the stable compiler, which must be
        // allowed to instrument.
        let outcome = cmd(&format!(
            "cargo fuzz run --fuzz-dir {FOLDER} --sanitizer none --target-dir"
        ))
        .arg(&built)
        .arg(target)
        .words(&format!(
            "-- -max_total_time={seconds} -max_len=4096 -timeout=20 -print_final_stats=1"
        ))
        .env("RUSTC_BOOTSTRAP", "1")
        .logged()?;
        let executions = number_after(&outcome.text, "stat::number_of_executed_units:");
        let edges = number_after(&outcome.text, " cov: ");
        let findings = u64::from(outcome.code != 0);
        let members = [
            ("executions", executions),
            ("edges", edges),
            ("edges_goal", floor),
        ];
        print_with(&format!("fuzz {target}"), &members, findings, "findings", 0);
        let mut artifacts = outcome
            .text
            .lines()
            .filter_map(|line| line.split("Test unit written to ").nth(1));
        let artifact = artifacts.next().unwrap_or("no artifact, see the log");
        report.require(findings == 0, format_args!("{target}: {artifact}"));
        report.require(
            edges >= floor,
            format_args!("{target}: {edges} edges of at least {floor}"),
        );
    }
    report.finish()
}

/// Returns the number after the last of these marks, or 0.
fn number_after(log: &str, mark: &str) -> u64 {
    let mut numbers = log.lines().filter_map(|line| {
        line.split(mark)
            .nth(1)?
            .split_whitespace()
            .next()?
            .parse()
            .ok()
    });
    numbers.next_back().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::number_after;

    #[test]
    fn last_number_is_returned() {
        let log = "#2 INITED cov: 31 ft: 32\n#9 NEW    cov: 903 ft: 4 corp: 2\nstat::number_of_executed_units: 12345\n";
        assert_eq!(number_after(log, " cov: "), 903);
        assert_eq!(number_after(log, "stat::number_of_executed_units:"), 12_345);
        assert_eq!(number_after("", " cov: "), 0);
    }
}
