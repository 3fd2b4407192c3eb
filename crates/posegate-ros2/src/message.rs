//! The ROS 2 messages of the node, field by field in the order of their definitions.
//!
//! CDR has no field names: the order is the format. Arrays of equal numbers stand for structs of numbers (`Point`, `Quaternion`),
//! because CDR writes both in the same way.

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

/// `std_msgs/msg/Header`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// The time of the numbers.
    pub stamp: Time,
    /// The frame of the numbers.
    pub frame_id: String,
}

/// `geometry_msgs/msg/Pose`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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

/// `geometry_msgs/msg/TwistWithCovariance`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    /// Linear x, y, z (m/s), angular x, y, z (rad/s).
    pub twist: [f64; 6],
    /// 6 x 6 by rows.
    #[serde(with = "BigArray")]
    pub covariance: [f64; 36],
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
    /// The speed in the frame of the robot.
    pub twist: TwistWithCovariance,
}

/// `std_msgs/msg/Bool`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bool {
    /// The value.
    pub data: bool,
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
/// The level of a [`DiagnosticStatus`]: works, but not as wanted.
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

/// `std_msgs/msg/ColorRGBA`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Color {
    /// Red, green, blue and opacity, from 0 to 1.
    pub rgba: [f32; 4],
}

/// `visualization_msgs/msg/Marker`, with `sensor_msgs/msg/CompressedImage` and `MeshFile` written out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Where it is drawn.
    pub pose: Pose,
    /// Its size, metres.
    pub scale: [f64; 3],
    /// Its colour.
    pub color: Color,
    /// How long it stays: seconds and nanoseconds; zero for ever.
    pub lifetime: (i32, u32),
    /// Whether it moves with its frame.
    pub frame_locked: bool,
    /// Points of lines and polygons.
    pub points: Vec<[f64; 3]>,
    /// A colour per point.
    pub colors: Vec<Color>,
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

/// `visualization_msgs/msg/MarkerArray`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MarkerArray {
    /// The markers.
    pub markers: Vec<Marker>,
}

/// The request of `std_srvs/srv/Trigger`. An empty message has one byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerRequest {
    /// Unused.
    pub structure_needs_at_least_one_member: u8,
}

/// The response of `std_srvs/srv/Trigger`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerResponse {
    /// Whether the request was carried out.
    pub success: bool,
    /// In words.
    pub message: String,
}

impl ros2_client::Message for TriggerRequest {}
impl ros2_client::Message for TriggerResponse {}
