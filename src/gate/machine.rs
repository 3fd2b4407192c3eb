//! The gate's state machine: closed at first, closed after every error, open only after consecutive permits.

use super::doubled::{CorruptWord, RedundantWord};
use super::elsewhere::allowed_for;
use super::evidence::{Evidence, MOST_HYPOTHESES};
use super::permission::{Check, FlowSignature};
use super::scrub::{Scrub, ScrubProgress};
use super::self_test;
use super::standing::{DecodedState, StateSnapshot};
use super::state::State;
use super::{Advice, InvalidParameter, Permission, Reason, Settings, Source, Verdict};
use crate::report::{PoseEstimate, Report};
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
    /// or the reason why not. With a latched fault: that fault.
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
/// The state while a step runs: not a state.
const UNFINISHED: RedundantWord = RedundantWord::of_two(0, 0);
/// Half the range of the clock: a longer step counts as backwards.
const BACKWARDS_MS: u32 = 1 << 31;

mod earning;
mod order;
mod weighing;

/// The outcome of a step, or [`CorruptWord`] if memory is corrupted.
type Weighed = Result<Result<(), Reason>, CorruptWord>;

impl<'a> Gate<'a> {
    /// Makes a closed gate on the bytes of a table, at the controller's time `now_ms`. Runs [`self_test`] and checks
    /// the whole table. A table that is damaged, of another task or with another task digest gives a gate that denies with
    /// that reason: a controller with damaged flash must still answer.
    ///
    /// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
    /// ever ([`super::Clock`]).
    ///
    /// # Errors
    /// [`InvalidParameter`] if a parameter would switch a check off, or keep the gate closed for ever.
    pub fn new(
        table: &'a [u8],
        settings: &'a Settings<'a>,
        now_ms: u32,
    ) -> Result<Self, InvalidParameter> {
        Self::after(self_test(), table, settings, now_ms)
    }

    /// Returns `Ok` if the self-test has passed and nothing is latched besides the reason why the gate has no table; else the reason that is
    /// latched. For [`Gate::after`].
    ///
    /// # Errors
    /// The [`Reason`] that stays latched.
    pub fn is_sound(&self) -> Result<(), Reason> {
        if self.check_settings().is_err() {
            return Err(Reason::MemoryDamaged);
        }
        match (self.state(), self.table) {
            (State::Latched(Reason::SelfTestFailed), _) => Err(Reason::SelfTestFailed),
            (State::Latched(reason), Err(of_table)) if reason == of_table => Ok(()),
            (State::Latched(reason), _) => Err(reason),
            _ => Ok(()),
        }
    }

