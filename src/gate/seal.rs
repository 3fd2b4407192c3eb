//! The seal of a firmware: whether the program's own bytes are those that were built.

use super::{Reason, Scrub, ScrubProgress};
use crate::table::checksum;
use core::hint::black_box;

/// A record in a firmware's own flash that the host (`posegate seal`) fills in after linking, so that the
/// whole image, this record included, has the CRC-32C [`Seal::SUM`].
///
/// ```
/// use posegate::gate::Seal;
///
/// #[used]
/// static SEAL: Seal = Seal::UNSEALED;
/// ```
///
/// The firmware hands in its code as one slice: every byte that is loaded into flash, from the lowest
/// address to the highest (vectors, code, constants, the first values of variables). A firmware that was
/// not sealed, or that hands in other bytes than were sealed, is refused like a damaged one. A CRC-32C finds
/// every error of one, two or three bits in images of up to 256 MB.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
#[must_use]
pub struct Seal {
    magic: [u8; 8],
    /// Where the image starts and how long it is.
    start: u32,
    length: u32,
    /// What makes the sum right.
    balance: u32,
}

impl Seal {
    /// The record as the compiler leaves it: no image has this length, so nothing passes.
    pub const UNSEALED: Self = Self {
        magic: Self::MAGIC,
        start: u32::MAX,
        length: u32::MAX,
        balance: u32::MAX,
    };

    /// The first bytes of the record, by which the host finds it.
    pub const MAGIC: [u8; 8] = *b"POSESEAL";

    /// Bytes of the record: magic, start, length, balance (little endian).
    pub const LENGTH: usize = 20;

    /// The CRC-32C of every sealed image.
    pub const SUM: u32 = 0x5ea1_ed0f;

    /// Whether the record has been filled in: for a start-up message that tells a firmware fresh from the
    /// compiler from a damaged one. It opens nothing.
    #[must_use]
    pub fn is_sealed(&self) -> bool {
        self.read().length != u32::MAX
    }

    /// Looks at the whole image. At start, before anything is permitted; about 12 instructions a byte on a
    /// Cortex-M0+.
    ///
    /// # Errors
    /// [`Reason::CodeDamaged`], for [`super::Gate::fault`].
    pub fn check(&self, code: &[u8]) -> Result<(), Reason> {
        if self.is_of(code) && checksum(code) == Self::SUM {
            Ok(())
        } else {
            Err(Reason::CodeDamaged)
        }
    }

    /// Looks at the next `count` bytes of the image: for a main loop's idle time.
    /// [`ScrubProgress::Damaged`] goes to [`super::Gate::fault`] as [`Reason::CodeDamaged`].
    pub fn scrub(&self, progress: &mut Scrub, code: &[u8], count: usize) -> ScrubProgress {
        if self.is_of(code) {
            progress.step(code, Self::SUM, count)
        } else {
            ScrubProgress::Damaged
        }
    }

    fn is_of(&self, code: &[u8]) -> bool {
        u32::try_from(code.len()) == Ok(self.read().length)
    }

    /// The record as flash holds it: the compiler must not take the values that it was given.
    fn read(&self) -> &Self {
        black_box(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALANCE: u32 = 0x51db_3a40;

    #[test]
    fn an_unsealed_image_does_not_pass() {
        let code = [0x5a; 64];
        assert!(!Seal::UNSEALED.is_sealed());
        assert_eq!(Seal::UNSEALED.check(&code), Err(Reason::CodeDamaged));
        assert_eq!(Seal::UNSEALED.check(&[]), Err(Reason::CodeDamaged));
        let mut progress = Scrub::new();
        for _ in 0..100 {
            assert_eq!(
                Seal::UNSEALED.scrub(&mut progress, &code, 1),
                ScrubProgress::Damaged
            );
        }
        assert_eq!(size_of::<Seal>(), Seal::LENGTH);
    }

    /// An image of 52 bytes that was balanced elsewhere (by running a CRC-32C backwards).
    fn sealed() -> ([u8; 52], Seal) {
        let balance = BALANCE;
        let mut image = [0; 52];
        image[..8].copy_from_slice(&Seal::MAGIC);
        for (byte, value) in image[8..48].iter_mut().zip(0..) {
            *byte = value;
        }
        image[48..].copy_from_slice(&u32::to_le_bytes(balance));
        let seal = Seal {
            magic: Seal::MAGIC,
            start: 0,
            length: 52,
            balance,
        };
        (image, seal)
    }

    #[test]
    fn every_flipped_bit_of_a_sealed_image_is_found() {
        let (image, seal) = sealed();
        assert!(seal.is_sealed() && seal.check(&image) == Ok(()));
        let round = |image: &[u8]| {
            let mut progress = Scrub::new();
            let answers = [0; 4].map(|_| seal.scrub(&mut progress, image, 13));
            assert_eq!(answers[..3], [ScrubProgress::UnderWay; 3]);
            answers[3]
        };
        assert_eq!(round(&image), ScrubProgress::Whole);
        for bit in 0..image.len() * 8 {
            let mut damaged = image;
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(seal.check(&damaged), Err(Reason::CodeDamaged));
            assert_eq!(round(&damaged), ScrubProgress::Damaged);
        }
        for length in 0..image.len() {
            assert_eq!(seal.check(&image[..length]), Err(Reason::CodeDamaged));
        }
    }
}
