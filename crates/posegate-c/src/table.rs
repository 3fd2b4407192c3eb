//! Tables: bytes in flash.

use super::call::answer;
use super::memory::{Plain, bytes};
use super::posegate_status;
use core::ffi::c_char;
use posegate::table::{self, Parts, Table};

/// The header data of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_table_info {
    /// The task's name, zero-terminated.
    pub task: [c_char; 36],
    /// The version of the tool that made the table, zero-terminated.
    pub tool_version: [c_char; 20],
    /// The task digest: SHA-256 of the set, the goal and the confidence from which the table was made.
    pub task_digest: [u8; 32],
    /// The squared radius of the site's confidence, unit 2^-16.
    pub radius_squared_q16: u32,
    /// The CRC-32C at the end of the table.
    pub crc: u32,
    /// The parts of the gate that decide on all of this table: a sum of `posegate_part`.
    pub parts: u32,
    /// Those of `parts` that this archive does not contain. Without them the gate denies more.
    pub missing_parts: u32,
}

/// A part of the gate, which an archive contains or not: a feature of the package `posegate-c`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_part {
    /// Decisions on cells. A table that needs them is refused without them: `POSEGATE_STATUS_PART_MISSING`.
    Cells = 1,
    /// Facets on points that turn with the robot, heading by heading.
    Headings = 2,
    /// The view of a tag.
    Sight = 4,
    /// Pose-sets that only several pieces of facets contain together.
    Unions = 8,
}

const _: () = assert!(
    posegate_part::Cells as u32 == Parts::CELLS.bits()
        && posegate_part::Headings as u32 == Parts::HEADINGS.bits()
        && posegate_part::Sight as u32 == Parts::SIGHT.bits()
        && posegate_part::Unions as u32 == Parts::UNIONS.bits()
);

// SAFETY: integers.
unsafe impl Plain for posegate_table_info {}

/// Returns a text with at least one zero after it.
pub(super) fn text<const N: usize>(from: &str) -> [c_char; N] {
    let mut text = [0; N];
    let most = N.saturating_sub(1);
    for (to, byte) in text.iter_mut().take(most).zip(from.bytes()) {
        *to = c_char::from_ne_bytes([byte]);
    }
    text
}

/// Checks the bytes of a table and writes its header data.
///
/// Errors: `POSEGATE_STATUS_TABLE_INVALID`, `POSEGATE_STATUS_TABLE_TOO_NEW` or `POSEGATE_STATUS_PART_MISSING` if a gate would refuse the
/// bytes; its reasons are then `POSEGATE_REASON_TABLE_DAMAGED`, `_TABLE_TOO_NEW` and `_PART_MISSING`.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type; `length` bytes of the table can be
/// read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_table_check(
    table: *const u8,
    length: usize,
    info: *mut posegate_table_info,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(info, || {
            let table = Table::parse(bytes(table, length)?)?;
            let parts = table.parts();
            Ok(posegate_table_info {
                task: text(table.task()),
                tool_version: text(table.tool_version()),
                task_digest: table.task_digest(),
                radius_squared_q16: table.radius_squared().q16(),
                crc: table.crc(),
                parts: parts.bits(),
                missing_parts: parts.without(Parts::BUILT).bits(),
            })
        })
    }
}

/// Continues a CRC-32C: writes the CRC of data whose first part has the CRC `so_far` (0 for no bytes)
/// and whose rest is `bytes`, as tables and frames use it. A program may also check its own code with
/// it.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type; `length` bytes can be read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_checksum(
    so_far: u32,
    bytes: *const u8,
    length: usize,
    checksum: *mut u32,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(checksum, || {
            let bytes = self::bytes(bytes, length)?;
            Ok(table::checksum_continued(so_far, bytes))
        })
    }
}
