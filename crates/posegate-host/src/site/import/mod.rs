//! Maps of tags and docks that others wrote: read into the tags and goals of a site.
//!
//! Nothing is guessed. A format that leaves the tag frame open needs a [`Convention`], one without sizes or
//! places needs them from outside, and what a format says itself cannot be said again.

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
mod nav2;
mod own;
mod place;
mod settings;
mod table;
#[cfg(test)]
mod tests;
mod wpilib;
mod write;

/// Whose file it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `wpilib`: a field layout in JSON. Its tag frame is [`Convention::Wpilib`].
    Wpilib,
    /// `apriltag_ros`: a `tags.yaml` with bundles of tags, and with single tags, which have no place.
    AprilTagRos,
    /// `nav2_docks`: a dock database in YAML. A dock's pose is where the robot's base stands when docked.
    Nav2Docks,
    /// `posegate`: `[tag.NAME]` and `[goal.NAME]` tables as in a site file.
    Posegate,
}

impl Format {
    /// The formats' names.
    pub const NAMES: [&str; 4] = ["wpilib", "apriltag_ros", "nav2_docks", "posegate"];

    /// The format of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "wpilib" => Self::Wpilib,
            "apriltag_ros" => Self::AprilTagRos,
            "nav2_docks" => Self::Nav2Docks,
            "posegate" => Self::Posegate,
            _ => return None,
        })
    }

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wpilib => "wpilib",
            Self::AprilTagRos => "apriltag_ros",
            Self::Nav2Docks => "nav2_docks",
            Self::Posegate => "posegate",
        }
    }

    /// The tag frame that the format itself fixes.
    #[must_use]
    pub const fn convention(self) -> Option<Convention> {
        match self {
            Self::Wpilib => Some(Convention::Wpilib),
            Self::Posegate => Some(Convention::Posegate),
            Self::AprilTagRos | Self::Nav2Docks => None,
        }
    }

    /// The file and what is chosen in it: `tags.yaml#dock` is the bundle `dock` of an apriltag_ros file.
    #[must_use]
    pub fn split(self, file: &str) -> (&str, Option<&str>) {
        match file.rsplit_once('#') {
            Some((file, part)) if self == Self::AprilTagRos => (file, Some(part)),
            _ => (file, None),
        }
    }
}

/// How to read a file of tags or docks: all that it does not say itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// Whose file it is.
    pub format: Format,
    /// The frame in which it gives its tags; needed where the format leaves it open.
    pub convention: Option<Convention>,
    /// The edge of the tags' black border, metres, where the format has none.
    pub size: Option<f64>,
    /// The tags' family, where the format has none.
    pub family: Option<String>,
    /// Where the file's frame stands in the world. A bundle's frame is placed like a tag of ours that would
    /// hang at its origin; a bundle needs it, other maps stand at the world's origin without it.
    pub pose: Option<Pose3Deg>,
    /// What stands before the number of a tag or the name of a dock: `t` for numbers, nothing for names.
    pub prefix: Option<String>,
    /// The bundle or single tag that is meant, in a file that has several.
    pub part: Option<String>,
    /// How far off the tags may be.
    pub tolerance: Option<Tolerance>,
}

/// What a file brought.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// Tags by name. Poses are rounded to a nanometre and 1e-9 degrees, but for those of format `posegate` that
    /// stay where they are.
    pub tags: BTreeMap<String, SiteTag>,
    /// Goals by name, rounded likewise.
    pub goals: BTreeMap<String, PoseDeg>,
}

/// Why nothing could be imported.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A fault in the file.
    #[error(transparent)]
    File(#[from] SiteError),
    /// A setting that is missing, that the format does not have, or whose value cannot be.
    #[error("{message}; expected {expected}")]
    Setting {
        /// Its name, as in the site file.
        key: &'static str,
        /// What is wrong.
        message: Box<str>,
        /// What was expected.
        expected: Box<str>,
        /// A value as one would write it; `None` where there is to be none.
        like: Option<Box<str>>,
    },
}

/// Something with its place in the file.
struct Placed<T> {
    at: Range<usize>,
    value: T,
}

/// Whether a tag can have this size, metres: larger ones are other units.
fn is_size(size: f64) -> bool {
    size > 0.0 && size <= 10.0
}

impl Import {
    /// A file of a format, of which nothing else is said.
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
        }
    }

    /// Reads the text of a file, which errors call `file_name`.
    ///
    /// # Errors
    ///
    /// A setting is missing or has no meaning in this format, or the file has a fault: the first one found.
    pub fn parse(&self, text: &str, file_name: &str) -> Result<Imported, ImportError> {
        let source = Source {
            file: file_name,
            text,
        };
        match self.format {
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
                    let what =
                        "the bundle's pose in the world, said like a tag's: x out of its face";
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
                let docks = nav2::read(source, self.pose.is_some())?;
                self.named(source, Vec::new(), docks)
            }
            Format::Posegate => {
                self.convention()?;
                self.refuse("size", self.size.is_some())?;
                self.refuse("family", self.family.is_some())?;
                self.refuse("tolerance", self.tolerance.is_some())?;
                let (mut tags, goals) = own::read(source)?;
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
                self.named(source, tags, goals)
            }
        }
    }

    /// Tags that are named by their numbers.
    fn numbered(
        &self,
        source: Source<'_>,
        family: &str,
        tags: Vec<(Range<usize>, Tag)>,
    ) -> Result<Imported, ImportError> {
        if tags.is_empty() {
            return Err(source
                .error(0..0, "the file has no tag")
                .expected("one tag at least")
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
                    .help("remove one of them, or hang another tag")
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
        Ok(Imported {
            tags,
            ..Imported::default()
        })
    }

    /// Tags and goals that have names.
    fn named(
        &self,
        source: Source<'_>,
        tags: Vec<(String, Placed<SiteTag>)>,
        goals: Vec<(String, Placed<PoseDeg>)>,
    ) -> Result<Imported, ImportError> {
        if tags.is_empty() && goals.is_empty() {
            return Err(source
                .error(0..0, "the file has no tag and no goal")
                .expected("one at least")
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
        })
    }
}

/// By name, where every name is one that a site can have.
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
    /// The tables of a site file that say the same, to the last bit; they are a file of the format `posegate`.
    #[must_use]
    pub fn to_toml(&self) -> String {
        write::tables(self).to_string()
    }
}
