//! The ROS 2 messages of the node, field by field in the order of their definitions.
//!
//! CDR has no field names: the order is the format. Structs of equal numbers (`Point`, `Quaternion`) are arrays here,
//! because CDR encodes both in the same way. A message with one field is that field: `std_msgs/msg/Bool` is `bool`,
//! `tf2_msgs/msg/TFMessage` is `Vec<TransformStamped>`.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_big_array::BigArray;

/// `builtin_interfaces/msg/Time`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    /// Seconds since 1970.
    pub sec: i32,
    /// Nanoseconds of the second, below 10^9 in a valid time.
    pub nanosec: u32,
}

impl Time {
    /// Returns nanoseconds since 1970.
    #[must_use]
    pub const fn ns(self) -> i64 {
        self.sec as i64 * 1_000_000_000 + self.nanosec as i64
    }

    /// Returns the time of nanoseconds since 1970 that [`Time::ns`] returned.
    #[must_use]
    pub const fn from_ns(ns: i64) -> Self {
        Self {
            sec: ns.div_euclid(1_000_000_000) as i32,
            nanosec: ns.rem_euclid(1_000_000_000) as u32,
        }
    }
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// The time of the numbers.
    pub stamp: Time,
    /// The frame of the numbers.
    pub frame_id: String,
}

/// `geometry_msgs/msg/Pose`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// x, y, z, metres.
    pub position: [f64; 3],
    /// x, y, z, w.
    pub orientation: [f64; 4],
}

/// `geometry_msgs/msg/PoseWithCovariance`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// 6 x 6 by rows over x, y, z and rotations about the fixed axes x, y, z.
    #[serde(with = "BigArray")]
    pub covariance: [f64; 36],
}

/// `geometry_msgs/msg/PoseWithCovarianceStamped`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovarianceStamped {
    /// Time and frame.
    pub header: Header,
    /// The pose and its covariance in that frame.
    pub pose: PoseWithCovariance,
}

/// `geometry_msgs/msg/PoseStamped`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseStamped {
    /// Time and frame.
    pub header: Header,
    /// The pose in that frame.
    pub pose: Pose,
}

/// `geometry_msgs/msg/TransformStamped`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TransformStamped {
    /// Time, and the frame of the pose.
    pub header: Header,
    /// The frame whose pose it is.
    pub child_frame_id: String,
    /// x, y, z, metres.
    pub translation: [f64; 3],
    /// x, y, z, w.
    pub rotation: [f64; 4],
}

/// `nav_msgs/msg/Odometry`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// Time, and the frame of the pose.
    pub header: Header,
    /// The frame of the robot.
    pub child_frame_id: String,
    /// The pose in the frame of the header.
    pub pose: PoseWithCovariance,
    /// Unused: the speed in the frame of the robot, and its covariance by rows.
    pub twist: ([f64; 6], [[f64; 6]; 6]),
}

/// `apriltag_msgs/msg/AprilTagDetection`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AprilTagDetection {
    /// The family, such as `tag36h11`.
    pub family: String,
    /// The number of the tag.
    pub id: i32,
    /// The number of bits that were corrected.
    pub hamming: i32,
    /// Unused.
    pub goodness: f32,
    /// The contrast of black and white bits.
    pub decision_margin: f32,
    /// Column and row of the centre, pixels.
    pub centre: [f64; 2],
    /// Columns and rows of the corners, pixels, counter-clockwise from the bottom left as a viewer sees the upright
    /// tag.
    pub corners: [[f64; 2]; 4],
    /// Unused: from the tag's square to pixels, by rows.
    pub homography: [f64; 9],
}

/// `apriltag_msgs/msg/AprilTagDetectionArray`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AprilTagDetectionArray {
    /// Time of the image, and the frame of the camera.
    pub header: Header,
    /// The tags of one image.
    pub detections: Vec<AprilTagDetection>,
}

