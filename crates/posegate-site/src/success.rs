//! Success sets from TOML.

use super::error::SiteError;
use super::families::{FAMILIES, family_bits};
use super::learnt;
use super::names::{Names, named};
use super::places::SiteModel;
use super::reader::{Key, Node, Table};
use super::{Site, SiteCamera, SiteTag, camera, keys, suggest};
use posegate::shape::{
    BoxSet, Clear, ErrorLimit, ErrorModel, Exclusion, Footprint, Intrinsics, Lens, PolygonError,
    Round, Shape, Sharpness, Visibility, Wall, is_arc,
};

/// Deepest nesting of `any` and `all`.
const DEEPEST: u32 = 16;

pub(super) fn shape(node: &Node<'_>, names: &Names<'_>) -> Result<Shape, SiteError> {
    nested(node, names, DEEPEST)
}

fn nested(node: &Node<'_>, names: &Names<'_>, depth: u32) -> Result<Shape, SiteError> {
    let table = node.any_table()?;
    for key in [&keys::ANY, &keys::ALL] {
        if table.has(key.name) {
            let table = node.table(&[key])?;
            let sets = table.required(key)?;
            if depth == 0 {
                return Err(sets
                    .error("the success set is nested too deeply")
                    .help("an `any` in an `any`, or an `all` in an `all`, can be one"));
            }
            let of = |set: &Node<'_>| nested(set, names, depth - 1);
            let inner: Vec<Shape> = sets.array()?.iter().map(of).collect::<Result<_, _>>()?;
            return if inner.is_empty() {
                Err(sets.error(format!("`{}` has no success set", sets.path())))
            } else if key.name == keys::ANY.name {
                Ok(Shape::Any(inner))
            } else {
                Ok(Shape::All(inner))
            };
        }
    }
    let name = table.required(&keys::SHAPE)?;
    match name.text()? {
        "box" => box_set(node).map(Shape::Box),
        "disc" => round(node, true),
        "ellipse" => round(node, false),
        "footprint" => footprint(node),
        "visibility" => visibility(node, names),
        "clear" => clear(node),
        _ => Err(name.unknown_word(["box", "disc", "ellipse", "footprint", "visibility", "clear"])),
    }
}

fn box_set(node: &Node<'_>) -> Result<BoxSet, SiteError> {
    let table = node.table(&[&keys::SHAPE, &keys::BOX_X, &keys::BOX_Y, &keys::BOX_YAW])?;
    Ok(BoxSet {
        x: table.interval(&keys::BOX_X, |lo, hi| lo <= hi)?,
        y: table.interval(&keys::BOX_Y, |lo, hi| lo <= hi)?,
        yaw_deg: table.interval(&keys::BOX_YAW, |lo, hi| lo <= hi && is_arc([lo, hi]))?,
    })
}

/// Reads a disc or an ellipse.
fn round(node: &Node<'_>, is_disc: bool) -> Result<Shape, SiteError> {
    let own: &[&Key] = if is_disc {
        &[&keys::RADIUS]
    } else {
        &[&keys::SEMI_AXIS_A, &keys::SEMI_AXIS_B, &keys::AXIS_TURN]
    };
    let common = [&keys::SHAPE, &keys::ROUND_X, &keys::ROUND_Y, &keys::BOX_YAW];
    let table = node.table(&[&common[..], own].concat())?;
    let or_0 = |key| {
        let node = table.optional(key);
        node.map_or(Ok(0.0), |node| node.number())
    };
    let (axes, turn_deg) = if is_disc {
        ([table.number(&keys::RADIUS)?; 2], 0.0)
    } else {
        let axes = [
            table.number(&keys::SEMI_AXIS_A)?,
            table.number(&keys::SEMI_AXIS_B)?,
        ];
        (axes, or_0(&keys::AXIS_TURN)?)
    };
    let round = Round {
        centre: [or_0(&keys::ROUND_X)?, or_0(&keys::ROUND_Y)?],
        axes,
        turn_deg,
    };
    let yaw_deg = table.interval(&keys::BOX_YAW, |lo, hi| lo <= hi && is_arc([lo, hi]))?;
    round.set(yaw_deg).map_err(|fault| {
        node.error(format!("`{}`: {fault}", node.path()))
            .help("choose a goal nearer to the centre, and semi-axes of similar length")
    })
}

