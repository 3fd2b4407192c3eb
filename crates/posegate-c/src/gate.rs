//! The gate: the state machine in caller-owned storage.

use super::call::{act, answer};
use super::evidence::Read;
use super::memory::{Plain, Storage, bytes, check, close, disjoint, open, read, separate, take};
use super::reason::code;
use super::report::no_report;
use super::settings::{POSEGATE_MOST_SOURCES, POSEGATE_NAME_LENGTH, name};
use super::status::Done;
use super::{
    POSEGATE_NO_TAG, posegate_evidence, posegate_examined, posegate_permission, posegate_report,
    posegate_settings, posegate_status, posegate_verdict,
};
use posegate::gate::{
    self, Advice, Gate, Reason, Restart, ScrubProgress, Settings, Source, State, Step,
};
use posegate::motion::MotionBounds;
use posegate::report::FrameId;
use posegate::set::{Aging, CrossTerms, Trust};
use posegate::table::checksum_continued;

/// Number of 64-bit words of a `posegate_gate`.
pub const POSEGATE_GATE_WORDS: usize = 60;
/// Number of pointers of a `posegate_gate`.
pub const POSEGATE_GATE_POINTERS: usize = 24;

/// Storage of a gate, which evaluates reports, keeps state, and decides whether the interlock may open.
///
/// `posegate_gate_init` initialises it. Do not move it: a copy at another place is refused, and so is zeroed
/// storage. A copy that is restored to the same place does not contain a fault that was latched since then. The
/// counter that the caller provides detects the copy, and the gate latches `POSEGATE_REASON_MEMORY_DAMAGED`. No gate can
/// detect that the whole memory, including the counter, was restored: call `posegate_gate_init` after that. Only one
/// context at a time may call its functions.
#[repr(C)]
pub struct posegate_gate {
    /// Private.
    pub words: [u64; POSEGATE_GATE_WORDS],
    /// Private.
    pub pointers: [*const u8; POSEGATE_GATE_POINTERS],
}

/// A gate with the data that it borrows: its settings, which borrow names and sources.
pub(super) struct Held {
    task: [u8; POSEGATE_NAME_LENGTH],
    sources: [Source; POSEGATE_MOST_SOURCES],
    settings: Settings<'static>,
    /// The digest of the settings at the start, because they are kept in memory, not in flash.
    digest: u32,
    /// The number of calls; the caller's word has the same number.
    count: u32,
    /// The address of the caller's word, and its complement.
    counter: *mut u32,
    counter_complement: usize,
    gate: Gate<'static>,
}

// SAFETY: integers and pointers.
unsafe impl Storage for posegate_gate {
    type Held = Held;
    const MARK: u32 = 0x6761_7465;
}

/// The state of a gate. 0 means that an error was returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_state_kind {
    /// Closed: the last report was denied, or none has come.
    Inhibited = 1,
    /// Closed: reports permit, but more must permit, or the hold time is not over.
    Qualifying = 2,
    /// Open.
    Permitted = 3,
    /// Closed until `posegate_gate_reset`.
    Latched = 4,
}

/// The state of a gate, with its reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_state {
    /// A `posegate_state_kind`.
    pub kind: u32,
    /// If inhibited or latched: a `posegate_reason`; else 0.
    pub reason: u32,
    /// If qualifying: the number of consecutive reports that have permitted; else 0.
    pub permits: u32,
}

/// The answer of a gate at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_step {
    /// For the interlock.
    pub permission: posegate_permission,
    /// The state of the gate.
    pub state: posegate_state,
    /// With a report: the `posegate_reason` why this report does not permit, or 0 if it does. Without a report: the
    /// reason why the gate is closed, or 0.
    pub reason: u32,
}

/// What to do. 0 if nothing needs to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_advice_kind {
    /// Ask again with the next report.
    Wait = 1,
    /// Improve the estimate first.
    Relocalise = 2,
    /// Improve the estimate by looking at a tag.
    LookAtTag = 3,
    /// Bring the robot to the start of the task.
    Restage = 4,
    /// Manual repair or configuration is needed.
    Service = 5,
}

