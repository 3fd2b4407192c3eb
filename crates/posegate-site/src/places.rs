//! Walls, tolerances and error models from TOML.

use super::error::SiteError;
use super::keys;
use super::named::NamedFile;
use super::reader::Node;
use posegate::shape::{ErrorModel, Footprint, Intrinsics, Pose3Deg, Tolerance, Wall};
use posegate_files::input::{self, Limit};
use posegate_learn as learn;
use std::path::Path;

pub(super) fn wall(name: &str, node: &Node<'_>) -> Result<Wall, SiteError> {
    let table = node.table(&[
        &keys::WALL_FROM,
        &keys::WALL_TO,
        &keys::WALL_CORNERS,
        &keys::WALL_Z,
        &keys::WALL_KEEP_OUTS,
    ])?;
    let keep_outs = match table.optional(&keys::WALL_KEEP_OUTS) {
        Some(node) => node
            .array()?
            .iter()
            .map(keep_out)
            .collect::<Result<_, _>>()?,
        None => Vec::new(),
    };
    let corners = match table.optional(&keys::WALL_CORNERS) {
        Some(corners) => {
            if table.has(keys::WALL_FROM.name) || table.has(keys::WALL_TO.name) {
                return Err(corners
                    .error("a wall has `from` and `to`, or `corners`")
                    .help("remove one or the other"));
            }
            let points: Vec<[f64; 2]> = corners
                .array()?
                .iter()
                .map(Node::pair)
                .collect::<Result<_, _>>()?;
            Footprint::check_region(&points)
                .map_err(|fault| corners.error(format!("`{}`: {fault}", corners.path())))?;
            points
        }
        None => {
            let [from, to] = [&keys::WALL_FROM, &keys::WALL_TO].map(|key| table.required(key));
            let (from, to) = (from?.pair()?, to?);
            let end = to.pair()?;
            if from == end {
                return Err(to.error("the wall ends where it starts"));
            }
            std::vec![from, end]
        }
    };
    Ok(Wall {
        name: name.to_owned(),
        corners,
        z: table.interval(&keys::WALL_Z, |lo, hi| lo < hi)?,
        keep_outs,
    })
}

/// Reads the part of a wall where no tag may be mounted.
fn keep_out(node: &Node<'_>) -> Result<[[f64; 2]; 2], SiteError> {
    let table = node.table(&[&keys::KEEP_OUT_ALONG, &keys::KEEP_OUT_Z])?;
    Ok([
        table.interval(&keys::KEEP_OUT_ALONG, |lo, hi| lo < hi)?,
        table.interval(&keys::KEEP_OUT_Z, |lo, hi| lo < hi)?,
    ])
}

pub(super) fn tolerance(node: &Node<'_>) -> Result<Tolerance, SiteError> {
    let table = node.table(&[&keys::TOLERANCE_TRANSLATION, &keys::TOLERANCE_YAW])?;
    Ok(Tolerance {
        translation: table.number(&keys::TOLERANCE_TRANSLATION)?,
        turn_deg: table.number(&keys::TOLERANCE_YAW)?,
    })
}

/// Reads the pose-set, about its goal, in which the robot is expected.
pub(super) fn expected(node: &Node<'_>) -> Result<Tolerance, SiteError> {
    let table = node.table(&[&keys::TOLERANCE_TRANSLATION, &keys::EXPECTED_YAW])?;
    Ok(Tolerance {
        translation: table.number(&keys::TOLERANCE_TRANSLATION)?,
        turn_deg: table.number(&keys::EXPECTED_YAW)?,
    })
}

pub(super) fn mount_tolerance(node: &Node<'_>) -> Result<Tolerance, SiteError> {
    let table = node.table(&[&keys::TOLERANCE_TRANSLATION, &keys::TOLERANCE_ANGLE])?;
    Ok(Tolerance {
        translation: table.number(&keys::TOLERANCE_TRANSLATION)?,
        turn_deg: table.number(&keys::TOLERANCE_ANGLE)?,
    })
}

pub(super) fn intrinsics(node: &Node<'_>) -> Result<Intrinsics, SiteError> {
    let table = node.table(&[&keys::FOCAL_SHARE, &keys::CENTRE_PX])?;
    Ok(Intrinsics {
        focal: table.number(&keys::FOCAL_SHARE)?,
        centre_px: table.number(&keys::CENTRE_PX)?,
    })
}

/// An error model of a site.
// A site has only a few of them, so the size of a variant does not matter.
#[allow(clippy::large_enum_variant)]
pub(super) enum SiteModel {
    /// A bound that is a polynomial of distance and angles.
    Formula(ErrorModel),
    /// Learnt bounds.
    Learnt(learn::ErrorModel),
}

/// The largest tilt of a detector's pose that is assumed, degrees, as for the tolerance of a mount.
const LARGEST_LEAN_DEG: f64 = 20.0;

