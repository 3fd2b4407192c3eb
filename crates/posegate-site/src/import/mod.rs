//! Reads maps of tags and docks from other programs into the tags and goals of a site.
//!
//! Nothing is guessed. A format that does not define the tag frame needs a [`Convention`]; a format without sizes or
//! poses needs them as settings. A setting that the format itself defines is refused.

use std::collections::BTreeMap;
use std::ops::Range;

use self::place::{Frame, on_the_floor, transposed};
use super::error::{SiteError, Source};
use super::reader::name_fault;
use super::{SiteTag, keys};
use posegate::shape::{Pose3Deg, PoseDeg, Tag, Tolerance};

pub use self::convention::Convention;
pub(super) use self::table::imports;

mod apriltag_ros;
mod convention;
mod fmap;
mod nav2;
mod own;
mod place;
mod settings;
mod table;
#[cfg(test)]
mod tests;
mod wpilib;
mod write;

/// The format of an import file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `fmap`: a field map of Limelight in JSON. Its tag frame is [`Convention::Wpilib`]; its origin is the middle of the field.
    Fmap,
    /// `wpilib`: a field layout in JSON. Its tag frame is [`Convention::Wpilib`].
    Wpilib,
    /// `apriltag_ros`: a `tags.yaml` with bundles of tags, and with single tags, which have no pose.
    AprilTagRos,
    /// `nav2_docks`: a dock database in YAML, or the parameters of the docking server. A dock's pose is that of the robot's base when it
    /// is docked, with the opposite heading if the robot enters backward.
    Nav2Docks,
    /// `posegate`: `[tag.NAME]` and `[goal.NAME]` tables as in a site file.
    Posegate,
}

impl Format {
    /// The names of the formats.
    pub const NAMES: [&str; 5] = ["wpilib", "fmap", "apriltag_ros", "nav2_docks", "posegate"];

    /// Returns the format with a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "wpilib" => Self::Wpilib,
            "fmap" => Self::Fmap,
            "apriltag_ros" => Self::AprilTagRos,
            "nav2_docks" => Self::Nav2Docks,
            "posegate" => Self::Posegate,
            _ => return None,
        })
    }

    /// Returns the format's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wpilib => "wpilib",
            Self::Fmap => "fmap",
            Self::AprilTagRos => "apriltag_ros",
            Self::Nav2Docks => "nav2_docks",
            Self::Posegate => "posegate",
        }
    }

    /// Returns the tag frame that the format defines; `None` if it defines none.
    #[must_use]
    pub const fn convention(self) -> Option<Convention> {
        match self {
            Self::Wpilib | Self::Fmap => Some(Convention::Wpilib),
            Self::Posegate => Some(Convention::Posegate),
            Self::AprilTagRos | Self::Nav2Docks => None,
        }
    }

    /// Splits a path from the part after `#`: `tags.yaml#dock` is the bundle `dock` of an apriltag_ros file.
    #[must_use]
    pub fn split(self, file: &str) -> (&str, Option<&str>) {
        match file.rsplit_once('#') {
            Some((file, part)) if self == Self::AprilTagRos => (file, Some(part)),
            _ => (file, None),
        }
    }
}

/// How a robot enters a dock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DockDirection {
    /// `forward`: the docked robot has the heading of the dock's pose.
    Forward,
    /// `backward`: the docked robot has the opposite heading.
    Backward,
}

impl DockDirection {
    /// The names of the directions.
    pub const NAMES: [&str; 2] = ["forward", "backward"];

    /// Returns the direction with a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "forward" => Some(Self::Forward),
            "backward" => Some(Self::Backward),
            _ => None,
        }
    }

    /// Returns the direction's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Backward => "backward",
        }
    }
}

/// A task of a dock: the robot's position within a distance of the goal of the same name, at any heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DockTask {
    /// Metres, above 0.
    pub radius: f64,
}

/// The settings for reading a file of tags or docks: everything that the file itself does not contain.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The format of the file.
    pub format: Format,
    /// The tag frame of the file; needed if the format does not define it.
    pub convention: Option<Convention>,
    /// The edge length of the tags' black border, metres, if the format has none.
    pub size: Option<f64>,
    /// The tags' family, if the format has none.
    pub family: Option<String>,
    /// The pose of the file's frame in the world. For a bundle: the pose of one of our tags mounted at the
    /// bundle's origin. A bundle needs it; other maps are at the world's origin without it.
    pub pose: Option<Pose3Deg>,
    /// The prefix of names. `None` is `t` before a tag's number, and nothing before a dock's name.
    pub prefix: Option<String>,
    /// The bundle or single tag to read, if the file has several.
    pub part: Option<String>,
    /// The tolerance of the tags' poses; `None` for none.
    pub tolerance: Option<Tolerance>,
    /// How the robot enters docks, if the file does not say it; `None` is forward, with a remark.
    pub dock_direction: Option<DockDirection>,
    /// The frame whose docks are read; needed if the file has docks of several frames.
    pub frame: Option<String>,
}

