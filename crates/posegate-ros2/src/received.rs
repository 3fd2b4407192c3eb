//! What arrives at a subscription: counts, publishers, the period of the messages, and the age of their stamps.

use crate::clock::Now;
use crate::message::{DiagnosticStatus, ERROR, KeyValue, OK, Time};
use crate::peers::{Peers, delivery_words};
use crate::settings::{Delivery, NodeSettings};
use std::collections::VecDeque;

/// The intervals between messages that are kept.
const INTERVALS: usize = 32;
/// Stamps before this time, 1973, look like simulated time, which begins at 0; seconds.
const SIMULATED_S: i32 = 100_000_000;

/// The counts of a subscription.
#[derive(Clone, Debug, Default)]
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
    /// The arrival of the last message, and its stamp.
    last: Option<(Now, Time)>,
    /// Between the last messages, nanoseconds.
    intervals: VecDeque<i128>,
}

impl Received {
    /// Returns the counts of a new subscription.
    #[must_use]
    pub fn new(topic: String, parameters: &'static str, delivery: Delivery, peers: Peers) -> Self {
        Self {
            topic,
            parameters,
            delivery,
            peers,
            ..Self::default()
        }
    }

    /// Adds a message that was decoded.
    pub fn note(&mut self, now: Now, stamp: Time) {
        self.messages += 1;
        if let Some((last, _)) = self.last.replace((now, stamp)) {
            if self.intervals.len() == INTERVALS {
                self.intervals.pop_front();
            }
            self.intervals.push_back(now.age_ns(last.time()));
        }
    }

    /// Returns the middle of the last intervals between messages, and the difference of the longest and the shortest one,
    /// milliseconds.
    #[must_use]
    pub fn pace_ms(&self) -> Option<[f64; 2]> {
        let mut sorted: Vec<i128> = self.intervals.iter().copied().collect();
        sorted.sort_unstable();
        let (first, last) = (sorted.first()?, sorted.last()?);
        let middle = sorted.get(sorted.len() / 2)?;
        Some([*middle, last - first].map(|ns| ns as f64 * 1e-6))
    }

    /// Returns why messages do not arrive; `None` if there is no problem.
    #[must_use]
    pub fn problem(&self) -> Option<String> {
        if let Some(problem) = self.peers.problem(&self.topic, self.parameters) {
            return Some(problem);
        }
        let topic = &self.topic;
        if self.unreadable > 0 {
            return Some(format!(
                "{} messages of {topic} could not be read: another message type, or damaged on the way",
                self.unreadable
            ));
        }
        // Of transforms only those that give the robot's pose are counted.
        (self.messages == 0 && !self.peers.is_shared)
            .then(|| format!("{topic} has a publisher, and no message of it has arrived"))
    }

    /// Returns the fault of the last stamp.
    #[must_use]
    pub fn stamps(&self, settings: &NodeSettings) -> Option<String> {
        let (arrival, stamp) = self.last?;
        let topic = &self.topic;
        let age_s = arrival.age_s(stamp);
        let most_ms = settings.oldest_ms();
        if stamp == Time::default() {
            return Some(format!(
                "stamps of {topic} are zero: its publisher must fill them"
            ));
        }
        if stamp.sec < SIMULATED_S {
            return Some(format!(
                "stamps of {topic} are {age_s:.3} s old and look like simulated time, which begins at 0: this node uses the system's clock; set use_sim_time to false at the publisher, and play recordings with `posegate replay`"
            ));
        }
        if age_s * 1e3 > f64::from(most_ms) {
            return Some(format!(
                "stamps of {topic} are {age_s:.3} s old when they arrive, and a report is used until it is {:.3} s old: make its publisher faster, compare the clocks, or raise maximum_age_ms",
                f64::from(most_ms) * 1e-3
            ));
        }
        (age_s < -1e-3).then(|| {
            format!(
                "stamps of {topic} are {:.3} s in the future: the clocks of the machines differ",
                -age_s
            )
        })
    }

    /// Returns which hold would open the gate, if messages come too rarely for the one that is set.
    #[must_use]
    pub fn hold(&self, settings: &NodeSettings) -> Option<String> {
        let gate = settings.gate();
        let required = usize::from(gate.permits_in_a_row);
        // Permits in a row have one interval less between them; a single permit is still held until the next.
        let run = required.saturating_sub(1).clamp(1, INTERVALS);
        let intervals: Vec<i128> = self.intervals.iter().copied().collect();
        let longest = |run: &[i128]| run.iter().max().copied().unwrap_or_default();
        let quickest_ns = intervals.windows(run).map(longest).min()?;
        let least = u32::try_from(quickest_ns.div_euclid(1_000_000) + 1).ok()?;
        let hold = gate.permit_hold_ms;
        (settings.tracker.is_none() && hold < least).then(|| {
            let oldest = least + settings.response_ms() + 100;
            let age = if settings.oldest_ms() < least + 100 {
                format!(", and maximum_age_ms of {oldest} or more")
            } else {
                String::new()
            };
            format!(
                "{required} permits in a row of {} come {:.0} ms apart at the quickest, and a permit is held for {hold} ms: with permit_hold_ms of {least} or more{age}, the gate would open; or carry each pose along odometry (use_odometry)",
                self.topic,
                quickest_ns as f64 * 1e-6
            )
        })
    }

    /// Returns the state for the diagnostics. `more` is a problem of the content of the messages.
    #[must_use]
    pub fn status(&self, name: &str, now: Now, more: Option<String>) -> DiagnosticStatus {
        let problem = self.problem().or(more);
        let age = self
            .last
            .map(|(_, stamp)| format!("{:.3}", now.age_s(stamp)));
        let [period, jitter] = match self.pace_ms() {
            Some(pace) => pace.map(|ms| format!("{ms:.1}")),
            None => Default::default(),
        };
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
                KeyValue::new("period_ms", period),
                KeyValue::new("jitter_ms", jitter),
            ],
        }
    }
}

#[cfg(test)]
mod tests;
