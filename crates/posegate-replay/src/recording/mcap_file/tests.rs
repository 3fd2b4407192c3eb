use super::super::intake::MOST_NAMED;
use super::super::message::Kind;
use super::super::{ReaderDiagnostics, Role, Wanted};
use super::*;
use crate::mcap::{Head, Writer};
use posegate_testkit::counts;
use proptest::prelude::*;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use std::io::Write;

const CHUNKS: usize = 3;
/// The number of poses in a chunk.
const POSES: usize = 5;

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    let length = (body.len() as u64).to_le_bytes();
    [&[opcode][..], &length, body].concat()
}

fn compressed(compression: &str, records: &[u8]) -> Vec<u8> {
    match compression {
        "zstd" => compress_to_vec(records, CompressionLevel::Fastest),
        "lz4" => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            encoder.write_all(records).unwrap();
            encoder.finish().unwrap()
        }
        _ => records.to_vec(),
    }
}

/// Returns a `PoseStamped` in CDR: the stamp, an empty frame, seven floats.
fn pose(second: u32) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    for value in [second, 0, 1, 0] {
        bytes.extend(value.to_le_bytes());
    }
    for value in [1.0, -2.0, 0.0, 0.0, 0.0, 0.6, 0.8f64] {
        bytes.extend(value.to_le_bytes());
    }
    bytes
}

/// Returns a bag of [`CHUNKS`] chunks, and the position of each one's body.
fn bag(compression: &str) -> (Vec<u8>, Vec<core::ops::Range<usize>>) {
    let (mut bytes, mut places) = (MAGIC.to_vec(), Vec::new());
    for chunk in 0..CHUNKS {
        // The records of the only chunk of another file.
        let mut writer = Writer::new(Vec::new(), "").unwrap();
        let name = Kind::Pose.name();
        let schema = writer.add_schema(name, "ros2msg", b"").unwrap();
        let channel = writer.add_channel(schema, "/pose", "cdr").unwrap();
        for k in 0..POSES {
            let second = (chunk * POSES + k) as u32;
            let head = Head {
                channel,
                sequence: second,
                time_ns: u64::from(second) * 1_000_000_000,
            };
            writer.write(head, &pose(second)).unwrap();
        }
        let file = writer.finish().unwrap();
        let mut records = &file[MAGIC.len()..];
        let plain = loop {
            let (opcode, body, rest) = chunk::next(records).unwrap();
            records = rest;
            if opcode == op::CHUNK {
                break body;
            }
        };
        let data = compressed(compression, &plain[40..]);
        let mut body = plain[..28].to_vec();
        body.extend((compression.len() as u32).to_le_bytes());
        body.extend(compression.as_bytes());
        body.extend((data.len() as u64).to_le_bytes());
        body.extend(data);
        let start = bytes.len() + HEAD;
        bytes.extend(record(op::CHUNK, &body));
        places.push(start..bytes.len());
    }
    bytes.extend(record(op::FOOTER, &[0; FOOTER as usize]));
    bytes.extend(MAGIC);
    (bytes, places)
}

/// Reads to the end and returns the seconds of the poses. Memory is bounded by the existing bytes, or by a chunk's
/// stated limit.
fn read(bytes: &[u8]) -> (Vec<f64>, ReaderDiagnostics) {
    let wanted = Wanted {
        topic: "/pose".into(),
        role: Role::Estimates(0),
    };
    let (mut bag, mut intake) = (McapFile::new(bytes, "a.mcap"), Intake::new(&[wanted]));
    let mut seconds = Vec::new();
    while let Some(item) = bag.next(&mut intake).unwrap() {
        let Item::Estimate(sample) = item else {
            panic!("an estimate");
        };
        seconds.push(sample.t_s);
        assert!(seconds.len() <= bytes.len() * 1000);
    }
    // `read_to_end` doubles its buffer.
    assert!(bag.body.capacity() <= 2 * bytes.len() + 64);
    assert!(bag.records.capacity() <= LARGEST);
    assert!(intake.kept() <= MOST_NAMED);
    (seconds, intake.diagnostics)
}

const COMPRESSIONS: [&str; 3] = ["", "zstd", "lz4"];

#[test]
fn undamaged_bags_are_read_completely() {
    for compression in COMPRESSIONS {
        let (seconds, diagnostics) = read(&bag(compression).0);
        let all: Vec<f64> = (0..CHUNKS * POSES).map(|k| k as f64).collect();
        assert_eq!(seconds, all, "{compression:?}");
        assert_eq!((diagnostics.bad_chunks, diagnostics.damage), (0, None));
    }
}

/// Changes every byte of a chunk in turn: the bad chunk is left out completely and counted, the others are read.
#[test]
fn chunk_with_a_wrong_byte_is_left_out_completely() {
    for compression in COMPRESSIONS {
        let (bytes, places) = bag(compression);
        let mut bad = 0;
        for at in places[1].clone() {
            for change in [1, 0x80, 0xff] {
                let mut bytes = bytes.clone();
                bytes[at] ^= change;
                let (seconds, diagnostics) = read(&bytes);
                bad += diagnostics.bad_chunks;
                let without = |k: &usize| diagnostics.bad_chunks == 0 || k / POSES != 1;
                let expected = (0..CHUNKS * POSES).filter(without).map(|k| k as f64);
                let expected: Vec<f64> = expected.collect();
                assert_eq!(seconds, expected, "{compression:?} {at} {change:x}");
                assert_eq!(diagnostics.damage.is_some(), diagnostics.bad_chunks > 0);
            }
        }
        // Every byte except the times in the chunk's header, which are not used.
        let least = 3 * (places[1].len() - 16) as u64;
        assert!(bad >= least * 9 / 10, "{compression:?}: {bad} of {least}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(counts::rounds(2_000, 7)))]

    #[test]
    fn random_bytes_are_read_to_their_end(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        read(&bytes);
        read(&[&MAGIC[..], &bytes].concat());
    }

    /// Records with a valid head and a random body.
    #[test]
    fn random_records_are_read_to_their_end(
        records in prop::collection::vec((0u8..=0x10, prop::collection::vec(any::<u8>(), 0..80)), 0..12),
    ) {
        let bodies = records.iter().map(|(opcode, body)| record(*opcode, body));
        let bytes: Vec<u8> = bodies.flatten().collect();
        read(&[&MAGIC[..], &bytes].concat());
    }

    #[test]
    fn changed_bags_are_read_to_their_end(
        compression in 0usize..3,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let (mut bytes, _) = bag(COMPRESSIONS[compression]);
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let (seconds, _) = read(&bytes);
        prop_assert!(seconds.len() <= CHUNKS * POSES);
    }
}
