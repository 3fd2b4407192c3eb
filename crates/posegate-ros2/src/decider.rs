//! The interface of a decider: the gate in this process, or the controller on a serial line.

use crate::clock::Now;
use crate::diagnostics::explanation;
use crate::markers::markers;
use crate::message::{
    AprilTagDetectionArray, CameraInfo, DiagnosticStatus, KeyValue, MarkerArray, Odometry,
};
use crate::permission::report_values;
use crate::permit_gate::{Answer, Origin, PermitGate};
use crate::poses::PoseReport;
use crate::settings::NodeSettings;
use crate::tags::Tags;
use posegate::gate::Reason;
use std::time::Duration;

/// Decides from ROS messages.
pub trait Decider {
    /// Processes a pose.
    fn pose(&mut self, now: Now, message: &PoseReport, origin: Origin) -> Answer;

    /// Processes the detections of an image.
    fn detections(&mut self, now: Now, message: &AprilTagDetectionArray, origin: Origin) -> Answer;

    /// Processes a camera info; `None` if it could not be decoded.
    fn camera_info(&mut self, message: Option<&CameraInfo>);

    /// Processes a pose of the odometry.
    fn odometry(&mut self, now: Now, message: &Odometry, origin: Origin) -> Answer;

    /// Reports that a message of the odometry could not be decoded.
    fn odometry_lost(&mut self, now: Now) -> Answer;

    /// Advances the time. Called in every control cycle.
    fn tick(&mut self, now: Now) -> Answer;

    /// Ends a permit for a cause outside of the gate.
    fn inhibit(&mut self, now: Now, reason: Reason) -> Answer;

    /// Restarts the gate, closed. Returns a description.
    ///
    /// # Errors
    /// The reason, as text, why it does not restart.
    fn reset(&mut self, now: Now) -> Result<String, String>;

    /// Returns the values of the last report for the heartbeat.
    fn report(&self) -> Vec<KeyValue>;

    /// Returns the name of the frame of the last pose.
    fn frame(&self) -> Option<&str>;

    /// Returns additional diagnostics.
    fn diagnostics(&self, now: Now) -> Vec<DiagnosticStatus>;

    /// Returns the reason of the answer and a recommended action, as text. `hint` is an action that the node knows.
    fn explain(&self, answer: &Answer, hint: Option<&str>) -> String;

    /// Returns the markers of the last report.
    fn markers(&self, answer: &Answer) -> Option<MarkerArray>;

    /// Returns the longest time to wait for a message, if it is shorter than a control cycle.
    fn patience(&self) -> Option<Duration>;

    /// Returns `true` if the task is asked for by name.
    fn takes_tasks(&self) -> bool {
        false
    }

    /// Changes the task. The gate closes, unless it is the task that is decided on.
    fn ask(&mut self, _: Now, _: &str) {}

    /// Returns the settings of the task that is decided on; `None` if there is no task. `given` are those of the node.
    fn chosen<'s>(&'s self, given: &'s NodeSettings) -> Option<&'s NodeSettings> {
        Some(given)
    }

    /// Returns why there is no task to decide on.
    fn problem(&self) -> Option<String> {
        None
    }
}

impl Decider for PermitGate<'_> {
    fn pose(&mut self, now: Now, message: &PoseReport, origin: Origin) -> Answer {
        Self::pose(self, now, message, origin)
    }

    fn detections(&mut self, now: Now, message: &AprilTagDetectionArray, origin: Origin) -> Answer {
        Self::detections(self, now, message, origin)
    }

    fn camera_info(&mut self, message: Option<&CameraInfo>) {
        Self::camera_info(self, message);
    }

    fn odometry(&mut self, now: Now, message: &Odometry, origin: Origin) -> Answer {
        Self::odometry(self, now, message, origin)
    }

    fn odometry_lost(&mut self, now: Now) -> Answer {
        Self::odometry_lost(self, now)
    }

    fn tick(&mut self, now: Now) -> Answer {
        self.scrub();
        Self::tick(self, now)
    }

    fn inhibit(&mut self, now: Now, reason: Reason) -> Answer {
        Self::inhibit(self, now, reason)
    }

    fn reset(&mut self, now: Now) -> Result<String, String> {
        match Self::reset(self, now) {
            Ok(()) => Ok("the gate was reset: it is closed, and qualifies again".into()),
            Err(error) => Err(error.to_string()),
        }
    }

    fn report(&self) -> Vec<KeyValue> {
        self.last()
            .map(report_values)
            .into_iter()
            .flatten()
            .collect()
    }

    fn frame(&self) -> Option<&str> {
        self.last().map(|last| last.frame.as_str())
    }

    fn diagnostics(&self, _: Now) -> Vec<DiagnosticStatus> {
        self.tags().map(Tags::status).into_iter().collect()
    }

    fn explain(&self, answer: &Answer, hint: Option<&str>) -> String {
        let last = self.last().and_then(|last| last.step.err());
        let words = explanation(answer, last, hint);
        match self.tags().and_then(Tags::problem) {
            Some(problem) if !answer.is_open => format!("{words} Detections: {problem}."),
            _ => words,
        }
    }

    fn markers(&self, answer: &Answer) -> Option<MarkerArray> {
        let table = self.gate().table().ok()?;
        Some(markers(answer, self.last()?, table))
    }

    fn patience(&self) -> Option<Duration> {
        None
    }
}
