//! New results take the place of old ones, whatever happens; drafts and locks of several processes.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use super::error::FleetError;
use super::journal::{self, InjectedFault};
use super::lock::Lock;
use super::store::Store;
use super::{BuildOptions, Inventory, MergeChecks, MergeSummary, Recipe, Shard, build, merge};
use crate::plan::Options;
use crate::site::Site;

/// A box so many centimetres wide, and a plan to it, which is none.
fn site(wide: &str) -> Site {
    let text = format!(
        "[task.dock]\nkind = \"work\"\nfrom = \"gate\"\ngoal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}\n\
         success = {{ shape = \"box\", x = [-0.{wide}, 0.{wide}], y = [-0.1, 0.1], yaw_deg = [-4.0, 4.0] }}\n\
         [chain.gate]\nstart = {{ x = -3.0, y = 0.0, yaw_deg = 0.0, bounded = {{ translation = 0.5, yaw_deg = 2.0 }} }}\n"
    );
    Site::parse(&text, "site.toml").unwrap()
}

fn built(site: &Site, output: &Path) {
    let recipe = Recipe::of(site, Some(&Options::default()), "program");
    let order = BuildOptions {
        shard: Shard::WHOLE,
        resume: false,
        threads: None,
    };
    build(site, &Inventory::of(site, recipe), output, &order, &|| ()).unwrap();
}

fn merged(output: &Path) -> Result<MergeSummary, FleetError> {
    merge(output, MergeChecks::Folder, Some("program"), &|| ())
}

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// All files of a folder but those among `parts` and of stages.
fn results(folder: &Path) -> Files {
    let mut files = all(folder);
    files.retain(|path, _| {
        let first = path.components().next().unwrap().as_os_str();
        first != "parts" && !first.to_str().unwrap().starts_with('.')
    });
    files
}

fn all(folder: &Path) -> Files {
    let mut files = Files::new();
    let mut open = std::vec![folder.to_path_buf()];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(
                std::fs::read_dir(path)
                    .unwrap()
                    .map(|entry| entry.unwrap().path()),
            );
        } else {
            let name = path.strip_prefix(folder).unwrap().to_path_buf();
            files.insert(name, std::fs::read(path).unwrap());
        }
    }
    files
}

fn copied(from: &Path) -> tempfile::TempDir {
    let to = tempfile::tempdir().unwrap();
    for (name, bytes) in all(from) {
        let path = to.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    to
}

fn stages(output: &Path) -> usize {
    let entries = std::fs::read_dir(output).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.starts_with('.')).count()
}

/// A folder with merged results and the parts of others, with what is in it, and what will be.
fn prepared(first: bool) -> (tempfile::TempDir, Files, Files) {
    let folder = tempfile::tempdir().unwrap();
    if !first {
        built(&site("20"), folder.path());
        merged(folder.path()).unwrap();
    }
    let before = results(folder.path());
    built(&site("10"), folder.path());
    let other = copied(folder.path());
    merged(other.path()).unwrap();
    let after = results(other.path());
    assert_eq!((before.len(), after.len()), (if first { 0 } else { 4 }, 4));
    assert_ne!(before, after);
    (folder, before, after)
}

/// Does a merge with a fault; `None` when it was killed.
fn faulty(
    output: &Path,
    fault: (usize, InjectedFault),
) -> Option<Result<MergeSummary, FleetError>> {
    journal::begin(Some(fault));
    let done = catch_unwind(AssertUnwindSafe(|| merged(output))).ok();
    journal::end();
    done
}

/// A disk that fails at any step: what was there is there, or all that is new.
#[test]
fn a_merge_that_fails_at_any_step_leaves_what_was_there() {
    for first in [true, false] {
        let (template, before, after) = prepared(first);
        for number in 0.. {
            let folder = copied(template.path());
            let output = folder.path();
            let mut arrived = false;
            match faulty(output, (number, InjectedFault::Fails)).unwrap() {
                Ok(merged) => {
                    assert_eq!(results(output), after, "{number}");
                    let Some(left) = merged.left else {
                        assert!(number > 12, "{number}");
                        break;
                    };
                    // The stage could not be cleared away, and all is there.
                    assert!(left.contains("remove fails"), "{left}");
                    assert_eq!(stages(output), 1);
                    arrived = true;
                    // Nor can it by the next merge, to which it is the first step.
                    let next = faulty(output, (0, InjectedFault::Fails)).unwrap().unwrap();
                    assert!(next.left.unwrap().contains("remove fails"));
                    assert_eq!(stages(output), 1);
                }
                Err(error) => {
                    assert!(error.to_string().contains(" fails"), "{error}");
                    assert_eq!(stages(output), 0, "{number}");
                    let now = results(output);
                    // The manifest has its name, and that may not be on the disk: the last step.
                    assert!(now == before || now == after, "{number}: {:?}", now.keys());
                    arrived |= now == after;
                }
            }
            merged(output).unwrap();
            assert_eq!(results(output), after, "{number} {arrived}");
            assert_eq!(stages(output), 0, "{number}");
        }
    }
}

