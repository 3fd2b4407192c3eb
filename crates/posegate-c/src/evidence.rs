//! A report with its other hypotheses, and with the bounded slip of its odometry.

use super::memory::{Plain, check, read, unused};
use super::report::no_estimate;
use super::{posegate_belief, posegate_report, posegate_status, posegate_verdict};
use posegate::gate::{Evidence, MOST_HYPOTHESES};
use posegate::report::{PoseEstimate, Report};
use posegate::set::Growth;
use posegate::task::Risk;

/// Largest number of hypotheses of one report, the report's own estimate included.
pub const POSEGATE_MOST_HYPOTHESES: usize = 8;
/// Largest number of hypotheses in addition to the report's own.
pub const POSEGATE_OTHERS: usize = 7;

/// A report with its other hypotheses. The robot is at one of the hypotheses, so a gate permits only if each is inside. Examples: the
/// clusters of a particle filter, or the two poses from which a tag that is seen head-on looks the same.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_evidence {
    /// The report. Its own estimate is hypothesis 0.
    pub report: posegate_report,
    /// Hypotheses 1, 2 and so on, in the frame and with the stamp of the report.
    pub others: [posegate_belief; POSEGATE_OTHERS],
    /// The number of valid entries of `others`: from 0 to `POSEGATE_OTHERS`.
    pub other_count: u32,
    /// Bound of the slip of the odometry until the stamp, in any direction, micrometres: added to every hypothesis.
    pub beside_um: u32,
    /// The same bound for the heading, to either side, unit 2^-24 turn.
    pub beside_q24: u32,
    /// The probability that the robot is at none of the hypotheses, unit 2^-32, rounded up: the weight of the omitted hypotheses.
    pub elsewhere_q32: u32,
    /// The time from the source's last fix until the stamp, milliseconds, rounded up, at least 1; 0 if it is not known. It chooses the
    /// factor of `posegate_source.ages`; without it the source's own inflation applies.
    pub since_fix_ms: u32,
    /// Reserved: must be 0.
    pub reserved: u32,
}

/// A verdict on a report with several hypotheses.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_examined {
    /// The verdict, with margin and worst pose.
    pub verdict: posegate_verdict,
    /// The number of the hypothesis of this verdict: the first denied hypothesis, else the one with the least margin.
    pub hypothesis: u32,
    /// Reserved: 0.
    pub reserved: u32,
}

const _: () =
    assert!(POSEGATE_MOST_HYPOTHESES == MOST_HYPOTHESES && POSEGATE_OTHERS + 1 == MOST_HYPOTHESES);

// SAFETY: numbers.
unsafe impl Plain for posegate_evidence {}

// SAFETY: numbers.
unsafe impl Plain for posegate_examined {}

impl posegate_evidence {
    /// Evidence of no form, which closes every gate.
    pub(super) const NONE: Self = Self {
        report: posegate_report {
            source: u32::MAX,
            ..Plain::ZERO
        },
        other_count: u32::MAX,
        ..Self::ZERO
    };
}

/// Evidence that has been read, in the core's types.
pub(super) struct Read {
    report: Report,
    others: [PoseEstimate; POSEGATE_OTHERS],
    count: usize,
    beside: Growth,
    elsewhere: Risk,
    since_fix_ms: Option<u32>,
}

impl Read {
    /// Reads evidence, part by part, so that the stack never holds a copy of the whole struct.
    ///
    /// # Safety
    /// As for [`read`].
    pub(super) unsafe fn from(evidence: *const posegate_evidence) -> Result<Self, posegate_status> {
        // SAFETY: the caller's promise; a null or misaligned pointer is refused before anything is read.
        unsafe {
            check(evidence)?;
            let report = read(&raw const (*evidence).report)?.report()?;
            unused(read(&raw const (*evidence).reserved)?)?;
            let count = read(&raw const (*evidence).other_count)?;
            let count = usize::try_from(count).unwrap_or(usize::MAX);
            if count > POSEGATE_OTHERS {
                return Err(posegate_status::BadLength);
            }
            let mut others = [no_estimate(); POSEGATE_OTHERS];
            let mut given = (&raw const (*evidence).others).cast::<posegate_belief>();
            for other in others.iter_mut().take(count) {
                *other = read(given)?.belief()?;
                given = given.wrapping_add(1);
            }
            Ok(Self {
                report,
                others,
                count,
                beside: Growth::new(
                    read(&raw const (*evidence).beside_um)?,
                    read(&raw const (*evidence).beside_q24)?,
                ),
                elsewhere: Risk::from_q32(read(&raw const (*evidence).elsewhere_q32)?),
                since_fix_ms: Some(read(&raw const (*evidence).since_fix_ms)?)
                    .filter(|since_fix_ms| *since_fix_ms != 0),
            })
        }
    }

    pub(super) fn evidence(&self) -> Evidence<'_> {
        Evidence {
            report: &self.report,
            others: self.others.get(..self.count).unwrap_or_default(),
            beside: self.beside,
            elsewhere: self.elsewhere,
            since_fix_ms: self.since_fix_ms,
        }
    }
}
