//! JSON with the position of every value.

use std::collections::BTreeSet;
use std::fmt;
use std::ops::Range;

use serde::Deserialize;
use serde::de::{MapAccess, Visitor};
use serde_json::value::RawValue;

use super::error::{SiteError, Source};
use super::suggest;

/// A value, its full name, and its file.
#[derive(Clone)]
pub(super) struct Value<'a> {
    source: Source<'a>,
    raw: &'a RawValue,
    path: String,
}

/// An object's members in the order of the file. A repeated name appears twice.
struct Members<'a>(Vec<(String, &'a RawValue)>);

impl<'de: 'a, 'a> Deserialize<'de> for Members<'a> {
    fn deserialize<D: serde::Deserializer<'de>>(reader: D) -> Result<Self, D::Error> {
        struct Each;
        impl<'de> Visitor<'de> for Each {
            type Value = Members<'de>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Members(members))
            }
        }
        reader.deserialize_map(Each)
    }
}

impl<'a> Value<'a> {
    /// Parses the whole file.
    pub(super) fn root(source: Source<'a>) -> Result<Self, SiteError> {
        // Windows programs may write a byte order mark before the text.
        let text = source.text.trim_start_matches('\u{feff}');
        let mark = source.text.len() - text.len();
        match serde_json::from_str(text) {
            Ok(raw) => Ok(Self {
                source,
                raw,
                path: String::new(),
            }),
            Err(fault) => {
                let lines = text.split_inclusive('\n').take(fault.line().max(1) - 1);
                let before: usize = lines.map(str::len).sum();
                let at = mark + before + fault.column().saturating_sub(1);
                let message = format!("{fault}");
                let message = message.split(" at line ").next().unwrap_or_default();
                let help = if text[before..].contains("NaN") || text[before..].contains("nan") {
                    "JSON has no NaN: measure the missing value, or remove the tag"
                } else {
                    "write `{ \"tags\": [ ... ] }`, names in double quotes, commas between, none at the end"
                };
                Err(source
                    .error(at..at + 1, format!("not valid JSON: {message}"))
                    .expected("JSON")
                    .help(help))
            }
        }
    }

    /// Returns the value's range in the text, bytes.
    pub(super) fn span(&self) -> Range<usize> {
        // `raw` is a slice of the text.
        let start = self.raw.get().as_ptr() as usize;
        let start = start.wrapping_sub(self.source.text.as_ptr() as usize);
        start..start.wrapping_add(self.raw.get().len())
    }

    /// Returns an error at this value.
    pub(super) fn error(&self, message: impl Into<std::boxed::Box<str>>) -> SiteError {
        self.source.error(self.span(), message)
    }

    /// Returns the value's name for error messages.
    pub(super) fn title(&self) -> String {
        if self.path.is_empty() {
            "the file".into()
        } else {
            format!("`{}`", self.path)
        }
    }

    fn found(&self, expected: &str, like: &str) -> SiteError {
        let text = self.raw.get();
        let kind = match text.as_bytes().first() {
            Some(b'{') => "an object".into(),
            Some(b'[') => "a list".into(),
            Some(b'"') => "a text in quotes".into(),
            _ => self.source.quote(self.span()),
        };
        self.error(format!("{} is {kind}", self.title()))
            .expected(expected)
            .help(format!("write it like {like}"))
    }

    fn members(&self, like: &str) -> Result<Vec<(String, &'a RawValue)>, SiteError> {
        let Ok(Members(members)) = serde_json::from_str(self.raw.get()) else {
            return Err(self.found("an object", like));
        };
        let mut names = BTreeSet::new();
        for (name, raw) in &members {
            if !names.insert(name) {
                let twice = self.member(name, raw);
                return Err(twice
                    .error(format!("{} is there twice", twice.title()))
                    .expected("each name once")
                    .help("remove one of them"));
            }
        }
        Ok(members)
    }

    fn member(&self, name: &str, raw: &'a RawValue) -> Self {
        let path = if self.path.is_empty() {
            name.into()
        } else {
            format!("{}.{name}", self.path)
        };
        Self { raw, path, ..*self }
    }

    /// Returns a member that may be missing.
    pub(super) fn optional(&self, name: &str, like: &str) -> Result<Option<Self>, SiteError> {
        let members = self.members(like)?;
        let found = members.iter().find(|(other, _)| other == name);
        Ok(found.map(|(_, raw)| self.member(name, raw)))
    }

    /// Returns a member of an object; `like` is an example of the object.
    pub(super) fn required(&self, name: &str, like: &str) -> Result<Self, SiteError> {
        let members = self.members(like)?;
        let found = members.iter().find(|(other, _)| other == name);
        found.map_or_else(
            || {
                let names = suggest::list(members.iter().map(|(name, _)| name.as_str()));
                let has = if names.is_empty() { "nothing" } else { &names };
                let message = format!("`{name}` is missing from {}, which has {has}", self.title());
                Err(self
                    .error(message)
                    .expected(format!("`{name}`"))
                    .help(format!("write it like {like}")))
            },
            |(_, raw)| Ok(self.member(name, raw)),
        )
    }

    /// Returns the elements of a list.
    pub(super) fn list(&self, like: &str) -> Result<Vec<Self>, SiteError> {
        let Ok(elements) = serde_json::from_str::<Vec<&'a RawValue>>(self.raw.get()) else {
            return Err(self.found("a list", like));
        };
        let elements = elements.into_iter().enumerate().map(|(index, raw)| Self {
            raw,
            path: format!("{}[{index}]", self.path),
            ..*self
        });
        Ok(elements.collect())
    }

    /// Returns a finite number.
    pub(super) fn number(&self) -> Result<f64, SiteError> {
        match serde_json::from_str::<f64>(self.raw.get()) {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.found("a finite number", "4.25, without quotes")),
        }
    }

    /// Returns a truth value.
    pub(super) fn truth(&self) -> Result<bool, SiteError> {
        serde_json::from_str(self.raw.get())
            .map_err(|_| self.found("true or false", "true, without quotes"))
    }

    /// Returns a text.
    pub(super) fn text(&self, like: &str) -> Result<&'a str, SiteError> {
        serde_json::from_str(self.raw.get())
            .map_err(|_| self.found("a text in quotes, without escapes", like))
    }

    /// Returns a whole number.
    pub(super) fn whole(&self) -> Result<u32, SiteError> {
        serde_json::from_str(self.raw.get())
            .map_err(|_| self.found("a whole number from 0 to 4294967295", "7"))
    }
}