fn footprint(node: &Node<'_>) -> Result<Shape, SiteError> {
    let table = node.table(&[
        &keys::SHAPE,
        &keys::FOOTPRINT,
        &keys::REGION,
        &keys::REGIONS,
    ])?;
    let outline = outline(&table)?;
    let Some(regions) = table.optional(&keys::REGIONS) else {
        let region = table.required(&keys::REGION)?;
        let bounds = corners(&region)?;
        let set = Footprint::new(outline, bounds).map_err(|fault| polygon(&region, fault))?;
        return Ok(Shape::Footprint(set));
    };
    if table.has(keys::REGION.name) {
        return Err(table
            .error_at_key(
                keys::REGION.name,
                format!("{} has both `region` and `regions`", table.title()),
            )
            .expected("one of them")
            .help("add the region to `regions`"));
    }
    let mut union = Vec::new();
    for region in regions.array()? {
        let bounds = corners(&region)?;
        Footprint::check_region(&bounds).map_err(|fault| polygon(&region, fault))?;
        union.push(bounds);
    }
    Shape::footprint_in_union(&outline, &union)
        .ok_or_else(|| match union.len() {
            0 => regions.error(format!("`{}` has no region", regions.path())),
            count => regions
                .error(format!(
                    "`{}` has {count} regions that are too many or too jagged together",
                    regions.path()
                ))
                .help("join regions, or leave corners out: 4,096 corners in all, 1,024 free cells between them"),
        })
}

fn outline(table: &Table<'_>) -> Result<Vec<[f64; 2]>, SiteError> {
    let footprint = table.required(&keys::FOOTPRINT)?;
    let outline = corners(&footprint)?;
    Footprint::check_footprint(&outline).map_err(|fault| polygon(&footprint, fault))?;
    Ok(outline)
}

fn clear(node: &Node<'_>) -> Result<Shape, SiteError> {
    let table = node.table(&[&keys::SHAPE, &keys::FOOTPRINT, &keys::OBSTACLE])?;
    let outline = outline(&table)?;
    let obstacle = table.required(&keys::OBSTACLE)?;
    let set =
        Clear::new(outline, corners(&obstacle)?).map_err(|fault| polygon(&obstacle, fault))?;
    Ok(Shape::Apart(Exclusion::Obstacle(set)))
}

fn corners(node: &Node<'_>) -> Result<Vec<[f64; 2]>, SiteError> {
    node.array()?.iter().map(Node::pair).collect()
}

fn polygon(node: &Node<'_>, fault: PolygonError) -> SiteError {
    let error = node.error(format!("`{}`: {fault}", node.path()));
    match fault {
        PolygonError::TooManyCorners | PolygonError::TooManyPairs => error.help(
            "draw a simpler outline: a larger one for a footprint or an obstacle, a smaller one for a region",
        ),
        PolygonError::Clockwise => error.help("reverse the order of the corners"),
        PolygonError::NotConvex => error.help(
            "list each corner of the convex outline once, counter-clockwise; leave out corners \
             that lie on a straight edge",
        ),
        _ => error,
    }
}

fn visibility(node: &Node<'_>, names: &Names<'_>) -> Result<Shape, SiteError> {
    let table = node.table(&[
        &keys::SHAPE,
        &keys::SEEN_BY,
        &keys::SEEN_TAG,
        &keys::SEEN_TAGS,
        &keys::SEE,
        &keys::D_MAX,
        &keys::D_MIN,
        &keys::PHI_MAX,
        &keys::PSI_MAX,
        &keys::PSI_MIN,
        &keys::Z_NEAR,
        &keys::BORDER,
        &keys::PX_PER_BIT,
        &keys::BITS,
        &keys::BLUR,
        &keys::WALLS_SEEN,
        &keys::ERROR_MODEL,
        &keys::ERROR_LIMIT,
    ])?;
    let camera = named(&table.required(&keys::SEEN_BY)?, "camera", names.cameras)?;
    let Some(tags) = table.optional(&keys::SEEN_TAGS) else {
        let tag = named(&table.required(&keys::SEEN_TAG)?, "tag", names.tags)?;
        return view(&table, camera, tag, names);
    };
    if table.has(keys::SEEN_TAG.name) {
        return Err(table
            .error_at_key(
                keys::SEEN_TAG.name,
                format!("{} has both `tag` and `tags`", table.title()),
            )
            .expected("one of them")
            .help("add the tag to `tags`"));
    }
    let mut views = Vec::new();
    for name in tags.array()? {
        let tag = named(&name, "tag", names.tags)?;
        views.push(view(&table, camera, tag, names)?);
    }
    if views.is_empty() {
        return Err(tags.error(format!("`{}` has no tag", tags.path())));
    }
    let see = table.required(&keys::SEE)?;
    match see.text()? {
        "any" => Ok(Shape::Any(views)),
        "all" => Ok(Shape::All(views)),
        _ => Err(see.unknown_word(["any", "all"])),
    }
}

