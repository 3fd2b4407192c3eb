//! Consistent Overhead Byte Stuffing (Cheshire and Baker 1999) for short messages.
//!
//! Removes zeros from bytes: each stretch between zeros is preceded by its length plus one. Messages
//! here are shorter than 254 bytes, so the encoder never needs the code 0xff (254 bytes and no zero),
//! but the decoder accepts it. Implemented here because a panic must not be reachable; the tests
//! compare it with the `cobs` crate.

use super::Frame;
use heapless::Vec;

/// Returns the encoding of at most `N` bytes, with the closing zero, or `None` if it does not fit.
pub(super) fn encode(plain: &[u8]) -> Option<Frame> {
    let mut frame = Frame::new();
    for block in plain.split(|byte| *byte == 0) {
        let code = u8::try_from(block.len()).ok()?.checked_add(1)?;
        if code == 0xff {
            return None;
        }
        frame.push(code).ok()?;
        append(&mut frame, block)?;
    }
    frame.push(0).ok()?;
    Some(frame)
}

/// Appends bytes one by one, so that the compiler can rule out every overflow of the length.
pub(super) fn append<const N: usize>(to: &mut Vec<u8, N>, bytes: &[u8]) -> Option<()> {
    bytes.iter().try_for_each(|byte| to.push(*byte).ok())
}

/// Decodes a frame without its closing zero, or returns `None` if it is not an encoding.
pub(super) fn decode(frame: &[u8]) -> Option<Frame> {
    let mut plain: Frame = Vec::new();
    let mut rest = frame;
    while let Some((code, tail)) = rest.split_first() {
        let length = usize::from(code.checked_sub(1)?);
        let (block, tail) = tail.split_at_checked(length)?;
        append(&mut plain, block)?;
        rest = tail;
        if *code != 0xff && !rest.is_empty() {
            plain.push(0).ok()?;
        }
    }
    Some(plain)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Compares with the `cobs` crate in both directions.
        #[test]
        fn cobs_matches_reference_encoding(plain in proptest::collection::vec(prop_oneof![Just(0u8), any::<u8>()], 1..118)) {
            let mut theirs = [0u8; 300];
            let length = ::cobs::try_encode(&plain, &mut theirs).unwrap();
            let ours = encode(&plain).unwrap();
            prop_assert_eq!(&ours[..ours.len() - 1], &theirs[..length]);
            prop_assert_eq!(ours.last(), Some(&0));
            let decoded = decode(&ours[..ours.len() - 1]).unwrap();
            prop_assert_eq!(&decoded[..], &plain[..]);
        }

        #[test]
        fn decoded_frames_equal_those_of_cobs_crate(frame in proptest::collection::vec(1u8..=255, 1..119)) {
            let mut theirs = [0u8; 300];
            let report = ::cobs::decode(&frame, &mut theirs);
            match (decode(&frame), report) {
                (Some(ours), Ok(report)) => prop_assert_eq!(&ours[..], &theirs[..report.frame_size()]),
                (Some(_), Err(error)) => prop_assert!(false, "{error:?}"),
                (None, _) => {}
            }
        }
    }
}
