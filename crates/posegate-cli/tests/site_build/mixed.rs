//! Missing and changed pieces, and shards that do not belong together, are refused by name.

use super::{boxes, flip, rewrite, two_shards};
use std::path::Path;

/// Appends a blank to the proof in a finished piece: the JSON is the same.
fn forge(piece: &Path) {
    rewrite(piece, |files| files.last_mut().unwrap().1.push(b' '));
}

#[test]
fn missing_shards_are_named() {
    let folder = two_shards();
    folder.expect(0, "site build site.toml --shard 1/2 -o one");
    let (_, err) = folder.expect(2, "site merge one");
    assert!(
        err.contains("pieces that are missing or damaged: 3 the table of `dock-")
            && err.matches("shard 0/2, parts/").count() == 3,
        "{err}"
    );
    assert!(!folder.path().join("one/manifest.json").exists());
    // Pieces of any number of shards are merged.
    folder.expect(0, "site build site.toml --shard 0/3 -o one");
    folder.expect(0, "site build site.toml --resume --shard 0/2 -o one");
    folder.expect(0, "site merge one");
    folder.expect(0, "site merge out");
    assert!(folder.results("one") == folder.results("out"));
    folder
        .run("site merge nowhere")
        .is_refused_with(&["nowhere: no shard was built here"]);
}

#[test]
fn missing_or_changed_piece_is_named() {
    let folder = two_shards();
    folder.copied("out", "untouched");
    folder.expect(0, "site merge untouched");
    let untouched = folder.results("untouched");
    for change in ["remove", "flip", "forge", "swap"] {
        folder.copied("out", change);
        let [piece, other] = &folder.pieces(change)[..2] else {
            panic!("five pieces");
        };
        match change {
            "remove" => std::fs::remove_file(piece).unwrap(),
            "flip" => flip(piece),
            "forge" => forge(piece),
            _ => {
                std::fs::copy(other, piece).unwrap();
            }
        }
        let key = piece.file_name().unwrap().to_str().unwrap();
        let (_, err) = folder.expect(2, &format!("site merge {change}"));
        assert!(
            err.contains("pieces that are missing or damaged: 1 the table of `dock-")
                && err.contains(&key[..16])
                && err.contains("/2, parts/"),
            "{err}"
        );
        assert!(!folder.path().join(change).join("manifest.json").exists());
        assert!(!folder.path().join(change).join("tables").exists());
        // The named shard builds it again.
        for shard in ["0/2", "1/2"] {
            folder.expect(
                0,
                &format!("site build site.toml --shard {shard} --resume -o {change}"),
            );
        }
        folder.expect(0, &format!("site merge {change}"));
        assert!(folder.results(change) == untouched, "{change}");
    }
}

/// A changed record or inventory is refused.
#[test]
fn changed_record_or_inventory_is_refused() {
    let folder = two_shards();
    folder.copied("out", "torn");
    folder.write("torn/parts/shard-0-of-2.json", "{");
    folder
        .run("site merge torn")
        .is_refused_with(&["torn/parts/shard-0-of-2.json: EOF"]);
    for (name, change, expected) in [
        ("changed", Some("{}"), "was changed"),
        ("gone", None, "is missing: every shard writes it"),
    ] {
        folder.copied("out", name);
        let parts = folder.parts(name);
        let is_inventory = |name: &&String| name.starts_with("inventory-");
        let inventory = format!("{name}/parts/{}", parts.iter().find(is_inventory).unwrap());
        match change {
            Some(text) => folder.write(&inventory, text),
            None => std::fs::remove_file(folder.path().join(&inventory)).unwrap(),
        }
        folder
            .run(&format!("site merge {name}"))
            .is_refused_with(&[expected]);
        folder.expect(
            0,
            &format!("site build site.toml --shard 1/2 --resume -o {name}"),
        );
        folder.expect(0, &format!("site merge {name}"));
    }
}

#[test]
fn shards_of_different_builds_are_refused() {
    let folder = two_shards();
    let digest = |site: &str| {
        let built = folder
            .run(&format!("site build {site} --json -o digest"))
            .json(0);
        built["site_digest"].as_str().unwrap().to_owned()
    };
    // The site changed between the shards.
    folder.write("other.toml", &boxes().replace("0.1]", "0.11]"));
    let (one, other) = (digest("site.toml"), digest("other.toml"));
    folder.copied("out", "changed");
    folder.expect(0, "site build other.toml --shard 1/2 --resume -o changed");
    let (_, err) = folder.expect(2, "site merge changed");
    let squeezed = err.replace(' ', "");
    let lists = |digest: &str, shard: &str| {
        squeezed.contains(&format!("site{},", &digest[..12]))
            && squeezed.contains(&format!(":{shard}"))
    };
    assert!(
        err.contains("shards are of different sites, programs or options")
            && lists(&one, "shard-0-of-2.json")
            && lists(&other, "shard-1-of-2.json"),
        "{err}"
    );
    // Other plans.
    folder.copied("out", "options");
    folder.expect(
        0,
        "site build site.toml --shard 1/2 --tables-only -o options",
    );
    let (_, err) = folder.expect(2, "site merge options");
    assert!(
        err.contains("tables only")
            && err.contains("shard-0-of-2.json")
            && err.contains("shard-1-of-2.json"),
        "{err}"
    );
    // The shard builds with the same options again.
    folder.expect(0, "site build site.toml --shard 1/2 --resume -o options");
    folder.expect(0, "site merge options");
}