/// Killed at any step, and at any step of what the next ones put back: nothing is lost, and there is no manifest of what is
/// not there.
#[test]
fn a_merge_that_is_killed_at_any_step_is_put_back_by_the_next() {
    for first in [true, false] {
        let (template, before, after) = prepared(first);
        for number in 0.. {
            let folder = copied(template.path());
            let output = folder.path();
            if faulty(output, (number, InjectedFault::Killed)).is_some() {
                assert!(number > 12, "{number}");
                break;
            }
            let whole = |place: &str| {
                let now = results(output);
                let is_whole = now == before || now == after;
                let listed = now.contains_key(Path::new("manifest.json"));
                assert!(is_whole || !listed, "{number}, {place}: {:?}", now.keys());
                is_whole
            };
            whole("killed");
            // A merge that can do no more than to put back, and is killed again and again.
            let list = output.join("parts/shard-0-of-1.json");
            let bytes = std::fs::read(&list).unwrap();
            std::fs::remove_file(&list).unwrap();
            for again in 0.. {
                assert!(again < 40, "{number}");
                match faulty(output, (again, InjectedFault::Killed)) {
                    None => whole("killed again"),
                    Some(done) => {
                        assert!(matches!(done, Err(FleetError::NoShards(_))), "{done:?}");
                        break;
                    }
                };
            }
            assert!(whole("put back"), "{number}: {:?}", results(output).keys());
            assert_eq!(stages(output), 0, "{number}");
            std::fs::write(&list, bytes).unwrap();
            merged(output).unwrap();
            assert_eq!(results(output), after, "{number}");
        }
    }
}

/// What a name points to is on the disk before the name is, and there is no manifest while there are results of two merges.
#[test]
fn names_are_on_the_disk_in_order() {
    let (folder, ..) = prepared(false);
    let output = folder.path();
    journal::begin(None);
    merged(output).unwrap();
    let steps: Vec<String> = journal::end()
        .into_iter()
        .map(|(what, path)| {
            let path = path.strip_prefix(output).unwrap();
            let names = path.iter().map(|name| name.to_str().unwrap());
            let names: Vec<&str> = names
                .map(|name| if name.starts_with('.') { "stage" } else { name })
                .collect();
            format!("{what} {}", names.join("/"))
        })
        .collect();
    let expected = [
        "sync stage/plans/gate",
        "sync stage/tables",
        "sync stage/proofs",
        "sync stage/plans",
        "sync stage",
        "sync ",
        "rename stage/before/manifest.json",
        "sync stage/before",
        "sync ",
        "rename stage/before/tables",
        "rename tables",
        "rename stage/before/proofs",
        "rename proofs",
        "rename stage/before/plans",
        "rename plans",
        "sync stage/before",
        "sync stage",
        "sync ",
        "rename manifest.json",
        "sync ",
        "remove stage",
    ];
    assert_eq!(steps, expected);
}

/// In containers many processes have the same number: here two stores have one.
#[test]
fn two_processes_of_one_number_do_not_meet() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path();
    let other = |of: u8| std::vec![of; 10_000];
    Store::for_shard(output, Shard::WHOLE)
        .unwrap()
        .write("piece", &other(0))
        .unwrap();
    std::thread::scope(|scope| {
        for of in 1..4 {
            scope.spawn(move || {
                for _ in 0..20 {
                    let store = Store::for_shard(output, Shard::WHOLE).unwrap();
                    store.write("piece", &other(of)).unwrap();
                    let bytes = store.read("piece").unwrap().unwrap();
                    assert!((0..4).any(|of| bytes == other(of)));
                }
            });
        }
    });
    let store = Store::for_shard(output, Shard::WHOLE).unwrap();
    assert_eq!(store.names().unwrap(), ["piece"]);
}

#[test]
fn a_lock_is_held_once_and_nobody_elses_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::for_shard(folder.path(), Shard::WHOLE).unwrap();
    let lock = Lock::take(&store).unwrap();
    let Err(FleetError::Locked { path, by }) = Lock::take(&store) else {
        panic!("taken twice");
    };
    assert!(
        by.contains(&format!("process {}, ", std::process::id())),
        "{by}"
    );
    drop(lock);
    assert!(!path.exists());
    let lock = Lock::take(&store).unwrap();
    // Somebody has removed it, and another one has it.
    std::fs::write(&path, "host other, process 1, 00").unwrap();
    drop(lock);
    assert!(path.exists());
}
