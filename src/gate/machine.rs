//! The gate's state machine: closed at first, closed after every error, open only after permits in a row.

use super::doubled::{Damaged, Doubled};
use super::permission::{Check, Flow};
use super::scrub::{Scrub, Scrubbed};
use super::standing::{Before, Standing};
use super::{Advice, InvalidParameter, Permission, Reason, Restart, Settings, Verdict, self_test};
use crate::contain::{self, Decision, second};
use crate::report::Report;
use crate::table::Table;
use core::hint::black_box;

/// Where a gate stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum State {
    /// Closed: the last report was denied, or none has come.
    Inhibited(Reason),
    /// Closed: so many reports in a row have permitted, and more must, or the hold time is not over.
    Qualifying(u16),
    /// Open.
    Permitted,
    /// Closed until [`Gate::reset`].
    Latched(Reason),
}

/// What a gate says at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct Step {
    /// For the interlock.
    pub permission: Permission,
    /// Where the gate stands.
    pub state: State,
    /// Whether the report that came with the step permits by itself, or why not; without a report, whether
    /// the gate is open, or why not.
    pub verdict: Result<(), Reason>,
}

/// A gate: feeds on reports, remembers, and says whether the interlock may open.
///
/// It permits only after [`Settings::permits_in_a_row`] consecutive fresh permits of one source; it
/// inhibits at once on a denial, a stale estimate, a sequence gap, or time going backwards. Faults
/// (damaged memory, table or code, evaluations that disagree, an interlock that does not follow) are
/// latched until [`Gate::reset`]. What it assumes and what it cannot know: [`super::assumptions`].
///
/// Its own words are kept beside their complements; the table is read from flash by the second evaluation,
/// so that what falls over in memory cannot make a permit of a denial. Every step takes the permit back
/// before it looks at anything: only a whole way through the checks gives it again, so that a program that
/// jumps over a part of its way is left closed.
#[derive(Clone, Copy, Debug)]
pub struct Gate<'a> {
    bytes: &'a [u8],
    table: Result<Table<'a>, Reason>,
    settings: &'a Settings<'a>,
    /// The digest of the settings as they were checked.
    checked: Doubled,
    /// The controller's clock when it was last told.
    now_ms: Doubled,
    /// When the last denial was, at most its hold time ago.
    closed_at_ms: Doubled,
    /// When the last permit was.
    permitted_at_ms: Doubled,
    state: Doubled,
    /// The source of the last report, or [`NO_SOURCE`]; its sequence number and stamp.
    last_source: Doubled,
    last_sequence: Doubled,
    last_stamp_ms: Doubled,
    scrub: Scrub,
}

#[cfg(feature = "defmt")]
impl defmt::Format for Gate<'_> {
    /// Where it stands; its other words are its own.
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Gate {{ state: {} }}", self.state());
    }
}

/// No report has come since the start or the reset.
const NO_SOURCE: u32 = 0x0001_0000;
/// Half the range of the clock: farther is backwards.
const BACKWARDS_MS: u32 = 1 << 31;

/// A step's outcome, or memory that cannot be read.
type Weighed = Result<Result<(), Reason>, Damaged>;

