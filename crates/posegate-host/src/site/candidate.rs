//! Places where tags could be mounted, from TOML.

use std::collections::BTreeMap;

use super::error::SiteError;
use super::reader::{Node, Table};
use super::{Candidate, SiteTag, keys, parse, places};
use posegate::shape::{Tag, Tolerance};

pub(super) fn candidates(
    root: &Table<'_>,
    tags: &BTreeMap<String, SiteTag>,
) -> Result<BTreeMap<String, Candidate>, SiteError> {
    let mut found: BTreeMap<String, Candidate> = BTreeMap::new();
    let Some(node) = root.optional(&keys::CANDIDATES) else {
        return Ok(found);
    };
    let of = |family: &str, id: u32| (family.to_owned(), id);
    let mut taken: BTreeMap<(String, u32), String> = tags
        .iter()
        .map(|(name, tag)| (of(&tag.family, tag.tag.id), format!("tag `{name}`")))
        .collect();
    for (name, node) in node.any_table()?.named(&keys::CANDIDATE)? {
        if tags.contains_key(name) {
            return Err(node
                .error(format!("the candidate `{name}` has the name of a tag"))
                .expected("a name of its own: a chosen candidate becomes a tag")
                .help("give it another name, or remove it if the tag is already there"));
        }
        let made = candidate(&node)?;
        if let Some(id) = made.id {
            let number = of(&made.tag.family, id);
            if let Some(other) = taken.get(&number) {
                return Err(node
                    .error(format!(
                        "the candidate `{name}` has the number {id} of {other}: a detector cannot distinguish them"
                    ))
                    .expected("a number of its own in its family")
                    .help("leave out `id`: a chosen candidate gets a free number"));
            }
            taken.insert(number, format!("candidate `{name}`"));
        }
        found.insert(name.to_owned(), made);
    }
    Ok(found)
}

fn candidate(node: &Node<'_>) -> Result<Candidate, SiteError> {
    let table = node.table(&[
        &keys::ID,
        &keys::FAMILY,
        &keys::SIZE,
        &keys::POSE,
        &keys::TOLERANCE,
        &keys::CANDIDATE_COST,
    ])?;
    let id = match table.optional(&keys::ID) {
        Some(node) => Some(node.whole(0..=u32::MAX)?),
        None => None,
    };
    let family = table.required(&keys::FAMILY)?;
    if family.text()?.is_empty() {
        return Err(family.error("the tag's family is empty"));
    }
    Ok(Candidate {
        tag: SiteTag {
            family: family.text()?.to_owned(),
            tag: Tag {
                id: id.unwrap_or_default(),
                size: table.number(&keys::SIZE)?,
                pose: parse::pose3(&table.required(&keys::POSE)?)?,
            },
            tolerance: match table.optional(&keys::TOLERANCE) {
                Some(node) => places::tolerance(&node)?,
                None => Tolerance::NONE,
            },
        },
        id,
        cost: match table.optional(&keys::CANDIDATE_COST) {
            Some(node) => node.number()?,
            None => 1.0,
        },
    })
}
