//! Tables as in a site file: `[tag.NAME]` and `[goal.NAME]`.

use toml::de::DeTable;

use super::Placed;
use crate::site::error::{SiteError, Source};
use crate::site::reader::{Node, Table};
use crate::site::{SiteTag, keys, poses, syntax, tags};
use posegate::shape::PoseDeg;

type Named<T> = Vec<(String, Placed<T>)>;

pub(super) fn read(source: Source<'_>) -> Result<(Named<SiteTag>, Named<PoseDeg>), SiteError> {
    let document = DeTable::parse(source.text).map_err(|fault| syntax::syntax(source, &fault))?;
    let root = Table::root(source, &document);
    root.refuse_unknown(&[&keys::TAGS, &keys::GOALS])?;
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
    Ok((tags, goals))
}

fn placed<T>(node: &Node<'_>, value: T) -> Placed<T> {
    Placed {
        at: node.span(),
        value,
    }
}
