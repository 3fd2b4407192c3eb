//! The gate's state machine: closed at first, closed after every error, open only after consecutive permits.

use super::doubled::{CorruptWord, RedundantWord};
use super::elsewhere::allowed_for;
use super::evidence::{Evidence, MOST_HYPOTHESES};
use super::permission::{Check, FlowSignature};
use super::scrub::{Scrub, ScrubProgress};
use super::self_test;
use super::standing::{DecodedState, StateSnapshot};
use super::state::State;
use super::{Advice, InvalidParameter, Permission, Reason, Restart, Settings, Source, Verdict};
use crate::contain::{self, Decision, second};
use crate::motion::MotionBounds;
use crate::report::{PoseEstimate, Report};
use crate::set::{Growth, Trust};
use crate::table::{self, Table};
use crate::task::Risk;
use core::hint::black_box;

/// The answer of a gate at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct Step {
    /// For the interlock.
    pub permission: Permission,
    /// The state of the gate.
    pub state: State,
    /// With a report: `Ok` if this report permits, or the reason why not. Without a report: `Ok` if the gate is open,
    /// or the reason why not.
    pub verdict: Result<(), Reason>,
}

/// A gate: evaluates reports, keeps state between them, and decides whether the interlock may open.
///
/// It permits only after [`Settings::permits_in_a_row`] consecutive fresh permits of one source. It inhibits at once
/// on a denial, a stale estimate, a sequence gap, another source, or time going backwards. Faults (damaged memory,
/// table or code, evaluations that disagree, an interlock that does not follow) are latched until [`Gate::reset`].
/// [`super::assumptions`] lists its assumptions and the faults that it cannot detect.
///
/// A report counts only if its stamp is newer than every earlier stamp, of any source. Delayed reports
/// never open the gate.
///
/// Each word of the gate's state is stored with its complement. The second evaluation reads the table from flash. So
/// a bit flip in memory cannot turn a denial into a permit. Every step and tick revokes the permit first, and
/// checks that the settings are unchanged. Only a complete pass through the checks gives the permit again, so a
/// program that skips a part of its path leaves the gate closed.
///
/// A gate cannot be copied: a saved copy would not contain a fault that was latched later.
///
/// ```compile_fail,E0382
/// fn restored(gate: posegate::gate::Gate<'_>) -> posegate::gate::Gate<'_> {
///     let saved = gate;
///     let _ = gate.state();
///     saved
/// }
/// ```
///
/// ```compile_fail,E0599
/// fn saved<'a>(gate: posegate::gate::Gate<'a>) -> posegate::gate::Gate<'a> {
///     gate.clone()
/// }
/// ```
#[derive(Debug)]
pub struct Gate<'a> {
    bytes: &'a [u8],
    table: Result<Table<'a>, Reason>,
    settings: &'a Settings<'a>,
    /// The digest of the settings at the start, when they were checked.
    checked: RedundantWord,
    /// The checksum of the table at the start. Another table may replace it later.
    table_crc: RedundantWord,
    /// The table's mark ([`table::stored_mark`]) at the start.
    table_mark: RedundantWord,
    /// The time of the controller's clock in the last call.
    now_ms: RedundantWord,
    /// The time of the last denial, at most the hold time ago.
    closed_at_ms: RedundantWord,
    /// The time of the last permit.
    permitted_at_ms: RedundantWord,
    state: RedundantWord,
    /// The source of the last report, or [`NO_SOURCE`], and its sequence number.
    last_source: RedundantWord,
    last_sequence: RedundantWord,
    /// The newest stamp of all reports that were not from the future. At most the maximum age later than now (if the
    /// clock was set back).
    newest_stamp_ms: RedundantWord,
    scrub: Scrub,
}

#[cfg(feature = "defmt")]
impl defmt::Format for Gate<'_> {
    /// Writes the state only.
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Gate {{ state: {} }}", self.state());
    }
}

/// The source number if no report has come since the start or the reset.
const NO_SOURCE: u32 = 0x0001_0000;
/// Half the range of the clock: a longer step counts as backwards.
const BACKWARDS_MS: u32 = 1 << 31;

/// The outcome of a step, or [`CorruptWord`] if memory is corrupted.
type Weighed = Result<Result<(), Reason>, CorruptWord>;

