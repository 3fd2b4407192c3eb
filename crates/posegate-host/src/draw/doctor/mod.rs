//! Checks of a site: what its cameras see, and what is likely a wrong convention.

pub use self::deepest::{Deepest, deepest};
pub use self::faults::{IMPOSSIBLE_ERROR, Warning, stated_errors};
pub use self::portrait::{camera_portrait, tag_portrait};
pub use self::site_plan::site_plan;

mod collisions;
mod deepest;
mod faults;
mod portrait;
mod site_plan;
#[cfg(test)]
mod tests;

use super::depth::{MinSlack, SlackEvaluator};
use super::ingredients::{Ingredients, axes};
use crate::site::{Site, SiteCamera, Task};
use posegate::shape::{Exclusion, Pose3Deg, Shape, SuccessSet, Tag, Tolerance, Visibility};

/// The findings about a site.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// The tags, by name.
    pub tags: Vec<TagFinding>,
    /// The cameras, by name.
    pub cameras: Vec<CameraFinding>,
    /// The tasks, by name.
    pub tasks: Vec<TaskFinding>,
    /// Likely mistakes.
    pub warnings: Vec<Warning>,
}

/// The findings about a tag.
#[derive(Clone, Debug, PartialEq)]
pub struct TagFinding {
    /// Its name.
    pub name: String,
    /// Its number, size and pose.
    pub tag: Tag,
    /// The heading of its face, degrees in (-180, 180], and its elevation.
    pub faces_deg: [f64; 2],
    /// The views of the tag, from the goal of every task by every camera.
    pub looks: Vec<Look>,
}

/// The view of a tag by a camera at a task's goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// The task's name.
    pub task: String,
    /// The camera's name.
    pub camera: String,
    /// `true` if the task looks at this tag with this camera. Then the task's limits apply, else only the
    /// image and the tag's face. Walls hide the tag in both cases; tolerances are ignored.
    pub own: bool,
    /// The least slack; at least 0 if the tag is seen.
    pub least: MinSlack,
}

/// The findings about a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFinding {
    /// Its name.
    pub name: String,
    /// Its pose on the robot.
    pub mount: Pose3Deg,
    /// Its viewing direction on the robot: the heading, degrees in (-180, 180], and the elevation.
    pub looks_deg: [f64; 2],
    /// The z components of its unit axes forward, left and up.
    pub rises: [f64; 3],
}

/// The findings about a task.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskFinding {
    /// Its name.
    pub name: String,
    /// The least slack at its goal.
    pub at_goal: MinSlack,
    /// The deepest pose found in its set.
    pub deepest: Deepest,
}

/// Examines a site.
#[must_use]
pub fn examine(site: &Site) -> Findings {
    let tags = site.tags.iter().map(|(name, tag)| TagFinding {
        name: name.clone(),
        tag: tag.tag,
        faces_deg: heading(axes(&tag.tag.pose)[0]),
        looks: looks(site, &tag.tag),
    });
    let cameras = site.cameras.iter().map(|(name, camera)| {
        let axes = axes(&camera.mount);
        CameraFinding {
            name: name.clone(),
            mount: camera.mount,
            looks_deg: heading(axes[0]),
            rises: axes.map(|axis| axis[2]),
        }
    });
    let tasks = site.tasks.iter().map(|(name, task)| {
        let depth = SlackEvaluator::of(&task.success);
        TaskFinding {
            name: name.clone(),
            at_goal: told(&task.success),
            deepest: deepest(task, &depth),
        }
    });
    let mut findings = Findings {
        tags: tags.collect(),
        cameras: cameras.collect(),
        tasks: tasks.collect(),
        warnings: Vec::new(),
    };
    findings.warnings = faults::warnings(site, &findings);
    findings
}

