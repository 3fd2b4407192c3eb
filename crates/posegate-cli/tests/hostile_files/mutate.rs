//! Makes damaged or hostile files from good ones.

use crate::chance::Chance;

/// Numbers that may cause errors in readers.
const NUMBERS: [&str; 24] = [
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "1e999",
    "-0",
    "-0.0",
    "nan",
    "inf",
    "-inf",
    "2147483647",
    "2147483648",
    "-2147483649",
    "4294967296",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551616",
    "340282366920938463463374607431768211456",
    "1e9",
    "1e-9",
    "0",
    "-1",
    "1000000",
    "65536",
];
/// The openings of nested structures with their ends.
const NESTS: [(&str, &str); 8] = [
    ("[", "]"),
    ("{a=", "}"),
    ("{\"a\":", "}"),
    ("[[", "]]"),
    ("- ", ""),
    ("a.", "b = 1"),
    ("{ any = [", "] }"),
    ("&a [", "]"),
];

/// The kind of a format: text or binary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Text,
    Binary,
}

/// Returns a mutant of a file, with one to three changes. Of the mutants of texts, four in ten only have another number: these
/// reach more of the program.
pub fn mutant(chance: &mut Chance, good: &[u8], kind: Kind) -> Vec<u8> {
    let mut bytes = good.to_vec();
    if kind == Kind::Text && chance.below(10) < 4 {
        other_number(chance, &mut bytes);
        return bytes;
    }
    for _ in 0..=chance.below(3) {
        match kind {
            Kind::Text if chance.below(3) > 0 => text(chance, &mut bytes),
            Kind::Binary if chance.below(3) > 0 => binary(chance, &mut bytes),
            _ => any(chance, &mut bytes),
        }
        // A file of megabytes is enough.
        bytes.truncate(4 << 20);
    }
    bytes
}

/// Returns a place in bytes, which may be their end.
fn place(chance: &mut Chance, bytes: &[u8]) -> usize {
    chance.below(bytes.len() + 1)
}

fn range(chance: &mut Chance, bytes: &[u8], longest: usize) -> std::ops::Range<usize> {
    let start = place(chance, bytes);
    let end = (start + chance.below(longest + 1)).min(bytes.len());
    start..end
}

