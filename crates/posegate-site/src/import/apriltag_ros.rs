//! apriltag_ros's tags.yaml: bundles, each in its own frame, and single tags without a pose.

use std::ops::Range;

use super::place::{Frame, LENGTH_SLACK};
use super::{Placed, is_size};
use crate::error::{SiteError, Source};
use crate::suggest;
use crate::yaml::{Document, FormatMessages, Node};

const POSE_KEYS: [&str; 7] = ["x", "y", "z", "qw", "qx", "qy", "qz"];

const MESSAGES: FormatMessages = FormatMessages {
    what: "a tags.yaml of apriltag_ros",
    written: "write `tag_bundles: [ { name: dock, layout: [ {id: 7, size: 0.1, x: 0, y: 0, z: 0, qw: 1, qx: 0, qy: 0, \
              qz: 0} ] } ]`",
    numbers: "write numbers plainly, as 0.25 or 2.5e-01, and ids as whole numbers",
    not_finite: "measure the missing value, or remove the tag",
    length: "write lists in [ ]",
    reads_first: false,
};

const MEMBER: &str = "write `{id: 7, size: 0.1, x: 0, y: 0, z: 0, qw: 1, qx: 0, qy: 0, qz: 0}`: metres, the quaternion \
                      in the bundle's frame";

/// A tag's number and size, and its pose in its bundle.
pub(super) type Found = Placed<(u32, f64, Frame)>;

/// Returns the tags of one bundle, or a single tag. `part` is its name, needed if the file has
/// several.
pub(super) fn read(source: Source<'_>, part: Option<&str>) -> Result<Vec<Found>, SiteError> {
    let document = Document::new(source, &MESSAGES)?;
    let root = document.parse()?;
    let file = document.map(&root)?;
    let [bundles, singles] = ["tag_bundles", "standalone_tags"].map(|key| file.get(key));
    if bundles.is_none() && singles.is_none() {
        return Err(document
            .error(0..0, "the file has neither `tag_bundles` nor `standalone_tags`")
            .expected(MESSAGES.what)
            .help(
                "parameters of ROS 2's node (ids, frames, sizes) have no poses: write such tags as [tag.NAME] \
                 tables",
            ));
    }
    // All bundles are read, so a misspelt key is found in each of them.
    let member_keys = [&["id", "size"], &POSE_KEYS[..]].concat();
    let mut parts = Vec::new();
    for (index, node) in document.list_or_none(bundles)?.iter().enumerate() {
        let bundle = document.map(node)?;
        document.only_keys(bundle, &["name", "layout"])?;
        let name = match bundle.get("name") {
            Some(name) => document.text(name)?.to_owned(),
            None => format!("bundle_{index}"),
        };
        let members = bundle.get("layout").map(|layout| {
            let members = document.list(layout)?.iter();
            members
                .map(|node| Member::read(&document, node, &member_keys))
                .collect()
        });
        parts.push((
            name,
            Part {
                at: node.at.clone(),
                members: members.transpose()?,
            },
        ));
    }
    for node in document.list_or_none(singles)? {
        let member = Member::read(&document, node, &["id", "size", "name"])?;
        let id = document.required(
            member.id.as_ref(),
            node.at.clone(),
            "id",
            "write `{id: 7, size: 0.1, name: dock}`",
        )?;
        let name = match document.map(node)?.get("name") {
            Some(name) => document.text(name)?.to_owned(),
            None => format!("tag_{}", id.value),
        };
        parts.push((
            name,
            Part {
                at: node.at.clone(),
                members: Some(std::vec![member]),
            },
        ));
    }
    let part = chosen(&document, parts, part)?;
    let members = document.required(part.members, part.at, "layout", MESSAGES.written)?;
    members
        .into_iter()
        .map(|member| of_member(&document, member))
        .collect()
}

/// A bundle, or a single tag in the middle of its own frame.
struct Part {
    at: Range<usize>,
    members: Option<Vec<Member>>,
}

