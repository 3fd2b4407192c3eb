//! Success sets from learnt error models: S_l(r) as a union of views in which both bounds are within r.

use super::error::SiteError;
use super::names::{Names, named};
use super::places::SiteModel;
use super::reader::{Node, Table};
use super::{ErrorBound, Site, SiteCamera, SiteTag, keys};
use posegate::shape::{Exclusion, Shape, Visibility};
use posegate_learn::{ErrorModel, TakenWith};

/// What to do if a model was learnt with another camera, another mount or other tags.
const LEARN_WITH_THESE: &str = "take detections with this camera and these tags, and learn a model from them: `posegate learn bounds`. If only the size of the tags differs, `tag_size` in the [error_model] table scales the model. If the same mount was measured again, compute the errors with its new numbers, or state a `mount_tolerance` that covers the difference";

/// Refuses a model whose detections were taken with another camera, another mount or other tags, if both are known.
pub(super) fn same(
    node: &Node<'_>,
    model: &ErrorModel,
    camera: &SiteCamera,
    tag: &SiteTag,
) -> Result<(), SiteError> {
    let Some(difference) = camera.difference(model, tag) else {
        return Ok(());
    };
    Err(node
        .error(format!(
            "the error model of `{}` was learnt with {difference} as here",
            node.path()
        ))
        .expected("the camera, its mount and the tags with which its detections were taken")
        .help(LEARN_WITH_THESE))
}

impl Site {
    /// Returns the first difference of a view's camera, mount and tag from those with which a model was learnt, and what to do;
    /// `None` if all known values are equal. Views name neither camera nor tag: those of the site that equal the view's are
    /// compared, and a camera at its mount if a border narrows its image. If there are several, one that is equal suffices.
    #[must_use]
    pub fn difference(
        &self,
        model: &ErrorModel,
        view: &Visibility,
    ) -> Option<(String, &'static str)> {
        let at_mount = |camera: &&SiteCamera| camera.mount == view.mount;
        let same_image = |camera: &&SiteCamera| at_mount(camera) && camera.camera == view.camera;
        let mut cameras: Vec<&SiteCamera> = self.cameras.values().filter(same_image).collect();
        if cameras.is_empty() {
            cameras = self.cameras.values().filter(at_mount).collect();
        }
        let tags = || self.tags.values().filter(|known| known.tag == view.tag);
        let pairs = cameras
            .iter()
            .flat_map(|camera| tags().map(move |tag| (camera, tag)));
        let differences: Option<Vec<String>> = pairs
            .map(|(camera, tag)| camera.difference(model, tag))
            .collect();
        let first = differences?.into_iter().next()?;
        Some((first, LEARN_WITH_THESE))
    }
}

impl SiteCamera {
    /// Returns the first difference of this camera, its mount and a tag from those with which a model was learnt.
    fn difference(&self, model: &ErrorModel, tag: &SiteTag) -> Option<String> {
        let here = TakenWith {
            tag_size: Some(tag.tag.size),
            family: Some(tag.family.clone()),
            ..self.taken_with()
        };
        model.taken_with()?.difference(&here, self.mount_tolerance)
    }

    /// Returns the description of this camera and its mount that a model learnt with it records.
    #[must_use]
    pub fn taken_with(&self) -> TakenWith {
        let [fx, fy] = self.calibration.focal_px;
        TakenWith {
            camera: None,
            fx: Some(fx),
            fy: Some(fy),
            image: Some(self.calibration.size_px),
            lens: Some(self.calibration.lens.name().to_owned()),
            tag_size: None,
            family: None,
            mount: Some(self.mount.into()),
        }
    }
}

