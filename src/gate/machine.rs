//! The gate's state machine: closed at first, closed after every error, open only after permits in a row.

use super::doubled::{Damaged, Doubled};
use super::permission::{Check, Flow};
use super::scrub::{Scrub, Scrubbed};
use super::{
    Advice, InvalidParameter, Permission, Reason, Restart, Settings, Source, Verdict, self_test,
};
use crate::contain::{self, Decision, second};
use crate::report::Report;
use crate::set::CrossTerms;
use crate::table::Table;

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
/// so that what falls over in memory cannot make a permit of a denial.
#[derive(Clone, Copy, Debug)]
pub struct Gate<'a> {
    bytes: &'a [u8],
    table: Result<Table<'a>, Reason>,
    settings: &'a Settings<'a>,
    /// The digest of the sources' settings as they were checked.
    sources: Doubled,
    maximum_age_ms: Doubled,
    permit_hold_ms: Doubled,
    inhibit_hold_ms: Doubled,
    permits_in_a_row: Doubled,
    /// The controller's clock when it was last told.
    now_ms: Doubled,
    /// What is left of the time that a denial stands.
    inhibit_left_ms: Doubled,
    /// What is left of the time that the last permit stands.
    permit_left_ms: Doubled,
    state: Doubled,
    /// The source of the last report, or [`NO_SOURCE`]; its sequence number and stamp.
    last_source: Doubled,
    last_sequence: Doubled,
    last_stamp_ms: Doubled,
    scrub: Scrub,
}

/// No report has come since the start or the reset.
const NO_SOURCE: u32 = 0x0001_0000;
/// Half the range of the clock: farther is backwards.
const BACKWARDS_MS: u32 = 1 << 31;