/// Returns the poses from which one tag is seen.
fn view(
    table: &Table<'_>,
    camera: &SiteCamera,
    tag: &SiteTag,
    names: &Names<'_>,
) -> Result<Shape, SiteError> {
    let view = limits(table, camera, tag)?;
    let mut sets = std::vec![match table.optional(&keys::ERROR_MODEL) {
        None if table.has(keys::ERROR_LIMIT.name) => {
            return Err(table
                .error_at_key(
                    keys::ERROR_LIMIT.name,
                    format!("{} has an `r` and no `error_model`", table.title()),
                )
                .expected("both or neither")
                .help("add `error_model = NAME`, or remove `r`"));
        }
        None => Shape::Visibility(view),
        Some(node) => {
            let model = named(&node, "error_model", names.error_models)?;
            let limit = table.required(&keys::ERROR_LIMIT)?;
            let largest = learnt::largest(&limit)?;
            match model {
                SiteModel::Formula(model) => bounded(&node, view, *model, largest)?,
                SiteModel::Learnt(model) => {
                    learnt::same(&node, model, camera, tag)?;
                    learnt::set(&limit, &view, model, largest)?
                }
            }
        }
    }];
    sets.extend(exclusions(table, view, tag)?.map(Shape::Apart));
    let walls: Vec<&Wall> = match table.optional(&keys::WALLS_SEEN) {
        Some(node) => {
            let walls = node.array()?;
            let walls = walls.iter().map(|name| named(name, "wall", names.walls));
            walls.collect::<Result<_, _>>()?
        }
        None => names.walls.values().collect(),
    };
    sets.extend(walls.into_iter().map(|wall| {
        Shape::Apart(Exclusion::Hidden {
            view,
            wall: wall.clone(),
        })
    }));
    Ok(match <[Shape; 1]>::try_from(sets) {
        Ok([only]) => only,
        Err(sets) => Shape::All(sets),
    })
}

/// Returns a view of a tag with the limits of a success set.
fn limits(table: &Table<'_>, camera: &SiteCamera, tag: &SiteTag) -> Result<Visibility, SiteError> {
    let z_near = match table.optional(&keys::Z_NEAR) {
        Some(node) => node.number()?,
        None => Site::DEFAULT_Z_NEAR,
    };
    let mut view = Visibility {
        camera: camera.camera,
        mount: camera.mount,
        tag: tag.tag,
        d_max: table.number(&keys::D_MAX)?,
        phi_max_deg: table.number(&keys::PHI_MAX)?,
        psi_max_deg: table.number(&keys::PSI_MAX)?,
        z_near,
        tag_tolerance: tag.tolerance,
        mount_tolerance: camera.mount_tolerance,
        sharpness: sharpness(table, camera, tag)?,
        error_room: None,
    };
    if let Some(node) = table.optional(&keys::BORDER) {
        let mut calibration = camera.calibration;
        calibration.border_px = calibration.border_px.max(node.number()?);
        let narrower = camera::seen(&calibration, camera.tolerance).map_err(|fault| {
            node.error(format!("`{}`: {fault}", node.path()))
                .help("give a narrower border")
        })?;
        view.camera = narrower.camera;
    }
    if let Some(node) = table.optional(&keys::BLUR) {
        blur(&node, camera.tolerance, &mut view)?;
    }
    if view.half_angles_deg().iter().any(|angle| !(*angle > 0.0)) {
        return Err(table
            .error(format!(
                "the tolerances of tag and camera leave no angles for {}",
                table.title()
            ))
            .expected("tolerances smaller than `phi_max_deg` and `psi_max_deg`")
            .help("survey the tag or the camera better, or allow wider angles"));
    }
    Ok(view)
}

/// Returns the part of a view in which the error of a formula is within `[m, deg]`.
fn bounded(
    node: &Node<'_>,
    view: Visibility,
    model: ErrorModel,
    [translation, yaw_deg]: [f64; 2],
) -> Result<Shape, SiteError> {
    let psi_max_deg = view.psi_max_deg;
    if !model.is_bound_up_to(psi_max_deg) {
        return Err(node
            .error(format!(
                "the error model of `{}` has a bound below 0 at a psi of {psi_max_deg} deg",
                node.path()
            ))
            .expected("a bound that is at least 0 at every angle of the set: c0 + c3 psi^2 >= 0 up to `psi_max_deg`")
            .help("choose a smaller negative c3, or a smaller `psi_max_deg`"));
    }
    Ok(Shape::Bounded {
        view,
        limit: ErrorLimit {
            model,
            translation,
            yaw_deg,
        },
    })
}

