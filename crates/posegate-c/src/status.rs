//! What every function answers.

use posegate::gate::InvalidParameter;
use posegate::wire::WireError;

/// Version of this interface: it changes when a struct or the meaning of a function does.
pub const POSEGATE_ABI_VERSION: u32 = 2;

/// What a function answers: 0, or why it did nothing. After an error every output is a denial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
#[must_use]
pub enum posegate_status {
    /// Done.
    Ok = 0,
    /// A pointer is null.
    Null = -1,
    /// A pointer is not aligned for what it should point to.
    Misaligned = -2,
    /// Storage that no `init` function has taken into use, or that was overwritten or moved since.
    NotInitialised = -3,
    /// A length that nothing in memory can have, or less than the function needs.
    BadLength = -4,
    /// A number that is none of its enum's, or out of its range.
    BadValue = -5,
    /// The bytes are no table: damaged, cut short, or of another format version.
    TableInvalid = -6,
    /// The controller does not give the known answers.
    SelfTestFailed = -7,
    /// The gate's copy of its settings is not what it was: the gate is latched, and only `init` helps.
    MemoryDamaged = -8,
    /// Storage (a gate, a judge, a receiver) shares bytes with another argument of the call, or a gate's counter with
    /// its table. The storage holds nothing any more.
    Overlap = -9,
    /// `maximum_age_ms` is not from 1 to 2^31 - 1.
    MaximumAge = -10,
    /// `permit_hold_ms` is not from 1 to 2^31 - 1.
    PermitHold = -11,
    /// `inhibit_hold_ms` is not from 1 to 2^31 - 1.
    InhibitHold = -12,
    /// `permits_in_a_row` is not from 1 to 65,535.
    PermitsInARow = -13,
    /// No task is named.
    Task = -14,
    /// No source is declared, or more than `POSEGATE_MOST_SOURCES`.
    Sources = -15,
    /// A source without a frame.
    Frame = -16,
    /// An inflation that is not from 1 to 4096.
    Inflation = -17,
    /// A time of an interlock is not from 1 to 2^31 - 1.
    InterlockTime = -18,
    /// `cross_terms` is no `posegate_cross_terms`, or `share_q8` is not from 1 to 255 where it counts.
    CrossTerms = -19,
    /// `restart` is no `posegate_restart`.
    Restart = -20,
    /// `response_ms` is 0, or not less than `maximum_age_ms`.
    ResponseTime = -21,
    /// A frame longer than any message, or not COBS.
    WireFrame = -31,
    /// A frame whose checksum does not hold.
    WireChecksum = -32,
    /// A message of another version, of an unknown kind, with a radius out of range or below the
    /// table's, or of a wrong length.
    WireContent = -33,
    /// A message that asks for a table that is not there.
    WireTable = -34,
}

/// What a function comes to within this crate.
pub(super) type Done = Result<(), posegate_status>;

impl posegate_status {
    /// The status of an outcome.
    pub(super) fn of(outcome: impl FnOnce() -> Done) -> Self {
        match outcome() {
            Ok(()) => Self::Ok,
            Err(status) => status,
        }
    }
}

impl From<InvalidParameter> for posegate_status {
    fn from(parameter: InvalidParameter) -> Self {
        match parameter {
            InvalidParameter::MaximumAge => Self::MaximumAge,
            InvalidParameter::ResponseTime => Self::ResponseTime,
            InvalidParameter::PermitHold => Self::PermitHold,
            InvalidParameter::InhibitHold => Self::InhibitHold,
            InvalidParameter::PermitsInARow => Self::PermitsInARow,
            InvalidParameter::Task => Self::Task,
            InvalidParameter::Sources => Self::Sources,
            InvalidParameter::Frame => Self::Frame,
            InvalidParameter::Inflation => Self::Inflation,
            InvalidParameter::InterlockTime => Self::InterlockTime,
            // None today: `no_setting_switches_a_check_off` in `tests/c_boundary.rs` has them all.
            _ => Self::BadValue,
        }
    }
}

impl From<WireError> for posegate_status {
    fn from(error: WireError) -> Self {
        match error {
            WireError::Frame => Self::WireFrame,
            WireError::Checksum => Self::WireChecksum,
            WireError::Content => Self::WireContent,
            WireError::Table => Self::WireTable,
            _ => Self::WireContent,
        }
    }
}

/// The version of the interface that the archive was built with: compare it with
/// `POSEGATE_ABI_VERSION` at start, since header and archive travel apart.
#[unsafe(no_mangle)]
pub extern "C" fn posegate_abi_version() -> u32 {
    POSEGATE_ABI_VERSION
}
