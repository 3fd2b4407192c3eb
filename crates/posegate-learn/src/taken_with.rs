//! The camera, its mount and the tags of detections: a bound is valid only for these.

use posegate::shape::{Mount, Tolerance, rotation};
use serde::{Deserialize, Serialize};

/// The camera, its mount and the tags of the detections from which bounds were learnt. Unknown values are not compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TakenWith {
    /// The camera's name, for people. Not compared: another site may give it another name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// The focal length along a row, pixels; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fx: Option<f64>,
    /// The focal length along a column, pixels; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fy: Option<f64>,
    /// Width and height of the image, pixels; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image: Option<[f64; 2]>,
    /// The model of the lens, as ROS names it; `none` without distortion. `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<String>,
    /// The width of the tags, metres: of the border that detectors measure. `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag_size: Option<f64>,
    /// The family of the tags, as detectors name it; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub family: Option<String>,
    /// The camera's pose on the robot; `None` if unknown. The errors are those of the robot's reference point, so they depend
    /// on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mount: Option<MountRecord>,
}

/// The pose of a camera on the robot, as a site file states it: metres and degrees, about the fixed axes of the robot
/// (`Rz(yaw) Ry(pitch) Rx(roll)`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MountRecord {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Metres.
    pub z: f64,
    /// Degrees.
    pub roll_deg: f64,
    /// Degrees.
    pub pitch_deg: f64,
    /// Degrees.
    pub yaw_deg: f64,
}

impl From<Mount> for MountRecord {
    fn from(mount: Mount) -> Self {
        let Mount {
            x,
            y,
            z,
            roll_deg,
            pitch_deg,
            yaw_deg,
        } = mount;
        Self {
            x,
            y,
            z,
            roll_deg,
            pitch_deg,
            yaw_deg,
        }
    }
}

impl core::fmt::Display for MountRecord {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(
            f,
            "({}, {}, {}) m with roll {}, pitch {}, yaw {} deg",
            self.x, self.y, self.z, self.roll_deg, self.pitch_deg, self.yaw_deg
        )
    }
}

impl MountRecord {
    const fn numbers(self) -> [f64; 6] {
        [
            self.x,
            self.y,
            self.z,
            self.roll_deg,
            self.pitch_deg,
            self.yaw_deg,
        ]
    }

    /// Returns the distance (m) and the angle (degrees) of the rigid motion from this mount to another.
    fn distance(self, other: Self) -> [f64; 2] {
        let [a, b] = [self, other].map(MountRecord::numbers);
        let squares = (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis]));
        let [from, to] =
            [a, b].map(|[_, _, _, roll, pitch, yaw]| rotation::<f64>(roll, pitch, yaw));
        let products = from.iter().flatten().zip(to.iter().flatten());
        let trace: f64 = products.map(|(a, b)| a * b).sum();
        let angle = libm::acos((0.5 * (trace - 1.0)).clamp(-1.0, 1.0));
        [libm::sqrt(squares.sum()), angle.to_degrees()]
    }
}

/// The share by which two calibrations of one camera, or two measurements of one tag, may differ.
const EQUAL_WITHIN: f64 = 0.01;

/// The distance (m) and the angle (degrees) by which arithmetic and the text of a file may change one mount.
const ROUNDING: [f64; 2] = [1e-6, 1e-4];

impl TakenWith {
    /// Returns the fault of the description; `None` if it is valid.
    #[must_use]
    pub fn fault(&self) -> Option<&'static str> {
        let numbers = [self.fx, self.fy, self.tag_size];
        let sides = self.image.into_iter().flatten();
        let mut all = numbers.into_iter().flatten().chain(sides);
        if all.any(|value| !(value > 0.0 && value.is_finite())) {
            return Some("focal lengths, image and tag size are numbers above 0");
        }
        let finite = |mount: MountRecord| mount.numbers().iter().all(|value| value.is_finite());
        (!self.mount.is_none_or(finite)).then_some("the camera's mount has finite numbers")
    }

    /// Returns a description of the first difference from another camera, another mount or other tags; `None` if all values
    /// that both know are equal. Mounts are equal within `mount_tolerance`, whose errors the bound of a look
    /// includes.
    #[must_use]
    pub fn difference(&self, other: &Self, mount_tolerance: Tolerance) -> Option<String> {
        let number = |name: &str, a: Option<f64>, b: Option<f64>, unit: &str| {
            let (a, b) = (a?, b?);
            ((a - b).abs() > EQUAL_WITHIN * a.abs().max(b.abs()))
                .then(|| format!("{name} {a} {unit}, not {b} {unit}"))
        };
        let text = |name: &str, a: &Option<String>, b: &Option<String>| {
            let (a, b) = (a.as_ref()?, b.as_ref()?);
            (a != b).then(|| format!("{name} {a}, not {b}"))
        };
        let image = || {
            let (a, b) = (self.image?, other.image?);
            (a != b).then(|| {
                format!(
                    "images of {} x {} px, not {} x {} px",
                    a[0], a[1], b[0], b[1]
                )
            })
        };
        let mount = || {
            let (a, b) = (self.mount?, other.mount?);
            let [moved, turned] = a.distance(b);
            (moved > mount_tolerance.translation + ROUNDING[0]
                || turned > mount_tolerance.turn_deg + ROUNDING[1])
                .then(|| format!("the camera mounted at {a}, not at {b}"))
        };
        number("fx", self.fx, other.fx, "px")
            .or_else(|| number("fy", self.fy, other.fy, "px"))
            .or_else(image)
            .or_else(|| text("a lens of the model", &self.lens, &other.lens))
            .or_else(mount)
            .or_else(|| number("tags of", self.tag_size, other.tag_size, "m"))
            .or_else(|| text("tags of the family", &self.family, &other.family))
    }
}