/// The contents of an import file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// Tags by name. Poses are rounded to a nanometre and 1e-9 degrees, except in format `posegate` if they are
    /// not moved.
    pub tags: BTreeMap<String, SiteTag>,
    /// Goals by name, rounded in the same way.
    pub goals: BTreeMap<String, PoseDeg>,
    /// Tasks by the names of their goals.
    pub tasks: BTreeMap<String, DockTask>,
    /// Everything that was assumed, and what the file says beyond tags and goals.
    pub remarks: Vec<String>,
}

/// The reason why an import failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A fault in the file.
    #[error(transparent)]
    File(#[from] SiteError),
    /// A setting is missing, does not exist in the format, or has an invalid value.
    #[error("{message}; expected {expected}")]
    Setting {
        /// The setting's name, as in the site file.
        key: &'static str,
        /// The fault.
        message: Box<str>,
        /// The expected value.
        expected: Box<str>,
        /// An example value; `None` if the setting must be removed.
        like: Option<Box<str>>,
    },
}

/// A value with its position in the file.
struct Placed<T> {
    at: Range<usize>,
    value: T,
}

/// Returns a remark for the farthest of some named places if it is so far away that the file may have other units.
fn far_remark<'n>(places: impl Iterator<Item = (&'n str, f64, f64)>) -> Option<String> {
    /// Metres; more than the size of a hall.
    const FAR: f64 = 300.0;
    let all = places.map(|(name, x, y)| (name, x.hypot(y)));
    let (name, distance) = all.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (distance > FAR).then(|| {
        format!(
            "`{name}` is {distance:.0} m from the origin: if the file has other units than metres, convert it; if the map's origin is far away, \
             write [origin] in the site"
        )
    })
}

/// Returns `true` if a tag can have this size, metres. Larger numbers must be in other units.
fn is_size(size: f64) -> bool {
    size > 0.0 && size <= 10.0
}

impl Import {
    /// Returns the settings for a format, with all others unset.
    #[must_use]
    pub const fn of(format: Format) -> Self {
        Self {
            format,
            convention: None,
            size: None,
            family: None,
            pose: None,
            prefix: None,
            part: None,
            tolerance: None,
            dock_direction: None,
            frame: None,
        }
    }

    /// Reads the text of a file. Errors name the file `file_name`.
    ///
    /// # Errors
    ///
    /// A setting is missing or has no meaning in this format, or the file has a fault. The first fault is
    /// returned.
    pub fn parse(&self, text: &str, file_name: &str) -> Result<Imported, ImportError> {
        let source = Source {
            file: file_name,
            text,
        };
        let of_docks = self.format == Format::Nav2Docks;
        self.refuse("dock_direction", self.dock_direction.is_some() && !of_docks)?;
        self.refuse("frame", self.frame.is_some() && !of_docks)?;
        match self.format {
            Format::Fmap => {
                let convention = self.convention()?;
                self.refuse("size", self.size.is_some())?;
                self.refuse("family", self.family.is_some())?;
                let world = self.world();
                let found = fmap::read(source)?;
                let tags = found.tags.into_iter().map(|tag| {
                    let (id, size, frame) = tag.value;
                    let pose = world.then(&frame).with_axes(convention.axes()).pose();
                    (tag.at, Tag { id, size, pose })
                });
                let mut imported = self.numbered(source, found.family, tags.collect())?;
                if self.pose.is_none() {
                    imported.remarks.push(
                        "the origin is the middle of the field, as in the file (WPILib's is a corner): --pose moves it".into(),
                    );
                }
                Ok(imported)
            }
            Format::Wpilib => {
                let convention = self.convention()?;
                let (size, family) = (self.size()?, self.family()?);
                let world = self.world();
                let tags = wpilib::read(source)?.into_iter().map(|tag| {
                    let (id, frame) = tag.value;
                    let pose = world.then(&frame).with_axes(convention.axes()).pose();
                    let tag_of = Tag { id, size, pose };
                    (tag.at, tag_of)
                });
                self.numbered(source, family, tags.collect())
            }
            Format::AprilTagRos => {
                let convention = self.convention()?;
                self.refuse("size", self.size.is_some())?;
                let family = self.family()?;
                let Some(pose) = self.pose else {
                    let what = "the bundle's pose in the world, like a tag's: x out of its face";
                    return Err(self.missing(keys::POSE.name, what, keys::POSE.like));
                };
                let bundle = Frame::of_pose(pose).with_axes(transposed(convention.axes()));
                let tags = apriltag_ros::read(source, self.part.as_deref())?;
                let tags = tags.into_iter().map(|tag| {
                    let (id, size, frame) = tag.value;
                    let pose = bundle.then(&frame).with_axes(convention.axes()).pose();
                    (tag.at, Tag { id, size, pose })
                });
                self.numbered(source, family, tags.collect())
            }
            Format::Nav2Docks => {
                self.refuse("convention", self.convention.is_some())?;
                self.refuse("size", self.size.is_some())?;
                self.refuse("family", self.family.is_some())?;
                self.refuse("tolerance", self.tolerance.is_some())?;
                self.flat()?;
                let found = nav2::read(source, self)?;
                let mut imported = self.named(source, Vec::new(), found.docks)?;
                let prefix = self.prefix.as_deref().unwrap_or("");
                let tasks = found.tasks.into_iter();
                imported.tasks = tasks
                    .map(|(name, task)| (format!("{prefix}{name}"), task))
                    .collect();
                let places = imported.goals.iter();
                let far = far_remark(places.map(|(name, goal)| (name.as_str(), goal.x, goal.y)));
                imported.remarks = found.remarks.into_iter().chain(far).collect();
                Ok(imported)
            }
            Format::Posegate => {
                self.convention()?;
                self.refuse("size", self.size.is_some())?;
                self.refuse("family", self.family.is_some())?;
                self.refuse("tolerance", self.tolerance.is_some())?;
                let (mut tags, goals, has_tasks) = own::read(source)?;
                if !goals.is_empty() {
                    self.flat()?;
                }
                if self.pose.is_some() {
                    let world = self.world();
                    for (_, tag) in &mut tags {
                        let pose = &mut tag.value.tag.pose;
                        *pose = world.then(&Frame::of_pose(*pose)).pose();
                    }
                }
                let mut imported = self.named(source, tags, goals)?;
                if has_tasks {
                    let remark = "the file's tasks are not imported: paste them into the site file";
                    imported.remarks.push(remark.into());
                }
                Ok(imported)
            }
        }
    }

