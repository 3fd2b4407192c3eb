//! Runs a recording through the gate: each estimate through the code that runs on the controller, and through the rules
//! that are in use without a gate. Compares it with the truth, if that was recorded.
//!
//! Each estimate has two results. Its *verdict* is that of [`Evaluator`], with margin and worst pose: the same that
//! `posegate gate` prints. The *permission* is that of [`Gate`], which has a memory: freshness, consecutive permits,
//! hold times. Memory does not grow with the recording: it holds counts ([`Tally`], [`Timeline`], [`Stanford`]) and
//! at most [`MOST_WAITING`] estimates that wait for a true pose.
//!
//! ```
//! use posegate::gate::{Restart, Settings, Source};
//! use posegate::motion::MotionBounds;
//! use posegate::report::FrameId;
//! use posegate::set::{Aging, Trust};
//! use posegate_replay::recording::Text;
//! use posegate_replay::replay::{Part, Replay, ReplayConfig, play};
//! # const SITE: &str = include_str!("../../../../examples/sites/dock.toml");
//! # const TABLE: &[u8] = include_bytes!("../../../../examples/tables/dock.posegate");
//! # let site = posegate_site::Site::parse(SITE, "dock.toml")?;
//!
//! // Two estimates of a robot at the dock, 10 cm apart: (0.01, 0, 0) and (0.11, 0, 0).
//! let csv = "t_s,x_m,y_m,yaw_rad\n1.00,0.01,0,0\n1.05,0.11,0,0\n";
//! let settings = Settings {
//!     task: "dock",
//!     task_digest: site.task_digest(site.task("dock")?),
//!     sources: &[Source { frame: FrameId::of("map"), trust: Trust::FULL, aging: Aging::NONE, motion: MotionBounds::STANDS_STILL }],
//!     maximum_age_ms: 200,
//!     response_ms: 20,
//!     report_period_ms: 50,
//!     permit_hold_ms: 100,
//!     inhibit_hold_ms: 500,
//!     permits_in_a_row: 3,
//!     restart: Restart::Automatic,
//!     most_runs: 1_000,
//!     look_at: None,
//! };
//! let config = ReplayConfig {
//!     table: TABLE,
//!     settings: &settings,
//!     success: &site.task("dock")?.success,
//!     // The source's error bound: 2 cm, 0.01 rad.
//!     bounded: Some([0.02, 0.01]),
//!     world: "map",
//!     clock: None,
//!     examined: true,
//! };
//! let mut replay = Replay::new(&config, None)?;
//! let mut recording = Text::csv(csv.as_bytes(), "run.csv", false)?;
//! let mut part = Part { range: [f64::NEG_INFINITY, f64::INFINITY], looks: None, outside: 0 };
//! let mut permits = Vec::new();
//! let mut take = |row: &posegate_replay::replay::Row| {
//!     permits.push(row.verdict.is_permit());
//!     Ok::<(), ()>(())
//! };
//! assert!(play(&mut recording, &mut part, &mut replay, &mut take, &mut |_| ()).is_ok());
//! assert_eq!(permits, [true, false]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use self::channels::Channels;
pub use self::clock::{Clock, NOT_FRESH};
pub use self::interlock::{InterlockTimes, WhyShut};
pub use self::lanes::{LaneSpan, Lanes};
pub use self::map::{Map, MapPose};
pub use self::odometry::{Odometry, OdometryError, OdometryExtremes, OdometryPose, odometry_csv};
pub use self::open::OpenMoments;
pub use self::play::{Part, PlayError, play};
pub use self::refused::RejectedTruth;
pub use self::row::{RULES, Row, TruthComparison};
pub use self::rules::{Rules, Thresholds};
pub use self::stanford::{END as STANFORD_END, Region, STEPS as STANFORD_STEPS, Stanford};
pub use self::tally::Tally;
pub use self::timeline::{Bucket, RuleCounts, Timeline};

mod against;
mod channels;
mod clock;
mod interlock;
mod lanes;
mod map;
mod odometry;
mod open;
mod play;
mod refused;
mod row;
mod rules;
mod spans;
mod stanford;
mod summary;
mod tally;
mod timeline;

