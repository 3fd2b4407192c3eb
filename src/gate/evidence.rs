//! The input of a step: a report, its other hypotheses, and the slip of its odometry.

use crate::report::{PoseEstimate, Report};
use crate::set::{Growth, Uncertainty};
use crate::task::Risk;

/// Largest number of hypotheses of one report, the report's own estimate included.
pub const MOST_HYPOTHESES: usize = 8;

/// A report with its other hypotheses and the slip of its odometry.
///
/// A source may have several hypotheses: the clusters of a particle filter, or the two solutions of a tag that is seen
/// head-on. The robot is at one of them. A gate permits only if the pose-set of *every* hypothesis is inside. The weight of
/// omitted hypotheses (such as small clusters) reduces the confidence of the site: the sets grow accordingly, or the
/// report is denied. Bounded sets and carried fixes cannot grow for this, so they are denied.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Evidence<'r> {
    /// The report. Its own estimate is hypothesis 0.
    pub report: &'r Report,
    /// Hypotheses 1, 2 and so on, at most seven, in the frame and with the stamp of the report.
    pub others: &'r [PoseEstimate],
    /// Bound of the slip of the odometry until the stamp: added to the pose-set of every hypothesis.
    pub beside: Growth,
    /// The probability that the robot is at none of the hypotheses: the weight of the omitted hypotheses.
    pub elsewhere: Risk,
    /// The time from the source's last fix (a tag, a scan that matched) until the stamp, milliseconds, rounded up; `None` if it is not
    /// known. It chooses the factor of [`super::Source::aging`]; without it the source's own inflation applies.
    pub since_fix_ms: Option<u32>,
}

impl<'r> Evidence<'r> {
    /// Returns the evidence of a report without other hypotheses and without slip.
    #[must_use]
    pub const fn of(report: &'r Report) -> Self {
        Self {
            report,
            others: &[],
            beside: Growth::NONE,
            elsewhere: Risk::NONE,
            since_fix_ms: None,
        }
    }

    /// Returns `true` if larger sets can compensate omitted hypotheses: only for normal errors. A bound states no distribution, and
    /// slip is not part of the sets.
    pub(super) fn can_make_up(&self) -> bool {
        self.beside == Growth::NONE
            && self
                .hypotheses()
                .all(|(_, estimate)| !matches!(estimate.spread, Some(Uncertainty::Bounded { .. })))
    }

    /// Returns the estimates with their numbers.
    pub(super) fn hypotheses(&self) -> impl Iterator<Item = (u8, &'r PoseEstimate)> {
        let all = core::iter::once(&self.report.belief).chain(self.others);
        // At most 256: a corrupted length ends.
        (0..=u8::MAX).zip(all)
    }
}
