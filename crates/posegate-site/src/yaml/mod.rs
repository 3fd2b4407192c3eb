//! YAML with the position of every value, and OpenCV's XML.

mod tree;
mod xml;

use std::borrow::Cow;
use std::cell::Cell;
use std::ops::Range;
use std::rc::Rc;

pub(super) use self::tree::Node;
use self::tree::{Entry, Value};
use crate::error::{SiteError, Source};
use crate::suggest;

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
    /// `true` to read the first one of several documents, `false` to refuse several.
    pub reads_first: bool,
}

const TABS: &str = "indent with spaces; `expand FILE` turns tabs into them";

/// The text of a YAML file, checked for tab indents.
pub(super) struct Document<'a> {
    source: Source<'a>,
    messages: &'static FormatMessages,
    /// Set if the first one of several documents was read.
    has_more: Cell<bool>,
}

/// The entries of a map in the file.
#[derive(Clone, Copy)]
pub(super) struct Map<'a> {
    entries: &'a [Entry],
}

impl<'a> Map<'a> {
    /// Returns the value of a key; `None` if the map does not have the key. A key without a value has an empty scalar, which
    /// [`Document::text`], [`Document::number`] and the others refuse: a default would hide that someone has still to write it.
    pub(super) fn get(&self, key: &str) -> Option<&'a Node> {
        let entry = self.entries.iter().find(|entry| &*entry.key == key)?;
        Some(&entry.node)
    }

    /// Returns the keys in the order of the file.
    pub(super) fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.entries.iter().map(|entry| &*entry.key)
    }

    /// Returns the keys in alphabetical order, with their values.
    pub(super) fn sorted(&self) -> Vec<(&'a str, &'a Node)> {
        let mut all: Vec<_> = self
            .entries
            .iter()
            .map(|entry| (&*entry.key, &entry.node))
            .collect();
        all.sort_unstable_by_key(|(key, _)| *key);
        all
    }
}

impl Node {
    /// Returns `true` for a list.
    pub(super) fn is_list(&self) -> bool {
        matches!(&*self.value, Value::List(_))
    }

    /// Returns a list of lists as one list, row by row; other values as they are.
    pub(super) fn rows(&self) -> Cow<'_, Self> {
        let Value::List(rows) = &*self.value else {
            return Cow::Borrowed(self);
        };
        let mut all = Vec::new();
        for row in rows {
            match &*row.value {
                Value::List(row) => all.extend(row.iter().cloned()),
                _ => return Cow::Borrowed(self),
            }
        }
        let (at, value) = (self.at.clone(), Rc::new(Value::List(all)));
        Cow::Owned(Self { at, value })
    }

    /// Returns the entries of a map; `None` for other values.
    pub(super) fn as_map(&self) -> Option<Map<'_>> {
        match &*self.value {
            Value::Map(entries) => Some(Map { entries }),
            _ => None,
        }
    }
}

impl<'a> Document<'a> {
    /// Refuses indents by tabs: the position of the text after a tab would be misleading.
    pub(super) fn new(
        source: Source<'a>,
        messages: &'static FormatMessages,
    ) -> Result<Self, SiteError> {
        let mut start = 0;
        for line in source.text.split_inclusive('\n') {
            let indent = line.len() - line.trim_start_matches([' ', '\t']).len();
            let is_blank = line.trim().is_empty();
            if let Some(tab) = line[..indent].find('\t').filter(|_| !is_blank) {
                let at = start + tab;
                return Err(source
                    .error(at..at + 1, "the line is indented by a tab")
                    .expected("spaces")
                    .help(TABS));
            }
            start += line.len();
        }
        Ok(Self::indented(source, messages))
    }

    /// Returns a text in which tabs are blanks as others: XML.
    pub(super) const fn indented(source: Source<'a>, messages: &'static FormatMessages) -> Self {
        Self {
            source,
            messages,
            has_more: Cell::new(false),
        }
    }

    /// Returns `true` if the file has more documents than the one that was read.
    pub(super) fn has_more(&self) -> bool {
        self.has_more.get()
    }

    /// Returns `true` for no value, and for an empty text.
    pub(super) fn is_empty(&self, node: &Node) -> bool {
        node.value.is_null() || scalar(node) == Some("")
    }

    /// Parses the file.
    pub(super) fn parse(&self) -> Result<Node, SiteError> {
        tree::parse(self)
    }

