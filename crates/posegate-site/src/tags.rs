//! Tags from TOML.

use super::error::SiteError;
use super::reader::Node;
use super::{SiteTag, keys, places, poses};
use posegate::shape::{Tag, Tolerance};

/// Reads a tag.
pub(super) fn tag(node: &Node<'_>) -> Result<SiteTag, SiteError> {
    let table = node.table(&[
        &keys::ID,
        &keys::FAMILY,
        &keys::SIZE,
        &keys::POSE,
        &keys::TOLERANCE,
    ])?;
    let id = table.required(&keys::ID)?.whole(0..=u32::MAX)?;
    let family = table.required(&keys::FAMILY)?;
    let family_name = family.text()?;
    if family_name.is_empty() {
        return Err(family.error("the tag's family is empty"));
    }
    Ok(SiteTag {
        family: family_name.to_owned(),
        tag: Tag {
            id,
            size: table.number(&keys::SIZE)?,
            pose: poses::pose3(&table.required(&keys::POSE)?)?,
        },
        tolerance: match table.optional(&keys::TOLERANCE) {
            Some(node) => places::tolerance(&node)?,
            None => Tolerance::NONE,
        },
    })
}