/// What to do if a gate is closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_advice {
    /// A `posegate_advice_kind`; 0 if the gate is open.
    pub kind: u32,
    /// The tag to look at, or `POSEGATE_NO_TAG`.
    pub tag: u32,
}

/// The progress of the check of a table in flash. 0 if an error was returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_scrubbed {
    /// The round is not complete.
    UnderWay = 1,
    /// The round is complete and the checksum is as expected.
    Whole = 2,
    /// The bytes have changed. The gate is latched.
    Damaged = 3,
}

// SAFETY: integers.
unsafe impl Plain for posegate_state {}
// SAFETY: integers.
unsafe impl Plain for posegate_step {
    const DENIED: Self = Self {
        permission: posegate_permission::DENIED,
        ..Self::ZERO
    };
}
// SAFETY: integers.
unsafe impl Plain for posegate_advice {
    const DENIED: Self = Self {
        kind: 0,
        tag: POSEGATE_NO_TAG,
    };
}

impl posegate_state {
    fn of(state: State) -> Self {
        let (kind, reason, permits) = match state {
            State::Inhibited(reason) => (posegate_state_kind::Inhibited, reason.code(), 0),
            State::Qualifying(count) => (posegate_state_kind::Qualifying, 0, count),
            State::Permitted => (posegate_state_kind::Permitted, 0, 0),
            State::Latched(reason) => (posegate_state_kind::Latched, reason.code(), 0),
            // A state without a number in C is reported as closed until a manual reset.
            _ => (posegate_state_kind::Latched, 0, 0),
        };
        Self {
            kind: kind as u32,
            reason: u32::from(reason),
            permits: u32::from(permits),
        }
    }
}

impl From<Step> for posegate_step {
    fn from(step: Step) -> Self {
        Self {
            permission: posegate_permission::of(step.permission),
            state: posegate_state::of(step.state),
            reason: code(step.verdict),
        }
    }
}

impl posegate_advice {
    fn of(advice: Option<Advice>) -> Self {
        let (kind, tag) = match advice {
            None => return Self::DENIED,
            Some(Advice::Wait) => (posegate_advice_kind::Wait, None),
            Some(Advice::Relocalise) => (posegate_advice_kind::Relocalise, None),
            Some(Advice::LookAtTag(tag)) => (posegate_advice_kind::LookAtTag, Some(tag)),
            Some(Advice::Restage) => (posegate_advice_kind::Restage, None),
            Some(Advice::Service | _) => (posegate_advice_kind::Service, None),
        };
        Self {
            kind: kind as u32,
            tag: tag.unwrap_or(POSEGATE_NO_TAG),
        }
    }
}

/// Returns the gate in storage and counts the call. If the caller's word has another count, the storage is not the
/// newest: the gate then latches a fault.
///
/// The gate borrows the settings in the same struct, so no `&mut Held` is made while it is alive.
///
/// # Safety
/// As for [`open`], for as long as `'a`; no other reference to the gate is in use; the caller's word can be written
/// to.
pub(super) unsafe fn held<'a>(
    storage: *mut posegate_gate,
) -> Result<&'a mut Gate<'static>, posegate_status> {
    // SAFETY: the caller's promise; sealed storage has been written. An address with a flipped bit is not
    // dereferenced.
    unsafe {
        let held = open(storage)?;
        let gate = &mut (*held).gate;
        let counter = (*held).counter;
        if counter.addr() != !(*held).counter_complement {
            gate.fault(Reason::MemoryDamaged);
            return Ok(gate);
        }
        let count = counter.read_volatile();
        if count != (*held).count {
            gate.fault(Reason::MemoryDamaged);
        }
        // Continues from the caller's count, which no saved copy has.
        let next = count.wrapping_add(1);
        counter.write_volatile(next);
        (&raw mut (*held).count).write(next);
        Ok(gate)
    }
}

