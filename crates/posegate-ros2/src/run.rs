//! The control loop of the node.
//!
//! One thread reads, decides and publishes the heartbeat. A loop that is blocked sends no heartbeat, and consumers deny.

use crate::clock::{ClockWatch, Now};
use crate::decider::Decider;
use crate::diagnostics::{diagnostics, words, wrong_frame};
use crate::entities::GraphError;
use crate::graph::{Environment, Graph, Input};
use crate::lifecycle::State;
use crate::message::TriggerResponse;
use crate::names::Names;
use crate::permission::Heartbeat;
use crate::permit_gate::{Answer, Origin};
use crate::poses::Poses;
use crate::received::Received;
use crate::services::Served;
use crate::settings::NodeSettings;
use posegate::gate::Reason;
use rustdds::StatusEvented;
use rustdds::mio1::Events;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The longest time between two `Bool`s of the permit.
const PERMIT_PERIOD: Duration = Duration::from_millis(100);
/// The longest time between two diagnostics, and two markers.
const SLOW_PERIOD: Duration = Duration::from_millis(1_000);
/// The shortest time between two heartbeats that report a pose; a change is published at once.
const SHORTEST: Duration = Duration::from_millis(2);
/// The most messages of a topic that are processed before the rest of the cycle.
const BATCH: usize = 64;

/// Like [`BATCH`], for detections: each takes some milliseconds.
const DETECTIONS: usize = 4;

/// A running node.
pub struct Runner<'a> {
    graph: Graph,
    environment: Environment,
    names: &'a Names,
    gate: Box<dyn Decider + 'a>,
    settings: &'a NodeSettings,
    heartbeat: Heartbeat,
    watch: ClockWatch,
    clock_steps: u64,
    poses: Poses,
    /// Why the last pose was not used.
    refused: Option<String>,
    /// The number of poses that transforms gave.
    composed: i64,
    /// Active, unless a manager decides on it.
    lifecycle: State,
    was_open: bool,
    has_report: bool,
    sent: Sent,
}

/// When each message was last published.
#[derive(Default)]
struct Sent {
    heartbeat: Option<Instant>,
    permit: Option<Instant>,
    slow: Option<Instant>,
}

impl<'a> Runner<'a> {
    /// Creates a node and joins a graph.
    ///
    /// # Errors
    /// [`GraphError`]
    pub fn join(
        environment: Environment,
        names: &'a Names,
        gate: Box<dyn Decider + 'a>,
        settings: &'a NodeSettings,
    ) -> Result<Self, GraphError> {
        let graph = Graph::join(environment, names, settings, gate.takes_tasks())?;
        Ok(Self {
            poses: Poses::new(&settings.poses, names.of_poses(settings.poses.kind)),
            refused: None,
            composed: 0,
            graph,
            environment,
            names,
            gate,
            settings,
            heartbeat: Heartbeat::start(),
            watch: ClockWatch::default(),
            clock_steps: 0,
            lifecycle: match settings.is_managed {
                true => State::Unconfigured,
                false => State::Active,
            },
            was_open: false,
            has_report: false,
            sent: Sent::default(),
        })
    }

    /// Joins again after the threads of DDS have ended. The gate keeps its state, but closes.
    fn rejoin(&mut self) -> Result<(), GraphError> {
        eprintln!(
            "posegate-node: the threads of DDS were interrupted and have ended: joining the graph again"
        );
        let _ = self.gate.inhibit(Now::read(), Reason::CycleLate);
        let takes_tasks = self.gate.takes_tasks();
        let mut graph = Graph::join(self.environment, self.names, self.settings, takes_tasks)?;
        for (received, earlier) in graph.received().zip(self.graph.received()) {
            std::mem::swap(received, earlier);
            std::mem::swap(&mut received.peers, &mut earlier.peers);
        }
        // A graph without threads cannot leave in order.
        std::mem::forget(std::mem::replace(&mut self.graph, graph));
        self.sent = Sent::default();
        Ok(())
    }