/// Returns the exclusions of near and of head-on views.
fn exclusions(
    table: &Table<'_>,
    view: Visibility,
    tag: &SiteTag,
) -> Result<impl Iterator<Item = Exclusion>, SiteError> {
    let mut near = None;
    if let Some(node) = table.optional(&keys::D_MIN) {
        let d_min = node.number()?;
        if d_min >= view.d_max {
            return Err(node.error(format!("`{}` is not below `d_max`", node.path())));
        }
        near = Some(Exclusion::Near { view, d_min });
    }
    let mut head_on = None;
    if let Some(node) = table.optional(&keys::PSI_MIN) {
        let psi_min_deg = node.number()?;
        if psi_min_deg + 2.0 * tag.tolerance.turn_deg >= view.psi_max_deg {
            return Err(node.error(format!(
                "`{}` and the tag's tolerance leave nothing below `psi_max_deg`",
                node.path()
            )));
        }
        head_on = Some(Exclusion::Square { view, psi_min_deg });
    }
    Ok(near.into_iter().chain(head_on))
}

/// Returns the smallest number of pixels per bit at which the tag must be seen.
fn sharpness(
    table: &Table<'_>,
    camera: &SiteCamera,
    tag: &SiteTag,
) -> Result<Option<Sharpness>, SiteError> {
    let Some(node) = table.optional(&keys::PX_PER_BIT) else {
        return Ok(None);
    };
    if camera.camera.lens() != Lens::Pinhole {
        return Err(node
            .error("`px_per_bit_min` is supported only for rectified images")
            .help("use the rectified image, or limit `d_max` and `psi_max_deg`"));
    }
    let bits = match table.optional(&keys::BITS) {
        Some(bits) => bits.whole(1..=64)?,
        None => family_bits(&tag.family).ok_or_else(|| {
            node.error(format!(
                "the number of bits of the family `{}` is not known",
                tag.family
            ))
            .help(format!(
                "{}if the name is right, add `bits`: those along the black border's outer edge, including the border's own",
                suggest::question(&tag.family, FAMILIES.into_iter()).map_or_else(String::new, |words| words + " Or, ")
            ))
        })?,
    };
    Ok(Some(Sharpness {
        // A focal length below the calibrated one makes bits narrower, so the limit rises.
        px_per_bit: node.number()? / (1.0 - camera.tolerance.focal),
        bits,
    }))
}

/// Limits a view so that the tag's blur stays within `px_max` while the robot turns. The image of a fixed
/// point moves by at most `f m w (1 / cos^2 phi + arm / (Z cos phi))` pixels per second, so `phi` and the
/// depth `Z` are limited. Here `arm` is the distance of the camera from the axis of rotation, and `m` is the
/// lens's largest magnification up to `phi`.
fn blur(node: &Node<'_>, off: Intrinsics, view: &mut Visibility) -> Result<(), SiteError> {
    let table = node.table(&[&keys::YAW_RATE, &keys::EXPOSURE, &keys::BLUR_PX])?;
    let turned = table.number(&keys::YAW_RATE)?.to_radians() * table.number(&keys::EXPOSURE)?;
    let most = table.number(&keys::BLUR_PX)?;
    // Blur on the optical axis, pixels. The rotation itself may use nine tenths of the allowed blur; the
    // rest is for `arm`.
    let focal = view.camera.fx.max(view.camera.fy) * (1.0 + off.focal);
    let axis = focal * turned * (1.0 + 1e-9);
    let limit = 0.9 * most;
    let lens = view.camera.lens();
    if !(axis < limit) {
        return Err(node
            .error(format!(
                "the blur is {axis:.2} px even on the optical axis, {most} px are allowed"
            ))
            .help("turn more slowly, or expose for less time"));
    }
    let magnified =
        |phi_deg: f64| axis * lens.magnification(libm::tan(phi_deg.to_radians()) * (1.0 + 1e-9));
    let turning = |phi_deg: f64| {
        let cosine = libm::cos(phi_deg.to_radians());
        magnified(phi_deg) / (cosine * cosine)
    };
    let phi = libm::acos(libm::sqrt(axis / limit)).to_degrees() - 1e-9;
    view.phi_max_deg = view.phi_max_deg.min(phi);
    if lens != Lens::Pinhole && !(turning(view.phi_max_deg) <= limit) {
        let (mut within, mut beyond) = (0.0, view.phi_max_deg);
        for _ in 0..40 {
            let middle = 0.5 * (within + beyond);
            if turning(middle) <= limit {
                within = middle;
            } else {
                beyond = middle;
            }
        }
        view.phi_max_deg = within;
    }
    let pixels = magnified(view.phi_max_deg);
    let cosine = libm::cos(view.phi_max_deg.to_radians());
    let arm = libm::hypot(view.mount.x, view.mount.y) + view.mount_tolerance.translation;
    let near = pixels * arm / (cosine * (most - pixels / (cosine * cosine)));
    view.z_near = view.z_near.max(near * (1.0 + 1e-9));
    Ok(())
}
