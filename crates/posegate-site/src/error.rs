//! Errors in site files: the fault, its position, and how to fix it.

use std::ops::Range;

use super::suggest;
use posegate_files::excerpt::Excerpt;

/// The position of an error in a site file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Line, counted from 1.
    pub line: usize,
    /// Column in characters, counted from 1.
    pub column: usize,
    /// Bytes before the faulty text.
    pub offset: usize,
    /// Length of the faulty text, bytes; 0 at the end of the file.
    pub len: usize,
}

/// The first fault found in a site file that cannot be used.
///
/// Prints as `site.toml:12:8: what is wrong; expected this; help: do that`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{file}{}: {message}{}{}",
    position(.at), clause("; expected ", .expected), clause("; help: ", .help)
)]
pub struct SiteError {
    /// The file's name as given by the caller.
    pub file: Box<str>,
    /// The position of the fault; `None` if the file could not be read at all.
    pub at: Option<Place>,
    /// The fault.
    pub message: Box<str>,
    /// The expected text or value.
    pub expected: Option<Box<str>>,
    /// How to fix the fault.
    pub help: Option<Box<str>>,
    /// The text around `at`; `None` if `at` is `None`.
    pub excerpt: Option<Box<Excerpt>>,
}

impl SiteError {
    pub(super) fn unreadable(file: &str, cause: &posegate_files::input::InputError) -> Self {
        Self {
            file: file.into(),
            at: None,
            message: format!("the site file cannot be read: {cause}").into(),
            expected: Some("a readable TOML file".into()),
            help: Some("check the path and its permissions".into()),
            excerpt: None,
        }
    }

    pub(super) fn expected(mut self, expected: impl Into<Box<str>>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    pub(super) fn help(mut self, help: impl Into<Box<str>>) -> Self {
        self.help = Some(help.into());
        self
    }
}

fn position(at: &Option<Place>) -> String {
    at.map_or_else(String::new, |at| format!(":{}:{}", at.line, at.column))
}

fn clause(lead: &str, text: &Option<Box<str>>) -> String {
    text.as_deref()
        .map_or_else(String::new, |text| format!("{lead}{text}"))
}

/// A file's name and text, to which spans refer.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) file: &'a str,
    pub(super) text: &'a str,
}

impl<'a> Source<'a> {
    /// Returns an error at a span of bytes of the text.
    pub(super) fn error(&self, span: Range<usize>, message: impl Into<Box<str>>) -> SiteError {
        let start = self.boundary(span.start);
        let end = self.boundary(span.end).max(start);
        let before = &self.text[..start];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        // A byte order mark occupies no column.
        let in_line = before[line_start..].trim_start_matches('\u{feff}');
        let line = 1 + before.matches('\n').count();
        SiteError {
            file: self.file.into(),
            at: Some(Place {
                line,
                column: 1 + in_line.chars().count(),
                offset: start,
                len: end - start,
            }),
            message: message.into(),
            expected: None,
            help: None,
            excerpt: Some(Box::new(Excerpt::new(self.text, start..end, line))),
        }
    }

    /// Returns the text of a span, shortened to a part of one line.
    pub(super) fn quote(&self, span: Range<usize>) -> String {
        const LONGEST: usize = 40;
        let start = self.boundary(span.start);
        let end = self.boundary(span.end).max(start);
        let whole = &self.text[start..end];
        let first = whole.lines().next().unwrap_or_default();
        let mut quoted: String = first.chars().take(LONGEST).collect();
        if quoted.len() < whole.len() {
            quoted.push_str("...");
        }
        quoted
    }

    fn boundary(&self, offset: usize) -> usize {
        let offset = offset.min(self.text.len());
        (0..=offset)
            .rev()
            .find(|&at| self.text.is_char_boundary(at))
            .unwrap_or(0)
    }
}

/// A task that the site does not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the site has no task `{name}`; {}", known_or_similar(.known, .similar, "task"))]
pub struct UnknownTask {
    /// The requested name.
    pub name: String,
    /// The known task with the most similar name, if one is similar.
    pub similar: Option<String>,
    /// The names of all tasks of the site.
    pub known: Vec<String>,
}

/// A chain that the site does not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the site has no chain `{name}`; {}", known_or_similar(.known, .similar, "chain"))]
pub struct UnknownChain {
    /// The requested name.
    pub name: String,
    /// The known chain with the most similar name, if one is similar.
    pub similar: Option<String>,
    /// The names of all chains of the site.
    pub known: Vec<String>,
}

fn known_or_similar(known: &[String], similar: &Option<String>, what: &str) -> String {
    match similar {
        Some(similar) => format!("did you mean `{similar}`?"),
        None if known.is_empty() => format!("it has none: add a [{what}.NAME] table"),
        None => format!("it has {}", suggest::list(known.iter().map(String::as_str))),
    }
}
