//! A recording held against the gate: each estimate through the code that runs on the controller, and through the
//! rules that are in use without it; against the truth, where it was recorded.
//!
//! Two things are said of each estimate. Its *verdict* is that of [`Judge`], with margin and worst pose, the same that
//! `posegate gate` prints. The *permission* is that of [`Gate`], which remembers: freshness, permits in a row, hold
//! times. Memory does not grow with the recording: what is kept are counts ([`Tally`], [`Timeline`], [`Stanford`])
//! and estimates that wait for a true pose, [`MOST_WAITING`] at most.

pub use self::against::Against;
pub use self::channels::Channels;
pub use self::play::{Part, PlayError, play};
pub use self::row::Row;
pub use self::rules::{RULES, Rules, Thresholds};
pub use self::stanford::{END as STANFORD_END, Region, STEPS as STANFORD_STEPS, Stanford};
pub use self::tally::{Spans, Tally};
pub use self::timeline::{Bucket, Timeline};

mod against;
mod channels;
mod play;
mod row;
mod rules;
mod stanford;
mod summary;
mod tally;
mod timeline;

use super::recording::{Findings, Sample};
use super::{At, Track, clock_ms};
use crate::contain::Margin;
use crate::gate::{Gate, InvalidParameter, Judge, Reason, Settings, Verdict};
use crate::log::factor;
use crate::report::{FrameId, Report};
use crate::set::Spread;
use crate::shape::SuccessSet;
use rayon::prelude::*;
use std::collections::VecDeque;
use std::vec::Vec;

/// How many estimates wait for a true pose at most; then the first goes without.
pub const MOST_WAITING: usize = 1 << 16;
/// Two clocks that are farther apart than this, seconds, are not one.
const SAME_CLOCK_S: f64 = 3600.0;

/// By which clock the gate looks at stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// When each estimate was recorded, or used (`now_s`): ages are known.
    Logged,
    /// The stamps themselves: every estimate counts as just made.
    Stamps,
}

/// What a recording is held against.
#[derive(Clone, Copy, Debug)]
pub struct Setup<'a> {
    /// The bytes of the task's table.
    pub table: &'a [u8],
    /// The gate's settings; its sources are those of the recording, by their numbers.
    pub settings: &'a Settings<'a>,
    /// The success set itself, which the truth is held against.
    pub success: &'a SuccessSet,
    /// A bounded set about each estimate in place of its covariance: metres, radians.
    pub bounded: Option<[f64; 2]>,
    /// The world frame's name.
    pub world: &'a str,
    /// The clock; `None` for the recorded times where they are of the same clock as the stamps.
    pub clock: Option<Clock>,
    /// The thresholds of other rules.
    pub thresholds: Thresholds,
    /// Whether margins and worst poses are looked for: a few dozen decisions more for each estimate. Without them
    /// the verdict is what the gate's own step says, and the Stanford diagram is empty.
    pub examined: bool,
}

/// A recording that is held against a gate.
pub struct Replay<'a> {
    setup: Setup<'a>,
    judge: Judge<'a>,
    gate: Gate<'a>,
    world: FrameId,
    clock: Option<Clock>,
    track: Option<Track>,
    waiting: VecDeque<Row>,
    sequences: [u32; 256],
    next: u64,
    last_now_ms: u32,
    findings: Findings,
    rules: Rules,
    counts: tally::Counts,
    timeline: Timeline,
    stanford: Stanford,
}

impl<'a> Replay<'a> {
    /// Begins. `track` has the true poses where they are not in the rows; more may be added to it
    /// ([`Replay::truth`]).
    ///
    /// # Errors
    /// [`InvalidParameter`]: a setting that would switch a check off.
    pub fn new(setup: &Setup<'a>, track: Option<Track>) -> Result<Self, InvalidParameter> {
        let judge = Judge::new(setup.table, setup.settings.maximum_age_ms)?;
        Ok(Self {
            setup: *setup,
            judge,
            // Made anew at the first estimate's time.
            gate: Gate::new(setup.table, setup.settings, 0)?,
            world: FrameId::of(setup.world),
            clock: setup.clock,
            track,
            waiting: VecDeque::new(),
            sequences: [0; 256],
            next: 0,
            last_now_ms: 0,
            findings: Findings::default(),
            rules: Rules::new(setup.thresholds, setup.success.goal),
            counts: tally::Counts::default(),
            timeline: Timeline::default(),
            stanford: Stanford::default(),
        })
    }