impl<'a> Gate<'a> {
    /// Makes a closed gate on the bytes of a table, at the controller's time `now_ms`. Runs [`self_test`] and checks
    /// the whole table. A table that is damaged, of another task or of another site gives a gate that denies with
    /// that reason: a controller with damaged flash must still answer.
    ///
    /// # Errors
    /// [`InvalidParameter`] if a parameter would switch a check off, or keep the gate closed for ever.
    pub fn new(
        table: &'a [u8],
        settings: &'a Settings<'a>,
        now_ms: u32,
    ) -> Result<Self, InvalidParameter> {
        settings.check()?;
        let mut gate = Self {
            bytes: table,
            table: Err(Reason::TableInvalid),
            settings,
            checked: RedundantWord::new(settings.digest()),
            table_crc: RedundantWord::new(table::stored_checksum(table)),
            table_mark: RedundantWord::new(table::stored_mark(table)),
            now_ms: RedundantWord::new(now_ms),
            closed_at_ms: RedundantWord::new(now_ms),
            permitted_at_ms: RedundantWord::new(now_ms),
            state: RedundantWord::new(0),
            last_source: RedundantWord::new(NO_SOURCE),
            last_sequence: RedundantWord::new(0),
            newest_stamp_ms: RedundantWord::new(0),
            scrub: Scrub::new(),
        };
        gate.start();
        Ok(gate)
    }

    /// Checks the table again and restarts the gate, closed. This is the only way out of a latched fault. A reset is
    /// a manual action: never call it from a timer. If the settings have changed, latches [`Reason::MemoryDamaged`]:
    /// restart the controller.
    ///
    /// # Errors
    /// [`InvalidParameter`] if the settings are invalid; the gate stays as it was.
    pub fn reset(&mut self, now_ms: u32) -> Result<(), InvalidParameter> {
        if self.check_settings().is_err() {
            self.state = DecodedState::Latched(Reason::MemoryDamaged).word();
            return Ok(());
        }
        *self = Self::new(self.bytes, self.settings, now_ms)?;
        Ok(())
    }

    fn start(&mut self) {
        self.table = self_test().and_then(|()| checked(self.bytes, self.settings));
        match self.table {
            Ok(_) => self.enter_inhibited(Reason::Silent),
            Err(reason) => self.state = DecodedState::Latched(reason).word(),
        }
    }

