//! Places where tags could be mounted, from TOML.

use std::collections::BTreeMap;

use super::error::SiteError;
use super::reader::{Node, Table, name_fault};
use super::{Candidate, SiteTag, keys, places, poses, row};
use posegate::shape::{Tag, Tolerance, Wall};

/// Returns the candidates of `[candidate.NAME]` and `[candidates.NAME]` tables, by name. Rows are on the sides of the
/// walls where `goals` are.
pub(super) fn candidates(
    root: &Table<'_>,
    [east, north]: [f64; 2],
    tags: &BTreeMap<String, SiteTag>,
    walls: &BTreeMap<String, Wall>,
    goals: &[[f64; 2]],
) -> Result<BTreeMap<String, Candidate>, SiteError> {
    let mut all = Candidates::new(tags);
    if let Some(node) = root.optional(&keys::CANDIDATES) {
        for (name, node) in node.any_table()?.named(&keys::CANDIDATE)? {
            let mut made = candidate(&node)?;
            let pose = &mut made.tag.tag.pose;
            (pose.x, pose.y) = (pose.x - east, pose.y - north);
            all.add(name.to_owned(), made, &node)?;
        }
    }
    if let Some(node) = root.optional(&keys::ROWS) {
        for (name, node) in node.any_table()?.named(&keys::ROW)? {
            for (name, made) in row::row(name, &node, walls, goals)? {
                if let Some(fault) = name_fault(&name) {
                    return Err(node
                        .error(format!("the candidate's name `{name}` {fault}"))
                        .help("give the row a shorter name"));
                }
                all.add(name, made, &node)?;
            }
        }
    }
    Ok(all.found)
}

/// Candidates with different names, and different numbers in a family.
struct Candidates<'a> {
    tags: &'a BTreeMap<String, SiteTag>,
    found: BTreeMap<String, Candidate>,
    /// The owner of each number, by family and number.
    taken: BTreeMap<(String, u32), String>,
}

impl<'a> Candidates<'a> {
    fn new(tags: &'a BTreeMap<String, SiteTag>) -> Self {
        let taken = tags.iter().map(|(name, tag)| {
            let number = (tag.family.clone(), tag.tag.id);
            (number, format!("tag `{name}`"))
        });
        Self {
            tags,
            found: BTreeMap::new(),
            taken: taken.collect(),
        }
    }

    fn add(&mut self, name: String, made: Candidate, node: &Node<'_>) -> Result<(), SiteError> {
        if self.tags.contains_key(&name) {
            return Err(node
                .error(format!("the candidate `{name}` has the name of a tag"))
                .expected("a name of its own: a chosen candidate becomes a tag")
                .help("give it another name, or remove it if the tag is already there"));
        }
        if self.found.contains_key(&name) {
            return Err(node
                .error(format!("two candidates have the name `{name}`"))
                .expected("a name of its own")
                .help("rename the candidate or the row: the candidates of a row `r` are `r-1`, `r-2`, ..."));
        }
        if let Some(id) = made.id {
            let number = (made.tag.family.clone(), id);
            if let Some(other) = self.taken.get(&number) {
                return Err(node
                    .error(format!(
                        "the candidate `{name}` has the number {id} of {other}: a detector cannot distinguish them"
                    ))
                    .expected("a number of its own in its family")
                    .help("leave out `id`: a chosen candidate gets a free number"));
            }
            self.taken.insert(number, format!("candidate `{name}`"));
        }
        self.found.insert(name, made);
        Ok(())
    }
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
                pose: poses::pose3(&table.required(&keys::POSE)?)?,
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