impl<'a> Gate<'a> {
    /// A gate on the bytes of a table, closed, at the controller's time `now_ms`. It tests itself
    /// ([`self_test`]) and checks the table in full; one that is damaged, of another task or of another site gives a gate that denies and says
    /// why, since a controller with damaged flash must still answer.
    ///
    /// # Errors
    /// [`InvalidParameter`]: a parameter that would switch a check off.
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
            checked: Doubled::new(settings.digest()),
            now_ms: Doubled::new(now_ms),
            closed_at_ms: Doubled::new(now_ms),
            permitted_at_ms: Doubled::new(now_ms),
            state: Doubled::new(0),
            last_source: Doubled::new(NO_SOURCE),
            last_sequence: Doubled::new(0),
            last_stamp_ms: Doubled::new(0),
            scrub: Scrub::new(),
        };
        gate.start();
        Ok(gate)
    }

    /// Checks the table again and begins anew, closed, with the settings as they stand: the one way out
    /// of a latched fault. For a person's hand, never for a timer's.
    ///
    /// # Errors
    /// [`InvalidParameter`], and the gate stays as it was.
    pub fn reset(&mut self, now_ms: u32) -> Result<(), InvalidParameter> {
        *self = Self::new(self.bytes, self.settings, now_ms)?;
        Ok(())
    }

    fn start(&mut self) {
        self.table = self_test().and_then(|()| checked(self.bytes, self.settings));
        match self.table {
            Ok(_) => self.inhibit(Reason::Silent),
            Err(reason) => self.state = Standing::Latched(reason).word(),
        }
    }

    /// The table, or why there is none.
    ///
    /// # Errors
    /// [`Reason::TableInvalid`], [`Reason::WrongTask`], [`Reason::WrongSite`].
    pub const fn table(&self) -> Result<&Table<'a>, Reason> {
        match &self.table {
            Ok(table) => Ok(table),
            Err(reason) => Err(*reason),
        }
    }

    /// Takes a report at the controller's time `now_ms`.
    pub fn step(&mut self, now_ms: u32, report: &Report) -> Step {
        let verdict = self.listen(now_ms, report).unwrap_or_else(|Damaged| {
            self.fault(Reason::MemoryDamaged);
            Err(Reason::MemoryDamaged)
        });
        self.told(Some(verdict))
    }

    /// Lets time pass without a report: in every control cycle, so that a permit ends when reports do.
    pub fn tick(&mut self, now_ms: u32) -> Step {
        if self.wait(now_ms).is_err() {
            self.fault(Reason::MemoryDamaged);
        }
        self.told(None)
    }

    /// Latches a fault that something else has found: the interlock, a check of the code. The first fault
    /// stays the one that is told.
    pub fn fault(&mut self, reason: Reason) {
        if !matches!(Standing::of(self.state), Ok(Standing::Latched(_))) {
            self.state = Standing::Latched(reason).word();
        }
    }

    /// Looks at the next `count` bytes of the table in flash, and latches [`Reason::TableDamaged`] at the
    /// end of a round that finds them changed. For a main loop's idle time.
    pub fn scrub(&mut self, count: usize) -> Scrubbed {
        let Some((content, crc)) = self.bytes.split_last_chunk::<4>() else {
            return Scrubbed::Damaged;
        };
        let scrubbed = self.scrub.step(content, u32::from_le_bytes(*crc), count);
        if scrubbed == Scrubbed::Damaged {
            self.fault(Reason::TableDamaged);
        }
        scrubbed
    }

    /// Where the gate stands.
    pub fn state(&self) -> State {
        Standing::of(self.state).map_or(State::Latched(Reason::MemoryDamaged), Standing::state)
    }

    /// The verdict on a report's belief with its margin and worst pose, as [`super::judge`] gives it: for
    /// telemetry, at the cost of [`contain::examine`]. It does not change the gate.
    pub fn examine(&self, report: &Report) -> Verdict {
        let table = match &self.table {
            Ok(table) => table,
            Err(reason) => return Verdict::deny(*reason),
        };
        let Some(source) = self.settings.sources.get(usize::from(report.source)) else {
            return Verdict::deny(Reason::SourceUnknown);
        };
        if report.frame != source.frame {
            return Verdict::deny(Reason::FrameMismatch);
        }
        match report.belief.pose_set(table.radius_squared(), source.trust) {
            Ok(set) => super::judge(table, &set),
            Err(impossible) => Verdict::deny(impossible.into()),
        }
    }

    /// What to do, where the gate is not open.
    #[must_use]
    pub fn advice(&self) -> Option<Advice> {
        let reason = self.told(None).verdict.err()?;
        Some(reason.advice(self.settings.look_at))
    }

    fn listen(&mut self, now_ms: u32, report: &Report) -> Weighed {
        let mut before = self.take_back()?;
        let verdict = match self.pass(now_ms, &mut before)? {
            Ok(()) => self.take(report, &before)?,
            // Remembered, and not looked at.
            Err(reason) => Err(reason),
        };
        // A stranger's report is not what the next one is held against.
        if !matches!(verdict, Err(Reason::SourceUnknown | Reason::FrameMismatch)) {
            self.remember(report);
        }
        Ok(verdict)
    }

    fn wait(&mut self, now_ms: u32) -> Result<(), Damaged> {
        let mut before = self.take_back()?;
        if self.pass(now_ms, &mut before)?.is_ok() {
            self.give_back(&before);
        }
        Ok(())
    }

    /// Takes what stands back, before anything is looked at.
    fn take_back(&mut self) -> Result<Before, Damaged> {
        let before = Before::of(self.state)?;
        if !matches!(before.standing, Standing::Latched(_)) {
            self.state = Standing::Inhibited(Reason::Silent).word();
        }
        Ok(before)
    }

    /// What stood, stands again.
    fn give_back(&mut self, before: &Before) {
        self.state = before.state;
    }

    /// The time that has passed, and what it ends of what stood before. A reason where it did not pass as
    /// time does.
    fn pass(&mut self, now_ms: u32, before: &mut Before) -> Weighed {
        let passed = now_ms.wrapping_sub(self.now_ms.get()?);
        self.now_ms = Doubled::new(now_ms);
        if !(passed < BACKWARDS_MS) {
            self.close(before, Reason::TimeBackwards);
            return Ok(Err(Reason::TimeBackwards));
        }
        if before.standing.is_earning() {
            let fresh = self.is_fresh(self.last_stamp_ms.get()?)?;
            let since = now_ms.wrapping_sub(self.permitted_at_ms.get()?);
            if !(fresh && since <= self.settings.permit_hold_ms) {
                let reason = if fresh { Reason::Silent } else { Reason::Stale };
                self.close(before, reason);
                *before = Before::of(self.state)?;
            }
        }
        // Kept as no longer ago than that, so that the clock's wrap does not make it young again.
        let hold = self.settings.inhibit_hold_ms;
        if now_ms.wrapping_sub(self.closed_at_ms.get()?) > hold {
            self.closed_at_ms = Doubled::new(now_ms.wrapping_sub(hold));
        }
        Ok(Ok(()))
    }

    /// Weighs a report, and moves by what it is.
    fn take(&mut self, report: &Report, before: &Before) -> Weighed {
        if let Standing::Latched(reason) = before.standing {
            return Ok(Err(reason));
        }
        let mut flow = Flow::start();
        let weighed = self.weigh(report, before, &mut flow)?;
        match weighed {
            Ok(()) => self.permit(report, before, flow)?,
            // Nothing new: what stands, stands for as long as it may.
            Err(Reason::Repeated) if self.is_last_again(report) => self.give_back(before),
            Err(Reason::EvaluationsDisagree) => self.fault(Reason::EvaluationsDisagree),
            Err(reason) => self.close(before, reason),
        }
        Ok(weighed)
    }

    /// Whether a report permits by itself.
    fn weigh(&self, report: &Report, before: &Before, flow: &mut Flow) -> Weighed {
        if self.checked.get()? != self.settings.digest() {
            return Err(Damaged);
        }
        let Some(source) = self.settings.sources.get(usize::from(report.source)) else {
            return Ok(Err(Reason::SourceUnknown));
        };
        if !(report.frame == source.frame) {
            return Ok(Err(Reason::FrameMismatch));
        }
        if let Err(reason) = self.follows(report, before)? {
            return Ok(Err(reason));
        }
        flow.past(Check::Followed);
        if !self.is_fresh(report.stamp_ms)? {
            return Ok(Err(Reason::Stale));
        }
        flow.past(Check::Fresh);
        let table = match &self.table {
            Ok(table) => table,
            Err(reason) => return Ok(Err(*reason)),
        };
        let set = report.belief.pose_set(table.radius_squared(), source.trust);
        // By reference: the set is larger than the rest of the step.
        let set = match &set {
            Ok(set) => set,
            Err(impossible) => return Ok(Err((*impossible).into())),
        };
        match contain::decide(table, set) {
            Decision::Inside => flow.past(Check::First),
            Decision::Outside(cause) => return Ok(Err(cause.into())),
        }
        // Looked up once more, so that both evaluations do not rest on one pointer.
        let Some(source) = black_box(self.settings)
            .sources
            .get(usize::from(report.source))
        else {
            return Err(Damaged);
        };
        if !(second::opinion(self.bytes, &report.belief, source.trust) == second::INSIDE) {
            return Ok(Err(Reason::EvaluationsDisagree));
        }
        flow.past(Check::Second);
        Ok(Ok(()))
    }

    /// Whether a report is the next one of its source.
    fn follows(&self, report: &Report, before: &Before) -> Weighed {
        let source = self.last_source.get()?;
        if source == NO_SOURCE {
            return Ok(Ok(()));
        }
        if source != u32::from(report.source) {
            // A new source begins anew; while another was earning or holding a permit, that ends it.
            return Ok(if before.standing.is_earning() {
                Err(Reason::SourceChanged)
            } else {
                Ok(())
            });
        }
        let later = report.stamp_ms.wrapping_sub(self.last_stamp_ms.get()?);
        let sequence = self.last_sequence.get()?;
        Ok(match report.sequence.wrapping_sub(sequence) {
            0 if later == 0 => Err(Reason::Repeated),
            0 => Err(Reason::SequenceStuck),
            1 if later == 0 || !(later < BACKWARDS_MS) => Err(Reason::TimeBackwards),
            1 => Ok(()),
            _ => Err(Reason::SequenceGap),
        })
    }

    /// Whether a report has the frame of its source and follows on the last: once more, from the
    /// complements and in another form, against a first look that was falsified.
    fn follows_again(&self, report: &Report, before: &Before) -> bool {
        let source = self.last_source.by_complement();
        let known = black_box(self.settings).sources;
        let framed = known
            .get(usize::from(report.source))
            .is_some_and(|known| known.frame.digest() ^ report.frame.digest() == 0);
        if source == NO_SOURCE {
            return framed;
        }
        if source ^ u32::from(report.source) != 0 {
            return framed && before.is_inhibited_by_complement();
        }
        let sequence = self.last_sequence.by_complement();
        let stamp = self.last_stamp_ms.by_complement();
        framed
            && sequence.wrapping_add(1) ^ report.sequence == 0
            && stamp.wrapping_sub(report.stamp_ms) > BACKWARDS_MS
    }

    /// Whether a report is the last one: once more, against another denial that is taken for this one.
    fn is_last_again(&self, report: &Report) -> bool {
        self.last_source.by_complement() ^ u32::from(report.source) == 0
            && self.last_sequence.by_complement() ^ report.sequence == 0
            && self.last_stamp_ms.by_complement() ^ report.stamp_ms == 0
    }

    fn remember(&mut self, report: &Report) {
        self.last_source = Doubled::new(u32::from(report.source));
        self.last_sequence = Doubled::new(report.sequence);
        self.last_stamp_ms = Doubled::new(report.stamp_ms);
    }

    /// Whether a stamp is no older than the maximum age and not from the future, which is an age of half
    /// the clock's range or more.
    fn is_fresh(&self, stamp_ms: u32) -> Result<bool, Damaged> {
        let age = self.now_ms.get()?.wrapping_sub(stamp_ms);
        Ok(age <= self.settings.maximum_age_ms)
    }

    /// One permit more.
    fn permit(&mut self, report: &Report, before: &Before, mut flow: Flow) -> Result<(), Damaged> {
        if !self.follows_again(report, before) {
            return Err(Damaged);
        }
        flow.past(Check::FollowedAgain);
        // The age once more, from the other copies.
        let settings = black_box(self.settings);
        let now = self.now_ms.by_complement();
        if settings.maximum_age_ms < now.wrapping_sub(report.stamp_ms) {
            return Err(Damaged);
        }
        flow.past(Check::FreshAgain);
        self.permitted_at_ms = self.now_ms;
        let needed = u32::from(settings.permits_in_a_row);
        let so_far = match before.standing {
            Standing::Inhibited(_) => 0,
            Standing::Qualifying(count) => u32::from(count),
            Standing::Permitted(_) => needed,
            Standing::Latched(_) => return Err(Damaged),
        };
        let count = so_far.saturating_add(1).min(0xffff);
        if !(count >= needed && self.is_held_long_enough()?) {
            self.state = Standing::Qualifying(count as u16).word();
            return Ok(());
        }
        // Number and times once more, from the other copies: against a count or a subtraction that went wrong.
        if !before.has_earned_by_complement(settings.permits_in_a_row)
            || !self.is_held_long_enough_by_complement(settings)
        {
            return Err(Damaged);
        }
        flow.past(Check::Qualified);
        self.state = Standing::Permitted(flow).word();
        Ok(())
    }

    /// Whether the last denial has stood for its hold time.
    fn is_held_long_enough(&self) -> Result<bool, Damaged> {
        let closed_for = self.now_ms.get()?.wrapping_sub(self.closed_at_ms.get()?);
        Ok(closed_for >= self.settings.inhibit_hold_ms)
    }

    /// The same, from the other copies.
    fn is_held_long_enough_by_complement(&self, settings: &Settings<'_>) -> bool {
        let now = self.now_ms.by_complement();
        let opens = self
            .closed_at_ms
            .by_complement()
            .wrapping_add(settings.inhibit_hold_ms);
        now.wrapping_sub(opens) <= u32::MAX.wrapping_sub(settings.inhibit_hold_ms)
    }

    /// Closes, for the hold time at least; for good where a restart is a person's.
    fn close(&mut self, before: &Before, reason: Reason) {
        match before.standing {
            Standing::Latched(_) => {}
            Standing::Permitted(_) if self.settings.restart == Restart::OnReset => {
                self.state = Standing::Latched(reason).word();
            }
            _ => self.inhibit(reason),
        }
    }

    fn inhibit(&mut self, reason: Reason) {
        self.closed_at_ms = self.now_ms;
        self.state = Standing::Inhibited(reason).word();
    }

    /// Whether a permit still stands: once more, by the times themselves and from the other copies,
    /// whatever the first look let stand.
    fn stands(&self) -> bool {
        let settings = black_box(self.settings);
        let now = self.now_ms.by_complement();
        let age = now.wrapping_sub(self.last_stamp_ms.by_complement());
        let since = now.wrapping_sub(self.permitted_at_ms.by_complement());
        age <= settings.maximum_age_ms && since <= settings.permit_hold_ms
    }

    /// What stands, with a report's own verdict or without one.
    fn told(&self, verdict: Option<Result<(), Reason>>) -> Step {
        let standing = Standing::of(self.state).unwrap_or(Standing::Latched(Reason::MemoryDamaged));
        let permission = match standing {
            Standing::Permitted(mut flow) if self.stands() => {
                flow.past(Check::Stands);
                Permission::after(flow)
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

/// The table of these bytes, if it is the one that the controller expects.
fn checked<'a>(bytes: &'a [u8], settings: &Settings<'_>) -> Result<Table<'a>, Reason> {
    let table = Table::parse(bytes).map_err(|_| Reason::TableInvalid)?;
    if table.task() != settings.task {
        return Err(Reason::WrongTask);
    }
    if table.site_digest() != settings.site_digest {
        return Err(Reason::WrongSite);
    }
    Ok(table)
}

#[cfg(test)]
mod tests;
