//! What a controller tells its gate at construction.

use crate::report::FrameId;
use crate::set::{CrossTerms, Inflation, Trust};

/// A localization source as the controller knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Source {
    /// The frame that its reports must be in: the world frame of the site.
    pub frame: FrameId,
    /// How far its covariances are believed.
    pub trust: Trust,
}

impl Source {
    /// A source in a named frame, whose covariances are multiplied by `inflation`.
    ///
    /// # Errors
    /// [`InvalidParameter::Frame`] for an empty name; [`InvalidParameter::Inflation`] unless the factor
    /// is a number from 1 to 4096.
    pub fn new(
        frame: &str,
        inflation: f64,
        cross_terms: CrossTerms,
    ) -> Result<Self, InvalidParameter> {
        let inflation = Inflation::new(inflation).ok_or(InvalidParameter::Inflation)?;
        let frame = FrameId::of(frame);
        if frame == FrameId::UNNAMED {
            return Err(InvalidParameter::Frame);
        }
        let trust = Trust {
            inflation,
            cross_terms,
        };
        Ok(Self { frame, trust })
    }
}

/// What ends a permit for longer than the cause lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Restart {
    /// After a denial the gate qualifies again by itself; only faults wait for a reset.
    Automatic,
    /// Whatever ends a permit waits for a reset (no automatic restart, ISO 3691-4:2020, 4.1.14).
    OnReset,
}

/// The parameters of a gate. None can be set so that a check is off.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings<'a> {
    /// The task that the table must be for.
    pub task: &'a str,
    /// SHA-256 of the site file that the table must be made from (`posegate table info` tells it).
    pub site_digest: [u8; 32],
    /// The sources, by the number that their reports carry.
    pub sources: &'a [Source],
    /// The oldest estimate that may hold the interlock open, milliseconds: from 1 to 2^31 - 1. Its age is
    /// judged at the end of the permission, which is [`Settings::response_ms`] after the time of the step.
    pub maximum_age_ms: u32,
    /// The longest time from the `now_ms` of one step or tick until the output has followed the answer of the
    /// next one, milliseconds: from 1, and less than `maximum_age_ms`. It is the sum of the longest period of the
    /// control cycle, the longest time of a step and that of the output. A step is two evaluations and the conversion
    /// of the estimate: some 9,000 instructions (Cortex-M4F; Cortex-M0+: 24,000) with facets, and up to eleven times
    /// the bound of `posegate table info` with cells. A cycle that is later while the gate is open closes it
    /// ([`super::Reason::CycleLate`]).
    pub response_ms: u32,
    /// A permit ends when no further one has come for longer, milliseconds: from 1 to 2^31 - 1.
    pub permit_hold_ms: u32,
    /// After a denial nothing is permitted for so long, milliseconds: from 1 to 2^31 - 1. So it is after
    /// the start.
    pub inhibit_hold_ms: u32,
    /// So many reports in a row must permit: from 1 to 65,535.
    pub permits_in_a_row: u16,
    /// What waits for a reset.
    pub restart: Restart,
    /// The tag that the robot should look at to relocalise for this task, for advice alone.
    pub look_at: Option<u32>,
}

/// A parameter that would switch a check off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum InvalidParameter {
    /// The maximum age is zero, or half the range of the millisecond clock or more.
    MaximumAge,
    /// The response time is zero, or leaves no age that a report may have.
    ResponseTime,
    /// The time that a permit stands likewise.
    PermitHold,
    /// The time that a denial stands likewise.
    InhibitHold,
    /// No permit would be needed.
    PermitsInARow,
    /// No task is named.
    Task,
    /// No source is declared, or more than 256.
    Sources,
    /// A source without a frame.
    Frame,
    /// An inflation that is zero, negative, no number, below 1 or above 4096.
    Inflation,
    /// A time of the interlock (read-back, heartbeat) is zero, or 2^31 ms or more.
    InterlockTime,
}

