//! The part of a text that an error message shows: the lines around the fault, limited in size.
//!
//! ```
//! use posegate_files::excerpt::Excerpt;
//!
//! let text = "[camera.front]\nwidth = 640\nheight_px = 480\n";
//! let fault = text.find("width").expect("the key");
//! let excerpt = Excerpt::new(text, fault..fault + 5, 2);
//! assert_eq!(excerpt.text, "[camera.front]\nwidth = 640\nheight_px = 480");
//! assert_eq!((excerpt.first_line, &excerpt.text[excerpt.fault.clone()]), (1, "width"));
//! ```

use std::ops::Range;

use crate::printable::push;

/// Largest number of characters of a line shown before and after the fault, and of the fault itself.
const REACH: usize = 100;
/// Largest number of lines of a fault that are shown. If a fault is longer, only its first line is shown.
const MOST_LINES: usize = 8;
/// Replaces omitted text.
const LEFT_OUT: char = '\u{2026}';

/// A few lines around a fault in a text, printable ([`crate::printable`]) and shortened if they are long.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excerpt {
    /// The lines. Tabs are kept.
    pub text: String,
    /// The bytes of `text` that are the fault; empty at the end of a file.
    pub fault: Range<usize>,
    /// The number of the first line in the whole text, counted from 1.
    pub first_line: usize,
}

impl Excerpt {
    /// Extracts the lines of a fault, and one line before and after. The run time is proportional to the length of
    /// the text; the result is of limited size. `fault` is a range of bytes, moved to character boundaries; `line` is
    /// the number of the line in which it begins, counted from 1.
    #[must_use]
    pub fn new(text: &str, fault: Range<usize>, line: usize) -> Self {
        let start = text.floor_char_boundary(fault.start);
        let end = text.floor_char_boundary(fault.end).max(start);
        // A line end at the end of the fault would not be visible.
        let end = start + text[start..end].trim_end_matches(['\r', '\n']).len();
        let (head, rest) = text.split_at(line_start(text, start));
        let (start, mut end) = (start - head.len(), end - head.len());
        if rest[start..end].matches('\n').count() >= MOST_LINES {
            end = rest[start..].find('\n').map_or(end, |at| start + at);
        }
        let mut out = Out::default();
        let before = head.strip_suffix('\n');
        if let Some(before) = before {
            out.letters(&before[line_start(before, before.len())..], 2 * REACH);
            out.text.push('\n');
        }
        let mut at = 0;
        for line in rest.split('\n') {
            if at > end {
                out.text.push('\n');
                out.letters(line, 2 * REACH);
                break;
            }
            if at > 0 {
                out.text.push('\n');
            }
            out.faulty_line(line, start.saturating_sub(at)..end - at, at == 0);
            at += line.len() + 1;
        }
        Self {
            text: out.text,
            fault: out.fault,
            first_line: line.saturating_sub(usize::from(before.is_some())),
        }
    }
}

fn line_start(text: &str, at: usize) -> usize {
    text[..at].rfind('\n').map_or(0, |newline| newline + 1)
}

/// The excerpt under construction.
#[derive(Default)]
struct Out {
    text: String,
    fault: Range<usize>,
}

impl Out {
    /// Writes a line with a part of the fault, which may continue after the line's end.
    fn faulty_line(&mut self, line: &str, fault: Range<usize>, is_first: bool) {
        let (before, rest) = line.split_at(fault.start.min(line.len()));
        let (fault, after) = rest.split_at((fault.end - fault.start).min(rest.len()));
        let kept = before.char_indices().rev().nth(REACH - 1);
        let kept = kept.map_or(0, |(at, _)| at);
        if kept > 0 {
            self.text.push(LEFT_OUT);
        }
        self.letters(&before[kept..], REACH);
        if is_first {
            self.fault.start = self.text.len();
        }
        let is_complete = self.letters(fault, REACH);
        self.fault.end = self.text.len();
        if is_complete {
            self.letters(after, REACH);
        }
    }

    /// Writes at most `most` characters of a line. Returns `true` if that is the complete line.
    fn letters(&mut self, line: &str, most: usize) -> bool {
        let line = line.strip_suffix('\r').unwrap_or(line);
        let end = line.char_indices().nth(most);
        let end = end.map_or(line.len(), |(at, _)| at);
        for letter in line[..end].chars() {
            match letter {
                '\t' => self.text.push('\t'),
                letter => push(&mut self.text, letter),
            }
        }
        if end < line.len() {
            self.text.push(LEFT_OUT);
        }
        end == line.len()
    }
}

#[cfg(test)]
mod tests;
