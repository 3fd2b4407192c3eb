//! A source's estimate of the robot's pose.

use super::call::answer;
use super::memory::{Plain, read};
use super::posegate_status;
use posegate::report::{Heading, PoseEstimate, mavlink, ros};
use posegate::set::Uncertainty;

// Messages are those of the core, which are plain numbers in the layout of C. `cbindgen.toml` has their names, too.
pub use posegate::report::mavlink::Odometry as posegate_mavlink_odometry;
pub use posegate::report::mavlink::VisionPositionEstimate as posegate_mavlink_vision;
pub use posegate::report::ros::PoseWithCovariance as posegate_ros_pose;

/// The form of an estimate's heading. 0 is not a form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_heading {
    /// `heading[0]` is the yaw, radians, counter-clockwise.
    Yaw = 1,
    /// `heading[0]` to `heading[2]` are roll, pitch, yaw about fixed axes, radians; a tilt above 5 degrees denies.
    RollPitchYaw = 2,
    /// `heading[0]` to `heading[3]` are x, y, z, w of a unit quaternion; a tilt above 5 degrees denies.
    Quaternion = 3,
}

/// The form of an estimate's uncertainty. 0 is not a form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_spread {
    /// `spread[0]` to `spread[8]` are the covariance of x, y, yaw by rows, in the axes of the report's frame: m^2,
    /// m rad, rad^2.
    Gaussian = 1,
    /// `spread[0]` bounds the distance, metres; `spread[1]` the yaw, radians.
    Bounded = 2,
    /// The source reports that it does not know its uncertainty. Denies.
    Unknown = 3,
}

/// The directions of a MAVLink message's axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_axes {
    /// z up, yaw counter-clockwise (ENU, FLU).
    Up = 1,
    /// z down, yaw clockwise (NED, FRD).
    Down = 2,
}

/// A source's estimate of the robot's pose. Any numbers are allowed: a gate checks each.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_belief {
    /// x, metres, in the report's frame.
    pub x_m: f64,
    /// y, metres, in the report's frame.
    pub y_m: f64,
    /// The heading, in the form of `heading_kind`.
    pub heading: [f64; 4],
    /// The uncertainty, in the form of `spread_kind`.
    pub spread: [f64; 9],
    /// A `posegate_heading`.
    pub heading_kind: u32,
    /// A `posegate_spread`.
    pub spread_kind: u32,
}

/// An estimate in nine numbers, as in micro-ROS messages and CAN frames.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_compact {
    /// x, metres, in the report's frame.
    pub x_m: f32,
    /// y, metres, in the report's frame.
    pub y_m: f32,
    /// Yaw, radians, counter-clockwise.
    pub yaw_rad: f32,
    /// Covariance of x with x, m^2.
    pub xx: f32,
    /// Covariance of x with y, m^2.
    pub xy: f32,
    /// Covariance of x with yaw, m rad.
    pub x_yaw: f32,
    /// Covariance of y with y, m^2.
    pub yy: f32,
    /// Covariance of y with yaw, m rad.
    pub y_yaw: f32,
    /// Covariance of yaw with yaw, rad^2.
    pub yaw_yaw: f32,
}

// SAFETY: numbers. The zero has no form, so every function refuses it.
unsafe impl Plain for posegate_belief {}
// SAFETY: numbers.
unsafe impl Plain for ros::PoseWithCovariance {}
// SAFETY: numbers.
unsafe impl Plain for mavlink::Odometry {}
// SAFETY: numbers.
unsafe impl Plain for mavlink::VisionPositionEstimate {}
// SAFETY: numbers.
unsafe impl Plain for posegate_compact {}

