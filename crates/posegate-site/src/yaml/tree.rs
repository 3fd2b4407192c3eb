//! The values of a YAML text, each with its position.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use std::rc::Rc;

use granit_parser::{ErrorKind, Event, Parser, ScalarStyle, ScanError, Span, options};

use super::{Document, TABS};
use crate::error::{SiteError, Source};

/// The most values of a file. An alias counts as all values that it names, because readers follow it.
pub(super) const MAX_VALUES: usize = 250_000;
/// The most bytes of all texts of a file. An alias counts as the texts that it names.
const MAX_TEXT: usize = 64 << 20;
/// The most lists and maps inside one another.
pub(super) const MAX_DEPTH: usize = 64;
const NESTS: &str = "the file nests too deep";

/// A value with its position in the text.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Bytes of the text. An alias has a position of its own.
    pub at: Range<usize>,
    pub value: Rc<Value>,
}

#[derive(Debug)]
pub(crate) enum Value {
    Scalar {
        text: String,
        /// Without quotes: an empty text is no value.
        is_plain: bool,
    },
    List(Vec<Node>),
    Map(Vec<Entry>),
}

#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub key: Rc<str>,
    /// Bytes of the key in the text.
    pub key_at: Range<usize>,
    pub node: Node,
}

impl Value {
    /// Returns `true` for no value, `~` and `null`.
    pub(super) fn is_null(&self) -> bool {
        matches!(self, Self::Scalar { text, is_plain: true } if matches!(text.as_str(), "" | "~" | "null" | "Null" | "NULL"))
    }
}

/// The size of a value with everything that is in it.
#[derive(Clone, Copy, Default)]
struct Size {
    values: usize,
    /// Bytes of all texts.
    text: usize,
    /// How many lists and maps are inside one another.
    depth: usize,
}

/// Returns the value of a text with one document. An empty text is a map without keys.
pub(super) fn parse(document: &Document<'_>) -> Result<Node, SiteError> {
    let options = options! {
        flow_nesting_limit: MAX_DEPTH,
        block_nesting_limit: MAX_DEPTH,
    };
    let mut tree = Tree::new(document);
    let text = without_directive(document.source.text);
    for event in Parser::new_from_str_with_options(&text, options) {
        let (event, span) = event.map_err(|fault| not_read(document, &fault))?;
        if document.messages.reads_first
            && tree.root.is_some()
            && matches!(event, Event::DocumentStart(..))
        {
            let rest = text.get(bytes(span).end..).unwrap_or_default();
            document.has_more.set(
                !rest
                    .trim_matches(['-', '.', ' ', '\t', '\r', '\n'])
                    .is_empty(),
            );
            break;
        }
        tree.take(event, bytes(span))?;
    }
    Ok(match tree.root {
        Some(node) if !node.value.is_null() => node,
        _ => Node {
            at: 0..0,
            value: Rc::new(Value::Map(Vec::new())),
        },
    })
}

/// Returns the text with the directive of its first line as a comment: OpenCV writes `%YAML:1.0`, which YAML does not know, and old versions write no `---`
/// after it.
fn without_directive(text: &str) -> Cow<'_, str> {
    let bare = text.trim_start_matches('\u{feff}');
    match bare.strip_prefix("%YAML") {
        Some(rest) => {
            let mark = text.get(..text.len() - bare.len()).unwrap_or_default();
            Cow::Owned(format!("{mark}#YAML{rest}"))
        }
        None => Cow::Borrowed(text),
    }
}

fn bytes(span: Span) -> Range<usize> {
    span.byte_range().unwrap_or(0..0)
}

fn not_read(document: &Document<'_>, fault: &ScanError) -> SiteError {
    let start = fault.marker().byte_offset().unwrap_or(0);
    let error = document.error(start..start, format!("not read: {}", fault.info()));
    match fault.kind() {
        ErrorKind::RecursionLimitExceeded => too_large(document.error(start..start, NESTS)),
        ErrorKind::TabNotAllowed
        | ErrorKind::TabInBlockIndentation
        | ErrorKind::TabAtBlockScalarStart
        | ErrorKind::TabInIndentation
        | ErrorKind::TabInPlainScalar => error.expected("spaces").help(TABS),
        _ => error
            .expected(document.messages.what)
            .help(document.messages.written),
    }
}

