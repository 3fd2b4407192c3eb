//! The message that carries an increment of the odometry (version 2).

use super::{Body, LONGEST_BODY, Reader, VERSION_2, WireError};
use crate::track::Increment;
use heapless::Vec;

/// Type of the message. (3 was the same in whole micrometres: their rounding added up to millimetres in a second.)
const ODOMETRY: u8 = 4;

/// Returns the body of the message that carries an increment.
#[must_use]
pub fn increment_body(increment: &Increment) -> Vec<u8, LONGEST_BODY> {
    let mut body = Body(Vec::new());
    body.put([VERSION_2, ODOMETRY]);
    for stamp in increment.span_ms() {
        body.put(stamp.to_le_bytes());
    }
    for entry in increment.entries() {
        body.put(entry.to_le_bytes());
    }
    body.0
}

/// Parses an increment from the body of a message.
///
/// # Errors
/// [`WireError::Content`] if the body is not an increment, an entry is longer than 4 m, or the turn is above an eighth of a turn.
pub fn increment_from_body(body: &[u8]) -> Result<Increment, WireError> {
    read(body).ok_or(WireError::Content)
}

fn read(body: &[u8]) -> Option<Increment> {
    let mut rest = Reader(body);
    if rest.take()? != [VERSION_2, ODOMETRY] {
        return None;
    }
    let mut stamp = || Some(u32::from_le_bytes(rest.take()?));
    let span_ms = [stamp()?, stamp()?];
    let mut entry = || Some(i32::from_le_bytes(rest.take()?));
    let [ahead_q8, left_q8, turn] = [entry()?, entry()?, entry()?];
    rest.0
        .is_empty()
        .then(|| Increment::new(ahead_q8, left_q8, turn, span_ms))?
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn increments_round_trip_bit_for_bit(ahead in -(1i32 << 30)..=1 << 30, left in -(1i32 << 30)..=1 << 30, turn in -(1i32 << 29)..=1 << 29, span: [u32; 2]) {
            let sent = Increment::new(ahead, left, turn, span).unwrap();
            let body = increment_body(&sent);
            prop_assert_eq!(increment_from_body(&body), Ok(sent));
            for length in 0..body.len() {
                prop_assert_eq!(increment_from_body(&body[..length]), Err(WireError::Content));
            }
        }

        #[test]
        fn decoded_increment_re_encodes_to_its_body(body in prop::collection::vec(any::<u8>(), 0..30)) {
            if let Ok(increment) = increment_from_body(&body) {
                prop_assert_eq!(&increment_body(&increment)[..], &body[..]);
            }
        }
    }

    /// Checks the table of the module's documentation, byte by byte.
    #[test]
    fn an_increment_is_as_documented() {
        let sent = Increment::new(5_000, -2, 0x0103_0201, [0x0807_0605, 0x0c0b_0a09]).unwrap();
        let expected = [
            2, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0x88, 0x13, 0, 0, 0xfe, 0xff, 0xff, 0xff, 1, 2, 3, 1,
        ];
        assert_eq!(increment_body(&sent)[..], expected);
        let mut long = increment_body(&sent);
        long[13] = 0x41;
        assert_eq!(increment_from_body(&long), Err(WireError::Content));
    }
}
