//! Converts messages with a pose to estimates of the robot's base. Without DDS.
//!
//! [`Poses`] takes the types of the parameter `pose_type`. The place of the pose on the robot and the site's origin
//! are applied by the function of `posegate replay` ([`posegate_replay::recording::LivePoses`]).

use crate::message::{Header, Pose, Time, TransformStamped};
use posegate::gate::Reason;
use posegate::report::PoseEstimate;
use posegate_files::printable::toml_key;
use posegate_replay::recording::{
    BodyFrames, FrameNames, LivePose, LivePoses, LiveTransform, RecordingError,
};
use std::collections::BTreeMap;

/// A covariance that is the same in so many different poses in a row is a constant of the driver.
const MOST_EQUAL: u32 = 20;

/// The most transforms whose publishers are compared.
const MOST_EDGES: usize = 64;

/// The type of the messages with poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseType {
    /// `geometry_msgs/msg/PoseWithCovarianceStamped`.
    WithCovariance,
    /// `nav_msgs/msg/Odometry`.
    Odometry,
    /// `geometry_msgs/msg/PoseStamped`.
    Pose,
    /// `tf2_msgs/msg/TFMessage`.
    Transforms,
}

impl PoseType {
    /// Returns `true` if messages of this type have a covariance.
    #[must_use]
    pub const fn has_covariance(self) -> bool {
        matches!(self, Self::WithCovariance | Self::Odometry)
    }
}

/// How poses are read.
#[derive(Clone, Debug)]
pub struct PoseSettings {
    /// The type of the messages.
    pub kind: PoseType,
    /// The largest error that replaces covariances: translation (m) and yaw (rad).
    pub bound: Option<[f64; 2]>,
    /// The places of frames on the robot.
    pub body: BodyFrames,
    /// The frames of transforms.
    pub names: FrameNames,
    /// The squared radius of the pose-sets, times the inflation.
    pub radius_squared: f64,
}

/// A pose of the robot's base, or why there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseReport {
    /// The stamp of the message.
    pub stamp: Time,
    /// The frame of the numbers.
    pub frame: String,
    /// The estimate.
    pub pose: Result<PoseEstimate, RefusedPose>,
}

/// The reason why a pose is not used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RefusedPose {
    /// The pose is that of a frame with an unknown place on the robot.
    #[error(
        "poses are of the frame `{child}`, and its place on the robot is not known{known}: give --site FILE with [frame.{}], or child_frame_id:={child} if it is the robot's base",
        toml_key(.child)
    )]
    ChildFrame {
        /// The frame.
        child: String,
        /// The frames with a known place, as text.
        known: String,
    },
    /// The covariance of a pose beside the robot's axis lacks terms.
    #[error(
        "poses are of a frame beside the robot's base, and cross_terms says that their covariances lack terms: set it to filled if all terms are the filter's, or state the largest error by set_translation_m and set_yaw_deg"
    )]
    PartialCovariance,
    /// All entries of the covariance are zero.
    #[error(
        "the covariance is zero, so the source does not fill it: state its largest error by set_translation_m and set_yaw_deg"
    )]
    ZeroCovariance,
    /// The covariance does not change.
    #[error(
        "the covariance was the same in {0} different poses, so it is a constant and not an uncertainty: state the largest error of the source by set_translation_m and set_yaw_deg"
    )]
    FixedCovariance(u32),
    /// A transform comes from another publisher than before.
    #[error(
        "the transform from `{parent}` to `{child}` has two publishers, or its publisher was started again: give each robot frames or a topic of its own (-r /tf:=tf)"
    )]
    TwoPublishers {
        /// The frame of the pose.
        parent: String,
        /// The frame whose pose it is.
        child: String,
    },
}

impl RefusedPose {
    /// Returns the reason of the gate.
    #[must_use]
    pub const fn reason(&self) -> Reason {
        match self {
            Self::ChildFrame { .. } => Reason::FrameMismatch,
            Self::ZeroCovariance => Reason::CovarianceZero,
            Self::TwoPublishers { .. } => Reason::SourceChanged,
            Self::PartialCovariance | Self::FixedCovariance(_) => Reason::CovarianceUnknown,
        }
    }
}

impl From<RecordingError> for RefusedPose {
    fn from(error: RecordingError) -> Self {
        match error {
            RecordingError::PartialCovariance { .. } => Self::PartialCovariance,
            RecordingError::ChildFrame { child, known, .. } => Self::ChildFrame {
                child,
                known: match known.as_str() {
                    "" => known,
                    known => format!(" (known: {known})"),
                },
            },
            // A pose that is not in a file has no other fault.
            other => Self::ChildFrame {
                child: other.to_string(),
                known: String::new(),
            },
        }
    }
}

