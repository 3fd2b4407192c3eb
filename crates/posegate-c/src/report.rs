//! Reports of sources, and the frames that their numbers are in.

use super::memory::{Plain, answer, bytes};
use super::{posegate_belief, posegate_status};
use core::ffi::c_char;
use posegate::report::{FrameId, Heading, PoseEstimate, Report};

/// A belief with all that a gate must know of it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_report {
    /// What the source says.
    pub belief: posegate_belief,
    /// The frame of its numbers, from `posegate_frame_id`.
    pub frame: u64,
    /// Which of the gate's sources sent it: its place in the settings.
    pub source: u32,
    /// Counts the source's reports: one more each time, wrapping.
    pub sequence: u32,
    /// When it was made, milliseconds of the controller's wrapping clock.
    pub stamp_ms: u32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: numbers.
unsafe impl Plain for posegate_report {}

impl posegate_report {
    pub(super) fn report(&self) -> Result<Report, posegate_status> {
        Ok(Report {
            // Sources are fewer than 255: a number beyond is of none.
            source: u8::try_from(self.source).unwrap_or(u8::MAX),
            frame: FrameId::from_digest(self.frame),
            sequence: self.sequence,
            stamp_ms: self.stamp_ms,
            belief: self.belief.belief()?,
        })
    }
}

/// What a gate is fed with in the place of what is no report: of a source that no gate has.
pub(super) const NO_REPORT: Report = Report {
    source: u8::MAX,
    frame: FrameId::UNNAMED,
    sequence: 0,
    stamp_ms: 0,
    belief: PoseEstimate {
        x_m: 0.0,
        y_m: 0.0,
        heading: Heading::Radians(0.0),
        spread: None,
    },
};

/// The number of a frame's name, such as "map" with its length 3, for the reports: 64-bit FNV-1a, a leading
/// `/` dropped. 0 for an empty name, which no source can be declared with.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` for a name that is not UTF-8.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says; `length` bytes of the name can be
/// read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_frame_id(
    name: *const c_char,
    length: usize,
    frame: *mut u64,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let digest = bytes(name.cast(), length).and_then(|name| {
            let name = core::str::from_utf8(name).map_err(|_| posegate_status::BadValue)?;
            Ok(FrameId::of(name).digest())
        });
        answer(frame, digest, 0)
    })
}
