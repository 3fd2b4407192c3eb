//! Warnings about likely wrong conventions, or mistakes, in a site.

use super::collisions::meet;
use super::mounting::{SIZES, mounted};
use super::warning::{Warning, warn};
use super::{CameraFinding, Findings, TagFinding, TaskFinding, seen, view};
use crate::draw::ingredients::{Eye, Ingredients, axes, corners, frame, radians};
use posegate::certify::Calibration;
use posegate::shape::{Exclusion, Pose3Deg, Shape, Tag, Visibility};
use posegate_plan::cover::overlap;
use posegate_site::{ErrorBound, Site, SiteTag, Task, line_of, stated_views};

/// The code of a warning about a stated error that no view can satisfy.
pub const IMPOSSIBLE_ERROR: &str = "error_bound_impossible";

/// The sine of 45 degrees: a direction with a larger elevation looks up or down.
const STEEP: f64 = core::f64::consts::FRAC_1_SQRT_2;
/// The farthest that an optical axis is from the middle of an image, as a share of its width or height.
const FARTHEST_AXIS: f64 = 0.15;
/// The focal lengths of cameras, as shares of the image's width and height: angles of view from 180 degrees down to 2.
const FOCAL_SHARES: [f64; 2] = [0.1, 30.0];
/// The largest ratio of a camera's focal lengths: of a sensor that is binned in one direction.
const LARGEST_ASPECT: f64 = 1.5;
/// A wall that begins higher is above the robot, metres.
const FLOOR: f64 = 0.05;

pub(super) fn warnings(site: &Site, findings: &Findings) -> Vec<Warning> {
    let mut all = Vec::new();
    for tag in &findings.tags {
        of_tag(site, "tag", tag, &mut all);
        if let Some(known) = site.tags.get(&tag.name) {
            all.extend(mounted(site, ["tag", &tag.name], known));
        }
    }
    for candidate in &findings.candidates {
        of_tag(site, "candidate", candidate, &mut all);
        if let Some(known) = site.candidates.get(&candidate.name) {
            let about = ["candidate", &candidate.name];
            all.extend(mounted(site, about, &known.tag));
            all.extend(occupied(site, about, &known.tag));
        }
    }
    let tags = &findings.tags;
    for (index, tag) in tags.iter().enumerate() {
        all.extend(tags[index + 1..].iter().filter_map(|b| too_near(tag, b)));
        all.extend(
            tags[index + 1..]
                .iter()
                .filter_map(|b| same_number(site, tag, b)),
        );
    }
    for camera in &findings.cameras {
        of_camera(findings, camera, &mut all);
    }
    for (name, camera) in &site.cameras {
        all.extend(off_centre(name, &camera.calibration));
        all.extend(odd_focal_length(name, &camera.calibration));
    }
    all.extend(site.remarks.iter().map(|remark| {
        let [kind, name] = &remark.about;
        let note = &remark.note;
        warn(note.code, [kind, name], note.message.clone(), note.help)
    }));
    for (task, finding) in site.tasks.values().zip(&findings.tasks) {
        of_task(site, task, finding, &mut all);
    }
    all.extend(stated_errors(site));
    all
}

/// Returns a warning if a camera's axis is far from the middle of its image, as in a calibration of another resolution.
fn off_centre(name: &str, calibration: &Calibration) -> Option<Warning> {
    let Calibration {
        size_px, axis_px, ..
    } = calibration;
    let offs = [0, 1].map(|axis| (axis_px[axis] - 0.5 * size_px[axis]).abs());
    let shares = [offs[0] / size_px[0], offs[1] / size_px[1]];
    let axis = usize::from(shares[1] > shares[0]);
    (shares[axis] > FARTHEST_AXIS).then(|| {
        warn(
            "axis_off_centre",
            ["camera", name],
            format!(
                "its optical axis ({} px, {} px) is {:.0} px from the middle of the image of {} x {} px, {:.0} % of the {}",
                axis_px[0], axis_px[1], offs[axis], size_px[0], size_px[1], 100.0 * shares[axis],
                ["width", "height"][axis]
            ),
            "check that the calibration is of this resolution, and not of a cropped or binned image",
        )
    })
}

/// Returns a warning if a focal length cannot be in pixels, as one in millimetres, or those of rows and columns differ.
fn odd_focal_length(name: &str, calibration: &Calibration) -> Option<Warning> {
    let Calibration {
        size_px, focal_px, ..
    } = calibration;
    let [least, most] = FOCAL_SHARES;
    let is_odd = |axis: usize| !(least..=most).contains(&(focal_px[axis] / size_px[axis]));
    let [fx, fy] = *focal_px;
    (is_odd(0) || is_odd(1) || fx.max(fy) > LARGEST_ASPECT * fx.min(fy)).then(|| {
        warn(
            "focal_length_odd",
            ["camera", name],
            format!(
                "its focal lengths are {fx} px and {fy} px, its image is {} x {} px",
                size_px[0], size_px[1]
            ),
            "check that they are in pixels, and of this resolution",
        )
    })
}

