//! Typed access to parsed TOML that keeps the position of every value in the file.

use std::borrow::Cow;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

use super::error::{SiteError, Source};
use super::suggest;

/// Integers up to this magnitude are exact as `f64`.
const EXACT_INTEGERS: u64 = 1 << 53;

/// A key of the site file: its name, the meaning of its value, and an example.
#[derive(Debug)]
pub(super) struct Key {
    pub(super) name: &'static str,
    /// The expected value, with its unit: completes "expected ...".
    pub(super) what: &'static str,
    /// An example value.
    pub(super) like: &'static str,
    /// Returns `true` for allowed (finite) numbers, if the value is a number.
    pub(super) allows: fn(f64) -> bool,
}

impl Key {
    /// Returns a key with any value, or any finite number.
    pub(super) const fn new(name: &'static str, what: &'static str, like: &'static str) -> Self {
        Self::number(name, what, like, |_| true)
    }

    /// Returns a key with a number in a range.
    pub(super) const fn number(
        name: &'static str,
        what: &'static str,
        like: &'static str,
        allows: fn(f64) -> bool,
    ) -> Self {
        Self {
            name,
            what,
            like,
            allows,
        }
    }

    fn example(&self) -> Box<str> {
        format!("write it like `{} = {}`", self.name, self.like).into()
    }
}

/// A value with its position in the file, the key that it was read for and its full name.
#[derive(Clone)]
pub(super) struct Node<'a> {
    source: Source<'a>,
    key: &'static Key,
    path: String,
    value: &'a Spanned<DeValue<'a>>,
}

impl<'a> Node<'a> {
    /// Returns an error at this value. It states the expected value and an example.
    pub(super) fn error(&self, message: impl Into<Box<str>>) -> SiteError {
        self.source
            .error(self.value.span(), message)
            .expected(self.key.what)
            .help(self.key.example())
    }

