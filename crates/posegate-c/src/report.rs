//! Reports of sources, and the frames of their numbers.

use super::call::answer;
use super::memory::{Plain, bytes, unused};
use super::{posegate_belief, posegate_status};
use core::ffi::c_char;
use posegate::report::{FrameId, Heading, PoseEstimate, Report};

/// An estimate with everything that a gate needs to know about it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_report {
    /// The estimate of the source.
    pub belief: posegate_belief,
    /// The frame of the estimate, from `posegate_frame_id`.
    pub frame: u64,
    /// The index, in `posegate_settings.sources`, of the source that sent the report.
    pub source: u32,
    /// The source's count of its reports: one more each time, wrapping.
    pub sequence: u32,
    /// The time of the estimate, milliseconds of the controller's wrapping clock.
    pub stamp_ms: u32,
    /// Reserved: must be 0.
    pub reserved: u32,
}

// SAFETY: numbers.
unsafe impl Plain for posegate_report {}

impl posegate_report {
    pub(super) fn report(&self) -> Result<Report, posegate_status> {
        unused(self.reserved)?;
        Ok(Report {
            // A gate has fewer than 255 sources, so a larger number is not a source.
            source: u8::try_from(self.source).unwrap_or(u8::MAX),
            frame: FrameId::from_digest(self.frame),
            sequence: self.sequence,
            stamp_ms: self.stamp_ms,
            belief: self.belief.belief()?,
        })
    }
}

/// Returns an estimate of unknown uncertainty, which denies.
pub(super) const fn no_estimate() -> PoseEstimate {
    PoseEstimate {
        x_m: 0.0,
        y_m: 0.0,
        heading: Heading::Radians(0.0),
        spread: None,
    }
}

/// Returns the report that a gate receives instead of an invalid one. It is from a source that no gate has. One function,
/// to save flash.
#[inline(never)]
pub(super) const fn no_report() -> Report {
    Report {
        source: u8::MAX,
        frame: FrameId::UNNAMED,
        sequence: 0,
        stamp_ms: 0,
        belief: no_estimate(),
    }
}

/// Writes the number of a frame's name for reports, such as of "map" with its length 3: 64-bit FNV-1a, a
/// leading `/` dropped. 0 for an empty name, which no source can be declared with.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` if the name is not UTF-8.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type; `length` bytes of the name can be
/// read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_frame_id(
    name: *const c_char,
    length: usize,
    frame: *mut u64,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(frame, || {
            let name = core::str::from_utf8(bytes(name.cast(), length)?);
            Ok(FrameId::of(name.map_err(|_| posegate_status::BadValue)?).digest())
        })
    }
}
