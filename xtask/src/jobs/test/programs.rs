//! Runs the programs of a test suite side by side. `cargo test` runs one after the other, and many have one test that takes longer
//! than all of their others.

use crate::shell::{Cmd, Outcome, Result, program_at, say};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Programs that take longest. They begin first, so that no core waits for one at the end.
const SLOW: [&str; 7] = [
    "posegate-replay test worst_pose",
    "posegate-cli test learn",
    "posegate-cli test valid_sites",
    "posegate-replay test other_tags",
    "posegate-boards test fault_injection",
    "posegate-cli test site_build",
    "posegate-place lib posegate_place",
];

/// A test program that is built.
#[derive(Debug, PartialEq, Eq)]
struct Program {
    /// Its package, its kind of target, and its name: `posegate-cli test learn`.
    name: String,
    /// The folder of its package, in which it runs.
    folder: PathBuf,
    executable: PathBuf,
}

/// Builds the programs of a suite, and runs them.
///
/// # Errors
/// If one fails. The others still run, so that all failures are known.
pub fn run(suite: Cmd) -> Result {
    let built = suite
        .words("--no-run --message-format json-render-diagnostics")
        .read()?;
    let programs = programs(&built)?;
    for slow in SLOW {
        if !programs.iter().any(|program| program.name == slow) {
            return Err(format!("no test program is `{slow}`: correct the list SLOW").into());
        }
    }
    let failed = run_all(&programs)?;
    match failed.as_slice() {
        [] => Ok(()),
        _ => Err(format!(
            "{} of {} test programs failed: {}",
            failed.len(),
            programs.len(),
            failed.join(", ")
        )
        .into()),
    }
}

/// Returns the test programs that cargo's messages name.
fn programs(messages: &str) -> Result<Vec<Program>> {
    let mut found = Vec::new();
    for line in messages.lines() {
        let message: Value = serde_json::from_str(line)?;
        let text = |value: &Value| value.as_str().map(str::to_owned);
        let is_test = message["profile"]["test"] == true;
        let executable = text(&message["executable"]).filter(|_| is_test);
        let Some(executable) = executable else {
            continue;
        };
        let manifest = text(&message["manifest_path"]).ok_or("an artifact without a manifest")?;
        let folder = Path::new(&manifest).parent().unwrap_or(Path::new("/"));
        let package = message["package_id"].as_str().unwrap_or_default();
        let kind = message["target"]["kind"][0].as_str().unwrap_or_default();
        let name = message["target"]["name"].as_str().unwrap_or_default();
        found.push(Program {
            name: format!("{} {kind} {name}", package_name(package)),
            folder: folder.to_owned(),
            executable: executable.into(),
        });
    }
    if found.is_empty() {
        return Err("cargo built no test program".into());
    }
    let rank = |name: &str| SLOW.iter().position(|slow| *slow == name);
    found.sort_by_cached_key(|program| {
        let rank = rank(&program.name).unwrap_or(SLOW.len());
        (rank, program.name.clone())
    });
    Ok(found)
}

/// Returns the name in a package's id: `path+file:///folder/NAME#0.1.0`, or `...#NAME@0.1.0` if the folder has another name.
fn package_name(id: &str) -> &str {
    let (folder, rest) = id.split_once('#').unwrap_or((id, ""));
    match rest.split_once('@') {
        Some((name, _)) => name,
        None => folder.rsplit('/').next().unwrap_or(folder),
    }
}

/// Runs as many programs at once as there are processor cores, and prints the output of each when it has ended. Returns the names of
/// those that failed, in the order of the programs.
fn run_all(programs: &[Program]) -> Result<Vec<String>> {
    let cores = std::thread::available_parallelism()?.get();
    let next = AtomicUsize::new(0);
    let failed = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..cores.min(programs.len()) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(program) = programs.get(index) else {
                        break;
                    };
                    if !run_one(program) {
                        failed
                            .lock()
                            .expect("no thread panics")
                            .push((index, program.name.clone()));
                    }
                }
            });
        }
    });
    let mut failed = failed.into_inner()?;
    failed.sort_unstable();
    Ok(failed.into_iter().map(|(_, name)| name).collect())
}

/// Runs a program and prints its output; returns whether it succeeded.
fn run_one(program: &Program) -> bool {
    let begun = Instant::now();
    let outcome = program_at(&program.executable)
        .dir(&program.folder)
        .unlogged()
        .quiet();
    let outcome = outcome.unwrap_or_else(|error| Outcome {
        code: 1,
        text: error.to_string(),
    });
    let seconds = begun.elapsed().as_secs();
    // In one call, so that lines of programs are not mixed.
    say(&format!(
        "{}: {} after {seconds} s\n{}",
        program.name,
        match outcome.code {
            0 => "passed".to_owned(),
            code => format!("FAILED with {code}"),
        },
        outcome.text.trim_end()
    ));
    outcome.code == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    const MESSAGES: &str = r##"{"reason":"compiler-artifact","package_id":"registry+x#syn@3.0.0","manifest_path":"/r/syn/Cargo.toml","target":{"kind":["lib"],"name":"syn"},"profile":{"test":false},"executable":null}
{"reason":"compiler-artifact","package_id":"path+file:///w/crates/posegate-cli#0.1.0","manifest_path":"/w/crates/posegate-cli/Cargo.toml","target":{"kind":["bin"],"name":"posegate"},"profile":{"test":false},"executable":"/t/posegate"}
{"reason":"compiler-artifact","package_id":"path+file:///w/crates/posegate-cli#0.1.0","manifest_path":"/w/crates/posegate-cli/Cargo.toml","target":{"kind":["test"],"name":"learn"},"profile":{"test":true},"executable":"/t/deps/learn-1"}
{"reason":"compiler-artifact","package_id":"path+file:///w#posegate@0.1.0","manifest_path":"/w/Cargo.toml","target":{"kind":["lib"],"name":"posegate"},"profile":{"test":true},"executable":"/t/deps/posegate-2"}
{"reason":"build-finished","success":true}"##;

    #[test]
    fn programs_are_those_with_tests() {
        let found = programs(MESSAGES).unwrap();
        let names: Vec<&str> = found.iter().map(|program| &*program.name).collect();
        assert_eq!(names, ["posegate-cli test learn", "posegate lib posegate"]);
        assert_eq!(found[0].folder, Path::new("/w/crates/posegate-cli"));
        assert_eq!(found[0].executable, Path::new("/t/deps/learn-1"));
        assert!(programs("{\"reason\":\"build-finished\"}").is_err());
        assert!(programs("no json").is_err());
    }

    #[test]
    fn all_programs_run_and_failures_are_named() {
        let program = |name: &str, executable: &str| Program {
            name: name.into(),
            folder: "/".into(),
            executable: executable.into(),
        };
        let all = [
            program("a", "/bin/false"),
            program("b", "/bin/true"),
            program("c", "/no/such/program"),
            program("d", "/bin/true"),
            program("e", "/bin/false"),
        ];
        assert_eq!(run_all(&all).unwrap(), ["a", "c", "e"]);
        assert!(run_all(&all[1..2]).unwrap().is_empty());
    }
}
