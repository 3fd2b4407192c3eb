//! Success sets from TOML.

use std::collections::BTreeMap;
use std::format;
use std::string::String;
use std::vec::Vec;

use super::error::SiteError;
use super::reader::Node;
use super::{Site, SiteCamera, SiteTag, keys, suggest};
use crate::shape::{BoxSet, Footprint, PolygonError, Shape, Visibility, is_arc};

/// Keys of a success set that are documented but not read yet.
const LATER: [&str; 2] = ["any", "all"];

pub(super) fn shape(
    node: &Node<'_>,
    cameras: &BTreeMap<String, SiteCamera>,
    tags: &BTreeMap<String, SiteTag>,
) -> Result<Shape, SiteError> {
    let table = node.any_table()?;
    table.refuse_later(&LATER, "a success set with a `shape`")?;
    let name = table.required(&keys::SHAPE)?;
    match name.text()? {
        "box" => box_set(node).map(Shape::Box),
        "footprint" => footprint(node).map(Shape::Footprint),
        "visibility" => visibility(node, cameras, tags).map(Shape::Visibility),
        "clear" => Err(name.error("`shape = \"clear\"` is not supported by this version")),
        _ => Err(name.unknown_word(["box", "footprint", "visibility"])),
    }
}

fn box_set(node: &Node<'_>) -> Result<BoxSet, SiteError> {
    let table = node.table(
        &[&keys::SHAPE, &keys::BOX_X, &keys::BOX_Y, &keys::BOX_YAW],
        &[],
    )?;
    Ok(BoxSet {
        x: table.interval(&keys::BOX_X, |lo, hi| lo <= hi)?,
        y: table.interval(&keys::BOX_Y, |lo, hi| lo <= hi)?,
        yaw_deg: table.interval(&keys::BOX_YAW, |lo, hi| lo <= hi && is_arc([lo, hi]))?,
    })
}

fn footprint(node: &Node<'_>) -> Result<Footprint, SiteError> {
    let table = node.table(&[&keys::SHAPE, &keys::FOOTPRINT, &keys::REGION], &[])?;
    let footprint = table.required(&keys::FOOTPRINT)?;
    let outline = corners(&footprint)?;
    Footprint::check_footprint(&outline).map_err(|fault| polygon(&footprint, fault))?;
    let region = table.required(&keys::REGION)?;
    let bounds = corners(&region)?;
    Footprint::new(outline, bounds).map_err(|fault| polygon(&region, fault))
}

fn corners(node: &Node<'_>) -> Result<Vec<[f64; 2]>, SiteError> {
    node.array()?.iter().map(Node::pair).collect()
}

fn polygon(node: &Node<'_>, fault: PolygonError) -> SiteError {
    let error = node.error(format!("`{}`: {fault}", node.path()));
    match fault {
        PolygonError::Clockwise => error.help("reverse the order of the corners"),
        PolygonError::NotConvex => error.help(
            "list each corner of the convex outline once, counter-clockwise; leave out corners \
             that lie on a straight edge",
        ),
        _ => error,
    }
}

fn visibility(
    node: &Node<'_>,
    cameras: &BTreeMap<String, SiteCamera>,
    tags: &BTreeMap<String, SiteTag>,
) -> Result<Visibility, SiteError> {
    let table = node.table(
        &[
            &keys::SHAPE,
            &keys::SEEN_BY,
            &keys::SEEN_TAG,
            &keys::D_MAX,
            &keys::PHI_MAX,
            &keys::PSI_MAX,
            &keys::Z_NEAR,
        ],
        &["psi_min_deg", "d_min", "border_px"],
    )?;
    let seen_by = table.required(&keys::SEEN_BY)?;
    let camera = named(&seen_by, "camera", cameras)?;
    if !camera.camera.is_whole_pinhole() {
        // The slacks are those of a whole pinhole image: a lens or a border would not be looked at.
        return Err(seen_by
            .error("a tag seen through a lens, or without the image's border, is not supported by this version")
            .help("name a camera that is a pinhole and has no `border_px`"));
    }
    let tag = named(&table.required(&keys::SEEN_TAG)?, "tag", tags)?;
    Ok(Visibility {
        camera: camera.camera,
        mount: camera.mount,
        tag: tag.tag,
        d_max: table.number(&keys::D_MAX)?,
        phi_max_deg: table.number(&keys::PHI_MAX)?,
        psi_max_deg: table.number(&keys::PSI_MAX)?,
        z_near: match table.optional(&keys::Z_NEAR) {
            Some(node) => node.number()?,
            None => Site::DEFAULT_Z_NEAR,
        },
    })
}

/// What a name refers to.
fn named<'m, T>(
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
