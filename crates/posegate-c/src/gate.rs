//! The gate: the state machine in caller-owned storage.

use super::memory::{
    Plain, Storage, bytes, close, disjoint, open, place, read, separate, take, write,
};
use super::report::NO_REPORT;
use super::settings::{POSEGATE_MOST_SOURCES, POSEGATE_NAME_LENGTH, name};
use super::{
    POSEGATE_NO_TAG, posegate_permission, posegate_report, posegate_settings, posegate_status,
    posegate_verdict,
};
use posegate::gate::{
    self, Advice, Gate, Reason, Restart, ScrubProgress, Settings, Source, State, Step,
};
use posegate::report::FrameId;
use posegate::set::{CrossTerms, Trust};
use posegate::table::checksum_continued;

/// Words of a `posegate_gate`.
pub const POSEGATE_GATE_WORDS: usize = 52;
/// Pointers of a `posegate_gate`.
pub const POSEGATE_GATE_POINTERS: usize = 24;

/// Storage of a gate. It feeds on reports, remembers, and says whether the interlock may open.
///
/// `posegate_gate_init` takes it into use. It stays where it is: a copy at another place is refused, and so is
/// storage that was zeroed. A copy that is put back to the same place would not know of a fault that was latched
/// since: the counter that the caller lends shows it, and the gate latches `POSEGATE_REASON_MEMORY_DAMAGED`. What
/// no gate can see is an image of the whole memory that is put back, its counter included: call
/// `posegate_gate_init` after that. One context at a time calls its functions.
#[repr(C)]
pub struct posegate_gate {
    /// Not for the caller.
    pub words: [u64; POSEGATE_GATE_WORDS],
    /// Not for the caller.
    pub pointers: [*const u8; POSEGATE_GATE_POINTERS],
}

/// A gate with what it borrows: its settings, which borrow names and sources.
pub(super) struct Held {
    task: [u8; POSEGATE_NAME_LENGTH],
    sources: [Source; POSEGATE_MOST_SOURCES],
    settings: Settings<'static>,
    /// The digest of the settings as they were given: memory is no flash.
    digest: u32,
    /// How many calls there were; the same number is in the caller's word.
    count: u32,
    /// The caller's word, and the complement of its address.
    counter: *mut u32,
    counter_complement: usize,
    gate: Gate<'static>,
}

// SAFETY: integers and pointers.
unsafe impl Storage for posegate_gate {
    type Held = Held;
    const MARK: u32 = 0x6761_7465;
}

/// Where a gate stands. 0 is nowhere: an error was returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_state_kind {
    /// Closed: the last report was denied, or none has come.
    Inhibited = 1,
    /// Closed: reports permit, and more must, or the hold time is not over.
    Qualifying = 2,
    /// Open.
    Permitted = 3,
    /// Closed until `posegate_gate_reset`.
    Latched = 4,
}

/// Where a gate stands, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_state {
    /// A `posegate_state_kind`.
    pub kind: u32,
    /// Inhibited, latched: a `posegate_reason`; else 0.
    pub reason: u32,
    /// Qualifying: so many reports in a row have permitted; else 0.
    pub permits: u32,
}

/// What a gate says at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_step {
    /// For the interlock.
    pub permission: posegate_permission,
    /// Where the gate stands.
    pub state: posegate_state,
    /// Why the report that came with the step does not permit by itself, a `posegate_reason`, or 0 if it
    /// does; without a report, why the gate is closed.
    pub reason: u32,
}

/// What to do. 0 where nothing needs to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_advice_kind {
    /// Ask again with the next report.
    Wait = 1,
    /// Improve the estimate first.
    Relocalise = 2,
    /// Improve the estimate by looking at a tag.
    LookAtTag = 3,
    /// Bring the robot to where the task begins.
    Restage = 4,
    /// A person must mend something.
    Service = 5,
}

/// What to do where a gate is closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_advice {
    /// A `posegate_advice_kind`; 0 where the gate is open.
    pub kind: u32,
    /// The tag to look at, or `POSEGATE_NO_TAG`.
    pub tag: u32,
}

/// How far the check of a table in flash has come. 0 where an error was returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_scrubbed {
    /// Within a round.
    UnderWay = 1,
    /// At the end of a round: the checksum held.
    Whole = 2,
    /// The bytes are not what they were. The gate is latched.
    Damaged = 3,
}

// SAFETY: integers.
unsafe impl Plain for posegate_state {}
// SAFETY: integers.
unsafe impl Plain for posegate_step {}
// SAFETY: integers.
unsafe impl Plain for posegate_advice {}