    /// Adds a true pose (m, m, rad) of a time.
    pub fn truth(&mut self, t_s: f64, pose: [f64; 3]) {
        if let Some(track) = &mut self.track {
            track.push(t_s, pose);
        }
    }

    /// Takes estimates in the order in which they were recorded; `out` is given each row once its truth is known.
    /// A batch of a thousand or so keeps every core at work.
    pub fn estimates<E>(
        &mut self,
        samples: &[Sample],
        out: &mut impl FnMut(&Row) -> Result<(), E>,
    ) -> Result<(), E> {
        let Some(first) = samples.first() else {
            return Ok(());
        };
        if self.clock.is_none() {
            let same = |logged: f64| (logged - first.t_s).abs() < SAME_CLOCK_S;
            let logged = first.logged_s.is_some_and(same);
            self.clock = Some(if logged { Clock::Logged } else { Clock::Stamps });
        }
        let mut examined: Vec<Option<Verdict>> = Vec::new();
        if self.setup.examined {
            let this = &*self;
            let each = samples.par_iter().with_min_len(32);
            let each = each.map(|sample| Some(this.judged(&this.report(sample), sample)));
            each.collect_into_vec(&mut examined);
        }
        for (index, sample) in samples.iter().enumerate() {
            self.findings.note(sample, self.setup.world);
            let verdict = examined.get_mut(index).and_then(Option::take);
            self.step(sample, verdict);
            self.settle(false, out)?;
        }
        Ok(())
    }

    /// The recording is over: what waits for the truth goes without.
    pub fn finish<E>(&mut self, out: &mut impl FnMut(&Row) -> Result<(), E>) -> Result<(), E> {
        if let Some(track) = &mut self.track {
            track.complete();
        }
        self.settle(true, out)
    }

    /// The report of a sample. Its sequence number is not set yet.
    fn report(&self, sample: &Sample) -> Report {
        let mut belief = sample.belief;
        if let Some([translation_m, yaw_rad]) = self.setup.bounded {
            belief.spread = Some(Spread::Bounded {
                translation_m,
                yaw_rad,
            });
        }
        let frame = sample
            .frame
            .as_ref()
            .map_or(self.world, |name| FrameId::of(name));
        Report {
            source: sample.source,
            frame,
            sequence: 0,
            stamp_ms: clock_ms(sample.t_s).unwrap_or(0),
            belief,
        }
    }

    /// When a sample was recorded, where the gate goes by that; NaN where it should and there is no such time.
    fn logged(&self, sample: &Sample) -> Option<f64> {
        match self.clock {
            Some(Clock::Logged) => sample.logged_s.or(Some(f64::NAN)),
            _ => None,
        }
    }

    /// The verdict on a sample by itself.
    fn judged(&self, report: &Report, sample: &Sample) -> Verdict {
        // Without a time of use there is no age: the estimate counts as just made.
        let times = match self.logged(sample) {
            None => Some((0, 0)),
            Some(logged) => clock_ms(logged).zip(clock_ms(sample.t_s)),
        };
        let Some(source) = self.setup.settings.sources.get(usize::from(report.source)) else {
            return Verdict::deny(Reason::SourceUnknown);
        };
        if report.frame != self.world {
            return Verdict::deny(Reason::FrameMismatch);
        }
        let Some((now, stamp)) = times else {
            return Verdict::deny(Reason::Stale);
        };
        let set = report
            .belief
            .pose_set(self.judge.radius_squared(), source.trust);
        if self.setup.examined {
            return self.judge.judge(now, stamp, set);
        }
        match self.judge.permits(now, stamp, set) {
            Ok(()) => Verdict::Permit {
                margin: Margin::ONE,
            },
            Err(reason) => Verdict::deny(reason),
        }
    }

    /// One step of the gate.
    fn step(&mut self, sample: &Sample, examined: Option<Verdict>) {
        let mut report = self.report(sample);
        let logged = self.logged(sample);
        let now_s = logged.unwrap_or(sample.t_s);
        let now_ms = clock_ms(now_s).unwrap_or(self.last_now_ms);
        if self.next == 0
            && let Ok(gate) = Gate::new(self.setup.table, self.setup.settings, now_ms)
        {
            self.gate = gate;
        }
        if clock_ms(sample.t_s).is_none() || clock_ms(now_s).is_none() {
            // No time: older than whatever is fresh.
            let stale = self.setup.settings.maximum_age_ms.wrapping_add(1);
            report.stamp_ms = now_ms.wrapping_sub(stale);
        }
        if let Some(sequence) = self.sequences.get_mut(usize::from(report.source)) {
            report.sequence = *sequence;
            *sequence = sequence.wrapping_add(1);
        }
        let step = self.gate.step(now_ms, &report);
        self.last_now_ms = now_ms;
        let verdict = examined.unwrap_or_else(|| match step.verdict {
            Ok(()) => Verdict::Permit {
                margin: Margin::ONE,
            },
            // Not of the estimate alone: asked again without memory.
            Err(reason) if remembers(reason) => self.judged(&report, sample),
            Err(reason) => Verdict::deny(reason),
        });
        let mut row = Row::of(sample, &report.belief, verdict, logged);
        row.examined = self.setup.examined;
        row.index = self.next;
        self.next += 1;
        row.permitted = step.permission.is_permit();
        row.state = step.state;
        row.step = step.verdict;
        let settings = self.setup.settings;
        self.counts.spans.step(&row, now_s, settings);
        self.waiting.push_back(row);
    }

