//! ROS 2 messages from CDR: poses and detections.

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
        Self::ALL
            .into_iter()
            .find(|kind| short(kind.name()) == name)
    }

    /// Returns `true` if a definition has the expected fields. Some writers leave the definition empty: then the name
    /// decides, and each message must be decodable up to its last byte.
    pub(super) fn has_fields_of(self, definition: &str) -> bool {
        let fields = match self {
            Self::PoseWithCovariance => "int32 uint32 string float64x43",
            Self::Odometry => "int32 uint32 stringx2 float64x85",
            Self::Pose => "int32 uint32 string float64x7",
            Self::Detections => "int32 uint32 string sequence<string int32x2 float32x2 float64x19>",
            Self::Transforms => "sequence<int32 uint32 stringx2 float64x7>",
        };
        definition.trim().is_empty() || layout(definition, self.name()).as_deref() == Some(fields)
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
    pub content: Content,
}

// Only one exists at a time, on the stack: a box for each pose would cost more.
#[allow(clippy::large_enum_variant)]
pub(super) enum Content {
    Pose {
        position: [f64; 3],
        orientation: [f64; 4],
        covariance: Option<[[f64; 6]; 6]>,
    },
    Detections(Vec<Detection>),
    Transforms(Vec<Transform>),
}

/// Decodes a message. Up to three bytes of padding may follow it.
///
/// # Errors
/// A text that states why the bytes are not a message of this kind.
pub(super) fn decoded(kind: Kind, bytes: &[u8]) -> Result<Message, String> {
    let mut cdr = match bytes {
        // Both byte orders of plain CDR; the other two bytes are unused options.
        [0, order @ (0 | 1), _, _, body @ ..] => Cdr::new(body, *order == 0),
        [a, b, _, _, ..] => {
            return Err(format!("representation {a:02x} {b:02x} is not plain CDR"));
        }
        _ => return Err(format!("{} bytes are not a message", bytes.len())),
    };
    let message = message(kind, &mut cdr).map_err(|error| error.to_string())?;
    match cdr.left() {
        ..=3 => Ok(message),
        left => Err(format!("{left} bytes are left over")),
    }
}

/// Reads the fields of a message, in the order of its definition.
fn message(kind: Kind, cdr: &mut Cdr<'_>) -> Result<Message, BadCdr> {
    if kind == Kind::Transforms {
        return transforms(cdr);
    }
    let (stamp_ns, frame) = header(cdr)?;
    let content = match kind {
        Kind::PoseWithCovariance => pose(cdr, true)?,
        Kind::Odometry => {
            let _child_frame = cdr.text()?;
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
        content,
    })
}

/// Reads a stamp, nanoseconds, and the name of a frame.
fn header(cdr: &mut Cdr<'_>) -> Result<(i64, String), BadCdr> {
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
        content: Content::Transforms(transforms),
    })
}

/// Reads the position, then the quaternion x, y, z, w.
fn pose(cdr: &mut Cdr<'_>, has_covariance: bool) -> Result<Content, BadCdr> {
    Ok(Content::Pose {
        position: cdr.floats()?,
        orientation: cdr.floats()?,
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
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::rounds(2_000, 7)))]

        /// The number of decoded detections is limited by the bytes.
        #[test]
        fn random_messages_never_panic(order in 0u8..=1, body in prop::collection::vec(0u8..4, 0..900)) {
            let bytes = [&[0, order, 0, 0], &body[..]].concat();
            for kind in Kind::ALL {
                let message = decoded(kind, &bytes);
                if let Ok(Message { content: Content::Detections(found), .. }) = message {
                    prop_assert!(found.len() * 168 <= body.len());
                }
            }
        }
    }

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
    fn big_and_little_endian_messages_are_read() {
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
    fn invalid_bytes_are_errors() {
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
        // The bytes of another type under this name.
        assert!(decoded(Kind::PoseWithCovariance, &good).is_err());
    }

    /// A detection array written by hand: stamp, frame, count, then for each detection its family, four numbers of 32 bits and
    /// 19 floats.
    #[test]
    fn detections_are_read_and_their_count_is_bounded_by_the_bytes() {
        let mut bytes = vec![0, 1, 0, 0];
        for value in [7, 0, 1] {
            bytes.extend(u32::to_le_bytes(value));
        }
        bytes.extend([0; 4]);
        bytes.extend(2u32.to_le_bytes());
        for id in [3u32, 4] {
            bytes.extend(4u32.to_le_bytes());
            bytes.extend(b"36h\0");
            for value in [id, 0, 0, 0] {
                bytes.extend(value.to_le_bytes());
            }
            while !(bytes.len() - 4).is_multiple_of(8) {
                bytes.push(0);
            }
            for value in 0..19 {
                bytes.extend(f64::from(value).to_le_bytes());
            }
        }
        let message = decoded(Kind::Detections, &bytes).unwrap();
        let Content::Detections(found) = message.content else {
            panic!("detections");
        };
        let all: Vec<_> = found.iter().map(|one| (&*one.family, one.id)).collect();
        assert_eq!(all, [("36h", 3), ("36h", 4)]);
        assert_eq!(
            found[1].corners_px,
            [[2.0, 3.0], [4.0, 5.0], [6.0, 7.0], [8.0, 9.0]]
        );
        for cut in 4..bytes.len() {
            assert!(decoded(Kind::Detections, &bytes[..cut]).is_err(), "{cut}");
        }
        bytes[20..24].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(decoded(Kind::Detections, &bytes).is_err());
    }

    #[test]
    fn kinds_are_recognized_by_name_and_definition() {
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
