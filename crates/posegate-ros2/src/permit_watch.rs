//! The rules that a consumer of the permit follows, without DDS.
//!
//! [`PermitWatch`] permits only while heartbeats of the expected robot, table and task come, and of a single run of
//! the node. `integrations/ros2/permit_listener.py` and `integrations/behaviortree` have the same rules.

use crate::clock::Now;
use crate::message::{DiagnosticArray, OK};
use crate::permission::{FORMAT, NAME, PERMIT};
use std::collections::VecDeque;

/// The longest time for which a heartbeat is valid, whatever it states, milliseconds. After a change of the run,
/// heartbeats of the new run alone must come for this time before one permits.
pub const MOST_VALID_MS: i128 = 1_000;
/// The same after an earlier run has come back, milliseconds: a node that was started again has a new run, so two nodes
/// are alive, and one of them may be slow.
pub const TWO_NODES_MS: i128 = 10_000;
/// The earlier runs that are kept.
const MOST_RUNS: usize = 8;
/// A heartbeat from farther in the future shows that the clocks of the machines differ, milliseconds.
pub const MOST_AHEAD_MS: i128 = 20;

const MS: i128 = 1_000_000;

/// Follows heartbeats. The permit ends by itself `valid_ms` after the stamp of the last heartbeat that permits.
#[derive(Clone, Debug)]
pub struct PermitWatch {
    task: String,
    robot: String,
    table: String,
    run: Option<(String, u64)>,
    /// Runs before this one, the last one last.
    earlier: VecDeque<String>,
    /// Until this moment of the monotonic clock two runs may be alive.
    alone_ns: Option<i128>,
    ends_ns: Option<i128>,
    reason: String,
}

impl PermitWatch {
    /// Returns a watch that denies. A permit must name the task, the robot, such as `/robot1/posegate`, and the table:
    /// the `table_digest` that `posegate table info` prints. An empty robot or table is never permitted.
    #[must_use]
    pub fn new(task: &str, robot: &str, table: &str) -> Self {
        Self {
            task: task.into(),
            robot: robot.into(),
            table: table.into(),
            run: None,
            earlier: VecDeque::new(),
            alone_ns: None,
            ends_ns: None,
            reason: "silent".into(),
        }
    }

    /// Takes a heartbeat at a moment of the system's clock and of a monotonic clock, nanoseconds.
    pub fn heartbeat(&mut self, message: &DiagnosticArray, now: Now, monotonic_ns: i128) {
        match self.valid_ns(message, now, monotonic_ns) {
            Ok(left_ns) => {
                self.ends_ns = Some(monotonic_ns + left_ns);
                self.reason.clear();
            }
            Err(reason) => {
                self.ends_ns = None;
                self.reason = reason;
            }
        }
    }

    /// Returns `true` if the task may run at this moment of the monotonic clock.
    pub fn permitted(&mut self, monotonic_ns: i128) -> bool {
        if self.ends_ns.is_some_and(|ends_ns| monotonic_ns >= ends_ns) {
            self.ends_ns = None;
            self.reason = "no heartbeat: the node has stopped, or messages do not arrive".into();
        }
        self.ends_ns.is_some()
    }

    /// Returns why the task may not run: a reason in snake case, or a sentence. Empty with a permit.
    #[must_use]
    pub fn reason(&self) -> &str {
        &self.reason
    }

    /// Returns for how long a heartbeat permits, or why it does not.
    fn valid_ns(
        &mut self,
        message: &DiagnosticArray,
        now: Now,
        monotonic_ns: i128,
    ) -> Result<i128, String> {
        let [status] = message.status.as_slice() else {
            return Err("not a heartbeat of posegate-node".into());
        };
        let is_twice = |key: &str| status.values.iter().filter(|pair| pair.key == key).count() > 1;
        if status.values.iter().any(|pair| is_twice(&pair.key)) {
            return Err("a value is given twice".into());
        }
        let value = |key| status.value(key).unwrap_or_default();
        if status.name != NAME || value("format") != FORMAT {
            return Err("not a heartbeat of posegate-node, or of another version".into());
        }
        let (Some(run), Ok(sequence)) = (status.value("run"), value("sequence").parse()) else {
            return Err("a heartbeat without its number".into());
        };
        match self.run.replace((run.to_owned(), sequence)) {
            // A late message of the same run says nothing about now.
            Some((same, last)) if same == run && sequence <= last => {
                self.run = Some((same, last));
                return Err("heartbeats out of order".into());
            }
            Some((other, _)) if other != run => {
                let has_come_back = self.earlier.iter().any(|earlier| earlier == run);
                let alone_ms = if has_come_back {
                    TWO_NODES_MS
                } else {
                    MOST_VALID_MS
                };
                let until_ns = monotonic_ns + alone_ms * MS;
                self.alone_ns = self.alone_ns.max(Some(until_ns));
                if self.earlier.len() == MOST_RUNS {
                    self.earlier.pop_front();
                }
                self.earlier.push_back(other);
            }
            _ => {}
        }
        if self.robot.is_empty() || value("robot") != self.robot {
            let (found, expected) = (value("robot"), &self.robot);
            return Err(format!(
                "a heartbeat of the robot `{found}`, expected `{expected}`"
            ));
        }
        if self
            .alone_ns
            .is_some_and(|alone_ns| monotonic_ns < alone_ns)
        {
            return Err("two nodes send heartbeats, or the node was just started again: another run came a moment ago".into());
        }
        if status.level != OK || status.message != PERMIT || value("state") != "permitted" {
            let reason = value("reason");
            return Err(if reason.is_empty() { "denied" } else { reason }.into());
        }
        if status.value("reason") != Some("") {
            return Err("a heartbeat that contradicts itself".into());
        }
        if status.value("task") != Some(&self.task) {
            let (found, expected) = (value("task"), &self.task);
            return Err(format!(
                "a permit for the task `{found}`, expected `{expected}`"
            ));
        }
        if self.table.is_empty() || value("table") != self.table {
            let (found, expected) = (value("table"), &self.table);
            return Err(format!(
                "a permit by the table `{found}`, expected `{expected}`"
            ));
        }
        let valid_ms = value("valid_ms").parse::<i128>().unwrap_or_default();
        if !(1..=MOST_VALID_MS).contains(&valid_ms) {
            return Err("a heartbeat without its time, or of too long a time".into());
        }
        let age_ns = now.age_ns(message.header.stamp);
        if age_ns < -MOST_AHEAD_MS * MS {
            return Err("a heartbeat from the future: the clocks of the machines differ".into());
        }
        if age_ns >= valid_ms * MS {
            return Err(
                "an old heartbeat: delayed on the way, or the clocks of the machines differ".into(),
            );
        }
        Ok(valid_ms * MS - age_ns.max(0))
    }
}

#[cfg(test)]
mod tests;