    fn settle<E>(
        &mut self,
        all: bool,
        out: &mut impl FnMut(&Row) -> Result<(), E>,
    ) -> Result<(), E> {
        while let Some(row) = self.waiting.front() {
            let truth = match (row.truth, &self.track) {
                (Some(truth), _) => At::Pose(truth),
                (None, None) => At::None,
                (None, Some(track)) => track.at(row.t_s),
            };
            if truth == At::NotYet && !all && self.waiting.len() <= MOST_WAITING {
                return Ok(());
            }
            if let Some(mut row) = self.waiting.pop_front() {
                row.truth = match truth {
                    At::Pose(truth) if truth.iter().all(|v| v.is_finite()) => Some(truth),
                    _ => None,
                };
                self.count(&mut row);
                out(&row)?;
            }
        }
        Ok(())
    }

    fn count(&mut self, row: &mut Row) {
        row.rules = self.rules.of(row);
        row.against = row.truth.map(|truth| {
            let source = self.setup.settings.sources.get(usize::from(row.source));
            let trust = source.map(|source| source.trust);
            Against::of(
                row,
                truth,
                self.setup.success,
                self.judge.radius_squared(),
                trust,
            )
        });
        self.counts.note(row);
        self.timeline.note(row);
        self.stanford.note(row);
    }

    /// What is wrong with the estimates.
    #[must_use]
    pub const fn findings(&self) -> &Findings {
        &self.findings
    }

    /// The clock that is used; `None` before the first estimate.
    #[must_use]
    pub const fn clock(&self) -> Option<Clock> {
        self.clock
    }

    /// Verdicts over time.
    #[must_use]
    pub const fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// Errors against protection levels against alert limits.
    #[must_use]
    pub const fn stanford(&self) -> &Stanford {
        &self.stanford
    }

    /// The permits of the gate's verdicts, of its permission, and of the rules of [`RULES`].
    #[must_use]
    pub fn tallies(&self) -> [(&'static str, Tally); 6] {
        self.counts.tallies(&self.setup.thresholds)
    }

    /// How many estimates were permitted, and how many there were.
    #[must_use]
    pub const fn permits(&self) -> [u64; 2] {
        [self.counts.verdicts.permits, self.next]
    }

    /// How often each reason was given, of those that were.
    #[must_use]
    pub fn reasons(&self) -> Vec<(Reason, u64)> {
        self.counts.reasons()
    }

    /// Everything as JSON.
    #[must_use]
    pub fn summary(&self) -> serde_json::Value {
        summary::summary(self)
    }
}

/// Whether a reason of a gate's step may come of what was before: of a verdict on the estimate alone it then says
/// nothing. (Staleness too: the gate's clock may stand still where a time is missing.)
const fn remembers(reason: Reason) -> bool {
    !matches!(
        reason,
        Reason::NotContained
            | Reason::PoseSetTooLarge
            | Reason::OutsideTable
            | Reason::EstimateNotFinite
            | Reason::EstimateOutOfRange
            | Reason::CovarianceNotFinite
            | Reason::CovarianceZero
            | Reason::CovarianceNotSymmetric
            | Reason::CovarianceNotPositiveDefinite
            | Reason::CovarianceTooLarge
            | Reason::CovarianceUnknown
            | Reason::BoundInvalid
            | Reason::OrientationInvalid
            | Reason::Tilted
            | Reason::FrameMismatch
            | Reason::SourceUnknown
    )
}

/// A verdict's margin.
fn margin_of(verdict: &Verdict) -> Option<f64> {
    match verdict {
        Verdict::Permit { margin } => Some(factor(*margin)),
        Verdict::Deny { margin, .. } => margin.map(factor),
    }
}
