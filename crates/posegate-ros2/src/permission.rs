//! The fail-safe permit: a heartbeat with a stamp, a number and a validity.
//!
//! A `Bool` that a publisher leaves behind looks like a new one. Therefore consumers use this message, a
//! `diagnostic_msgs/msg/DiagnosticArray` with one status. It permits only if all of its parts agree: zeroed or
//! default messages deny. `docs/for-ros.md` has the rules that a consumer must follow; [`crate::permit_watch`] and
//! `integrations/ros2/permit_listener.py` are consumers.

use crate::clock::Now;
use crate::message::{DiagnosticArray, DiagnosticStatus, Header, KeyValue, OK, WARN};
use crate::permit_gate::{Answer, LastReport};
use crate::settings::NodeSettings;
use posegate::gate::{Reason, Verdict};
use posegate::pose::Pose;
use posegate_replay::coordinates;
use std::hash::{BuildHasher, Hasher};

/// The name of the status.
pub const NAME: &str = "posegate";
/// The version of the message's rules.
pub const FORMAT: &str = "2";
/// The message of a permit. All other messages deny.
pub const PERMIT: &str = "permit";
/// The message of a denial.
pub const DENY: &str = "deny";

/// Makes the heartbeats of one run of the node.
#[derive(Debug)]
pub struct Heartbeat {
    run: String,
    sequence: u64,
}

impl Heartbeat {
    /// Starts the heartbeats of a run, with a random name by which consumers detect a restart.
    #[must_use]
    pub fn start() -> Self {
        let random = std::hash::RandomState::new().build_hasher().finish();
        Self {
            run: format!("{random:016x}"),
            sequence: 0,
        }
    }

    /// Returns the next heartbeat, with the values of the last report. `task` are the settings of the task that is
    /// decided on; without one the heartbeat names no table, and denies.
    pub fn next(
        &mut self,
        answer: &Answer,
        settings: &NodeSettings,
        task: Option<&NodeSettings>,
        report: Vec<KeyValue>,
    ) -> DiagnosticArray {
        self.sequence += 1;
        let is_open = answer.is_open && task.is_some();
        let [name, table, site] = match task {
            Some(task) => [task.task().to_owned(), task.table(), task.site()],
            None => Default::default(),
        };
        let mut values = vec![
            KeyValue::new("format", FORMAT),
            KeyValue::new("task", &name),
            KeyValue::new("robot", &settings.robot),
            KeyValue::new("table", table),
            KeyValue::new("site", site),
            KeyValue::new("run", &self.run),
            KeyValue::new("sequence", self.sequence),
            KeyValue::new("valid_ms", if is_open { settings.valid_ms } else { 0 }),
            KeyValue::new("state", answer.state.name()),
            KeyValue::new("reason", answer.reason().map_or("", Reason::name)),
        ];
        values.extend(report);
        let status = DiagnosticStatus {
            level: if is_open { OK } else { WARN },
            name: NAME.into(),
            message: if is_open { PERMIT } else { DENY }.into(),
            hardware_id: name,
            values,
        };
        array(answer.now, vec![status])
    }
}

/// Returns statuses with a stamp.
#[must_use]
pub fn array(now: Now, status: Vec<DiagnosticStatus>) -> DiagnosticArray {
    DiagnosticArray {
        header: Header {
            stamp: now.time(),
            frame_id: String::new(),
        },
        status,
    }
}

/// Returns the last report as names and values: its verdict alone, and the gate's answer.
#[must_use]
pub fn report_values(last: &LastReport) -> [KeyValue; 6] {
    let (reason, margin, worst_pose) = match last.verdict {
        Verdict::Permit { margin } => (None, Some(margin), None),
        Verdict::Deny {
            reason,
            margin,
            worst_pose,
        } => (Some(reason), margin, worst_pose),
    };
    let margin = margin.map(|margin| f64::from(margin.q16()) / 65_536.0);
    let stamp = last.stamp;
    [
        KeyValue::new(
            "report_stamp",
            format_args!("{}.{:09}", stamp.sec, stamp.nanosec),
        ),
        KeyValue::new(
            "report_verdict",
            if reason.is_none() { PERMIT } else { DENY },
        ),
        KeyValue::new("report_reason", reason.map_or("", Reason::name)),
        KeyValue::new(
            "report_margin",
            margin.map_or(String::new(), |margin| margin.to_string()),
        ),
        KeyValue::new(
            "report_worst_pose",
            worst_pose.map_or(String::new(), pose_text),
        ),
        KeyValue::new("gate_reason", last.step.err().map_or("", Reason::name)),
    ]
}

/// Returns a pose as `x y yaw`, metres and radians.
fn pose_text(pose: Pose) -> String {
    coordinates(pose).map(|value| value.to_string()).join(" ")
}
