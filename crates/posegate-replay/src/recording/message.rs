//! ROS messages from CDR (ROS 2) or ROS 1's encoding: poses and detections.

use super::cdr::{BadCdr, Cdr};
use super::layout::{layout, short};
use super::transforms::{Pose, Transform};

/// The supported message types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// `geometry_msgs/msg/PoseWithCovarianceStamped`.
    PoseWithCovariance,
    /// `nav_msgs/msg/Odometry`.
    Odometry,
    /// `geometry_msgs/msg/PoseStamped`: a pose without a covariance.
    Pose,
    /// `apriltag_msgs/msg/AprilTagDetectionArray`.
    Detections,
    /// `tf2_msgs/msg/TFMessage`: transforms between frames.
    Transforms,
}

impl Kind {
    const ALL: [Self; 5] = [
        Self::PoseWithCovariance,
        Self::Odometry,
        Self::Pose,
        Self::Detections,
        Self::Transforms,
    ];

    /// Returns the type's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PoseWithCovariance => "geometry_msgs/msg/PoseWithCovarianceStamped",
            Self::Odometry => "nav_msgs/msg/Odometry",
            Self::Pose => "geometry_msgs/msg/PoseStamped",
            Self::Detections => "apriltag_msgs/msg/AprilTagDetectionArray",
            Self::Transforms => "tf2_msgs/msg/TFMessage",
        }
    }

    /// Returns the kind with a name, with or without `/msg/`.
    pub(super) fn of(name: &str) -> Option<Self> {
        let name = short(name);
        // Before tf2.
        if name == "tf/tfMessage" {
            return Some(Self::Transforms);
        }
        Self::ALL
            .into_iter()
            .find(|kind| short(kind.name()) == name)
    }

    /// Returns `true` if a definition has the expected fields. Some writers leave the definition empty: then the name
    /// decides, and each message must be decodable up to its last byte.
    pub(super) fn has_fields_of(self, encoding: Encoding, definition: &str) -> bool {
        let ros2 = match self {
            Self::PoseWithCovariance => "int32 uint32 string float64x43",
            Self::Odometry => "int32 uint32 stringx2 float64x85",
            Self::Pose => "int32 uint32 string float64x7",
            Self::Detections => "int32 uint32 string sequence<string int32x2 float32x2 float64x19>",
            Self::Transforms => "sequence<int32 uint32 stringx2 float64x7>",
        };
        if definition.trim().is_empty() {
            return true;
        }
        let fields = match encoding {
            Encoding::Cdr => ros2.into(),
            // The header of ROS 1 begins with a counter, and its time is unsigned; the layout does not show the sign of a time.
            Encoding::Ros1 => ros2.replacen("int32 uint32", "uint32 int32 uint32", 1),
        };
        layout(definition, self.name()).as_ref() == Some(&fields)
            || self == Self::Transforms && layout(definition, "tf/tfMessage") == Some(fields)
    }
}

/// A tag detected in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// The tag's family, as the detector names it.
    pub family: String,
    /// The tag's number.
    pub id: i32,
    /// The tag's corners in AprilTag's order ([`posegate::shape::Sight`]), pixels.
    pub corners_px: [[f64; 2]; 4],
}

/// A decoded message.
pub(super) struct Message {
    /// Nanoseconds, exactly as written: an `f64` cannot hold them.
    pub stamp_ns: i64,
    pub frame: String,
    /// The frame whose pose it is; `None` if the type has no such field.
    pub child: Option<String>,
    pub content: Content,
}

// Only one exists at a time, on the stack: a box for each pose would cost more.
#[allow(clippy::large_enum_variant)]
pub(super) enum Content {
    Pose {
        pose: Pose,
        covariance: Option<[[f64; 6]; 6]>,
    },
    Detections(Vec<Detection>),
    Transforms(Vec<Transform>),
}

/// The encoding of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    /// ROS 2.
    Cdr,
    /// ROS 1: no alignment, and texts without a NUL.
    Ros1,
}

