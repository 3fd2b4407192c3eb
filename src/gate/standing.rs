//! The gate's state as memory holds it: one word with its complement.

use super::doubled::{CorruptWord, RedundantWord};
use super::permission::FlowSignature;
use super::{Reason, State};

/// A state. A permit carries the signature of the checks that it passed.
#[derive(Clone, Copy)]
pub(super) enum DecodedState {
    Inhibited(Reason),
    Qualifying(u16),
    Permitted(FlowSignature),
    Latched(Reason),
}

/// Marks of the states, in the upper 16 bits of the word.
const INHIBITED: u32 = 0x1196;
const QUALIFYING: u32 = 0x2e69;
const PERMITTED: u32 = 0xa53c;
const LATCHED: u32 = 0x5bc3;

impl DecodedState {
    /// Decodes the state from its word.
    pub fn of(word: RedundantWord) -> Result<Self, CorruptWord> {
        let word = word.get()?;
        let rest = word as u16;
        let reason = || Reason::from_code(word as u8).ok_or(CorruptWord);
        match word >> 16 {
            INHIBITED => reason().map(Self::Inhibited),
            QUALIFYING => Ok(Self::Qualifying(rest)),
            PERMITTED => Ok(Self::Permitted(FlowSignature::from_word(rest))),
            LATCHED => reason().map(Self::Latched),
            _ => Err(CorruptWord),
        }
    }

    /// Encodes the state as a word.
    pub fn word(self) -> RedundantWord {
        let (mark, rest) = match self {
            Self::Inhibited(reason) => (INHIBITED, u16::from(reason.code())),
            Self::Qualifying(count) => (QUALIFYING, count),
            Self::Permitted(flow) => (PERMITTED, flow.word()),
            Self::Latched(reason) => (LATCHED, u16::from(reason.code())),
        };
        RedundantWord::new(mark << 16 | u32::from(rest))
    }

    /// Returns `true` if a permit is valid or being earned.
    pub const fn is_earning(self) -> bool {
        matches!(self, Self::Qualifying(_) | Self::Permitted(_))
    }

    /// Returns `true` if a permit is valid: the interlock may be open.
    pub const fn is_open(self) -> bool {
        matches!(self, Self::Permitted(_))
    }

    pub const fn state(self) -> State {
        match self {
            Self::Inhibited(reason) => State::Inhibited(reason),
            Self::Qualifying(count) => State::Qualifying(count),
            Self::Permitted(_) => State::Permitted,
            Self::Latched(reason) => State::Latched(reason),
        }
    }
}

/// The state before a step, saved while the gate is closed during the checks.
#[derive(Clone, Copy)]
pub(super) struct StateSnapshot {
    /// The state as it was decoded once. The decision to open reads `state` again.
    pub standing: DecodedState,
    pub state: RedundantWord,
}

impl StateSnapshot {
    /// Decodes a state's word and keeps both.
    pub fn of(state: RedundantWord) -> Result<Self, CorruptWord> {
        Ok(Self {
            standing: DecodedState::of(state)?,
            state,
        })
    }

    /// Returns `true` if one more permit makes `needed` consecutive permits, read from the complement.
    pub fn has_earned_by_complement(&self, needed: u16) -> bool {
        let word = self.state.by_complement();
        match word >> 16 {
            PERMITTED => true,
            QUALIFYING => (word as u16) >= needed.saturating_sub(1),
            INHIBITED => needed == 1,
            _ => false,
        }
    }
}
