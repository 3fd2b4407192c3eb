//! A plan on the controller: its rules in flash, the next step for the current pose-set.

use super::call::{answer, init};
use super::memory::{Plain, Storage, bytes_apart, object, read, separate};
use super::table::text;
use super::{POSEGATE_NO_TAG, posegate_belief, posegate_pose, posegate_status};
use core::ffi::c_char;
use posegate::sequencer::{Instruction, Rules, Sequencer, StopReason};
use posegate::set::{RadiusSquared, Trust, Uncertainty};

/// Number of 64-bit words of a `posegate_sequencer`.
pub const POSEGATE_SEQUENCER_WORDS: usize = 4;
/// Number of pointers of a `posegate_sequencer`.
pub const POSEGATE_SEQUENCER_POINTERS: usize = 6;

/// Storage of a sequencer, which executes the rules of a plan (`posegate plan --rules`). It selects the next step, and the reaction if a
/// step fails. It permits nothing: before a look or a work task the task's own gate decides.
///
/// `posegate_sequencer_init` initialises it. Do not move it: a copy is refused. Only one context at a time may call its functions.
#[repr(C)]
pub struct posegate_sequencer {
    /// Private.
    pub words: [u64; POSEGATE_SEQUENCER_WORDS],
    /// Private.
    pub pointers: [*const u8; POSEGATE_SEQUENCER_POINTERS],
}

// SAFETY: integers and pointers.
unsafe impl Storage for posegate_sequencer {
    type Held = Sequencer<'static>;
    const MARK: u32 = 0x7365_7175;
}

/// What to do next. 0 is not a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_instruction_kind {
    /// Ask the gate of the task; if it permits, look at the tag. Afterwards the estimate is the observation.
    Look = 1,
    /// Drive to a pose.
    Drive = 2,
    /// Ask the gate of the task; if it permits, do the task.
    Work = 3,
    /// Do nothing.
    Inhibit = 4,
}

/// Why a sequencer inhibits. 0 if it does not, and if an error was returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_stop {
    /// The work is done.
    Done = 1,
    /// A task failed as often as its rule allows and the plan has no alternative, or a condition failed more than 1,000 times.
    GaveUp = 2,
    /// No entry of the plan is proven for the pose-set: improve the estimate, then ask again.
    NoEntry = 3,
}

/// The next step of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_instruction {
    /// A `posegate_instruction_kind`.
    pub kind: u32,
    /// If inhibited: a `posegate_stop`; else 0.
    pub stop: u32,
    /// Of a look: the tag's number. `POSEGATE_NO_TAG` if the step has no tag, or several.
    pub tag: u32,
    /// Of a look or work: the task's name, zero-terminated; else empty.
    pub task: [c_char; 36],
    /// Of a drive: the target, world frame; else zeros.
    pub to: posegate_pose,
}

// SAFETY: integers.
unsafe impl Plain for posegate_instruction {
    const DENIED: Self = Self {
        kind: posegate_instruction_kind::Inhibit as u32,
        tag: POSEGATE_NO_TAG,
        ..Self::ZERO
    };
}

impl posegate_instruction {
    fn of(instruction: Instruction<'_>) -> Self {
        match instruction {
            Instruction::Look { task, tag } => Self {
                kind: posegate_instruction_kind::Look as u32,
                tag,
                task: text(task),
                ..Self::DENIED
            },
            Instruction::Drive { to } => Self {
                kind: posegate_instruction_kind::Drive as u32,
                to: posegate_pose::of(to),
                ..Self::DENIED
            },
            Instruction::Work { task } => Self {
                kind: posegate_instruction_kind::Work as u32,
                task: text(task),
                ..Self::DENIED
            },
            Instruction::Inhibit(why) => Self {
                stop: match why {
                    StopReason::Done => posegate_stop::Done as u32,
                    StopReason::GaveUp => posegate_stop::GaveUp as u32,
                    StopReason::NoEntry => posegate_stop::NoEntry as u32,
                    // C has no number for any others.
                    _ => 0,
                },
                ..Self::DENIED
            },
        }
    }
}

/// Initialises storage for a sequencer before the plan's first step. The rules are borrowed: they must not change while the sequencer is used.
///
/// Errors: `POSEGATE_STATUS_RULES_INVALID` if the bytes are not the rules of a plan: damaged, cut short, or of another format version.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type; `length` bytes of the rules can be read, now and as long as the sequencer is
/// used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_sequencer_init(
    sequencer: *mut posegate_sequencer,
    rules: *const u8,
    length: usize,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        init(sequencer, || {
            let rules = Rules::parse(bytes_apart(sequencer, rules, length)?);
            let rules = rules.map_err(|_| posegate_status::RulesInvalid)?;
            Ok(Sequencer::new(rules))
        })
    }
}

/// Writes the next step for the current estimate. `radius_squared_q16` is the squared radius of a Gaussian set, unit 2^-16, such as that of
/// `posegate_table_info`; a bounded set does not use it. Report the result of the step with `posegate_sequencer_succeeded` or
/// `posegate_sequencer_failed` before the next call.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` if the estimate is not a pose-set, or the radius is out of range. The instruction is then
/// `POSEGATE_INSTRUCTION_KIND_INHIBIT`, and the plan is where it was.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_sequencer_next(
    sequencer: *mut posegate_sequencer,
    belief: *const posegate_belief,
    radius_squared_q16: u32,
    instruction: *mut posegate_instruction,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(instruction, || {
            separate(sequencer, belief).and(separate(sequencer, instruction))?;
            let sequencer = object(sequencer)?;
            let belief = read(belief)?.belief()?;
            let radius = match belief.spread {
                Some(Uncertainty::Gaussian(_)) => RadiusSquared::from_q16(radius_squared_q16),
                _ => Some(RadiusSquared::LARGEST),
            };
            let set = belief.pose_set(radius.ok_or(posegate_status::BadValue)?, Trust::FULL);
            let set = set.map_err(|_| posegate_status::BadValue)?;
            Ok(posegate_instruction::of(sequencer.next(&set)))
        })
    }
}

/// Reports that the last instruction succeeded: after a drive or a look the plan continues, after the work it ends.
///
/// # Safety
/// The pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_sequencer_succeeded(
    sequencer: *mut posegate_sequencer,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe { object(sequencer).map(Sequencer::succeeded) })
}

/// Reports that the last instruction failed: the tag was not seen, the gate did not permit, or the drive was stopped. The step is repeated as
/// often as its rule allows; then the plan continues without the tag, or ends.
///
/// # Safety
/// The pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_sequencer_failed(
    sequencer: *mut posegate_sequencer,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe { object(sequencer).map(Sequencer::failed) })
}
