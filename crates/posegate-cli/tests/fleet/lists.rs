//! What shards say of themselves: gaps, changed pieces and lists, and shards that do not belong together are refused by name.

use super::{boxes, flip, rewrite, two_shards};
use std::path::Path;

/// Makes the proof in a finished piece longer: blanks are nothing to JSON.
fn forge(piece: &Path) {
    rewrite(piece, |files| files.last_mut().unwrap().1.push(b' '));
}

#[test]
fn gaps_are_named() {
    let folder = two_shards();
    std::fs::remove_file(folder.path().join("out/parts/shard-1-of-2.json")).unwrap();
    let (_, err) = folder.expect(2, "site merge out");
    assert!(err.contains("shards that have not ended: 1 1/2"), "{err}");
    assert!(!folder.path().join("out/manifest.json").exists());
    let (_, err) = folder.expect(2, "site merge nowhere");
    assert!(err.contains("nowhere: no shard has ended here"), "{err}");
}

#[test]
fn a_piece_that_is_missing_or_changed_is_named() {
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
        // The shard that is named makes it again.
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

#[test]
fn a_list_that_was_changed_is_refused() {
    let folder = two_shards();
    let list = "parts/shard-0-of-2.json";
    let read = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(folder.path().join("out").join(name)).unwrap())
            .unwrap()
    };
    // A piece is left out.
    folder.copied("out", "short");
    let mut changed = read(list);
    changed["pieces"].as_array_mut().unwrap().pop();
    folder.write(&format!("short/{list}"), &changed.to_string());
    let (_, err) = folder.expect(2, "site merge short");
    assert!(
        err.contains("missing or damaged: 1 the table of `dock-")
            && err.contains("shard 0/2 does not list it"),
        "{err}"
    );
    // Both have one: with the same bytes, then with others.
    let other = "parts/shard-1-of-2.json";
    folder.copied("out", "twice");
    let mut changed = read(other);
    let theirs = read(list)["pieces"][0].clone();
    changed["pieces"].as_array_mut().unwrap().push(theirs);
    folder.write(&format!("twice/{other}"), &changed.to_string());
    let twice = || {
        let (_, err) = folder.expect(2, "site merge twice");
        assert!(
            err.contains("the table of `dock-")
                && err.contains(
                    "is the share of shard-0-of-2.json alone, and is listed by shard-0-of-2.json and by shard-1-of-2.json"
                ),
            "{err}"
        );
    };
    twice();
    let last = changed["pieces"].as_array().unwrap().len() - 1;
    changed["pieces"][last]["sha256"] = "00".into();
    folder.write(&format!("twice/{other}"), &changed.to_string());
    twice();
    // The other one alone, and one twice.
    let mut without = read(list);
    let own = without["pieces"].as_array_mut().unwrap().remove(0);
    folder.write(&format!("twice/{list}"), &without.to_string());
    changed["pieces"][last] = own.clone();
    folder.write(&format!("twice/{other}"), &changed.to_string());
    let (_, err) = folder.expect(2, "site merge twice");
    assert!(
        err.contains("is the share of shard-0-of-2.json alone, and is listed by shard-1-of-2.json"),
        "{err}"
    );
    folder.copied("out", "doubled");
    let mut doubled = read(list);
    doubled["pieces"].as_array_mut().unwrap().push(own);
    folder.write(&format!("doubled/{list}"), &doubled.to_string());
    let (_, err) = folder.expect(2, "site merge doubled");
    assert!(
        err.contains("listed by shard-0-of-2.json and by shard-0-of-2.json"),
        "{err}"
    );
    // What is no piece of the site.
    folder.copied("out", "more");
    let mut changed = read(list);
    changed["pieces"][0]["key"] = "ab".into();
    folder.write(&format!("more/{list}"), &changed.to_string());
    let (_, err) = folder.expect(2, "site merge more");
    assert!(err.contains("does not list it"), "{err}");
    let mut changed = read(list);
    let mut own = changed["pieces"][0].clone();
    own["key"] = "ab".into();
    changed["pieces"].as_array_mut().unwrap().push(own);
    folder.write(&format!("more/{list}"), &changed.to_string());
    let (_, err) = folder.expect(2, "site merge more");
    assert!(
        err.contains("lists ab, which is no piece of the site"),
        "{err}"
    );
    // A list or an inventory that is no longer what was written.
    folder.copied("out", "torn");
    folder.write(&format!("torn/{list}"), "{");
    let (_, err) = folder.expect(2, "site merge torn");
    assert!(err.contains("torn/parts/shard-0-of-2.json: EOF"), "{err}");
    folder.copied("out", "inventory");
    let parts = folder.parts("inventory");
    let name = parts
        .iter()
        .find(|name| name.starts_with("inventory-"))
        .unwrap();
    folder.write(&format!("inventory/parts/{name}"), "{}");
    let (_, err) = folder.expect(2, "site merge inventory");
    assert!(err.contains("was changed"), "{err}");
}

#[test]
fn shards_that_do_not_belong_together_are_refused() {
    let folder = two_shards();
    let digest = |site: &str| {
        let (out, _) = folder.expect(0, &format!("site build {site} --json -o digest"));
        let built: serde_json::Value = serde_json::from_str(&out).unwrap();
        built["site_digest"].as_str().unwrap().to_owned()
    };
    // The site changed between the shards.
    folder.write("other.toml", &boxes().replace("0.1]", "0.11]"));
    let (one, other) = (digest("site.toml"), digest("other.toml"));
    folder.copied("out", "changed");
    folder.expect(0, "site build other.toml --shard 1/2 --resume -o changed");
    let (_, err) = folder.expect(2, "site merge changed");
    let said = format!(
        "the site changed between shards: shard-0-of-2.json was built of the site {one}, shard-1-of-2.json of {other}"
    );
    assert!(
        err.replace(' ', "").contains(&said.replace(' ', "")),
        "{err}"
    );
    // Two numbers of shards.
    folder.copied("out", "numbers");
    folder.expect(0, "site build site.toml --shard 2/3 -o numbers");
    let (_, err) = folder.expect(2, "site merge numbers");
    assert!(
        err.contains("shard-0-of-2.json and shard-2-of-3.json are mixed"),
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
        err.contains("shards are not alike: shard-0-of-2.json and shard-1-of-2.json"),
        "{err}"
    );
}