impl posegate_state {
    const NOWHERE: Self = Self {
        kind: 0,
        reason: 0,
        permits: 0,
    };

    fn of(state: State) -> Self {
        let (kind, reason, permits) = match state {
            State::Inhibited(reason) => (posegate_state_kind::Inhibited, reason.code(), 0),
            State::Qualifying(count) => (posegate_state_kind::Qualifying, 0, count),
            State::Permitted => (posegate_state_kind::Permitted, 0, 0),
            State::Latched(reason) => (posegate_state_kind::Latched, reason.code(), 0),
            // A state that C does not know is closed, and needs a person.
            _ => (posegate_state_kind::Latched, 0, 0),
        };
        Self {
            kind: kind as u32,
            reason: u32::from(reason),
            permits: u32::from(permits),
        }
    }
}

impl posegate_step {
    const DENIED: Self = Self {
        permission: posegate_permission::DENIED,
        state: posegate_state::NOWHERE,
        reason: 0,
    };

    fn of(step: Step) -> Self {
        Self {
            permission: posegate_permission::of(step.permission),
            state: posegate_state::of(step.state),
            reason: step
                .verdict
                .map_or_else(|reason| u32::from(reason.code()), |()| 0),
        }
    }
}

impl posegate_advice {
    const NONE: Self = Self {
        kind: 0,
        tag: POSEGATE_NO_TAG,
    };

