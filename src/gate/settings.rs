//! The settings of a gate.

use crate::motion::MotionBounds;
use crate::report::FrameId;
use crate::set::{Aging, CrossTerms, Growth, Inflation, Trust};

/// A localization source as the controller knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Source {
    /// The frame that the source's reports must be in: the world frame of the site.
    pub frame: FrameId,
    /// The trust in the source's covariances, for any time since its last fix.
    pub trust: Trust,
    /// Smaller inflations for estimates soon after a fix ([`super::Evidence::since_fix_ms`]); none is larger than that of `trust`.
    /// [`Aging::NONE`] if one factor is used.
    pub aging: Aging,
    /// The largest speeds of the robot, from the stamp of an estimate until its permission ends.
    /// [`MotionBounds::STANDS_STILL`] if other means ensure that it does not move.
    pub motion: MotionBounds,
}

impl Source {
    /// Returns a source in a named frame, whose covariances are multiplied by `inflation`, of a robot that moves within
    /// `motion`.
    ///
    /// # Errors
    /// [`InvalidParameter::Frame`] for an empty name; [`InvalidParameter::Inflation`] unless the factor
    /// is a number from 1 to 4096.
    pub fn new(
        frame: &str,
        inflation: f64,
        cross_terms: CrossTerms,
        motion: MotionBounds,
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
        Ok(Self {
            frame,
            trust,
            aging: Aging::NONE,
            motion,
        })
    }

    /// Returns the trust in an estimate at a time since the last fix: the factor of its age, or that of the source if `since_fix_ms` is `None`.
    #[must_use]
    pub fn trust_after(&self, since_fix_ms: Option<u32>) -> Trust {
        match since_fix_ms {
            Some(since_fix_ms) => Trust {
                inflation: self.aging.at(since_fix_ms, self.trust.inflation),
                ..self.trust
            },
            None => self.trust,
        }
    }

    /// Returns the same in another form, for the second evaluation.
    pub(super) fn trust_again(&self, since_fix_ms: Option<u32>) -> Trust {
        let age_ms = since_fix_ms.unwrap_or(u32::MAX);
        Trust {
            inflation: self.aging.at_from_oldest(age_ms, self.trust.inflation),
            ..self.trust
        }
    }
}

/// The condition for a restart after a permit has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Restart {
    /// After a denial the gate qualifies again by itself. Only faults wait for a reset.
    Automatic,
    /// After every end of a permit the gate waits for a reset (no automatic restart, ISO 3691-4:2020, 4.1.14).
    OnReset,
}

/// The parameters of a gate. No accepted value switches a check off.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings<'a> {
    /// The task that the table must be for.
    pub task: &'a str,
    /// The task digest that the table must have: SHA-256 of the set, the goal and the confidence (`posegate table info` prints it).
    pub task_digest: [u8; 32],
    /// The sources. A report carries the index of its source.
    pub sources: &'a [Source],
    /// The oldest estimate that may keep the interlock open, in milliseconds: from 1 to 2^31 - 1. The age counts up
    /// to the end of the permission, which is [`Settings::response_ms`] after the time of the step.
    pub maximum_age_ms: u32,
    /// The longest time from the `now_ms` of one step or tick until the output has followed the answer of the next
    /// one, in milliseconds: at least 1, and less than `maximum_age_ms`. It is the sum of the longest period of the
    /// control cycle, the longest duration of a step and the delay of the output. A step on the table of a box takes about 5,200 instructions
    /// (Cortex-M4F; Cortex-M0+: 12,000), one on another table up to the bound of `posegate table info` ([`Settings::most_runs`] lowers that of cells) and,
    /// for the second evaluation, 3,700 (10,200) with facets and 31,300 (79,300) with cells. If a later cycle finds the gate open, the gate
    /// closes ([`super::Reason::CycleLate`]).
    pub response_ms: u32,
    /// The longest time between two reports of the sources, in milliseconds: from 1 to 2^31 - 1. A step does not use it. Settings with
    /// which reports at this distance would never open the gate are refused.
    pub report_period_ms: u32,
    /// A permit ends if no further permit comes for longer than this, in milliseconds: from 1 to 2^31 - 1; at least
    /// [`Settings::report_period_ms`] if more than one permit in a row is needed.
    pub permit_hold_ms: u32,
    /// After a denial, and after the start, nothing is permitted for this time, in milliseconds: from 1 to 2^31 - 1.
    pub inhibit_hold_ms: u32,
    /// The number of consecutive reports that must permit before the gate opens: from 1 to 65,535.
    pub permits_in_a_row: u16,
    /// The condition for a restart after a permit has ended.
    pub restart: Restart,
    /// The largest number of runs of cells that a decision reads (a row without a run counts as one), for a table with cells. A pose-set that
    /// needs more is denied with [`super::Reason::TooCostly`]. `Table::within(most_runs).worst_case()` bounds the instructions: a run takes
    /// at most 150 on a Cortex-M4F, and each slab of headings that a set meets 3,500. Facets are not affected. Zero: cells permit nothing. Read once, when the gate is made or reset.
    pub most_runs: u32,
    /// The tag that the robot should look at to relocalise for this task. Only [`super::Advice`] uses it.
    pub look_at: Option<u32>,
}

