//! Tables as in a site file: `[tag.NAME]` and `[goal.NAME]`. Tasks are not read.

use toml::de::DeTable;

use super::Placed;
use crate::error::{SiteError, Source};
use crate::reader::{Node, Table};
use crate::{SiteTag, keys, poses, syntax, tags};
use posegate::shape::PoseDeg;

type Named<T> = Vec<(String, Placed<T>)>;
/// Tags, goals, and `true` if the file has tasks.
type Found = (Named<SiteTag>, Named<PoseDeg>, bool);

pub(super) fn read(source: Source<'_>) -> Result<Found, SiteError> {
    let document = DeTable::parse(source.text).map_err(|fault| syntax::syntax(source, &fault))?;
    let root = Table::root(source, &document);
    root.refuse_unknown(&[&keys::TAGS, &keys::GOALS, &keys::TASKS])?;
    let mut tags = Vec::new();
    if let Some(node) = root.optional(&keys::TAGS) {
        for (name, node) in node.any_table()?.named(&keys::TAG)? {
            tags.push((name.to_owned(), placed(&node, tags::tag(&node)?)));
        }
    }
    let mut goals = Vec::new();
    if let Some(node) = root.optional(&keys::GOALS) {
        for (name, node) in node.any_table()?.named(&keys::ONE_GOAL)? {
            goals.push((name.to_owned(), placed(&node, poses::pose2(&node)?)));
        }
    }
    Ok((tags, goals, root.has(keys::TASKS.name)))
}

fn placed<T>(node: &Node<'_>, value: T) -> Placed<T> {
    Placed {
        at: node.span(),
        value,
    }
}
