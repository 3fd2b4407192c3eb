//! A build without some parts of the gate (features `cells`, `headings`, `unions`, `sight`) denies more and never less.
//!
//! In every build: the decisions of the vector file, which were made with all parts, are those of this build, except that
//! denials may replace permits. `./ci.sh parts` builds the sets of features.

#[path = "../crates/posegate-testkit/src/replay.rs"]
mod replay;

use posegate::gate::{Reason, Verdict};
use posegate::recordings::Evaluator;
use posegate::table::{Parts, Table, TableError};
use posegate::wire::Reply;
use replay::{MAXIMUM_AGE_MS, Records, answer, reply};
use std::path::Path;

/// The tables in the order of `examples/vectors.rs`.
const TABLES: [&str; 8] = [
    "examples/tables/dock.posegate",
    "examples/tables/see-t7.posegate",
    "examples/tables/see-t7-grid.posegate",
    "tests/data/whole-circle.posegate",
    "tests/data/turning.posegate",
    "tests/data/over-180.posegate",
    "tests/data/over-180-grid.posegate",
    "tests/data/corner.posegate",
];
/// The table of cells alone.
const CELLS_ALONE: usize = 2;
const HAS_ALL: bool = cfg!(all(
    feature = "cells",
    feature = "headings",
    feature = "unions"
));

fn read(path: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn permitted(verdict: Verdict) -> Option<u32> {
    match verdict {
        Verdict::Permit { margin } => Some(margin.q16()),
        Verdict::Deny { .. } => None,
    }
}

#[test]
fn the_self_test_passes_in_every_build() {
    assert_eq!(posegate::gate::self_test(), Ok(()));
}

#[test]
fn fewer_parts_never_permit_more() {
    let gates = TABLES.map(|path| {
        Evaluator::new(read(path).leak(), MAXIMUM_AGE_MS).expect("a valid maximum age")
    });
    let file = read("tests/data/vectors.bin");
    let (mut permits, mut kept, mut lost_on) = (0_u32, 0_u32, [0_u32; TABLES.len()]);
    for record in Records::of(&file).expect("a vector file") {
        let record = record.expect("a record");
        let table = usize::from(record.request.table);
        let here = answer(&record.request, &gates).expect("a table of the list");
        if record.answer == 0 {
            permits += 1;
            kept += u32::from(here == 0);
            lost_on[table] += u32::from(here != 0);
        } else {
            assert_ne!(here, 0, "{:?}", record.request);
        }
        let Some(with_all) = record.reply else {
            continue;
        };
        let with_all = Reply::from_body(with_all).expect("a reply").verdict;
        let here = reply(&record.request, &gates).verdict;
        if let (Ok(with_all), Ok(here)) = (with_all, here)
            && let Some(margin) = permitted(here)
        {
            let most = permitted(with_all).expect("a permit with all parts");
            assert!(margin <= most, "{:?}", record.request);
        }
    }
    println!("{kept} of {permits} permits; lost by table {lost_on:?}");
    assert!(permits > 4_000);
    if HAS_ALL {
        assert_eq!(kept, permits);
    }
    // Facets that do not turn decide the dock in every build, and most of the tag's sets.
    assert_eq!(lost_on[0], 0);
    assert!(kept * 4 > permits, "{kept} of {permits}");
    if cfg!(not(feature = "cells")) {
        assert!(lost_on[CELLS_ALONE] > 500, "{lost_on:?}");
    }
}

#[test]
fn cells_only_table_is_refused_without_cells() {
    let bytes = read(TABLES[CELLS_ALONE]);
    let refused = Table::parse(&bytes).err();
    let expected = cfg!(not(feature = "cells")).then_some(TableError::NoCells);
    assert_eq!(refused, expected);
    assert_eq!(
        refused.map(Reason::from),
        expected.map(|_| Reason::PartMissing)
    );
}

/// A build names the parts that a table needs, also those that it does not contain.
#[test]
fn parts_of_a_table_do_not_depend_on_the_build() {
    let needed = |path| Table::parse(&read(path)).map(|table| table.parts());
    assert_eq!(needed(TABLES[0]), Ok(Parts::default()));
    for (path, part) in [
        (TABLES[1], Parts::SIGHT),
        ("tests/data/corner.posegate", Parts::UNIONS),
        ("tests/data/turning.posegate", Parts::HEADINGS),
    ] {
        let parts = needed(path).expect("a table with facets");
        assert!(parts.contains(part), "{path}: {parts:?}");
        assert!(!parts.contains(Parts::CELLS), "{path}: {parts:?}");
    }
    assert_eq!(
        needed(TABLES[CELLS_ALONE])
            .ok()
            .map(|parts| parts.contains(Parts::CELLS)),
        cfg!(feature = "cells").then_some(true)
    );
    assert_eq!(
        Parts::ALL.map(|part| Parts::BUILT.contains(part)),
        [
            cfg!(feature = "cells"),
            cfg!(any(feature = "headings", feature = "unions")),
            cfg!(feature = "sight"),
            cfg!(feature = "unions"),
        ]
    );
}

#[test]
fn sight_record_is_read_only_with_feature_sight() {
    let bytes = read("examples/tables/see-t7.posegate");
    let table = Table::parse(&bytes).expect("a table with facets");
    assert_eq!(table.sight_record().is_some(), cfg!(feature = "sight"));
}
