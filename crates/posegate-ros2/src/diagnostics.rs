//! The content of `/diagnostics`: the permission, and each subscription; reasons in words.

use crate::message::{DiagnosticArray, DiagnosticStatus, KeyValue, OK, WARN};
use crate::permission::{NAME, array};
use crate::permit_gate::Answer;
use crate::received::Received;
use crate::settings::NodeSettings;
use posegate::gate::Reason;
use posegate::report::FrameId;

/// Returns the diagnostics of the node. `task` are the settings of the task that is decided on, `hint` is what keeps
/// the gate closed besides its own reason, and `pose` has the subscription of poses with the problem of the last one;
/// `more` are the diagnostics of other subscriptions and of the decider.
#[must_use]
pub fn diagnostics(
    answer: &Answer,
    settings: &NodeSettings,
    task: Option<&NodeSettings>,
    hint: Option<&str>,
    pose: (&Received, Option<String>),
    clock_steps: u64,
    more: Vec<DiagnosticStatus>,
) -> DiagnosticArray {
    let mut status = vec![permission(
        answer,
        task.unwrap_or(settings),
        task.is_some(),
        hint,
        clock_steps,
    )];
    let input = match settings.detector {
        None => "pose",
        Some(_) => "detections",
    };
    let (pose, refused) = pose;
    status.push(pose.status(input, answer.now, refused.or_else(|| pose.stamps(settings))));
    status.extend(more);
    // Robots share this topic: the name of each status begins with the robot's.
    let robot = settings.robot.trim_start_matches('/');
    for status in &mut status {
        if let Some(of) = status.name.strip_prefix(NAME) {
            status.name = format!("{robot}{of}");
        }
    }
    array(answer.now, status)
}

/// Returns the problem of poses in a frame that is not the site's.
#[must_use]
pub fn wrong_frame(frame: &str, settings: &NodeSettings) -> Option<String> {
    (FrameId::of(frame) != FrameId::of(&settings.frame)).then(|| {
        format!(
            "poses are in the frame `{frame}`, expected `{}`: set frame_id only if that is the world frame of the site",
            settings.frame
        )
    })
}

fn permission(
    answer: &Answer,
    settings: &NodeSettings,
    has_task: bool,
    hint: Option<&str>,
    clock_steps: u64,
) -> DiagnosticStatus {
    let [task, site] = match has_task {
        true => [settings.task().to_owned(), settings.site()],
        false => Default::default(),
    };
    let reason = answer.reason();
    let site_check = if settings.serial.is_some() {
        "of the table that was given; the controller does not say from which site its own is"
    } else if settings.site_is_checked {
        "as given"
    } else {
        "not given: any table of the task's name would be accepted; start the node with --task-digest"
    };
    DiagnosticStatus {
        level: if reason.is_none() { OK } else { WARN },
        name: "posegate: permission".into(),
        message: reason.map_or_else(
            || "permit".into(),
            |reason| format!("{}: {}", reason.name(), words(reason, hint)),
        ),
        hardware_id: task.clone(),
        values: vec![
            KeyValue::new("task", task),
            KeyValue::new("site", site),
            KeyValue::new("site_check", site_check),
            KeyValue::new("state", answer.state.name()),
            KeyValue::new("clock_steps", clock_steps),
        ],
    }
}

/// Returns the hint, if there is one; else the meaning of a reason and a recommended action.
#[must_use]
pub fn words(reason: Reason, hint: Option<&str>) -> String {
    match hint {
        None => format!("{} {}", reason.meaning(), reason.action()),
        // The gate knows neither the topic nor its publishers, and would name the link.
        Some(hint) => format!("{hint}."),
    }
}

/// Returns the answer of the service `explain`: the state of the gate, the reason of the last denial, and a
/// recommended action.
#[must_use]
pub fn explanation(answer: &Answer, last: Option<Reason>, hint: Option<&str>) -> String {
    let now = match answer.reason() {
        None => "permit".to_owned(),
        Some(reason) => format!("deny, {}: {}", reason.name(), words(reason, hint)),
    };
    // While permits are counted, the last report has the reason why a permit does not count.
    match last {
        Some(reason) if Some(reason) != answer.reason() => {
            format!(
                "{now} Last report: {}: {}",
                reason.name(),
                words(reason, None)
            )
        }
        _ => now,
    }
}