/// Asks an initialised gate, and writes the answer of a step. The gate is asked even if the answer cannot be written.
///
/// # Safety
/// As for [`held`] and [`act`].
unsafe fn stepped(
    gate: *mut posegate_gate,
    apart: Done,
    step: *mut posegate_step,
    by: impl FnOnce(&mut Gate<'static>) -> Step,
) -> Done {
    // SAFETY: the caller's promise.
    unsafe {
        let apart = apart.and(separate(gate, step));
        act(apart, step, posegate_step::DENIED, || Ok(by(held(gate)?)))
    }
}

/// Returns a digest of all settings.
#[inline(never)]
fn digest(settings: &Settings<'_>) -> u32 {
    let Settings {
        task,
        task_digest,
        sources,
        maximum_age_ms,
        response_ms,
        report_period_ms,
        permit_hold_ms,
        inhibit_hold_ms,
        permits_in_a_row,
        restart,
        most_runs,
        look_at,
    } = settings;
    let numbers = [
        *maximum_age_ms,
        *response_ms,
        *report_period_ms,
        *permit_hold_ms,
        *inhibit_hold_ms,
        u32::from(*permits_in_a_row),
        u32::from(*restart == Restart::OnReset),
        *most_runs,
        look_at.unwrap_or(POSEGATE_NO_TAG),
    ];
    let of_settings = [
        task.as_bytes(),
        task_digest,
        numbers.map(u32::to_le_bytes).as_flattened(),
    ]
    .into_iter()
    .fold(0, checksum_continued);
    sources.iter().fold(of_settings, |sum, source| {
        let (terms, share) = match source.trust.cross_terms {
            CrossTerms::Filled => (0, 0),
            CrossTerms::YawUnknown(share) => (1, share.q8()),
            CrossTerms::AllUnknown(share) => (2, share.q8()),
            // C cannot declare any others.
            _ => (u8::MAX, 0),
        };
        let sum = checksum_continued(sum, &source.frame.digest().to_le_bytes());
        let sum = checksum_continued(sum, &source.trust.inflation.q16().to_le_bytes());
        let sum = checksum_continued(sum, &[terms, share]);
        let sum = checksum_continued(
            sum,
            source.aging.words().map(u32::to_le_bytes).as_flattened(),
        );
        source.motion.words().iter().fold(sum, |sum, word| {
            checksum_continued(sum, &word.to_le_bytes())
        })
    })
}

/// Writes a gate with its settings.
///
/// # Safety
/// The place is that of a gate's storage, and stays there; the table does not change; the counter can be written to.
unsafe fn fill(
    held: *mut Held,
    table: &'static [u8],
    given: &posegate_settings,
    counter: *mut u32,
    now_ms: u32,
    is_sound: Result<(), Reason>,
) -> Result<(), posegate_status> {
    const UNUSED: Source = Source {
        frame: FrameId::UNNAMED,
        trust: Trust::FULL,
        aging: Aging::NONE,
        motion: MotionBounds::STANDS_STILL,
    };
    let mut sources = [UNUSED; POSEGATE_MOST_SOURCES];
    let count = usize::try_from(given.source_count).unwrap_or(usize::MAX);
    let declared = sources.get_mut(..count).ok_or(posegate_status::Sources)?;
    for (source, given) in declared.iter_mut().zip(&given.sources) {
        *source = given.source()?;
    }
    let (task, length) = name(&given.task);
    let restart = given.restart()?;
    let permits = u16::try_from(given.permits_in_a_row);
    let permits_in_a_row = permits.map_err(|_| posegate_status::PermitsInARow)?;
    // SAFETY: the caller's promise. The borrowed settings have been written, are not written again while the gate is in
    // use, and are not part of the reference that `held` returns.
    unsafe {
        (&raw mut (*held).task).write(task);
        (&raw mut (*held).sources).write(sources);
        let task: &'static [u8; POSEGATE_NAME_LENGTH] = &(*held).task;
        let sources: &'static [Source; POSEGATE_MOST_SOURCES] = &(*held).sources;
        let task = task.get(..length).unwrap_or_default();
        (&raw mut (*held).settings).write(Settings {
            task: core::str::from_utf8(task).map_err(|_| posegate_status::Task)?,
            task_digest: given.task_digest,
            sources: sources.get(..count).unwrap_or_default(),
            maximum_age_ms: given.maximum_age_ms,
            response_ms: given.response_ms,
            report_period_ms: given.report_period_ms,
            permit_hold_ms: given.permit_hold_ms,
            inhibit_hold_ms: given.inhibit_hold_ms,
            permits_in_a_row,
            restart,
            most_runs: match given.most_runs {
                0 => const { Settings::for_source(0, 0).most_runs },
                runs => runs,
            },
            look_at: Some(given.look_at_tag).filter(|tag| *tag != POSEGATE_NO_TAG),
        });
        let settings: &'static Settings<'static> = &(*held).settings;
        (&raw mut (*held).digest).write(digest(settings));
        (&raw mut (*held).count).write(counter.read_volatile());
        (&raw mut (*held).counter).write(counter);
        (&raw mut (*held).counter_complement).write(!counter.addr());
        let gate = Gate::after(is_sound, table, settings, now_ms)?;
        (&raw mut (*held).gate).write(gate);
    }
    Ok(())
}

/// Decides known pose-sets on a built-in table. Returns `POSEGATE_STATUS_OK`, or `POSEGATE_STATUS_SELF_TEST_FAILED`
/// if a faulty core or a flipped bit in the code gives another answer. `posegate_gate_init` runs it too. A main loop
/// may call it again, and must then latch `POSEGATE_REASON_SELF_TEST_FAILED` if it fails.
#[unsafe(no_mangle)]
pub extern "C" fn posegate_self_test() -> posegate_status {
    posegate_status::of(|| gate::self_test().map_err(|_| posegate_status::SelfTestFailed))
}

/// Initialises storage for a gate on the bytes of a table, closed, at the controller's time `now_ms`.
///
/// A table that is damaged, of another task or with another task digest is not an error. It gives a gate that denies with
/// that reason, because a controller with damaged flash must still answer. The settings are copied. The table is
/// borrowed: it must not change while the gate is used, as with constants in flash. `counter` is borrowed too: a
/// word of the caller in which the gate counts its calls. Its first value may be any number. The caller must not save
/// and restore it, and no other code may ever write to it, not even before another
/// `posegate_gate_init`. Table and counter must not share memory with an argument of any later call.
///
/// Errors: the first setting that would switch a check off, or keep the gate closed for ever. The storage then holds no
/// gate, and its functions deny.
///
/// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
/// ever (`posegate_clock`).
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type; `length` bytes of the table can be
/// read, and the counter can be written, now and as long as the gate is used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_init(
    gate: *mut posegate_gate,
    table: *const u8,
    length: usize,
    settings: *const posegate_settings,
    counter: *mut u32,
    now_ms: u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let of_table = disjoint(counter, size_of::<u32>(), table, length);
        let apart = separate(gate, settings)
            .and(separate(gate, counter))
            .and(disjoint(gate, size_of::<posegate_gate>(), table, length))
            .and(of_table);
        let held = take(gate);
        let given = read(settings);
        let table = bytes(table, length);
        // A gate that was saved before does not match the counter any more, whether this call succeeds or not.
        let counted = separate(gate, counter).and(check(counter));
        if counted.is_ok() && (of_table.is_ok() || table.is_err()) {
            counter.write_volatile(counter.read_volatile().wrapping_add(1));
        }
        let (held, table) = (held?, table?);
        apart?;
        counted?;
        let (given, tested) = (given?, gate::self_test());
        fill(held, table, &given, counter, now_ms, tested)?;
        close(gate);
        Ok(())
    })
}