/// A parameter that would switch a check off, or with which a gate would never open.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum InvalidParameter {
    /// The maximum age is zero, or at least half of the range of the millisecond clock.
    MaximumAge,
    /// The response time is zero, or not less than the maximum age.
    ResponseTime,
    /// The permit hold time is zero, or at least half of the range of the millisecond clock.
    PermitHold,
    /// The inhibit hold time is zero, or at least half of the range of the millisecond clock.
    InhibitHold,
    /// The number of permits in a row is zero.
    PermitsInARow,
    /// The task has no name.
    Task,
    /// No source is declared, or more than 256 sources are.
    Sources,
    /// A source has no frame.
    Frame,
    /// An inflation is not a number, below 1 or above 4096.
    Inflation,
    /// The inflations by age of a source are damaged, or one is larger than the source's own.
    Aging,
    /// A time of the interlock (read-back, heartbeat) is zero, or 2^31 ms or more.
    InterlockTime,
    /// The report period is zero, or at least half of the range of the millisecond clock.
    ReportPeriod,
    /// A permit ends before the next report: consecutive permits are never counted, or the inhibit hold time is not over then.
    PermitHoldTooShort {
        /// The smallest permit hold time that is valid, in milliseconds.
        least_ms: u32,
    },
    /// An estimate is too old before the next report, with the same result.
    MaximumAgeTooShort {
        /// The smallest maximum age that is valid, in milliseconds.
        least_ms: u32,
    },
}

impl core::fmt::Display for InvalidParameter {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::MaximumAge => "the maximum age is zero, or 2^31 ms or more",
            Self::ResponseTime => "the response time is zero, or not less than the maximum age",
            Self::PermitHold => "the permit hold time is zero, or 2^31 ms or more",
            Self::InhibitHold => "the inhibit hold time is zero, or 2^31 ms or more",
            Self::PermitsInARow => "the number of permits in a row is zero",
            Self::Task => "the task has no name",
            Self::Sources => "no source is declared, or more than 256 sources are",
            Self::Frame => "a source has no frame",
            Self::Inflation => "an inflation is not a number, below 1 or above 4096",
            Self::Aging => "an inflation by age is larger than the source's own, or its table is damaged",
            Self::InterlockTime => {
                "a time of the interlock (read-back, heartbeat) is zero, or 2^31 ms or more"
            }
            Self::ReportPeriod => "the report period is zero, or 2^31 ms or more",
            Self::PermitHoldTooShort { least_ms } => {
                return write!(
                    f,
                    "the gate would never open: a permit ends before the next report comes; let the permit hold time be \
                     {least_ms} ms or more"
                );
            }
            Self::MaximumAgeTooShort { least_ms } => {
                return write!(
                    f,
                    "the gate would never open: an estimate is too old before the next report comes; let the maximum age be \
                     {least_ms} ms or more"
                );
            }
        })
    }
}

impl core::error::Error for InvalidParameter {}

