//! apriltag_ros's tags.yaml: bundles, each in its own frame, and single tags without a pose.

use std::ops::Range;

use serde::Deserialize;

use super::place::{Frame, LENGTH_SLACK};
use super::{Placed, is_size};
use crate::site::error::{SiteError, Source};
use crate::site::suggest;
use crate::site::yaml::{Document, FormatMessages, Spanned};

#[derive(Deserialize)]
struct File {
    standalone_tags: Option<Spanned<Vec<Spanned<Single>>>>,
    tag_bundles: Option<Spanned<Vec<Spanned<Bundle>>>>,
}

// An unknown key is refused: a misspelt key would silently leave the default.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Single {
    id: Option<Spanned<u32>>,
    size: Option<Spanned<f64>>,
    name: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Bundle {
    name: Option<String>,
    layout: Option<Spanned<Vec<Spanned<Member>>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Member {
    id: Option<Spanned<u32>>,
    size: Option<Spanned<f64>>,
    x: Option<Spanned<f64>>,
    y: Option<Spanned<f64>>,
    z: Option<Spanned<f64>>,
    qw: Option<Spanned<f64>>,
    qx: Option<Spanned<f64>>,
    qy: Option<Spanned<f64>>,
    qz: Option<Spanned<f64>>,
}

const MANNER: FormatMessages = FormatMessages {
    what: "a tags.yaml of apriltag_ros",
    written: "write `tag_bundles: [ { name: dock, layout: [ {id: 7, size: 0.1, x: 0, y: 0, z: 0, qw: 1, qx: 0, qy: 0, \
              qz: 0} ] } ]`",
    numbers: "write numbers plainly, as 0.25 or 2.5e-01, and ids as whole numbers",
    not_finite: "measure the missing value, or remove the tag",
    length: "write lists in [ ]",
};

const MEMBER: &str = "write `{id: 7, size: 0.1, x: 0, y: 0, z: 0, qw: 1, qx: 0, qy: 0, qz: 0}`: metres, the quaternion \
                      in the bundle's frame";

/// A tag's number and size, and its pose in its bundle.
pub(super) type Found = Placed<(u32, f64, Frame)>;

/// Returns the tags of one bundle, or a single tag. `part` is its name, needed if the file has
/// several.
pub(super) fn read(source: Source<'_>, part: Option<&str>) -> Result<Vec<Found>, SiteError> {
    let document = Document::new(source, &MANNER)?;
    let keys = document.keys()?;
    if !keys
        .iter()
        .any(|key| key == "tag_bundles" || key == "standalone_tags")
    {
        return Err(document
            .error(0..0, "the file has neither `tag_bundles` nor `standalone_tags`")
            .expected(MANNER.what)
            .help(
                "parameters of ROS 2's node (ids, frames, sizes) have no poses: write such tags as [tag.NAME] \
                 tables",
            ));
    }
    let file: File = document.read()?;
    let bundles = file.tag_bundles.map_or_else(Vec::new, |list| list.value);
    let singles = file
        .standalone_tags
        .map_or_else(Vec::new, |list| list.value);
    let mut parts: Vec<(String, Part)> = Vec::new();
    for (index, bundle) in bundles.into_iter().enumerate() {
        let name = bundle.value.name.clone();
        let name = name.unwrap_or_else(|| format!("bundle_{index}"));
        parts.push((name, Part::Bundle(bundle)));
    }
    for single in singles {
        let id = document.required(
            single.value.id.as_ref(),
            document.span(single.referenced),
            "id",
            "write `{id: 7, size: 0.1, name: dock}`",
        )?;
        let name = single.value.name.clone();
        let name = name.unwrap_or_else(|| format!("tag_{}", id.value));
        parts.push((name, Part::Single(single)));
    }
    chosen(&document, parts, part)?.tags(&document)
}

enum Part {
    Bundle(Spanned<Bundle>),
    Single(Spanned<Single>),
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
            .help(MANNER.written)),
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

impl Part {
    fn tags(self, document: &Document<'_>) -> Result<Vec<Found>, SiteError> {
        match self {
            Self::Single(single) => {
                let at = document.span(single.referenced);
                let member = Member {
                    id: single.value.id,
                    size: single.value.size,
                    x: None,
                    y: None,
                    z: None,
                    qw: None,
                    qx: None,
                    qy: None,
                    qz: None,
                };
                Ok(std::vec![of_member(document, &at, member)?])
            }
            Self::Bundle(bundle) => {
                let at = document.span(bundle.referenced);
                let layout =
                    document.required(bundle.value.layout, at, "layout", MANNER.written)?;
                layout
                    .value
                    .into_iter()
                    .map(|member| {
                        of_member(document, &document.span(member.referenced), member.value)
                    })
                    .collect()
            }
        }
    }
}

fn of_member(
    document: &Document<'_>,
    at: &Range<usize>,
    member: Member,
) -> Result<Found, SiteError> {
    let id = document.required(member.id, at.clone(), "id", MEMBER)?;
    let size = document.required(member.size, at.clone(), "size", MEMBER)?;
    if !is_size(size.value) {
        return Err(document
            .error(
                document.span(size.referenced),
                format!("the size of tag {} is {}", id.value, size.value),
            )
            .expected("the black border's outer edge in metres, above 0 and at most 10")
            .help("sizes are metres: 165 mm are 0.165"));
    }
    let number = |value: Option<Spanned<f64>>, name: &str, otherwise: f64| match value {
        None => Ok(otherwise),
        Some(value) if value.value.is_finite() => Ok(value.value),
        Some(value) => Err(document
            .error(
                document.span(value.referenced),
                format!("{name} of tag {} is {}", id.value, value.value),
            )
            .expected("a finite number")
            .help(MANNER.not_finite)),
    };
    let at_metres = [
        number(member.x, "x", 0.0)?,
        number(member.y, "y", 0.0)?,
        number(member.z, "z", 0.0)?,
    ];
    let quaternion = [
        number(member.qw, "qw", 1.0)?,
        number(member.qx, "qx", 0.0)?,
        number(member.qy, "qy", 0.0)?,
        number(member.qz, "qz", 0.0)?,
    ];
    let frame = Frame::of_quaternion(at_metres, quaternion).map_err(|length| {
        let [w, x, y, z] = quaternion;
        document
            .error(
                at.to_owned(),
                format!(
                    "the quaternion of tag {} (qw {w}, qx {x}, qy {y}, qz {z}) has length {length:.4}",
                    id.value
                ),
            )
            .expected(format!("a unit quaternion: length 1 within {LENGTH_SLACK}"))
            .help("write all four with all digits: without it qw is 1")
    })?;
    Ok(Placed {
        at: document.span(id.referenced),
        value: (id.value, size.value, frame),
    })
}