/// Returns a warning for each task, and for the looks of the planner at tags and candidates, whose stated error is
/// smaller than the error from the tolerances of tag and camera in some of its views. Looks with the same fault share a
/// warning.
#[must_use]
pub fn stated_errors(site: &Site) -> Vec<Warning> {
    let tasks = site.tasks.iter().filter_map(|(name, task)| {
        bound_without_survey(&task.success.shape, task.error_bound?, ["task", name])
    });
    let mut looks: Vec<(Warning, Vec<&str>)> = Vec::new();
    for (name, look) in site.planner.looks.iter().chain(&site.planner.offers) {
        let fault = bound_without_survey(&look.success.shape, look.bound, ["planner", "r"]);
        let Some(warning) = fault else {
            continue;
        };
        let same = |known: &&mut (Warning, Vec<&str>)| {
            (known.0.code, &known.0.message) == (warning.code, &warning.message)
        };
        match looks.iter_mut().find(same) {
            Some((_, names)) => names.push(name),
            None => looks.push((warning, vec![name])),
        }
    }
    let looks = looks.into_iter().map(|(warning, names)| Warning {
        about: match names.as_slice() {
            [name] => format!("look {name} of the planner"),
            names => format!("looks {} of the planner", names.join(", ")),
        },
        ..warning
    });
    tasks.chain(looks).collect()
}

/// Returns a warning if the stated error of a task is smaller than the error from the tolerances of tag and camera in
/// some of the views of a shape.
#[must_use]
pub fn stated_error(shape: &Shape, bound: ErrorBound, task: &str) -> Option<Warning> {
    bound_without_survey(shape, bound, ["task", task])
}

/// Returns a warning if a stated error is smaller than the error from the tolerances of tag and camera.
fn bound_without_survey(shape: &Shape, bound: ErrorBound, about: [&str; 2]) -> Option<Warning> {
    let views = stated_views(shape);
    let beyond = |d: fn(&Visibility) -> f64| {
        let added = views
            .iter()
            .map(|view| (d(view), view.tolerance_error(d(view))));
        let mut beyond = added.filter(|(_, [metres, degrees])| {
            *metres > bound.translation || *degrees > bound.yaw_deg
        });
        beyond.next()
    };
    if let Some((near, [metres, degrees])) = beyond(|view| view.z_near) {
        return Some(warn(
            IMPOSSIBLE_ERROR,
            about,
            format!(
                "its largest error is stated as {} m and {} deg; the tolerances of tag and camera alone make {metres:.3} m and \
                 {degrees:.2} deg of it where the tag is {near} m away, and more from everywhere else",
                bound.translation, bound.yaw_deg
            ),
            "state the whole error, survey the tag or the camera better, or give the set an `error_model`, to whose bounds the \
             tolerances are added",
        ));
    }
    let (far, [metres, degrees]) = beyond(|view| view.d_max)?;
    Some(warn(
        "error_bound_below_tolerance",
        about,
        format!(
            "its largest error is stated as {} m and {} deg; the tolerances of tag and camera alone make up to {metres:.3} m and \
             {degrees:.2} deg of it where the tag is {far} m away",
            bound.translation, bound.yaw_deg
        ),
        "a stated error is the whole error: include the survey's error, lower `d_max`, or give the set an `error_model`, to \
         whose bounds the tolerances are added",
    ))
}

fn of_tag(site: &Site, kind: &str, finding: &TagFinding, all: &mut Vec<Warning>) {
    let TagFinding {
        name,
        tag,
        faces_deg: [faces, rises],
        looks,
    } = finding;
    let about = [kind, name.as_str()];
    let begun = all.len();
    let is_seen = looks.iter().any(|look| look.least.slack >= 0.0);
    if !(SIZES[0]..=SIZES[1]).contains(&tag.size) {
        all.push(warn(
            "tag_size",
            about,
            format!("it is {} m wide", tag.size),
            "`size` is the black border's outer edge in metres, not in millimetres and not with the white margin",
        ));
    }
    let lowest = corners(tag)
        .iter()
        .map(|c| c[2])
        .fold(f64::INFINITY, f64::min);
    if lowest < -1e-9 {
        all.push(warn(
            "tag_below_floor",
            about,
            format!("its lowest corner is {:.3} m below the floor", -lowest),
            "`z` is the height of the tag's centre above the floor; the world's z axis points up",
        ));
    }
    let normal = axes(&tag.pose)[0];
    if normal[2].abs() > STEEP && !is_seen {
        let direction = if normal[2] > 0.0 { "up" } else { "down" };
        all.push(warn(
            "tag_faces_up_or_down",
            about,
            format!(
                "its face looks {direction} ({rises:.1} deg), and no camera sees it from any goal"
            ),
            "the tag's x axis comes out of its face: a tag on a wall has roll = pitch = 0",
        ));
    } else if !looks.is_empty() && faces_away(site, tag) {
        let turned = Pose3Deg {
            yaw_deg: tag.pose.yaw_deg + 180.0,
            ..tag.pose
        };
        let turned = Tag {
            pose: turned,
            ..*tag
        };
        let sees = seen_from(site, &turned);
        let sees = sees.map_or(String::new(), |(task, camera)| {
            format!("; turned by 180 deg, {camera} would see it from the goal of {task}")
        });
        all.push(warn(
            "tag_faces_away",
            about,
            format!("its face looks to {faces:.1} deg, away from every camera at every goal{sees}"),
            "`yaw_deg` is the heading that the face looks to, not the heading of who looks at it",
        ));
    }
    for warning in all.iter_mut().skip(begun) {
        let key = if warning.code == "tag_size" {
            "size"
        } else {
            "pose"
        };
        warning.at.push(key.into());
    }
}