impl Settings<'static> {
    /// Returns the times for a source that reports every `period_ms`, and whose reports arrive up to `jitter_ms` after their stamps.
    /// Task, site and sources are still empty, so a gate on it alone is refused:
    ///
    /// ```
    /// use posegate::gate::{InvalidParameter, Settings, Source};
    /// use posegate::motion::MotionBounds;
    /// use posegate::set::CrossTerms;
    ///
    /// // AMCL at 2 Hz, whose estimates are up to 100 ms old when they arrive.
    /// let source = Source::new("map", 1.0, CrossTerms::Filled, MotionBounds::STANDS_STILL)?;
    /// let settings = Settings {
    ///     task: "dock",
    ///     task_digest: [0; 32],
    ///     sources: &[source],
    ///     ..Settings::for_source(500, 100)
    /// };
    /// settings.check()?;
    /// assert_eq!((settings.permit_hold_ms, settings.maximum_age_ms), (620, 640));
    /// # Ok::<(), InvalidParameter>(())
    /// ```
    ///
    /// Two reports arrive at most `period_ms + jitter_ms` apart, and the older one is at most that old when the next one arrives:
    /// - `report_period_ms` is this time.
    /// - `response_ms` is 20: set it to that of your controller, and add the difference to the permit hold time and twice the difference to
    ///   the maximum age.
    /// - `permit_hold_ms` adds one response, since a report may wait for the next cycle.
    /// - `maximum_age_ms` adds two, since the age counts up to the end of the permission.
    /// - `inhibit_hold_ms` is this time: after a denial at least one further report is evaluated before the gate opens.
    /// - `permits_in_a_row` is 3.
    /// - `most_runs` is 1,000, such as 50 rows in each of 20 slabs of headings: 1 m and 20 deg on cells of 2 cm and 1 deg.
    ///
    /// One lost report closes the gate. To tolerate one, give twice the period. Longer times cost margin, since the movement that is
    /// possible in them ([`Source::motion`]) is added to every set. Odometry makes the times short ([`crate::track`]): then the period
    /// is that of the odometry. Times beyond 2^31 ms are refused when the gate is made.
    #[must_use]
    pub const fn for_source(period_ms: u32, jitter_ms: u32) -> Self {
        const RESPONSE_MS: u32 = 20;
        let apart = period_ms.saturating_add(jitter_ms);
        Self {
            task: "",
            task_digest: [0; 32],
            sources: &[],
            maximum_age_ms: apart.saturating_add(2 * RESPONSE_MS),
            response_ms: RESPONSE_MS,
            report_period_ms: apart,
            permit_hold_ms: apart.saturating_add(RESPONSE_MS),
            inhibit_hold_ms: apart,
            permits_in_a_row: 3,
            restart: Restart::Automatic,
            most_runs: 1_000,
            look_at: None,
        }
    }
}