use self::clock::{clock_of, now_ms, stamp_ms};
use super::recording::{Findings, Sample, TruePose, of_base};
use super::{Trajectory, TruthLookup};
use crate::{clock_ms, factor, remembers};
use posegate::contain::Margin;
use posegate::gate::{Evidence, Gate, InvalidParameter, Reason, Settings, State, Step, Verdict};
use posegate::recordings::Evaluator;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::{RadiusSquared, Trust};
use posegate::shape::SuccessSet;
use posegate::track::{Tracker, TrackerSettings};
use rayon::prelude::*;
use std::collections::VecDeque;

/// The most estimates that wait for a true pose. If there are more, the first one is counted without a truth.
pub const MOST_WAITING: usize = 1 << 16;
/// The number of increments of the odometry that are kept for fixes with old stamps.
const INCREMENTS: usize = 128;

/// The settings of a replay.
#[derive(Clone, Copy, Debug)]
pub struct ReplayConfig<'a> {
    /// The bytes of the task's table.
    pub table: &'a [u8],
    /// The gate's settings. Its sources are those of the recording, by number.
    pub settings: &'a Settings<'a>,
    /// The success set itself, for the comparison with the truth.
    pub success: &'a SuccessSet,
    /// A bounded set around each estimate instead of its covariance: metres, radians. `None` uses the
    /// covariances.
    pub bounded: Option<[f64; 2]>,
    /// The world frame's name.
    pub world: &'a str,
    /// The clock. `None` selects the recorded times. It selects the stamps if there are no recorded times, or if
    /// nearly all of the first estimates show that the two clocks differ.
    pub clock: Option<Clock>,
    /// `true` to compute margins and worst poses: a few dozen more decisions for each estimate. Otherwise the verdict
    /// is that of the gate's own step, and the Stanford diagram is empty.
    pub examined: bool,
}

/// A running replay of a recording through the gate. [`play`] feeds it a recording and returns the rows; the counts are
/// read afterwards.
pub struct Replay<'a> {
    setup: ReplayConfig<'a>,
    judge: Evaluator<'a>,
    gate: Gate<'a>,
    world: FrameId,
    clock: Option<Clock>,
    track: Option<Trajectory>,
    waiting: VecDeque<(Row, TruthLookup)>,
    refused: RejectedTruth,
    sequences: [u32; 256],
    next: u64,
    last_now_ms: u32,
    findings: Findings,
    rules: Rules,
    counts: tally::Counts,
    timeline: Timeline,
    stanford: Stanford,
    map: Map,
    carry: Option<Box<Carry>>,
    open: OpenMoments,
}

/// The odometry along which fixes are carried, and the trust in the fixes.
struct Carry {
    odometry: Odometry,
    tracker: Tracker<INCREMENTS>,
    trust: Trust,
}

impl<'a> Replay<'a> {
    /// Begins a replay. `track` has the true poses if they are not in the rows; [`Replay::truth`] adds more to it.
    ///
    /// # Errors
    /// [`InvalidParameter`]: a setting that would disable a check.
    pub fn new(
        setup: &ReplayConfig<'a>,
        track: Option<Trajectory>,
    ) -> Result<Self, InvalidParameter> {
        let judge = Evaluator::new(setup.table, setup.settings.maximum_age_ms)?;
        Ok(Self {
            setup: *setup,
            judge,
            // Created again with the first estimate's time.
            gate: Gate::new(setup.table, setup.settings, 0)?,
            world: FrameId::of(setup.world),
            clock: setup.clock,
            track,
            waiting: VecDeque::new(),
            refused: RejectedTruth::default(),
            sequences: [0; 256],
            next: 0,
            last_now_ms: 0,
            findings: Findings::default(),
            rules: Rules::new(setup.success.goal),
            counts: tally::Counts::default(),
            timeline: Timeline::default(),
            stanford: Stanford::default(),
            map: Map::default(),
            carry: None,
            open: OpenMoments::default(),
        })
    }

    /// Carries each fix along an odometry. The tracker applies its own trust to the fixes, so the settings' sources should have
    /// [`Trust::FULL`].
    ///
    /// # Errors
    /// Returns the settings if one of them is not valid.
    pub fn carry_along(
        &mut self,
        odometry: Odometry,
        settings: TrackerSettings,
    ) -> Result<(), TrackerSettings> {
        let tracker = Tracker::new(settings).ok_or(settings)?;
        self.carry = Some(Box::new(Carry {
            odometry,
            tracker,
            trust: settings.trust,
        }));
        Ok(())
    }

