//! Machines of every word size and byte order read the committed tables and decide as
//! `tests/data/vectors.bin` states. `./ci.sh miri` runs this test on machines of 32 bits and of the
//! other byte order; the interpreter is slow, so it checks only some of the decisions.

#[path = "../crates/posegate-testkit/src/replay.rs"]
mod replay;

use posegate::recordings::Evaluator;
use posegate::table::checksum;
use replay::{HEADER_LENGTH, MAXIMUM_AGE_MS, Outcome, REPLY_LENGTH, WITH_REPLY};

static VECTORS: &[u8] = include_bytes!("data/vectors.bin");

/// The tables in the order of their numbers in the requests.
static TABLES: [&[u8]; 8] = [
    include_bytes!("../examples/tables/dock.posegate"),
    include_bytes!("../examples/tables/see-t7.posegate"),
    include_bytes!("../examples/tables/see-t7-grid.posegate"),
    include_bytes!("data/whole-circle.posegate"),
    include_bytes!("data/turning.posegate"),
    include_bytes!("data/over-180.posegate"),
    include_bytes!("data/over-180-grid.posegate"),
    include_bytes!("data/corner.posegate"),
];

/// One decision per this number is checked.
const STEP: usize = if cfg!(miri) { 311 } else { 1 };

#[test]
fn decisions_are_the_same() {
    let gates = TABLES.map(|table| Evaluator::new(table, MAXIMUM_AGE_MS).expect("a maximum age"));
    assert!(gates.iter().all(|gate| gate.table().is_ok()));
    let records: Vec<_> = records(VECTORS).into_iter().step_by(STEP).collect();
    let count_of = |kind: fn(u8) -> bool| records.iter().filter(|record| kind(record[0])).count();
    let (permits, replies) = (
        count_of(|code| code & !WITH_REPLY == 0),
        count_of(|code| code & WITH_REPLY != 0),
    );
    assert!(records.len() > 30 && permits > 5 && permits < records.len() - 5 && replies > 0);
    let expected = Outcome {
        count: records.len() as u32,
        mismatches: 0,
        first_mismatch: None,
    };
    assert_eq!(replay::replay(&file(&records), &gates), Ok(expected));
}

/// Returns the bytes of each record. The checksum over a megabyte is not checked here, because it takes too long.
fn records(file: &[u8]) -> Vec<&[u8]> {
    let mut rest = &file[HEADER_LENGTH..file.len() - 4];
    let mut records = Vec::new();
    while let [code, length, ..] = rest {
        let reply = if code & WITH_REPLY == 0 {
            0
        } else {
            REPLY_LENGTH
        };
        let (record, after) = rest.split_at(2 + usize::from(*length) + reply);
        records.push(record);
        rest = after;
    }
    records
}

/// Returns a vector file of some records.
fn file(records: &[&[u8]]) -> Vec<u8> {
    let mut file = replay::MAGIC.to_vec();
    file.extend((records.len() as u32).to_le_bytes());
    file.extend(records.concat());
    file.extend(checksum(&file).to_le_bytes());
    file
}
