use super::piece::file_name;
use super::piece_file::{Content, checked, decode, encode};
use super::{Inventory, Piece, PlanOptions, Recipe, Shard};
use crate::Options;
use posegate_site::{SAMPLE, Site};

fn recipe() -> Recipe {
    let site = Site::parse(SAMPLE, "site.toml").unwrap();
    Recipe::new(&site, Some(&Options::default()), "program")
}

fn table() -> Piece {
    Piece::Table {
        task: "dock".into(),
    }
}

#[test]
fn shards_are_counted_from_zero() {
    assert_eq!("2/5".parse(), Shard::new(2, 5));
    let text = |shard: &str| shard.parse::<Shard>().unwrap_err().to_string();
    assert_eq!(
        text("3/2"),
        "shard 3/2: shards are counted from 0, the last of 2 is 1/2"
    );
    assert_eq!(
        text("2/2"),
        "shard 2/2: shards are counted from 0, the last of 2 is 1/2"
    );
    assert_eq!(
        text("0/0"),
        "shard 0/0: a site is cut into one shard at least"
    );
    assert_eq!(
        text("0/1000001"),
        "shard 0/1000001: a site is cut into 1000000 shards at most"
    );
    assert!("999999/1000000".parse::<Shard>().is_ok());
    for wrong in [
        "", "1", "a/b", "-1/2", "+1/2", "1/+2", "1/", "1/2/3", "1 /2",
    ] {
        assert!(text(wrong).contains("is no shard"), "{wrong}");
    }
}

#[test]
fn file_names_have_no_special_characters() {
    for (name, safe) in [
        ("dock-1_a.b", "dock-1_a.b"),
        ("../etc", "%2E.%2Fetc"),
        (".hidden", "%2Ehidden"),
        ("a b", "a%20b"),
        ("50%", "50%25"),
        ("\u{e9}", "%C3%A9"),
    ] {
        assert_eq!(file_name(name), safe);
    }
}

/// Every piece is in one share, and the numbers of tables of two shares differ by at most one; a few plans are all
/// made by one shard.
#[test]
fn shares_are_complete_and_even() {
    let site = Site::parse(
        include_str!("../../../../examples/sites/docks.toml"),
        "docks.toml",
    )
    .unwrap();
    let inventory = Inventory::new(
        &site,
        Recipe::new(&site, Some(&Options::default()), "program"),
    );
    assert_eq!(inventory.pieces().len(), 6);
    for count in [1, 2, 3, 5, 7] {
        let shares: Vec<Vec<&Piece>> = (0..count)
            .map(|index| inventory.share(Shard::new(index, count).unwrap()).collect())
            .collect();
        let is_table = |piece: &&&Piece| matches!(piece, Piece::Table { .. });
        let tables = shares
            .iter()
            .map(|share| share.iter().filter(is_table).count());
        assert!(tables.clone().max().unwrap() - tables.clone().min().unwrap() <= 1);
        let mut plans = shares
            .iter()
            .zip(tables)
            .map(|(share, tables)| share.len() - tables);
        assert!(plans.next_back() == Some(3) && plans.all(|plans| plans == 0));
        let mut all: Vec<&Piece> = shares.into_iter().flatten().collect();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), 6, "{count}");
    }
    let tables = Inventory::new(&site, Recipe::new(&site, None, "program"));
    assert_eq!(tables.pieces().len(), 3);
}

