//! The permission that opens an interlock, with the signature of the checks that led to it.

/// The verdict byte of a permit.
pub const PERMIT: u8 = 0xa5;
/// The verdict byte of a denial.
pub const DENY: u8 = 0;

/// The gate's answer for the interlock: a verdict byte, its complement, the signature of the checks that led
/// to it, and the time of its cycle.
///
/// A permit is `0xA5`, `0x5A` and the one correct signature for its time; a denial is `0x00`, `0xFF`. No
/// change within one byte turns a denial into a permit. Zeroed and erased memory is a denial. A program that
/// skips a check has another signature.
///
/// A permission is valid only in the cycle for which it was made: [`super::Interlock::apply`] refuses a
/// permit of another time, so a stored permission never opens the interlock later.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
#[must_use]
pub struct Permission {
    verdict: u8,
    complement: u8,
    /// The signature of the checks, combined with the time by [`of_time`].
    flow: u16,
    /// The controller's time of the step.
    made_ms: u32,
}

/// Returns the contribution of a time to the signature. Each changed bit of the time changes one bit of the
/// contribution.
#[inline(always)]
const fn of_time(made_ms: u32) -> u16 {
    (made_ms ^ made_ms >> 16) as u16
}

impl Permission {
    /// A denial.
    pub const DENIED: Self = Self {
        verdict: DENY,
        complement: !DENY,
        flow: 0,
        made_ms: 0,
    };

    /// Returns the permission after a path through the checks, for the cycle at `made_ms`. It is a permit
    /// only if its signature is complete.
    #[inline(always)]
    pub(super) const fn after(flow: FlowSignature, made_ms: u32) -> Self {
        Self {
            verdict: PERMIT,
            complement: !PERMIT,
            flow: flow.word() ^ of_time(made_ms),
            made_ms,
        }
    }

    /// Returns the permission for one verdict without qualification, for the cycle at `now_ms`. Only for
    /// benches that replay single estimates; a controller uses the permission that its [`super::Gate`]
    /// returns.
    pub const fn of_single(verdict: &super::Verdict, now_ms: u32) -> Self {
        if verdict.is_permit() {
            Self::after(FlowSignature::COMPLETE, now_ms)
        } else {
            Self::DENIED
        }
    }

    /// Reads a permission from its eight bytes, as C and registers hold it: verdict, complement, signature
    /// and time (both low byte first).
    pub const fn from_bytes(bytes: [u8; 8]) -> Self {
        let [verdict, complement, low, high, a, b, c, d] = bytes;
        Self {
            verdict,
            complement,
            flow: u16::from_le_bytes([low, high]),
            made_ms: u32::from_le_bytes([a, b, c, d]),
        }
    }

    /// Returns the eight bytes of the permission.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; 8] {
        let [low, high] = self.flow.to_le_bytes();
        let [a, b, c, d] = self.made_ms.to_le_bytes();
        [self.verdict, self.complement, low, high, a, b, c, d]
    }

    /// Returns `true` if this is a permit of any cycle, for telemetry. Code that drives an output calls
    /// [`Permission::opens_at`] instead, because a stored permit is still a permit here.
    #[inline(always)]
    #[must_use]
    pub fn is_permit(&self) -> bool {
        let seen = core::hint::black_box(*self);
        seen.verdict == PERMIT
            && seen.complement == !PERMIT
            && seen.flow ^ of_time(seen.made_ms) == FlowSignature::COMPLETE.word()
    }

    /// Returns `true` if the interlock may open in the cycle whose step was given the time `now_ms`: every
    /// part must permit, and the permission must be of this cycle.
    #[inline(always)]
    #[must_use]
    pub fn opens_at(&self, now_ms: u32) -> bool {
        self.is_permit() && core::hint::black_box(*self).made_ms == now_ms
    }
}

/// The signature of the checks that a permit has passed, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FlowSignature(u32);

