//! What starts an emulator, waits, or looks at a clock is run by `./ci.sh steady`, twenty times idle and twenty beside a
//! load: every such test target is on the list of that job.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What only such a test writes.
const WORDS: [&str; 7] = [
    "qemu-system-arm",
    "sleep(",
    "recv_timeout(",
    "read_timeout(",
    "try_wait(",
    "mkfifo",
    "Instant",
];
/// Targets that run on recordings alone, which no fast suite has: they look at a clock to print what it says.
const PRINTS_A_TIME: [&str; 1] = ["cases"];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The source files of a target: its own, those that it names by `#[path]`, and those of its folder.
fn files(first: &Path, is_folder: bool) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut open = vec![first.to_path_buf()];
    if is_folder {
        let entries = std::fs::read_dir(first.parent().unwrap()).unwrap();
        open.extend(entries.map(|entry| entry.unwrap().path()));
    }
    while let Some(path) = open.pop() {
        let is_source = path.extension().is_some_and(|extension| extension == "rs");
        if !is_source || !found.insert(path.clone()) {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let named = text
            .lines()
            .filter_map(|line| line.trim().strip_prefix("#[path = \""));
        let folder = path.parent().unwrap();
        open.extend(
            named
                .filter_map(|rest| rest.split('"').next())
                .map(|name| folder.join(name)),
        );
    }
    found
}

/// Whether the code, not a comment, has one of the words.
fn waits(text: &str) -> bool {
    text.lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .any(|line| WORDS.iter().any(|word| line.contains(word)))
}

/// Every target of `tests`, by its name, and whether it waits.
fn targets() -> Vec<(String, bool)> {
    let mut targets = Vec::new();
    for entry in std::fs::read_dir(root().join("tests")).unwrap() {
        let path = entry.unwrap().path();
        let main = path.join("main.rs");
        let is_folder = main.is_file();
        if !is_folder && path.extension().is_none_or(|extension| extension != "rs") {
            continue;
        }
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let first = if is_folder { main } else { path };
        let text = |path: &PathBuf| std::fs::read_to_string(path).unwrap();
        // This one names the words.
        let found = name != "steady"
            && files(&first, is_folder)
                .iter()
                .any(|path| waits(&text(path)));
        targets.push((name, found));
    }
    targets
}

/// The targets on the list.
fn listed(script: &str) -> BTreeSet<String> {
    let (_, rest) = script.split_once("\nSTEADY=(\n").expect("the list");
    let (list, _) = rest.split_once("\n)").expect("its end");
    let entries = list.lines().map(|line| line.trim().trim_matches('"'));
    entries
        .filter_map(|entry| entry.split(' ').next())
        .map(str::to_owned)
        .collect()
}

#[test]
fn every_test_that_waits_is_run_beside_a_load() {
    let script = std::fs::read_to_string(root().join("ci.sh")).unwrap();
    let listed = listed(&script);
    let targets = targets();
    assert!(targets.len() > 30 && listed.len() >= 5);
    let waiting: BTreeSet<String> = targets
        .into_iter()
        .filter(|(name, waits)| *waits && !PRINTS_A_TIME.contains(&name.as_str()))
        .map(|(name, _)| name)
        .collect();
    assert_eq!(
        waiting, listed,
        "STEADY in ci.sh, to the right, is not what waits"
    );
}

#[test]
fn waiting_is_seen_in_code_alone() {
    assert!(waits("    std::thread::sleep(time);"));
    assert!(waits("let start = Instant::now();"));
    assert!(!waits("    // It may sleep(as it likes)."));
    assert!(!waits("fn a_source_that_waits() {}"));
    assert_eq!(
        listed("\nSTEADY=(\n  a\n  \"b c\"\n)\n"),
        ["a", "b"].map(String::from).into()
    );
}
