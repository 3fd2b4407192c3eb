//! Checks bytes of flash a few at a time.

use crate::table::checksum_continued;

/// A check of bytes (code or tables) against their CRC-32C, spread over many calls from a main loop.
///
/// The rounds repeat without end. Cost: about 12 instructions per byte on a Cortex-M0+
/// (`ci.sh budgets`).
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scrub {
    at: usize,
    so_far: u32,
}

/// The progress of a scrub.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum ScrubProgress {
    /// The round is not complete.
    UnderWay,
    /// The round is complete and the checksum is as expected.
    Whole,
    /// The round is complete and the checksum differs: the bytes have changed.
    Damaged,
}

impl Scrub {
    /// Returns a scrub at the start of a round.
    #[must_use]
    pub const fn new() -> Self {
        Self { at: 0, so_far: 0 }
    }

    /// Checks the next `count` bytes (at least one) of `bytes`, whose checksum is `expected`. A call
    /// never continues past the end of a round.
    pub fn step(&mut self, bytes: &[u8], expected: u32, count: usize) -> ScrubProgress {
        let end = self.at.saturating_add(count.max(1)).min(bytes.len());
        // `at` is beyond the bytes only after a bit flip. Then no byte is checked, and the checksum
        // differs.
        let part = bytes.get(self.at..end).unwrap_or_default();
        self.so_far = checksum_continued(self.so_far, part);
        self.at = end;
        if end < bytes.len() {
            return ScrubProgress::UnderWay;
        }
        let found = self.so_far;
        *self = Self::new();
        if found == expected {
            ScrubProgress::Whole
        } else {
            ScrubProgress::Damaged
        }
    }
}

impl Default for Scrub {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::checksum;

    #[test]
    fn every_flipped_bit_is_found_within_a_round() {
        let bytes: Vec<u8> = (0..100u8).map(|v| v.wrapping_mul(3)).collect();
        let expected = checksum(&bytes);
        for count in [0, 1, 7, 99, 100, 1000] {
            let rounds = bytes.len().div_ceil(count.max(1));
            let round = |bytes: &[u8]| {
                let mut scrub = Scrub::new();
                let answers: Vec<_> = (0..rounds)
                    .map(|_| scrub.step(bytes, expected, count))
                    .collect();
                let (last, before) = answers.split_last().unwrap();
                assert!(before.iter().all(|s| *s == ScrubProgress::UnderWay));
                *last
            };
            assert_eq!(round(&bytes), ScrubProgress::Whole);
            for bit in 0..bytes.len() * 8 {
                let mut damaged = bytes.clone();
                damaged[bit / 8] ^= 1 << (bit % 8);
                assert_eq!(round(&damaged), ScrubProgress::Damaged);
            }
        }
    }
}
