//! Small ROS 2 bags, written by hand.

use crate::mcap::{Layout, Writer};

pub use crate::mcap::Compression;

const HEADER: &str = "std_msgs/Header header\n";
const PARTS: &str = "================================================================================\n\
MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
================================================================================\n\
MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n\
================================================================================\n\
MSG: geometry_msgs/PoseWithCovariance\nPose pose\nfloat64[36] covariance\n\
================================================================================\n\
MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n\
================================================================================\n\
MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n\
================================================================================\n\
MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
const DETECTIONS: &str = "AprilTagDetection[] detections\n\
================================================================================\n\
MSG: apriltag_msgs/AprilTagDetection\nstring family\nint32 id\nint32 hamming\nfloat32 goodness\nfloat32 decision_margin\nPoint centre\nPoint[4] corners\nfloat64[9] homography\n\
================================================================================\n\
MSG: apriltag_msgs/Point\nfloat64 x\nfloat64 y\n";

const ODOMETRY: &str = "string child_frame_id\ngeometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n\
================================================================================\n\
MSG: geometry_msgs/TwistWithCovariance\nTwist twist\nfloat64[36] covariance\n\
================================================================================\n\
MSG: geometry_msgs/Twist\nVector3 linear\nVector3 angular\n\
================================================================================\n\
MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const TRANSFORMS: &str = "geometry_msgs/TransformStamped[] transforms\n\
================================================================================\n\
MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\nTransform transform\n\
================================================================================\n\
MSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n\
================================================================================\n\
MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";

/// A transform: its stamp in seconds, the parent's and the child's frame, and the child's pose (m, m, rad) in the parent.
pub type Transform<'a> = (f64, &'a str, &'a str, [f64; 3]);

/// A pose on the floor, with the values of its message.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    pub t_s: f64,
    /// Log time; if `None`, 10 ms after the stamp.
    pub logged_s: Option<f64>,
    pub frame: &'static str,
    pub x: f64,
    pub y: f64,
    pub yaw: f64,
    pub roll: f64,
    /// Length of the quaternion.
    pub length: f64,
    /// Variances of x, y, yaw.
    pub covariance: [f64; 3],
}

impl Pose {
    pub const AT_DOCK: Self = Self {
        t_s: 1.0,
        logged_s: None,
        frame: "map",
        x: 0.0,
        y: 0.0,
        yaw: 0.0,
        roll: 0.0,
        length: 1.0,
        covariance: [1e-4; 3],
    };
}

/// CDR in one byte order.
struct Cdr {
    bytes: Vec<u8>,
    big: bool,
}

impl Cdr {
    fn new(big: bool) -> Self {
        Self {
            bytes: vec![0, u8::from(!big), 0, 0],
            big,
        }
    }

    fn align(&mut self, size: usize) {
        while !(self.bytes.len() - 4).is_multiple_of(size) {
            self.bytes.push(0);
        }
    }

    fn int(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend(if self.big {
            value.to_be_bytes()
        } else {
            value.to_le_bytes()
        });
    }

    fn floats(&mut self, values: &[f64]) {
        self.align(8);
        for value in values {
            let bits = value.to_bits();
            self.bytes.extend(if self.big {
                bits.to_be_bytes()
            } else {
                bits.to_le_bytes()
            });
        }
    }