    fn of(advice: Option<Advice>) -> Self {
        let (kind, tag) = match advice {
            None => return Self::NONE,
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

/// The gate in storage, and one call more on its counter. Storage that is not the newest, since the caller's word
/// has another count, gives a gate with a latched fault.
///
/// The gate borrows the settings in the same struct, so no `&mut Held` is made while it is alive.
///
/// # Safety
/// As for [`open`], for as long as `'a`; no other reference to the gate is in use; the caller's word can be
/// written.
unsafe fn held<'a>(storage: *mut posegate_gate) -> Result<&'a mut Gate<'static>, posegate_status> {
    // SAFETY: the caller's promise; what is sealed has been written. An address with a fallen bit is not followed.
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
        // On from the caller's count, which no saved copy has.
        let next = count.wrapping_add(1);
        counter.write_volatile(next);
        (&raw mut (*held).count).write(next);
        Ok(gate)
    }
}

/// A digest of everything in the settings.
fn digest(settings: &Settings<'_>) -> u32 {
    let Settings {
        task,
        site_digest,
        sources,
        maximum_age_ms,
        response_ms,
        permit_hold_ms,
        inhibit_hold_ms,
        permits_in_a_row,
        restart,
        look_at,
    } = settings;
    let numbers = [
        *maximum_age_ms,
        *response_ms,
        *permit_hold_ms,
        *inhibit_hold_ms,
        u32::from(*permits_in_a_row),
        u32::from(*restart == Restart::OnReset),
        look_at.unwrap_or(POSEGATE_NO_TAG),
    ];
    let of_settings = [
        task.as_bytes(),
        site_digest,
        numbers.map(u32::to_le_bytes).as_flattened(),
    ]
    .into_iter()
    .fold(0, checksum_continued);
    sources.iter().fold(of_settings, |sum, source| {
        let (terms, share) = match source.trust.cross_terms {
            CrossTerms::Filled => (0, 0),
            CrossTerms::YawUnknown(share) => (1, share.q8()),
            CrossTerms::AllUnknown(share) => (2, share.q8()),
            // C can declare no others.
            _ => (u8::MAX, 0),
        };
        let sum = checksum_continued(sum, &source.frame.digest().to_le_bytes());
        let sum = checksum_continued(sum, &source.trust.inflation.q16().to_le_bytes());
        checksum_continued(sum, &[terms, share])
    })
}

/// Writes a gate with its settings.
///
/// # Safety
/// The place is that of a gate's storage, and stays there; the table stays as it is; the counter can be written.
unsafe fn fill(
    held: *mut Held,
    table: &'static [u8],
    given: &posegate_settings,
    counter: *mut u32,
    now_ms: u32,
) -> Result<(), posegate_status> {
    const UNUSED: Source = Source {
        frame: FrameId::UNNAMED,
        trust: Trust::FULL,
    };
    let mut sources = [UNUSED; POSEGATE_MOST_SOURCES];
    let count = usize::try_from(given.source_count).unwrap_or(usize::MAX);
    let declared = sources.get_mut(..count).ok_or(posegate_status::Sources)?;
    for (source, given) in declared.iter_mut().zip(&given.sources) {
        *source = given.source()?;
    }
    let (task, length) = name(&given.task);
    let (restart, look_at) = (given.restart()?, given.look_at());
    let permits = u16::try_from(given.permits_in_a_row);
    let permits_in_a_row = permits.map_err(|_| posegate_status::PermitsInARow)?;
    // SAFETY: the caller's promise. What is borrowed has been written, is written no more as long as
    // the gate is in use, and is no part of what `held` lends.
    unsafe {
        (&raw mut (*held).task).write(task);
        (&raw mut (*held).sources).write(sources);
        let task: &'static [u8; POSEGATE_NAME_LENGTH] = &(*held).task;
        let sources: &'static [Source; POSEGATE_MOST_SOURCES] = &(*held).sources;
        let task = task.get(..length).unwrap_or_default();
        (&raw mut (*held).settings).write(Settings {
            task: core::str::from_utf8(task).map_err(|_| posegate_status::Task)?,
            site_digest: given.site_digest,
            sources: sources.get(..count).unwrap_or_default(),
            maximum_age_ms: given.maximum_age_ms,
            response_ms: given.response_ms,
            permit_hold_ms: given.permit_hold_ms,
            inhibit_hold_ms: given.inhibit_hold_ms,
            permits_in_a_row,
            restart,
            look_at,
        });
        let settings: &'static Settings<'static> = &(*held).settings;
        (&raw mut (*held).digest).write(digest(settings));
        (&raw mut (*held).count).write(counter.read_volatile());
        (&raw mut (*held).counter).write(counter);
        (&raw mut (*held).counter_complement).write(!counter.addr());
        (&raw mut (*held).gate).write(Gate::new(table, settings, now_ms)?);
    }
    Ok(())
}

/// Decides known pose-sets on a built-in table: `POSEGATE_STATUS_OK`, or `POSEGATE_STATUS_SELF_TEST_FAILED` where a
/// failing core or a fallen bit in the code gives another answer. `posegate_gate_init` does so too; a main
/// loop may call it again, and latches `POSEGATE_REASON_SELF_TEST_FAILED` where it fails.
#[unsafe(no_mangle)]
pub extern "C" fn posegate_self_test() -> posegate_status {
    posegate_status::of(|| gate::self_test().map_err(|_| posegate_status::SelfTestFailed))
}

/// Takes storage into use for a gate on the bytes of a table, closed, at the controller's time `now_ms`.
///
/// A table that is damaged, of another task or of another site gives a gate that denies and says why, and
/// no error: a controller with damaged flash must still answer. The settings are copied. The table is
/// borrowed: it must stay as it is for as long as the gate is used, as constants in flash do. So is `counter`, a
/// word of the caller's in which the gate counts its calls: it may hold any number now, is not a part of what the
/// caller saves and restores, and nobody else ever writes to it, not before another `posegate_gate_init` either.
/// Table and counter share memory with no argument of any later call.
///
/// Errors: the setting that would switch a check off. The storage then holds no gate, and its functions
/// deny.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says; `length` bytes of the table can be
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
        // A gate that was saved before does not fit the counter, whether this call succeeds or not.
        let counted = separate(gate, counter).and(place(counter));
        if counted.is_ok() && (of_table.is_ok() || table.is_err()) {
            counter.write_volatile(counter.read_volatile().wrapping_add(1));
        }
        let (held, table) = (held?, table?);
        apart?;
        counted?;
        fill(held, table, &given?, counter, now_ms)?;
        close(gate);
        Ok(())
    })
}

/// Takes a report at the controller's time `now_ms`.
///
/// What is no report (a null pointer, a number that is none of its enum's) is an error, and closes the
/// gate as a report of an unknown source does. Where `step` is none, the report is taken all the same: what
/// the caller cannot be told must still close the gate.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_step(
    gate: *mut posegate_gate,
    now_ms: u32,
    report: *const posegate_report,
    step: *mut posegate_step,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(gate, report).and(separate(gate, step));
        let report = read(report).and_then(|report| report.report());
        let written = write(step, posegate_step::DENIED);
        apart?;
        let told = held(gate).map(|gate| gate.step(now_ms, report.as_ref().unwrap_or(&NO_REPORT)));
        written?;
        write(step, posegate_step::of(told?))?;
        report.map(|_| ())
    })
}