impl posegate_belief {
    pub(super) const fn of(belief: &PoseEstimate) -> Self {
        let (heading_kind, heading) = match belief.heading {
            Heading::Radians(yaw) => (posegate_heading::Yaw, [yaw, 0.0, 0.0, 0.0]),
            Heading::RollPitchYaw([roll, pitch, yaw]) => {
                (posegate_heading::RollPitchYaw, [roll, pitch, yaw, 0.0])
            }
            Heading::Quaternion(entries) => (posegate_heading::Quaternion, entries),
        };
        let (spread_kind, spread) = match belief.spread {
            Some(Uncertainty::Gaussian([[a, b, c], [d, e, f], [g, h, i]])) => {
                (posegate_spread::Gaussian, [a, b, c, d, e, f, g, h, i])
            }
            Some(Uncertainty::Bounded {
                translation_m: a,
                yaw_rad: b,
            }) => (
                posegate_spread::Bounded,
                [a, b, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            ),
            None => (posegate_spread::Unknown, [0.0; 9]),
        };
        Self {
            x_m: belief.x_m,
            y_m: belief.y_m,
            heading,
            spread,
            heading_kind: heading_kind as u32,
            spread_kind: spread_kind as u32,
        }
    }

    pub(super) fn belief(&self) -> Result<PoseEstimate, posegate_status> {
        const YAW: u32 = posegate_heading::Yaw as u32;
        const ROLL_PITCH_YAW: u32 = posegate_heading::RollPitchYaw as u32;
        const QUATERNION: u32 = posegate_heading::Quaternion as u32;
        const GAUSSIAN: u32 = posegate_spread::Gaussian as u32;
        const BOUNDED: u32 = posegate_spread::Bounded as u32;
        const UNKNOWN: u32 = posegate_spread::Unknown as u32;
        let [p, q, r, _] = self.heading;
        let [a, b, c, d, e, f, g, h, i] = self.spread;
        Ok(PoseEstimate {
            x_m: self.x_m,
            y_m: self.y_m,
            heading: match self.heading_kind {
                YAW => Heading::Radians(p),
                ROLL_PITCH_YAW => Heading::RollPitchYaw([p, q, r]),
                QUATERNION => Heading::Quaternion(self.heading),
                _ => return Err(posegate_status::BadValue),
            },
            spread: match self.spread_kind {
                GAUSSIAN => Some(Uncertainty::Gaussian([[a, b, c], [d, e, f], [g, h, i]])),
                BOUNDED => Some(Uncertainty::Bounded {
                    translation_m: a,
                    yaw_rad: b,
                }),
                UNKNOWN => None,
                _ => return Err(posegate_status::BadValue),
            },
        })
    }
}

const fn axes(axes: u32) -> Result<mavlink::Axes, posegate_status> {
    const UP: u32 = posegate_axes::Up as u32;
    const DOWN: u32 = posegate_axes::Down as u32;
    match axes {
        UP => Ok(mavlink::Axes::Up),
        DOWN => Ok(mavlink::Axes::Down),
        _ => Err(posegate_status::BadValue),
    }
}

/// Converts a message. After an error the estimate has no form.
///
/// # Safety
/// As for [`read`] and [`answer`].
unsafe fn convert<T: Plain>(
    message: *const T,
    belief: *mut posegate_belief,
    of: impl FnOnce(&T) -> Result<PoseEstimate, posegate_status>,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe { answer(belief, || Ok(posegate_belief::of(&of(&read(message)?)?))) }
}

/// Converts a ROS message to an estimate: its marginal over x, y and yaw.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_belief_from_ros(
    message: *const ros::PoseWithCovariance,
    belief: *mut posegate_belief,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe { convert(message, belief, |message| Ok(PoseEstimate::from(message))) }
}

/// Converts a MAVLink `ODOMETRY` to an estimate in axes with z up; `axes` is a `posegate_axes`.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` if `axes` is not in its enum.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_belief_from_mavlink_odometry(
    message: *const mavlink::Odometry,
    axes: u32,
    belief: *mut posegate_belief,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        convert(message, belief, |message| {
            Ok(message.belief(self::axes(axes)?))
        })
    }
}

/// Converts a MAVLink `VISION_POSITION_ESTIMATE` to an estimate in axes with z up; `axes` is a
/// `posegate_axes`.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` if `axes` is not in its enum.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_belief_from_mavlink_vision(
    message: *const mavlink::VisionPositionEstimate,
    axes: u32,
    belief: *mut posegate_belief,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        convert(message, belief, |message| {
            Ok(message.belief(self::axes(axes)?))
        })
    }
}

/// Converts nine numbers to an estimate.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_belief_from_compact(
    message: *const posegate_compact,
    belief: *mut posegate_belief,
) -> posegate_status {
    let of = |m: &posegate_compact| {
        Ok(PoseEstimate::compact([
            m.x_m, m.y_m, m.yaw_rad, m.xx, m.xy, m.x_yaw, m.yy, m.y_yaw, m.yaw_yaw,
        ]))
    };
    // SAFETY: the caller's promise.
    unsafe { convert(message, belief, of) }
}