/// Returns the beginning of a name of any length.
fn short(name: &str) -> String {
    name.chars().take(40).collect()
}

pub(super) fn too_large(error: SiteError) -> SiteError {
    error
        .expected(format!(
            "at most {MAX_VALUES} values, nested at most {MAX_DEPTH} deep"
        ))
        .help("check that it is the file that is meant; cut a large map into several files")
}

/// A list or a map whose end has not been read yet.
struct Open {
    at: Range<usize>,
    anchor: usize,
    /// Of what has been read of it.
    size: Size,
    content: Content,
}

enum Content {
    List(Vec<Node>),
    Map {
        entries: Vec<Entry>,
        /// Where each key is, to refuse a second one.
        keys: Keys,
        /// Values of merge keys.
        merged: Vec<Node>,
        /// The key whose value comes next.
        key: Option<(Rc<str>, Range<usize>, bool)>,
    },
}

/// The first byte of each key of a map.
type Keys = BTreeMap<Rc<str>, usize>;

struct Tree<'a> {
    document: &'a Document<'a>,
    root: Option<Node>,
    open: Vec<Open>,
    /// Values that an alias may name.
    anchors: BTreeMap<usize, (Rc<Value>, Size)>,
    /// Of what has been read of the file.
    size: Size,
}

impl<'a> Tree<'a> {
    fn new(document: &'a Document<'a>) -> Self {
        Self {
            document,
            root: None,
            open: Vec::new(),
            anchors: BTreeMap::new(),
            size: Size::default(),
        }
    }

    fn take(&mut self, event: Event<'_>, at: Range<usize>) -> Result<(), SiteError> {
        self.check_tag(&event, &at)?;
        match event {
            Event::DocumentStart(..) if self.root.is_some() => Err(self
                .document
                .error(at, "the file has several documents")
                .expected("one document")
                .help("remove what begins with the second `---`")),
            Event::Scalar(text, style, anchor, _) => {
                let size = Size {
                    values: 1,
                    text: text.len(),
                    depth: 0,
                };
                let value = Value::Scalar {
                    text: text.into_owned(),
                    is_plain: style == ScalarStyle::Plain,
                };
                self.charge(&at, size)?;
                self.add(at, anchor, size, value)
            }
            Event::SequenceStart(_, anchor, _) => self.begin(at, anchor, Content::List(Vec::new())),
            Event::MappingStart(_, anchor, _) => {
                let content = Content::Map {
                    entries: Vec::new(),
                    keys: BTreeMap::new(),
                    merged: Vec::new(),
                    key: None,
                };
                self.begin(at, anchor, content)
            }
            Event::SequenceEnd | Event::MappingEnd => self.end(),
            Event::Alias(anchor) => {
                let Some((value, size)) = self.anchors.get(&anchor).cloned() else {
                    return Err(self
                        .document
                        .error(at, "the alias is inside the value that it names")
                        .expected("an alias of a value that ends before it")
                        .help("write the value out"));
                };
                self.charge(&at, size)?;
                self.place(Node { at, value }, size)
            }
            _ => Ok(()),
        }
    }

    /// Refuses a tag, because it may change a value, as `!degrees` does. Allows OpenCV's `!!opencv-matrix` on a map, which adds nothing to
    /// the map's keys, and `!!merge` on a merge key.
    fn check_tag(&self, event: &Event<'_>, at: &Range<usize>) -> Result<(), SiteError> {
        let Some(tag) = event.tag() else {
            return Ok(());
        };
        let name = tag.original();
        let is_harmless = match event {
            Event::MappingStart(..) => name == "!!opencv-matrix",
            Event::Scalar(text, ScalarStyle::Plain, ..) => text == "<<" && name == "!!merge",
            _ => false,
        };
        if is_harmless {
            return Ok(());
        }
        Err(self
            .document
            .error(
                at.clone(),
                format!("the value has the tag `{}`", short(&name)),
            )
            .expected("a value without a tag")
            .help("remove the tag, and write the value as it is meant"))
    }