/// Gives a gate another table and other settings, within one control cycle: it is then closed as after `posegate_gate_init`, without
/// another run of the self-test. A gate that is latched stays latched, unless its table was the reason. With `POSEGATE_RESTART_ON_RESET`, too, an open
/// gate waits for no reset after the change: `posegate_gate_inhibit` before it makes it wait.
///
/// Errors: as for `posegate_gate_init`. After an error the storage is not initialised, so every function denies.
///
/// # Safety
/// As for `posegate_gate_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_change_table(
    gate: *mut posegate_gate,
    table: *const u8,
    length: usize,
    settings: *const posegate_settings,
    now_ms: u32,
) -> posegate_status {
    // SAFETY: the caller's promise. The counter is that of the gate, which was checked when it was made.
    posegate_status::of(|| unsafe {
        let apart =
            separate(gate, settings).and(disjoint(gate, size_of::<posegate_gate>(), table, length));
        let given = read(settings);
        let is_sound = held(gate).map(|gate| gate.is_sound());
        let counter = open(gate).map(|held| ((*held).counter, (*held).counter_complement));
        let place = take(gate)?;
        let in_flash = bytes(table, length)?;
        apart?;
        let (is_sound, (counter, complement)) = (is_sound?, counter?);
        if counter.addr() != !complement {
            return Err(posegate_status::NotInitialised);
        }
        disjoint(counter, size_of::<u32>(), table, length)?;
        fill(place, in_flash, &given?, counter, now_ms, is_sound)?;
        close(gate);
        Ok(())
    })
}