    /// Returns the table, or the reason why the gate has none.
    ///
    /// # Errors
    /// [`Reason::TableInvalid`], [`Reason::WrongTask`], [`Reason::WrongSite`] or [`Reason::SelfTestFailed`].
    pub const fn table(&self) -> Result<&Table<'a>, Reason> {
        match &self.table {
            Ok(table) => Ok(table),
            Err(reason) => Err(*reason),
        }
    }

    /// Evaluates a report at the controller's time `now_ms`.
    pub fn step(&mut self, now_ms: u32, report: &Report) -> Step {
        self.step_on(now_ms, &Evidence::of(report))
    }

    /// As [`Gate::step`], for a report with several hypotheses, or a report that was carried along odometry.
    #[inline(always)]
    pub fn step_on(&mut self, now_ms: u32, evidence: &Evidence<'_>) -> Step {
        let verdict = self
            .process_report(now_ms, evidence)
            .unwrap_or_else(|CorruptWord| {
                self.fault(Reason::MemoryDamaged);
                Err(Reason::MemoryDamaged)
            });
        self.output(Some(verdict))
    }

    /// Advances the time without a report. Call it in every control cycle without a report, so that a permit ends if
    /// reports stop.
    pub fn tick(&mut self, now_ms: u32) -> Step {
        if self.process_tick(now_ms).is_err() {
            self.fault(Reason::MemoryDamaged);
        }
        self.output(None)
    }

    /// Ends a permit, and the permits counted so far, at the controller's time `now_ms`. Call it if something else
    /// has closed the interlock for a cause that may pass, such as a watchdog or a mode of the machine. The gate then
    /// qualifies again as after a denial. With [`Restart::OnReset`] an open gate waits for the reset.
    pub fn inhibit(&mut self, now_ms: u32, reason: Reason) -> Step {
        if self.interrupt(now_ms, reason).is_err() {
            self.fault(Reason::MemoryDamaged);
        }
        self.output(None)
    }

    /// Latches a fault that was found elsewhere, by the interlock or by a check of the code. The first fault remains
    /// the reported one.
    #[cfg_attr(small_code, inline(never))]
    pub fn fault(&mut self, reason: Reason) {
        if !matches!(DecodedState::of(self.state), Ok(DecodedState::Latched(_))) {
            self.state = DecodedState::Latched(reason).word();
        }
    }

    /// Checks the next `count` bytes of the table in flash against the checksum from the start. At the end of a round
    /// that finds a change, latches [`Reason::TableDamaged`]: the table is damaged, or replaced by another table with
    /// its own valid checksum. Call it in a main loop's idle time.
    pub fn scrub(&mut self, count: usize) -> ScrubProgress {
        let expected = self.table_crc.get();
        let scrubbed = match (self.bytes.split_last_chunk::<4>(), expected) {
            (Some((content, crc)), Ok(expected)) if u32::from_le_bytes(*crc) == expected => {
                self.scrub.step(content, expected, count)
            }
            _ => ScrubProgress::Damaged,
        };
        if scrubbed == ScrubProgress::Damaged {
            self.fault(match expected {
                Ok(_) => Reason::TableDamaged,
                Err(CorruptWord) => Reason::MemoryDamaged,
            });
        }
        scrubbed
    }

    /// Returns the state of the gate.
    pub fn state(&self) -> State {
        DecodedState::of(self.state)
            .map_or(State::Latched(Reason::MemoryDamaged), DecodedState::state)
    }

    /// Returns the verdict on a report's estimate with its margin and worst pose, as [`super::judge`] does, at the
    /// cost of [`contain::examine`]. For telemetry: the gate does not change.
    pub fn examine(&self, report: &Report) -> Verdict {
        self.examine_on(&Evidence::of(report)).1
    }

    /// As [`Gate::examine`], for a report with several hypotheses, or a report that was carried along odometry. Returns the number of
    /// the verdict's hypothesis: the first denied hypothesis, else the one with the least margin.
    pub fn examine_on(&self, evidence: &Evidence<'_>) -> (u8, Verdict) {
        let mut least = (0, Verdict::deny(Reason::TooManyHypotheses));
        if !(evidence.others.len() < MOST_HYPOTHESES) {
            return least;
        }
        for (number, belief) in evidence.hypotheses() {
            let verdict = self.examine_belief(evidence, belief);
            let Verdict::Permit { margin } = verdict else {
                return (number, verdict);
            };
            let is_less = match least.1 {
                Verdict::Permit { margin: least } => margin < least,
                Verdict::Deny { .. } => true,
            };
            if is_less {
                least = (number, verdict);
            }
        }
        least
    }

    #[inline(never)]
    fn examine_belief(&self, evidence: &Evidence<'_>, belief: &PoseEstimate) -> Verdict {
        let report = evidence.report;
        let table = match &self.table {
            Ok(table) => table,
            Err(reason) => return Verdict::deny(*reason),
        };
        let source = match self.source_of(report) {
            Ok(source) => source,
            Err(reason) => return Verdict::deny(reason),
        };
        let radius = table.radius_squared();
        let aged = source.trust_after(evidence.since_fix_ms);
        let trust = match allowed_for(evidence.elsewhere, radius, aged) {
            Some(trust) if evidence.elsewhere == Risk::NONE || evidence.can_make_up() => trust,
            _ => return Verdict::deny(Reason::ElsewhereTooLikely),
        };
        match belief.pose_set(radius, trust) {
            Ok(set) => {
                let age_ms = self.now_ms.by_complement().wrapping_sub(report.stamp_ms);
                let movement = self.settings.movement(source.motion, age_ms);
                super::judge(table, &set.grown(movement.plus(evidence.beside)))
            }
            Err(impossible) => Verdict::deny(impossible.into()),
        }
    }

    /// Returns what to do, or `None` if the gate is open.
    #[must_use]
    pub fn advice(&self) -> Option<Advice> {
        let reason = self.output(None).verdict.err()?;
        Some(reason.advice(self.settings.look_at))
    }

    fn process_report(&mut self, now_ms: u32, evidence: &Evidence<'_>) -> Weighed {
        let report = evidence.report;
        let mut before = self.revoke()?;
        let source = self.source_of(report);
        let passed = self.advance_time(now_ms, &mut before)?;
        let newest = self.is_newest(report.stamp_ms)?;
        let verdict = match passed {
            Ok(()) => self.take(evidence, source, newest, &before)?,
            // The report is remembered, but not evaluated.
            Err(reason) => Err(reason),
        };
        // A report of an undeclared source or in another frame is not remembered.
        if source.is_ok() {
            self.remember(report, newest.is_ok())?;
        }
        Ok(verdict)
    }

    /// Returns the declared source of a report.
    fn source_of(&self, report: &Report) -> Result<&'a Source, Reason> {
        let source = self.settings.sources.get(usize::from(report.source));
        let source = source.ok_or(Reason::SourceUnknown)?;
        if report.frame == source.frame {
            Ok(source)
        } else {
            Err(Reason::FrameMismatch)
        }
    }

    fn process_tick(&mut self, now_ms: u32) -> Result<(), CorruptWord> {
        let mut before = self.revoke()?;
        if self.advance_time(now_ms, &mut before)?.is_ok() {
            self.restore(&before);
        }
        Ok(())
    }

    fn interrupt(&mut self, now_ms: u32, reason: Reason) -> Result<(), CorruptWord> {
        let mut before = self.revoke()?;
        if self.advance_time(now_ms, &mut before)?.is_ok() {
            self.close(&before, reason);
        }
        Ok(())
    }

    /// Revokes the permit before anything is checked, then checks the settings before any of them is used. Returns
    /// the state from before.
    fn revoke(&mut self) -> Result<StateSnapshot, CorruptWord> {
        let before = StateSnapshot::of(self.state)?;
        if !matches!(before.standing, DecodedState::Latched(_)) {
            self.state = DecodedState::Inhibited(Reason::Silent).word();
        }
        self.check_settings()?;
        if !self.table_is_the_same()? {
            self.fault(Reason::TableDamaged);
            return StateSnapshot::of(self.state);
        }
        Ok(before)
    }

    /// Returns `true` if the table in flash still has the mark that it had at the start: its length, site digest and
    /// checksum. Another valid table has another length, or another checksum at the same place; it has the same mark
    /// with a probability of 2^-32. [`Gate::scrub`] detects changes that leave the mark unchanged. A table that was
    /// refused at the start may change.
    fn table_is_the_same(&self) -> Result<bool, CorruptWord> {
        let expected = self.table_mark.get()?;
        Ok(table::stored_mark(self.bytes) == expected || self.table.is_err())
    }

    /// Checks that the settings, and the references to them, are unchanged since the gate was made.
    fn check_settings(&self) -> Result<(), CorruptWord> {
        if self.checked.get()? == self.settings.digest() {
            Ok(())
        } else {
            Err(CorruptWord)
        }
    }

    /// Restores the state that [`Gate::revoke`] returned.
    fn restore(&mut self, before: &StateSnapshot) {
        self.state = before.state;
    }

    /// Sets the clock and ends a permit that has expired. Returns [`Reason::TimeBackwards`] if the clock went
    /// backwards.
    fn advance_time(&mut self, now_ms: u32, before: &mut StateSnapshot) -> Weighed {
        let passed = now_ms.wrapping_sub(self.now_ms.get()?);
        self.now_ms = RedundantWord::new(now_ms);
        if !(passed < BACKWARDS_MS) {
            self.close(before, Reason::TimeBackwards);
            // Reports from before the clock was set back stay refused for as long as they could be fresh.
            let most = self.settings.maximum_age_ms;
            let ahead = self.newest_stamp_ms.get()?.wrapping_sub(now_ms);
            if ahead > most && ahead <= BACKWARDS_MS {
                self.newest_stamp_ms = RedundantWord::new(now_ms.wrapping_add(most));
            }
            return Ok(Err(Reason::TimeBackwards));
        }
        if before.standing.is_earning() {
            let seen = black_box(&*self);
            let fresh = self.is_fresh_at(now_ms, seen.newest_stamp_ms.get_of_opaque()?);
            let since = now_ms.wrapping_sub(seen.permitted_at_ms.get_of_opaque()?);
            let ended = if !fresh {
                Some(Reason::Stale)
            } else if !(since <= self.settings.permit_hold_ms) {
                Some(Reason::Silent)
            } else if before.standing.is_open() && !(passed <= self.settings.response_ms) {
                // The last permission was valid for longer than the time for which its age was checked.
                Some(Reason::CycleLate)
            } else {
                None
            };
            if let Some(reason) = ended {
                self.close(before, reason);
                *before = StateSnapshot::of(self.state)?;
            }
        }
        // Never kept as longer ago than the hold time, so that the clock's wrap does not make the closing recent
        // again.
        let hold = self.settings.inhibit_hold_ms;
        if now_ms.wrapping_sub(self.closed_at_ms.get()?) > hold {
            self.closed_at_ms = RedundantWord::new(now_ms.wrapping_sub(hold));
        }
        Ok(Ok(()))
    }

    /// Evaluates a report and changes the state accordingly.
    fn take(
        &mut self,
        evidence: &Evidence<'_>,
        source: Result<&Source, Reason>,
        newest: Result<(), Reason>,
        before: &StateSnapshot,
    ) -> Weighed {
        if let DecodedState::Latched(reason) = before.standing {
            return Ok(Err(reason));
        }
        let report = evidence.report;
        let mut flow = FlowSignature::start();
        let weighed = self.weigh(evidence, source, newest, &mut flow)?;
        match weighed {
            Ok(()) => {
                let held = self.is_held_long_enough()?;
                self.permit(report, before, held, flow)?;
            }
            Err(Reason::Repeated) => self.repeat(report, before),
            Err(Reason::EvaluationsDisagree) => self.fault(Reason::EvaluationsDisagree),
            Err(reason) => self.close(before, reason),
        }
        Ok(weighed)
    }

    /// Returns `Ok` if a report permits by itself. A repeated report is evaluated like any other, but without
    /// [`Check::Followed`], so its signature is never complete.
    fn weigh(
        &self,
        evidence: &Evidence<'_>,
        source: Result<&Source, Reason>,
        newest: Result<(), Reason>,
        flow: &mut FlowSignature,
    ) -> Weighed {
        let source = match source {
            Ok(source) => source,
            Err(reason) => return Ok(Err(reason)),
        };
        let report = evidence.report;
        let follows = self.follows(report, newest)?;
        match follows {
            Ok(()) => flow.past(Check::Followed),
            Err(Reason::Repeated) => {}
            Err(reason) => return Ok(Err(reason)),
        }
        if !self.is_fresh(report.stamp_ms)? {
            return Ok(Err(Reason::Stale));
        }
        flow.past(Check::Fresh);
        let table = match &self.table {
            Ok(table) => table,
            Err(reason) => return Ok(Err(*reason)),
        };
        if !(evidence.others.len() < MOST_HYPOTHESES) {
            return Ok(Err(Reason::TooManyHypotheses));
        }
        let age_ms = self.now_ms.get()?.wrapping_sub(report.stamp_ms);
        let movement = self.settings.movement(source.motion, age_ms);
        let movement = movement.plus(evidence.beside);
        let radius = table.radius_squared();
        // Most reports state neither: nothing is copied for them.
        let changed;
        let trust = if evidence.since_fix_ms.is_none() && evidence.elsewhere == Risk::NONE {
            &source.trust
        } else {
            let aged = source.trust_after(evidence.since_fix_ms);
            match allowed_for(evidence.elsewhere, radius, aged) {
                Some(trust) if evidence.elsewhere == Risk::NONE || evidence.can_make_up() => {
                    changed = trust;
                }
                _ => return Ok(Err(Reason::ElsewhereTooLikely)),
            }
            &changed
        };
        if let Err(reason) = first_opinion(table, &report.belief, trust, movement) {
            return Ok(Err(reason));
        }
        for belief in evidence.others {
            if let Err(reason) = first_opinion(table, belief, trust, movement) {
                return Ok(Err(reason));
            }
        }
        flow.past(Check::First);
        // Looked up again, so that the two evaluations do not depend on one pointer.
        let Some(source) = black_box(self.settings)
            .sources
            .get(usize::from(report.source))
        else {
            return Err(CorruptWord);
        };
        let movement = self.movement_by_complement(report, source);
        let Evidence {
            beside,
            elsewhere,
            since_fix_ms,
            ..
        } = *black_box(evidence);
        let movement = movement.plus(beside);
        let changed;
        let trust = if since_fix_ms.is_none() && elsewhere == Risk::NONE {
            &source.trust
        } else {
            // The radius from flash, as for the evaluation itself.
            let radius = table::stored_radius_squared(self.bytes);
            let aged = source.trust_again(since_fix_ms);
            match radius.and_then(|radius| allowed_for(elsewhere, radius, aged)) {
                Some(trust) => changed = trust,
                None => return Ok(Err(Reason::EvaluationsDisagree)),
            }
            &changed
        };
        let confirms = |belief: &PoseEstimate| {
            let word = second::opinion_after(self.bytes, belief, *trust, movement);
            word == second::INSIDE
        };
        if !confirms(&report.belief) {
            return Ok(Err(Reason::EvaluationsDisagree));
        }
        // Counted down, so that a loop that ends too early is found.
        let mut left = evidence.others.len();
        for belief in evidence.others {
            if !confirms(belief) {
                return Ok(Err(Reason::EvaluationsDisagree));
            }
            left = left.wrapping_sub(1);
        }
        if !(left == 0) {
            return Err(CorruptWord);
        }
        flow.past(Check::Second);
        Ok(follows)
    }

    /// Returns the largest movement until a permission on a report ends, from the complements and in another form: within the time
    /// until the estimate is too old, or the time since its stamp until the hold time is over, whichever is less.
    #[inline(always)]
    fn movement_by_complement(&self, report: &Report, source: &Source) -> Growth {
        if source.motion == MotionBounds::STANDS_STILL {
            return Growth::NONE;
        }
        let seen = black_box(self);
        let settings = seen.settings;
        let now = seen.now_ms.by_complement_of_opaque();
        let most = settings.maximum_age_ms;
        let held = settings.permit_hold_ms.wrapping_add(settings.response_ms);
        let age = now.wrapping_sub(report.stamp_ms);
        // Each time is below 2^31. An estimate that is older than the maximum age does not come here.
        let left = most.saturating_sub(age);
        let horizon = if left < held {
            most.max(age)
        } else {
            age.wrapping_add(held)
        };
        source.motion.within(horizon)
    }

    /// Checks that a report is the next one of the last report's source. The first report after a start or a reset
    /// always passes.
    fn follows(&self, report: &Report, newest: Result<(), Reason>) -> Weighed {
        let seen = black_box(self);
        let source = seen.last_source.get_of_opaque()?;
        if source == NO_SOURCE {
            return Ok(Ok(()));
        }
        if source != u32::from(report.source) {
            return Ok(Err(Reason::SourceChanged));
        }
        let steps = report
            .sequence
            .wrapping_sub(seen.last_sequence.get_of_opaque()?);
        if steps > 1 {
            return Ok(Err(Reason::SequenceGap));
        }
        if steps == 0 && report.stamp_ms == seen.newest_stamp_ms.get_of_opaque()? {
            return Ok(Err(Reason::Repeated));
        }
        Ok(match newest {
            Ok(()) if steps == 0 => Err(Reason::SequenceStuck),
            otherwise => otherwise,
        })
    }

    /// Checks that a stamp is newer than every earlier stamp, and not from the future.
    ///
    /// Both stamps are counted back from the latest time that the newest stamp can have, so that the clock's wrap
    /// makes neither older than it is. After 49.7 days the wrap makes the newest stamp recent again, and a fresh
    /// report waits for the maximum age at most.
    fn is_newest(&self, stamp_ms: u32) -> Weighed {
        let seen = black_box(self);
        let now_ms = seen.now_ms.get_of_opaque()?;
        if !(now_ms.wrapping_sub(stamp_ms) < BACKWARDS_MS) {
            return Ok(Err(Reason::Stale));
        }
        let latest = now_ms.wrapping_add(self.settings.maximum_age_ms);
        let newest = match seen.last_source.get_of_opaque()? {
            // Farther back than any stamp.
            NO_SOURCE => latest.wrapping_add(1),
            _ => seen.newest_stamp_ms.get_of_opaque()?,
        };
        Ok(
            if latest.wrapping_sub(stamp_ms) < latest.wrapping_sub(newest) {
                Ok(())
            } else {
                Err(Reason::TimeBackwards)
            },
        )
    }

    /// Returns `true` if a report has the frame of its source and follows the last report. A second check against a
    /// corrupted result of the first: it reads the complements and compares in another form. A stamp from the future
    /// is not fresh, and freshness has a second check too.
    fn follows_again(&self, report: &Report) -> bool {
        let seen = black_box(self);
        let source = seen.last_source.by_complement_of_opaque();
        let settings = seen.settings;
        let framed = settings
            .sources
            .get(usize::from(report.source))
            .is_some_and(|known| known.frame.digest() ^ report.frame.digest() == 0);
        if source == NO_SOURCE {
            return framed;
        }
        let sequence = seen.last_sequence.by_complement_of_opaque();
        let newest = seen.newest_stamp_ms.by_complement_of_opaque();
        // Counted forwards from just after the latest time that the newest stamp can have.
        let behind = seen
            .now_ms
            .by_complement_of_opaque()
            .wrapping_add(settings.maximum_age_ms)
            .wrapping_add(1);
        framed
            && source ^ u32::from(report.source) == 0
            && sequence.wrapping_add(1) ^ report.sequence == 0
            && report.stamp_ms.wrapping_sub(behind) > newest.wrapping_sub(behind)
    }

    /// Returns `true` if a report is the last one: a second check, in case another denial is taken for
    /// [`Reason::Repeated`].
    fn is_last_again(&self, report: &Report) -> bool {
        let seen = black_box(self);
        seen.last_source.by_complement_of_opaque() ^ u32::from(report.source) == 0
            && seen.last_sequence.by_complement_of_opaque() ^ report.sequence == 0
            && seen.newest_stamp_ms.by_complement_of_opaque() ^ report.stamp_ms == 0
    }

    /// Stores the values that the next report is compared with. A stamp from the future is not stored: otherwise no
    /// report would be newer until that time.
    fn remember(&mut self, report: &Report, is_newest: bool) -> Result<(), CorruptWord> {
        if is_newest {
            self.newest_stamp_ms = RedundantWord::new(report.stamp_ms);
        } else if self.last_source.get()? == NO_SOURCE {
            // Older than every fresh stamp.
            let stale = self.settings.maximum_age_ms.wrapping_add(1);
            self.newest_stamp_ms = RedundantWord::new(self.now_ms.get()?.wrapping_sub(stale));
        }
        self.last_source = RedundantWord::new(u32::from(report.source));
        self.last_sequence = RedundantWord::new(report.sequence);
        Ok(())
    }

    /// Returns `true` if a stamp is not older than the maximum age when a permission of this cycle ends, and not from
    /// the future. A stamp from the future has an age of half the clock's range or more.
    fn is_fresh(&self, stamp_ms: u32) -> Result<bool, CorruptWord> {
        Ok(self.is_fresh_at(self.now_ms.get()?, stamp_ms))
    }

    /// As [`Gate::is_fresh`], in a cycle at `now_ms`.
    fn is_fresh_at(&self, now_ms: u32, stamp_ms: u32) -> bool {
        now_ms.wrapping_sub(stamp_ms) <= self.settings.oldest_ms()
    }

    /// Restores the state from before a report that the first checks found to be a repetition. Closes the gate
    /// if the second check, from the complements, finds another report.
    fn repeat(&mut self, report: &Report, before: &StateSnapshot) {
        if self.is_last_again(report) {
            self.restore(before);
        } else {
            self.close(before, Reason::Repeated);
        }
    }

    /// Adds one permit, and opens the gate if there are enough. Repeats the first checks from the complements:
    /// `before`, `held`, and that the report permits. Returns [`CorruptWord`] if they disagree.
    fn permit(
        &mut self,
        report: &Report,
        before: &StateSnapshot,
        held: bool,
        mut flow: FlowSignature,
    ) -> Result<(), CorruptWord> {
        if !self.follows_again(report) {
            return Err(CorruptWord);
        }
        flow.past(Check::FollowedAgain);
        // The age again, from the complements.
        let seen = black_box(&*self);
        let settings = seen.settings;
        let now = seen.now_ms.by_complement_of_opaque();
        if settings.oldest_ms() < now.wrapping_sub(report.stamp_ms) {
            return Err(CorruptWord);
        }
        flow.past(Check::FreshAgain);
        self.permitted_at_ms = self.now_ms;
        let needed = u32::from(settings.permits_in_a_row);
        let so_far = match before.standing {
            DecodedState::Inhibited(_) => 0,
            DecodedState::Qualifying(count) => u32::from(count),
            DecodedState::Permitted(_) => needed,
            DecodedState::Latched(_) => return Err(CorruptWord),
        };
        let count = so_far.saturating_add(1).min(0xffff);
        if !(count >= needed && held) {
            self.state = DecodedState::Qualifying(count as u16).word();
            return Ok(());
        }
        // The count and the times again, from the complements: detects a corrupted count or subtraction.
        if !before.has_earned_by_complement(settings.permits_in_a_row)
            || !self.is_held_long_enough_by_complement(settings)
        {
            return Err(CorruptWord);
        }
        flow.past(Check::Qualified);
        self.state = DecodedState::Permitted(flow).word();
        Ok(())
    }

    /// Returns `true` if the hold time since the last denial is over.
    fn is_held_long_enough(&self) -> Result<bool, CorruptWord> {
        let seen = black_box(self);
        let closed_for = seen
            .now_ms
            .get_of_opaque()?
            .wrapping_sub(seen.closed_at_ms.get_of_opaque()?);
        Ok(closed_for >= self.settings.inhibit_hold_ms)
    }

    /// As [`Gate::is_held_long_enough`], from the complements.
    fn is_held_long_enough_by_complement(&self, settings: &Settings<'_>) -> bool {
        let seen = black_box(self);
        let now = seen.now_ms.by_complement_of_opaque();
        let opens = seen
            .closed_at_ms
            .by_complement_of_opaque()
            .wrapping_add(settings.inhibit_hold_ms);
        now.wrapping_sub(opens) <= u32::MAX.wrapping_sub(settings.inhibit_hold_ms)
    }

    /// Closes the gate for at least the hold time. With [`Restart::OnReset`] an open gate stays closed until the
    /// reset.
    #[cfg_attr(small_code, inline(never))]
    fn close(&mut self, before: &StateSnapshot, reason: Reason) {
        match before.standing {
            DecodedState::Latched(_) => {}
            DecodedState::Permitted(_) if self.settings.restart == Restart::OnReset => {
                self.state = DecodedState::Latched(reason).word();
            }
            _ => self.enter_inhibited(reason),
        }
    }

    fn enter_inhibited(&mut self, reason: Reason) {
        self.closed_at_ms = self.now_ms;
        self.state = DecodedState::Inhibited(reason).word();
    }

    /// Returns `true` if a permit is still valid: a second check of the times, from the complements, independent of
    /// the first.
    #[cfg_attr(small_code, inline(never))]
    fn stands(&self) -> bool {
        let seen = black_box(self);
        let settings = seen.settings;
        let now = seen.now_ms.by_complement_of_opaque();
        let age = now.wrapping_sub(seen.newest_stamp_ms.by_complement_of_opaque());
        let since = now.wrapping_sub(seen.permitted_at_ms.by_complement_of_opaque());
        age <= settings.oldest_ms() && since <= settings.permit_hold_ms
    }

    /// Returns the current permission and state, with the verdict on a report if there is one.
    fn output(&self, verdict: Option<Result<(), Reason>>) -> Step {
        let standing =
            DecodedState::of(self.state).unwrap_or(DecodedState::Latched(Reason::MemoryDamaged));
        let permission = match standing {
            DecodedState::Permitted(mut flow) if self.stands() => {
                flow.past(Check::Stands);
                Permission::after(flow, self.now_ms.by_complement())
            }
            _ => Permission::DENIED,
        };
        let state = standing.state();
        Step {
            permission,
            state,
            verdict: verdict.unwrap_or_else(|| match state {
                State::Permitted => Ok(()),
                State::Qualifying(_) => Err(match self.is_held_long_enough() {
                    Ok(true) => Reason::Qualifying,
                    _ => Reason::Holding,
                }),
                State::Inhibited(reason) | State::Latched(reason) => Err(reason),
            }),
        }
    }
}

/// Returns `Ok` if the pose-set of a hypothesis after a movement is inside by the first evaluation.
#[inline(never)]
fn first_opinion(
    table: &Table<'_>,
    belief: &PoseEstimate,
    trust: &Trust,
    movement: Growth,
) -> Result<(), Reason> {
    let mut set = belief.pose_set(table.radius_squared(), *trust);
    // In place: the set takes more memory than the rest of the step.
    let set = match &mut set {
        Ok(set) => set,
        Err(impossible) => return Err((*impossible).into()),
    };
    set.grow(movement);
    match contain::decide(table, set) {
        Decision::Inside => Ok(()),
        Decision::Outside(cause) => Err(cause.into()),
    }
}

/// Parses a table, checks that it is for the task and site that the controller expects, and limits its walks.
fn checked<'a>(bytes: &'a [u8], settings: &Settings<'_>) -> Result<Table<'a>, Reason> {
    let table = Table::parse(bytes).map_err(|_| Reason::TableInvalid)?;
    if table.task() != settings.task {
        return Err(Reason::WrongTask);
    }
    if !table.is_of_site(&settings.site_digest) {
        return Err(Reason::WrongSite);
    }
    Ok(table.within(settings.most_runs))
}

#[cfg(test)]
mod tests;
