//! The vector file equals its generator's output, has the required content, and the host decides as the file
//! states. `./ci.sh vectors` tests the emulated cores.
//!
//! `POSEGATE_BLESS=1 cargo test -p posegate --features std --test vectors` rewrites the file and its tables.
#![cfg(feature = "std")]

#[path = "../crates/posegate-testkit/src/replay.rs"]
mod replay;
#[path = "../crates/posegate-testkit/src/vectors.rs"]
#[allow(dead_code)] // This target uses a part.
mod vectors;
#[path = "../crates/posegate-testkit/src/wrapped.rs"]
#[allow(dead_code)] // This target uses a part.
mod wrapped;

use core::f64::consts::PI;
use posegate::gate::{Reason, Verdict};
use posegate::recordings::Evaluator;
use posegate::table::{Table, checksum};
use posegate::wire::{Reply, Request, Uncertainty};
use replay::{MAXIMUM_AGE_MS, Outcome, Record, Records, answer, replay};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

const VECTORS: &str = "tests/data/vectors.bin";
const WHOLE_CIRCLE: &str = "tests/data/whole-circle.posegate";
const TURNING: &str = "tests/data/turning.posegate";
const OVER_180: &str = "tests/data/over-180.posegate";
const OVER_180_GRID: &str = "tests/data/over-180-grid.posegate";
const CORNER: &str = "tests/data/corner.posegate";
/// The tables in the order of `examples/vectors.rs`.
const TABLES: [&str; 8] = [
    "examples/tables/dock.posegate",
    "examples/tables/see-t7.posegate",
    "examples/tables/see-t7-grid.posegate",
    WHOLE_CIRCLE,
    TURNING,
    OVER_180,
    OVER_180_GRID,
    CORNER,
];
type Maker = fn() -> Vec<u8>;
/// The tables that are made here.
const MADE: [(&str, Maker); 5] = [
    (WHOLE_CIRCLE, wrapped::whole_circle),
    (TURNING, wrapped::turning),
    (OVER_180, wrapped::over_180),
    (OVER_180_GRID, wrapped::over_180_grid),
    (CORNER, wrapped::corner),
];
const LAYOUTS: [&str; 2] = ["facets", "grid"];

fn at_root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn read(path: &str) -> Vec<u8> {
    std::fs::read(at_root(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Returns the committed bytes. With `POSEGATE_BLESS` they are first replaced by the generator's.
fn committed(path: &str, made: impl FnOnce() -> Vec<u8>) -> Vec<u8> {
    if std::env::var_os("POSEGATE_BLESS").is_some_and(|value| value == "1") {
        std::fs::write(at_root(path), made()).unwrap_or_else(|error| panic!("{path}: {error}"));
    }
    read(path)
}

static GATES: LazyLock<[Evaluator<'static>; 8]> = LazyLock::new(|| {
    for (path, made) in MADE {
        committed(path, made);
    }
    TABLES.map(|path| {
        let gate = Evaluator::new(read(path).leak(), MAXIMUM_AGE_MS).expect("a maximum age");
        gate.table().unwrap_or_else(|e| panic!("{path}: {e:?}"));
        gate
    })
});

static FILE: LazyLock<Vec<u8>> =
    LazyLock::new(|| committed(VECTORS, || vectors::file(GATES.as_slice())));

fn records() -> Vec<Record<'static>> {
    let records = Records::of(&FILE).expect("a vector file");
    records.map(|record| record.expect("a record")).collect()
}

#[test]
fn files_equal_generator_output() {
    let is_made = |path, kept: &[u8], made: &[u8]| {
        assert!(kept == made, "{path} differs: POSEGATE_BLESS=1 rewrites it");
    };
    is_made(VECTORS, &FILE, &vectors::file(GATES.as_slice()));
    for (path, made) in MADE {
        is_made(path, &read(path), &made());
    }
}

#[test]
fn host_decides_as_the_file_states() {
    assert!(FILE.len() < 1_000_000, "{} bytes", FILE.len());
    let expected = Outcome {
        count: vectors::COUNT,
        mismatches: 0,
        first_mismatch: None,
    };
    assert_eq!(replay(&FILE, GATES.as_slice()), Ok(expected));
    assert!(expected.is_good());
}

fn table(record: &Record<'_>) -> &'static Table<'static> {
    let gate = &GATES[usize::from(record.request.table)];
    gate.table().expect("a table")
}

/// Returns the index in [`LAYOUTS`] of the layout of a record's table.
fn layout(record: &Record<'_>) -> usize {
    let table = table(record);
    usize::from(table.grid().is_some())
}

/// Returns the number of records of a layout and a kind.
fn count_of(layout_of: usize, kind: impl Fn(&Record<'_>) -> bool) -> usize {
    let records = records().into_iter();
    records
        .filter(|record| layout(record) == layout_of && kind(record))
        .count()
}

/// Every reason that a request can cause occurs on every table. Permits are neither rare nor most of the answers.
#[test]
fn file_contains_every_answer() {
    let mut answers: [BTreeMap<u8, usize>; 8] = Default::default();
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
            // The other reasons are about the table, about messages of other systems, and about a gate's
            // memory.
            let expected = reason <= Reason::Stale;
            assert_eq!(count(reason.code()) >= 5, expected, "{path}: {reason}");
        }
    }
    for (index, (name, fewest)) in LAYOUTS.iter().zip([6300, 4200]).enumerate() {
        let [permits, denials] =
            [true, false].map(|permit| count_of(index, |record| (record.answer == 0) == permit));
        println!("{name}: {permits} permits, {denials} denials");
        assert!(permits + denials >= fewest, "{name}: {permits} {denials}");
    }
}