/// Evaluates a report at the controller's time `now_ms`.
///
/// An invalid report (a null pointer, a number that is not in its enum) is an error. It closes the gate as a report
/// of an unknown source does. If `step` is null or misaligned, the report is still evaluated: the gate must
/// close even if the caller gets no answer.
///
/// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
/// ever (`posegate_clock`).
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_step(
    gate: *mut posegate_gate,
    now_ms: u32,
    report: *const posegate_report,
    step: *mut posegate_step,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(gate, report);
        let mut valid = Ok(());
        let report = read(report).and_then(|report| report.report());
        let report = report.unwrap_or_else(|status| {
            valid = Err(status);
            no_report()
        });
        stepped(gate, apart, step, |gate| gate.step(now_ms, &report))?;
        valid
    })
}

/// As `posegate_gate_step`, for a report with several hypotheses, or a report that a tracker has carried along odometry.
///
/// Errors: as for `posegate_gate_step`; `POSEGATE_STATUS_BAD_LENGTH` if there are more hypotheses than `POSEGATE_OTHERS`. Each error closes
/// the gate.
///
/// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
/// ever (`posegate_clock`).
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_step_on(
    gate: *mut posegate_gate,
    now_ms: u32,
    evidence: *const posegate_evidence,
    step: *mut posegate_step,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(gate, evidence);
        let read = Read::from(evidence);
        stepped(gate, apart, step, |gate| match &read {
            Ok(read) => gate.step_on(now_ms, &read.evidence()),
            Err(_) => gate.step(now_ms, &no_report()),
        })?;
        read.map(|_| ())
    })
}

/// Advances the time without a report. Call it in every control cycle without a report, so that a permit ends if
/// reports stop. The time also advances if `step` is null or misaligned.
///
/// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
/// ever (`posegate_clock`).
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_tick(
    gate: *mut posegate_gate,
    now_ms: u32,
    step: *mut posegate_step,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe { stepped(gate, Ok(()), step, |gate| gate.tick(now_ms)) })
}

/// Checks the table again and restarts the gate, closed. This is the only way out of a latched fault. A reset is a
/// manual action: never call it from a timer.
///
/// Errors: `POSEGATE_STATUS_MEMORY_DAMAGED` if the copy of the settings has changed.
///
/// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
/// ever (`posegate_clock`).
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_reset(
    gate: *mut posegate_gate,
    now_ms: u32,
) -> posegate_status {
    // SAFETY: the caller's promise; sealed storage has been written.
    posegate_status::of(|| unsafe {
        let held = open(gate)?;
        let gate = self::held(gate)?;
        if digest(&(*held).settings) != (*held).digest {
            gate.fault(Reason::MemoryDamaged);
            return Err(posegate_status::MemoryDamaged);
        }
        Ok(gate.reset(now_ms)?)
    })
}