/// Reads an error model. Also returns its file if it names one.
///
/// The two lengths, metres, are the largest distance of a camera from the robot's reference point along the floor,
/// and its largest height above that point.
pub(super) fn error_model(
    node: &Node<'_>,
    [lever, height]: [f64; 2],
) -> Result<(SiteModel, Option<NamedFile>), SiteError> {
    let table = node.table(&[
        &keys::MODEL_TRANSLATION,
        &keys::MODEL_YAW,
        &keys::MODEL_FILE,
        &keys::MODEL_TAG_SIZE,
        &keys::MODEL_LEAN,
    ])?;
    if table.has(keys::MODEL_LEAN.name) && !table.has(keys::MODEL_TAG_SIZE.name) {
        return Err(table
            .error_at_key(
                keys::MODEL_LEAN.name,
                format!("{} has a `lean_deg` and no `tag_size`", table.title()),
            )
            .expected("`lean_deg` only beside a `tag_size`")
            .help("remove `lean_deg`"));
    }
    if let Some(file) = table.optional(&keys::MODEL_FILE) {
        for key in [&keys::MODEL_TRANSLATION, &keys::MODEL_YAW] {
            if table.has(key.name) {
                return Err(table
                    .error_at_key(
                        key.name,
                        format!("{} has both `file` and `{}`", table.title(), key.name),
                    )
                    .expected("a learnt model, or a bound written here")
                    .help("remove one or the other"));
            }
        }
        let (mut model, named) = learnt(&file)?;
        if model.is_of_better_pose() {
            return Err(file
                .error(format!(
                    "the bounds of the error model of {} hold for the better one of a detector's two poses",
                    table.title()
                ))
                .expected("bounds for the one pose that a look gives")
                .help("learn the model without the columns `second_err_translation_m` and `second_err_yaw_rad`"));
        }
        if let Some(node) = table.optional(&keys::MODEL_TAG_SIZE) {
            let lean = table.optional(&keys::MODEL_LEAN);
            let lean_deg = lean.map_or(Ok(LARGEST_LEAN_DEG), |node| node.number())?;
            let rise = height * libm::sin(lean_deg.to_radians());
            model = model.for_tags_of(node.number()?, lever, rise).ok_or_else(|| {
                node.error(format!(
                    "the error model of {} does not record the size of its tags, so it cannot be scaled",
                    table.title()
                ))
                .help("learn it again with `posegate learn bounds --tag-size` or `--camera --site`, or remove `tag_size`")
            })?;
        }
        return Ok((SiteModel::Learnt(model), Some(named)));
    }
    if table.has(keys::MODEL_TAG_SIZE.name) {
        return Err(table
            .error_at_key(
                keys::MODEL_TAG_SIZE.name,
                format!("{} is a formula and has a `tag_size`", table.title()),
            )
            .expected("a `tag_size` only beside a `file`")
            .help("remove `tag_size`, and write a formula for the tags of this site"));
    }
    let four = |key| {
        let node = table.required(key)?;
        let mut numbers: Vec<f64> = Vec::new();
        for entry in &node.array()? {
            let number = entry.number()?;
            // Only the last coefficient may be negative: errors decrease with psi, since they are largest head-on.
            if number < 0.0 && numbers.len() < 3 {
                return Err(entry.out_of_range());
            }
            numbers.push(number);
        }
        <[f64; 4]>::try_from(numbers)
            .map_err(|_| node.error(format!("`{}` is not four numbers", node.path())))
    };
    let model = ErrorModel {
        translation: four(&keys::MODEL_TRANSLATION)?,
        yaw_deg: four(&keys::MODEL_YAW)?,
    };
    Ok((SiteModel::Formula(model), None))
}

/// Reads a learnt model from a file; its path is relative to the site file's folder.
fn learnt(node: &Node<'_>) -> Result<(learn::ErrorModel, NamedFile), SiteError> {
    let folder = Path::new(node.file()).parent().unwrap_or(Path::new(""));
    let path = folder.join(node.text()?);
    let name = path.to_string_lossy();
    let bytes = input::read_file(&path, Limit::MODEL).map_err(|cause| {
        node.error(format!("the error model {name} cannot be read: {cause}"))
            .help("write the file's path relative to the site file's folder")
    })?;
    let read = NamedFile::new(&path, &bytes);
    let text = String::from_utf8(bytes)
        .map_err(|_| node.error(format!("the error model {name} is not UTF-8")))?;
    let model = learn::ErrorModel::parse(&text, &name).map_err(|fault| {
        node.error(format!("{fault}"))
            .help("create the model again with `posegate learn bounds`")
    })?;
    Ok((model, read))
}

/// Returns the `pose` line of a tag in a site file, exact to the last bit.
#[must_use]
pub fn pose_line(pose: &Pose3Deg) -> String {
    let Pose3Deg {
        x,
        y,
        z,
        roll_deg,
        pitch_deg,
        yaw_deg,
    } = pose;
    format!(
        "pose = {{ x = {x:?}, y = {y:?}, z = {z:?}, roll_deg = {roll_deg:?}, pitch_deg = {pitch_deg:?}, yaw_deg = {yaw_deg:?} }}"
    )
}
