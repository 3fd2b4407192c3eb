//! The directions of a tag's axes: tag frames of other programs, and the transform to ours.

use super::place::Matrix;

/// The frame in which a map gives its tags.
///
/// All are centred on the tag and right-handed. `right` and `up` are those of a viewer of the upright tag, as
/// in AprilTag's own images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Convention {
    /// `posegate`, frame t: x out of the tag's face, y right, z up.
    Posegate,
    /// `wpilib`, the frame of WPILib's field layouts and PhotonVision: the same axes as `posegate`.
    Wpilib,
    /// `apriltag`, the frame of `estimate_tag_pose` in the AprilTag 3 library: x right, y down, z into the tag.
    AprilTag,
    /// `apriltag_ros`, the frame of the ROS nodes of that name and of their bundles: x right, y up, z out of
    /// the face.
    AprilTagRos,
    /// `opencv`, the frame of OpenCV's ArUco module: x right, y up, z out of the face in OpenCV's own images of
    /// AprilTags. These are AprilTag's turned by 180 degrees, so in AprilTag's images x is left, y down, z out
    /// of the face.
    OpenCv,
}

impl Convention {
    /// The names of the conventions.
    pub const NAMES: [&str; 5] = ["posegate", "wpilib", "apriltag", "apriltag_ros", "opencv"];

    /// Returns the convention with a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "posegate" => Self::Posegate,
            "wpilib" => Self::Wpilib,
            "apriltag" => Self::AprilTag,
            "apriltag_ros" => Self::AprilTagRos,
            "opencv" => Self::OpenCv,
            _ => return None,
        })
    }

    /// Returns the convention's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Posegate => "posegate",
            Self::Wpilib => "wpilib",
            Self::AprilTag => "apriltag",
            Self::AprilTagRos => "apriltag_ros",
            Self::OpenCv => "opencv",
        }
    }

    /// Returns a description of the directions of its axes.
    #[must_use]
    pub const fn axes_in_words(self) -> &'static str {
        match self {
            Self::Posegate | Self::Wpilib => "x out of the tag's face, y to a viewer's right, z up",
            Self::AprilTag => "x to a viewer's right, y down, z into the tag",
            Self::AprilTagRos => "x to a viewer's right, y up, z out of the tag's face",
            Self::OpenCv => {
                "x to a viewer's right, y up, z out of the tag's face, of images that are AprilTag's turned by 180 \
                 degrees"
            }
        }
    }

    /// Returns our tag frame in this one: the columns are our axes.
    pub(super) const fn axes(self) -> Matrix {
        match self {
            Self::Posegate | Self::Wpilib => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Self::AprilTag => [[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]],
            Self::AprilTagRos => [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
            Self::OpenCv => [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]],
        }
    }
}
