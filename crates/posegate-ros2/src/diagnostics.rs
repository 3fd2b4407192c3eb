//! The content of `/diagnostics`: the permission, and each subscription.

use crate::clock::Now;
use crate::message::{DiagnosticArray, DiagnosticStatus, ERROR, KeyValue, OK, Time, WARN};
use crate::peers::{Peers, delivery_words};
use crate::permission::{NAME, array};
use crate::permit_gate::Answer;
use crate::settings::{Delivery, NodeSettings};
use posegate::gate::Reason;
use posegate::report::FrameId;

/// The counts of a subscription.
#[derive(Clone, Debug)]
pub struct Received {
    /// The name of the topic.
    pub topic: String,
    /// The parameters that set its quality of service, with values, as text.
    pub parameters: &'static str,
    /// The quality of service of the subscription.
    pub delivery: Delivery,
    /// The publishers of the topic.
    pub peers: Peers,
    /// Messages that were decoded.
    pub messages: u64,
    /// Messages that could not be decoded.
    pub unreadable: u64,
    /// The stamp of the last message.
    pub last: Option<Time>,
}

impl Received {
    /// Returns the counts of a new subscription.
    #[must_use]
    pub const fn new(
        topic: String,
        parameters: &'static str,
        delivery: Delivery,
        peers: Peers,
    ) -> Self {
        Self {
            topic,
            parameters,
            delivery,
            peers,
            messages: 0,
            unreadable: 0,
            last: None,
        }
    }

    fn status(&self, name: &str, now: Now, wrong_frame: Option<String>) -> DiagnosticStatus {
        let problem = self.peers.problem(&self.topic, self.parameters);
        let unreadable = (self.unreadable > 0).then(|| {
            format!(
                "{} messages of {} could not be read: another message type, or damaged on the way",
                self.unreadable, self.topic
            )
        });
        let problem = problem.or(wrong_frame).or(unreadable);
        let age = self.last.map(|stamp| format!("{:.3}", now.age_s(stamp)));
        DiagnosticStatus {
            level: if problem.is_some() { ERROR } else { OK },
            name: format!("posegate: {name}"),
            message: problem.unwrap_or_else(|| "messages can arrive".into()),
            hardware_id: String::new(),
            values: vec![
                KeyValue::new("topic", &self.topic),
                KeyValue::new("requested", delivery_words(self.delivery)),
                KeyValue::new("publishers", self.peers.matched()),
                KeyValue::new("messages", self.messages),
                KeyValue::new("unreadable", self.unreadable),
                KeyValue::new("age_s", age.unwrap_or_default()),
            ],
        }
    }
}

/// Returns the diagnostics of the node: `frame` is that of the last pose, and `more` are those of the decider.
#[must_use]
pub fn diagnostics(
    answer: &Answer,
    settings: &NodeSettings,
    frame: Option<&str>,
    pose: &Received,
    others: [(&str, Option<&Received>); 2],
    clock_steps: u64,
    more: Vec<DiagnosticStatus>,
) -> DiagnosticArray {
    let mut status = vec![permission(answer, settings, clock_steps)];
    let wrong_frame = frame.and_then(|frame| {
        (FrameId::of(frame) != FrameId::of(&settings.frame)).then(|| {
            format!(
                "poses are in the frame `{frame}`, expected `{}`: set frame_id only if that is the world frame of the site",
                settings.frame
            )
        })
    });
    let input = match settings.detector {
        None => "pose",
        Some(_) => "detections",
    };
    status.push(pose.status(input, answer.now, wrong_frame));
    let others = others.into_iter();
    status.extend(
        others.filter_map(|(name, received)| Some(received?.status(name, answer.now, None))),
    );
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

fn permission(answer: &Answer, settings: &NodeSettings, clock_steps: u64) -> DiagnosticStatus {
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
            |reason| format!("{}: {}", reason.name(), words(reason)),
        ),
        hardware_id: settings.task().into(),
        values: vec![
            KeyValue::new("task", settings.task()),
            KeyValue::new("site", settings.site()),
            KeyValue::new("site_check", site_check),
            KeyValue::new("state", answer.state.name()),
            KeyValue::new("clock_steps", clock_steps),
        ],
    }
}

/// Returns the meaning of a reason and a recommended action.
#[must_use]
pub fn words(reason: Reason) -> String {
    format!("{} {}", reason.meaning(), reason.action())
}

/// Returns the answer of the service `explain`: the state of the gate, the reason of the last denial, and a
/// recommended action.
#[must_use]
pub fn explanation(answer: &Answer, last: Option<Reason>) -> String {
    let now = match answer.reason() {
        None => "permit".to_owned(),
        Some(reason) => format!("deny, {}: {}", reason.name(), words(reason)),
    };
    // While permits are counted, the last report has the reason why a permit does not count.
    match last {
        Some(reason) if Some(reason) != answer.reason() => {
            format!("{now} Last report: {}: {}", reason.name(), words(reason))
        }
        _ => now,
    }
}
