//! ROS 2 messages from CDR: poses and detections.

use super::layout::{layout, short};
use byteorder::{BigEndian, ByteOrder, LittleEndian};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

/// The types that are read.
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
}

impl Kind {
    const ALL: [Self; 4] = [
        Self::PoseWithCovariance,
        Self::Odometry,
        Self::Pose,
        Self::Detections,
    ];

    /// The type's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PoseWithCovariance => "geometry_msgs/msg/PoseWithCovarianceStamped",
            Self::Odometry => "nav_msgs/msg/Odometry",
            Self::Pose => "geometry_msgs/msg/PoseStamped",
            Self::Detections => "apriltag_msgs/msg/AprilTagDetectionArray",
        }
    }

    /// The kind of a name, with or without `/msg/`.
    pub(super) fn of(name: &str) -> Option<Self> {
        let name = short(name);
        Self::ALL
            .into_iter()
            .find(|kind| short(kind.name()) == name)
    }

    /// Whether a definition has the fields that are read. Some writers leave the definition empty: then the
    /// name counts, and each message must be used up to its last byte.
    pub(super) fn has_fields_of(self, definition: &str) -> bool {
        let fields = match self {
            Self::PoseWithCovariance => "int32 uint32 string float64x43",
            Self::Odometry => "int32 uint32 stringx2 float64x85",
            Self::Pose => "int32 uint32 string float64x7",
            Self::Detections => "int32 uint32 string sequence<string int32x2 float32x2 float64x19>",
        };
        definition.trim().is_empty() || layout(definition, self.name()).as_deref() == Some(fields)
    }
}

#[derive(Deserialize)]
struct Header {
    sec: i32,
    nanosec: u32,
    frame_id: String,
}

/// Position, then the quaternion x, y, z, w.
#[derive(Deserialize)]
struct Place {
    position: [f64; 3],
    orientation: [f64; 4],
}

#[derive(Deserialize)]
struct PoseWithCovarianceStamped {
    header: Header,
    pose: Place,
    covariance: [[f64; 6]; 6],
}

#[derive(Deserialize)]
struct Odometry {
    header: Header,
    _child_frame_id: String,
    pose: Place,
    covariance: [[f64; 6]; 6],
    _twist: [f64; 6],
    _twist_covariance: [[f64; 6]; 6],
}

#[derive(Deserialize)]
struct PoseStamped {
    header: Header,
    pose: Place,
}

#[derive(Deserialize)]
struct DetectionArray {
    header: Header,
    detections: Vec<Found>,
}

#[derive(Deserialize)]
struct Found {
    family: String,
    id: i32,
    _hamming: i32,
    _goodness: f32,
    _decision_margin: f32,
    _centre: [f64; 2],
    corners: [[f64; 2]; 4],
    _homography: [[f64; 3]; 3],
}

/// A tag that was found in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Its family, as the detector names it.
    pub family: String,
    /// Its number.
    pub id: i32,
    /// Its corners in AprilTag's order, pixels.
    pub corners_px: [[f64; 2]; 4],
}

/// A message that was decoded.
pub(super) struct Message {
    /// Nanoseconds: as it was written, which 64 bits of a float do not hold.
    pub stamp_ns: i64,
    pub frame: String,
    pub content: Content,
}

// One at a time, on the stack: a box for each pose would cost more.
#[allow(clippy::large_enum_variant)]
pub(super) enum Content {
    Pose {
        position: [f64; 3],
        orientation: [f64; 4],
        covariance: Option<[[f64; 6]; 6]>,
    },
    Detections(Vec<Detection>),
}

/// Decodes a message. Up to three bytes of padding may follow it.
///
/// # Errors
/// Why the bytes are no message of the kind, in words.
pub(super) fn decoded(kind: Kind, bytes: &[u8]) -> Result<Message, String> {
    match bytes {
        // Both byte orders of plain CDR; the other two bytes are options that are not used.
        [0, 0, _, _, body @ ..] => read::<BigEndian>(kind, body),
        [0, 1, _, _, body @ ..] => read::<LittleEndian>(kind, body),
        [a, b, _, _, ..] => Err(format!("representation {a:02x} {b:02x} is not plain CDR")),
        _ => Err(format!("{} bytes are no message", bytes.len())),
    }
}

