use super::*;
use crate::table::checksum;
use proptest::prelude::*;
use std::vec::Vec as Bytes;

fn request(bits: [u64; 12], sequence: u16, gaussian: bool) -> Request {
    let v = bits.map(f64::from_bits);
    Request {
        sequence,
        table: (bits[0] & 0xff) as u8,
        stamp_ms: bits[1] as u32,
        now_ms: bits[2] as u32,
        radius_squared: RadiusSquared::from_q16(743_498).unwrap(),
        estimate: Estimate {
            x_m: v[0],
            y_m: v[1],
            yaw_rad: v[2],
        },
        spread: if gaussian {
            Uncertainty::Gaussian([[v[3], v[4], v[5]], [v[6], v[7], v[8]], [v[9], v[10], v[11]]])
        } else {
            Uncertainty::Bounded {
                translation_m: v[3],
                yaw_rad: v[4],
            }
        },
    }
}

fn received(bytes: &[u8]) -> Bytes<Result<Frame, WireError>> {
    let mut receiver = Receiver::new();
    bytes
        .iter()
        .filter_map(|byte| receiver.push(*byte))
        .collect()
}

proptest! {
    #[test]
    fn requests_round_trip_bit_for_bit(
        bits in proptest::array::uniform12(any::<u64>()), sequence: u16, gaussian: bool,
    ) {
        let sent = request(bits, sequence, gaussian);
        let frame = encode(&sent.body());
        prop_assert!(frame.len() <= LONGEST_FRAME);
        let got = received(&frame);
        prop_assert_eq!(got.len(), 1);
        let got = Request::from_body(got[0].as_ref().unwrap()).unwrap();
        prop_assert_eq!(got.body(), sent.body());
    }

    #[test]
    fn request_with_flipped_bit_is_refused(
        bits in proptest::array::uniform12(any::<u64>()), at in 0usize..119, bit in 0u8..8,
    ) {
        let sent = request(bits, 7, true);
        let mut frame = encode(&sent.body());
        let at = at % frame.len();
        frame[at] ^= 1 << bit;
        // The damaged frame, and the parts into which it breaks, contain no valid body.
        for frame in received(&frame) {
            prop_assert!(frame.is_err() || Request::from_body(&frame.unwrap()).is_err());
        }
    }

    #[test]
    fn receiver_recovers_after_random_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
        let mut stream = bytes;
        stream.push(0);
        let good = request([1; 12], 9, false);
        stream.extend_from_slice(&encode(&good.body()));
        let got = received(&stream);
        let last = got.last().unwrap().as_ref().unwrap();
        prop_assert_eq!(Request::from_body(last).unwrap().sequence, 9);
    }

    #[test]
    fn replies_round_trip(
        margin: u32, x_um: i32, y_um: i32, yaw: u32, interlock_high: bool,
    ) {
        let margin = Margin::from_q16(margin);
        let worst_pose = Some(Pose { x_um, y_um, yaw: BinaryAngle(yaw) });
        let with_place = |reason| Verdict::Deny { reason, margin: Some(margin), worst_pose };
        let denials = Reason::ALL.into_iter().flat_map(|r| [Ok(with_place(r)), Ok(Verdict::deny(r))]);
        let others = [Err(WireError::Checksum), Ok(Verdict::Permit { margin })];
        for verdict in denials.chain(others) {
            let reply = Reply { sequence: 3, verdict, interlock_high };
            prop_assert_eq!(Reply::from_body(&reply.body()), Some(reply));
        }
    }
}

/// The checksum cannot distinguish these bodies from their cut versions.
#[test]
fn too_long_body_has_no_frame() {
    let mut body = [0; LONGEST_BODY + 1];
    body[..4].fill(0xff);
    assert_eq!(checksum(&body), checksum(&body[..LONGEST_BODY]));
    assert!(encode(&body).is_empty());
    assert_eq!(
        received(&encode(&body[..LONGEST_BODY])).len(),
        1,
        "as long as it may be"
    );
}

#[test]
fn the_bodies_have_their_lengths() {
    assert_eq!(request([0; 12], 0, true).body().len(), 113);
    assert_eq!(request([0; 12], 0, false).body().len(), 57);
}

/// The sender may be stricter than the site, but not less strict.
#[test]
fn radius_below_table_radius_is_refused() {
    let gates = [Evaluator::new(&[], 100).unwrap()];
    let mut asked = request([0; 12], 0, true);
    assert!(asked.evaluate(&gates).is_ok());
    asked.radius_squared = RadiusSquared::from_q16(743_497).unwrap();
    assert_eq!(asked.evaluate(&gates), Err(WireError::Content));
    asked.radius_squared = RadiusSquared::LARGEST;
    assert!(asked.evaluate(&gates).is_ok());
    asked.table = 1;
    assert_eq!(asked.evaluate(&gates), Err(WireError::Table));
}

#[test]
fn radius_that_disables_the_check_is_refused() {
    let mut body = request([0; 12], 0, true).body();
    for byte in &mut body[13..17] {
        *byte = 0;
    }
    assert_eq!(Request::from_body(&body), Err(WireError::Content));
}
