//! Text from files and arguments, made safe to print on a terminal.
//!
//! A name may contain an escape sequence that clears the screen, or a format character that reorders the text after
//! it. Every function here replaces such characters by a visible escape and keeps all others.
//!
//! ```
//! use posegate_files::printable::printable;
//!
//! // A name that would clear the terminal.
//! assert_eq!(printable("dock\u{1b}[2J"), "dock\\u{1b}[2J");
//! ```

use std::borrow::Cow;
use std::fmt::Write;

/// Returns `true` if a terminal shows the character as itself: it is not a control character (C0, DEL, C1), does not
/// change the direction of text, and is not invisible.
#[must_use]
pub const fn is_printable(letter: char) -> bool {
    !matches!(letter,
        '\0'..='\u{1f}' | '\u{7f}'..='\u{9f}'
        // Direction of text.
        | '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
        // Line ends other than \n, and characters without width.
        | '\u{ad}' | '\u{200b}' | '\u{2028}' | '\u{2029}' | '\u{2060}'..='\u{2065}' | '\u{206a}'..='\u{206f}' | '\u{feff}'
        | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

/// Returns bytes as hexadecimal digits.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Appends a character, escaped as Rust writes it (`\n`, `\u{1b}`) if it is not printable.
pub fn push(out: &mut String, letter: char) {
    match letter {
        '\t' | '\n' | '\r' => out.extend(letter.escape_default()),
        letter if is_printable(letter) => out.push(letter),
        letter => out.extend(letter.escape_unicode()),
    }
}

/// Returns the text on one line: every character that is not printable is escaped, including line ends and tabs.
#[must_use]
pub fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |_| false, push)
}

/// Returns the text with its line ends. Use it only for text whose line ends are the program's own.
#[must_use]
pub fn printable_lines(text: &str) -> Cow<'_, str> {
    escaped(text, |letter| letter == '\n', push)
}

/// Returns JSON text with the same meaning that is printable, except for its white space. In JSON only strings can
/// contain other characters; there they become escapes of four hexadecimal digits.
#[must_use]
pub fn printable_json(json: &str) -> Cow<'_, str> {
    escaped(
        json,
        |letter| matches!(letter, '\t' | '\n' | '\r'),
        |out, letter| {
            for unit in letter.encode_utf16(&mut [0; 2]) {
                // Writing to a string cannot fail.
                let _ = write!(out, "\\u{unit:04x}");
            }
        },
    )
}

/// Returns a name as part of a TOML table's header: in quotes if it needs them.
pub fn toml_key(name: &str) -> String {
    let bare = |b: u8| b.is_ascii_alphanumeric() || b == b'-' || b == b'_';
    if !name.is_empty() && name.bytes().all(bare) {
        name.to_string()
    } else {
        toml_string(name)
    }
}

/// Returns a TOML string of the text, in double quotes, printable.
pub fn toml_string(text: &str) -> String {
    let mut out = String::from("\"");
    for letter in text.chars() {
        let _ = match letter {
            '"' | '\\' => write!(out, "\\{letter}"),
            letter if is_printable(letter) => write!(out, "{letter}"),
            '\0'..='\u{ffff}' => write!(out, "\\u{:04X}", u32::from(letter)),
            letter => write!(out, "\\U{:08X}", u32::from(letter)),
        };
    }
    out.push('"');
    out
}

fn escaped(
    text: &str,
    is_kept: impl Fn(char) -> bool,
    escape: impl Fn(&mut String, char),
) -> Cow<'_, str> {
    let is_shown = |letter| is_printable(letter) || is_kept(letter);
    let Some(first) = text.find(|letter| !is_shown(letter)) else {
        return Cow::Borrowed(text);
    };
    let (shown, rest) = text.split_at(first);
    let mut out = String::with_capacity(text.len());
    out.push_str(shown);
    for letter in rest.chars() {
        if is_shown(letter) {
            out.push(letter);
        } else {
            escape(&mut out, letter);
        }
    }
    Cow::Owned(out)
}

/// Returns a number with n decimals, without a minus before zero.
#[must_use]
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|byte| matches!(byte, b'0' | b'.')) => zero.to_owned(),
        _ => text,
    }
}

/// Returns a number with as few digits as read back as it. Numbers from 1e9 and below 1e-4 have an exponent.
#[must_use]
pub fn fewest_digits(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-4..1e9).contains(&size) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn very_large_and_very_small_numbers_have_an_exponent() {
        for (value, text) in [
            (0.0, "0"),
            (1e6, "1000000"),
            (0.05, "0.05"),
            (1e300, "1e300"),
            (2.5e-9, "2.5e-9"),
        ] {
            assert_eq!(fewest_digits(value), text);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
    }

    const HOSTILE: &str = "a\u{1b}[2J\u{7f}\u{9b}\u{202e}\u{2066}\u{200f}\u{feff}\u{e0041}\r\nb\tc";

    #[test]
    fn hostile_characters_are_escaped_on_one_line() {
        assert_eq!(
            printable(HOSTILE),
            "a\\u{1b}[2J\\u{7f}\\u{9b}\\u{202e}\\u{2066}\\u{200f}\\u{feff}\\u{e0041}\\r\\nb\\tc"
        );
        assert_eq!(printable_lines("a\n\u{1b}b"), "a\n\\u{1b}b");
    }

    #[test]
    fn ordinary_text_is_borrowed_unchanged() {
        for text in ["", "dock-3 `a` ä 停 \u{1f916} \u{2026}", "\\u{1b}"] {
            assert!(matches!(printable(text), Cow::Borrowed(same) if same == text));
        }
    }

    #[test]
    fn toml_strings_are_printable_and_read_back() {
        let quoted = toml_string(HOSTILE);
        assert!(quoted.chars().all(is_printable), "{quoted:?}");
        let read: toml::Table = std::format!("a = {quoted}").parse().unwrap();
        assert_eq!(read["a"].as_str(), Some(HOSTILE));
    }

    #[test]
    fn json_stays_equal_and_valid() {
        let value = serde_json::json!({"name": HOSTILE, "list": ["\u{85}", 1]});
        for json in [
            serde_json::to_string(&value).unwrap(),
            serde_json::to_string_pretty(&value).unwrap(),
        ] {
            let shown = printable_json(&json);
            assert!(
                shown.chars().all(|c| c == '\n' || is_printable(c)),
                "{shown:?}"
            );
            let again: serde_json::Value = serde_json::from_str(&shown).unwrap();
            assert_eq!(again, value);
        }
    }

    #[test]
    fn zero_has_no_minus() {
        for (value, text) in [
            (-0.0004, "0.000"),
            (-0.0006, "-0.001"),
            (0.0, "0.000"),
            (12.0, "12.000"),
        ] {
            assert_eq!(fixed(value, 3), text);
        }
    }
}
