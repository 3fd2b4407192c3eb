//! Changes to a table that the fuzzer's own mutations rarely make: a whole field, and one more facet.

/// Numbers of the header: offset and bytes.
const FIELDS: [(usize, usize); 17] = [
    (16, 4),
    (20, 4),
    (24, 4),
    (28, 4),
    (32, 4),
    (36, 4),
    (40, 4),
    (44, 4),
    (48, 2),
    (50, 2),
    (52, 4),
    (56, 4),
    (60, 2),
    (64, 4),
    (68, 4),
    (76, 4),
    (84, 4),
];
const HEADER: usize = 176;

/// The fuzzer's own mutation: takes the bytes, their number in use and their largest number, and returns the new
/// number.
pub type Mutate = fn(&mut [u8], usize, usize) -> usize;

/// Changes the first `size` bytes of `data`, a table and `tail` bytes behind it. Returns the new size.
pub fn mutate(
    data: &mut [u8],
    [size, most, tail]: [usize; 3],
    seed: u32,
    otherwise: Mutate,
) -> usize {
    let Some(end) = size.checked_sub(tail + 4).filter(|end| *end > HEADER + 2) else {
        return otherwise(data, size, most);
    };
    let pick = (seed >> 8) as usize;
    match seed % 8 {
        0 => {
            let (at, length) = FIELDS[pick % FIELDS.len()];
            change(&mut data[at..at + length], seed);
            size
        }
        1 => {
            let at = HEADER + (pick % (end - HEADER - 1));
            change(&mut data[at..at + 2], seed);
            size
        }
        2 => one_more_facet(data, size, most, end).unwrap_or(size),
        _ => otherwise(data, size, most),
    }
}

/// Changes a field slightly, by a single bit, or to an end of its range.
fn change(field: &mut [u8], seed: u32) {
    let mut bytes = [0; 4];
    bytes[..field.len()].copy_from_slice(field);
    let value = u32::from_le_bytes(bytes);
    let amount = seed >> 24;
    let changed = match seed >> 4 & 7 {
        0 | 1 => value.wrapping_add(amount % 16 + 1),
        2 | 3 => value.wrapping_sub(amount % 16 + 1),
        4 => value ^ 1 << (amount % 32),
        5 => amount,
        6 => 0,
        _ => u32::MAX,
    };
    field.copy_from_slice(&changed.to_le_bytes()[..field.len()]);
}

/// Repeats the last facet, if the facets are the last layout, and increases the counts of its frame, its piece and the
/// head.
fn one_more_facet(data: &mut [u8], size: usize, most: usize, end: usize) -> Option<usize> {
    let number = |data: &[u8], at: usize| {
        let bytes = data.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(bytes) as usize)
    };
    let at = number(data, 76).filter(|at| *at >= HEADER && at + 12 < end)?;
    let (pieces, frames) = (usize::from(data[at + 1]), usize::from(data[at + 2]));
    let piece = at + 12 + 12 * pieces.checked_sub(1)?;
    let frame = at + 12 + 12 * pieces + 6 * frames.checked_sub(1)?;
    if frame + 12 > end || size + 6 > most {
        return None;
    }
    data[frame + 1] = data[frame + 1].wrapping_add(1);
    for count in [piece + 10, at + 4] {
        let more = u16::from_le_bytes([data[count], data[count + 1]]).wrapping_add(1);
        data[count..count + 2].copy_from_slice(&more.to_le_bytes());
    }
    let length = number(data, 80)?.wrapping_add(6) as u32;
    data[80..84].copy_from_slice(&length.to_le_bytes());
    data.copy_within(end - 6..size, end);
    Some(size + 6)
}
