//! The publishers of the node's subscriptions, from discovery: matched publishers, and publishers that do not match.

use crate::settings::Delivery;
use rustdds::policy::{Durability, Reliability};
use rustdds::{DomainParticipantStatusEvent as Event, GUID, QosPolicies};
use std::collections::{BTreeMap, BTreeSet};

/// The publishers of one topic, as discovery reports them.
#[derive(Clone, Debug, Default)]
pub struct Peers {
    /// The DDS name of the topic and its type.
    topic: String,
    type_name: String,
    reader: Option<GUID>,
    /// `true` for a topic that several publishers share.
    pub is_shared: bool,
    matched: BTreeSet<GUID>,
    /// Publishers of the topic with another type.
    other_types: BTreeMap<GUID, String>,
    /// Publishers whose quality of service does not match, with the difference.
    incompatible: BTreeMap<GUID, String>,
}

impl Peers {
    /// Observes a topic by its name, such as `/amcl_pose`, and its type, such as `nav_msgs` and `Odometry`.
    #[must_use]
    pub fn new(topic: &str, [package, name]: [&str; 2], reader: GUID) -> Self {
        Self {
            topic: format!("rt{topic}"),
            type_name: format!("{package}::msg::dds_::{name}_"),
            reader: Some(reader),
            ..Self::default()
        }
    }

    /// Processes an event of discovery.
    pub fn note(&mut self, event: &Event) {
        match event {
            Event::RemoteWriterMatched {
                local_reader,
                remote_writer,
            } if Some(*local_reader) == self.reader => {
                self.incompatible.remove(remote_writer);
                self.matched.insert(*remote_writer);
            }
            Event::RemoteWriterQosIncompatible {
                local_reader,
                remote_writer,
                requested_qos,
                offered_qos,
            } if Some(*local_reader) == self.reader => {
                let words = mismatch(requested_qos, offered_qos);
                self.incompatible.insert(*remote_writer, words);
            }
            Event::WriterDetected { writer }
                if writer.topic_name == self.topic && writer.type_name != self.type_name =>
            {
                self.other_types
                    .insert(writer.guid, writer.type_name.clone());
            }
            Event::WriterLost { guid, .. } => self.forget(|writer| writer == guid),
            Event::ParticipantLost { id, .. } => self.forget(|writer| writer.prefix == *id),
            _ => {}
        }
    }

    fn forget(&mut self, is_lost: impl Fn(&GUID) -> bool) {
        self.matched.retain(|writer| !is_lost(writer));
        self.other_types.retain(|writer, _| !is_lost(writer));
        self.incompatible.retain(|writer, _| !is_lost(writer));
    }

    /// Returns the number of publishers from which messages are received.
    #[must_use]
    pub fn matched(&self) -> usize {
        self.matched.len()
    }

    /// Returns the problem of the publishers as text; `None` if there is exactly one, and it matches.
    #[must_use]
    pub fn problem(&self, topic: &str, parameters: &str) -> Option<String> {
        let incompatible = self.incompatible.values().next();
        if let Some(words) = incompatible {
            return Some(format!(
                "a publisher of {topic} does not match this subscription, so nothing of it arrives: {words}; set {parameters}, or change the publisher"
            ));
        }
        if let Some(found) = self.other_types.values().next() {
            return Some(format!(
                "a publisher of {topic} sends {found}, expected {}; remap the topic",
                self.type_name
            ));
        }
        match self.matched.len() {
            0 => Some(format!(
                "nobody publishes {topic}: start its publisher, or remap the topic (-r); check ROS_DOMAIN_ID"
            )),
            1 => None,
            _ if self.is_shared => None,
            many => Some(format!(
                "{many} publishers of {topic}: the gate opens for one alone; stop the others, or remap the topic"
            )),
        }
    }
}

/// Returns the difference between the offered and the requested quality of service.
fn mismatch(requested: &QosPolicies, offered: &QosPolicies) -> String {
    let mut words = Vec::new();
    let is_reliable =
        |qos: &QosPolicies| matches!(qos.reliability(), Some(Reliability::Reliable { .. }));
    if is_reliable(requested) && !is_reliable(offered) {
        words.push("it offers best effort, and reliable is requested");
    }
    let is_latched =
        |qos: &QosPolicies| !matches!(qos.durability(), Some(Durability::Volatile) | None);
    if is_latched(requested) && !is_latched(offered) {
        words.push("it offers volatile, and transient local is requested");
    }
    if words.is_empty() {
        words.push("another policy differs (deadline, liveliness or ownership)");
    }
    words.join(", and ")
}

/// Returns a description of a delivery.
#[must_use]
pub const fn delivery_words(delivery: Delivery) -> &'static str {
    match (delivery.reliable, delivery.transient_local) {
        (true, true) => "reliable, transient local",
        (true, false) => "reliable, volatile",
        (false, _) => "best effort, volatile",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustdds::QosPolicyBuilder;

    fn event(remote_writer: GUID, local_reader: GUID) -> Event {
        Event::RemoteWriterMatched {
            local_reader,
            remote_writer,
        }
    }

    fn guid(number: u8) -> GUID {
        let mut bytes = [0; 16];
        bytes[3] = number;
        GUID::from_bytes(bytes)
    }

    #[test]
    fn publishers_are_counted_and_their_faults_reported() {
        let mut peers = Peers::new(
            "/pose",
            ["geometry_msgs", "PoseWithCovarianceStamped"],
            guid(1),
        );
        let problem = |peers: &Peers| {
            peers
                .problem("/pose", "pose_reliability to best_effort")
                .unwrap_or_default()
        };
        assert!(problem(&peers).contains("nobody publishes /pose"));
        peers.note(&event(guid(9), guid(2)));
        assert_eq!(peers.matched(), 0);
        peers.note(&event(guid(9), guid(1)));
        assert_eq!((peers.matched(), problem(&peers).as_str()), (1, ""));
        peers.note(&event(guid(8), guid(1)));
        assert!(problem(&peers).contains("2 publishers"));
        let best_effort = QosPolicyBuilder::new()
            .reliability(Reliability::BestEffort)
            .build();
        let reliable = Reliability::Reliable {
            max_blocking_time: rustdds::Duration::ZERO,
        };
        peers.note(&Event::RemoteWriterQosIncompatible {
            local_reader: guid(1),
            remote_writer: guid(7),
            requested_qos: Box::new(QosPolicyBuilder::new().reliability(reliable).build()),
            offered_qos: Box::new(best_effort),
        });
        assert!(
            problem(&peers)
                .contains("it offers best effort, and reliable is requested; set pose_reliability")
        );
        peers.note(&Event::ParticipantLost {
            id: guid(7).prefix,
            reason: rustdds::LostReason::Disposed,
        });
        assert_eq!(
            peers.matched() as u8,
            2 * u8::from(guid(7).prefix != guid(8).prefix)
        );
    }
}