/// Marks of the states, in the upper half of the state's word.
const INHIBITED: u32 = 0x1196;
const QUALIFYING: u32 = 0x2e69;
const PERMITTED: u32 = 0xa53c;
const LATCHED: u32 = 0x5bc3;

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
            sources: Doubled::new(digest(settings.sources)),
            maximum_age_ms: Doubled::new(settings.maximum_age_ms),
            permit_hold_ms: Doubled::new(settings.permit_hold_ms),
            inhibit_hold_ms: Doubled::new(settings.inhibit_hold_ms),
            permits_in_a_row: Doubled::new(u32::from(settings.permits_in_a_row)),
            now_ms: Doubled::new(now_ms),
            inhibit_left_ms: Doubled::new(0),
            permit_left_ms: Doubled::new(0),
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
            Ok(_) => self.inhibit(Reason::Silent, self.settings.inhibit_hold_ms),
            Err(reason) => self.latch(reason),
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
        let weighed = match self.pass(now_ms) {
            Ok(Ok(())) => self.take(report),
            // Remembered, and not looked at.
            Ok(Err(reason)) => self.follow(report).map(|_| Err(reason)),
            Err(Damaged) => Err(Damaged),
        };
        let verdict = weighed.unwrap_or_else(|Damaged| {
            self.latch(Reason::MemoryDamaged);
            Err(Reason::MemoryDamaged)
        });
        self.told(Some(verdict))
    }

    /// Lets time pass without a report: in every control cycle, so that a permit ends when reports do.
    pub fn tick(&mut self, now_ms: u32) -> Step {
        if self.pass(now_ms).is_err() {
            self.latch(Reason::MemoryDamaged);
        }
        self.told(None)
    }

    /// Latches a fault that something else has found: the interlock, a check of the code.
    pub fn fault(&mut self, reason: Reason) {
        self.latch(reason);
    }

    /// Looks at the next `count` bytes of the table in flash, and latches [`Reason::TableDamaged`] at the
    /// end of a round that finds them changed. For a main loop's idle time.
    pub fn scrub(&mut self, count: usize) -> Scrubbed {
        let Some((content, crc)) = self.bytes.split_last_chunk::<4>() else {
            return Scrubbed::Damaged;
        };
        let scrubbed = self.scrub.step(content, u32::from_le_bytes(*crc), count);
        if scrubbed == Scrubbed::Damaged {
            self.latch(Reason::TableDamaged);
        }
        scrubbed
    }

    /// Where the gate stands.
    pub fn state(&self) -> State {
        self.read_state()
            .map_or(State::Latched(Reason::MemoryDamaged), Standing::state)
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

    /// The time that has passed, and what it ends. A reason where it did not pass as time does.
    fn pass(&mut self, now_ms: u32) -> Weighed {
        let passed = now_ms.wrapping_sub(self.now_ms.get()?);
        self.now_ms = Doubled::new(now_ms);
        if !(passed < BACKWARDS_MS) {
            self.close(Reason::TimeBackwards)?;
            return Ok(Err(Reason::TimeBackwards));
        }
        let left = self.inhibit_left_ms.get()?;
        self.inhibit_left_ms = Doubled::new(left.saturating_sub(passed));
        if !matches!(
            self.read_state()?,
            Standing::Qualifying(_) | Standing::Permitted(_)
        ) {
            return Ok(Ok(()));
        }
        match self.permit_left_ms.get()?.checked_sub(passed) {
            Some(left) => self.permit_left_ms = Doubled::new(left),
            None if self.is_fresh(self.last_stamp_ms.get()?)? => self.close(Reason::Silent)?,
            None => self.close(Reason::Stale)?,
        }
        Ok(Ok(()))
    }

    /// Weighs a report, and moves by what it is.
    fn take(&mut self, report: &Report) -> Weighed {
        if let Standing::Latched(reason) = self.read_state()? {
            return Ok(Err(reason));
        }
        let mut flow = Flow::start();
        match self.weigh(report, &mut flow)? {
            Ok(()) => self.permit(report, flow),
            // Nothing new: what stands, stands for as long as it may.
            Err(Reason::Repeated) => Ok(Err(Reason::Repeated)),
            Err(Reason::EvaluationsDisagree) => {
                self.latch(Reason::EvaluationsDisagree);
                Ok(Err(Reason::EvaluationsDisagree))
            }
            Err(reason) => {
                self.close(reason)?;
                Ok(Err(reason))
            }
        }
    }

    /// Whether a report permits by itself.
    fn weigh(&mut self, report: &Report, flow: &mut Flow) -> Weighed {
        if self.sources.get()? != digest(self.settings.sources) {
            return Err(Damaged);
        }
        let Some(source) = self.settings.sources.get(usize::from(report.source)) else {
            return Ok(Err(Reason::SourceUnknown));
        };
        if !(report.frame == source.frame) {
            return Ok(Err(Reason::FrameMismatch));
        }
        if let Err(reason) = self.follow(report)? {
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
        let set = match report.belief.pose_set(table.radius_squared(), source.trust) {
            Ok(set) => set,
            Err(impossible) => return Ok(Err(impossible.into())),
        };
        match contain::decide(table, &set) {
            Decision::Inside => flow.past(Check::First),
            Decision::Outside(cause) => return Ok(Err(cause.into())),
        }
        if !(second::opinion(self.bytes, &report.belief, source.trust) == second::INSIDE) {
            return Ok(Err(Reason::EvaluationsDisagree));
        }
        flow.past(Check::Second);
        Ok(Ok(()))
    }

    /// Whether a report is the next one of its source; remembers it.
    fn follow(&mut self, report: &Report) -> Weighed {
        let (source, sequence, stamp) = (
            self.last_source.get()?,
            self.last_sequence.get()?,
            self.last_stamp_ms.get()?,
        );
        self.last_source = Doubled::new(u32::from(report.source));
        self.last_sequence = Doubled::new(report.sequence);
        self.last_stamp_ms = Doubled::new(report.stamp_ms);
        if source == NO_SOURCE {
            return Ok(Ok(()));
        }
        if source != u32::from(report.source) {
            // A new source begins anew; while another was earning or holding a permit, that ends it.
            let earning = matches!(
                self.read_state()?,
                Standing::Qualifying(_) | Standing::Permitted(_)
            );
            return Ok(if earning {
                Err(Reason::SourceChanged)
            } else {
                Ok(())
            });
        }
        let later = report.stamp_ms.wrapping_sub(stamp);
        Ok(match report.sequence.wrapping_sub(sequence) {
            0 if later == 0 => Err(Reason::Repeated),
            0 => Err(Reason::SequenceStuck),
            1 if later == 0 || !(later < BACKWARDS_MS) => Err(Reason::TimeBackwards),
            1 => Ok(()),
            _ => Err(Reason::SequenceGap),
        })
    }

    /// Whether a stamp is no older than the maximum age and not from the future, which is an age of half
    /// the clock's range or more.
    fn is_fresh(&self, stamp_ms: u32) -> Result<bool, Damaged> {
        let age = self.now_ms.get()?.wrapping_sub(stamp_ms);
        Ok(age <= self.maximum_age_ms.get()?)
    }

    /// One permit more.
    fn permit(&mut self, report: &Report, mut flow: Flow) -> Weighed {
        // Once more, and from the other copies.
        let age = self.now_ms.by_complement().wrapping_sub(report.stamp_ms);
        let fresh_for = self.maximum_age_ms.by_complement().checked_sub(age);
        let fresh_for = fresh_for.ok_or(Damaged)?;
        flow.past(Check::FreshAgain);
        self.permit_left_ms = Doubled::new(self.permit_hold_ms.get()?.min(fresh_for));
        let needed = self.permits_in_a_row.get()?;
        let so_far = match self.read_state()? {
            Standing::Inhibited(_) => 0,
            Standing::Qualifying(count) => u32::from(count),
            Standing::Permitted(_) => needed,
            Standing::Latched(reason) => return Ok(Err(reason)),
        };
        let count = so_far.saturating_add(1).min(0xffff);
        if count >= needed && self.inhibit_left_ms.get()? == 0 {
            // Once more, and from the other copies.
            if self.permits_in_a_row.by_complement() > count
                || self.inhibit_left_ms.by_complement() != 0
            {
                return Err(Damaged);
            }
            flow.past(Check::Qualified);
            self.write_state(PERMITTED, flow.word());
        } else {
            self.write_state(QUALIFYING, count as u16);
        }
        Ok(Ok(()))
    }

    /// Closes, for the hold time at least; for good where a restart is a person's.
    fn close(&mut self, reason: Reason) -> Result<(), Damaged> {
        match self.read_state()? {
            Standing::Latched(_) => {}
            Standing::Permitted(_) if self.settings.restart == Restart::OnReset => {
                self.latch(reason);
            }
            _ => self.inhibit(reason, self.inhibit_hold_ms.get()?),
        }
        Ok(())
    }

    fn inhibit(&mut self, reason: Reason, hold_ms: u32) {
        self.inhibit_left_ms = Doubled::new(hold_ms);
        self.write_state(INHIBITED, u16::from(reason.code()));
    }

    /// Closes for good. The first fault stays the one that is told.
    fn latch(&mut self, reason: Reason) {
        if !matches!(self.read_state(), Ok(Standing::Latched(_))) {
            self.write_state(LATCHED, u16::from(reason.code()));
        }
    }

    fn write_state(&mut self, mark: u32, rest: u16) {
        self.state = Doubled::new(mark << 16 | u32::from(rest));
    }

    fn read_state(&self) -> Result<Standing, Damaged> {
        let word = self.state.get()?;
        let rest = word as u16;
        let reason = || Reason::from_code(word as u8).ok_or(Damaged);
        match word >> 16 {
            INHIBITED => reason().map(Standing::Inhibited),
            QUALIFYING => Ok(Standing::Qualifying(rest)),
            PERMITTED => Ok(Standing::Permitted(Flow::from_word(rest))),
            LATCHED => reason().map(Standing::Latched),
            _ => Err(Damaged),
        }
    }

    /// What stands, with a report's own verdict or without one.
    fn told(&self, verdict: Option<Result<(), Reason>>) -> Step {
        let standing = self
            .read_state()
            .unwrap_or(Standing::Latched(Reason::MemoryDamaged));
        let permission = match standing {
            Standing::Permitted(flow) => Permission::after(flow),
            _ => Permission::DENIED,
        };
        let state = standing.state();
        let closed = match state {
            State::Permitted => Ok(()),
            State::Qualifying(_) => match self.inhibit_left_ms.get() {
                Ok(0) => Err(Reason::Qualifying),
                _ => Err(Reason::Holding),
            },
            State::Inhibited(reason) | State::Latched(reason) => Err(reason),
        };
        Step {
            permission,
            state,
            verdict: verdict.unwrap_or(closed),
        }
    }
}

/// A state as memory holds it: a permit with the signature of its way.
#[derive(Clone, Copy)]
enum Standing {
    Inhibited(Reason),
    Qualifying(u16),
    Permitted(Flow),
    Latched(Reason),
}

impl Standing {
    const fn state(self) -> State {
        match self {
            Self::Inhibited(reason) => State::Inhibited(reason),
            Self::Qualifying(count) => State::Qualifying(count),
            Self::Permitted(_) => State::Permitted,
            Self::Latched(reason) => State::Latched(reason),
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

/// A digest of what is known of the sources: a fallen bit in it, or in them, is seen.
fn digest(sources: &[Source]) -> u32 {
    sources.iter().fold(0x9e37_79b9, |sum: u32, source| {
        let frame = source.frame.digest();
        let terms = match source.trust.cross_terms {
            CrossTerms::Filled => 0,
            CrossTerms::YawUnknown(share) => 0x100 | u32::from(share.q8()),
            CrossTerms::AllUnknown(share) => 0x200 | u32::from(share.q8()),
        };
        [
            frame as u32,
            (frame >> 32) as u32,
            source.trust.inflation.q16(),
            terms,
        ]
        .into_iter()
        .fold(sum, |sum, word| {
            sum.rotate_left(7).wrapping_add(word ^ 0x85eb_ca6b)
        })
    })
}