    fn found(&self) -> SiteError {
        let found: Cow<'static, str> = match self.value.get_ref() {
            DeValue::String(_) => "a string".into(),
            DeValue::Integer(_) => "a whole number".into(),
            DeValue::Float(_) => "a number with a fraction".into(),
            DeValue::Boolean(value) => format!("`{value}`").into(),
            DeValue::Datetime(_) => "a date or time".into(),
            DeValue::Array(values) => format!("an array of {}", values.len()).into(),
            DeValue::Table(_) => "a table".into(),
        };
        self.error(format!("`{}` is {found}", self.path))
    }

    /// Returns an error at a string that is not one of the known words.
    pub(super) fn unknown_word<const N: usize>(&self, known: [&str; N]) -> SiteError {
        let word = self.text().unwrap_or_default();
        let error = self.error(format!("`{}` is {}", self.path, self.quote()));
        match suggest::similar(word, known.into_iter()) {
            Some(similar) => error.help(format!("did you mean \"{similar}\"?")),
            None => error,
        }
    }

    /// Returns the name of the file that contains the value.
    pub(super) fn file(&self) -> &'a str {
        self.source.file
    }

    /// Returns the value's range in the text, bytes.
    pub(super) fn span(&self) -> Range<usize> {
        self.value.span()
    }

    /// Returns `true` if the value is a string.
    pub(super) fn is_text(&self) -> bool {
        matches!(self.value.get_ref(), DeValue::String(_))
    }

    /// Returns `true` if the value is a table. (Testing for an error of [`Node::any_table`] instead is
    /// slow: creating an error reads all text before it.)
    pub(super) fn is_table(&self) -> bool {
        matches!(self.value.get_ref(), DeValue::Table(_))
    }

    /// Returns the value's full name.
    pub(super) fn path(&self) -> &str {
        &self.path
    }

    /// Returns the value's source text, shortened to a part of one line.
    fn quote(&self) -> String {
        self.source.quote(self.value.span())
    }

    /// Returns the value's complete source text, which may have several lines.
    pub(super) fn written(&self) -> &'a str {
        self.source.text.get(self.value.span()).unwrap_or_default()
    }

    /// Returns a finite number that the key allows.
    pub(super) fn number(&self) -> Result<f64, SiteError> {
        let number = match self.value.get_ref() {
            DeValue::Integer(digits) => match i64_of(digits) {
                Some(whole) if whole.unsigned_abs() <= EXACT_INTEGERS => whole as f64,
                _ => return Err(self.out_of_range()),
            },
            DeValue::Float(digits) => digits.as_str().parse().unwrap_or(f64::NAN),
            _ => return Err(self.found()),
        };
        if !number.is_finite() {
            return Err(self.error(format!(
                "`{}` is {}, which is not a finite number",
                self.path,
                self.quote()
            )));
        }
        if !(self.key.allows)(number) {
            return Err(self.out_of_range());
        }
        Ok(number)
    }

    /// Returns a whole number, written without a fraction, in a range.
    pub(super) fn whole(&self, range: std::ops::RangeInclusive<u32>) -> Result<u32, SiteError> {
        match self.value.get_ref() {
            DeValue::Integer(digits) => i64_of(digits)
                .and_then(|whole| u32::try_from(whole).ok())
                .filter(|whole| range.contains(whole))
                .ok_or_else(|| self.out_of_range()),
            _ => Err(self.found()),
        }
    }

    /// Returns an error at a value that is out of range.
    pub(super) fn out_of_range(&self) -> SiteError {
        self.error(format!("`{}` is {}", self.path, self.quote()))
    }

    /// Returns a string.
    pub(super) fn text(&self) -> Result<&'a str, SiteError> {
        match self.value.get_ref() {
            DeValue::String(text) => Ok(text),
            _ => Err(self.found()),
        }
    }

    /// Returns what the string stands for among words with their meanings.
    pub(super) fn among<T: Copy, const N: usize>(
        &self,
        all: [(&str, T); N],
    ) -> Result<T, SiteError> {
        let word = self.text()?;
        let found = all.into_iter().find(|(known, _)| *known == word);
        found.map_or_else(
            || Err(self.unknown_word(all.map(|(known, _)| known))),
            |(_, meaning)| Ok(meaning),
        )
    }

    /// Returns the elements of an array, under the same key.
    pub(super) fn array(&self) -> Result<Vec<Node<'a>>, SiteError> {
        let DeValue::Array(values) = self.value.get_ref() else {
            return Err(self.found());
        };
        let nodes = values.iter().enumerate().map(|(index, value)| Node {
            path: format!("{}[{index}]", self.path),
            value,
            ..self.clone()
        });
        Ok(nodes.collect())
    }

    /// Returns exactly two numbers.
    pub(super) fn pair(&self) -> Result<[f64; 2], SiteError> {
        match self.array()?.as_slice() {
            [first, second] => Ok([first.number()?, second.number()?]),
            _ => Err(self.found()),
        }
    }

    /// Returns a table that has only known keys.
    pub(super) fn table(&self, known: &[&'static Key]) -> Result<Table<'a>, SiteError> {
        let table = self.any_table()?;
        table.refuse_unknown(known)?;
        Ok(table)
    }

    /// Returns a table without checking its keys.
    pub(super) fn any_table(&self) -> Result<Table<'a>, SiteError> {
        let DeValue::Table(entries) = self.value.get_ref() else {
            return Err(self.found());
        };
        Ok(Table {
            source: self.source,
            path: self.path.clone(),
            span: self.value.span(),
            entries,
        })
    }
}

fn i64_of(digits: &DeInteger<'_>) -> Option<i64> {
    i64::from_str_radix(digits.as_str(), digits.radix()).ok()
}

/// A table with its position in the file.
pub(super) struct Table<'a> {
    source: Source<'a>,
    path: String,
    span: Range<usize>,
    entries: &'a DeTable<'a>,
}

impl<'a> Table<'a> {
    /// Returns the table of the whole file.
    pub(super) fn root(source: Source<'a>, root: &'a Spanned<DeTable<'a>>) -> Self {
        Self {
            source,
            path: String::new(),
            span: root.span(),
            entries: root.get_ref(),
        }
    }

    /// Returns an error at the header of this table.
    pub(super) fn error(&self, message: impl Into<Box<str>>) -> SiteError {
        self.source.error(self.span.clone(), message)
    }

    /// Returns an error at one of this table's keys, or at the table's header if the key is missing.
    pub(super) fn error_at_key(&self, name: &str, message: impl Into<Box<str>>) -> SiteError {
        let span = self
            .entries
            .get_key_value(name)
            .map_or_else(|| self.span.clone(), |(key, _)| key.span());
        self.source.error(span, message)
    }

    /// Returns the table's name as in its header, or `the site file` for the root.
    pub(super) fn title(&self) -> String {
        if self.path.is_empty() {
            "the site file".into()
        } else {
            format!("`{}`", self.path)
        }
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.entries.contains_key(name)
    }

