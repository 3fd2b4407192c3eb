//! Numbers of a table that are read again from flash, past what a compiler or a register has kept.

use super::TASK_DIGEST_AT;
use super::bytes::u32_at;
use crate::set::RadiusSquared;

/// Returns the checksum in the last four bytes of a table, read from memory at each call; 0 if there are fewer than
/// four bytes.
#[inline]
pub(crate) fn stored_checksum(bytes: &[u8]) -> u32 {
    core::hint::black_box(bytes)
        .last_chunk()
        .map_or(0, |crc| u32::from_le_bytes(*crc))
}

/// Returns the squared radius in the header of a table, read from memory at each call.
pub(crate) fn stored_radius_squared(bytes: &[u8]) -> Option<RadiusSquared> {
    RadiusSquared::from_q16(u32_at(core::hint::black_box(bytes), 64)?)
}

/// Returns a mark of the bytes of a table, read from memory at each call: the stated length, the first four bytes of
/// the task digest and the checksum, combined by exclusive or. A change of one of them changes the mark; changes of
/// several cancel with a probability of 2^-32. Returns 0 for bytes without a header.
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline)]
pub(crate) fn stored_mark(bytes: &[u8]) -> u32 {
    let bytes = core::hint::black_box(bytes);
    let Some((header, crc)) = bytes
        .first_chunk::<{ TASK_DIGEST_AT + 4 }>()
        .zip(bytes.last_chunk::<4>())
    else {
        return 0;
    };
    let [.., s0, s1, s2, s3] = *header;
    let [_, _, _, _, _, _, _, _, _, _, _, _, l0, l1, l2, l3, ..] = *header;
    let [c0, c1, c2, c3] = *crc;
    let [task, length, crc] =
        [[s0, s1, s2, s3], [l0, l1, l2, l3], [c0, c1, c2, c3]].map(u32::from_le_bytes);
    task ^ length ^ crc
}