    fn text(&mut self, text: &str) {
        self.int(text.len() as u32 + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    fn header(&mut self, t_s: f64, frame: &str) {
        self.int(t_s.floor() as u32);
        self.int(((t_s - t_s.floor()) * 1e9).round() as u32);
        self.text(frame);
    }
}

/// Returns the message of a pose. Without the covariance it is a `PoseStamped`.
fn message(pose: &Pose, big: bool, covariance: bool) -> Vec<u8> {
    let mut cdr = Cdr::new(big);
    cdr.header(pose.t_s, pose.frame);
    let (sin, cos) = (0.5 * pose.yaw).sin_cos();
    let (tilted, level) = (0.5 * pose.roll).sin_cos();
    let [tilted, level] = [tilted, level].map(|part| pose.length * part);
    let orientation = [cos * tilted, sin * tilted, sin * level, cos * level];
    cdr.floats(&[pose.x, pose.y, 0.0]);
    cdr.floats(&orientation);
    if covariance {
        let mut entries = [0.0; 36];
        let [xx, yy, tt] = pose.covariance;
        (entries[0], entries[7], entries[35]) = (xx, yy, tt);
        cdr.floats(&entries);
    }
    cdr.bytes
}

/// Returns the message of a pose with its covariance.
pub fn pose_message(pose: &Pose) -> Vec<u8> {
    message(pose, false, true)
}

/// Returns the definition of `PoseWithCovarianceStamped`.
pub fn pose_definition() -> String {
    format!("{HEADER}PoseWithCovariance pose\n{PARTS}")
}

/// A bag that is being written.
pub struct Bag {
    writer: Writer<Vec<u8>>,
}

impl Bag {
    pub fn new(compression: Option<Compression>, index: bool) -> Self {
        let layout = Layout {
            compression,
            chunk_size: 4096,
            index,
        };
        Self {
            writer: Writer::new(Vec::new(), layout).unwrap(),
        }
    }

    fn write(&mut self, topic: &str, schema: &str, definition: &str, logged_s: f64, data: &[u8]) {
        let time = (logged_s * 1e9).round() as u64;
        self.write_at(topic, schema, definition, time, data);
    }

    fn write_at(&mut self, topic: &str, schema: &str, definition: &str, time: u64, data: &[u8]) {
        let schema = self.writer.schema(schema, definition.as_bytes());
        let channel = self.writer.channel(schema, topic);
        self.writer.message(channel, time, data).unwrap();
    }

    fn estimate(&mut self, topic: &str, logged_s: f64, data: &[u8]) {
        let name = "geometry_msgs/msg/PoseWithCovarianceStamped";
        self.write(topic, name, &pose_definition(), logged_s, data);
    }

    fn logged(pose: &Pose) -> f64 {
        pose.logged_s.unwrap_or(pose.t_s + 0.01)
    }

    pub fn pose(&mut self, topic: &str, pose: &Pose) {
        self.estimate(topic, Self::logged(pose), &message(pose, false, true));
    }

    /// Writes a pose with exactly this stamp and log time, in nanoseconds.
    pub fn pose_at(&mut self, topic: &str, nanoseconds: u64, pose: &Pose) {
        let mut data = message(pose, false, true);
        let (whole, rest) = (nanoseconds / 1_000_000_000, nanoseconds % 1_000_000_000);
        data[4..8].copy_from_slice(&(whole as u32).to_le_bytes());
        data[8..12].copy_from_slice(&(rest as u32).to_le_bytes());
        let name = "geometry_msgs/msg/PoseWithCovarianceStamped";
        self.write_at(topic, name, &pose_definition(), nanoseconds, &data);
    }

    pub fn big_endian(&mut self, topic: &str, pose: &Pose) {
        self.estimate(topic, Self::logged(pose), &message(pose, true, true));
    }

    pub fn raw(&mut self, topic: &str, logged_s: f64, data: &[u8]) {
        self.estimate(topic, logged_s, data);
    }

    /// Writes a pose as `PoseStamped`.
    pub fn truth(&mut self, topic: &str, pose: &Pose) {
        let definition = format!("{HEADER}Pose pose\n{PARTS}");
        let data = message(pose, false, false);
        self.write(
            topic,
            "geometry_msgs/msg/PoseStamped",
            &definition,
            Self::logged(pose),
            &data,
        );
    }

    /// Writes a pose of an odometry as `nav_msgs/msg/Odometry`, in the frame of the pose, of `base_link`.
    pub fn odometry(&mut self, topic: &str, pose: &Pose) {
        self.odometry_of(
            "base_link",
            topic,
            &Pose {
                covariance: [0.0; 3],
                ..*pose
            },
        );
    }

    /// As [`Bag::odometry`], of a child frame, with the covariance.
    pub fn odometry_of(&mut self, child: &str, topic: &str, pose: &Pose) {
        let mut cdr = Cdr::new(false);
        cdr.header(pose.t_s, pose.frame);
        cdr.text(child);
        let (sin, cos) = (0.5 * pose.yaw).sin_cos();
        cdr.floats(&[pose.x, pose.y, 0.0, 0.0, 0.0, sin, cos]);
        // The covariance of the pose, the twist and its covariance.
        let mut covariance = [0.0; 36];
        [covariance[0], covariance[7], covariance[35]] = pose.covariance;
        cdr.floats(&covariance);
        cdr.floats(&[0.0; 42]);
        let definition = format!("{HEADER}{ODOMETRY}{PARTS}");
        let name = "nav_msgs/msg/Odometry";
        self.write(topic, name, &definition, Self::logged(pose), &cdr.bytes);
    }

    /// Writes transforms as one `TFMessage`.
    pub fn transforms(&mut self, topic: &str, logged_s: f64, transforms: &[Transform<'_>]) {
        let mut cdr = Cdr::new(false);
        cdr.int(transforms.len() as u32);
        for (t_s, parent, child, [x, y, yaw]) in transforms {
            cdr.header(*t_s, parent);
            cdr.text(child);
            let (sin, cos) = (0.5 * yaw).sin_cos();
            cdr.floats(&[*x, *y, 0.0, 0.0, 0.0, sin, cos]);
        }
        let definition = format!("{TRANSFORMS}{PARTS}");
        self.write(
            topic,
            "tf2_msgs/msg/TFMessage",
            &definition,
            logged_s,
            &cdr.bytes,
        );
    }

    /// Writes messages of an unknown type.
    pub fn other(&mut self, topic: &str, schema: &str, count: u32) {
        for k in 0..count {
            self.write(
                topic,
                schema,
                "uint8[] data\n",
                1.0 + f64::from(k),
                &[0, 1, 0, 0, 0, 0, 0, 0],
            );
        }
    }

    /// Writes messages of a known type name with another definition.
    pub fn with_definition(&mut self, topic: &str, definition: &str, count: u32) {
        for k in 0..count {
            let name = "geometry_msgs/msg/PoseStamped";
            self.write(
                topic,
                name,
                definition,
                1.0 + f64::from(k),
                &[0, 1, 0, 0, 0, 0, 0, 0],
            );
        }
    }

    /// Writes the detection of the dock site's tag t7 from a pose, by the formulas of the pinhole camera. The tag has 0.30 m, is at
    /// (4, 0, 0.5) and faces -x; camera at (0.25, 0, 0.5), f = 615, centre (320, 240).
    pub fn look(&mut self, topic: &str, t_s: f64, id: u32, pose: [f64; 3]) {
        self.look_in("camera", topic, t_s, id, pose);
    }

    /// As [`Bag::look`], in a frame of that name.
    pub fn look_in(&mut self, frame: &str, topic: &str, t_s: f64, id: u32, pose: [f64; 3]) {
        let [x, y, yaw] = pose;
        let mut cdr = Cdr::new(false);
        cdr.header(t_s, frame);
        cdr.int(1);
        cdr.text("tag36h11");
        cdr.int(id);
        for _ in 0..3 {
            cdr.int(0);
        }
        let mut numbers = vec![320.0, 240.0];
        // Frame t has y to a viewer's right: against -x that is world -y.
        for [right, up] in [[-0.15, -0.15], [0.15, -0.15], [0.15, 0.15], [-0.15, 0.15]] {
            let (dx, dy) = (4.0 - x, -right - y);
            let ahead = yaw.cos() * dx + yaw.sin() * dy - 0.25;
            let left = yaw.cos() * dy - yaw.sin() * dx;
            numbers.extend([320.0 - 615.0 * left / ahead, 240.0 - 615.0 * up / ahead]);
        }
        numbers.extend([0.0; 9]);
        cdr.floats(&numbers);
        let definition = format!("{HEADER}{DETECTIONS}{PARTS}");
        let name = "apriltag_msgs/msg/AprilTagDetectionArray";
        self.write(topic, name, &definition, t_s + 0.01, &cdr.bytes);
    }

    pub fn finish(self) -> Vec<u8> {
        self.writer.finish().unwrap()
    }
}