/// There are replies of every kind, and margins slightly above and below 1, on every layout.
#[test]
fn file_contains_every_kind_of_reply() {
    // Permits, denials, and those of each kind close to the border.
    let mut all = [0; 4];
    for (index, name) in LAYOUTS.iter().enumerate() {
        let (mut permits, mut denials, mut close) = (0, 0, [0; 2]);
        for record in records() {
            let Some(reply) = record.reply.filter(|_| layout(&record) == index) else {
                continue;
            };
            let reply = Reply::from_body(reply).expect("a reply");
            let (margin, side) = match reply.verdict.expect("a verdict") {
                Verdict::Permit { margin } => {
                    permits += 1;
                    (Some(margin), 0)
                }
                Verdict::Deny {
                    margin, worst_pose, ..
                } => {
                    // A set that is not proven inside may have no pose that is outside.
                    assert!(margin.is_some() || worst_pose.is_none());
                    denials += usize::from(margin.is_some());
                    (margin, 1)
                }
            };
            let hair = margin.map(|margin| (f64::from(margin.q16()) / 65_536.0 - 1.0).abs());
            close[side] += usize::from(hair.is_some_and(|hair| hair <= 2e-3));
        }
        println!("{name}: {permits} permits and {denials} denials with a margin; close {close:?}");
        assert!(permits >= 100 && denials >= 100, "{permits} {denials}");
        assert!(close.iter().all(|count| *count >= 25), "{close:?}");
        all = [
            all[0] + permits,
            all[1] + denials,
            all[2] + close[0],
            all[3] + close[1],
        ];
    }
    let least = [500, 500, 100, 100];
    assert!(all.iter().zip(least).all(|(a, b)| *a >= b), "{all:?}");
}

/// There are permitted sets that would be denied if they were 1 % larger, and the reverse: ellipsoids and
/// bounded sets, on every layout.
#[test]
fn file_contains_sets_near_the_border() {
    for (index, name) in LAYOUTS.iter().enumerate() {
        for gaussian in [true, false] {
            let [permits, denials] = [1.01, 0.99].map(|size| {
                count_of(index, |record| {
                    let request = &record.request;
                    matches!(request.spread, Uncertainty::Gaussian(_)) == gaussian
                        && (record.answer == 0) == (size > 1.0)
                        && turns(
                            record.answer,
                            answer(&times(request, size), GATES.as_slice()),
                        )
                })
            });
            let kind = if gaussian { "ellipsoids" } else { "bounded" };
            println!("{name}, {kind}: {permits} permits and {denials} denials within 1 %");
            assert!(
                permits >= 100 && denials >= 100,
                "{name}: {permits} {denials}"
            );
        }
    }
}

/// Returns `true` if one of two answers is a permit and the other is `not_contained`.
fn turns(one: u8, other: Option<u8>) -> bool {
    let not_contained = Reason::NotContained.code();
    other.is_some_and(|other| [(0, not_contained), (not_contained, 0)].contains(&(one, other)))
}

/// Returns the request with a set of another size.
fn times(request: &Request, size: f64) -> Request {
    let spread = match request.spread {
        Uncertainty::Gaussian(covariance) => {
            Uncertainty::Gaussian(covariance.map(|row| row.map(|v| v * size * size)))
        }
        Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        } => Uncertainty::Bounded {
            translation_m: translation_m * size,
            yaw_rad: yaw_rad * size,
        },
    };
    Request { spread, ..*request }
}

/// There are headings on both sides of +-180 degrees and of many turns, places far out, and sets below every unit.
#[test]
fn file_contains_extreme_numbers() {
    // The largest yaw offset, and whether the place or a variance is extreme.
    let turn = |request: &Request| match request.spread {
        Uncertainty::Gaussian([.., [.., tt]]) => {
            (tt * f64::from(request.radius_squared.q16()) / 65_536.0).sqrt()
        }
        Uncertainty::Bounded { yaw_rad, .. } => yaw_rad,
    };
    let wraps = |request: &Request| {
        let yaw = request.estimate.yaw_rad.abs();
        yaw <= PI && yaw + turn(request) > PI
    };
    let is_tiny = |request: &Request| match request.spread {
        Uncertainty::Gaussian([[xx, ..], ..]) => xx > 0.0 && xx < 1e-12,
        Uncertainty::Bounded { translation_m, .. } => translation_m > 0.0 && translation_m < 1e-6,
    };
    for (index, name) in LAYOUTS.iter().enumerate() {
        for permit in [true, false] {
            let count = |kind: &dyn Fn(&Request) -> bool| {
                let is = |record: &Record<'_>| (record.answer == 0) == permit;
                count_of(index, |record| is(record) && kind(&record.request))
            };
            let counts = [
                count(&wraps),
                count(&|request| request.estimate.yaw_rad.abs() > 16_000.0),
                count(&|request| request.estimate.x_m.abs() > 800.0),
                count(&is_tiny),
            ];
            println!("{name}, permit {permit}: {counts:?} wrap, wound up, far, tiny");
            assert!(counts.iter().all(|count| *count >= 5), "{name}: {counts:?}");
        }
    }
}

/// A wrong answer, a wrong bit of a margin and a missing record are all detected.
#[test]
fn corrupted_file_is_detected() {
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