fn read<Order: ByteOrder>(kind: Kind, body: &[u8]) -> Result<Message, String> {
    let (header, content) = match kind {
        Kind::PoseWithCovariance => {
            let it: PoseWithCovarianceStamped = whole::<_, Order>(body)?;
            (it.header, pose(it.pose, Some(it.covariance)))
        }
        Kind::Odometry => {
            let it: Odometry = whole::<_, Order>(body)?;
            (it.header, pose(it.pose, Some(it.covariance)))
        }
        Kind::Pose => {
            let it: PoseStamped = whole::<_, Order>(body)?;
            (it.header, pose(it.pose, None))
        }
        Kind::Detections => {
            let it: DetectionArray = whole::<_, Order>(body)?;
            let found = it.detections.into_iter().map(|found| Detection {
                family: found.family,
                id: found.id,
                corners_px: found.corners,
            });
            (it.header, Content::Detections(found.collect()))
        }
    };
    Ok(Message {
        stamp_ns: i64::from(header.sec) * 1_000_000_000 + i64::from(header.nanosec),
        frame: header.frame_id,
        content,
    })
}

fn pose(place: Place, covariance: Option<[[f64; 6]; 6]>) -> Content {
    Content::Pose {
        position: place.position,
        orientation: place.orientation,
        covariance,
    }
}

fn whole<T: DeserializeOwned, Order: ByteOrder>(body: &[u8]) -> Result<T, String> {
    let (message, used) =
        cdr_encoding::from_bytes::<T, Order>(body).map_err(|error| error.to_string())?;
    let left = body.len().saturating_sub(used);
    if left > 3 {
        return Err(format!("{left} bytes are left over"));
    }
    Ok(message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    /// A PoseStamped in either byte order, written by hand: the stamp, "map", padding to 8, seven floats.
    fn pose_bytes(big: bool) -> Vec<u8> {
        let mut bytes = vec![0, u8::from(!big), 0, 0];
        let int = |value: u32| {
            if big {
                value.to_be_bytes()
            } else {
                value.to_le_bytes()
            }
        };
        for value in [7, 500_000_000, 4] {
            bytes.extend(int(value));
        }
        bytes.extend(b"map\0");
        for value in [1.0, -2.0, 0.0, 0.0, 0.0, 0.6, 0.8f64] {
            let bits = value.to_bits();
            bytes.extend(if big {
                bits.to_be_bytes()
            } else {
                bits.to_le_bytes()
            });
        }
        bytes
    }

    #[test]
    fn both_byte_orders_are_read() {
        for big in [false, true] {
            let message = decoded(Kind::Pose, &pose_bytes(big)).unwrap();
            assert_eq!(
                (message.stamp_ns, message.frame.as_str()),
                (7_500_000_000, "map")
            );
            let Content::Pose {
                position,
                orientation,
                covariance,
            } = message.content
            else {
                panic!("a pose");
            };
            assert_eq!(position, [1.0, -2.0, 0.0]);
            assert_eq!(orientation, [0.0, 0.0, 0.6, 0.8]);
            assert_eq!(covariance, None);
        }
    }

    #[test]
    fn bytes_that_are_no_message_are_told() {
        let good = pose_bytes(false);
        let padded: Vec<u8> = good.iter().copied().chain([0; 3]).collect();
        assert!(decoded(Kind::Pose, &padded).is_ok());
        let longer: Vec<u8> = good.iter().copied().chain([0; 4]).collect();
        for (bytes, words) in [
            (&longer[..], "4 bytes are left over"),
            (&good[..good.len() - 1], ""),
            (&[0, 3, 0, 0, 0][..], "not plain CDR"),
            (&[0, 1][..], "2 bytes"),
        ] {
            let error = decoded(Kind::Pose, bytes).err().unwrap();
            assert!(error.contains(words), "{error}");
        }
        // Another type's bytes under this name.
        assert!(decoded(Kind::PoseWithCovariance, &good).is_err());
    }

    #[test]
    fn names_and_definitions_are_known() {
        assert_eq!(Kind::of("nav_msgs/Odometry"), Some(Kind::Odometry));
        assert_eq!(Kind::of("nav_msgs/msg/Path"), None);
        let time = "builtin_interfaces/Time stamp\nstring frame_id\n";
        let poses =
            "std_msgs/Header header\ngeometry_msgs/Pose pose\n===========\nMSG: std_msgs/Header\n";
        let rest = "===========\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n===========\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n===========\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
        assert!(Kind::Pose.has_fields_of(&format!("{poses}{time}{rest}")));
        assert!(Kind::Pose.has_fields_of(""));
        let other = rest.replacen("float64 z", "float32 z", 1);
        assert!(!Kind::Pose.has_fields_of(&format!("{poses}{time}{other}")));
    }
}