    /// Adds a true pose. A pose in another frame, or with an orientation that the gate would refuse in an estimate, is
    /// refused and counted.
    pub fn truth(&mut self, pose: &TruePose) {
        if let Some(track) = &mut self.track {
            self.refused.push(pose, self.world, track);
        }
    }

    /// Returns the counts of refused true poses.
    #[must_use]
    pub const fn refused(&self) -> &RejectedTruth {
        &self.refused
    }

    /// Returns the true poses that are not in the rows.
    #[must_use]
    pub const fn track(&self) -> Option<&Trajectory> {
        self.track.as_ref()
    }

    /// Takes estimates in the order in which they were recorded. Calls `out` with each row once its truth is known. A
    /// batch of about a thousand keeps every core busy.
    ///
    /// # Errors
    /// The first error of `out`.
    pub fn estimates<E>(
        &mut self,
        samples: &[Sample],
        out: &mut impl FnMut(&Row) -> Result<(), E>,
    ) -> Result<(), E> {
        if samples.is_empty() {
            return self.settle(false, out);
        }
        self.clock.get_or_insert_with(|| clock_of(samples));
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
        }
        self.settle(false, out)
    }

    /// Ends the recording: rows that wait for a true pose are passed to `out` without one.
    ///
    /// # Errors
    /// The first error of `out`.
    pub fn finish<E>(&mut self, out: &mut impl FnMut(&Row) -> Result<(), E>) -> Result<(), E> {
        if let Some(track) = &mut self.track {
            track.complete();
        }
        self.settle(true, out)
    }

    /// Returns the report of a sample. Its sequence number is not set yet.
    fn report(&self, sample: &Sample) -> Report {
        let belief = self.spread(&sample.belief, sample);
        let frame = sample
            .frame
            .as_ref()
            .map_or(self.world, |name| FrameId::of(name));
        Report {
            source: sample.source,
            frame,
            sequence: 0,
            stamp_ms: stamp_ms(sample).unwrap_or(0),
            belief,
        }
    }

    /// Returns a pose of a sample with the uncertainty that the gate uses.
    fn spread(&self, belief: &PoseEstimate, sample: &Sample) -> PoseEstimate {
        let inflation = self.inflation(sample);
        let radius_squared = f64::from(self.judge.radius_squared().q16()) / 65536.0;
        let radius_squared = radius_squared * inflation;
        of_base(belief, self.setup.bounded, sample.lever_m, radius_squared)
    }

    /// Returns the factor of a sample's covariance.
    fn inflation(&self, sample: &Sample) -> f64 {
        let trust = self.trust(sample);
        f64::from(trust.map_or(0, |trust| trust.inflation.q16())) / 65536.0
    }

    /// Returns the trust in a sample's source; `None` if the source is not known.
    fn trust(&self, sample: &Sample) -> Option<Trust> {
        let source = self
            .setup
            .settings
            .sources
            .get(usize::from(sample.source))?;
        Some(self.carry.as_ref().map_or_else(
            || source.trust_after(sample.since_fix_ms),
            |carry| carry.trust,
        ))
    }

    /// Returns the time when a sample was recorded if the gate uses that clock, or NaN if the sample has no such time.
    fn logged(&self, sample: &Sample) -> Option<f64> {
        match self.clock {
            Some(Clock::Logged) => sample.logged_s.or(Some(f64::NAN)),
            _ => None,
        }
    }

    /// Returns the verdict on a sample alone, without the gate's memory.
    fn judged(&self, report: &Report, sample: &Sample) -> Verdict {
        // With the stamps as the clock there is no age: the estimate counts as just made.
        let times = match self.clock {
            Some(Clock::Logged) => now_ms(self.clock, sample).zip(stamp_ms(sample)),
            _ => Some((0, 0)),
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
        let trust = self.carry.as_ref().map_or_else(
            || source.trust_after(sample.since_fix_ms),
            |carry| carry.trust,
        );
        if let Some(reason) = sample.fault {
            return Verdict::deny(reason);
        }
        let movement = self
            .setup
            .settings
            .movement(source.motion, now.wrapping_sub(stamp));
        let verdict = |belief: &PoseEstimate| {
            let set = belief.pose_set(self.judge.radius_squared(), trust);
            let set = set.map(|set| set.grown(movement));
            if self.setup.examined {
                return self.judge.evaluate(now, stamp, set);
            }
            match self.judge.permits(now, stamp, set) {
                Ok(()) => Verdict::Permit {
                    margin: Margin::ONE,
                },
                Err(reason) => Verdict::deny(reason),
            }
        };
        let best = verdict(&report.belief);
        if !sample.is_ambiguous {
            return best;
        }
        let other = sample.other.as_ref();
        let other = other.map(|other| verdict(&self.spread(other, sample)));
        // Permitted only from both poses, with the smaller margin.
        match (best, other) {
            (Verdict::Permit { margin }, Some(Verdict::Permit { margin: of_other })) => {
                Verdict::Permit {
                    margin: margin.min(of_other),
                }
            }
            (Verdict::Permit { margin }, None) => Verdict::Permit { margin },
            _ => Verdict::deny(Reason::TagPosesAmbiguous),
        }
    }

    /// Calls the gate until `now_ms` as often as its controller would: an open gate closes if a cycle is late.
    fn let_time_pass(&mut self, now_ms: u32) {
        let response_ms = self.setup.settings.response_ms;
        let mut cycle_ms = self.last_now_ms;
        while self.gate.state() == State::Permitted && response_ms < now_ms.wrapping_sub(cycle_ms) {
            cycle_ms = cycle_ms.wrapping_add(response_ms);
            let _ = self.gate.tick(cycle_ms);
        }
    }

    /// Passes the pose that is carried along the odometry to the gate, increment by increment, up to a time.
    fn drive_until(&mut self, now_s: f64) {
        let Some(mut carry) = self.carry.take() else {
            return;
        };
        while let Some((t_s, increment)) = carry.odometry.next_until(now_s) {
            let Some(now_ms) = clock_ms(t_s) else {
                continue;
            };
            self.let_time_pass(now_ms);
            let taken = match increment {
                Some(increment) => carry.tracker.odometry(increment),
                None => Err(Reason::OdometryJump),
            };
            let tracked = taken.and_then(|()| carry.tracker.tracked(now_ms));
            let step = match tracked {
                Ok(tracked) => self.gate.step_on(now_ms, &tracked.evidence()),
                Err(Reason::Silent) => self.gate.tick(now_ms),
                Err(reason) => self.gate.inhibit(now_ms, reason),
            };
            self.last_now_ms = now_ms;
            let interlock = &mut self.counts.interlock;
            interlock.pass(t_s, step.state, 0.0, self.setup.settings);
            if step.permission.is_permit() {
                self.open.step(t_s, self.track.is_some());
            }
        }
        self.carry = Some(carry);
    }

    /// Passes a fix to the gate: unchanged, with the time since the source's last fix, or carried along the odometry.
    fn take_fix(&mut self, now_ms: u32, report: &Report, sample: &Sample) -> Step {
        if let Some(reason) = sample.fault {
            return self.gate.inhibit(now_ms, reason);
        }
        let other = sample.other.as_ref();
        let other = other.map(|other| self.spread(other, sample));
        let Some(carry) = &mut self.carry else {
            let evidence = Evidence {
                since_fix_ms: sample.since_fix_ms,
                others: other.as_slice(),
                ..Evidence::of(report)
            };
            return self.gate.step_on(now_ms, &evidence);
        };
        // One of two poses cannot be carried: the carried pose is unchanged.
        if other.is_some() {
            return Step {
                verdict: Err(Reason::TagPosesAmbiguous),
                ..self.gate.tick(now_ms)
            };
        }
        match carry.tracker.fix(report) {
            Ok(()) => match carry.tracker.tracked(now_ms) {
                Ok(tracked) => self.gate.step_on(now_ms, &tracked.evidence()),
                Err(reason) => self.gate.inhibit(now_ms, reason),
            },
            // The carried pose is unchanged.
            Err(reason) => Step {
                verdict: Err(reason),
                ..self.gate.tick(now_ms)
            },
        }
    }

    /// Runs one step of the gate.
    fn step(&mut self, sample: &Sample, examined: Option<Verdict>) {
        let mut report = self.report(sample);
        let logged = self.logged(sample);
        let now_s = logged.unwrap_or(sample.t_s);
        let known_ms = now_ms(self.clock, sample);
        let now_ms = known_ms.unwrap_or(self.last_now_ms);
        if self.next == 0
            && let Ok(gate) = Gate::new(self.setup.table, self.setup.settings, now_ms)
        {
            self.gate = gate;
        }
        if stamp_ms(sample).is_none() || known_ms.is_none() {
            // A sample without a time gets an age above the maximum, so it is stale.
            let stale = self.setup.settings.maximum_age_ms.wrapping_add(1);
            report.stamp_ms = now_ms.wrapping_sub(stale);
        }
        if let Some(sequence) = self.sequences.get_mut(usize::from(report.source)) {
            report.sequence = *sequence;
            *sequence = sequence.wrapping_add(1);
        }
        self.drive_until(now_s);
        self.let_time_pass(now_ms);
        let mut step = self.take_fix(now_ms, &report, sample);
        // One of the two poses is outside, whichever the gate names.
        if sample.is_ambiguous && step.verdict.is_err_and(|reason| !remembers(reason)) {
            step.verdict = Err(Reason::TagPosesAmbiguous);
            step.state = match step.state {
                State::Inhibited(_) => State::Inhibited(Reason::TagPosesAmbiguous),
                other => other,
            };
        }
        self.last_now_ms = now_ms;
        let verdict = examined.unwrap_or_else(|| match step.verdict {
            Ok(()) => Verdict::Permit {
                margin: Margin::ONE,
            },
            // The reason may come from the gate's memory, so the verdict is computed from the estimate alone.
            Err(reason) if remembers(reason) || sample.is_ambiguous => self.judged(&report, sample),
            Err(reason) => Verdict::deny(reason),
        });
        let mut row = Row::of(sample, &report.belief, verdict, logged);
        row.examined = self.setup.examined;
        row.in_world = report.frame == self.world;
        row.age = logged.map(|logged| {
            sample
                .exact_ns
                .map_or(logged - sample.t_s, |exact| exact.age_s())
        });
        row.index = self.next;
        self.next += 1;
        self.map.note(&row, self.inflation(sample));
        row.permitted = step.permission.is_permit();
        row.state = step.state;
        row.step = step.verdict;
        let settings = self.setup.settings;
        self.counts.interlock.step(&row, now_s, settings);
        let truth = match (row.truth, &self.track) {
            (Some(truth), _) => TruthLookup::Pose(truth),
            (None, None) => TruthLookup::None,
            (None, Some(_)) => TruthLookup::NotYet,
        };
        if truth != TruthLookup::None && row.in_world {
            // An impossible estimate has no pose-set, even if its numbers are finite.
            let trust = settings.sources.get(usize::from(row.source));
            row.possible = trust.is_some_and(|source| {
                let radius = self.judge.radius_squared();
                let trust = source.trust_after(row.since_fix_ms);
                report.belief.pose_set(radius, trust).is_ok()
            });
        }
        self.waiting.push_back((row, truth));
    }

    fn settle<E>(
        &mut self,
        all: bool,
        out: &mut impl FnMut(&Row) -> Result<(), E>,
    ) -> Result<(), E> {
        if let Some(track) = &self.track {
            self.open.settle(track, self.setup.success, all);
        }
        // Look up the truth of every waiting row while the track still has it. A row whose time never comes delays only
        // the output of later rows, not their truth.
        if let Some(track) = &self.track {
            for (row, truth) in &mut self.waiting {
                if *truth == TruthLookup::NotYet {
                    *truth = track.at(row.t_s);
                    let forgotten = *truth == TruthLookup::None && track.has_forgotten(row.t_s);
                    self.counts.truth_lost += u64::from(forgotten);
                }
            }
        }
        while let Some((_, truth)) = self.waiting.front() {
            if *truth == TruthLookup::NotYet && !all && self.waiting.len() <= MOST_WAITING {
                return Ok(());
            }
            if let Some((mut row, truth)) = self.waiting.pop_front() {
                row.truth = match truth {
                    TruthLookup::Pose(truth) if truth.iter().all(|v| v.is_finite()) => Some(truth),
                    TruthLookup::Pose(_) => {
                        self.counts.truth_not_finite += 1;
                        None
                    }
                    TruthLookup::NotYet => {
                        self.counts.truth_lost += 1;
                        None
                    }
                    TruthLookup::None => None,
                };
                self.count(&mut row);
                out(&row)?;
            }
        }
        Ok(())
    }

    fn count(&mut self, row: &mut Row) {
        row.rules = self.rules.of(row);
        // Poses in different frames have no error.
        let comparable = row.truth.filter(|_| row.in_world);
        self.counts.truth_other_frame += u64::from(row.truth.is_some() && !row.in_world);
        row.against = comparable.map(|truth| {
            let source = self.setup.settings.sources.get(usize::from(row.source));
            let trust = source.map(|source| source.trust_after(row.since_fix_ms));
            TruthComparison::of(
                row,
                truth,
                self.setup.success,
                self.judge.radius_squared(),
                trust,
            )
        });
        if row.permitted {
            let against = row.against.as_ref();
            self.open.estimate(against.map(|against| against.inside));
        }
        self.counts.note(row);
        self.timeline.note(row);
        self.stanford.note(row);
    }

    /// Returns the counts of faulty estimates.
    #[must_use]
    pub const fn findings(&self) -> &Findings {
        &self.findings
    }

    /// Returns the clock; `None` before the first estimate.
    #[must_use]
    pub const fn clock(&self) -> Option<Clock> {
        self.clock
    }

    /// Returns the success set.
    #[must_use]
    pub const fn success(&self) -> &SuccessSet {
        self.setup.success
    }

    /// Returns the squared radius of Gaussian pose-sets.
    #[must_use]
    pub fn radius_squared(&self) -> RadiusSquared {
        self.judge.radius_squared()
    }

    /// Returns a share of the estimates for a map.
    #[must_use]
    pub const fn map(&self) -> &Map {
        &self.map
    }

    /// Returns the verdicts over time.
    #[must_use]
    pub const fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// Returns the times for which the interlock was open and shut, and the reasons.
    #[must_use]
    pub const fn interlock(&self) -> &InterlockTimes {
        &self.counts.interlock
    }

    /// Returns the steps after which the interlock was open, compared with the truth.
    #[must_use]
    pub const fn open_moments(&self) -> &OpenMoments {
        &self.open
    }

    /// Returns the odometry along which fixes are carried.
    #[must_use]
    pub fn odometry(&self) -> Option<&Odometry> {
        self.carry.as_ref().map(|carry| &carry.odometry)
    }

    /// Returns the age up to which the gate uses an estimate, seconds.
    #[must_use]
    pub fn maximum_age_s(&self) -> f64 {
        f64::from(self.setup.settings.maximum_age_ms) * 1e-3
    }

    /// Returns the diagram of errors, protection levels and alert limits.
    #[must_use]
    pub const fn stanford(&self) -> &Stanford {
        &self.stanford
    }

    /// Returns the permits of the gate's verdicts, of its permission, and of the rules in [`RULES`].
    #[must_use]
    pub fn tallies(&self) -> [(&'static str, Tally); 6] {
        self.counts.tallies()
    }

    /// Returns the number of estimates whose verdict is a permit, and of all estimates.
    #[must_use]
    pub const fn permits(&self) -> [u64; 2] {
        [self.counts.verdicts.permits, self.next]
    }

    /// Returns the number of denied verdicts for each reason; reasons that were not given are omitted.
    #[must_use]
    pub fn reasons(&self) -> Vec<(Reason, u64)> {
        self.counts.reasons()
    }

    /// Returns the complete result as JSON.
    #[must_use]
    pub fn summary(&self) -> serde_json::Value {
        summary::summary(self)
    }
}

/// Returns a verdict's margin.
fn margin_of(verdict: &Verdict) -> Option<f64> {
    match verdict {
        Verdict::Permit { margin } => Some(factor(*margin)),
        Verdict::Deny { margin, .. } => margin.map(factor),
    }
}
