//! Poses as they arrive, of any type of message: made poses of the robot's base by the function that a recording uses.

use super::body::{BodyFrames, of_base};
use super::intake::{Covariance, Intake, Role};
use super::message::{Content, Message};
use super::transforms::{FrameNames, Pose, Transform};
use super::{Item, RecordingError};
use posegate::report::PoseEstimate;

/// A pose as a message has it. Its numbers are unchecked: any bits.
#[derive(Clone, Debug)]
pub struct LivePose {
    /// The frame of the robot of which the pose is; `None` for a type without this field.
    pub child: Option<String>,
    /// x, y, z, metres.
    pub position: [f64; 3],
    /// The quaternion x, y, z, w.
    pub orientation: [f64; 4],
    /// 6 x 6 by rows over x, y, z and rotations about the fixed axes x, y, z; `None` for a type without this field.
    pub covariance: Option<[f64; 36]>,
}

/// A transform of `/tf` as a message has it. Its numbers are unchecked: any bits.
#[derive(Clone, Debug)]
pub struct LiveTransform {
    /// Nanoseconds.
    pub stamp_ns: i64,
    /// The frame of the pose.
    pub parent: String,
    /// The frame whose pose it is.
    pub child: String,
    /// x, y, z, metres.
    pub position: [f64; 3],
    /// The quaternion x, y, z, w.
    pub orientation: [f64; 4],
}

/// Makes poses of messages poses of the robot's base, relative to the site's origin.
pub struct LivePoses {
    intake: Intake,
    topic: String,
    bound: Option<[f64; 2]>,
    radius_squared: f64,
}

impl LivePoses {
    /// Uses the frames of a robot, and the frames' names for transforms. `topic` is for messages. `bound` (translation in metres, yaw in
    /// radians) replaces the uncertainty of every pose. `radius_squared` is that of the pose-sets, with the source's inflation.
    #[must_use]
    pub fn new(
        topic: &str,
        body: BodyFrames,
        names: FrameNames,
        bound: Option<[f64; 2]>,
        radius_squared: f64,
    ) -> Self {
        let mut intake = Intake::new(&[]);
        (intake.body, intake.names) = (body, names);
        Self {
            intake,
            topic: topic.into(),
            bound,
            radius_squared,
        }
    }

    /// Returns the estimate of a pose.
    ///
    /// # Errors
    /// [`RecordingError::ChildFrame`] or [`RecordingError::PartialCovariance`]
    pub fn pose(&mut self, pose: LivePose) -> Result<PoseEstimate, RecordingError> {
        let covariance = pose.covariance.map(|entries| {
            let mut rows: Covariance = [[0.0; 6]; 6];
            for (to, from) in rows.as_flattened_mut().iter_mut().zip(entries) {
                *to = from;
            }
            rows
        });
        let content = Content::Pose {
            pose: Pose {
                position: pose.position,
                orientation: pose.orientation,
            },
            covariance,
        };
        let estimate = self.estimate(pose.child, content)?;
        // A message of a pose is always an item.
        Ok(estimate.map_or(NO_POSE, |(_, estimate)| estimate))
    }

    /// Returns the newest pose that transforms give, and its stamp in nanoseconds; `None` if they give no newer one.
    ///
    /// # Errors
    /// [`RecordingError::ChildFrame`] or [`RecordingError::PartialCovariance`]
    pub fn transforms(
        &mut self,
        transforms: impl IntoIterator<Item = LiveTransform>,
    ) -> Result<Option<(i64, PoseEstimate)>, RecordingError> {
        let transforms = transforms.into_iter().map(|transform| Transform {
            stamp_ns: transform.stamp_ns,
            parent: transform.parent,
            child: transform.child,
            pose: Pose {
                position: transform.position,
                orientation: transform.orientation,
            },
        });
        self.estimate(None, Content::Transforms(transforms.collect()))
    }

