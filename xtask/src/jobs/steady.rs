//! `steady`: repeats the tests that start an emulator, that wait, or that read a clock.

use crate::arguments::Arguments;
use crate::files;
use crate::jobs::test::suite;
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Result, cmd, program_at, say};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// One line per test target: its package, its name and, if not all of its tests wait, a part of the names of those that
/// do. `xtask/tests/steady.rs` compares the list with the sources.
const LIST: &str = include_str!("../../steady.txt");

/// Runs each target RUNS times (20) on an idle machine, which the caller must provide, and RUNS times with two busy processors. No
/// run may fail. Ends at the first failure, with its log.
pub fn steady(given: &Arguments) -> Result {
    let runs = given.number(0, 20)?;
    need::targets(&THUMBS)?;
    need::qemu()?;
    let entries = entries(LIST);
    let programs = build(&entries)?;
    repeat(&entries, &programs, runs, "on an idle machine")?;
    let _busy = Busy::start(2);
    repeat(&entries, &programs, runs, "with two busy processes")
}

/// A line of the list.
struct Entry<'a> {
    package: &'a str,
    target: &'a str,
    pattern: Option<&'a str>,
}

fn entries(list: &str) -> Vec<Entry<'_>> {
    let lines = list
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines
        .map(|line| {
            let (name, pattern) = line
                .split_once(' ')
                .map_or((line, None), |(name, pattern)| (name, Some(pattern)));
            let (package, target) = name
                .split_once(':')
                .expect("steady.txt has lines PACKAGE:TARGET [PATTERN]");
            Entry {
                package,
                target,
                pattern,
            }
        })
        .collect()
}

/// A test program, and the folder of its package, which it runs in.
type Program = (PathBuf, PathBuf);

/// Builds the targets, and returns the program of each.
fn build<'a>(entries: &[Entry<'a>]) -> Result<BTreeMap<(&'a str, &'a str), Program>> {
    let mut programs = BTreeMap::new();
    // posegate-peers is not in the fast suite: it has features that the program must not have.
    for is_peers in [false, true] {
        let built = entries
            .iter()
            .filter(|entry| (entry.package == "posegate-peers") == is_peers);
        let built: Vec<&Entry> = built.collect();
        let arguments = "--no-run --message-format=json";
        let mut command = if is_peers {
            cmd("cargo test -p posegate-peers").words(arguments)
        } else {
            suite(arguments)
        };
        for entry in &built {
            command = command.arg("--test").arg(entry.target);
        }
        let messages = command.read()?;
        for message in messages
            .lines()
            .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        {
            let (Some(executable), Some(manifest)) = (
                message["executable"].as_str(),
                message["manifest_path"].as_str(),
            ) else {
                continue;
            };
            let target = &message["target"];
            let folder = Path::new(manifest).parent().unwrap_or(Path::new("."));
            // A package has the name of its folder; only tests of other crates than the root's are listed.
            let package = files::name(folder);
            let is_entry =
                |entry: &&&Entry| target["name"] == entry.target && package == entry.package;
            if target["kind"][0] == "test"
                && let Some(entry) = built.iter().find(is_entry)
            {
                let program: Program = (executable.into(), folder.into());
                programs.insert((entry.package, entry.target), program);
            }
        }
    }
    for entry in entries {
        if !programs.contains_key(&(entry.package, entry.target)) {
            return Err(
                format!("cargo has built no test {}:{}", entry.package, entry.target).into(),
            );
        }
    }
    Ok(programs)
}

fn repeat(
    entries: &[Entry],
    programs: &BTreeMap<(&str, &str), Program>,
    runs: u64,
    load: &str,
) -> Result {
    for Entry {
        package,
        target,
        pattern,
    } in entries
    {
        let (program, folder) = &programs[&(*package, *target)];
        say(&format!(
            "{package}:{target} {}, {runs} times {load}",
            pattern.unwrap_or_default()
        ));
        for run in 1..=runs {
            let outcome = program_at(program)
                .args(pattern.iter())
                .env("CARGO_MANIFEST_DIR", folder)
                .dir(folder)
                .unlogged()
                .quiet()?;
            let mut report = Report::default();
            if outcome.code != 0 {
                eprint!("{}", outcome.text);
                report.at_most(
                    &format!("steady: {target} {load}, failures in {run} runs"),
                    1,
                    "failures",
                    0,
                );
                return report.finish();
            }
            // A filter that matches nothing would pass.
            if outcome
                .text
                .lines()
                .any(|line| line.starts_with("running 0 tests"))
            {
                return Err(format!(
                    "no test of {target} is named *{}*",
                    pattern.unwrap_or_default()
                )
                .into());
            }
        }
        Report::default().at_most(
            &format!("steady: {target} {load}, failures in {runs} runs"),
            0,
            "failures",
            0,
        );
    }
    Ok(())
}

/// Threads that only take processor time, until this is dropped. They end with this process, however it ends.
struct Busy(Arc<AtomicBool>);

impl Busy {
    fn start(count: u32) -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        for _ in 0..count {
            let is_over = Arc::clone(&is_over);
            std::thread::spawn(move || {
                while !is_over.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        Self(is_over)
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn list_is_read_by_lines() {
        let list = entries("# comment\na:b\nc:d part of\n");
        assert_eq!(
            (list[0].package, list[0].target, list[0].pattern),
            ("a", "b", None)
        );
        assert_eq!(
            (list[1].package, list[1].target, list[1].pattern),
            ("c", "d", Some("part of"))
        );
        assert!(entries(LIST).len() >= 5);
    }
}
