//! Converts detections of tags to poses: one, or two if a tag is seen head-on. Without DDS.
//!
//! The geometry is in [`posegate_replay::detector`]. [`Tags`] keeps the camera that the camera info describes, and
//! the result of the last detections as text.

use crate::message::{
    AprilTagDetectionArray, CameraInfo, DiagnosticStatus, ERROR, KeyValue, OK, WARN,
};
use posegate::gate::Reason;
use posegate::report::PoseEstimate;
use posegate::set::{Estimate, Uncertainty};
use posegate_replay::corners::{Fix, MountedCamera, is_ambiguous};
use posegate_replay::detector::{self, Detector, FoundTag};

/// The result of one message of detections.
#[derive(Clone, Debug, PartialEq)]
pub enum Look {
    /// The possible poses of the robot, best first: one or two; `true` if poses that are far apart fit.
    Poses(Vec<PoseEstimate>, bool),
    /// No pose. An earlier pose is still valid.
    Nothing,
    /// No pose, and the message contradicts the site: an earlier pose must not be used. The reason of the denial.
    Contradiction(Reason),
}

/// Computes poses from detections.
#[derive(Clone, Debug)]
pub struct Tags {
    detector: Detector,
    topics: [String; 2],
    info: Option<CameraInfo>,
    camera: Option<MountedCamera>,
    /// The reason why the camera info is not used.
    refused: Option<String>,
    /// The reason why the last detections gave no pose.
    unused: Option<String>,
    counts: [u64; 4],
}

impl Tags {
    /// Returns a converter without a camera info; the topics are those of the detections and of the camera info, for
    /// messages.
    #[must_use]
    pub const fn new(detector: Detector, topics: [String; 2]) -> Self {
        Self {
            detector,
            topics,
            info: None,
            camera: None,
            refused: None,
            unused: None,
            counts: [0; 4],
        }
    }

    /// Processes a camera info. If it is not that of the site's camera it is refused, and the earlier one is not used
    /// any more.
    pub fn camera_info(&mut self, message: &CameraInfo) {
        let is_same = self
            .info
            .as_ref()
            .is_some_and(|info| info.is_same_calibration(message));
        if is_same {
            return;
        }
        let camera = self.detector.camera(&calibration(message));
        self.info = Some(message.clone());
        (self.camera, self.refused) = match camera {
            Ok(camera) => (Some(camera), None),
            Err(error) => (None, Some(error.to_string())),
        };
    }

    /// Processes a camera info that could not be decoded: its content is not known, so the earlier one is not used
    /// any more.
    pub fn camera_info_lost(&mut self) {
        (self.info, self.camera) = (None, None);
        self.refused = Some(format!("a message of {} could not be read", self.topics[1]));
    }

    /// Returns `true` if a camera info is known and is that of the site's camera.
    #[must_use]
    pub const fn has_camera(&self) -> bool {
        self.camera.is_some()
    }

    /// Processes detections.
    pub fn look(&mut self, message: &AprilTagDetectionArray) -> Look {
        let (look, unused) = self.looked(message);
        self.unused = unused;
        let kind = match &look {
            Look::Poses(poses, _) if poses.len() == 1 => 0,
            Look::Poses(..) => 1,
            Look::Nothing => 2,
            Look::Contradiction(_) => 3,
        };
        self.counts[kind] += 1;
        look
    }

    fn looked(&self, message: &AprilTagDetectionArray) -> (Look, Option<String>) {
        // Without a camera info the camera is not known: see `problem`.
        let (Some(info), Some(camera)) = (&self.info, &self.camera) else {
            return (Look::Nothing, None);
        };
        let (own, camera_frame) = (&message.header.frame_id, &info.header.frame_id);
        if own != camera_frame {
            let [detections, camera_info] = &self.topics;
            let words = format!(
                "{detections} is in the frame `{own}`, and {camera_info} in `{camera_frame}`: they are of two cameras; remap one of them"
            );
            return (Look::Contradiction(Reason::FrameMismatch), Some(words));
        }
        let found: Vec<FoundTag> = message
            .detections
            .iter()
            .map(|detection| FoundTag {
                family: detection.family.clone(),
                id: detection.id,
                hamming: detection.hamming,
                corners_px: detection.corners,
            })
            .collect();
        match self.detector.look(camera, &found) {
            Ok(fixes) => {
                let poses = fixes.iter().map(estimate).collect();
                (Look::Poses(poses, is_ambiguous(&fixes)), None)
            }
            Err(error) => {
                let look = error.reason().map_or(Look::Nothing, Look::Contradiction);
                (look, Some(error.to_string()))
            }
        }
    }

    /// Returns the reason, as text, why detections give no pose; `None` if the last ones gave a pose.
    #[must_use]
    pub fn problem(&self) -> Option<String> {
        let [detections, camera_info] = &self.topics;
        if let Some(refused) = &self.refused {
            return Some(format!(
                "no detection is used, because of {camera_info}: {refused}"
            ));
        }
        if self.camera.is_none() {
            return Some(format!(
                "no detection is used: no camera info has arrived on {camera_info}; start its publisher, or remap camera_info (-r)"
            ));
        }
        let unused = self.unused.as_ref()?;
        Some(format!(
            "the last message of {detections} gives no pose: {unused}"
        ))
    }

    /// Returns the state for the diagnostics.
    #[must_use]
    pub fn status(&self) -> DiagnosticStatus {
        let problem = self.problem();
        let level = match (&problem, &self.camera) {
            (None, _) => OK,
            (_, Some(_)) => WARN,
            (_, None) => ERROR,
        };
        let [one, two, nothing, contradictions] = self.counts;
        let settings = self.detector.settings();
        DiagnosticStatus {
            level,
            name: "posegate: tags".into(),
            message: problem.unwrap_or_else(|| "detections give poses".into()),
            hardware_id: self.detector.camera_name().into(),
            values: vec![
                KeyValue::new("camera", self.detector.camera_name()),
                KeyValue::new("corner_sigma_px", settings.corner_sigma_px),
                KeyValue::new("one_pose", one),
                KeyValue::new("two_poses", two),
                KeyValue::new("no_pose", nothing),
                KeyValue::new("contradictions", contradictions),
            ],
        }
    }
}

/// Returns the estimate of a fix.
fn estimate(fix: &Fix) -> PoseEstimate {
    let [x_m, y_m, yaw_rad] = fix.pose;
    PoseEstimate::new(
        Estimate { x_m, y_m, yaw_rad },
        Uncertainty::Gaussian(fix.covariance),
    )
}

/// Returns the calibration of a message.
fn calibration(message: &CameraInfo) -> detector::CameraInfo {
    let ([x, y, rows, columns], _) = message.roi;
    detector::CameraInfo {
        width: message.width,
        height: message.height,
        distortion_model: message.distortion_model.clone(),
        d: message.d.clone(),
        k: message.k,
        r: message.r,
        p: message.p,
        binning: message.binning,
        roi: [x, y, columns, rows],
    }
}

#[cfg(test)]
mod tests;