    /// Adds a value to the size of the file, and refuses a file that is too large.
    fn charge(&mut self, at: &Range<usize>, size: Size) -> Result<(), SiteError> {
        self.size.values = self.size.values.saturating_add(size.values);
        self.size.text = self.size.text.saturating_add(size.text);
        let message = if self.size.values > MAX_VALUES {
            "the file has too many values"
        } else if self.size.text > MAX_TEXT {
            "the file has too long texts"
        } else {
            return Ok(());
        };
        Err(too_large(self.document.error(at.clone(), message)))
    }

    fn begin(
        &mut self,
        at: Range<usize>,
        anchor: usize,
        content: Content,
    ) -> Result<(), SiteError> {
        let size = Size {
            values: 1,
            ..Size::default()
        };
        self.charge(&at, size)?;
        self.open.push(Open {
            at,
            anchor,
            size,
            content,
        });
        Ok(())
    }

    fn end(&mut self) -> Result<(), SiteError> {
        let Some(open) = self.open.pop() else {
            return Ok(());
        };
        let value = match open.content {
            Content::List(nodes) => Value::List(nodes),
            Content::Map {
                mut entries,
                mut keys,
                merged,
                ..
            } => {
                for node in merged {
                    self.merge(&node, &mut entries, &mut keys)?;
                }
                Value::Map(entries)
            }
        };
        let size = Size {
            depth: open.size.depth + 1,
            ..open.size
        };
        self.add(open.at, open.anchor, size, value)
    }

    /// Remembers a value if it has an anchor, and places it.
    fn add(
        &mut self,
        at: Range<usize>,
        anchor: usize,
        size: Size,
        value: Value,
    ) -> Result<(), SiteError> {
        if size.depth > MAX_DEPTH {
            return Err(too_large(self.document.error(at, NESTS)));
        }
        let value = Rc::new(value);
        // The parser gives the number 0 to values without an anchor.
        if anchor != 0 {
            self.anchors.insert(anchor, (Rc::clone(&value), size));
        }
        self.place(Node { at, value }, size)
    }

    /// Puts a value into the list or map that is open, as its next key or value.
    fn place(&mut self, node: Node, size: Size) -> Result<(), SiteError> {
        let source: Source<'a> = self.document.source;
        let Some(open) = self.open.last_mut() else {
            self.root = Some(node);
            return Ok(());
        };
        open.size = Size {
            values: open.size.values.saturating_add(size.values),
            text: open.size.text.saturating_add(size.text),
            depth: open.size.depth.max(size.depth),
        };
        match &mut open.content {
            Content::List(nodes) => nodes.push(node),
            Content::Map {
                entries,
                keys,
                merged,
                key,
            } => match key.take() {
                None => {
                    let (text, is_plain) = match &*node.value {
                        Value::Scalar { text, is_plain } if !node.value.is_null() => {
                            (text, *is_plain)
                        }
                        _ => {
                            return Err(source
                                .error(node.at, "a key is empty, a list or a map")
                                .expected("a text as key")
                                .help(self.document.messages.written));
                        }
                    };
                    let is_merge = is_plain && text == "<<";
                    *key = Some((text.as_str().into(), node.at, is_merge));
                }
                Some((_, _, true)) => merged.push(node),
                Some((key, key_at, false)) => {
                    if let Some(first) = keys.insert(Rc::clone(&key), key_at.start) {
                        return Err(self.document.twice(key_at, first));
                    }
                    entries.push(Entry { key, key_at, node });
                }
            },
        }
        Ok(())
    }

    /// Adds the entries of a map, or of a list of maps, whose keys are not there yet. [`Tree::charge`] has counted them where the value of
    /// the merge key is.
    fn merge(
        &self,
        node: &Node,
        entries: &mut Vec<Entry>,
        keys: &mut Keys,
    ) -> Result<(), SiteError> {
        let single = std::slice::from_ref(node);
        let maps = match &*node.value {
            Value::List(maps) => maps.as_slice(),
            _ => single,
        };
        for map in maps {
            let Value::Map(more) = &*map.value else {
                return Err(self
                    .document
                    .error(node.at.clone(), "`<<` has a value that is not a map")
                    .expected("a map, or a list of maps")
                    .help("write `<<: *NAME`, where `&NAME` stands before a map"));
            };
            for entry in more {
                if !keys.contains_key(&entry.key) {
                    keys.insert(Rc::clone(&entry.key), entry.key_at.start);
                    entries.push(entry.clone());
                }
            }
        }
        Ok(())
    }
}