    pub(super) fn optional(&self, key: &'static Key) -> Option<Node<'a>> {
        self.entries
            .get(key.name)
            .map(|value| self.node(key, key.name, value))
    }

    pub(super) fn required(&self, key: &'static Key) -> Result<Node<'a>, SiteError> {
        self.optional(key).ok_or_else(|| {
            self.error(format!("`{}` is missing from {}", key.name, self.title()))
                .expected(key.what)
                .help(format!("add `{} = {}`", key.name, key.like))
        })
    }

    pub(super) fn number(&self, key: &'static Key) -> Result<f64, SiteError> {
        self.required(key)?.number()
    }

    /// Returns an interval `[lo, hi]` that `allows` accepts.
    pub(super) fn interval(
        &self,
        key: &'static Key,
        allows: fn(f64, f64) -> bool,
    ) -> Result<[f64; 2], SiteError> {
        let node = self.required(key)?;
        let [lo, hi] = node.pair()?;
        if allows(lo, hi) {
            Ok([lo, hi])
        } else {
            Err(node.error(format!("`{}` is {}", node.path, node.quote())))
        }
    }

    /// Returns the entries of a table whose keys are user-defined names, in the file's order.
    pub(super) fn named(&self, key: &'static Key) -> Result<Vec<(&'a str, Node<'a>)>, SiteError> {
        let mut entries: Vec<_> = self.entries.iter().collect();
        entries.sort_by_key(|(name, _)| name.span().start);
        entries
            .into_iter()
            .map(|(name, value)| {
                let text: &'a str = name.get_ref();
                let Some(fault) = name_fault(text) else {
                    return Ok((text, self.node(key, text, value)));
                };
                Err(self
                    .source
                    .error(name.span(), format!("a name in {} {fault}", self.title()))
                    .expected("a name of 1 to 32 bytes in UTF-8")
                    .help("choose a short name, like `dock`"))
            })
            .collect()
    }

    fn node(&self, key: &'static Key, name: &str, value: &'a Spanned<DeValue<'a>>) -> Node<'a> {
        let path = if self.path.is_empty() {
            name.into()
        } else {
            format!("{}.{name}", self.path)
        };
        Node {
            source: self.source,
            key,
            path,
            value,
        }
    }

    /// Refuses keys that are not in `known`.
    pub(super) fn refuse_unknown(&self, known: &[&'static Key]) -> Result<(), SiteError> {
        let unknown = self
            .entries
            .keys()
            .filter(|name| !known.iter().any(|key| key.name == name.get_ref()))
            .min_by_key(|name| name.span().start);
        let Some(unknown) = unknown else {
            return Ok(());
        };
        let name: &str = unknown.get_ref();
        let names = || known.iter().map(|key| key.name);
        let help = match unit_hint(name, known) {
            Some(hint) => hint,
            None => match suggest::similar(name, names()) {
                Some(similar) => format!("did you mean `{similar}`?"),
                None => format!("remove it; {} has {}", self.title(), suggest::list(names())),
            },
        };
        let error = self.source.error(
            unknown.span(),
            format!("unknown key `{name}` in {}", self.title()),
        );
        Err(error.expected(one_of(known)).help(help))
    }
}

/// Returns the fault of a text that cannot be a name of a camera, a tag, a task or the like; `None` if it can.
pub(super) fn name_fault(name: &str) -> Option<&'static str> {
    const LONGEST: usize = 32;
    if name.is_empty() {
        Some("is empty")
    } else if name.len() > LONGEST {
        Some("is longer than 32 bytes")
    } else if name.chars().any(char::is_control) {
        Some("has a control character")
    } else {
        None
    }
}

fn one_of(known: &[&'static Key]) -> String {
    format!("one of {}", suggest::list(known.iter().map(|key| key.name)))
}

/// Returns a hint for a key whose unit is missing or wrong.
fn unit_hint(name: &str, known: &[&'static Key]) -> Option<String> {
    let knows = |wanted: &str| known.iter().any(|key| key.name == wanted);
    let (stem, unit) = match name.rsplit_once('_') {
        Some((stem, unit @ ("m" | "mm" | "cm" | "deg" | "rad" | "px"))) => (stem, Some(unit)),
        _ => (name, None),
    };
    let degrees = format!("{stem}_deg");
    let pixels = format!("{stem}_px");
    if knows(&degrees) {
        let verb = if unit == Some("rad") {
            "not radians"
        } else {
            "the unit is missing"
        };
        return Some(format!(
            "{verb}: angles are written in degrees, in a key named `{degrees}`"
        ));
    }
    if knows(&pixels) {
        return Some(format!(
            "the unit is missing: pixels are written in a key named `{pixels}`"
        ));
    }
    (unit.is_some() && knows(stem)).then(|| {
        format!(
            "lengths are written in metres and focal lengths in pixels, in a key named `{stem}`"
        )
    })
}
