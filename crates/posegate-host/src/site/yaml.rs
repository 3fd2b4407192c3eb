//! YAML with the position of every value.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::Deserialize;
use serde::de::{DeserializeOwned, IgnoredAny};
use serde_saphyr::NonFiniteFloatPolicy;

pub(super) use serde_saphyr::Spanned;

use crate::site::error::{SiteError, Source};

/// Texts for the errors of one kind of file.
pub(super) struct FormatMessages {
    /// The kind of file: completes "expected ...".
    pub what: &'static str,
    /// Advice on the notation of the file.
    pub written: &'static str,
    /// Advice on the notation of its numbers.
    pub numbers: &'static str,
    /// Advice for a number that is not finite.
    pub not_finite: &'static str,
    /// Advice for a list of the wrong length.
    pub length: &'static str,
}

const TABS: &str = "indent with spaces; `expand FILE` turns tabs into them";

/// The text of a YAML file, checked for tab indents.
pub(super) struct Document<'a> {
    source: Source<'a>,
    manner: &'static FormatMessages,
}

/// A matrix in the notation of ROS and OpenCV.
#[derive(Deserialize)]
pub(super) struct Matrix {
    pub(super) data: Option<Spanned<Vec<Spanned<f64>>>>,
}

impl<'a> Document<'a> {
    /// Refuses indents by tabs: the position of the text after a tab would be misleading. (The parser
    /// ignores OpenCV's `%YAML:1.0` and `!!opencv-matrix`.)
    pub(super) fn new(
        source: Source<'a>,
        manner: &'static FormatMessages,
    ) -> Result<Self, SiteError> {
        let mut start = 0;
        for line in source.text.split_inclusive('\n') {
            let indent = line.len() - line.trim_start_matches([' ', '\t']).len();
            if let Some(tab) = line[..indent].find('\t') {
                let at = start + tab;
                return Err(source
                    .error(at..at + 1, "the line is indented by a tab")
                    .expected("spaces")
                    .help(TABS));
            }
            start += line.len();
        }
        Ok(Self { source, manner })
    }

    /// Returns the keys of the file's top level.
    pub(super) fn keys(&self) -> Result<Vec<String>, SiteError> {
        let all: BTreeMap<String, IgnoredAny> = self.read()?;
        Ok(all.into_keys().collect())
    }

    /// Parses the whole file.
    pub(super) fn read<T: DeserializeOwned>(&self) -> Result<T, SiteError> {
        // NaN and infinity pass here. They are refused later, by an error that states their name.
        let options = serde_saphyr::options! {
            non_finite_float_policy: NonFiniteFloatPolicy::PassThrough,
        };
        serde_saphyr::from_str_with_options(self.source.text, options).map_err(|fault| {
            let at = fault.location().map_or(0..0, |place| self.span(place));
            let full = fault.without_snippet().to_string();
            let line = full.split(" at line ").next().unwrap_or_default();
            // The rest of the message is for programmers.
            let message = line.split(", set ").next().unwrap_or_default();
            let found = self.source.quote(at.clone());
            let found = if found.is_empty() || found.trim().is_empty() {
                String::new()
            } else {
                format!(" (at `{found}`)")
            };
            let error = self.source.error(at, format!("not read: {message}{found}"));
            if message.contains("budget") {
                error
                    .expected("at most 250,000 values, nested a few deep")
                    .help("check that it is the file that is meant; cut a large map into several files")
            } else if message.contains(" tab") {
                error.expected("spaces").help(TABS)
            } else if message.contains("floating") || message.contains("u32") {
                error.expected("a number").help(self.manner.numbers)
            } else {
                let manner = self.manner;
                error.expected(manner.what).help(manner.written)
            }
        })
    }

    pub(super) fn error(
        &self,
        at: Range<usize>,
        message: impl Into<std::boxed::Box<str>>,
    ) -> SiteError {
        self.source.error(at, message)
    }

    /// Returns the range of a location in the text, bytes.
    pub(super) fn span(&self, place: serde_saphyr::Location) -> Range<usize> {
        let text = self.source.text;
        // Uses byte offsets if the parser gives them: counting lines up to each value would take quadratic
        // time.
        let span = place.span();
        if let (Some(start), Some(length)) = (span.byte_offset(), span.byte_len()) {
            let start = usize::try_from(start).unwrap_or(usize::MAX);
            let length = usize::try_from(length).unwrap_or(usize::MAX);
            return start..start.saturating_add(length);
        }
        let line = usize::try_from(place.line()).unwrap_or(1).max(1);
        let before: usize = text
            .split_inclusive('\n')
            .take(line - 1)
            .map(str::len)
            .sum();
        let chars = |count: u64, from: usize| {
            let rest = text[from..].chars();
            let count = usize::try_from(count).unwrap_or(0);
            from + rest.take(count).map(char::len_utf8).sum::<usize>()
        };
        let start = chars(place.column().saturating_sub(1), before);
        start..chars(place.span().len(), start)
    }

    /// Returns a value that a file must have.
    pub(super) fn required<T>(
        &self,
        value: Option<T>,
        at: Range<usize>,
        name: &str,
        help: &str,
    ) -> Result<T, SiteError> {
        value.ok_or_else(|| {
            self.error(at, format!("`{name}` is missing"))
                .expected(format!("`{name}`"))
                .help(help.to_owned())
        })
    }

    /// Returns exactly `N` finite numbers.
    pub(super) fn numbers<const N: usize>(
        &self,
        list: &Spanned<Vec<Spanned<f64>>>,
        name: &str,
    ) -> Result<[f64; N], SiteError> {
        self.finite(list, name)?;
        plain(&list.value).try_into().map_err(|all: Vec<f64>| {
            self.error(
                self.span(list.referenced),
                format!("{name} has {} numbers", all.len()),
            )
            .expected(format!("{N} numbers"))
            .help(self.manner.length)
        })
    }

    /// Refuses a list with a number that is not finite.
    pub(super) fn finite(
        &self,
        list: &Spanned<Vec<Spanned<f64>>>,
        name: &str,
    ) -> Result<(), SiteError> {
        let bad = list
            .value
            .iter()
            .enumerate()
            .find(|(_, number)| !number.value.is_finite());
        match bad {
            None => Ok(()),
            Some((index, number)) => Err(self
                .error(
                    self.span(number.referenced),
                    format!("{name}[{index}] is {}", number.value),
                )
                .expected("a finite number")
                .help(self.manner.not_finite)),
        }
    }
}

/// Returns the numbers without their positions.
pub(super) fn plain(numbers: &[Spanned<f64>]) -> Vec<f64> {
    numbers.iter().map(|number| number.value).collect()
}