/// Draws the pictures of a site. Returns file names and SVG texts.
#[must_use]
pub fn pictures(site: &Site) -> Vec<(String, String)> {
    let mut files = std::vec![("site.svg".to_owned(), site_plan(site))];
    let mut add = |kind: &str, name: &str, text: String| {
        // Names may contain any character; keep only those that every system accepts in file names.
        let plain = |c: char| {
            if c.is_ascii_alphanumeric() || c == '-' {
                c
            } else {
                '_'
            }
        };
        let stem: String = name.chars().map(plain).collect();
        let mut file = format!("{kind}-{stem}.svg");
        let mut count = 1;
        // Some systems ignore the case of file names.
        while files
            .iter()
            .any(|(known, _)| known.eq_ignore_ascii_case(&file))
        {
            count += 1;
            file = format!("{kind}-{stem}-{count}.svg");
        }
        files.push((file, text));
    };
    for (name, tag) in &site.tags {
        add("tag", name, tag_portrait(name, &tag.tag));
    }
    for (name, camera) in &site.cameras {
        add("camera", name, camera_portrait(name, camera));
    }
    files
}

fn looks(site: &Site, tag: &Tag) -> Vec<Look> {
    let mut looks = Vec::new();
    for (name, task) in &site.tasks {
        for (camera_name, camera) in &site.cameras {
            let (view, own) = view(task, camera, tag);
            looks.push(Look {
                task: name.clone(),
                camera: camera_name.clone(),
                own,
                least: seen(site, task, view),
            });
        }
    }
    looks
}

/// Returns a task's view of a tag with a camera, or a view with general limits. Also returns `true` if the
/// view is the task's own.
fn view(task: &Task, camera: &SiteCamera, tag: &Tag) -> (Visibility, bool) {
    let views = Ingredients::of(&task.success.shape).views;
    let own = views
        .into_iter()
        .find(|view| view.tag == *tag && view.mount == camera.mount);
    let view = own.unwrap_or(Visibility {
        camera: camera.camera,
        mount: camera.mount,
        tag: *tag,
        d_max: f64::INFINITY,
        phi_max_deg: 90.0,
        // A tag cannot be read from nearly edge-on.
        psi_max_deg: 80.0,
        z_near: Site::DEFAULT_Z_NEAR,
        tag_tolerance: Tolerance::NONE,
        mount_tolerance: Tolerance::NONE,
        sharpness: None,
        error_room: None,
    });
    let exact = Visibility {
        tag_tolerance: Tolerance::NONE,
        mount_tolerance: Tolerance::NONE,
        ..view
    };
    (exact, own.is_some())
}

/// Returns the least slack of a view from a task's goal, with every wall as an obstacle.
fn seen(site: &Site, task: &Task, view: Visibility) -> MinSlack {
    let mut all = std::vec![Shape::Visibility(view)];
    all.extend(site.walls.iter().map(|wall| {
        Shape::Apart(Exclusion::Hidden {
            view,
            wall: wall.clone(),
        })
    }));
    told(&SuccessSet {
        goal: task.success.goal,
        shape: Shape::All(all),
    })
}

/// Returns the least slack of a set at a task's goal. The slack of a wall that hides nothing is ignored:
/// the distance to its planes has no meaning.
fn told(set: &SuccessSet) -> MinSlack {
    let slack = set.membership(super::ingredients::radians(set.goal)).slack;
    let known = slack
        .iter()
        .filter(|(name, slack)| *name != "wall" || *slack < 0.0);
    let least = known.min_by(|a, b| a.1.total_cmp(&b.1));
    least.map_or(
        MinSlack {
            slack: f64::INFINITY,
            name: "all",
        },
        |(name, slack)| MinSlack {
            slack: *slack,
            name,
        },
    )
}

/// Returns a direction's heading and elevation, degrees, rounded to the millionth, so that 180 in the site
/// file is 180 here.
fn heading([x, y, z]: [f64; 3]) -> [f64; 2] {
    let heading = libm::atan2(y, x).to_degrees();
    let rise = libm::atan2(z, libm::hypot(x, y)).to_degrees();
    let [heading, rise] = [heading, rise].map(|deg| libm::round(deg * 1e6) * 1e-6 + 0.0);
    [if heading <= -180.0 { 180.0 } else { heading }, rise]
}