/// Ends a permit, and the permits counted so far, at the controller's time `now_ms`. Call it if something else has
/// closed the interlock for a cause that may pass, such as a watchdog, a late cycle or a mode of the machine. The
/// gate then qualifies again as after a denial. If `restart` is `POSEGATE_RESTART_ON_RESET`, an open gate waits for
/// the reset. The permit also ends if `step` is null.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` if `reason` is not a `posegate_reason`; the gate then latches
/// `POSEGATE_REASON_MEMORY_DAMAGED`.
///
/// `now_ms` is in milliseconds, of a clock that runs: if its ticks are longer than 1 ms, or it stands still, a permit lasts too long, or for
/// ever (`posegate_clock`).
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_inhibit(
    gate: *mut posegate_gate,
    now_ms: u32,
    reason: u32,
    step: *mut posegate_step,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let reason = u8::try_from(reason).ok().and_then(Reason::from_code);
        stepped(gate, Ok(()), step, |gate| match reason {
            Some(reason) => gate.inhibit(now_ms, reason),
            None => {
                gate.fault(Reason::MemoryDamaged);
                gate.tick(now_ms)
            }
        })?;
        reason.map(|_| ()).ok_or(posegate_status::BadValue)
    })
}

/// Latches a fault that was found elsewhere: an interlock that does not follow (`POSEGATE_REASON_INTERLOCK_FAULT`),
/// or a check of the code (`POSEGATE_REASON_CODE_DAMAGED`).
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` if `reason` is not a `posegate_reason`; the gate then latches
/// `POSEGATE_REASON_MEMORY_DAMAGED`.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_fault(
    gate: *mut posegate_gate,
    reason: u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let gate = held(gate)?;
        let reason = u8::try_from(reason).ok().and_then(Reason::from_code);
        gate.fault(reason.unwrap_or(Reason::MemoryDamaged));
        reason.map(|_| ()).ok_or(posegate_status::BadValue)
    })
}

/// Checks the next `count` bytes of the table in flash, in a main loop's idle time. Latches
/// `POSEGATE_REASON_TABLE_DAMAGED`: at once if the table's checksum differs from that at the start, else at the end
/// of a round that finds its bytes changed. Writes a `posegate_scrubbed`; the bytes are also checked if `scrubbed`
/// is null.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_scrub(
    gate: *mut posegate_gate,
    count: usize,
    scrubbed: *mut u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        act(separate(gate, scrubbed), scrubbed, 0, || {
            let progress = match held(gate)?.scrub(count) {
                ScrubProgress::UnderWay => posegate_scrubbed::UnderWay,
                ScrubProgress::Whole => posegate_scrubbed::Whole,
                ScrubProgress::Damaged => posegate_scrubbed::Damaged,
            };
            Ok(progress as u32)
        })
    })
}

/// Writes the state of the gate.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_state(
    gate: *mut posegate_gate,
    state: *mut posegate_state,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(state, || {
            separate(gate, state)?;
            Ok(posegate_state::of(held(gate)?.state()))
        })
    }
}

/// Writes what to do if the gate is closed.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_advice(
    gate: *mut posegate_gate,
    advice: *mut posegate_advice,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(advice, || {
            separate(gate, advice)?;
            Ok(posegate_advice::of(held(gate)?.advice()))
        })
    }
}

/// Writes the verdict on a report's estimate with its margin and worst pose, at the cost of 30 to 500 decisions. For
/// telemetry: the verdict does not change the gate's state.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_examine(
    gate: *mut posegate_gate,
    report: *const posegate_report,
    verdict: *mut posegate_verdict,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(verdict, || {
            separate(gate, report).and(separate(gate, verdict))?;
            let gate = held(gate)?;
            Ok(posegate_verdict::of(gate.examine(&read(report)?.report()?)))
        })
    }
}

/// Writes the verdict on a report with several hypotheses, or a report that a tracker has carried. The cost is that of
/// `posegate_gate_examine` for each hypothesis. For telemetry: the verdict does not change the gate's state.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_examine_on(
    gate: *mut posegate_gate,
    evidence: *const posegate_evidence,
    examined: *mut posegate_examined,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(examined, || {
            separate(gate, evidence).and(separate(gate, examined))?;
            let gate = held(gate)?;
            let (hypothesis, verdict) = gate.examine_on(&Read::from(evidence)?.evidence());
            Ok(posegate_examined {
                verdict: posegate_verdict::of(verdict),
                hypothesis: u32::from(hypothesis),
                reserved: 0,
            })
        })
    }
}