impl Settings<'_> {
    /// Checks that no parameter switches a check off, and that reports at their usual distance can open the gate.
    ///
    /// # Errors
    /// The first invalid parameter.
    pub fn check(&self) -> Result<(), InvalidParameter> {
        let time = |ms: u32, wrong| is_time(ms).then_some(()).ok_or(wrong);
        time(self.maximum_age_ms, InvalidParameter::MaximumAge)?;
        if !(self.response_ms > 0 && self.response_ms < self.maximum_age_ms) {
            return Err(InvalidParameter::ResponseTime);
        }
        time(self.permit_hold_ms, InvalidParameter::PermitHold)?;
        time(self.inhibit_hold_ms, InvalidParameter::InhibitHold)?;
        time(self.report_period_ms, InvalidParameter::ReportPeriod)?;
        if self.permits_in_a_row == 0 {
            return Err(InvalidParameter::PermitsInARow);
        }
        let period = self.report_period_ms;
        if self.permits_in_a_row > 1 {
            if self.permit_hold_ms < period {
                let least_ms = period;
                return Err(InvalidParameter::PermitHoldTooShort { least_ms });
            }
            if self.oldest_ms() < period {
                let least_ms = period.saturating_add(self.response_ms);
                return Err(InvalidParameter::MaximumAgeTooShort { least_ms });
            }
        } else {
            // A permit that ends by itself restarts the inhibit hold time, which must be over when the next report comes.
            let lasts = self.permit_hold_ms.min(self.oldest_ms());
            let again = lasts
                .saturating_add(self.inhibit_hold_ms)
                .saturating_add(self.response_ms);
            if lasts < period && again > period {
                return Err(if self.permit_hold_ms < period {
                    InvalidParameter::PermitHoldTooShort { least_ms: period }
                } else {
                    let least_ms = period.saturating_add(self.response_ms);
                    InvalidParameter::MaximumAgeTooShort { least_ms }
                });
            }
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
            if !(source.aging.is_valid() && source.aging.is_within(source.trust.inflation)) {
                return Err(InvalidParameter::Aging);
            }
        }
        Ok(())
    }

    /// Returns the greatest age of an estimate that permits in a step, in milliseconds, so that the estimate does not
    /// exceed the maximum age before the permission ends. Returns 0 for settings that [`Settings::check`] refuses.
    pub(super) fn oldest_ms(&self) -> u32 {
        self.maximum_age_ms.saturating_sub(self.response_ms)
    }

    /// Returns the largest movement from the stamp of an estimate of this age until its permission ends: at the
    /// maximum age at the latest, and when the permit hold time and the response time are over. One millisecond is added: stamps and the
    /// clock are whole milliseconds, both rounded down.
    #[must_use]
    pub fn movement(&self, motion: MotionBounds, age_ms: u32) -> Growth {
        if motion.stands_still() {
            return Growth::NONE;
        }
        let ends = age_ms
            .saturating_add(self.permit_hold_ms)
            .saturating_add(self.response_ms);
        motion.within(ends.min(self.maximum_age_ms).saturating_add(1))
    }

    /// Returns a digest of every setting that a step uses, to detect flipped bits in the settings or in the reference
    /// to them.
    pub(super) fn digest(&self) -> u32 {
        let words = [
            self.maximum_age_ms,
            self.response_ms,
            self.permit_hold_ms,
            self.inhibit_hold_ms,
            u32::from(self.permits_in_a_row) << 1 | u32::from(self.restart == Restart::OnReset),
        ];
        let own = words.into_iter().fold(0x9e37_79b9, mixed);
        // At most 256 sources, so that the loop ends even if the slice's length is corrupted.
        self.sources.iter().take(256).fold(own, |sum, source| {
            let frame = source.frame.digest();
            let terms = match source.trust.cross_terms {
                CrossTerms::Filled => 0,
                CrossTerms::YawUnknown(share) => 0x100 | u32::from(share.q8()),
                CrossTerms::AllUnknown(share) => 0x200 | u32::from(share.q8()),
            };
            let [speed, side, turn] = source.motion.words();
            [
                // A flipped bit of one part changes the word.
                frame as u32 ^ (frame >> 32) as u32,
                source.trust.inflation.q16() ^ terms ^ source.aging.digest(),
                speed ^ side.rotate_left(16),
                turn,
            ]
            .into_iter()
            .fold(sum, mixed)
        })
    }
}

/// Returns the digest extended by one word. For a fixed `sum` or a fixed `word` the map is one-to-one, so no bit is
/// lost.
const fn mixed(sum: u32, word: u32) -> u32 {
    sum.rotate_left(7).wrapping_add(word)
}

/// Parses a task digest from its 64 hexadecimal digits, as `posegate table info` prints it. Returns
/// `None` for any other text.
#[must_use]
pub const fn task_digest(digits: &str) -> Option<[u8; 32]> {
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

/// Returns `true` if a wrapping clock of 32 bits can measure this time: above zero and below half of the clock's
/// range.
pub(super) const fn is_time(ms: u32) -> bool {
    ms >= 1 && ms < 1 << 31
}

#[cfg(test)]
mod tests {
    use super::task_digest;

    #[test]
    fn digests_are_read_from_their_digits() {
        let digits: String = (0..32u8)
            .map(|v| format!("{:02x}", v.wrapping_mul(9)))
            .collect();
        let expected = core::array::from_fn(|k| (k as u8).wrapping_mul(9));
        assert_eq!(task_digest(&digits), Some(expected));
        assert_eq!(task_digest(&digits.to_uppercase()), Some(expected));
        for bad in [
            "",
            &digits[1..],
            &format!("{digits}0"),
            &format!("{digits}00"),
        ] {
            assert_eq!(task_digest(bad), None, "{bad}");
        }
        for bad in ['g', '/', ':', '@', '`', ' '] {
            assert_eq!(
                task_digest(&digits.replacen('0', &format!("{bad}"), 1)),
                None
            );
        }
    }
}
