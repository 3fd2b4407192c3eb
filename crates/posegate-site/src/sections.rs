//! Finds the sections of a site file by their headers, in a walk over its lines that reads no values.

use super::keys;
use super::reader::Key;

/// Sections `[KIND.NAME]` that matter only to entries that refer to them by name.
const NAMED: [&Key; 4] = [&keys::TASKS, &keys::TAGS, &keys::GOALS, &keys::CHAINS];
/// Sections that add tags and goals from other files, or whose numbers depend on all tags.
const OF_ALL: [&Key; 3] = [&keys::IMPORTS, &keys::CANDIDATES, &keys::ROWS];

/// The section that a line is in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Section {
    /// Before the first header, or in a section that every task may depend on.
    Common,
    /// In the section of one named task, tag, goal or chain.
    Named {
        /// The word before the name.
        kind: &'static str,
        name: String,
    },
}

/// The file needs the full parser, with or without a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NeedsFullParse;

/// A walk over the lines of a site file. It supports only simple files. It stops at strings of several lines, tasks
/// or tags without a header of their own, names with escapes, and unclosed brackets.
pub(super) struct Sections {
    section: Section,
    /// `true` if the section may have keys: `false` before the first header, and under `[task]` and the like.
    keys: bool,
    /// The number of open brackets and braces.
    depth: usize,
    /// The strings of the line, as written.
    strings: Vec<String>,
}

impl Sections {
    pub(super) const fn new() -> Self {
        Self {
            section: Section::Common,
            keys: false,
            depth: 0,
            strings: Vec::new(),
        }
    }

    /// Takes the next line, without its end. Returns `true` if it begins a section.
    pub(super) fn line(&mut self, line: &str) -> Result<bool, NeedsFullParse> {
        self.strings.clear();
        let line = line.strip_suffix('\r').unwrap_or(line);
        if line.contains(['\r', '\u{feff}']) {
            return Err(NeedsFullParse);
        }
        let path = header(line);
        if self.depth > 0 && path.is_some() {
            // This line may be a header after a bracket that was not closed.
            return Err(NeedsFullParse);
        }
        let text = line.trim_matches([' ', '\t']);
        if self.depth == 0 && text.starts_with('[') {
            (self.section, self.keys) = section(&path.ok_or(NeedsFullParse)?)?;
            return Ok(true);
        }
        if !self.keys && !text.is_empty() && !text.starts_with('#') {
            return Err(NeedsFullParse);
        }
        self.value(text).map(|()| false)
    }

    /// Returns the section of the last line.
    pub(super) const fn section(&self) -> &Section {
        &self.section
    }

    /// Returns the strings of the last line.
    pub(super) fn strings(&self) -> &[String] {
        &self.strings
    }

    /// Takes the end of the file.
    pub(super) const fn end(&self) -> Result<(), NeedsFullParse> {
        match self.depth {
            0 => Ok(()),
            _ => Err(NeedsFullParse),
        }
    }

    /// Counts brackets and collects strings, up to a comment.
    fn value(&mut self, text: &str) -> Result<(), NeedsFullParse> {
        let mut rest = text;
        while let Some(at) = rest.find(['#', '"', '\'', '[', ']', '{', '}']) {
            let (sign, after) = rest.get(at..).ok_or(NeedsFullParse)?.split_at(1);
            rest = after;
            match sign {
                "#" => return Ok(()),
                "[" | "{" => self.depth += 1,
                "]" | "}" => self.depth = self.depth.checked_sub(1).ok_or(NeedsFullParse)?,
                quote => {
                    let (string, after) = string(quote, after)?;
                    self.strings.push(string.to_owned());
                    rest = after;
                }
            }
        }
        Ok(())
    }
}

/// Splits a text after an opening quote into the string and the text after the closing quote. Refuses strings of
/// several lines and escapes.
fn string<'a>(quote: &str, text: &'a str) -> Result<(&'a str, &'a str), NeedsFullParse> {
    let (string, after) = text.split_once(quote).ok_or(NeedsFullParse)?;
    let escapes = quote == "\"" && string.contains('\\');
    if escapes || string.is_empty() && after.starts_with(quote) {
        return Err(NeedsFullParse);
    }
    Ok((string, after))
}

/// The header of a section.
struct Header<'a> {
    path: Vec<&'a str>,
    /// `true` for double brackets: an element of an array.
    is_element: bool,
}