    fn estimate(
        &mut self,
        child: Option<String>,
        content: Content,
    ) -> Result<Option<(i64, PoseEstimate)>, RecordingError> {
        let message = Message {
            stamp_ns: 0,
            frame: String::new(),
            child,
            content,
        };
        let item = self
            .intake
            .item(&self.topic, message, Role::Estimates(0), 0)?;
        Ok(match item {
            Some(Item::Estimate(sample)) => {
                let stamp_ns = sample.exact_ns.map_or(0, |exact| exact.stamp);
                let lever_m = sample.lever_m;
                let estimate = of_base(&sample.belief, self.bound, lever_m, self.radius_squared);
                Some((stamp_ns, estimate))
            }
            _ => None,
        })
    }
}

/// An estimate that every gate denies.
const NO_POSE: PoseEstimate = PoseEstimate {
    x_m: f64::NAN,
    y_m: f64::NAN,
    heading: posegate::report::Heading::Radians(f64::NAN),
    spread: None,
};

#[cfg(test)]
mod tests {
    use super::*;
    use posegate::report::Heading;
    use posegate::set::Uncertainty;
    use posegate::shape::Pose3Deg;
    use std::collections::BTreeMap;

    fn live(bound: Option<[f64; 2]>) -> LivePoses {
        let antenna = Pose3Deg {
            x: 0.5,
            y: 0.0,
            z: 1.2,
            roll_deg: 0.0,
            pitch_deg: 0.0,
            yaw_deg: 0.0,
        };
        let frames = BTreeMap::from([("antenna".to_owned(), antenna)]);
        let body = BodyFrames::new(&frames).with_origin([1000.0, 2000.0]);
        LivePoses::new("/odom", body, FrameNames::default(), bound, 11.3449)
    }

    fn pose(child: Option<&str>) -> LivePose {
        let mut covariance = [0.0; 36];
        for (at, variance) in [(0, 1e-4), (7, 1e-4), (35, 1e-4)] {
            covariance[at] = variance;
        }
        LivePose {
            child: child.map(Into::into),
            position: [1001.0, 2000.0, 0.0],
            orientation: [0.0, 0.0, 0.0, 1.0],
            covariance: Some(covariance),
        }
    }

    #[test]
    fn pose_of_an_antenna_becomes_that_of_the_base_relative_to_the_origin() {
        let estimate = live(None).pose(pose(Some("antenna"))).unwrap();
        assert!((estimate.x_m - 0.5).abs() < 1e-9 && estimate.y_m.abs() < 1e-9);
        let Some(Uncertainty::Gaussian(rows)) = estimate.spread else {
            panic!("{estimate:?}");
        };
        // A turn about the antenna moves the base across.
        assert!(rows[1][1] > 1.2e-4 && rows[1][2] < -4e-5, "{rows:?}");
        let bounded = live(Some([0.05, 0.1])).pose(pose(Some("antenna"))).unwrap();
        let Some(Uncertainty::Bounded { translation_m, .. }) = bounded.spread else {
            panic!("{bounded:?}");
        };
        assert!((translation_m - 0.099_98).abs() < 1e-4, "{translation_m}");
        let base = live(None).pose(pose(None)).unwrap();
        assert!((base.x_m - 1.0).abs() < 1e-9);
    }

    #[test]
    fn pose_of_an_unknown_frame_is_refused() {
        let refused = live(None).pose(pose(Some("mast"))).unwrap_err();
        assert!(
            matches!(refused, RecordingError::ChildFrame { .. }),
            "{refused}"
        );
    }

    #[test]
    fn transforms_give_a_pose_with_the_stated_bound() {
        let mut live = live(Some([0.05, 0.1]));
        let transform = |stamp_ns, parent: &str, child: &str| LiveTransform {
            stamp_ns,
            parent: parent.into(),
            child: child.into(),
            position: [1000.5, 2000.0, 0.0],
            orientation: [0.0, 0.0, 0.0, 1.0],
        };
        let unrelated = transform(5, "base_link", "wheel");
        assert!(live.transforms([unrelated]).unwrap().is_none());
        let (stamp_ns, estimate) = live
            .transforms([transform(7, "map", "base_link")])
            .unwrap()
            .unwrap();
        assert_eq!(stamp_ns, 7);
        assert!(
            (estimate.x_m - 0.5).abs() < 1e-9 && matches!(estimate.heading, Heading::Quaternion(_))
        );
        assert!(matches!(estimate.spread, Some(Uncertainty::Bounded { .. })));
    }
}
