//! `cargo xtask steady` repeats tests that start an emulator, wait, or read a clock, idle and under load. Every such test
//! target is in the list of that job, `xtask/steady.txt`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Words that only such a test contains.
const WORDS: [&str; 7] = [
    "qemu-system-arm",
    "sleep(",
    "recv_timeout(",
    "read_timeout(",
    "try_wait(",
    "mkfifo",
    "Instant",
];
/// Targets that run only on recordings, which the fast suite does not have: they read a clock to print the time.
const PRINTS_A_TIME: [&str; 1] = ["posegate-cli:cases"];
/// The crate of shared test code, of which a test uses single modules.
const TESTKIT: &str = "crates/posegate-testkit/src";

fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Returns the source files of a target: its own, those of its folder, and the modules of the shared test code that they name.
fn files(first: &Path, is_folder: bool) -> BTreeSet<PathBuf> {
    let testkit = root().join(TESTKIT);
    let mut found = BTreeSet::new();
    let mut open = vec![first.to_path_buf()];
    if is_folder {
        open.extend(entries(first.parent().unwrap()));
    }
    while let Some(path) = open.pop() {
        let is_source = path.extension().is_some_and(|extension| extension == "rs");
        if !is_source || !path.is_file() || !found.insert(path.clone()) {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let prefix = if path.starts_with(&testkit) {
            "crate::"
        } else {
            "posegate_testkit::"
        };
        for module in names_after(&text, prefix) {
            open.push(testkit.join(module).with_extension("rs"));
            let folder = testkit.join(module);
            if folder.is_dir() {
                open.extend(entries(&folder));
            }
        }
    }
    found
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().path()).collect()
}

/// Returns the names that follow a prefix, also those of a list in braces.
fn names_after<'a>(text: &'a str, prefix: &str) -> Vec<&'a str> {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut names = Vec::new();
    for rest in text.split(prefix).skip(1) {
        let list = match rest.strip_prefix('{') {
            Some(list) => list.split('}').next().unwrap_or_default(),
            None => rest.split(|c| !is_name(c)).next().unwrap_or_default(),
        };
        names.extend(list.split(|c| !is_name(c)).filter(|name| !name.is_empty()));
    }
    names
}

/// Returns `true` if the code, not a comment, has one of the words.
fn waits(text: &str) -> bool {
    text.lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .any(|line| WORDS.iter().any(|word| line.contains(word)))
}

/// Returns every test target of the workspace, as `PACKAGE:TARGET`, with `true` if it waits.
fn targets() -> Vec<(String, bool)> {
    let mut folders = vec![("posegate".to_owned(), root().join("tests"))];
    for path in entries(&root().join("crates")) {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.join("tests").is_dir() {
            folders.push((name, path.join("tests")));
        }
    }
    let mut targets = Vec::new();
    for (package, folder) in folders {
        for path in entries(&folder) {
            let main = path.join("main.rs");
            let is_folder = main.is_file();
            if !is_folder && path.extension().is_none_or(|extension| extension != "rs") {
                continue;
            }
            let name = path.file_stem().unwrap().to_str().unwrap();
            let first = if is_folder { main } else { path.clone() };
            let text = |path: &PathBuf| std::fs::read_to_string(path).unwrap();
            let found = files(&first, is_folder)
                .iter()
                .any(|path| waits(&text(path)));
            targets.push((format!("{package}:{name}"), found));
        }
    }
    targets
}

/// Returns the targets of the list.
fn listed(list: &str) -> BTreeSet<String> {
    list.lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .filter_map(|line| line.split(' ').next())
        .map(str::to_owned)
        .collect()
}

#[test]
fn every_waiting_test_is_in_the_list() {
    let listed = listed(include_str!("../steady.txt"));
    let targets = targets();
    assert!(targets.len() > 30 && listed.len() >= 5);
    let waiting: BTreeSet<String> = targets
        .into_iter()
        .filter(|(name, waits)| *waits && !PRINTS_A_TIME.contains(&name.as_str()))
        .map(|(name, _)| name)
        .collect();
    assert_eq!(
        waiting, listed,
        "xtask/steady.txt, to the right, does not name the tests that wait"
    );
}

/// A part of a name that no test has would repeat nothing.
#[test]
fn every_part_of_a_name_is_that_of_a_test() {
    let lines = include_str!("../steady.txt").lines();
    let mut count = 0;
    for line in lines.filter(|line| !line.starts_with('#')) {
        let Some((target, part)) = line.split_once(' ') else {
            continue;
        };
        let (package, name) = target.split_once(':').expect("PACKAGE:TARGET");
        let path = root().join(format!("crates/{package}/tests/{name}.rs"));
        let text = std::fs::read_to_string(&path).unwrap();
        let tests = text.split("#[test]").skip(1);
        let mut names = tests.filter_map(|test| test.split_once("fn ")?.1.split('(').next());
        assert!(names.any(|name| name.contains(part)), "{line}");
        count += 1;
    }
    assert!(count > 1);
}

#[test]
fn waiting_in_comments_is_ignored() {
    assert!(waits("    std::thread::sleep(time);"));
    assert!(waits("let start = Instant::now();"));
    assert!(!waits("    // It may sleep(as it likes)."));
    assert!(!waits("fn a_source_that_waits() {}"));
    let modules = names_after("use kit::{a, b_c};\nkit::d::f();", "kit::");
    assert_eq!(modules, ["a", "b_c", "d"]);
    assert_eq!(
        listed("# comment\na:b\nc:d e\n"),
        ["a:b", "c:d"].map(String::from).into()
    );
}
