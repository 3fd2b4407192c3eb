//! Site files: the cameras, tags and tasks of a place, in TOML.
//!
//! A site file states the tasks of a robot and the poses from which each of them succeeds; [`SAMPLE`] is a commented
//! example. Numbers are kept as written: metres, pixels, and degrees if a name ends in `_deg`. A file with a fault is
//! refused; the error states the position of the fault and how to fix it ([`SiteError`]). The gate ([`posegate::gate::Gate`]), its
//! tables and their proofs are in the package `posegate`.
//!
//! ```
//! use posegate_site::{SAMPLE, Site};
//!
//! let site = Site::parse(SAMPLE, "site.toml")?;
//! let dock = site.task("dock").expect("the sample has a task `dock`");
//! assert_eq!(dock.success.goal.yaw_deg, 0.0);
//!
//! let error = Site::parse("[camera.front]\nwidth = 640\n", "site.toml").unwrap_err();
//! assert!(error.to_string().starts_with("site.toml:2:1: unknown key `width`"));
//! # Ok::<(), posegate_site::SiteError>(())
//! ```
#![forbid(unsafe_code)]
#![deny(missing_docs)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use posegate::certify::Calibration;
use posegate::shape::{
    Camera, Intrinsics, Mount, Pose3Deg, PoseDeg, SuccessSet, Tag, Tolerance, Wall,
};
use posegate_learn::ErrorModel;

pub use posegate::bake::{Extent, Layout, Step, TableSpec};

pub use self::calibration::lens_of_ros;
pub use self::chain::{
    ChainStart, ChainStep, DriveModel, Navigation, SiteChain, StartFrame, StartUncertainty,
};
pub use self::controller::{Controller, Core};
pub use self::error::{Place, SiteError, UnknownChain, UnknownTask};
pub use self::families::FAMILIES;
pub use self::import::{
    Convention, DockDirection, DockTask, Format, Import, ImportError, Imported,
};
pub use self::learnt::stated_views;
pub use self::lines::line_of;
pub use self::places::pose_line;
pub use self::planner::{GeneratedLook, Planner};
pub use self::sample::SAMPLE;
pub use self::suggest::{question, similar};
pub use self::yaml::texts as yaml_texts;

mod calibration;
mod camera;
mod candidate;
mod chain;
mod controller;
pub mod controller_cost;
#[doc = include_str!("language.md")]
pub mod language {}

mod error;
mod families;
mod import;
pub mod inscribe;
mod json;
mod keys;
mod learnt;
mod lines;
mod named;
mod names;
mod parse;
mod places;
mod planner;
mod poses;
mod reader;
mod row;
mod sample;
mod success;
mod suggest;
mod syntax;
mod table_keys;
mod tags;
mod task;
#[cfg(test)]
mod tests;
mod yaml;

/// The contents of a site file.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// The robot's cameras by name.
    pub cameras: BTreeMap<String, SiteCamera>,
    /// The tags by name.
    pub tags: BTreeMap<String, SiteTag>,
    /// Places where tags could be mounted, by name. `posegate cover` chooses from them; no other command uses them.
    pub candidates: BTreeMap<String, Candidate>,
    /// The tasks by name.
    pub tasks: BTreeMap<String, Task>,
    /// The walls and blocks that may hide tags, by name.
    pub walls: Vec<Wall>,
    /// Poses that tasks can name as their goals, by name.
    pub goals: BTreeMap<String, PoseDeg>,
    /// Frames on the robot whose poses are recorded, by name: the pose of each in the base.
    pub frames: BTreeMap<String, Pose3Deg>,
    /// Chains of tasks, by name.
    pub chains: BTreeMap<String, SiteChain>,
    /// The driving of the robots.
    pub navigation: Navigation,
    /// The settings of the planner.
    pub planner: Planner,
    /// The default table of a task without its own. `None` if the file has no `[table]`, or one without an extent or a
    /// step.
    pub table: Option<TableSpec>,
    /// The probability with which the true pose lies in a Gaussian pose-set, in (0, 1).
    pub epsilon: f64,
    /// The motion controller, if the file names one: `posegate check` compares the cost of decisions with it.
    pub controller: Option<Controller>,
    /// SHA-256 of the file's bytes. If the site names calibration files, imports or learnt error models: SHA-256 of
    /// that digest and of the SHA-256 of each of these files, in the order of the cameras' names, then the imports'
    /// names, then the models' names.
    pub digest: [u8; 32],
    /// The files that the site file names, in the order of `digest`. The paths are relative to the working directory.
    pub files: Vec<PathBuf>,
    /// The learnt error models, by name.
    pub error_models: BTreeMap<String, ErrorModel>,
    /// The point of the map that is subtracted from every position in the file, in estimates and in the truth, metres. All poses of the
    /// site are relative to it.
    pub map_origin: [f64; 2],
    /// What was assumed where the files that the site names do not say it.
    pub remarks: Vec<Remark>,
    /// The error models that are formulas, by name.
    pub error_formulas: BTreeMap<String, posegate::shape::ErrorModel>,
}