/// Returns a warning if a candidate overlaps a mounted tag.
fn occupied(site: &Site, about: [&str; 2], candidate: &SiteTag) -> Option<Warning> {
    let mut tags = site.tags.iter();
    let (name, _) = tags.find(|(_, tag)| overlap(tag, candidate))?;
    Some(warn(
        "candidate_on_tag",
        about,
        format!("it overlaps the tag {name}, which is mounted already"),
        "move the candidate, or remove it: `cover` uses mounted tags anyway",
    ))
}

impl Warning {
    /// Returns the line of a site file's text, counted from 1, to which the warning points: the key of its subject,
    /// or the table that generates the subject.
    #[must_use]
    pub fn line(&self, text: &str) -> usize {
        let path: Vec<&str> = self.at.iter().map(String::as_str).collect();
        let made_by = match path.as_slice() {
            ["candidate", name, ..] => {
                let row = name.rsplit_once('-').map_or("", |(row, _)| row);
                line_of(text, &["candidates", row])
            }
            ["planner", ..] => line_of(text, &["planner"]),
            _ => line_of(text, &["import"]),
        };
        line_of(text, &path).or(made_by).unwrap_or(1)
    }
}

/// Returns `true` if a tag has its back to every camera at every goal.
fn faces_away(site: &Site, tag: &Tag) -> bool {
    let normal = axes(&tag.pose)[0];
    site.tasks.values().all(|task| {
        let goal = radians(task.success.goal);
        site.cameras.values().all(|camera| {
            let [x, y, z] = Eye::of(&camera.mount, goal).centre;
            let offset = [x - tag.pose.x, y - tag.pose.y, z - tag.pose.z];
            (0..3).map(|i| normal[i] * offset[i]).sum::<f64>() <= 0.0
        })
    })
}

/// Returns a task and a camera that see a tag from the task's goal.
fn seen_from<'a>(site: &'a Site, tag: &Tag) -> Option<(&'a str, &'a str)> {
    site.tasks.iter().find_map(|(name, task)| {
        let camera = site.cameras.iter().find(|(_, camera)| {
            let (view, _) = view(task, camera, tag);
            seen(site, task, view).slack >= 0.0
        });
        camera.map(|(camera, _)| (name.as_str(), camera.as_str()))
    })
}

fn too_near(a: &TagFinding, b: &TagFinding) -> Option<Warning> {
    let [p, q] = [a, b].map(|finding| finding.tag.pose);
    let [dx, dy, dz] = [p.x - q.x, p.y - q.y, p.z - q.z];
    let apart = libm::sqrt(dx * dx + dy * dy + dz * dz);
    let [n, m] = [p, q].map(|pose| axes(&pose)[0]);
    // Tags on both sides of a board face opposite directions.
    let back_to_back = (0..3).map(|i| n[i] * m[i]).sum::<f64>() < -0.5;
    let size = a.tag.size.max(b.tag.size);
    (apart < size && !back_to_back).then(|| {
        let warning = warn(
            "tags_too_near",
            ["tag", &b.name],
            format!("their centres are {apart:.3} m apart, and one of them is {size} m wide"),
            "two tags cannot be in one place: one of the poses, or of the sizes, is wrong",
        );
        of_both(a, b, warning)
    })
}

/// Returns a warning if two tags have the same family and number.
fn same_number(site: &Site, a: &TagFinding, b: &TagFinding) -> Option<Warning> {
    let [family, other] = [a, b].map(|finding| site.tags.get(&finding.name).map(|tag| &tag.family));
    (a.tag.id == b.tag.id && family == other).then(|| {
        let warning = warn(
            "tags_alike",
            ["tag", &b.name],
            format!("both have the number {}", a.tag.id),
            "a detector cannot tell such tags apart: where both can be seen, it may be the other one",
        );
        of_both(a, b, warning)
    })
}

