//! Site files: the cameras, tags and tasks of a place, in TOML.
//!
//! A site file says where a robot's tasks are and from which poses each of them succeeds;
//! [`SAMPLE`] is a commented one. Its numbers are kept as written: metres, pixels, and degrees
//! where a name ends in `_deg`. A file that says something else than it should is refused whole,
//! with the place of the fault and how to mend it ([`SiteError`]).
//!
//! ```
//! use posegate_host::site::{SAMPLE, Site};
//!
//! let site = Site::parse(SAMPLE, "site.toml")?;
//! let dock = site.task("dock").expect("the sample has a task `dock`");
//! assert_eq!(dock.success.goal.yaw_deg, 0.0);
//!
//! let error = Site::parse("[camera.front]\nwidth = 640\n", "site.toml").unwrap_err();
//! assert!(error.to_string().starts_with("site.toml:2:1: unknown key `width`"));
//! # Ok::<(), posegate_host::site::SiteError>(())
//! ```

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::learn::ErrorModel;
use posegate::certify::Calibration;
use posegate::shape::{Camera, Intrinsics, Mount, PoseDeg, SuccessSet, Tag, Tolerance, Wall};

pub use posegate::bake::{Extent, Layout, Step, TableSpec};

pub use self::chain::{
    ChainStart, ChainStep, DriveModel, Navigation, SiteChain, StartFrame, StartUncertainty,
};
pub use self::contents::SiteIndex;
pub use self::error::{Place, SiteError, UnknownChain, UnknownTask};
pub use self::import::{Convention, Format, Import, ImportError, Imported};
pub(crate) use self::learnt::stated_views;
pub use self::planner::{GeneratedLook, Planner};
pub use self::sample::SAMPLE;

mod calibration;
mod camera;
mod candidate;
mod chain;
mod contents;
#[doc = include_str!("language.md")]
pub mod language {}

mod error;
mod import;
mod json;
mod keys;
mod learnt;
mod named;
mod parse;
mod places;
mod planner;
mod reader;
mod sample;
mod sections;
mod success;
mod suggest;
#[cfg(test)]
mod tests;
mod yaml;

/// A site: everything that a site file says.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// The robot's cameras by name.
    pub cameras: BTreeMap<String, SiteCamera>,
    /// The tags by name.
    pub tags: BTreeMap<String, SiteTag>,
    /// Places where tags could hang, by name: `posegate cover` chooses from them, and nothing else sees them.
    pub candidates: BTreeMap<String, Candidate>,
    /// The tasks by name.
    pub tasks: BTreeMap<String, Task>,
    /// The walls and blocks that may hide tags, by name.
    pub walls: Vec<Wall>,
    /// Poses that tasks can name as their goals, by name.
    pub goals: BTreeMap<String, PoseDeg>,
    /// Chains of tasks, by name.
    pub chains: BTreeMap<String, SiteChain>,
    /// How the robots drive.
    pub navigation: Navigation,
    /// What the planner may do.
    pub planner: Planner,
    /// What tables cover unless a task says otherwise; `None` where the file's `[table]` lacks an
    /// extent or a step, or is missing.
    pub table: Option<TableSpec>,
    /// The probability with which the true pose lies in a Gaussian pose-set, in (0, 1).
    pub epsilon: f64,
    /// SHA-256 of the file's bytes; where it names calibration files, imports or learnt error models, of this and of
    /// the SHA-256 of each, in the order of the cameras' names, then of the imports' and of the models'.
    pub digest: [u8; 32],
    /// The files that the site file names, in the order of `digest`: their paths from where the program runs.
    pub files: Vec<PathBuf>,
    /// The error models that were learnt, by name.
    pub error_models: BTreeMap<String, ErrorModel>,
}

impl Site {
    /// The confidence of a site file that gives none.
    pub const DEFAULT_EPSILON: f64 = 0.99;

    /// The depth below which a tag's corner is not seen, metres, where a success set gives none.
    pub const DEFAULT_Z_NEAR: f64 = 0.05;

    /// The cells of a table where a site file gives none.
    pub const DEFAULT_STEP: Step = Step {
        xy: 0.02,
        yaw_deg: 1.0,
    };

