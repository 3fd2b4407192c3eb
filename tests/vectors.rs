//! The vector file is what its generator makes, holds what it should, and this machine decides as it
//! says. `./ci.sh vectors` asks the emulated cores.
//!
//! `POSEGATE_BLESS=1 cargo test --features std --test vectors` writes the file and its tables anew.
#![cfg(feature = "std")]

#[path = "support/replay.rs"]
mod replay;
#[path = "support/vectors.rs"]
mod vectors;
#[path = "support/wrapped.rs"]
mod wrapped;

use posegate::gate::{Gate, Reason, Verdict};
use posegate::table::checksum;
use posegate::wire::Reply;
use replay::{MAXIMUM_AGE_MS, Outcome, Record, Records, replay};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

const VECTORS: &str = "tests/data/vectors.bin";
const WHOLE_CIRCLE: &str = "tests/data/whole-circle.posegate";
const OVER_180: &str = "tests/data/over-180.posegate";
/// In the order of `examples/vectors.rs`.
const TABLES: [&str; 4] = [
    "examples/tables/dock.posegate",
    "examples/tables/see-t7.posegate",
    WHOLE_CIRCLE,
    OVER_180,
];

fn at_root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn read(path: &str) -> Vec<u8> {
    std::fs::read(at_root(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The committed bytes, which must be the generator's; rewritten where that is asked for.
fn committed(path: &str, made: &[u8]) -> Vec<u8> {
    if std::env::var_os("POSEGATE_BLESS").is_some_and(|value| value == "1") {
        std::fs::write(at_root(path), made).unwrap_or_else(|error| panic!("{path}: {error}"));
    }
    let kept = read(path);
    assert!(
        kept == made,
        "{path} differs: POSEGATE_BLESS=1 writes it anew"
    );
    kept
}

static GATES: LazyLock<[Gate<'static>; 4]> = LazyLock::new(|| {
    committed(WHOLE_CIRCLE, &wrapped::whole_circle());
    committed(OVER_180, &wrapped::over_180());
    TABLES.map(|path| {
        let gate = Gate::new(read(path).leak(), MAXIMUM_AGE_MS).expect("a maximum age");
        gate.table().unwrap_or_else(|e| panic!("{path}: {e:?}"));
        gate
    })
});

static FILE: LazyLock<Vec<u8>> =
    LazyLock::new(|| committed(VECTORS, &vectors::file(GATES.as_slice())));

fn records() -> Vec<Record<'static>> {
    let records = Records::of(&FILE).expect("a vector file");
    records.map(|record| record.expect("a record")).collect()
}

#[test]
fn this_machine_decides_as_the_file_says() {
    assert!(FILE.len() < 1_000_000, "{} bytes", FILE.len());
    let expected = Outcome {
        count: vectors::COUNT,
        mismatches: 0,
        first_mismatch: None,
    };
    assert_eq!(replay(&FILE, GATES.as_slice()), Ok(expected));
    assert!(expected.is_good());
}

/// Every reason that a request can give, on every table; permits neither rare nor the rule.
#[test]
fn the_file_holds_every_answer() {
    let mut answers: [BTreeMap<u8, usize>; 4] = Default::default();
    for record in records() {
        let table = usize::from(record.request.table);
        *answers[table].entry(record.answer).or_default() += 1;
    }
    for (path, answers) in TABLES.iter().zip(&answers) {
        let count = |code: u8| answers.get(&code).copied().unwrap_or(0);
        let all: usize = answers.values().sum();
        println!("{path}: {all} decisions, {answers:?}");
        let share = count(0) as f64 / all as f64;
        assert!((0.3..=0.6).contains(&share), "{path}: {share} permits");
        for reason in Reason::ALL {
            // Whether a table is valid is no matter of the request.
            let expected = reason != Reason::TableInvalid;
            assert_eq!(count(reason.code()) >= 5, expected, "{path}: {reason}");
        }
    }
}

/// Replies of every kind, and margins a hair above and below 1.
#[test]
fn the_file_holds_replies_and_close_calls() {
    let (mut permits, mut denials, mut close) = (0, 0, [0; 2]);
    for record in records() {
        let Some(reply) = record.reply else { continue };
        let reply = Reply::from_body(reply).expect("a reply");
        let (margin, side) = match reply.verdict.expect("a verdict") {
            Verdict::Permit { margin } => {
                permits += 1;
                (Some(margin), 0)
            }
            Verdict::Deny {
                margin, worst_pose, ..
            } => {
                assert_eq!(margin.is_some(), worst_pose.is_some());
                denials += usize::from(margin.is_some());
                (margin, 1)
            }
        };
        let hair = margin.map(|margin| (f64::from(margin.q16()) / 65_536.0 - 1.0).abs());
        close[side] += usize::from(hair.is_some_and(|hair| hair <= 2e-3));
    }
    println!("{permits} permits and {denials} denials with a margin; close {close:?}");
    assert!(permits >= 500 && denials >= 500, "{permits} {denials}");
    assert!(close.iter().all(|count| *count >= 100), "{close:?}");
}

/// One wrong answer, one wrong bit of a margin, one record less: each is found.
#[test]
fn a_wrong_file_is_found() {
    let repaired = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut file = FILE.clone();
        file.truncate(file.len() - 4);
        change(&mut file);
        let crc = checksum(&file);
        file.extend(crc.to_le_bytes());
        replay(&file, GATES.as_slice())
    };
    let first = |index| {
        Ok(Outcome {
            count: vectors::COUNT,
            mismatches: 1,
            first_mismatch: Some(index),
        })
    };
    let answer = replay::HEADER_LENGTH;
    assert_eq!(repaired(&|file| file[answer] ^= 1), first(0));
    // The first record has a reply, the margin of which is at bytes 7 to 10.
    let margin = answer + 2 + usize::from(FILE[answer + 1]) + 7;
    assert_eq!(repaired(&|file| file[margin] ^= 1), first(0));
    assert!(repaired(&|file| file.truncate(file.len() - 1)).is_err());
    assert!(repaired(&|file| file.push(0)).is_err());
    let mut damaged = FILE.clone();
    damaged[500_000] ^= 1;
    assert!(replay(&damaged, GATES.as_slice()).is_err());
}
