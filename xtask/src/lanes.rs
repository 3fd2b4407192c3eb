//! Runs two lists of jobs side by side: the builds and emulations of firmware occupy one processor core for most of their time.

use crate::files::Scratch;
use crate::shell::{Result, program_at, say, show};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Runs `here` in this process, and each job of `beside` in a process of its own, whose output is printed when it has ended, so that no lines
/// are mixed. After a failure no further job begins.
///
/// # Errors
/// The first failure of each list.
pub fn run(here: &[&str], beside: &[&str], run_job: impl Fn(&str) -> Result) -> Result {
    let has_failed = AtomicBool::new(false);
    // A copy: a build of the workspace may replace this program while it runs.
    let folder = Scratch::new()?;
    let program = folder.join("xtask");
    std::fs::copy(std::env::current_exe()?, &program)?;
    let (here, beside) = std::thread::scope(|scope| {
        // Errors of jobs cannot be sent from one thread to another, their texts can.
        let beside = scope.spawn(|| {
            each(beside, &has_failed, |line| {
                run_apart(&program, line).map_err(|error| error.to_string())
            })
        });
        let here = each(here, &has_failed, |line| {
            say(line);
            run_job(line).map_err(|error| error.to_string())
        });
        (here, beside.join().expect("no job panics"))
    });
    match (here, beside) {
        (Ok(()), Ok(())) => Ok(()),
        (Err(error), Ok(())) | (Ok(()), Err(error)) => Err(error.into()),
        (Err(here), Err(beside)) => Err(format!("{here}\nand beside it {beside}").into()),
    }
}

/// Runs jobs one after the other, until one of any list has failed.
fn each(
    lines: &[&str],
    has_failed: &AtomicBool,
    run_job: impl Fn(&str) -> std::result::Result<(), String>,
) -> std::result::Result<(), String> {
    for line in lines {
        if has_failed.load(Ordering::Relaxed) {
            break;
        }
        let begun = Instant::now();
        if let Err(error) = run_job(line) {
            has_failed.store(true, Ordering::Relaxed);
            return Err(format!("{line}: {error}"));
        }
        say(&format!("{line} took {} s", begun.elapsed().as_secs()));
    }
    Ok(())
}

/// Runs a job in a process of its own.
fn run_apart(program: &Path, line: &str) -> Result {
    let outcome = program_at(program).words(line).unlogged().quiet()?;
    show(&format!("\n== {line}\n{}", outcome.text));
    match outcome.code {
        0 => Ok(()),
        code => Err(format!("failed with {code}").into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_ends_both_lists_and_is_named() {
        let has_failed = AtomicBool::new(false);
        let job = |line: &str| match line {
            "bad" => Err("is broken".to_owned()),
            _ => Ok(()),
        };
        assert_eq!(each(&["good", "good"], &has_failed, job), Ok(()));
        assert_eq!(
            each(&["good", "bad", "good"], &has_failed, job),
            Err("bad: is broken".to_owned())
        );
        // The other list ends before its next job.
        assert_eq!(each(&["bad"], &has_failed, job), Ok(()));
    }
}
