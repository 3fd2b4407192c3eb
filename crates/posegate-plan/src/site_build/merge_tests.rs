//! A merge replaces the results of an earlier one, stopped at any file. Several processes write in parallel.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::error::SiteBuildError;
use super::store::Store;
use super::{BuildOptions, Inventory, MergeChecks, MergeSummary, Recipe, Shard, build, merge};
use crate::Options;
use posegate_site::Site;

/// Returns a site with a task whose success set is a box of twice `0.{wide}` m, and with `chain`, from which there is
/// no plan to the task.
fn site(wide: &str, chain: &str) -> Site {
    let text = format!(
        "[task.dock]\nkind = \"work\"\nfrom = \"{chain}\"\ngoal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}\n\
         success = {{ shape = \"box\", x = [-0.{wide}, 0.{wide}], y = [-0.1, 0.1], yaw_deg = [-4.0, 4.0] }}\n\
         [chain.{chain}]\nstart = {{ x = -3.0, y = 0.0, yaw_deg = 0.0, bounded = {{ translation = 0.5, yaw_deg = 2.0 }} }}\n"
    );
    Site::parse(&text, "site.toml").unwrap()
}

fn built(site: &Site, output: &Path) {
    let recipe = Recipe::new(site, Some(&Options::default()), "program");
    let options = BuildOptions {
        shard: Shard::WHOLE,
        resume: false,
        threads: None,
    };
    build(
        site,
        &Inventory::new(site, recipe),
        output,
        &options,
        &|| (),
    )
    .unwrap();
}

fn merged(output: &Path) -> Result<MergeSummary, SiteBuildError> {
    merge(output, MergeChecks::Folder, Some("program"), &|| ())
}

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Returns all files of a folder outside of `parts`.
fn results(folder: &Path) -> Files {
    let (mut files, mut open) = (Files::new(), vec![folder.to_path_buf()]);
    while let Some(path) = open.pop() {
        if path == folder.join("parts") {
            continue;
        }
        if path.is_dir() {
            let entries = std::fs::read_dir(path).unwrap();
            open.extend(entries.map(|entry| entry.unwrap().path()));
        } else {
            let name = path.strip_prefix(folder).unwrap().to_path_buf();
            files.insert(name, std::fs::read(path).unwrap());
        }
    }
    files
}

/// Returns the files of a merge of one site in a fresh folder.
fn expected(site: &Site) -> Files {
    let folder = tempfile::tempdir().unwrap();
    built(site, folder.path());
    merged(folder.path()).unwrap();
    results(folder.path())
}

/// A merge that stops at any file leaves no manifest. The next merge completes it, for this site or another one.
#[test]
fn next_merge_completes_one_that_stopped_at_any_file() {
    let (old, new) = (site("20", "gate"), site("10", "yard"));
    let (before, after) = (expected(&old), expected(&new));
    for stop in [
        "tables/dock.posegate",
        "proofs/dock.json",
        "plans/yard/dock.json",
    ] {
        for (first, next) in [(false, &new), (true, &new), (true, &old)] {
            let folder = tempfile::tempdir().unwrap();
            let output = folder.path();
            if first {
                built(&old, output);
                merged(output).unwrap();
                assert_eq!(results(output), before);
            }
            built(&new, output);
            // A file does not replace a folder.
            let stop = output.join(stop);
            let _ = std::fs::remove_file(&stop);
            std::fs::create_dir_all(&stop).unwrap();
            assert!(matches!(merged(output), Err(SiteBuildError::File { .. })));
            assert!(!output.join("manifest.json").exists());
            std::fs::remove_dir(&stop).unwrap();
            built(next, output);
            merged(output).unwrap();
            let expected = if next == &old { &before } else { &after };
            assert!(results(output) == *expected, "{}", stop.display());
            assert!(!output.join("parts/replacing.json").exists());
        }
    }
}

/// A missing piece, or another piece in its place, leaves the results unchanged.
#[test]
fn missing_and_damaged_pieces_leave_results_unchanged() {
    let (old, new) = (site("20", "gate"), site("10", "gate"));
    let before = expected(&old);
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path();
    built(&old, output);
    merged(output).unwrap();
    let recipe = Recipe::new(&new, Some(&Options::default()), "program");
    let keys: Vec<PathBuf> = Inventory::new(&new, recipe.clone())
        .pieces()
        .iter()
        .map(|piece| output.join("parts").join(piece.key(&recipe)))
        .collect();
    assert_eq!(keys.len(), 2);
    for (key, other) in [(&keys[0], &keys[1]), (&keys[1], &keys[0])] {
        built(&new, output);
        let bytes = std::fs::read(key).unwrap();
        let mut flipped = bytes.clone();
        *flipped.last_mut().unwrap() ^= 1;
        for wrong in [None, Some(flipped), Some(std::fs::read(other).unwrap())] {
            match wrong {
                None => std::fs::remove_file(key).unwrap(),
                Some(wrong) => std::fs::write(key, wrong).unwrap(),
            }
            let error = merged(output).unwrap_err();
            assert!(
                matches!(&error, SiteBuildError::Missing(names) if names.len() == 1),
                "{error}"
            );
            assert_eq!(results(output), before);
        }
    }
    built(&new, output);
    merged(output).unwrap();
    assert_eq!(results(output), expected(&new));
}

/// Processes in containers may have the same process number: here several stores write one file.
#[test]
fn stores_of_one_folder_do_not_interfere() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path();
    let other = |of: u8| vec![of; 10_000];
    let store = || Store::new(output.into());
    store().write("piece", &other(0)).unwrap();
    std::thread::scope(|scope| {
        for of in 1..4 {
            scope.spawn(move || {
                for _ in 0..20 {
                    let store = store();
                    store.write("piece", &other(of)).unwrap();
                    let bytes = store.read("piece").unwrap().unwrap();
                    assert!((0..4).any(|of| bytes == other(of)));
                }
            });
        }
    });
    assert_eq!(store().names().unwrap(), ["piece"]);
}
