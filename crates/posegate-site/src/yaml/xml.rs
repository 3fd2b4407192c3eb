//! OpenCV's FileStorage in XML, as the values that the same file has in YAML: an element is a key, elements named `_` are a list, and
//! numbers with blanks between are one too.

use std::collections::BTreeMap;
use std::ops::Range;
use std::rc::Rc;

use quick_xml::Reader;
use quick_xml::events::Event;

use super::Document;
use super::tree::{Entry, MAX_DEPTH, MAX_VALUES, Node, Value, too_large};
use crate::error::SiteError;

const ROOT: &str = "opencv_storage";
/// The name of the elements of a list.
const ITEM: &str = "_";

/// An element whose end has not been read yet.
struct Open {
    name: Rc<str>,
    name_at: Range<usize>,
    /// The words of its text.
    words: Vec<Range<usize>>,
    inner: Vec<Entry>,
}

/// Returns the values in the root element.
pub(super) fn parse(document: &Document<'_>) -> Result<Node, SiteError> {
    let text = document.source.text;
    let bare = text.trim_start_matches('\u{feff}');
    let mark = text.len() - bare.len();
    let place = |position: u64| mark + usize::try_from(position).unwrap_or(bare.len());
    let fault = |at: Range<usize>, message: String| {
        let error = document.error(at, format!("not read: {message}"));
        error
            .expected(document.messages.what)
            .help(document.messages.written)
    };
    let mut reader = Reader::from_str(bare);
    let mut open: Vec<Open> = Vec::new();
    let mut values = 0usize;
    loop {
        let start = place(reader.buffer_position());
        let event = reader.read_event().map_err(|error| {
            let at = place(reader.error_position());
            fault(at..at, error.to_string())
        })?;
        let at = start..place(reader.buffer_position());
        let is_empty = matches!(event, Event::Empty(_));
        match event {
            Event::Start(_) | Event::Empty(_) => {
                let inside = text.get(at.start + 1..at.end).unwrap_or_default();
                let end = inside.find(|c: char| c.is_whitespace() || c == '/' || c == '>');
                let name = inside.get(..end.unwrap_or(0)).unwrap_or_default();
                let name_at = at.start + 1..at.start + 1 + name.len();
                if open.is_empty() && name != ROOT {
                    return Err(fault(name_at, format!("the XML is a <{name}>")));
                }
                open.push(Open {
                    name: name.into(),
                    name_at,
                    words: Vec::new(),
                    inner: Vec::new(),
                });
            }
            Event::Text(_) | Event::CData(_) | Event::GeneralRef(_) => {
                let Some(element) = open.last_mut() else {
                    continue;
                };
                let words = text.get(at.clone()).unwrap_or_default();
                for word in words.split_ascii_whitespace() {
                    // A word is a part of the text.
                    let start = word.as_ptr() as usize - text.as_ptr() as usize;
                    element.words.push(start..start + word.len());
                    values += 1;
                }
            }
            Event::Eof => {
                let (at, name) = match open.pop() {
                    Some(element) => (element.name_at, element.name),
                    None => (at, ROOT.into()),
                };
                return Err(fault(at, format!("<{name}> has no end")));
            }
            _ => {}
        }
        values += 1;
        if values > MAX_VALUES || open.len() > MAX_DEPTH {
            return Err(too_large(document.error(at, "the file is too large")));
        }
        if (is_empty || matches!(event, Event::End(_)))
            && let Some(element) = open.pop()
        {
            let (key, key_at) = (element.name.clone(), element.name_at.clone());
            let node = node(document, element, at.end)?;
            match open.last_mut() {
                Some(outer) => outer.inner.push(Entry { key, key_at, node }),
                None => {
                    let rest = text.get(at.end..).unwrap_or_default();
                    document.has_more.set(!rest.trim().is_empty());
                    return Ok(node);
                }
            }
        }
    }
}

/// Returns the value of an element that ends at a byte.
fn node(document: &Document<'_>, element: Open, end: usize) -> Result<Node, SiteError> {
    let text = document.source.text;
    let scalar = |at: &Range<usize>| {
        let word = text.get(at.clone()).unwrap_or_default();
        let bare = word
            .strip_prefix('"')
            .and_then(|word| word.strip_suffix('"'));
        Rc::new(Value::Scalar {
            text: bare.unwrap_or(word).to_owned(),
            is_plain: bare.is_none(),
        })
    };
    let at = element.name_at.start..end;
    if !element.inner.is_empty() {
        if let Some(word) = element.words.first() {
            return Err(document
                .error(word.clone(), "a text is beside elements")
                .expected("elements, or a text")
                .help(document.messages.written));
        }
        if element.inner.iter().all(|entry| &*entry.key == ITEM) {
            let items = element.inner.into_iter().map(|entry| entry.node);
            let value = Rc::new(Value::List(items.collect()));
            return Ok(Node { at, value });
        }
        let mut seen = BTreeMap::new();
        for entry in &element.inner {
            if let Some(first) = seen.insert(entry.key.clone(), entry.key_at.start) {
                return Err(document.twice(entry.key_at.clone(), first));
            }
        }
        let value = Rc::new(Value::Map(element.inner));
        return Ok(Node { at, value });
    }
    let is_number = |at: &Range<usize>| {
        let word = text.get(at.clone()).unwrap_or_default();
        word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
    };
    let words = element.words;
    let is_list = &*element.name == "data" || words.len() > 1 && words.iter().all(is_number);
    let all = match (words.first(), words.last()) {
        (Some(first), Some(last)) => first.start..last.end,
        _ => at.end..at.end,
    };
    let value = if is_list {
        let items = words.into_iter().map(|at| Node {
            value: scalar(&at),
            at,
        });
        Rc::new(Value::List(items.collect()))
    } else {
        scalar(&all)
    };
    Ok(Node { at: all, value })
}