/// Converts poses.
pub struct Poses {
    live: LivePoses,
    frame: String,
    odometry: String,
    has_bound: bool,
    /// The bits of the last covariance and pose.
    last: Option<([u64; 36], [u64; 7])>,
    /// How many different poses in a row had the last covariance.
    equal: u32,
    /// The publisher of each transform from the world's or the odometry's frame.
    publishers: BTreeMap<(String, String), [u8; 16]>,
}

impl Poses {
    /// Returns a converter of the messages of a topic.
    #[must_use]
    pub fn new(settings: &PoseSettings, topic: &str) -> Self {
        let (body, names) = (settings.body.clone(), settings.names.clone());
        Self {
            frame: names.world.clone(),
            odometry: names.odometry.clone(),
            live: LivePoses::new(topic, body, names, settings.bound, settings.radius_squared),
            has_bound: settings.bound.is_some(),
            last: None,
            equal: 0,
            publishers: BTreeMap::new(),
        }
    }

    /// Converts a pose of the frame `child` on the robot, if the message names it, with its covariance, if it has one.
    pub fn pose(
        &mut self,
        header: Header,
        child: Option<String>,
        pose: &Pose,
        covariance: Option<[f64; 36]>,
    ) -> PoseReport {
        let checked = match covariance {
            Some(covariance) if !self.has_bound => self.check_covariance(pose, &covariance),
            _ => Ok(()),
        };
        let pose = checked.and_then(|()| {
            Ok(self.live.pose(LivePose {
                child,
                position: pose.position,
                orientation: pose.orientation,
                covariance,
            })?)
        });
        PoseReport {
            stamp: header.stamp,
            frame: header.frame_id,
            pose,
        }
    }

    /// Converts transforms; `None` if they give no newer pose. A transform that another publisher sent before is
    /// refused: it may be that of another robot.
    pub fn transforms(
        &mut self,
        message: &[TransformStamped],
        publisher: [u8; 16],
    ) -> Option<PoseReport> {
        if let Some((parent, child)) = self.foreign(message, publisher) {
            return Some(PoseReport {
                stamp: message.first()?.header.stamp,
                frame: self.frame.clone(),
                pose: Err(RefusedPose::TwoPublishers { parent, child }),
            });
        }
        let transforms = message.iter().map(|transform| LiveTransform {
            stamp_ns: transform.header.stamp.ns(),
            parent: transform.header.frame_id.clone(),
            child: transform.child_frame_id.clone(),
            position: transform.translation,
            orientation: transform.rotation,
        });
        let (stamp, pose) = match self.live.transforms(transforms) {
            Ok(None) => return None,
            Ok(Some((stamp_ns, pose))) => (Time::from_ns(stamp_ns), Ok(pose)),
            Err(error) => (Time::default(), Err(error.into())),
        };
        Some(PoseReport {
            stamp,
            frame: self.frame.clone(),
            pose,
        })
    }

    /// Returns the first transform of the robot that had another publisher before.
    fn foreign(
        &mut self,
        message: &[TransformStamped],
        publisher: [u8; 16],
    ) -> Option<(String, String)> {
        let mut foreign = None;
        for transform in message {
            let [parent, child] = [&transform.header.frame_id, &transform.child_frame_id]
                .map(|name| name.trim_start_matches('/').to_owned());
            let is_ours = [&self.frame, &self.odometry]
                .into_iter()
                .any(|name| name.trim_start_matches('/') == parent);
            let edge = (parent, child);
            if !is_ours
                || self.publishers.len() > MOST_EDGES && !self.publishers.contains_key(&edge)
            {
                continue;
            }
            let before = self.publishers.insert(edge.clone(), publisher);
            if before.is_some_and(|before| before != publisher) {
                foreign = foreign.or(Some(edge));
            }
        }
        foreign
    }

    fn check_covariance(&mut self, pose: &Pose, covariance: &[f64; 36]) -> Result<(), RefusedPose> {
        let covariance_bits = covariance.map(f64::to_bits);
        let [x, y, z] = pose.position.map(f64::to_bits);
        let [a, b, c, d] = pose.orientation.map(f64::to_bits);
        let now = (covariance_bits, [x, y, z, a, b, c, d]);
        match self.last.replace(now) {
            Some((last, _)) if last != now.0 => self.equal = 1,
            // The same pose again says nothing about the covariance.
            Some((_, last)) if last == now.1 => {}
            _ => self.equal = self.equal.saturating_add(1),
        }
        if covariance.iter().all(|entry| *entry == 0.0) {
            return Err(RefusedPose::ZeroCovariance);
        }
        if self.equal >= MOST_EQUAL {
            return Err(RefusedPose::FixedCovariance(self.equal));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
