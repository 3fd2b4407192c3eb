//! What a gate weighs in a step: a report, its other hypotheses, and what the robot can have moved beside them.

use crate::report::{PoseEstimate, Report};
use crate::set::{Growth, Uncertainty};
use crate::task::Risk;

/// Largest number of hypotheses of one report, the report's own estimate included.
pub const MOST_HYPOTHESES: usize = 8;

/// A report with what belongs to it.
///
/// A source may believe in several places at once: the clusters of a particle filter, the two solutions of a tag that is seen
/// squarely. The robot is at one of them. A gate permits only if the pose-set of *every* hypothesis is inside. What the listed
/// hypotheses leave out (clusters of little weight) counts against the confidence of the site: the sets grow accordingly, or the
/// report is denied. Sets with a bound, and fixes that were carried, cannot make up for it.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Evidence<'r> {
    /// The report. Its own estimate is hypothesis 0.
    pub report: &'r Report,
    /// Hypotheses 1, 2 and so on, at most seven, in the frame and with the stamp of the report.
    pub others: &'r [PoseEstimate],
    /// What the robot can have moved beside the estimates until the stamp: the slip of its odometry.
    pub beside: Growth,
    /// The probability that the robot is at none of the hypotheses: the weight of the clusters that are left out.
    pub elsewhere: Risk,
    /// The time from the source's last fix (a tag, a scan that matched) until the stamp, milliseconds, rounded up; `None` if it is not
    /// known. It chooses the factor of [`super::Source::aging`]; without it the source's own inflation applies.
    pub since_fix_ms: Option<u32>,
}

impl<'r> Evidence<'r> {
    /// Returns a report alone.
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

    /// Returns `true` if larger sets can make up for what is left out: of normal errors only. A bound states no distribution, and what
    /// odometry leaves open is beside the sets.
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
