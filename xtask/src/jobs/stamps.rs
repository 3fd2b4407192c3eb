//! Stamps of deep jobs: the sources with which each last ran. `docs/measured.md` states the stamp next to the figures of the job.

use crate::arguments::Arguments;
use crate::shell::{Result, cmd};
use std::fs::{read_to_string, write};

/// A job and the digest of its sources, one in each line.
const FILE: &str = "docs/stamps.txt";
const PAGE: &str = "docs/measured.md";
/// What decides the figures of deep jobs: firmware and its tests, besides what the firmware depends on.
const SOURCES: [&str; 3] = ["src", "examples", "crates/posegate-boards"];

/// Returns the digest of the committed sources.
fn digest() -> Result<String> {
    let changed = cmd("git status --porcelain --").args(SOURCES).read()?;
    if !changed.is_empty() {
        return Err(
            format!("commit these first, a stamp is of committed sources:\n{changed}").into(),
        );
    }
    let listed = cmd("git ls-tree -r HEAD --").args(SOURCES).read()?;
    // Pages beside the code state the figures, and do not change them.
    let is_code = |line: &&str| !line.ends_with(".md");
    let code: Vec<&str> = listed.lines().filter(is_code).collect();
    let used = cmd("cargo tree --locked -p posegate --features firmware --target thumbv7em-none-eabihf --edges normal,build,dev --prefix none")
        .read()?;
    // Name and version, without the folders of the workspace.
    let used = used
        .lines()
        .map(|line| line.split(' ').take(2).collect::<Vec<_>>().join(" "));
    let used: Vec<String> = used.collect();
    let digest = cmd("git hash-object --stdin")
        .input(format!("{}\n{}", code.join("\n"), used.join("\n")))
        .read()?;
    Ok(digest.chars().take(12).collect())
}

/// Returns the jobs with their stamps.
fn read() -> Result<Vec<(String, String)>> {
    let text = read_to_string(FILE).map_err(|error| format!("{FILE}: {error}"))?;
    let pair = |line: &str| {
        let (job, stamp) = line.split_once(' ').ok_or(format!("{FILE}: {line}"))?;
        Ok((job.to_owned(), stamp.to_owned()))
    };
    text.lines().map(pair).collect()
}

/// Records that a job has run with all of its counts on the present sources. State its figures and the stamp in the page.
pub fn record(job: &str) -> Result {
    let stamp = digest()?;
    let mut all = read().unwrap_or_default();
    all.retain(|(other, _)| other != job);
    all.push((job.to_owned(), stamp.clone()));
    all.sort();
    let lines: String = all
        .iter()
        .map(|(job, stamp)| format!("{job} {stamp}\n"))
        .collect();
    write(FILE, lines)?;
    eprintln!("{FILE}: {job} ran with the sources {stamp}; state this and the figures in {PAGE}");
    Ok(())
}

/// Checks that the page states the stamp of each job.
pub fn are_stated() -> Result {
    let page = read_to_string(PAGE)?;
    for (job, stamp) in read()? {
        if !page.contains(&format!("sources `{stamp}`")) {
            return Err(format!(
                "{PAGE} states other figures than those of `./ci.sh {job}` with the sources `{stamp}`: state that run's figures and stamp"
            )
            .into());
        }
    }
    Ok(())
}

/// Fails if a deep job has not run with the present sources.
pub fn stamps(_: &Arguments) -> Result {
    are_stated()?;
    let now = digest()?;
    let stale: Vec<String> = read()?
        .into_iter()
        .filter(|(_, stamp)| *stamp != now)
        .map(|(job, stamp)| format!("./ci.sh {job} (ran with the sources {stamp}, now {now})"))
        .collect();
    if stale.is_empty() {
        return Ok(());
    }
    Err(format!(
        "run again, and state the figures in {PAGE}:\n{}",
        stale.join("\n")
    )
    .into())
}