/// `sensor_msgs/msg/CameraInfo`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CameraInfo {
    /// Time of the image, and the frame of the camera.
    pub header: Header,
    /// Rows of the whole image.
    pub height: u32,
    /// Columns of the whole image.
    pub width: u32,
    /// The name of the lens model.
    pub distortion_model: String,
    /// The coefficients of the lens model.
    pub d: Vec<f64>,
    /// The matrix of the raw camera, by rows.
    pub k: [f64; 9],
    /// The rectification matrix, by rows.
    pub r: [f64; 9],
    /// The projection matrix of the rectified image, by rows.
    pub p: [f64; 12],
    /// Columns and rows that are combined into one; 0 for 1.
    pub binning: [u32; 2],
    /// The part of the image that is published: first column, first row, rows, columns; 0 for all. The last one is unused.
    pub roi: ([u32; 4], bool),
}

impl CameraInfo {
    /// Returns `true` if frame and calibration are equal: all but the stamp.
    #[must_use]
    pub fn is_same_calibration(&self, other: &Self) -> bool {
        let mut other = other.clone();
        other.header.stamp = self.header.stamp;
        *self == other
    }
}

/// `diagnostic_msgs/msg/KeyValue`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// The name.
    pub key: String,
    /// The value.
    pub value: String,
}

impl KeyValue {
    /// Returns a name with a value.
    pub fn new(key: &str, value: impl ToString) -> Self {
        Self {
            key: key.to_owned(),
            value: value.to_string(),
        }
    }
}

/// The level of a [`DiagnosticStatus`]: all is well.
pub const OK: u8 = 0;
/// The level of a [`DiagnosticStatus`]: works with restrictions.
pub const WARN: u8 = 1;
/// The level of a [`DiagnosticStatus`]: does not work.
pub const ERROR: u8 = 2;

/// `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// [`OK`], [`WARN`] or [`ERROR`].
    pub level: u8,
    /// The component.
    pub name: String,
    /// One sentence.
    pub message: String,
    /// The hardware.
    pub hardware_id: String,
    /// Details.
    pub values: Vec<KeyValue>,
}

impl DiagnosticStatus {
    /// Returns the value of a key, if there is exactly one.
    #[must_use]
    pub fn value(&self, key: &str) -> Option<&str> {
        let mut found = self.values.iter().filter(|pair| pair.key == key);
        let first = found.next()?;
        found.next().is_none().then_some(first.value.as_str())
    }
}

/// `diagnostic_msgs/msg/DiagnosticArray`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// The time; the frame is empty.
    pub header: Header,
    /// The states.
    pub status: Vec<DiagnosticStatus>,
}

/// `visualization_msgs/msg/Marker`, with `sensor_msgs/msg/CompressedImage` and `MeshFile` written out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// Time and frame.
    pub header: Header,
    /// The namespace of the number.
    pub ns: String,
    /// The number: a marker replaces the one with the same namespace and number.
    pub id: i32,
    /// The shape.
    pub kind: i32,
    /// 0 to add, 2 to delete.
    pub action: i32,
    /// The pose of the drawing.
    pub pose: Pose,
    /// The size, metres.
    pub scale: [f64; 3],
    /// Red, green, blue and opacity, from 0 to 1.
    pub color: [f32; 4],
    /// The lifetime: seconds and nanoseconds; zero for no limit.
    pub lifetime: (i32, u32),
    /// `true` if the marker moves with its frame.
    pub frame_locked: bool,
    /// Points of lines and polygons.
    pub points: Vec<[f64; 3]>,
    /// A colour per point.
    pub colors: Vec<[f32; 4]>,
    /// Unused.
    pub texture_resource: String,
    /// Unused: header, format, bytes.
    pub texture: (Header, String, Vec<u8>),
    /// Unused.
    pub uv_coordinates: Vec<[f32; 2]>,
    /// The text of a text marker.
    pub text: String,
    /// Unused.
    pub mesh_resource: String,
    /// Unused: name, bytes.
    pub mesh_file: (String, Vec<u8>),
    /// Unused.
    pub mesh_use_embedded_materials: bool,
}

/// The response of `std_srvs/srv/Trigger`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerResponse {
    /// `true` if the request was carried out.
    pub success: bool,
    /// A description.
    pub message: String,
}

impl ros2_client::Message for TriggerResponse {}

/// The request or the response of a service with one field. (CDR encodes an empty one as one byte.)
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Single<T>(pub T);

impl<T: Serialize + DeserializeOwned> ros2_client::Message for Single<T> {}
