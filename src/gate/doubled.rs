//! A word stored with its complement.

/// A 32-bit word and its complement, as IEC 60730 Annex H keeps redundant copies in a different form. A
/// change of bits in one of the two is always detected. Zeroed memory is not a valid pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct RedundantWord {
    word: u32,
    complement: u32,
}

/// The word and its complement do not match.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CorruptWord;

impl RedundantWord {
    #[inline(always)]
    pub const fn new(word: u32) -> Self {
        Self::of_two(word, word)
    }

    /// Stores a word that was read twice: if the readings differ, the pair is corrupt.
    #[inline(always)]
    pub const fn of_two(word: u32, again: u32) -> Self {
        Self {
            word,
            complement: !again,
        }
    }

    /// Returns the word if it matches its complement. `black_box` hides from the compiler what was written,
    /// so that the comparison is executed.
    #[inline(always)]
    pub fn get(&self) -> Result<u32, CorruptWord> {
        core::hint::black_box(self).get_of_opaque()
    }

    /// As [`RedundantWord::get`], for a word in a struct whose reference has already passed `black_box`.
    /// Several words of the struct then need only one `black_box`.
    #[inline(always)]
    pub const fn get_of_opaque(&self) -> Result<u32, CorruptWord> {
        if self.word ^ self.complement == u32::MAX {
            Ok(self.word)
        } else {
            Err(CorruptWord)
        }
    }

    /// Returns the word computed from its complement, for a second reading that does not rely on the first
    /// copy.
    #[inline(always)]
    pub fn by_complement(&self) -> u32 {
        core::hint::black_box(self).by_complement_of_opaque()
    }

    /// As [`RedundantWord::by_complement`], under the condition of [`RedundantWord::get_of_opaque`].
    #[inline(always)]
    pub const fn by_complement_of_opaque(&self) -> u32 {
        !self.complement
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_readings_that_differ_are_damaged() {
        assert_eq!(RedundantWord::of_two(7, 7).get(), Ok(7));
        assert_eq!(RedundantWord::of_two(7, 6).get(), Err(CorruptWord));
    }

    /// Detects every flipped bit of either copy, and zeroed or erased memory.
    #[test]
    fn a_word_that_does_not_agree_with_its_complement_is_damaged() {
        for word in [0, 1, 0x1234_5678, u32::MAX] {
            let doubled = RedundantWord::new(word);
            assert_eq!(doubled.get(), Ok(word));
            assert_eq!(doubled.by_complement(), word);
            for bit in 0..32 {
                let (mut first, mut second) = (doubled, doubled);
                first.word ^= 1 << bit;
                second.complement ^= 1 << bit;
                assert_eq!(first.get(), Err(CorruptWord));
                assert_eq!(second.get(), Err(CorruptWord));
            }
        }
        for same in [0, u32::MAX] {
            let memory = RedundantWord {
                word: same,
                complement: same,
            };
            assert_eq!(memory.get(), Err(CorruptWord));
        }
    }
}
