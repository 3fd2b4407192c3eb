//! Reads little-endian numbers at an offset; `None` past the end.

/// Returns `N` bytes at an offset.
pub(super) fn bytes_at<const N: usize>(bytes: &[u8], offset: usize) -> Option<[u8; N]> {
    let end = offset.checked_add(N)?;
    bytes.get(offset..end)?.try_into().ok()
}

pub(super) fn u16_at(bytes: &[u8], offset: usize) -> Option<u16> {
    bytes_at(bytes, offset).map(u16::from_le_bytes)
}

pub(super) fn u32_at(bytes: &[u8], offset: usize) -> Option<u32> {
    bytes_at(bytes, offset).map(u32::from_le_bytes)
}

pub(super) fn u64_at(bytes: &[u8], offset: usize) -> Option<u64> {
    bytes_at(bytes, offset).map(u64::from_le_bytes)
}

pub(super) fn i32_at(bytes: &[u8], offset: usize) -> Option<i32> {
    bytes_at(bytes, offset).map(i32::from_le_bytes)
}

/// Returns a name in `length` bytes: UTF-8, not empty, with only zeros after its first zero.
pub(super) fn padded_name(bytes: &[u8], offset: usize, length: usize) -> Option<&str> {
    let field = bytes.get(offset..offset.checked_add(length)?)?;
    let end = field.iter().position(|b| *b == 0).unwrap_or(length);
    let (name, padding) = field.split_at_checked(end)?;
    if name.is_empty() || padding.iter().any(|b| *b != 0) {
        return None;
    }
    core::str::from_utf8(name).ok()
}
