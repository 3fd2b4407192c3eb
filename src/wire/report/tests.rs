use super::*;
use crate::wire::{Receiver, Request, encode};
use proptest::prelude::*;
use std::vec::Vec as Bytes;

fn report(bits: [u64; 17], heading: u8, spread: u8) -> Report {
    let v = bits.map(f64::from_bits);
    Report {
        source: bits[15] as u8,
        frame: FrameId::from_digest(bits[16]),
        sequence: (bits[15] >> 32) as u32,
        stamp_ms: (bits[15] >> 8) as u32,
        belief: PoseEstimate {
            x_m: v[0],
            y_m: v[1],
            heading: match heading {
                0 => Heading::Radians(v[2]),
                1 => Heading::RollPitchYaw([v[2], v[3], v[4]]),
                _ => Heading::Quaternion([v[2], v[3], v[4], v[5]]),
            },
            spread: match spread {
                0 => None,
                1 => Some(Uncertainty::Gaussian([
                    [v[6], v[7], v[8]],
                    [v[9], v[10], v[11]],
                    [v[12], v[13], v[14]],
                ])),
                _ => Some(Uncertainty::Bounded {
                    translation_m: v[6],
                    yaw_rad: v[7],
                }),
            },
        },
    }
}

fn received(bytes: &[u8]) -> Bytes<Result<crate::wire::Frame, WireError>> {
    let mut receiver = Receiver::new();
    bytes
        .iter()
        .filter_map(|byte| receiver.push(*byte))
        .collect()
}

proptest! {
    #[test]
    fn reports_round_trip_bit_for_bit(
        bits: [u64; 17], heading in 0u8..3, spread in 0u8..3,
    ) {
        let sent = report(bits, heading, spread);
        let got = received(&encode(&report_body(&sent)));
        prop_assert_eq!(got.len(), 1);
        let got = report_from_body(got[0].as_ref().unwrap()).unwrap();
        prop_assert_eq!(report_body(&got), report_body(&sent));
        // The body contains every field: reports that differ in a field differ in the body.
        prop_assert_eq!((got.source, got.frame, got.sequence, got.stamp_ms),
            (sent.source, sent.frame, sent.sequence, sent.stamp_ms));
    }

    #[test]
    fn decoded_report_re_encodes_to_its_body(body in proptest::collection::vec(any::<u8>(), 0..160)) {
        if let Ok(report) = report_from_body(&body) {
            prop_assert_eq!(&report_body(&report)[..], &body[..]);
        }
    }
}

/// Every flipped bit of every kind of report, and every truncation.
#[test]
fn damaged_frame_is_never_a_report() {
    let bits = core::array::from_fn(|i| (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let is_report = |bytes: &[u8]| {
        received(bytes)
            .iter()
            .flatten()
            .any(|body| report_from_body(body).is_ok())
    };
    let mut tried = 0;
    for kinds in 0..9 {
        let frame = encode(&report_body(&report(bits, kinds % 3, kinds / 3)));
        assert!(is_report(&frame));
        for bit in 0..frame.len() * 8 {
            let mut damaged = frame.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(!is_report(&damaged), "{kinds} {bit}");
            tried += 1;
        }
        for length in 0..frame.len() - 1 {
            let cut = [&frame[..length], &[0]].concat();
            assert!(!is_report(&cut), "{kinds} {length}");
        }
    }
    assert!(tried > 6000, "{tried}");
}

/// Checks the table of the module's documentation, byte by byte.
#[test]
fn a_report_is_as_documented() {
    let sent = Report {
        source: 3,
        frame: FrameId::of("map"),
        sequence: 0x0403_0201,
        stamp_ms: 0x0807_0605,
        belief: PoseEstimate {
            x_m: 1.0,
            y_m: -2.0,
            heading: Heading::Radians(0.5),
            spread: Some(Uncertainty::Bounded {
                translation_m: 0.25,
                yaw_rad: 4.0,
            }),
        },
    };
    let mut expected = Bytes::from([2, 1, 3, 1, 2, 1, 2, 3, 4, 5, 6, 7, 8]);
    expected.extend(FrameId::of("map").digest().to_le_bytes());
    for value in [1.0f64, -2.0, 0.5, 0.25, 4.0] {
        expected.extend(value.to_bits().to_le_bytes());
    }
    assert_eq!(report_body(&sent)[..], expected[..]);
    let body = |heading, spread| report_body(&report([0; 17], heading, spread));
    for (heading, spread, kinds, length) in [
        (0, 0, [1, 0], 45),
        (1, 1, [2, 1], 133),
        (2, 1, [3, 1], LONGEST_BODY),
        (2, 2, [3, 2], 85),
    ] {
        assert_eq!(body(heading, spread)[3..5], kinds);
        assert_eq!(body(heading, spread).len(), length);
    }
}

/// Neither version is taken for the other, and no other type is taken for a report.
#[test]
fn other_versions_and_types_are_refused() {
    let body = report_body(&report([0; 17], 0, 1));
    assert!(Request::from_body(&body).is_err());
    for (at, wrong) in [
        (0, 0),
        (0, 1),
        (0, 3),
        (1, 0),
        (1, 2),
        (3, 0),
        (3, 4),
        (4, 3),
    ] {
        let mut other = body.clone();
        other[at] = wrong;
        assert_eq!(report_from_body(&other), Err(WireError::Content), "{at}");
    }
}