fn any(chance: &mut Chance, bytes: &mut Vec<u8>) {
    match chance.below(6) {
        0 if !bytes.is_empty() => {
            for _ in 0..=chance.below(8) {
                let bit = chance.below(bytes.len() * 8);
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
        }
        1 if !bytes.is_empty() => {
            for _ in 0..=chance.below(8) {
                let at = chance.below(bytes.len());
                bytes[at] = chance.next() as u8;
            }
        }
        2 => bytes.truncate(place(chance, bytes)),
        3 => {
            let range = range(chance, bytes, 2000);
            let times = [1, 2, 50, 2000][chance.below(4)];
            let slice = bytes[range.clone()].repeat(times);
            bytes.splice(range.end..range.end, slice);
        }
        4 => {
            let range = range(chance, bytes, 200);
            bytes.drain(range);
        }
        _ => {
            let at = place(chance, bytes);
            let odd: [&[u8]; 8] = [
                b"\0",
                b"\xff\xfe",
                b"\xef\xbb\xbf",
                b"\x1b[2J",
                b"\r",
                b"\t",
                "é\u{2028}\u{202e}".as_bytes(),
                b"\x80",
            ];
            bytes.splice(at..at, odd[chance.below(8)].iter().copied());
        }
    }
}

/// Changes of lengths and counts.
fn binary(chance: &mut Chance, bytes: &mut [u8]) {
    let values: [u64; 12] = [
        0,
        1,
        0x7f,
        0xffff,
        1 << 16,
        (1 << 31) - 1,
        1 << 31,
        (1 << 32) - 1,
        1 << 32,
        1 << 62,
        1 << 63,
        u64::MAX,
    ];
    let value = values[chance.below(values.len())].to_le_bytes();
    let width = [2, 4, 8][chance.below(3)];
    if bytes.len() >= width {
        let at = chance.below(bytes.len() - width + 1);
        bytes[at..at + width].copy_from_slice(&value[..width]);
    }
}

fn text(chance: &mut Chance, bytes: &mut Vec<u8>) {
    match chance.below(8) {
        0..=2 => {
            let Some(range) = number(chance, bytes) else {
                return;
            };
            bytes.splice(range, NUMBERS[chance.below(NUMBERS.len())].bytes());
        }
        3 => {
            let (open, close) = NESTS[chance.below(NESTS.len())];
            let deep = [10, 200, 5_000, 100_000][chance.below(4)];
            let nest = [
                open.repeat(deep),
                close.repeat(if chance.below(2) == 0 { deep } else { 0 }),
            ]
            .concat();
            // Instead of a value, as a separate line, or anywhere.
            let range = match chance.below(3) {
                0 => number(chance, bytes).unwrap_or(0..0),
                1 => {
                    let at = line(chance, bytes).start;
                    at..at
                }
                _ => {
                    let at = place(chance, bytes);
                    at..at
                }
            };
            bytes.splice(range, nest.bytes());
        }
        4 => {
            // Far columns: spaces, letters, digits, or a separator.
            let at = place(chance, bytes);
            let letter = b" a0,\"#\n\xc3"[chance.below(8)];
            let count = [100, 70_000, 2_000_000][chance.below(3)];
            bytes.splice(at..at, std::iter::repeat_n(letter, count));
        }
        5 => {
            let range = line(chance, bytes);
            let mut copied = bytes[range.clone()].to_vec();
            copied.push(b'\n');
            let times = [1, 20, 20_000][chance.below(3)].min((2 << 20) / copied.len());
            bytes.splice(range.start..range.start, copied.repeat(times));
        }
        6 => {
            // Many different entries: a line repeated with increasing numbers.
            let range = line(chance, bytes);
            let text = String::from_utf8_lossy(&bytes[range.clone()]).into_owned();
            let times = [20, 20_000][chance.below(2)].min((2 << 20) / (text.len() + 8));
            let counted: String = (0..times)
                .map(|k| match text.find(|c: char| c.is_ascii_digit()) {
                    Some(at) => format!("{}{k}{}\n", &text[..at], &text[at + 1..]),
                    None => format!("{text}{k}\n"),
                })
                .collect();
            bytes.splice(range.start..range.start, counted.bytes());
        }
        _ => {
            let (a, b) = (line(chance, bytes), line(chance, bytes));
            let (first, second) = if a.start <= b.start { (a, b) } else { (b, a) };
            if first.end <= second.start {
                let moved = bytes[second.clone()].to_vec();
                let other = bytes[first.clone()].to_vec();
                bytes.splice(second, other);
                bytes.splice(first, moved);
            }
        }
    }
}

/// Replaces a number by one of [`NUMBERS`], or by itself times a power of ten.
fn other_number(chance: &mut Chance, bytes: &mut Vec<u8>) {
    let Some(range) = number(chance, bytes) else {
        return;
    };
    let written = String::from_utf8_lossy(&bytes[range.clone()]).into_owned();
    let other = match (chance.below(2), written.parse::<f64>()) {
        (0, Ok(value)) => {
            let power = i32::try_from(chance.below(13)).expect("a small number") - 6;
            format!("{:?}", value * 10_f64.powi(power))
        }
        _ => NUMBERS[chance.below(NUMBERS.len())].to_owned(),
    };
    bytes.splice(range, other.into_bytes());
}

/// Returns the range of a line without its end.
fn line(chance: &mut Chance, bytes: &[u8]) -> std::ops::Range<usize> {
    let at = place(chance, bytes);
    let start = bytes[..at]
        .iter()
        .rposition(|byte| *byte == b'\n')
        .map_or(0, |end| end + 1);
    let length = bytes[at..].iter().position(|byte| *byte == b'\n');
    start..length.map_or(bytes.len(), |length| at + length)
}

/// Returns the range of a number in a text.
fn number(chance: &mut Chance, bytes: &[u8]) -> Option<std::ops::Range<usize>> {
    let is = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'e');
    let at = place(chance, bytes);
    let start = at + bytes[at..].iter().position(u8::is_ascii_digit)?;
    let start = start
        - bytes[..start]
            .iter()
            .rev()
            .take_while(|byte| is(byte))
            .count();
    let length = bytes[start..].iter().take_while(|byte| is(byte)).count();
    Some(start..start + length)
}