fn of_both(a: &TagFinding, b: &TagFinding, warning: Warning) -> Warning {
    Warning {
        about: format!("tags {} and {}", a.name, b.name),
        ..warning
    }
}

fn of_camera(findings: &Findings, camera: &CameraFinding, all: &mut Vec<Warning>) {
    let about = ["camera", camera.name.as_str()];
    let looks = || findings.tags.iter().flat_map(|tag| &tag.looks);
    let sees = looks().any(|look| look.camera == camera.name && look.least.slack >= 0.0);
    let [forward, left, up] = camera.rises;
    let help = "frame m has its x axis along the optical axis, y left and z up: not the optical frame, whose roll and \
                yaw are -90 deg";
    if forward.abs() > STEEP && !sees {
        let at = if forward > 0.0 { "ceiling" } else { "floor" };
        all.push(warn(
            "camera_looks_up_or_down",
            about,
            format!(
                "it looks at the {at} ({:.1} deg), and sees no tag from any goal",
                camera.looks_deg[1]
            ),
            help,
        ));
    } else if left.abs() > STEEP && !sees {
        all.push(warn(
            "camera_on_its_side",
            about,
            format!(
                "its image lies on its side (roll {:.1} deg, looking to {:.1} deg), and it sees no tag from any goal",
                camera.mount.roll_deg, camera.looks_deg[0]
            ),
            help,
        ));
    } else if up < -STEEP && !sees {
        all.push(warn(
            "camera_upside_down",
            about,
            "its image is upside down, and it sees no tag from any goal".into(),
            help,
        ));
    }
    if camera.mount.z < 0.0 {
        all.push(warn(
            "camera_below_floor",
            about,
            format!("it is {:.3} m below the floor", -camera.mount.z),
            "`z` of the mount is the height above the floor",
        ));
    }
}

fn of_task(site: &Site, task: &Task, finding: &TaskFinding, all: &mut Vec<Warning>) {
    let about = ["task", finding.name.as_str()];
    let goal = radians(task.success.goal);
    let place = frame(goal);
    let mut outlines = Ingredients::of(&task.success.shape).outlines;
    outlines.push(std::vec![[0.0, 0.0]]);
    let wall = site.walls.iter().find(|wall| {
        wall.z[0] <= FLOOR
            && outlines.iter().any(|outline| {
                let robot: Vec<_> = outline.iter().map(|p| place.to_goal(*p)).collect();
                meet(&robot, &wall.corners)
            })
    });
    if let Some(wall) = wall {
        all.push(warn(
            "goal_in_wall",
            about,
            format!("the robot at its goal is in the wall {}", wall.name),
            "walls and goals are in the world frame",
        ));
    }
    hidden(&task.success.shape, task, about, all);
    let least = finding.deepest.least;
    if least.slack < 0.0 {
        let [x, y, yaw] = finding.deepest.pose;
        let short = short_by(least.slack);
        all.push(Warning {
            empties: true,
            ..warn(
                "set_empty",
                about,
                format!(
                    "no pose of its success set was found in the range of the search: nearest is ({x:.2} m, {y:.2} m, \
                     {:.1} deg), where `{}` is {short}",
                    yaw.to_degrees(),
                    least.name
                ),
                "see the warnings about its tags and its camera, or widen the limit",
            )
        });
    } else if finding.at_goal.slack < 0.0 {
        all.push(warn(
            "goal_outside",
            about,
            format!(
                "its goal is not in its success set: `{}` is {}",
                finding.at_goal.name,
                short_by(finding.at_goal.slack)
            ),
            "no pose-set about the goal is inside; see the picture of `posegate draw`",
        ));
    }
}

fn short_by(slack: f64) -> String {
    if slack.is_finite() {
        format!("short by {:.3}", -slack)
    } else {
        "never fulfilled".to_string()
    }
}

/// Warns of walls that hide a tag from all poses because its tolerance extends into them.
fn hidden(shape: &Shape, task: &Task, about: [&str; 2], all: &mut Vec<Warning>) {
    match shape {
        Shape::Any(sets) | Shape::All(sets) => {
            sets.iter().for_each(|set| hidden(set, task, about, all));
        }
        Shape::Apart(set @ Exclusion::Hidden { view, wall })
            if set.lines(task.success.goal).next().is_none() =>
        {
            all.push(warn(
                "tag_in_wall",
                about,
                format!(
                    "the tag with id {} is in the wall {} or, within its tolerance, behind it: it is not visible from anywhere",
                    view.tag.id, wall.name
                ),
                "remove the wall on which it is mounted from the set's `walls`, or move the tag in front of it",
            ));
        }
        _ => {}
    }
}