/// Returns the poses of a visibility set at which a learnt model's bounds, plus the errors from the tolerances of tag
/// and camera, are within `[m, deg]`.
pub(super) fn set(
    limit: &Node<'_>,
    view: &Visibility,
    model: &ErrorModel,
    [translation, yaw_deg]: [f64; 2],
) -> Result<Shape, SiteError> {
    let turned = 2.0 * view.tag_tolerance.turn_deg;
    let mut sets: Vec<Shape> = Vec::new();
    // The error that the detector may still have at distance `d`, after the errors from the survey's tolerances.
    let allowed = |d: f64| {
        let [metres, degrees] = view.tolerance_error(d.min(view.d_max));
        [translation - metres, yaw_deg - degrees]
    };
    for part in model.views_within(allowed) {
        let mut narrower = Visibility {
            d_max: view.d_max.min(part.d[1]),
            phi_max_deg: view.phi_max_deg.min(part.phi_max_deg),
            psi_max_deg: view.psi_max_deg.min(part.psi_deg[1]),
            error_room: Some([translation - part.bounds[0], yaw_deg - part.bounds[1]]),
            ..*view
        };
        narrower.keep_error_room();
        let [d_min, psi_min_deg] = [part.d[0], part.psi_deg[0]];
        let left = narrower.half_angles_deg().iter().all(|angle| *angle > 0.0)
            && d_min < narrower.d_max
            && psi_min_deg + turned < narrower.psi_max_deg;
        if !left {
            continue;
        }
        let mut all = std::vec![Shape::Visibility(narrower)];
        if d_min > 0.0 {
            all.push(Shape::Apart(Exclusion::Near {
                view: narrower,
                d_min,
            }));
        }
        if psi_min_deg > 0.0 {
            all.push(Shape::Apart(Exclusion::Square {
                view: narrower,
                psi_min_deg,
            }));
        }
        sets.push(match <[Shape; 1]>::try_from(all) {
            Ok([only]) => only,
            Err(all) => Shape::All(all),
        });
    }
    match <[Shape; 1]>::try_from(sets) {
        Ok([only]) => Ok(only),
        Err(sets) if sets.is_empty() => Err(too_inaccurate(limit, view, [translation, yaw_deg])),
        Err(sets) => Ok(Shape::Any(sets)),
    }
}

/// Returns the error for a set in which no view is accurate enough.
fn too_inaccurate(
    limit: &Node<'_>,
    view: &Visibility,
    [translation, yaw_deg]: [f64; 2],
) -> SiteError {
    let within = format!("within {translation} m and {yaw_deg} deg");
    if view.is_exact() {
        return limit
            .error(format!(
                "nowhere in the set are both bounds of the error model {within}"
            ))
            .help("allow a larger error, or learn from more detections at the task's views");
    }
    let [near, far] = [view.z_near, view.d_max].map(|d| view.tolerance_error(d));
    limit
        .error(format!(
            "nowhere in the set are both bounds of the error model {within}, with the error from the tolerances of tag and camera added: \
             {:.3} to {:.3} m, and {} deg",
            near[0], far[0], far[1] as f32
        ))
        .help("allow a larger error, survey the tag or the camera better, or learn from more detections at the task's views")
}

/// The largest error within a success set, from its error models.
#[derive(Clone, Copy)]
pub(super) struct Limit {
    /// The largest error of all models in the set, with their smallest coverage.
    pub(super) bound: ErrorBound,
    /// `true` if the bound holds in every part of a union.
    pub(super) everywhere: bool,
}

/// Returns the largest error within a success set; `None` if nothing in the set names an error model.
pub(super) fn limit(node: &Node<'_>, names: &Names<'_>) -> Result<Option<Limit>, SiteError> {
    let table = node.any_table()?;
    for key in [&keys::ANY, &keys::ALL] {
        let Some(sets) = table.optional(key) else {
            continue;
        };
        let any = key.name == keys::ANY.name;
        let mut worst: Option<Limit> = None;
        let mut every = true;
        for set in sets.array()? {
            let Some(limit) = limit(&set, names)? else {
                every = false;
                continue;
            };
            every &= limit.everywhere;
            worst = Some(worst.map_or(limit, |worst| worse(worst, limit)));
        }
        return Ok(worst.map(|limit| Limit {
            everywhere: every || !any && limit.everywhere,
            ..limit
        }));
    }
    let (Some(model), Some(r)) = (
        table.optional(&keys::ERROR_MODEL),
        table.optional(&keys::ERROR_LIMIT),
    ) else {
        return Ok(None);
    };
    let model = named(&model, "error_model", names.error_models)?;
    let coverage = match model {
        SiteModel::Learnt(model) => model.coverage(),
        SiteModel::Formula(_) => 1.0,
    };
    let [translation, yaw_deg] = largest(&r)?;
    Ok(Some(Limit {
        bound: ErrorBound {
            translation,
            yaw_deg,
            coverage,
        },
        everywhere: true,
    }))
}