/// The numbers that the file states of a tag; `None` for each missing key.
struct Member {
    at: Range<usize>,
    id: Option<Placed<u32>>,
    size: Option<Placed<f64>>,
    /// The values of [`POSE_KEYS`], metres and parts of a quaternion.
    pose: [Option<Placed<f64>>; 7],
}

impl Member {
    fn read(document: &Document<'_>, node: &Node, known: &[&str]) -> Result<Self, SiteError> {
        let map = document.map(node)?;
        document.only_keys(map, known)?;
        let number = |key: &str| {
            let number = map.get(key).map(|node| {
                let value = document.number(node)?;
                let at = node.at.clone();
                Ok(Placed { at, value })
            });
            number.transpose()
        };
        let id = map.get("id").map(|node| {
            let value = document.whole(node)?;
            let at = node.at.clone();
            Ok(Placed { at, value })
        });
        let mut pose = [const { None }; 7];
        for (value, key) in pose.iter_mut().zip(POSE_KEYS) {
            *value = number(key)?;
        }
        Ok(Self {
            at: node.at.clone(),
            id: id.transpose()?,
            size: number("size")?,
            pose,
        })
    }
}

fn chosen(
    document: &Document<'_>,
    mut parts: Vec<(String, Part)>,
    named: Option<&str>,
) -> Result<Part, SiteError> {
    const NAMED: &str = "write `FILE#NAME`";
    let names = suggest::list(parts.iter().map(|(name, _)| name.as_str()));
    parts.retain(|(name, _)| named.is_none_or(|named| named == name));
    let found = parts.len();
    match (parts.pop(), named) {
        (Some((_, part)), _) if found == 1 => Ok(part),
        (None, None) => Err(document
            .error(0..0, "the file has no tag")
            .expected("a bundle or a tag")
            .help(MESSAGES.written)),
        (_, None) => Err(document
            .error(
                0..0,
                format!(
                    "the file has several bundles and tags, each with a frame of its own: {names}"
                ),
            )
            .expected("the name of one of them after the file's name")
            .help(NAMED)),
        (None, Some(name)) => Err(document
            .error(0..0, format!("the file has no bundle and no tag `{name}`"))
            .expected(format!("one of {names}"))
            .help(NAMED)),
        (Some((name, _)), Some(_)) => Err(document
            .error(0..0, format!("the file has `{name}` several times"))
            .expected("names that differ")
            .help("rename one of them")),
    }
}

fn of_member(document: &Document<'_>, member: Member) -> Result<Found, SiteError> {
    let at = || member.at.clone();
    let id = document.required(member.id, at(), "id", MEMBER)?;
    let size = document.required(member.size, at(), "size", MEMBER)?;
    if !is_size(size.value) {
        return Err(document
            .error(
                size.at,
                format!("the size of tag {} is {}", id.value, size.value),
            )
            .expected("the black border's outer edge in metres, above 0 and at most 10")
            .help("sizes are metres: 165 mm are 0.165"));
    }
    // The defaults of apriltag_ros: the origin and the identity.
    let mut pose = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    for ((value, key), given) in pose.iter_mut().zip(POSE_KEYS).zip(&member.pose) {
        let Some(given) = given else { continue };
        if !given.value.is_finite() {
            return Err(document
                .error(
                    given.at.clone(),
                    format!("{key} of tag {} is {}", id.value, given.value),
                )
                .expected("a finite number")
                .help(MESSAGES.not_finite));
        }
        *value = given.value;
    }
    let [x, y, z, w, qx, qy, qz] = pose;
    let frame = Frame::of_quaternion([x, y, z], [w, qx, qy, qz]).map_err(|length| {
        document
            .error(
                at(),
                format!(
                    "the quaternion of tag {} (qw {w}, qx {qx}, qy {qy}, qz {qz}) has length {length:.4}",
                    id.value
                ),
            )
            .expected(format!("a unit quaternion: length 1 within {LENGTH_SLACK}"))
            .help("write all four with all digits: without it qw is 1")
    })?;
    Ok(Placed {
        at: id.at,
        value: (id.value, size.value, frame),
    })
}
