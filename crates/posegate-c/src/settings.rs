//! The settings of a gate: a constant in flash.

use super::memory::Plain;
use super::posegate_status;
use core::ffi::c_char;
use posegate::gate::{Restart, Source};
use posegate::set::{CrossTerms, SplitWeight};

/// Bytes of a name. One that is shorter has zeros after it, as a C initialiser puts them.
pub const POSEGATE_NAME_LENGTH: usize = 32;
/// Sources that a gate can have.
pub const POSEGATE_MOST_SOURCES: usize = 4;
/// In the place of a tag's number: there is none.
pub const POSEGATE_NO_TAG: u32 = 0xffff_ffff;

/// Which terms of its covariance a source fills. 0 is none of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_cross_terms {
    /// All of them.
    Filled = 1,
    /// None between yaw and plane (AMCL): what stands there is not looked at.
    YawUnknown = 2,
    /// Variances alone (a landing target's).
    AllUnknown = 3,
}

/// What ends a permit for longer than the cause lasts. 0 is none of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_restart {
    /// After a denial the gate qualifies again by itself; only faults wait for a reset.
    Automatic = 1,
    /// Whatever ends a permit waits for a reset (no automatic restart, ISO 3691-4:2020, 4.1.14).
    OnReset = 2,
}

/// A localization source as the controller knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_source {
    /// The frame that its reports must be in, such as "map".
    pub frame: [c_char; POSEGATE_NAME_LENGTH],
    /// By how much its covariances are multiplied before they are believed: from 1 to 4096.
    pub inflation: f64,
    /// A `posegate_cross_terms`.
    pub cross_terms: u32,
    /// Where terms are unknown: the share of the spread that is left to the plane, from 1 to 255 of 256;
    /// 128 doubles both blocks.
    pub share_q8: u32,
}

/// The parameters of a gate. None can be set so that a check is off, and zeroed settings are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_settings {
    /// The task that the table must be for.
    pub task: [c_char; POSEGATE_NAME_LENGTH],
    /// SHA-256 of the site file that the table must be made from.
    pub site_digest: [u8; 32],
    /// The sources, by the number that their reports carry.
    pub sources: [posegate_source; POSEGATE_MOST_SOURCES],
    /// How many of them there are: from 1.
    pub source_count: u32,
    /// The oldest estimate that may hold the interlock open, milliseconds: from 1 to 2^31 - 1. Its age is
    /// judged at the end of the permission, `response_ms` after the time of the step.
    pub maximum_age_ms: u32,
    /// The longest time from the `now_ms` of one step or tick until the output has followed the answer of the
    /// next one, milliseconds: from 1, and less than `maximum_age_ms`. It is the sum of the longest period of the
    /// control cycle, the longest time of a step (some 9,000 instructions on a Cortex-M4F, 24,000 on a Cortex-M0+;
    /// with cells up to eleven times the bound of `posegate table info`) and that of the output. A cycle that is
    /// later while the gate is open closes it: `POSEGATE_REASON_CYCLE_LATE`.
    pub response_ms: u32,
    /// A permit ends when no further one has come for longer, milliseconds: from 1 to 2^31 - 1.
    pub permit_hold_ms: u32,
    /// After a denial, and after the start, nothing is permitted for so long, milliseconds: from 1 to
    /// 2^31 - 1.
    pub inhibit_hold_ms: u32,
    /// So many reports in a row must permit: from 1 to 65,535.
    pub permits_in_a_row: u32,
    /// A `posegate_restart`.
    pub restart: u32,
    /// The tag that the robot should look at to relocalise for this task, for advice alone, or
    /// `POSEGATE_NO_TAG`.
    pub look_at_tag: u32,
}

// SAFETY: numbers.
unsafe impl Plain for posegate_settings {}

/// The bytes of a name, up to the first zero.
pub(super) fn name(from: &[c_char; POSEGATE_NAME_LENGTH]) -> ([u8; POSEGATE_NAME_LENGTH], usize) {
    let bytes = from.map(|character| {
        let [byte] = character.to_ne_bytes();
        byte
    });
    let length = bytes.iter().take_while(|byte| **byte != 0).count();
    (bytes, length)
}

impl posegate_source {
    pub(super) fn source(&self) -> Result<Source, posegate_status> {
        const FILLED: u32 = posegate_cross_terms::Filled as u32;
        const YAW_UNKNOWN: u32 = posegate_cross_terms::YawUnknown as u32;
        const ALL_UNKNOWN: u32 = posegate_cross_terms::AllUnknown as u32;
        let share = u8::try_from(self.share_q8)
            .ok()
            .and_then(SplitWeight::from_q8);
        let share = share.ok_or(posegate_status::CrossTerms);
        let cross_terms = match self.cross_terms {
            FILLED => CrossTerms::Filled,
            YAW_UNKNOWN => CrossTerms::YawUnknown(share?),
            ALL_UNKNOWN => CrossTerms::AllUnknown(share?),
            _ => return Err(posegate_status::CrossTerms),
        };
        let (bytes, length) = name(&self.frame);
        let frame = bytes.get(..length).unwrap_or_default();
        let frame = core::str::from_utf8(frame).map_err(|_| posegate_status::Frame)?;
        Ok(Source::new(frame, self.inflation, cross_terms)?)
    }
}

impl posegate_settings {
    pub(super) const fn restart(&self) -> Result<Restart, posegate_status> {
        const AUTOMATIC: u32 = posegate_restart::Automatic as u32;
        const ON_RESET: u32 = posegate_restart::OnReset as u32;
        match self.restart {
            AUTOMATIC => Ok(Restart::Automatic),
            ON_RESET => Ok(Restart::OnReset),
            _ => Err(posegate_status::Restart),
        }
    }

    pub(super) const fn look_at(&self) -> Option<u32> {
        match self.look_at_tag {
            POSEGATE_NO_TAG => None,
            tag => Some(tag),
        }
    }
}