/// Returns the largest error `r` of a success set, `[metres, degrees]`.
pub(super) fn largest(limit: &Node<'_>) -> Result<[f64; 2], SiteError> {
    let table = limit.table(&[&keys::BOUND_TRANSLATION, &keys::BOUND_YAW])?;
    Ok([
        table.number(&keys::BOUND_TRANSLATION)?,
        table.number(&keys::BOUND_YAW)?,
    ])
}

fn worse(a: Limit, b: Limit) -> Limit {
    Limit {
        bound: ErrorBound {
            translation: a.bound.translation.max(b.bound.translation),
            yaw_deg: a.bound.yaw_deg.max(b.bound.yaw_deg),
            coverage: a.bound.coverage.min(b.bound.coverage),
        },
        everywhere: a.everywhere && b.everywhere,
    }
}

/// Returns the views of a set without an error model: their largest error is stated in the file.
pub fn stated_views(shape: &Shape) -> Vec<&Visibility> {
    let mut views = Vec::new();
    let mut open = std::vec![shape];
    while let Some(shape) = open.pop() {
        match shape {
            Shape::Visibility(view) if view.error_room.is_none() => views.push(view),
            Shape::Any(sets) | Shape::All(sets) => open.extend(sets.iter().rev()),
            _ => {}
        }
    }
    views
}

/// Returns the largest error of a task: its `error_bound` if it has one. Otherwise that of the success set, if it is
/// valid in every part of a union.
///
/// # Errors
///
/// The task's `error_bound` is missing and needed, or promises more than the success set's limit.
pub(super) fn error_bound(
    task: &Table<'_>,
    set: &Node<'_>,
    names: &Names<'_>,
) -> Result<ErrorBound, SiteError> {
    let limit = limit(set, names)?;
    let node = match (task.optional(&keys::ERROR_BOUND), limit) {
        (Some(node), _) => node,
        (None, Some(limit)) if limit.everywhere => return Ok(limit.bound),
        (None, _) => task.required(&keys::ERROR_BOUND)?,
    };
    let learnt = limit.map(|limit| limit.bound);
    let table = node.table(&[
        &keys::BOUND_TRANSLATION,
        &keys::BOUND_YAW,
        &keys::BOUND_COVERAGE,
    ])?;
    let bound = ErrorBound {
        translation: table.number(&keys::BOUND_TRANSLATION)?,
        yaw_deg: table.number(&keys::BOUND_YAW)?,
        coverage: match table.optional(&keys::BOUND_COVERAGE) {
            Some(node) => node.number()?,
            None => learnt.map_or(1.0, |learnt| learnt.coverage),
        },
    };
    if let Some(learnt) = learnt
        && (bound.translation < learnt.translation
            || bound.yaw_deg < learnt.yaw_deg
            || bound.coverage > learnt.coverage)
    {
        return Err(node
            .error(format!(
                "{} promises more than its success set: {} m and {} deg for {} of the observations",
                task.title(),
                learnt.translation,
                learnt.yaw_deg,
                learnt.coverage
            ))
            .expected("an error no smaller than the success set's `r`, for no more of the observations than its \
                       `error_model` was learnt for")
            .help("remove `error_bound`: the bound is then that of the success set"));
    }
    Ok(bound)
}