    /// Runs until `stop` is set, then publishes a denial.
    ///
    /// # Errors
    /// [`GraphError`]: the operating system cannot wait for messages, or the node cannot join again.
    pub fn run(&mut self, stop: &AtomicBool) -> Result<(), GraphError> {
        let mut events = Events::with_capacity(16);
        let cycle = Duration::from_millis(u64::from(self.settings.cycle_ms));
        while !(stop.load(Ordering::Relaxed) || self.lifecycle == State::Finalized) {
            // A report that came directly after a heartbeat waits no longer than necessary.
            let timeout = if self.has_report { SHORTEST } else { cycle };
            let timeout = timeout.min(self.gate.patience());
            match self.graph.poll().poll(&mut events, Some(timeout)) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => other?,
            }
            if !self.graph.is_alive() {
                self.rejoin()?;
            }
            self.cycle();
        }
        let answer = self.gate.inhibit(Now::read(), Reason::Silent);
        self.publish(&answer, Instant::now(), true);
        // Time for the denial to leave.
        std::thread::sleep(Duration::from_millis(50));
        Ok(())
    }

    /// One control cycle.
    fn cycle(&mut self) {
        if self.watch.check() {
            self.clock_steps += 1;
            let _ = self.gate.inhibit(Now::read(), Reason::TimeBackwards);
        }
        while let Some(event) = self.graph.events.try_recv_status() {
            for received in self.graph.received() {
                received.peers.note(&event);
            }
        }
        self.take_task();
        self.take_odometry();
        self.take_camera_info();
        self.take_reports();
        let answer = self.now();
        self.publish(&answer, Instant::now(), false);
        self.serve();
    }

    /// Returns the answer at this moment. A node that is not active denies.
    fn now(&mut self) -> Answer {
        match self.lifecycle {
            State::Active => self.gate.tick(Now::read()),
            _ => self.gate.inhibit(Now::read(), Reason::Silent),
        }
    }

    /// Takes the last name that was asked for. The denial is published before any report is evaluated for the other
    /// task.
    fn take_task(&mut self) {
        let mut last = None;
        if let Some(topic) = &mut self.graph.task {
            topic.drain(BATCH, |_, taken| {
                last = taken.map(|(name, _)| name).or(last.take());
            });
        }
        let Some(name) = last else {
            return;
        };
        self.gate.ask(Now::read(), &name);
        let answer = self.now();
        self.publish(&answer, Instant::now(), true);
    }

    fn take_odometry(&mut self) {
        let Some(topic) = &mut self.graph.odom else {
            return;
        };
        topic.drain(BATCH, |received, taken| {
            let _ = match taken {
                Some((message, origin)) => {
                    received.note(Now::read(), message.header.stamp);
                    self.gate.odometry(Now::read(), &message, origin)
                }
                None => self.gate.odometry_lost(Now::read()),
            };
        });
    }

    fn take_camera_info(&mut self) {
        let Some(topic) = &mut self.graph.camera_info else {
            return;
        };
        topic.drain(BATCH, |received, taken| {
            let message = taken.map(|(message, _)| message);
            if let Some(message) = &message {
                received.note(Now::read(), message.header.stamp);
            }
            self.gate.camera_info(message.as_ref());
        });
    }

    /// Takes poses or detections. After one that could not be read the next has a gap before it, and is denied. A node that is not active
    /// drops them.
    fn take_reports(&mut self) {
        let is_active = self.lifecycle == State::Active;
        let most = match self.settings.detector {
            Some(_) if is_active => DETECTIONS,
            _ => BATCH,
        };
        self.graph.input.drain(most, |received, taken| {
            let Some((message, mut origin)) = taken else {
                return;
            };
            if !is_active {
                received.messages += 1;
                return;
            }
            let report = match message {
                Input::Pose(header, child, pose, covariance) => {
                    self.poses.pose(header, child, &pose, covariance)
                }
                Input::Transforms(message) => {
                    let Some(report) = self.poses.transforms(&message, origin.publisher) else {
                        return;
                    };
                    // Several publishers share the topic, so their counts do not number the poses.
                    self.composed += 1;
                    origin = Origin {
                        publisher: [0; 16],
                        number: self.composed,
                    };
                    report
                }
                Input::Detections(message) => {
                    self.has_report = true;
                    received.note(Now::read(), message.header.stamp);
                    let _ = self.gate.detections(Now::read(), &message, origin);
                    return;
                }
            };
            self.has_report = true;
            let now = Now::read();
            received.note(now, report.stamp);
            self.refused = report.pose.as_ref().err().map(ToString::to_string);
            let _ = self.gate.pose(now, &report, origin);
        });
    }

    /// Returns the action that the node knows and the gate does not: the fault of the topic, of the last pose, of stamps,
    /// the hold that would open, or the movement that a set includes.
    fn hint(&self, answer: &Answer) -> Option<String> {
        let (pose, settings) = (&self.graph.input.received, self.settings);
        let reason = answer.reason()?;
        if self.lifecycle != State::Active {
            let state = self.lifecycle.labelled().label;
            return Some(format!(
                "the node is {state}: it decides when its manager of lifecycles has made it active"
            ));
        }
        if let Some(problem) = self.gate.problem() {
            return Some(problem);
        }
        match reason {
            Reason::Silent | Reason::Qualifying | Reason::Holding | Reason::SourceChanged => pose
                .problem()
                .or_else(|| self.refused.clone())
                .or_else(|| pose.stamps(settings))
                .or_else(|| pose.hold(settings)),
            Reason::Stale | Reason::TimeBackwards => pose.stamps(settings),
            Reason::CovarianceZero | Reason::CovarianceUnknown => self.refused.clone(),
            Reason::FrameMismatch => self.unused(),
            Reason::PoseSetTooLarge => settings
                .movement()
                .map(|movement| format!("{} {movement}", words(reason, None))),
            _ => None,
        }
    }

    /// Returns why the last pose was not used.
    fn unused(&self) -> Option<String> {
        let wrong_frame = || wrong_frame(self.gate.frame()?, self.settings);
        self.refused.clone().or_else(wrong_frame)
    }

    /// Publishes the messages that are due. Failed publications are not repeated: silence denies.
    fn publish(&mut self, answer: &Answer, now: Instant, is_last: bool) {
        let has_changed = answer.is_open != self.was_open || is_last;
        self.was_open = answer.is_open;
        let is_due = |last: Option<Instant>, period: Duration| {
            let passed = last.map(|last| now.saturating_duration_since(last));
            has_changed || passed.is_none_or(|passed| passed >= period)
        };
        let ms = |ms: u32| Duration::from_millis(u64::from(ms));
        let (settings, cycle_ms) = (self.settings, self.settings.cycle_ms);
        // A cycle early rather than late.
        let period = ms(settings.heartbeat_ms - cycle_ms + 1);
        let period = match self.has_report {
            true => period.min(SHORTEST),
            false => period,
        };
        if is_due(self.sent.heartbeat, period) {
            self.has_report = false;
            self.sent.heartbeat = Some(now);
            let (report, task) = (self.gate.report(), self.gate.chosen(settings));
            let message = self.heartbeat.next(answer, settings, task, report);
            let _ = self.graph.permission.publish(message);
        }
        if is_due(self.sent.permit, PERMIT_PERIOD - ms(cycle_ms.min(99))) {
            self.sent.permit = Some(now);
            let _ = self.graph.permit.publish(answer.is_open);
        }
        if is_due(self.sent.slow, SLOW_PERIOD) {
            self.sent.slow = Some(now);
            let received = |name, received: &Received| received.status(name, answer.now, None);
            let odometry = self.graph.odom.as_ref();
            let odometry = odometry.map(|topic| received("odometry", &topic.received));
            let camera_info = self.graph.camera_info.as_ref();
            let camera_info = camera_info.map(|topic| received("camera info", &topic.received));
            let others = odometry.into_iter().chain(camera_info);
            let more = others.chain(self.gate.diagnostics(answer.now)).collect();
            let message = diagnostics(
                answer,
                settings,
                self.gate.chosen(settings),
                self.hint(answer).as_deref(),
                (&self.graph.input.received, self.unused()),
                self.clock_steps,
                more,
            );
            let _ = self.graph.diagnostics.publish(message);
            if let Some(markers) = self.gate.markers(answer).filter(|_| settings.markers) {
                let _ = self.graph.markers.publish(markers);
            }
        }
    }

    fn serve(&mut self) {
        let mut served = Served {
            parameters: &self.settings.parameters,
            state: self.lifecycle,
        };
        for service in &self.graph.services {
            service(&mut served);
        }
        if served.state != self.lifecycle {
            self.lifecycle = served.state;
            let answer = self.now();
            self.publish(&answer, Instant::now(), false);
        }
        while let Ok(Some((id, _))) = self.graph.explain.receive_request() {
            let answer = self.now();
            let response = TriggerResponse {
                success: true,
                message: self.gate.explain(&answer, self.hint(&answer).as_deref()),
            };
            let _ = self.graph.explain.send_response(id, response);
        }
        while let Ok(Some((id, _))) = self.graph.reset.receive_request() {
            let now = Now::read();
            let reset = self.gate.reset(now);
            let answer = self.now();
            self.publish(&answer, Instant::now(), false);
            let success = reset.is_ok();
            let (Ok(message) | Err(message)) = reset;
            let response = TriggerResponse { success, message };
            let _ = self.graph.reset.send_response(id, response);
        }
    }
}
