//! The interface of a decider: the gate in this process, or the controller on a serial line.

use crate::clock::Now;
use crate::message::{
    AprilTagDetectionArray, CameraInfo, DiagnosticStatus, KeyValue, Marker, Odometry,
};
use crate::permit_gate::{Answer, Origin};
use crate::poses::PoseReport;
use crate::settings::NodeSettings;
use posegate::gate::Reason;
use std::time::Duration;

/// Decides from ROS messages. By default it has one task, and neither odometry nor a camera.
pub trait Decider {
    /// Processes a pose.
    fn pose(&mut self, now: Now, message: &PoseReport, origin: Origin) -> Answer;

    /// Processes the detections of an image.
    fn detections(&mut self, now: Now, _: &AprilTagDetectionArray, _: Origin) -> Answer {
        self.tick(now)
    }

    /// Processes a camera info; `None` if it could not be decoded.
    fn camera_info(&mut self, _: Option<&CameraInfo>) {}

    /// Processes a pose of the odometry.
    fn odometry(&mut self, now: Now, _: &Odometry, _: Origin) -> Answer {
        self.tick(now)
    }

    /// Reports that a message of the odometry could not be decoded.
    fn odometry_lost(&mut self, now: Now) -> Answer {
        self.tick(now)
    }

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
    fn markers(&self, _: &Answer) -> Option<Vec<Marker>> {
        None
    }

    /// Returns the longest time to wait for a message, if that is shorter than a control cycle.
    fn patience(&self) -> Duration {
        Duration::MAX
    }

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
