//! A merge keeps foreign files among its results, and only one merge runs at a time.

use super::{Folder, boxes, two_shards};
use std::path::Path;

#[test]
fn second_merge_at_the_same_time_is_refused() {
    let folder = two_shards();
    folder.expect(0, "site merge out");
    let before = folder.results("out");
    let parts = std::fs::File::open(folder.path().join("out/parts")).unwrap();
    parts.try_lock().unwrap();
    folder
        .run("site merge out")
        .is_refused_with(&["out/parts: another merge is at work here"]);
    // The end of a process releases its locks.
    drop(parts);
    super::flip(&folder.pieces("out")[0]);
    folder.expect(2, "site merge out");
    assert!(folder.results("out") == before);
    assert!(!folder.parts("out").iter().any(|name| name.starts_with('.')));
    folder.expect(0, "site build site.toml --resume --shard 0/2 -o out");
    folder.expect(0, "site build site.toml --resume --shard 1/2 -o out");
    folder.expect(0, "site merge out");
    assert!(folder.results("out") == before);
}

#[test]
fn merged_results_survive_the_removal_of_parts() {
    let folder = two_shards();
    folder.expect(0, "site merge out");
    let before = folder.results("out");
    std::fs::remove_dir_all(folder.path().join("out/parts")).unwrap();
    folder
        .run("site merge out")
        .is_refused_with(&["no shard was built here"]);
    folder.expect(0, "site build site.toml -o out");
    folder.expect(0, "site merge out");
    assert!(folder.results("out") == before);
    // A manifest of an older format is replaced, and one of a newer format is kept.
    for (format, code) in [(1, 0), (99, 2)] {
        std::fs::remove_dir_all(folder.path().join("out/parts")).unwrap();
        let manifest = String::from_utf8(before["manifest.json"].clone()).unwrap();
        let other = manifest.replacen("\"format\": 2", &format!("\"format\": {format}"), 1);
        assert_ne!(manifest, other);
        folder.write("out/manifest.json", &other);
        folder.expect(code, "site build site.toml -o out");
        if code == 0 {
            folder.expect(0, "site merge out");
            assert!(folder.results("out") == before);
        } else {
            folder.write("out/manifest.json", &manifest);
            folder.expect(0, "site build site.toml -o out");
        }
    }
    // A folder with a manifest of another kind is refused.
    std::fs::remove_dir_all(folder.path().join("out/parts")).unwrap();
    folder.write("out/manifest.json", "{\"name\": \"a page\"}");
    folder
        .run("site build site.toml -o out")
        .is_refused_with(&["already that is of no site build"]);
}

#[test]
fn foreign_file_among_the_results_is_not_removed() {
    let folder = two_shards();
    folder.expect(0, "site merge out");
    let before = folder.results("out");
    let foreign = [
        "out/tables/mine.posegate",
        "out/proofs/mine",
        "out/plans/a/b/mine.json",
    ];
    for name in foreign {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        folder.write(name, "mine");
        let (_, err) = folder.expect(2, "site merge out");
        assert!(
            err.contains(&format!("{name}: no merge has written it")),
            "{err}"
        );
        assert_eq!(std::fs::read(&path).unwrap(), b"mine");
        std::fs::remove_file(&path).unwrap();
        assert!(folder.results("out") == before);
    }
    folder.copied("out", "page");
    folder.write("page/manifest.json", "{\"name\": \"a page\"}");
    folder
        .run("site merge page")
        .is_refused_with(&["page: there is a `manifest.json` already that is of no site build"]);
    folder.expect(0, "site merge out");
    assert!(folder.results("out") == before);
}

/// Parts on another disk, or at least in another folder.
#[cfg(unix)]
#[test]
fn parts_on_another_disk_are_merged() {
    let folder = two_shards();
    folder.copied("out", "same");
    folder.expect(0, "site merge same");
    let memory = Path::new("/dev/shm");
    let elsewhere = match memory.is_dir() {
        true => tempfile::tempdir_in(memory).unwrap(),
        false => tempfile::tempdir().unwrap(),
    };
    let far = elsewhere.path().join("far");
    std::fs::create_dir_all(far.join("parts")).unwrap();
    for name in folder.parts("out") {
        std::fs::copy(
            folder.path().join("out/parts").join(&name),
            far.join("parts").join(&name),
        )
        .unwrap();
    }
    std::fs::create_dir(folder.path().join("linked")).unwrap();
    std::os::unix::fs::symlink(far.join("parts"), folder.path().join("linked/parts")).unwrap();
    folder.expect(0, "site merge linked");
    assert!(folder.results("linked") == folder.results("same"));
    assert_eq!(std::fs::read_dir(&far).unwrap().count(), 1);
}

/// After a change of the site, records of earlier shards stay. They are named, and left out if the site is given.
#[test]
fn stale_records_are_left_out_if_the_site_is_given() {
    let folder = two_shards();
    folder.copied("out", "first");
    folder.expect(0, "site merge first");
    folder.write("other.toml", &boxes().replace("0.1]", "0.11]"));
    folder.expect(0, "site build other.toml -o second");
    folder.expect(0, "site merge second");
    folder.expect(0, "site build other.toml -o out");
    let (_, err) = folder.expect(2, "site merge out");
    // Errors are wrapped within names.
    let squeezed = err.replace(' ', "");
    for expected in [
        "shards are of different sites, programs or options",
        ": shard-0-of-1.json site ",
        ": shard-0-of-2.json, shard-1-of-2.json",
        "remove stale shard files from `parts`",
        "into a fresh folder",
    ] {
        assert!(
            squeezed.contains(&expected.replace(' ', "")),
            "{expected}: {err}"
        );
    }
    folder.expect(0, "site merge out --site other.toml");
    assert!(folder.results("out") == folder.results("second"));
    folder.expect(0, "site merge out --site site.toml");
    assert!(folder.results("out") == folder.results("first"));
    // Remains of another split of the same site.
    folder.expect(0, "site build site.toml --shard 1/3 -o out");
    folder.expect(0, "site merge out --site site.toml");
    assert!(folder.results("out") == folder.results("first"));
    // Builds with and without plans: the site does not define which.
    folder.expect(0, "site build site.toml -o out");
    folder.expect(0, "site merge out --site site.toml");
    assert!(folder.results("out") == folder.results("first"));
    folder.expect(0, "site build site.toml --tables-only --shard 1/3 -o out");
    folder.expect(2, "site merge out --site site.toml");
    folder.write("third.toml", &boxes().replace("0.1]", "0.12]"));
    folder
        .run("site merge out --site third.toml")
        .is_refused_with(&["the parts are of the site "]);
    folder.expect(0, "site build third.toml --shard 0/2 -o out");
    folder
        .run("site merge out --site third.toml")
        .is_refused_with(&["pieces that are missing or damaged: 2 the table of"]);
}

/// The largest number of shards is a million: a record of more is refused.
#[test]
fn record_of_more_than_a_million_shards_is_refused() {
    let folder = Folder::with(&boxes());
    folder.expect(0, "site build site.toml --shard 3/1000000 -o out");
    folder
        .run("site merge out")
        .is_refused_with(&["shard 2/1000000, parts/"]);
    let record = |count: u32| {
        folder
            .path()
            .join(format!("out/parts/shard-3-of-{count}.json"))
    };
    std::fs::rename(record(1_000_000), record(20_000_000)).unwrap();
    folder
        .run("site merge out")
        .is_refused_with(&["is not what a shard of this name writes"]);
}