/// Parses a header; `None` if the line is not a header.
fn header(line: &str) -> Option<Header<'_>> {
    let mut rest = line.trim_start_matches([' ', '\t']).strip_prefix('[')?;
    let end = match rest.strip_prefix('[') {
        Some(inner) => {
            rest = inner;
            "]]"
        }
        None => "]",
    };
    let mut path = Vec::new();
    loop {
        rest = rest.trim_start_matches([' ', '\t']);
        let (name, after) = match rest.get(..1)? {
            quote @ ("\"" | "'") => string(quote, rest.get(1..)?).ok()?,
            _ => {
                let bare = |letter: char| letter.is_ascii_alphanumeric() || "-_".contains(letter);
                let end = rest.find(|letter| !bare(letter)).filter(|end| *end > 0)?;
                rest.split_at(end)
            }
        };
        path.push(name);
        rest = after.trim_start_matches([' ', '\t']);
        rest = match rest.strip_prefix('.') {
            Some(after) => after,
            None => break,
        };
    }
    let rest = rest.strip_prefix(end)?.trim_start_matches([' ', '\t']);
    let header = Header {
        path,
        is_element: end == "]]",
    };
    (rest.is_empty() || rest.starts_with('#')).then_some(header)
}

/// Returns the section that a header begins, and `true` if the section may have keys.
fn section(header: &Header<'_>) -> Result<(Section, bool), NeedsFullParse> {
    let first = header.path.first().ok_or(NeedsFullParse)?;
    if OF_ALL.iter().any(|key| key.name == *first) {
        return Err(NeedsFullParse);
    }
    let Some(key) = NAMED.iter().find(|key| key.name == *first) else {
        return Ok((Section::Common, true));
    };
    match header.path.get(1) {
        Some(name) => {
            let (kind, name) = (key.name, (*name).to_owned());
            Ok((Section::Named { kind, name }, true))
        }
        // Keys under `[task]` would be tasks.
        None if !header.is_element => Ok((Section::Common, false)),
        None => Err(NeedsFullParse),
    }
}

#[cfg(test)]
mod tests {

    use super::*;

    /// Returns the last section and the strings of some lines.
    fn walk(text: &str) -> Result<(Section, Vec<String>), NeedsFullParse> {
        let mut sections = Sections::new();
        let mut strings = Vec::new();
        for line in text.lines() {
            sections.line(line)?;
            strings.extend(sections.strings().iter().cloned());
        }
        sections.end()?;
        Ok((sections.section().clone(), strings))
    }

    fn named(kind: &'static str, name: &str) -> Section {
        Section::Named {
            kind,
            name: name.to_string(),
        }
    }

    #[test]
    fn headers_of_simple_kinds_are_recognized() {
        for (header, section) in [
            ("[task.dock]", named("task", "dock")),
            (" [ task . dock ] # so", named("task", "dock")),
            ("[task.\"a b.c\".success]", named("task", "a b.c")),
            ("['tag'.'t 1']", named("tag", "t 1")),
            ("[[chain.c.steps]]", named("chain", "c")),
            ("[goal.g]", named("goal", "g")),
            ("[table]", Section::Common),
            ("[camera.front]", Section::Common),
            ("[wall.task]", Section::Common),
            ("[task]\n\n# So.\n[task.dock]", named("task", "dock")),
            ("[task.dock]\n[tag] # So.", Section::Common),
        ] {
            assert_eq!(walk(header), Ok((section, vec![])), "{header}");
        }
    }

    #[test]
    fn values_end_at_their_closing_bracket() {
        let text = "[task.dock]\na = \"[#'\" # [ \"no\"\nb = [ # [\n  [1, 2], 'x\"', [\n 3 ]]\nc = { d = \"y\" }";
        let strings = ["[#'", "x\"", "y"].map(ToString::to_string).to_vec();
        assert_eq!(walk(text), Ok((named("task", "dock"), strings)));
        assert_eq!(
            walk("[tag.t]\na = \"\"\nb = ''"),
            Ok((named("tag", "t"), vec![String::new(); 2]))
        );
    }

    #[test]
    fn other_syntax_needs_the_full_parser() {
        for text in [
            "task.dock.kind = \"work\"",
            "x = 1",
            "[task]\ndock = {}",
            "[tag.t]\n[task]\ndock.kind = 1",
            "[[task]]",
            "[import.map]",
            "[candidate.c]",
            "[task.\"do\\u0063k\"]",
            "[task.dock",
            "[task.dock] x",
            "[task.dock]]",
            "[[task.dock]",
            "[task..dock]",
            "[]",
            "[task.d\u{f6}ck]",
            "[tag.t]\na = \"\"\"\n[task.dock]\n\"\"\"",
            "[tag.t]\na = '''",
            "[tag.t]\na = \"\"\" \"\n[task.dock]\n\" \"\"\"",
            "[tag.t]\na = ''' '\n[task.dock]\n' '''",
            "[tag.t]\na = \"\\u0041\"",
            "[tag.t]\na = \"open",
            "[tag.t]\na = [1",
            "[tag.t]\na = [1\n[task.dock]\nb = 2]",
            "[tag.t]\na = [\n[1]\n]",
            "[tag.t]\na = 1]\nb = [",
            "[tag.t]\na = 1\r[task.dock]",
            "\u{feff}[tag.t]",
        ] {
            assert_eq!(walk(text), Err(NeedsFullParse), "{text}");
        }
    }
}