impl Site {
    /// Returns the digest as hexadecimal digits.
    #[must_use]
    pub fn digest_text(&self) -> String {
        posegate_files::printable::hex(&self.digest)
    }

    /// Returns the digest of a task that a controller compares with the one in its table ([`posegate::shape::SuccessSet::digest`]). The rest
    /// of the file does not change it.
    #[must_use]
    pub fn task_digest(&self, task: &Task) -> [u8; 32] {
        task.success.digest(self.epsilon)
    }

    /// Returns the words that a document made from this site carries: the name of its file without folders, and the first 16 digits
    /// of the digest.
    #[must_use]
    pub fn origin(&self, name: &str) -> String {
        let file = Path::new(name).file_name();
        let name = file.map_or(name.into(), |file| file.to_string_lossy());
        format!("site {name}, digest {:.16}", self.digest_text())
    }

    /// The confidence if a site file gives none.
    pub const DEFAULT_EPSILON: f64 = 0.99;

    /// The smallest depth of a visible tag corner if a success set gives none, metres.
    pub const DEFAULT_Z_NEAR: f64 = 0.05;

    /// The cell size of a table if a site file gives none.
    pub const DEFAULT_STEP: Step = Step {
        xy: 0.02,
        yaw_deg: 1.0,
    };

    /// Reads a site from the text of a file. Errors name the file `file_name`; the paths of calibration files and
    /// imports are relative to its folder.
    ///
    /// # Errors
    ///
    /// The first fault in the text, or in another file that it names.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, SiteError> {
        parse::site(text, file_name)
    }

    /// Reads a site file.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is not UTF-8, or has a fault. The first fault is returned.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SiteError> {
        parse::read(path.as_ref())
    }

    /// Returns the task with a name.
    ///
    /// # Errors
    ///
    /// The site has no such task; the error names the most similar one.
    pub fn task(&self, name: &str) -> Result<&Task, UnknownTask> {
        self.tasks.get(name).ok_or_else(|| {
            let known = || self.tasks.keys().map(String::as_str);
            UnknownTask {
                name: name.to_owned(),
                similar: suggest::similar(name, known()).map(ToOwned::to_owned),
                known: known().map(ToOwned::to_owned).collect(),
            }
        })
    }

    /// Returns the chain with a name.
    ///
    /// # Errors
    ///
    /// The site has no such chain; the error names the most similar one.
    pub fn chain(&self, name: &str) -> Result<&SiteChain, UnknownChain> {
        self.chains.get(name).ok_or_else(|| {
            let known = || self.chains.keys().map(String::as_str);
            UnknownChain {
                name: name.to_owned(),
                similar: suggest::similar(name, known()).map(ToOwned::to_owned),
                known: known().map(ToOwned::to_owned).collect(),
            }
        })
    }

    /// Returns the extent, step and layout of a task's table: the values of the file, else the defaults. A missing
    /// extent is chosen so that it contains the success set, at most twice as wide as the task's expected pose-set
    /// ([`posegate::bake::extent`]). `None` if no such extent is found: for example, if the set is unbounded and the
    /// task has no `expected`.
    #[must_use]
    pub fn chosen_table(&self, task: &Task) -> Option<TableSpec> {
        chosen_table(&task.success, &task.wish)
    }

    /// Returns the extent, step and layout of a task's table: those of the task, else the site's default. `None` if
    /// neither is complete.
    #[must_use]
    pub fn table_spec<'a>(&'a self, task: &'a Task) -> Option<&'a TableSpec> {
        task.table.as_ref().or(self.table.as_ref())
    }
}