    /// Parses a file that OpenCV wrote in XML.
    pub(super) fn parse_xml(&self) -> Result<Node, SiteError> {
        xml::parse(self)
    }

    /// Returns the error of a key whose first one is at a byte of the text.
    fn twice(&self, key_at: Range<usize>, first: usize) -> SiteError {
        let before = self.source.text.get(..first).unwrap_or_default();
        let line = 1 + before.matches('\n').count();
        let name = self.source.quote(key_at.clone());
        self.error(
            key_at,
            format!("`{name}` is there twice, first in line {line}"),
        )
        .expected("each key once")
        .help(format!("remove one; {}", self.messages.written))
    }

    /// Returns the text of a value, shortened to a part of one line.
    pub(super) fn quote(&self, node: &Node) -> String {
        self.source.quote(node.at.clone())
    }

    pub(super) fn error(
        &self,
        at: Range<usize>,
        message: impl Into<std::boxed::Box<str>>,
    ) -> SiteError {
        self.source.error(at, message)
    }

    /// Returns the error of a value of another kind than expected.
    fn wrong_kind(&self, node: &Node, expected: &str, help: &'static str) -> SiteError {
        let found = match &*node.value {
            Value::List(_) => "a list".to_owned(),
            Value::Map(_) => "a map of keys".to_owned(),
            Value::Scalar { .. } if node.value.is_null() => "no value".to_owned(),
            Value::Scalar { .. } => format!("`{}`", self.quote(node)),
        };
        self.error(node.at.clone(), format!("found {found}"))
            .expected(expected.to_owned())
            .help(help)
    }

    /// Returns the entries of a map.
    pub(super) fn map<'n>(&self, node: &'n Node) -> Result<Map<'n>, SiteError> {
        match &*node.value {
            Value::Map(entries) => Ok(Map { entries }),
            _ => Err(self.wrong_kind(node, self.messages.what, self.messages.written)),
        }
    }

    /// Returns the values of a list; none if the key has no value.
    pub(super) fn list_or_none<'n>(&self, node: Option<&'n Node>) -> Result<&'n [Node], SiteError> {
        match node {
            Some(node) if !node.value.is_null() => self.list(node),
            _ => Ok(&[]),
        }
    }

    /// Returns the values of a list.
    pub(super) fn list<'n>(&self, node: &'n Node) -> Result<&'n [Node], SiteError> {
        match &*node.value {
            Value::List(nodes) => Ok(nodes),
            _ => Err(self.wrong_kind(node, "a list", self.messages.written)),
        }
    }

    /// Returns a text, with or without quotes.
    pub(super) fn text<'n>(&self, node: &'n Node) -> Result<&'n str, SiteError> {
        match &*node.value {
            Value::Scalar { text, .. } if !node.value.is_null() => Ok(text),
            _ => Err(self.wrong_kind(node, "a text", self.messages.written)),
        }
    }

    /// Returns a number in the notation of YAML 1.2. It may be infinite or NaN if it is written so.
    pub(super) fn number(&self, node: &Node) -> Result<f64, SiteError> {
        scalar(node)
            .and_then(number)
            .ok_or_else(|| self.wrong_kind(node, "a number", self.messages.numbers))
    }

    /// Returns a whole number from 0 to 2^32 - 1.
    pub(super) fn whole(&self, node: &Node) -> Result<u32, SiteError> {
        scalar(node)
            .and_then(whole)
            .ok_or_else(|| self.wrong_kind(node, "a whole number", self.messages.numbers))
    }

    /// Returns the numbers of a list, all of which must be finite. `name` is the list's name in errors.
    pub(super) fn finite_numbers(&self, list: &Node, name: &str) -> Result<Vec<f64>, SiteError> {
        let finite = |(index, node): (usize, &Node)| {
            let number = self.number(node)?;
            if number.is_finite() {
                return Ok(number);
            }
            Err(self
                .error(node.at.clone(), format!("{name}[{index}] is {number}"))
                .expected("a finite number")
                .help(self.messages.not_finite))
        };
        self.list(list)?.iter().enumerate().map(finite).collect()
    }

    /// Returns exactly `N` finite numbers.
    pub(super) fn numbers<const N: usize>(
        &self,
        list: &Node,
        name: &str,
    ) -> Result<[f64; N], SiteError> {
        let numbers = self.finite_numbers(list, name)?;
        numbers.try_into().map_err(|all: Vec<f64>| {
            self.error(list.at.clone(), format!("{name} has {} numbers", all.len()))
                .expected(format!("{N} numbers"))
                .help(self.messages.length)
        })
    }

    /// Returns the place of an element of a list, or of the list if it has no such element.
    pub(super) fn place_of(&self, list: &Node, index: usize) -> Range<usize> {
        match &*list.value {
            Value::List(nodes) => nodes.get(index).unwrap_or(list).at.clone(),
            _ => list.at.clone(),
        }
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

    /// Refuses keys that the format does not have: a misspelt key would silently leave the default.
    pub(super) fn only_keys(&self, map: Map<'_>, known: &[&str]) -> Result<(), SiteError> {
        match map
            .entries
            .iter()
            .find(|entry| !known.contains(&&*entry.key))
        {
            None => Ok(()),
            Some(entry) => Err(self
                .error(
                    entry.key_at.clone(),
                    format!("unknown key `{}`", self.source.quote(entry.key_at.clone())),
                )
                .expected(format!("one of {}", suggest::list(known.iter().copied())))
                .help(self.messages.written)),
        }
    }
}

