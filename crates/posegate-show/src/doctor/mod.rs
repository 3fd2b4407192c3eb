//! Checks of a site: the views of its cameras, and likely mistakes.
//!
//! ```
//! use posegate_show::doctor::examine;
//! use posegate_site::{SAMPLE, Site};
//!
//! let site = Site::parse(SAMPLE, "site.toml")?;
//! assert!(examine(&site).warnings.is_empty());
//!
//! // The tag's face turned away from the robot, as a file with another convention would give it.
//! let turned = SAMPLE.replace("z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0", "z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0");
//! let site = Site::parse(&turned, "site.toml")?;
//! assert!(!examine(&site).warnings.is_empty());
//! # Ok::<(), posegate_site::SiteError>(())
//! ```

pub use self::cost::decision_costs;
pub use self::deepest::{Deepest, deepest};
pub use self::faults::{IMPOSSIBLE_ERROR, stated_error, stated_errors};
pub use self::warning::Warning;

mod collisions;
mod cost;
mod deepest;
mod faults;
mod mounting;
#[cfg(test)]
mod tests;
mod warning;

use crate::draw::ingredients::{Ingredients, axes, heading, radians};
use posegate::shape::MinSlack;
use posegate::shape::{Exclusion, Pose3Deg, Shape, SuccessSet, Tag, Tolerance, Visibility};
use posegate_site::{Site, SiteCamera, Task};

/// The findings about a site.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// The tags, by name.
    pub tags: Vec<TagFinding>,
    /// The candidates, by name.
    pub candidates: Vec<TagFinding>,
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
    /// The tag's name.
    pub name: String,
    /// The tag's number, size and pose.
    pub tag: Tag,
    /// The direction of the tag's face in the world: heading, in (-180, 180], and elevation; degrees.
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
    /// The camera's name.
    pub name: String,
    /// The camera's pose on the robot.
    pub mount: Pose3Deg,
    /// The camera's viewing direction on the robot: heading, in (-180, 180], and elevation; degrees.
    pub looks_deg: [f64; 2],
    /// The z components, in the robot's frame, of the camera's unit axes forward, left and up.
    pub rises: [f64; 3],
}

/// The findings about a task.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskFinding {
    /// The task's name.
    pub name: String,
    /// The least slack at the task's goal.
    pub at_goal: MinSlack,
    /// The deepest pose found in the task's set.
    pub deepest: Deepest,
}

/// Examines a site.
#[must_use]
pub fn examine(site: &Site) -> Findings {
    let finding = |name: &String, tag: &Tag| TagFinding {
        name: name.clone(),
        tag: *tag,
        faces_deg: heading(axes(&tag.pose)[0]),
        looks: looks(site, tag),
    };
    let tags = site.tags.iter().map(|(name, tag)| finding(name, &tag.tag));
    let candidates = site.candidates.iter();
    let candidates = candidates.map(|(name, candidate)| finding(name, &candidate.tag.tag));
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
        let depth = task.success.evaluator();
        TaskFinding {
            name: name.clone(),
            at_goal: slack_at_goal(&task.success),
            deepest: deepest(task, &depth),
        }
    });
    let mut findings = Findings {
        tags: tags.collect(),
        candidates: candidates.collect(),
        cameras: cameras.collect(),
        tasks: tasks.collect(),
        warnings: Vec::new(),
    };
    findings.warnings = faults::warnings(site, &findings);
    findings
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
    let mut all = vec![Shape::Visibility(view)];
    all.extend(site.walls.iter().map(|wall| {
        Shape::Apart(Exclusion::Hidden {
            view,
            wall: wall.clone(),
        })
    }));
    slack_at_goal(&SuccessSet {
        goal: task.success.goal,
        shape: Shape::All(all),
    })
}

/// Returns the least slack of a set at a task's goal. The slack of a wall that hides no tag is ignored: the distance
/// to its planes has no meaning.
fn slack_at_goal(set: &SuccessSet) -> MinSlack {
    let slack = set.membership(radians(set.goal)).slack;
    let known = slack
        .iter()
        .filter(|(name, slack)| *name != "wall" || *slack < 0.0);
    let least = known.min_by(|a, b| a.1.total_cmp(&b.1));
    least.map_or(MinSlack::EVERYTHING, |(name, slack)| MinSlack {
        slack: *slack,
        name,
    })
}