/// A key changes with each input of the results. A table's key does not change with the plans.
#[test]
fn key_depends_on_all_inputs_of_the_results() {
    let plan = |from: &str, task: &str| Piece::Plan {
        from: from.into(),
        task: task.into(),
    };
    let one = recipe();
    let options = PlanOptions {
        survive_a_lost_tag: true,
        ..one.plans.clone().unwrap()
    };
    let other = Recipe {
        plans: Some(options),
        ..one.clone()
    };
    assert_eq!(table().key(&one), table().key(&other));
    let elsewhere = Recipe {
        site_digest: "00".into(),
        ..one.clone()
    };
    let newer = Recipe {
        tool_version: "9".into(),
        ..one.clone()
    };
    let rebuilt = Recipe {
        program: "another".into(),
        ..one.clone()
    };
    let mut keys = vec![
        table().key(&one),
        table().key(&elsewhere),
        table().key(&newer),
        table().key(&rebuilt),
        plan("ab", "c").key(&rebuilt),
        plan("ab", "c").key(&one),
        plan("a", "bc").key(&one),
        plan("ab", "c").key(&other),
    ];
    keys.sort();
    keys.dedup();
    assert_eq!(keys.len(), 8);
}

/// Only the exact bytes that were written are accepted: no bit may differ, and no byte may be missing.
#[test]
fn only_the_exact_bytes_of_a_piece_are_accepted() {
    let recipe = recipe();
    let key = table().key(&recipe);
    let files = vec![
        ("tables/dock.posegate".into(), vec![1, 2, 3]),
        ("proofs/dock.json".into(), b"{}\n".to_vec()),
    ];
    let bytes = encode(&table(), &recipe, &files).unwrap();
    let found = decode(&bytes, &table(), &key).unwrap();
    let found: Vec<_> = found
        .into_iter()
        .map(|(listed, bytes)| (listed.path, bytes.to_vec()))
        .collect();
    assert_eq!(found, files);
    for at in 0..bytes.len() {
        assert!(decode(&bytes[..at], &table(), &key).is_none(), "{at}");
        for bit in 0..8 {
            let mut flipped = bytes.clone();
            flipped[at] ^= 1 << bit;
            assert!(decode(&flipped, &table(), &key).is_none(), "{at} {bit}");
        }
    }
    let longer = [bytes.as_slice(), b"0"].concat();
    assert!(decode(&longer, &table(), &key).is_none());
    let other = Piece::Table {
        task: "see-t7".into(),
    };
    assert!(decode(&bytes, &other, &key).is_none());
    // A path that a piece does not own is refused; each path that it owns is there once.
    let outside = ("../dock.posegate".to_string(), vec![1]);
    let [one, other] = [files[0].clone(), files[1].clone()];
    for wrong in [
        vec![outside.clone()],
        vec![one.clone()],
        vec![other.clone()],
        vec![one.clone(), one.clone()],
        vec![other.clone(), one.clone()],
        vec![one.clone(), other.clone(), other.clone()],
        vec![one, other, outside],
        vec![],
    ] {
        let bytes = encode(&table(), &recipe, &wrong).unwrap();
        assert!(decode(&bytes, &table(), &key).is_none(), "{wrong:?}");
    }
}

/// A plan states if there is one. Bytes that are not a table are refused, for any proof file.
#[test]
fn content_of_a_finished_piece_is_read() {
    let recipe = recipe();
    let plan = Piece::Plan {
        from: "gate".into(),
        task: "dock".into(),
    };
    for (text, says) in [
        ("{\"success\":true}\n", Some(true)),
        ("{\"success\":false}\n", Some(false)),
        ("{\"success\":1}\n", None),
        ("{}\n", None),
        ("[true]\n", None),
        ("{\"success\":true", None),
        ("", None),
    ] {
        let files = vec![("plans/gate/dock.json".into(), text.into())];
        let bytes = encode(&plan, &recipe, &files).unwrap();
        let found = checked(&bytes, &plan, &recipe).map(|finished| match finished.content {
            Content::Plan(says) => says,
            Content::Table(..) => panic!("a plan"),
        });
        assert_eq!(found, says, "{text}");
    }
    let files = vec![
        ("tables/dock.posegate".into(), vec![1, 2, 3]),
        ("proofs/dock.json".into(), b"{}\n".to_vec()),
    ];
    let bytes = encode(&table(), &recipe, &files).unwrap();
    assert!(checked(&bytes, &table(), &recipe).is_none());
}
