//! Factors of a covariance by the time since the last fix: smaller ones for estimates that are fresh from a fix.

use super::Inflation;

/// The largest number of steps of [`Aging`].
pub const MOST_AGES: usize = 4;

/// The unit of an age in a step, as a power of two of milliseconds.
const AGE_POWER: u32 = 6;
/// The unit of a factor in a step is 2^-6: this power less than that of an [`Inflation`].
const FACTOR_POWER: u32 = 10;

/// Factors by the time since the last fix: up to four steps, each an age and the factor up to that age. Neither decreases from a step to the
/// next, so an older estimate never has a smaller factor.
///
/// Each word has an age in its lower 16 bits, in units of 64 ms, rounded down; and in its upper ones a factor in units of 2^-6, rounded
/// up, at least 1. A word 0 is unused; used words come first. The factor of an age is that of the first step whose age is not less,
/// so it is never below the factor given for this age. Beyond the last step, or if the time since the last fix is not
/// known, the source's own inflation applies, which no step exceeds ([`Aging::is_within`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Aging {
    words: [u32; MOST_AGES],
    /// The digest of the words, compared at every use, so that a gate need not read the words if it does not use them.
    digest: u32,
}

impl Aging {
    /// No steps: the source's own inflation at every age.
    pub const NONE: Self = Self::of([0; MOST_AGES]);

    const fn of(words: [u32; MOST_AGES]) -> Self {
        Self {
            words,
            digest: digest(words),
        }
    }

    /// Returns factors by age, from the youngest: up to `age_ms` milliseconds, ends included, the factor. Ages are rounded down to 64 ms,
    /// factors up to 2^-6. `None` if there are more than [`MOST_AGES`] steps, an age is below 64 ms or above 4194 s,
    /// or ages do not rise by 64 ms. Also `None` if factors decrease or a factor is above 1023.
    #[must_use]
    pub fn new(steps: &[(u32, Inflation)]) -> Option<Self> {
        let mut words = [0; MOST_AGES];
        if steps.len() > words.len() {
            return None;
        }
        for (word, (age_ms, inflation)) in words.iter_mut().zip(steps) {
            let age = u16::try_from(age_ms >> AGE_POWER).ok()?;
            // At most 2^28, so the sum does not overflow.
            let up = (1u32 << FACTOR_POWER).wrapping_sub(1);
            let factor = inflation.q16().wrapping_add(up) >> FACTOR_POWER;
            let factor = u16::try_from(factor).ok()?;
            *word = u32::from(factor) << 16 | u32::from(age);
        }
        let aging = Self::of(words);
        let are_used = words.iter().take(steps.len()).all(|word| *word != 0);
        (are_used && aging.is_valid()).then_some(aging)
    }

    /// Returns factors by age from words, as [`Aging::words`] returns them. `None` if they are not valid.
    #[must_use]
    pub fn from_words(words: [u32; MOST_AGES]) -> Option<Self> {
        let aging = Self::of(words);
        aging.is_valid().then_some(aging)
    }

    /// Returns the words: of each step its age and its factor.
    #[must_use]
    pub const fn words(self) -> [u32; MOST_AGES] {
        self.words
    }

    /// Returns the digest of the words.
    pub(crate) const fn digest(self) -> u32 {
        self.digest
    }

    /// Returns `true` if the words match the digest. Every single flipped bit makes it `false`.
    #[cfg_attr(small_code, inline(never))]
    const fn is_whole(self) -> bool {
        self.digest == digest(self.words)
    }

    /// Returns `true` if ages rise, factors are at least 1 and do not fall, and unused words come last. A bit flip in memory can make it
    /// invalid.
    #[must_use]
    pub fn is_valid(self) -> bool {
        let mut before = (0u32, 0u32);
        let mut is_over = false;
        if !self.is_whole() {
            return false;
        }
        for word in self.words {
            let (age, factor) = (word & 0xffff, word >> 16);
            if word == 0 {
                is_over = true;
            } else if is_over || !(age > before.0 && factor >= before.1 && factor >= 1 << 6) {
                return false;
            } else {
                before = (age, factor);
            }
        }
        true
    }

    /// Returns `true` if no step has a larger factor than `inflation`.
    #[must_use]
    pub fn is_within(self, inflation: Inflation) -> bool {
        self.words
            .iter()
            .all(|word| u64::from(word >> 16) << FACTOR_POWER <= u64::from(inflation.q16()))
    }

    /// Returns the factor of an age, or `inflation` beyond the last step and if the words are damaged.
    #[must_use]
    pub(crate) fn at(self, since_fix_ms: u32, inflation: Inflation) -> Inflation {
        // Rounded up: an age between two units is beyond the lower one.
        let age = (u64::from(since_fix_ms).wrapping_add(63) >> AGE_POWER) as u32;
        if !self.is_whole() {
            return inflation;
        }
        for word in self.words {
            if word != 0 && age <= word & 0xffff {
                return stepped(word).unwrap_or(inflation);
            }
        }
        inflation
    }

    /// As [`Aging::at`], from the other end and in another form, for the second evaluation.
    #[must_use]
    pub(crate) fn at_from_oldest(self, since_fix_ms: u32, inflation: Inflation) -> Inflation {
        let mut factor = inflation;
        if !self.is_whole() {
            return inflation;
        }
        for word in self.words.iter().rev() {
            let ends_ms = (word & 0xffff) << AGE_POWER;
            if *word != 0 && !(since_fix_ms > ends_ms) {
                factor = stepped(*word).unwrap_or(inflation);
            }
        }
        factor
    }
}

/// Returns a digest in which every bit of every word counts.
const fn digest([a, b, c, d]: [u32; MOST_AGES]) -> u32 {
    a ^ b.rotate_left(8) ^ c.rotate_left(16) ^ d.rotate_left(24) ^ 0x5eed_a9e5
}

/// Returns the factor of a step; `None` if it is damaged.
fn stepped(word: u32) -> Option<Inflation> {
    Inflation::from_q16((word >> 16) << FACTOR_POWER)
}

#[cfg(test)]
mod tests;