/// A check and the value that it adds to the signature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Check {
    /// The source, the frame and the sequence are correct.
    Followed = 0x3a6d,
    /// The stamp is fresh.
    Fresh = 0xc51b,
    /// The first evaluation permits.
    First = 0x96e3,
    /// The second evaluation permits.
    Second = 0x6b58,
    /// The frame and the sequence are correct, read from the complements.
    FollowedAgain = 0x4cb2,
    /// There were enough consecutive permits, and the hold time is over.
    Qualified = 0xe2c4,
    /// The permit has not expired. Checked in every step and tick.
    Stands = 0xb14d,
}

impl FlowSignature {
    const START: Self = Self(0x5aa5);

    /// The only signature of a report that counts towards a permit.
    pub const WEIGHED: Self = Self::START
        .and(Check::Followed)
        .and(Check::Fresh)
        .and(Check::First)
        .and(Check::Second)
        .and(Check::FollowedAgain);

    /// The only signature of a permit.
    pub const COMPLETE: Self = Self::WEIGHED
        .and(Check::Qualified)
        .stored()
        .and(Check::Stands);

    /// Returns the signature before any check. `black_box` hides the number, so the compiler cannot compute
    /// the result.
    #[inline(always)]
    pub fn start() -> Self {
        core::hint::black_box(Self::START)
    }

    const fn and(self, check: Check) -> Self {
        Self(self.0.rotate_left(5) ^ check as u32)
    }

    /// Returns the signature as it is read back from memory, which keeps it between two steps.
    const fn stored(self) -> Self {
        Self::from_word(self.word())
    }

    /// Adds one passed check.
    #[inline(always)]
    pub fn past(&mut self, check: Check) {
        *self = core::hint::black_box(self.and(check));
    }

    /// Returns the signature as memory holds it, folded to 16 bits. Each changed bit of the signature
    /// changes one bit of it.
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

    const MADE_MS: u32 = 0xfff1_2345;
    const PERMITTED: Permission = Permission::after(FlowSignature::COMPLETE, MADE_MS);

    /// Tries every flipped bit, every changed byte, zeroed and erased memory.
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
        assert_eq!(tried, 2048);
        assert!(!Permission::from_bytes([0; 8]).is_permit());
        assert!(!Permission::from_bytes([0xff; 8]).is_permit());
        assert!(!Permission::from_bytes([PERMIT; 8]).is_permit());
    }

    /// A flipped bit of the time also changes the verdict, since the time is a part of the signature.
    #[test]
    fn a_permit_with_a_flipped_bit_is_a_denial() {
        let permitted = PERMITTED.to_bytes();
        for bit in 0..64 {
            let word = u64::from_le_bytes(permitted) ^ 1 << bit;
            assert!(!Permission::from_bytes(word.to_le_bytes()).is_permit());
        }
    }

    #[test]
    fn a_permit_opens_in_its_own_cycle_only() {
        assert!(PERMITTED.opens_at(MADE_MS));
        for other in [0, MADE_MS - 1, MADE_MS + 1, MADE_MS ^ 1 << 31, !MADE_MS] {
            assert!(!PERMITTED.opens_at(other));
        }
        assert!(!Permission::DENIED.opens_at(0));
    }

    /// No check can be skipped, repeated or made in another order.
    #[test]
    fn only_the_whole_way_is_complete() {
        let checks = [
            Check::Followed,
            Check::Fresh,
            Check::First,
            Check::Second,
            Check::FollowedAgain,
            Check::Qualified,
            Check::Stands,
        ];
        let way = |checks: &[Check]| {
            let whole = checks
                .iter()
                .fold(FlowSignature::start(), |mut flow, check| {
                    if *check == Check::Stands {
                        flow = flow.stored();
                    }
                    flow.past(*check);
                    flow
                });
            whole.word()
        };
        assert_eq!(way(&checks), FlowSignature::COMPLETE.word());
        for index in 0..checks.len() {
            let mut fewer = checks.to_vec();
            let left_out = fewer.remove(index);
            assert_ne!(way(&fewer), FlowSignature::COMPLETE.word());
            fewer.insert(index, left_out);
            fewer.insert(index, left_out);
            assert_ne!(way(&fewer), FlowSignature::COMPLETE.word());
            for other in 0..index {
                let mut swapped = checks;
                swapped.swap(index, other);
                assert_ne!(way(&swapped), FlowSignature::COMPLETE.word());
            }
        }
    }
}