/// Lets time pass without a report: in every control cycle, so that a permit ends when reports do. Where
/// `step` is none, it passes all the same.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_tick(
    gate: *mut posegate_gate,
    now_ms: u32,
    step: *mut posegate_step,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(gate, step);
        let written = write(step, posegate_step::DENIED);
        apart?;
        let told = held(gate).map(|gate| gate.tick(now_ms));
        written?;
        write(step, posegate_step::of(told?))
    })
}

/// Checks the table again and begins anew, closed: the one way out of a latched fault. For a person's
/// hand, never for a timer's.
///
/// Errors: `POSEGATE_STATUS_MEMORY_DAMAGED` where the copy of the settings has changed.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_reset(
    gate: *mut posegate_gate,
    now_ms: u32,
) -> posegate_status {
    // SAFETY: the caller's promise; what is sealed has been written.
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

/// Ends a permit, and what has been earned of one, at the controller's time `now_ms`: if something else has closed
/// the interlock for a cause that may pass, such as a watchdog, a late cycle or a mode of the machine. The gate then
/// qualifies again as after a denial, or waits for the reset if `restart` is `POSEGATE_RESTART_ON_RESET`. The
/// permit also ends if `step` is null.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` for what is no `posegate_reason`; it latches
/// `POSEGATE_REASON_MEMORY_DAMAGED`.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_inhibit(
    gate: *mut posegate_gate,
    now_ms: u32,
    reason: u32,
    step: *mut posegate_step,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(gate, step);
        let written = write(step, posegate_step::DENIED);
        apart?;
        let reason = u8::try_from(reason).ok().and_then(Reason::from_code);
        let told = held(gate).map(|gate| match reason {
            Some(reason) => gate.inhibit(now_ms, reason),
            None => {
                gate.fault(Reason::MemoryDamaged);
                gate.tick(now_ms)
            }
        });
        written?;
        write(step, posegate_step::of(told?))?;
        reason.map(|_| ()).ok_or(posegate_status::BadValue)
    })
}

/// Latches a fault that something else has found: an interlock that does not follow
/// (`POSEGATE_REASON_INTERLOCK_FAULT`), a check of the code (`POSEGATE_REASON_CODE_DAMAGED`).
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` for what is no `posegate_reason`; it latches
/// `POSEGATE_REASON_MEMORY_DAMAGED`.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says.
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

/// Checks the next `count` bytes of the table in flash, and latches `POSEGATE_REASON_TABLE_DAMAGED`: at once if the
/// table's checksum is another than at the start, else at the end of a round that finds its bytes changed. Writes a
/// `posegate_scrubbed`; the bytes are also checked if `scrubbed` is null. For a main loop's idle time.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_scrub(
    gate: *mut posegate_gate,
    count: usize,
    scrubbed: *mut u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(gate, scrubbed);
        let written = write(scrubbed, 0);
        apart?;
        let told = held(gate).map(|gate| gate.scrub(count));
        written?;
        let told = match told? {
            ScrubProgress::UnderWay => posegate_scrubbed::UnderWay,
            ScrubProgress::Whole => posegate_scrubbed::Whole,
            ScrubProgress::Damaged => posegate_scrubbed::Damaged,
        };
        write(scrubbed, told as u32)
    })
}

/// Where the gate stands.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_state(
    gate: *mut posegate_gate,
    state: *mut posegate_state,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(gate, state);
        write(state, posegate_state::NOWHERE)?;
        apart?;
        let told = held(gate)?.state();
        write(state, posegate_state::of(told))
    })
}

/// What to do, where the gate is closed.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_advice(
    gate: *mut posegate_gate,
    advice: *mut posegate_advice,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(gate, advice);
        write(advice, posegate_advice::NONE)?;
        apart?;
        let told = held(gate)?.advice();
        write(advice, posegate_advice::of(told))
    })
}

/// The verdict on a report's belief with its margin and worst pose, at the cost of 30 to 500 decisions: for
/// telemetry. The verdict does not change the gate's state.
///
/// # Safety
/// Each pointer is null, misaligned, or points to what its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_gate_examine(
    gate: *mut posegate_gate,
    report: *const posegate_report,
    verdict: *mut posegate_verdict,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(gate, report).and(separate(gate, verdict));
        let report = read(report);
        write(verdict, posegate_verdict::DENIED)?;
        apart?;
        let gate = held(gate)?;
        let report = report?.report()?;
        write(verdict, posegate_verdict::of(gate.examine(&report)))
    })
}