/// Returns the list of texts below these keys, one inside the other; errors are described in one line and name the file `name`.
pub fn texts(text: &str, name: &str, path: &[&str]) -> Result<Vec<String>, String> {
    const MESSAGES: FormatMessages = FormatMessages {
        what: "the metadata of a ROS 2 bag",
        written: "use the file as rosbag2 wrote it",
        numbers: "use the file as rosbag2 wrote it",
        not_finite: "use the file as rosbag2 wrote it",
        length: "use the file as rosbag2 wrote it",
        reads_first: true,
    };
    let found = || {
        let document = Document::new(Source { file: name, text }, &MESSAGES)?;
        let root = document.parse()?;
        let mut node = root;
        for key in path {
            let inner = document.map(&node)?.get(key).cloned();
            node = document.required(inner, node.at, key, MESSAGES.written)?;
        }
        let texts = document.list(&node)?.iter().map(|node| document.text(node));
        texts
            .map(|text| text.map(str::to_owned))
            .collect::<Result<_, SiteError>>()
    };
    found().map_err(|error| error.to_string())
}

fn scalar(node: &Node) -> Option<&str> {
    match &*node.value {
        Value::Scalar { text, .. } => Some(text.trim_ascii()),
        _ => None,
    }
}

/// Returns the number that a text states in YAML 1.2's core schema; `None` for other texts and for numbers beyond the range of `f64`.
fn number(text: &str) -> Option<f64> {
    let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
    let sign = if text.starts_with('-') { -1.0 } else { 1.0 };
    match unsigned {
        ".nan" | ".NaN" | ".NAN" => Some(f64::NAN),
        ".inf" | ".Inf" | ".INF" => Some(sign * f64::INFINITY),
        // Rust reads words such as `inf` too.
        _ => text.parse().ok().filter(|number: &f64| number.is_finite()),
    }
}

/// Returns the whole number that a text states in YAML 1.2's core schema; `None` for other texts and for numbers outside 0 to
/// 2^32 - 1. A decimal number with a leading 0 is read if YAML 1.1, where it is octal, reads the same number or none.
fn whole(text: &str) -> Option<u32> {
    let text = text.strip_prefix('+').unwrap_or(text);
    let (digits, radix) = match (text.strip_prefix("0x"), text.strip_prefix("0o")) {
        (Some(digits), _) => (digits, 16),
        (_, Some(digits)) => (digits, 8),
        _ => (text, 10),
    };
    if radix == 10 && digits.len() > 1 && digits.starts_with('0') {
        let octal = u32::from_str_radix(digits, 8).ok();
        let decimal = digits
            .parse()
            .ok()
            .filter(|_| digits.bytes().all(|b| b.is_ascii_digit()))?;
        return octal
            .is_none_or(|octal| octal == decimal)
            .then_some(decimal);
    }
    // `from_str_radix` accepts a sign, so it would accept a second one.
    if !digits.starts_with(|first: char| first.is_ascii_hexdigit()) {
        return None;
    }
    u32::from_str_radix(digits, radix).ok()
}

#[cfg(test)]
mod tests;
