//! Names of tasks as names of files.

use std::fmt::Write as _;

/// A name with every byte that is no letter, digit, `-`, `_` or inner `.` as `%` and two digits.
pub(super) fn file_name(name: &str) -> String {
    let mut safe = String::with_capacity(name.len());
    for (at, byte) in name.bytes().enumerate() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' => safe.push(char::from(byte)),
            b'.' if at > 0 => safe.push('.'),
            _ => {
                // A string takes whatever is written to it.
                let _ = write!(safe, "%{byte:02X}");
            }
        }
    }
    safe
}