    /// Returns tags whose names are made from their numbers.
    fn numbered(
        &self,
        source: Source<'_>,
        family: &str,
        tags: Vec<(Range<usize>, Tag)>,
    ) -> Result<Imported, ImportError> {
        if tags.is_empty() {
            return Err(source
                .error(0..0, "the file has no tag")
                .expected("at least one tag")
                .help("export the map again")
                .into());
        }
        let mut seen: BTreeMap<u32, usize> = BTreeMap::new();
        for (at, tag) in &tags {
            if let Some(first) = seen.insert(tag.id, at.start) {
                let first = 1 + source.text[..first].matches('\n').count();
                return Err(source
                    .error(
                        at.clone(),
                        format!("tag {} is there twice, first in line {first}", tag.id),
                    )
                    .expected("each number once: a detector cannot tell such tags apart")
                    .help("remove one of them, or mount a tag with another number")
                    .into());
            }
        }
        let prefix = self.prefix.as_deref().unwrap_or("t");
        let named = tags.into_iter().map(|(at, tag)| {
            let name = format!("{prefix}{}", tag.id);
            let value = SiteTag {
                family: family.to_owned(),
                tag,
                tolerance: self.tolerance.unwrap_or(Tolerance::NONE),
            };
            (name, Placed { at, value })
        });
        let tags = unique(source, named.collect())?;
        let places = tags.iter().map(|(name, tag)| {
            let pose = tag.tag.pose;
            (name.as_str(), pose.x, pose.y)
        });
        Ok(Imported {
            remarks: far_remark(places).into_iter().collect(),
            tags,
            ..Imported::default()
        })
    }

    /// Returns tags and goals that have names in the file.
    fn named(
        &self,
        source: Source<'_>,
        tags: Vec<(String, Placed<SiteTag>)>,
        goals: Vec<(String, Placed<PoseDeg>)>,
    ) -> Result<Imported, ImportError> {
        if tags.is_empty() && goals.is_empty() {
            return Err(source
                .error(0..0, "the file has no tag and no goal")
                .expected("at least one tag or goal")
                .help("check that it is the file that is meant")
                .into());
        }
        let prefix = self.prefix.as_deref().unwrap_or("");
        let goals = goals.into_iter().map(|(name, goal)| {
            let value = match self.pose {
                Some(pose) => on_the_floor(pose, goal.value),
                None => goal.value,
            };
            (format!("{prefix}{name}"), Placed { at: goal.at, value })
        });
        let tags = tags
            .into_iter()
            .map(|(name, tag)| (format!("{prefix}{name}"), tag));
        Ok(Imported {
            tags: unique(source, tags.collect())?,
            goals: unique(source, goals.collect())?,
            ..Imported::default()
        })
    }
}

/// Returns the entries by name. Every name must be valid in a site.
fn unique<T>(
    source: Source<'_>,
    entries: Vec<(String, Placed<T>)>,
) -> Result<BTreeMap<String, T>, SiteError> {
    let mut all = BTreeMap::new();
    for (name, entry) in entries {
        if let Some(fault) = name_fault(&name) {
            return Err(source
                .error(entry.at, format!("the name {name:?} {fault}"))
                .expected("a name of 1 to 32 bytes in UTF-8")
                .help("choose a shorter name or `prefix`"));
        }
        all.insert(name, entry.value);
    }
    Ok(all)
}

impl Imported {
    /// Returns the tables of a site file with the same contents, to the last bit: a file of format `posegate`.
    #[must_use]
    pub fn to_toml(&self) -> String {
        write::tables(self).to_string()
    }
}