    /// Makes a closed gate as [`Gate::new`] does, without the self-test, whose result is given: for a change of the table in one control cycle.
    ///
    /// ```
    /// # use posegate::gate::{Gate, InvalidParameter, Settings};
    /// # fn change<'a>(gate: &Gate<'a>, next: &'a [u8], settings: &'a Settings<'a>, now_ms: u32) -> Result<Gate<'a>, InvalidParameter> {
    /// Gate::after(gate.is_sound(), next, settings, now_ms)
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`InvalidParameter`] if the settings are invalid.
    pub fn after(
        is_sound: Result<(), Reason>,
        table: &'a [u8],
        settings: &'a Settings<'a>,
        now_ms: u32,
    ) -> Result<Self, InvalidParameter> {
        settings.check()?;
        let parsed = match is_sound {
            Err(Reason::SelfTestFailed) => Err(Reason::SelfTestFailed),
            _ => checked(table, settings),
        };
        let state = match is_sound.err().or(parsed.err()) {
            None => DecodedState::Inhibited(Reason::Silent),
            Some(reason) => DecodedState::Latched(reason),
        };
        Ok(Self {
            bytes: table,
            table: parsed,
            settings,
            checked: RedundantWord::new(settings.digest()),
            table_crc: RedundantWord::new(table::stored_checksum(table)),
            table_mark: RedundantWord::new(table::stored_mark(table)),
            now_ms: RedundantWord::new(now_ms),
            closed_at_ms: RedundantWord::new(now_ms),
            permitted_at_ms: RedundantWord::new(now_ms),
            state: state.word(),
            last_source: RedundantWord::new(NO_SOURCE),
            last_sequence: RedundantWord::new(0),
            newest_stamp_ms: RedundantWord::new(0),
            scrub: Scrub::new(),
        })
    }

    /// Checks the table again and restarts the gate, closed. This is the only way out of a latched fault. A reset is
    /// a manual action: never call it from a timer. If the settings have changed, latches [`Reason::MemoryDamaged`]:
    /// restart the controller.
    ///
    /// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
    /// ever ([`super::Clock`]).
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

    /// Returns the table, or the reason why the gate has none.
    ///
    /// # Errors
    /// [`Reason::TableDamaged`], [`Reason::TableTooNew`], [`Reason::PartMissing`], [`Reason::WrongTask`], [`Reason::WrongSite`] or [`Reason::SelfTestFailed`].
    pub const fn table(&self) -> Result<&Table<'a>, Reason> {
        match &self.table {
            Ok(table) => Ok(table),
            Err(reason) => Err(*reason),
        }
    }

    /// Evaluates a report at the controller's time `now_ms`.
    ///
    /// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
    /// ever ([`super::Clock`]).
    pub fn step(&mut self, now_ms: u32, report: &Report) -> Step {
        self.step_on(now_ms, &Evidence::of(report))
    }

    /// As [`Gate::step`], for a report with several hypotheses, or a report that was carried along odometry.
    ///
    /// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
    /// ever ([`super::Clock`]).
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
    ///
    /// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
    /// ever ([`super::Clock`]).
    pub fn tick(&mut self, now_ms: u32) -> Step {
        if self.process_tick(now_ms).is_err() {
            self.fault(Reason::MemoryDamaged);
        }
        self.output(None)
    }

    /// Ends a permit, and the permits counted so far, at the controller's time `now_ms`. Call it if something else
    /// has closed the interlock for a cause that may pass, such as a watchdog or a mode of the machine. The gate then
    /// qualifies again as after a denial. With [`super::Restart::OnReset`] an open gate waits for the reset.
    ///
    /// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
    /// ever ([`super::Clock`]).
    pub fn inhibit(&mut self, now_ms: u32, reason: Reason) -> Step {
        if self.interrupt(now_ms, reason).is_err() {
            self.fault(Reason::MemoryDamaged);
        }
        self.output(None)
    }

    /// Latches a fault that was found elsewhere, by the interlock or by a check of the code. The first fault remains
    /// the reported one; it replaces the reason why a gate has no table, which ends with a change of the table.
    #[cfg_attr(small_code, inline(never))]
    pub fn fault(&mut self, reason: Reason) {
        match DecodedState::of(self.state) {
            Ok(DecodedState::Latched(first)) if self.table.err() != Some(first) => {}
            _ => self.state = DecodedState::Latched(reason).word(),
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
    /// cost of [`crate::contain::examine`]. For telemetry: the gate does not change.
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
        let reason = self.verdict_without_report(self.state()).err()?;
        Some(reason.advice(self.settings.look_at))
    }

    fn process_report(&mut self, now_ms: u32, evidence: &Evidence<'_>) -> Weighed {
        let report = evidence.report;
        let mut before = self.revoke()?;
        let source = self.source_of(report);
        let passed = self.advance_time(now_ms, &mut before)?;
        let newest = self.is_newest(now_ms, report.stamp_ms)?;
        match passed {
            Ok(()) => self.take(now_ms, evidence, source, newest, &before),
            // The report is remembered, but not evaluated.
            Err(reason) => {
                self.remember(report, source, newest)?;
                Ok(Err(reason))
            }
        }
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
    /// the state from before. Until a new state is stored, the state is a corrupt word: a step that is not completed, or that stores elsewhere
    /// what it found, leaves a fault. A permit is the last thing that a step stores.
    fn revoke(&mut self) -> Result<StateSnapshot, CorruptWord> {
        let before = StateSnapshot::of(self.state)?;
        if !matches!(before.standing, DecodedState::Latched(_)) {
            self.state = UNFINISHED;
        }
        self.check_settings()?;
        if !self.table_is_the_same()? {
            self.fault(Reason::TableDamaged);
            return StateSnapshot::of(self.state);
        }
        Ok(before)
    }

    /// Returns `true` if the table in flash still has the mark that it had at the start: its length, task digest and
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
                if !matches!(before.standing, DecodedState::Latched(_)) {
                    self.state = UNFINISHED;
                }
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
        now_ms: u32,
        evidence: &Evidence<'_>,
        source: Result<&Source, Reason>,
        newest: Result<u32, Reason>,
        before: &StateSnapshot,
    ) -> Weighed {
        let report = evidence.report;
        if let DecodedState::Latched(reason) = before.standing {
            self.remember(report, source, newest)?;
            return Ok(Err(reason));
        }
        let mut flow = FlowSignature::start();
        let weighed = self.weigh(now_ms, evidence, source, newest, &mut flow)?;
        match weighed {
            Ok(()) => {
                if self.follows_again(report) {
                    flow.past(Check::FollowedAgain);
                }
                self.remember(report, source, newest)?;
                let held = self.is_held_long_enough()?;
                self.permit(before, held, flow)?;
            }
            // The gate remembers it already.
            Err(Reason::Repeated) => self.repeat(report, before),
            Err(Reason::EvaluationsDisagree) => self.fault(Reason::EvaluationsDisagree),
            Err(reason) => {
                self.remember(report, source, newest)?;
                self.close(before, reason);
            }
        }
        Ok(weighed)
    }

    /// Returns the current permission and state, with the verdict on a report if there is one. A permit, or permits in a row, that should
    /// have ended are a fault: the first check of the times was skipped, or it is wrong.
    fn output(&mut self, mut verdict: Option<Result<(), Reason>>) -> Step {
        let mut standing =
            DecodedState::of(self.state).unwrap_or(DecodedState::Latched(Reason::MemoryDamaged));
        let mut permission = Permission::DENIED;
        if standing.is_earning() {
            if !self.stands() {
                self.fault(Reason::MemoryDamaged);
                standing = DecodedState::Latched(Reason::MemoryDamaged);
                verdict = None;
            } else if let DecodedState::Permitted(mut flow) = standing {
                flow.past(Check::Stands);
                permission = Permission::after(flow, self.now_ms.by_complement());
            }
        } else if let DecodedState::Latched(_) = standing {
            // Not what a report found after the fault.
            verdict = None;
        }
        let state = standing.state();
        Step {
            permission,
            state,
            verdict: verdict.unwrap_or_else(|| self.verdict_without_report(state)),
        }
    }

    /// Returns `Ok` if the gate is open in a state, or the reason why not.
    fn verdict_without_report(&self, state: State) -> Result<(), Reason> {
        match state {
            State::Permitted => Ok(()),
            State::Qualifying(_) => Err(match self.is_held_long_enough() {
                Ok(true) => Reason::Qualifying,
                _ => Reason::Holding,
            }),
            State::Inhibited(reason) | State::Latched(reason) => Err(reason),
        }
    }
}

/// Parses a table, checks that it is for the task and site that the controller expects, and limits its walks.
fn checked<'a>(bytes: &'a [u8], settings: &Settings<'_>) -> Result<Table<'a>, Reason> {
    let table = Table::parse(bytes)?;
    if table.task() != settings.task {
        return Err(Reason::WrongTask);
    }
    if !table.is_of_task(&settings.task_digest) {
        return Err(Reason::WrongSite);
    }
    Ok(table.within(settings.most_runs))
}

#[cfg(test)]
mod tests;
