//! Checks an import's settings: values that the format defines must not be set, all others must.

use super::place::Frame;
use super::{Convention, Format, Import, ImportError, is_size};
use crate::families::meant_family;
use crate::keys;
use posegate::shape::Pose3Deg;

impl Import {
    /// Returns the frame of the tags: that of the format, or the setting if the format does not define one.
    pub(super) fn convention(&self) -> Result<Convention, ImportError> {
        let format = self.format.name();
        match (self.format.convention(), self.convention) {
            (None, Some(said)) => Ok(said),
            (Some(fixed), None) => Ok(fixed),
            (Some(fixed), Some(said)) if fixed == said => Ok(fixed),
            (Some(fixed), Some(said)) => Err(ImportError::Setting {
                key: keys::CONVENTION.name,
                message: format!(
                    "the convention is `{}`, the format `{format}` has its own",
                    said.name()
                )
                .into(),
                expected: format!("`{}` ({}), or none", fixed.name(), fixed.axes_in_words()).into(),
                like: Some(format!("\"{}\"", fixed.name()).into()),
            }),
            // No example: users would copy it.
            (None, None) => Err(self.missing(
                keys::CONVENTION.name,
                keys::CONVENTION.what,
                &Convention::NAMES
                    .map(|name| format!("\"{name}\""))
                    .join(" | "),
            )),
        }
    }

    pub(super) fn size(&self) -> Result<f64, ImportError> {
        let key = &keys::SIZE;
        match self.size {
            Some(size) if is_size(size) => Ok(size),
            Some(size) => Err(ImportError::Setting {
                key: key.name,
                message: format!("the tags' size is {size}").into(),
                expected: "the black border's outer edge in metres, above 0 and at most 10".into(),
                like: Some(key.like.into()),
            }),
            None => Err(self.missing(key.name, key.what, key.like)),
        }
    }

    pub(super) fn family(&self) -> Result<&str, ImportError> {
        let key = &keys::FAMILY;
        match self.family.as_deref() {
            Some("") | None => Err(self.missing(key.name, key.what, key.like)),
            // Families of one's own keep their names.
            Some(family) => Ok(meant_family(family).unwrap_or(family)),
        }
    }

    pub(super) fn world(&self) -> Frame {
        const ORIGIN: Pose3Deg = Pose3Deg {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            roll_deg: 0.0,
            pitch_deg: 0.0,
            yaw_deg: 0.0,
        };
        Frame::of_pose(self.pose.unwrap_or(ORIGIN))
    }

    pub(super) fn missing(&self, key: &'static str, what: &str, like: &str) -> ImportError {
        let format = self.format.name();
        ImportError::Setting {
            key,
            message: format!("`{key}` is missing: files of the format `{format}` do not say it")
                .into(),
            expected: what.into(),
            like: Some(like.into()),
        }
    }

    pub(super) fn refuse(&self, key: &'static str, is_there: bool) -> Result<(), ImportError> {
        if !is_there {
            return Ok(());
        }
        let why = match (self.format, key) {
            (_, "dock_direction" | "frame") => "it is for docks",
            (Format::Nav2Docks, _) => "docks are no tags",
            _ => "the file says it itself",
        };
        Err(ImportError::Setting {
            key,
            message: format!(
                "`{key}` has no meaning in the format `{}`: {why}",
                self.format.name()
            )
            .into(),
            expected: format!("no `{key}`").into(),
            like: None,
        })
    }

    /// Goals are on the floor, so the frame's pose must not tilt or lift them.
    pub(super) fn flat(&self) -> Result<(), ImportError> {
        match self.pose {
            Some(pose) if [pose.z, pose.roll_deg, pose.pitch_deg] != [0.0; 3] => {
                Err(ImportError::Setting {
                    key: keys::POSE.name,
                    message: "the `pose` lifts or tilts docks off the floor".into(),
                    expected: "a pose with z, roll_deg and pitch_deg 0".into(),
                    like: Some(
                        "{ x = 4.0, y = 0.0, z = 0.0, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 90.0 }".into(),
                    ),
                })
            }
            _ => Ok(()),
        }
    }
}
