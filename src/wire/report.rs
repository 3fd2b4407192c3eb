//! The message that carries a report to a gate (version 2).

use super::{BOUNDED, Body, GAUSSIAN, LONGEST_BODY, Reader, VERSION_2, WireError};
use crate::report::{FrameId, Heading, PoseEstimate, Report};
use crate::set::Uncertainty;
use heapless::Vec;

/// Type of the message.
pub(super) const REPORT: u8 = 1;

const YAW: u8 = 1;
const ROLL_PITCH_YAW: u8 = 2;
const QUATERNION: u8 = 3;
const UNKNOWN: u8 = 0;

/// Returns the body of the message that carries a report: every field, bit for bit.
#[must_use]
pub fn report_body(report: &Report) -> Vec<u8, LONGEST_BODY> {
    body_of(REPORT, report)
}

/// Returns the body of a message of a type that carries a report.
pub(super) fn body_of(message: u8, report: &Report) -> Vec<u8, LONGEST_BODY> {
    let PoseEstimate {
        x_m,
        y_m,
        heading,
        spread,
    } = report.belief;
    let heading_kind = match heading {
        Heading::Radians(_) => YAW,
        Heading::RollPitchYaw(_) => ROLL_PITCH_YAW,
        Heading::Quaternion(_) => QUATERNION,
    };
    let spread_kind = match spread {
        None => UNKNOWN,
        Some(Uncertainty::Gaussian(_)) => GAUSSIAN,
        Some(Uncertainty::Bounded { .. }) => BOUNDED,
    };
    let mut body = Body(Vec::new());
    body.put([VERSION_2, message, report.source, heading_kind, spread_kind]);
    body.put(report.sequence.to_le_bytes());
    body.put(report.stamp_ms.to_le_bytes());
    body.put(report.frame.digest().to_le_bytes());
    body.floats(&[x_m, y_m]);
    match heading {
        Heading::Radians(yaw) => body.floats(&[yaw]),
        Heading::RollPitchYaw(angles) => body.floats(&angles),
        Heading::Quaternion(entries) => body.floats(&entries),
    }
    match spread {
        None => {}
        Some(Uncertainty::Gaussian(covariance)) => body.floats(covariance.as_flattened()),
        Some(Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        }) => body.floats(&[translation_m, yaw_rad]),
    }
    body.0
}

/// Parses a report from the body of a message. The gate checks its numbers, not this function.
///
/// # Errors
/// [`WireError::Content`] if the body is not a report.
pub fn report_from_body(body: &[u8]) -> Result<Report, WireError> {
    read(body)
        .filter(|(message, _)| *message == REPORT)
        .map(|(_, report)| report)
        .ok_or(WireError::Content)
}

/// Parses the type of a message, and the report that it carries.
pub(super) fn read(body: &[u8]) -> Option<(u8, Report)> {
    let mut rest = Reader(body);
    let [version, message, source, heading, spread] = rest.take()?;
    if version != VERSION_2 {
        return None;
    }
    let sequence = u32::from_le_bytes(rest.take()?);
    let stamp_ms = u32::from_le_bytes(rest.take()?);
    let frame = FrameId::from_digest(u64::from_le_bytes(rest.take()?));
    let (x_m, y_m) = (rest.float()?, rest.float()?);
    let heading = match heading {
        YAW => Heading::Radians(rest.float()?),
        ROLL_PITCH_YAW => Heading::RollPitchYaw([rest.float()?, rest.float()?, rest.float()?]),
        QUATERNION => {
            Heading::Quaternion([rest.float()?, rest.float()?, rest.float()?, rest.float()?])
        }
        _ => return None,
    };
    let spread = match spread {
        UNKNOWN => None,
        GAUSSIAN => {
            let mut row = || Some([rest.float()?, rest.float()?, rest.float()?]);
            Some(Uncertainty::Gaussian([row()?, row()?, row()?]))
        }
        BOUNDED => Some(Uncertainty::Bounded {
            translation_m: rest.float()?,
            yaw_rad: rest.float()?,
        }),
        _ => return None,
    };
    let report = Report {
        source,
        frame,
        sequence,
        stamp_ms,
        belief: PoseEstimate {
            x_m,
            y_m,
            heading,
            spread,
        },
    };
    rest.0.is_empty().then_some((message, report))
}

#[cfg(test)]
mod tests {
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
}