impl Settings<'_> {
    /// Whether every parameter leaves its check on.
    ///
    /// # Errors
    /// The first that does not.
    pub fn check(&self) -> Result<(), InvalidParameter> {
        let time = |ms: u32, wrong| is_time(ms).then_some(()).ok_or(wrong);
        time(self.maximum_age_ms, InvalidParameter::MaximumAge)?;
        if !(self.response_ms > 0 && self.response_ms < self.maximum_age_ms) {
            return Err(InvalidParameter::ResponseTime);
        }
        time(self.permit_hold_ms, InvalidParameter::PermitHold)?;
        time(self.inhibit_hold_ms, InvalidParameter::InhibitHold)?;
        if self.permits_in_a_row == 0 {
            return Err(InvalidParameter::PermitsInARow);
        }
        if self.task.is_empty() {
            return Err(InvalidParameter::Task);
        }
        if self.sources.is_empty() || self.sources.len() > 256 {
            return Err(InvalidParameter::Sources);
        }
        for source in self.sources {
            if source.frame == FrameId::UNNAMED {
                return Err(InvalidParameter::Frame);
            }
            if !source.trust.is_valid() {
                return Err(InvalidParameter::Inflation);
            }
        }
        Ok(())
    }

    /// The oldest estimate that permits in a step, so that it is not older than the maximum age when the
    /// permission ends; 0 for settings that [`Settings::check`] refuses.
    pub(super) fn oldest_ms(&self) -> u32 {
        self.maximum_age_ms.saturating_sub(self.response_ms)
    }

    /// A digest of what a step goes by: a fallen bit in it, or in the settings, is seen.
    pub(super) fn digest(&self) -> u32 {
        let words = [
            self.maximum_age_ms,
            self.response_ms,
            self.permit_hold_ms,
            self.inhibit_hold_ms,
            u32::from(self.permits_in_a_row) << 1 | u32::from(self.restart == Restart::OnReset),
        ];
        let own = words.into_iter().fold(0x9e37_79b9, mixed);
        // No more than there can be, wherever a damaged pointer leads.
        self.sources.iter().take(256).fold(own, |sum, source| {
            let frame = source.frame.digest();
            let terms = match source.trust.cross_terms {
                CrossTerms::Filled => 0,
                CrossTerms::YawUnknown(share) => 0x100 | u32::from(share.q8()),
                CrossTerms::AllUnknown(share) => 0x200 | u32::from(share.q8()),
            };
            [
                frame as u32,
                (frame >> 32) as u32,
                source.trust.inflation.q16(),
                terms,
            ]
            .into_iter()
            .fold(sum, mixed)
        })
    }
}

/// A digest with one word more; no bit of either is lost.
const fn mixed(sum: u32, word: u32) -> u32 {
    sum.rotate_left(7).wrapping_add(word)
}

/// The digest of a site file from its 64 hexadecimal digits, as `posegate table info` prints it. `None` for
/// anything else.
#[must_use]
pub const fn site_digest(digits: &str) -> Option<[u8; 32]> {
    let (pairs, rest) = digits.as_bytes().as_chunks::<2>();
    let mut pairs = pairs;
    let mut digest = [0; 32];
    let mut bytes: &mut [u8] = &mut digest;
    while let ([byte, bytes_after @ ..], [[high, low], pairs_after @ ..]) = (bytes, pairs) {
        *byte = match (nibble(*high), nibble(*low)) {
            (Some(high), Some(low)) => high << 4 | low,
            _ => return None,
        };
        bytes = bytes_after;
        pairs = pairs_after;
    }
    if digits.len() == 64 && rest.is_empty() {
        Some(digest)
    } else {
        None
    }
}

const fn nibble(digit: u8) -> Option<u8> {
    match digit {
        b'0'..=b'9' => Some(digit.wrapping_sub(b'0')),
        b'a'..=b'f' => Some(digit.wrapping_sub(b'a').wrapping_add(10)),
        b'A'..=b'F' => Some(digit.wrapping_sub(b'A').wrapping_add(10)),
        _ => None,
    }
}

/// Whether milliseconds are a time that a wrapping clock can tell: above zero, below half its range.
pub(super) const fn is_time(ms: u32) -> bool {
    ms >= 1 && ms < 1 << 31
}

#[cfg(test)]
mod tests {
    use super::site_digest;

    #[test]
    fn digests_are_read_from_their_digits() {
        let digits: String = (0..32u8)
            .map(|v| format!("{:02x}", v.wrapping_mul(9)))
            .collect();
        let expected = core::array::from_fn(|k| (k as u8).wrapping_mul(9));
        assert_eq!(site_digest(&digits), Some(expected));
        assert_eq!(site_digest(&digits.to_uppercase()), Some(expected));
        for bad in [
            "",
            &digits[1..],
            &format!("{digits}0"),
            &format!("{digits}00"),
        ] {
            assert_eq!(site_digest(bad), None, "{bad}");
        }
        for bad in ['g', '/', ':', '@', '`', ' '] {
            assert_eq!(
                site_digest(&digits.replacen('0', &format!("{bad}"), 1)),
                None
            );
        }
    }
}
