//! Entries of a site file that other entries refer to by name.

use std::collections::BTreeMap;

use super::error::SiteError;
use super::places::SiteModel;
use super::reader::Node;
use super::{SiteCamera, SiteTag, suggest};
use posegate::shape::{PoseDeg, Wall};

/// The entries that a success set can refer to by name.
pub(super) struct Names<'a> {
    /// Subtracted from every position in the map, metres; the entries below have it subtracted.
    pub origin: [f64; 2],
    pub cameras: &'a BTreeMap<String, SiteCamera>,
    pub tags: &'a BTreeMap<String, SiteTag>,
    pub walls: &'a BTreeMap<String, Wall>,
    pub error_models: &'a BTreeMap<String, SiteModel>,
    pub goals: &'a BTreeMap<String, PoseDeg>,
}

/// Returns the entry that a name refers to.
pub(super) fn named<'m, T>(
    node: &Node<'_>,
    what: &str,
    known: &'m BTreeMap<String, T>,
) -> Result<&'m T, SiteError> {
    let name = node.text()?;
    known.get(name).ok_or_else(|| {
        let error = node.error(format!("there is no {what} `{name}`"));
        match suggest::similar(name, known.keys().map(String::as_str)) {
            Some(similar) => error.help(format!("did you mean `{similar}`?")),
            None => error.help(format!("add a table [{what}.{name}]")),
        }
    })
}
