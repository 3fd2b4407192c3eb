//! The seal of a firmware: checks that the program's own bytes are the ones that were built.

use super::{Reason, Scrub, ScrubProgress};
use crate::table::checksum;
use core::hint::black_box;

/// A record in the firmware's own flash. After linking, the host (`posegate table seal`) fills it in so that the
/// whole image, this record included, has the CRC-32C [`Seal::SUM`].
///
/// ```
/// use posegate::gate::Seal;
///
/// #[used]
/// static SEAL: Seal = Seal::UNSEALED;
/// ```
///
/// The firmware passes its code as one slice: every byte that is loaded into flash, from the lowest address
/// to the highest (vectors, code, constants, the initial values of variables). A firmware that was not
/// sealed, or that passes other bytes than the sealed ones, is refused like a damaged one. A CRC-32C detects
/// every error of one, two or three bits in images of up to 256 MB.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
#[must_use]
pub struct Seal {
    magic: [u8; 8],
    /// The image's first address and its length in bytes.
    start: u32,
    length: u32,
    /// The value that makes the checksum of the image equal to [`Seal::SUM`].
    balance: u32,
}

impl Seal {
    /// The record as the compiler leaves it. No image has this length, so the check always fails.
    pub const UNSEALED: Self = Self {
        magic: Self::MAGIC,
        start: u32::MAX,
        length: u32::MAX,
        balance: u32::MAX,
    };

    /// The first bytes of the record. The host finds the record by them.
    pub const MAGIC: [u8; 8] = *b"POSESEAL";

    /// Bytes of the record: magic, start, length, balance (little endian).
    pub const LENGTH: usize = 20;

    /// The CRC-32C of every sealed image.
    pub const SUM: u32 = 0x5ea1_ed0f;

    /// Returns `true` if the record has been filled in. For a start-up message that distinguishes an
    /// unsealed firmware from a damaged one; the gate ignores it.
    #[must_use]
    pub fn is_sealed(&self) -> bool {
        self.read().length != u32::MAX
    }

    /// Checks the whole image. Call it at start, before anything is permitted. Cost: about 12 instructions
    /// per byte on a Cortex-M0+.
    ///
    /// # Errors
    /// [`Reason::CodeDamaged`] if the firmware is not sealed or its bytes have changed. Pass it to
    /// [`super::Gate::fault`].
    pub fn check(&self, code: &[u8]) -> Result<(), Reason> {
        if self.is_of(code) && checksum(code) == Self::SUM {
            Ok(())
        } else {
            Err(Reason::CodeDamaged)
        }
    }

    /// Checks the next `count` bytes of the image, in a main loop's idle time. On [`ScrubProgress::Damaged`]
    /// pass [`Reason::CodeDamaged`] to [`super::Gate::fault`].
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

    /// Returns the record as flash holds it. The compiler must not assume the values in the source.
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

    /// Returns an image of 52 bytes and its seal. The balance was computed outside of this crate, by running
    /// a CRC-32C backwards.
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