    /// Reads a site from the text of a file; errors call the file `file_name`, and calibration files and
    /// imports are looked for beside it.
    ///
    /// # Errors
    ///
    /// The first fault found in the text, or in another file that it names.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, SiteError> {
        parse::site(text, file_name)
    }

    /// Reads a site file.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is no UTF-8, or has a fault: the first one found.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SiteError> {
        parse::read(path.as_ref())
    }

    /// The task of a name.
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

    /// The chain of a name.
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

    /// What a task's table covers: what the file says, and where it leaves out the extent one that holds the
    /// success set, no wider than the task's expected pose-set ([`posegate::bake::extent`]). `None` where the
    /// set has no bound and nothing is expected.
    #[must_use]
    pub fn chosen_table(&self, task: &Task) -> Option<TableSpec> {
        chosen_table(&task.success, &task.wish)
    }

    /// What a task's table covers: its own table, or else the site's default.
    #[must_use]
    pub fn table_spec<'a>(&'a self, task: &'a Task) -> Option<&'a TableSpec> {
        task.table.as_ref().or(self.table.as_ref())
    }
}

/// What a table of a set covers: what is wished, and where no extent is one that holds the set
/// ([`Site::chosen_table`]).
pub(crate) fn chosen_table(success: &SuccessSet, wish: &TableOverrides) -> Option<TableSpec> {
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

/// A camera of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SiteCamera {
    /// The image that the detector reads, and what is seen in it.
    pub camera: Camera,
    /// Where it sits on the robot.
    pub mount: Mount,
    /// How far off that may be.
    pub mount_tolerance: Tolerance,
    /// How far off the calibration's focal lengths and optical axis may be: what is seen keeps so much more from
    /// the image's border.
    pub tolerance: Intrinsics,
    /// The share of what is seen that [`Camera::view`] keeps ([`CertifiedCamera::kept`](posegate::certify::CertifiedCamera::kept)).
    pub kept: f64,
    /// What the camera's image and window were made from.
    pub calibration: Calibration,
}

/// A tag of the site.
#[derive(Clone, Debug, PartialEq)]
pub struct SiteTag {
    /// Its family, as detectors name it: `tag36h11`.
    pub family: String,
    /// Its number, size and pose.
    pub tag: Tag,
    /// How far off its pose may be.
    pub tolerance: Tolerance,
}

/// A place where a tag could hang.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The tag as it would hang there; its number means nothing unless `id` says it.
    pub tag: SiteTag,
    /// Its number, where the site file says it; else it gets one when it is chosen.
    pub id: Option<u32>,
    /// What it costs to hang it there, above 0.
    pub cost: f64,
}

/// What a task does to the robot's knowledge of its pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskKind {
    /// Nothing: it only needs to succeed.
    Work,
    /// It observes the pose, with an error of at most the task's [`ErrorBound`].
    Localization,
}

/// A task and where it succeeds.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// What it does to the robot's knowledge of its pose.
    pub kind: TaskKind,
    /// The goal and the poses around it from which the task succeeds; cameras and tags that the
    /// file refers to by name are copied in.
    pub success: SuccessSet,
    /// The largest error of a localization; every localization task has one, no work task has.
    pub error_bound: Option<ErrorBound>,
    /// The chain whose start a robot sets out from for this task, where the file says it.
    pub from: Option<String>,
    /// What the task's own table covers, with the site's defaults where it says nothing; `None`
    /// where the task has no table of its own.
    pub table: Option<TableSpec>,
    /// What is said of its table, by itself or by the site.
    pub wish: TableOverrides,
}

/// What a site file says of a table; the rest is chosen ([`Site::chosen_table`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TableOverrides {
    /// What to cover.
    pub extent: Option<Extent>,
    /// How finely.
    pub step: Option<Step>,
    /// The layouts.
    pub layout: Option<Layout>,
    /// Where the robot is expected about the goal: a bounded pose-set.
    pub expected: Option<Tolerance>,
}

/// The largest error of a localization (r_l).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBound {
    /// Metres, above 0.
    pub translation: f64,
    /// Degrees, above 0.
    pub yaw_deg: f64,
    /// The share of observations that are within it, above 0 and at most 1.
    pub coverage: f64,
}

impl ErrorBound {
    /// Translation and yaw in metres and radians.
    #[must_use]
    pub const fn metres_radians(&self) -> [f64; 2] {
        [self.translation, self.yaw_deg.to_radians()]
    }
}