/// Returns the extent, step and layout of a set's table: the overrides, with a chosen extent if they have none
/// ([`Site::chosen_table`]).
pub fn chosen_table(success: &SuccessSet, wish: &TableOverrides) -> Option<TableSpec> {
    let extent = match wish.extent {
        Some(extent) => extent,
        None => posegate::bake::extent(success, wish.expected)?,
    };
    Some(TableSpec {
        extent,
        step: wish.step.unwrap_or(Site::DEFAULT_STEP),
        layout: wish.layout.unwrap_or_default(),
    })
}

/// What was assumed about an entry of a site, or is unlikely in a file that it names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remark {
    /// The kind and the name of the entry: `["camera", "front"]`.
    pub about: [String; 2],
    /// The assumption, or the unlikely number.
    pub note: Note,
}

/// A text of a [`Remark`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The kind of remark: a word for scripts.
    pub code: &'static str,
    /// The assumption, or the unlikely number.
    pub message: String,
    /// Advice on what to check.
    pub help: &'static str,
}

impl Note {
    /// Returns the note of an assumption.
    pub(crate) fn assumed(message: String) -> Self {
        Self {
            code: "assumed",
            message,
            help: "check that this is so; the file does not say it",
        }
    }
}

/// A camera of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SiteCamera {
    /// The image that the detector reads, and its visible part.
    pub camera: Camera,
    /// The camera's pose on the robot.
    pub mount: Mount,
    /// The tolerance of `mount`.
    pub mount_tolerance: Tolerance,
    /// The tolerance of the calibration's focal lengths and optical axis. The image border is widened by it.
    pub tolerance: Intrinsics,
    /// The share of the visible solid angle that [`Camera::view`] keeps
    /// ([`CertifiedCamera::kept`](posegate::certify::CertifiedCamera::kept)).
    pub kept: f64,
    /// The calibration from which the camera's image and window were computed.
    pub calibration: Calibration,
}

/// A tag of the site.
#[derive(Clone, Debug, PartialEq)]
pub struct SiteTag {
    /// The tag's family, as detectors name it: `tag36h11`.
    pub family: String,
    /// The tag's number, size and pose.
    pub tag: Tag,
    /// The tolerance of the tag's pose.
    pub tolerance: Tolerance,
}

/// A place where a tag could be mounted.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The tag as it would be mounted there. Its number is meaningless if `id` is `None`.
    pub tag: SiteTag,
    /// The tag's number if the site file gives one. Otherwise the tag gets a number when it is chosen.
    pub id: Option<u32>,
    /// The cost of mounting the tag there, above 0.
    pub cost: f64,
}

/// The effect of a task on the robot's knowledge of its pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskKind {
    /// No effect: the task only needs to succeed.
    Work,
    /// The task observes the pose, with an error of at most the task's [`ErrorBound`].
    Localization,
}

/// A task and its success set.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// The effect of the task on the robot's knowledge of its pose.
    pub kind: TaskKind,
    /// The goal and the poses around it from which the task succeeds. Cameras and tags that the file refers to by name
    /// are copied in.
    pub success: SuccessSet,
    /// The largest error of a localization. Every localization task has one; a work task has none.
    pub error_bound: Option<ErrorBound>,
    /// The name of the chain from whose start the robot drives to this task, if the file gives one.
    pub from: Option<String>,
    /// The task's own table, completed with the site's defaults. `None` if the task has no table of its own.
    pub table: Option<TableSpec>,
    /// The table settings of the task or the site.
    pub wish: TableOverrides,
}

/// The table settings in a site file; the rest is chosen ([`Site::chosen_table`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TableOverrides {
    /// The poses to cover; `None` if the file has none.
    pub extent: Option<Extent>,
    /// The cell size; `None` if the file has none.
    pub step: Option<Step>,
    /// The layouts to write; `None` if the file has none.
    pub layout: Option<Layout>,
    /// The bounded pose-set, about the goal, in which the robot is expected; `None` if the file has none.
    pub expected: Option<Tolerance>,
}

/// The largest error of a localization (`r_l`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBound {
    /// Metres, above 0.
    pub translation: f64,
    /// Degrees, above 0.
    pub yaw_deg: f64,
    /// The share of observations within the bound, above 0 and at most 1.
    pub coverage: f64,
}

impl ErrorBound {
    /// Returns translation and yaw in metres and radians.
    #[must_use]
    pub const fn metres_radians(&self) -> [f64; 2] {
        [self.translation, self.yaw_deg.to_radians()]
    }
}
