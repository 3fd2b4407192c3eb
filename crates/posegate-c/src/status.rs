//! The status that every function returns.

use posegate::gate::InvalidParameter;
use posegate::table::TableError;
use posegate::wire::WireError;

/// Version of this interface. It changes if a struct or the meaning of a function changes.
pub const POSEGATE_ABI_VERSION: u32 = 7;

/// The result of a function: 0, or the reason why it did nothing. After an error every output is a denial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
#[must_use]
pub enum posegate_status {
    /// Done.
    Ok = 0,
    /// A pointer is null.
    Null = -1,
    /// A pointer is not aligned for its type.
    Misaligned = -2,
    /// Storage that no `init` function has initialised, or that was overwritten or moved since then.
    NotInitialised = -3,
    /// A length that is impossible in memory, or less than the function needs.
    BadLength = -4,
    /// A number that is not in its enum or out of its range, or a field `reserved` that is not 0.
    BadValue = -5,
    /// The bytes are not a table: damaged or cut short.
    TableInvalid = -6,
    /// The controller computes wrong answers on the built-in table.
    SelfTestFailed = -7,
    /// The gate's copy of its settings has changed: the gate is latched until `posegate_gate_init`.
    MemoryDamaged = -8,
    /// Storage (a gate, a judge, a receiver) shares bytes with another argument of the call, or a gate's counter with
    /// its table. The storage is no longer initialised.
    Overlap = -9,
    /// `maximum_age_ms` is not from 1 to 2^31 - 1.
    MaximumAge = -10,
    /// `permit_hold_ms` is not from 1 to 2^31 - 1.
    PermitHold = -11,
    /// `inhibit_hold_ms` is not from 1 to 2^31 - 1.
    InhibitHold = -12,
    /// `permits_in_a_row` is not from 1 to 65,535.
    PermitsInARow = -13,
    /// The task has no name.
    Task = -14,
    /// No source is declared, or more than `POSEGATE_MOST_SOURCES` sources are.
    Sources = -15,
    /// A source has no frame.
    Frame = -16,
    /// An inflation is not from 1 to 4096.
    Inflation = -17,
    /// A time of an interlock is not from 1 to 2^31 - 1.
    InterlockTime = -18,
    /// `cross_terms` is not a `posegate_cross_terms`, or `share_q8` is not from 1 to 255 although it is used.
    CrossTerms = -19,
    /// `restart` is not a `posegate_restart`.
    Restart = -20,
    /// `response_ms` is 0, or not less than `maximum_age_ms`.
    ResponseTime = -21,
    /// `motion` is not a `posegate_motion`; or a source moves and all its speeds are zero, or a speed is below zero, not a number, or above
    /// 1,000 m/s or 24 rad/s.
    Motion = -22,
    /// `report_period_ms` is not from 1 to 2^31 - 1.
    ReportPeriod = -23,
    /// The gate would never open: several permits in a row are needed, and `permit_hold_ms` is less than `report_period_ms`.
    PermitHoldTooShort = -24,
    /// The gate would never open: several permits in a row are needed, and `maximum_age_ms` is less than `report_period_ms` plus
    /// `response_ms`.
    MaximumAgeTooShort = -25,
    /// An error of the odometry is below zero, not a number or too large, or a time of a tracker is not from 1 to 2^31 - 1.
    Odometry = -26,
    /// The `ages` of a source do not rise by 64 ms, are below 64 ms or above 4194 s; or their factors fall, are not from 1 to 1023, or are,
    /// rounded up to 2^-6, larger than the source's own inflation; or a used entry follows an unused one.
    Aging = -27,
    /// The table is whole, and its format version is above that which this archive reads.
    TableTooNew = -28,
    /// The table has cells and no facets, and this archive is built without the part `cells`.
    PartMissing = -29,
    /// The counter of a clock stands still.
    ClockStopped = -30,
    /// A frame longer than any message, or not COBS.
    WireFrame = -31,
    /// The checksum of a frame is wrong.
    WireChecksum = -32,
    /// A message has another version, an unknown kind, a radius out of range or below the table's, or a wrong length.
    WireContent = -33,
    /// A message names a table that does not exist.
    WireTable = -34,
    /// The bytes are not the rules of a plan: damaged, cut short, or of another format version.
    RulesInvalid = -35,
}

/// The result of a function within this crate.
pub(super) type Done = Result<(), posegate_status>;

impl posegate_status {
    /// Returns the status of a result.
    pub(super) fn of(outcome: impl FnOnce() -> Done) -> Self {
        match outcome() {
            Ok(()) => Self::Ok,
            Err(status) => status,
        }
    }
}

impl From<TableError> for posegate_status {
    fn from(error: TableError) -> Self {
        match error {
            TableError::TooNew => Self::TableTooNew,
            TableError::NoCells => Self::PartMissing,
            _ => Self::TableInvalid,
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
            InvalidParameter::Aging => Self::Aging,
            InvalidParameter::InterlockTime => Self::InterlockTime,
            InvalidParameter::ReportPeriod => Self::ReportPeriod,
            InvalidParameter::PermitHoldTooShort { .. } => Self::PermitHoldTooShort,
            InvalidParameter::MaximumAgeTooShort { .. } => Self::MaximumAgeTooShort,
            // No other parameter exists today: `no_setting_disables_a_check` in `tests/c_boundary.rs` tests all.
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

/// Returns the version of the interface that the archive was built with. Compare it with `POSEGATE_ABI_VERSION` at
/// start, since header and archive are distributed separately.
#[unsafe(no_mangle)]
pub extern "C" fn posegate_abi_version() -> u32 {
    POSEGATE_ABI_VERSION
}
