//! The word that opens an interlock, and how it must have come about.

/// Byte of a permit; a denial is 0.
pub const PERMIT: u8 = 0xa5;
/// Byte of a denial.
pub const DENY: u8 = 0;

/// What a gate tells an interlock: a verdict byte, its complement, and the signature of the way that led
/// to it.
///
/// A permit is `0xA5`, `0x5A` and the one right signature; a denial `0x00`, `0xFF`. No change within one
/// byte makes a permit of a denial, zeroed or erased memory is none, and a program that jumped over a
/// check has another signature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
#[must_use]
pub struct Permission {
    verdict: u8,
    complement: u8,
    flow: u16,
}

impl Permission {
    /// A denial.
    pub const DENIED: Self = Self {
        verdict: DENY,
        complement: !DENY,
        flow: 0,
    };

    /// The permit of a way through the checks; whether it is one, its signature tells.
    #[inline(always)]
    pub(super) const fn after(flow: Flow) -> Self {
        Self {
            verdict: PERMIT,
            complement: !PERMIT,
            flow: flow.word(),
        }
    }

    /// The permission of one verdict that nothing before it has qualified: for benches that replay
    /// single estimates. A controller takes what its [`super::Gate`] says.
    pub const fn of_single(verdict: &super::Verdict) -> Self {
        if verdict.is_permit() {
            Self::after(Flow::COMPLETE)
        } else {
            Self::DENIED
        }
    }

    /// From its four bytes, as C and registers carry them: verdict, complement, signature (low byte
    /// first).
    pub const fn from_bytes([verdict, complement, low, high]: [u8; 4]) -> Self {
        Self {
            verdict,
            complement,
            flow: u16::from_le_bytes([low, high]),
        }
    }

    /// Its four bytes.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; 4] {
        let [low, high] = self.flow.to_le_bytes();
        [self.verdict, self.complement, low, high]
    }

    /// Whether the interlock may open: all three parts must say so.
    #[inline(always)]
    #[must_use]
    pub fn is_permit(&self) -> bool {
        let seen = core::hint::black_box(*self);
        seen.verdict == PERMIT && seen.complement == !PERMIT && seen.flow == Flow::COMPLETE.word()
    }
}

/// The signature of the checks that a permit has gone through, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Flow(u32);

/// What a check adds to the signature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Check {
    /// The source, the frame and the sequence are right.
    Followed = 0x3a6d,
    /// The stamp is fresh.
    Fresh = 0xc51b,
    /// The first evaluation permits.
    First = 0x96e3,
    /// The second evaluation permits.
    Second = 0x6b58,
    /// The frame and the sequence are right as the complements tell it.
    FollowedAgain = 0x4cb2,
    /// The stamp is fresh as the complements tell it.
    FreshAgain = 0x1d97,
    /// Enough permits have come in a row.
    Qualified = 0xe2c4,
    /// The permit is not older than it may be: looked at in every step, with a report or without.
    Stands = 0xb14d,
}

impl Flow {
    const START: Self = Self(0x5aa5);

    /// The one signature of a permit.
    pub const COMPLETE: Self = Self::START
        .and(Check::Followed)
        .and(Check::Fresh)
        .and(Check::First)
        .and(Check::Second)
        .and(Check::FollowedAgain)
        .and(Check::FreshAgain)
        .and(Check::Qualified)
        .stored()
        .and(Check::Stands);

    /// A way at its start. The compiler does not know the number, so that it cannot foresee the end.
    #[inline(always)]
    pub fn start() -> Self {
        core::hint::black_box(Self::START)
    }

    const fn and(self, check: Check) -> Self {
        Self(self.0.rotate_left(5) ^ check as u32)
    }

    /// As it comes back from memory, where it stands between two steps.
    const fn stored(self) -> Self {
        Self::from_word(self.word())
    }

    /// One check further.
    #[inline(always)]
    pub fn past(&mut self, check: Check) {
        *self = core::hint::black_box(self.and(check));
    }

    /// As memory holds it: what a bit tells is in one bit of it.
    pub const fn word(self) -> u16 {
        (self.0 ^ self.0 >> 16) as u16
    }

    pub const fn from_word(word: u16) -> Self {
        Self(word as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERMITTED: Permission = Permission::after(Flow::COMPLETE);

    /// Every single flipped bit, every changed byte, zeroed and erased memory.
    #[test]
    fn no_denial_falls_over_into_a_permit() {
        assert!(PERMITTED.is_permit() && !Permission::DENIED.is_permit());
        let denied = Permission::DENIED.to_bytes();
        let mut tried = 0;
        for (at, byte) in denied.into_iter().enumerate() {
            for other in 0..=u8::MAX {
                let mut bytes = denied;
                bytes[at] = other;
                assert!(other == byte || !Permission::from_bytes(bytes).is_permit());
                tried += 1;
            }
        }
        assert_eq!(tried, 1024);
        assert!(!Permission::from_bytes([0; 4]).is_permit());
        assert!(!Permission::from_bytes([0xff; 4]).is_permit());
        assert!(!Permission::from_bytes([PERMIT; 4]).is_permit());
    }

    /// A permit is one word of the 2^32.
    #[test]
    fn a_changed_permit_is_none() {
        let permitted = PERMITTED.to_bytes();
        for bit in 0..32 {
            let word = u32::from_le_bytes(permitted) ^ 1 << bit;
            assert!(!Permission::from_bytes(word.to_le_bytes()).is_permit());
        }
    }

    /// No check can be left out, made twice or in another order.
    #[test]
    fn only_the_whole_way_is_complete() {
        let checks = [
            Check::Followed,
            Check::Fresh,
            Check::First,
            Check::Second,
            Check::FollowedAgain,
            Check::FreshAgain,
            Check::Qualified,
            Check::Stands,
        ];
        let way = |checks: &[Check]| {
            let whole = checks.iter().fold(Flow::start(), |mut flow, check| {
                if *check == Check::Stands {
                    flow = flow.stored();
                }
                flow.past(*check);
                flow
            });
            whole.word()
        };
        assert_eq!(way(&checks), Flow::COMPLETE.word());
        for index in 0..checks.len() {
            let mut fewer = checks.to_vec();
            let left_out = fewer.remove(index);
            assert_ne!(way(&fewer), Flow::COMPLETE.word());
            fewer.insert(index, left_out);
            fewer.insert(index, left_out);
            assert_ne!(way(&fewer), Flow::COMPLETE.word());
            for other in 0..index {
                let mut swapped = checks;
                swapped.swap(index, other);
                assert_ne!(way(&swapped), Flow::COMPLETE.word());
            }
        }
    }
}