/// Decodes a message. Up to three bytes of padding may follow it.
///
/// # Errors
/// A text that states why the bytes are not a message of this kind.
pub(super) fn decoded(kind: Kind, encoding: Encoding, bytes: &[u8]) -> Result<Message, String> {
    let mut cdr = match bytes {
        _ if encoding == Encoding::Ros1 => Cdr::ros1(bytes),
        // Both byte orders of plain CDR; the other two bytes are unused options.
        [0, order @ (0 | 1), _, _, body @ ..] => Cdr::new(body, *order == 0),
        [a, b, _, _, ..] => {
            return Err(format!("representation {a:02x} {b:02x} is not plain CDR"));
        }
        _ => return Err(format!("{} bytes are not a message", bytes.len())),
    };
    let message = message(kind, &mut cdr).map_err(|error| error.to_string())?;
    match cdr.left() {
        0 => Ok(message),
        ..=3 if encoding == Encoding::Cdr => Ok(message),
        left => Err(format!("{left} bytes are left over")),
    }
}

/// Reads the fields of a message, in the order of its definition.
fn message(kind: Kind, cdr: &mut Cdr<'_>) -> Result<Message, BadCdr> {
    if kind == Kind::Transforms {
        return transforms(cdr);
    }
    let (stamp_ns, frame) = header(cdr)?;
    let mut child = None;
    let content = match kind {
        Kind::PoseWithCovariance => pose(cdr, true)?,
        Kind::Odometry => {
            child = Some(cdr.name()?.into());
            let pose = pose(cdr, true)?;
            let (_twist, _covariance) = (cdr.floats::<6>()?, cdr.floats::<36>()?);
            pose
        }
        Kind::Pose => pose(cdr, false)?,
        Kind::Detections => {
            let mut detections = Vec::new();
            // Each detection takes bytes of the message, so a wrong count fails at the end of the bytes.
            for _ in 0..cdr.u32()? {
                detections.push(detection(cdr)?);
            }
            Content::Detections(detections)
        }
        Kind::Transforms => Content::Transforms(Vec::new()),
    };
    Ok(Message {
        stamp_ns,
        frame,
        child,
        content,
    })
}

/// Reads a stamp, nanoseconds, and the name of a frame.
fn header(cdr: &mut Cdr<'_>) -> Result<(i64, String), BadCdr> {
    if cdr.is_ros1() {
        let _sequence = cdr.u32()?;
    }
    let (seconds, nanoseconds) = (cdr.i32()?, cdr.u32()?);
    let stamp_ns = i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds);
    Ok((stamp_ns, cdr.name()?.into()))
}

/// Reads transforms. The message has no header of its own.
fn transforms(cdr: &mut Cdr<'_>) -> Result<Message, BadCdr> {
    let mut transforms = Vec::new();
    // Each transform takes bytes of the message, so a wrong count fails at the end of the bytes.
    for _ in 0..cdr.u32()? {
        let (stamp_ns, parent) = header(cdr)?;
        let child = cdr.name()?.into();
        let pose = Pose {
            position: cdr.floats()?,
            orientation: cdr.floats()?,
        };
        transforms.push(Transform {
            stamp_ns,
            parent,
            child,
            pose,
        });
    }
    Ok(Message {
        stamp_ns: 0,
        frame: String::new(),
        child: None,
        content: Content::Transforms(transforms),
    })
}

/// Reads the position, then the quaternion x, y, z, w.
fn pose(cdr: &mut Cdr<'_>, has_covariance: bool) -> Result<Content, BadCdr> {
    Ok(Content::Pose {
        pose: Pose {
            position: cdr.floats()?,
            orientation: cdr.floats()?,
        },
        covariance: if has_covariance {
            Some(cdr.rows()?)
        } else {
            None
        },
    })
}

fn detection(cdr: &mut Cdr<'_>) -> Result<Detection, BadCdr> {
    let family = cdr.name()?.into();
    let id = cdr.i32()?;
    let (_hamming, _goodness, _decision_margin) = (cdr.u32()?, cdr.u32()?, cdr.u32()?);
    let _centre = cdr.floats::<2>()?;
    let corners_px = cdr.rows()?;
    let _homography = cdr.floats::<9>()?;
    Ok(Detection {
        family,
        id,
        corners_px,
    })
}

#[cfg(test)]
mod tests;
