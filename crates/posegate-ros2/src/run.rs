//! The control loop of the node.
//!
//! One thread reads, decides and publishes the heartbeat. A loop that is blocked sends no heartbeat, and consumers deny.

use crate::clock::{ClockWatch, Now};
use crate::decider::Decider;
use crate::diagnostics::{diagnostics, words, wrong_frame};
use crate::graph::{Environment, Graph, GraphError, Input};
use crate::lifecycle::State;
use crate::message::{Bool, TriggerResponse};
use crate::names::Names;
use crate::permission::Heartbeat;
use crate::permit_gate::{Answer, Origin};
use crate::poses::{PoseReport, Poses};
use crate::received::Received;
use crate::settings::NodeSettings;
use posegate::gate::Reason;
use ros2_client::{MessageInfo, Subscription};
use rustdds::StatusEvented;
use rustdds::mio1::Events;
use serde::de::DeserializeOwned;
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
pub struct Runner<'a, D> {
    graph: Graph,
    environment: Environment,
    names: &'a Names,
    gate: D,
    settings: &'a NodeSettings,
    heartbeat: Heartbeat,
    watch: ClockWatch,
    clock_steps: u64,
    pose: Received,
    poses: Poses,
    /// Why the last pose was not used.
    refused: Option<String>,
    /// The number of poses that transforms gave.
    composed: i64,
    camera_info: Option<Received>,
    odometry: Option<Received>,
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

/// Processes the messages of a topic that have arrived, at most `most`, and counts those that cannot be decoded. `take`
/// gets `None` for such a message.
fn drain<M: DeserializeOwned + 'static>(
    topic: &Subscription<M>,
    most: usize,
    received: &mut Received,
    mut take: impl FnMut(&mut Received, Option<(M, MessageInfo)>),
) {
    for _ in 0..most {
        let taken = match topic.take() {
            Ok(None) => return,
            Ok(taken) => taken,
            Err(_) => None,
        };
        received.unreadable += u64::from(taken.is_none());
        take(received, taken);
    }
}

fn is_due(last: Option<Instant>, now: Instant, period: Duration) -> bool {
    last.is_none_or(|last| now.saturating_duration_since(last) >= period)
}

impl<'a, D: Decider> Runner<'a, D> {
    /// Creates a node and joins a graph.
    ///
    /// # Errors
    /// [`GraphError`]
    pub fn join(
        environment: Environment,
        names: &'a Names,
        gate: D,
        settings: &'a NodeSettings,
    ) -> Result<Self, GraphError> {
        let graph = Graph::join(environment, names, settings, gate.takes_tasks())?;
        Ok(Self {
            pose: graph.received_poses(names, settings),
            poses: Poses::new(&settings.poses, names.of_poses(settings.poses.kind)),
            refused: None,
            composed: 0,
            camera_info: graph.received_camera_info(names, settings),
            odometry: graph.received_odometry(names, settings),
            graph,
            environment,
            names,
            gate,
            settings,
            heartbeat: Heartbeat::new(),
            watch: ClockWatch::new(),
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
        let graph = Graph::join(
            self.environment,
            self.names,
            self.settings,
            self.gate.takes_tasks(),
        )?;
        self.pose.peers = graph.received_poses(self.names, self.settings).peers;
        let (names, settings) = (self.names, self.settings);
        for (received, again) in [
            (&mut self.odometry, graph.received_odometry(names, settings)),
            (
                &mut self.camera_info,
                graph.received_camera_info(names, settings),
            ),
        ] {
            if let (Some(received), Some(again)) = (received, again) {
                received.peers = again.peers;
            }
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
            let timeout = self
                .gate
                .patience()
                .map_or(timeout, |patience| timeout.min(patience));
            match self.graph.poll.poll(&mut events, Some(timeout)) {
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
            self.pose.peers.note(&event);
            for received in [&mut self.odometry, &mut self.camera_info]
                .into_iter()
                .flatten()
            {
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
        if let Some(topic) = &self.graph.task {
            while let Ok(Some((message, _))) = topic.take() {
                last = Some(message.data);
            }
        }
        let Some(name) = last else {
            return;
        };
        self.gate.ask(Now::read(), &name);
        let answer = self.now();
        self.publish(&answer, Instant::now(), true);
    }

    fn take_odometry(&mut self) {
        if let (Some(topic), Some(received)) = (&self.graph.odom, &mut self.odometry) {
            drain(topic, BATCH, received, |received, taken| {
                let _ = match taken {
                    Some((message, info)) => {
                        received.note(Now::read(), message.header.stamp);
                        self.gate.odometry(Now::read(), &message, origin(&info))
                    }
                    None => self.gate.odometry_lost(Now::read()),
                };
            });
        }
    }

    fn take_camera_info(&mut self) {
        if let (Input::Detections(_, topic), Some(received)) =
            (&self.graph.input, &mut self.camera_info)
        {
            drain(topic, BATCH, received, |received, taken| {
                if let Some((message, _)) = &taken {
                    received.note(Now::read(), message.header.stamp);
                }
                self.gate
                    .camera_info(taken.as_ref().map(|(message, _)| message));
            });
        }
    }

    /// Takes poses or detections. After one that could not be read the next has a gap before it, and is denied. A node that is not active
    /// drops them.
    fn take_reports(&mut self) {
        if self.lifecycle != State::Active {
            return self.drop_reports();
        }
        let (received, poses) = (&mut self.pose, &mut self.poses);
        let (gate, has_report) = (&mut self.gate, &mut self.has_report);
        let (refused, composed) = (&mut self.refused, &mut self.composed);
        let mut take = |received: &mut Received, report: &PoseReport, origin: Origin| {
            *has_report = true;
            let now = Now::read();
            received.note(now, report.stamp);
            *refused = report.pose.as_ref().err().map(ToString::to_string);
            let _ = gate.pose(now, report, origin);
        };
        match &self.graph.input {
            Input::Poses(topic) => drain(topic, BATCH, received, |received, taken| {
                if let Some((message, info)) = taken {
                    take(received, &poses.with_covariance(&message), origin(&info));
                }
            }),
            Input::Odometry(topic) => drain(topic, BATCH, received, |received, taken| {
                if let Some((message, info)) = taken {
                    take(received, &poses.odometry(&message), origin(&info));
                }
            }),
            Input::Plain(topic) => drain(topic, BATCH, received, |received, taken| {
                if let Some((message, info)) = taken {
                    take(received, &poses.pose(&message), origin(&info));
                }
            }),
            Input::Transforms(topic) => drain(topic, BATCH, received, |received, taken| {
                let Some((message, info)) = taken else {
                    return;
                };
                let publisher = info.publisher_gid().to_bytes16();
                if let Some(report) = poses.transforms(&message, publisher) {
                    // Several publishers share the topic, so their counts do not number the poses.
                    *composed += 1;
                    let origin = Origin {
                        publisher: [0; 16],
                        number: *composed,
                    };
                    take(received, &report, origin);
                }
            }),
            Input::Detections(topic, _) => drain(topic, DETECTIONS, received, |received, taken| {
                if let Some((message, info)) = taken {
                    *has_report = true;
                    received.note(Now::read(), message.header.stamp);
                    let _ = gate.detections(Now::read(), &message, origin(&info));
                }
            }),
        }
    }

    fn drop_reports(&mut self) {
        fn count<M>(received: &mut Received, taken: Option<M>) {
            received.messages += u64::from(taken.is_some());
        }
        let received = &mut self.pose;
        match &self.graph.input {
            Input::Poses(topic) => drain(topic, BATCH, received, count),
            Input::Odometry(topic) => drain(topic, BATCH, received, count),
            Input::Plain(topic) => drain(topic, BATCH, received, count),
            Input::Transforms(topic) => drain(topic, BATCH, received, count),
            Input::Detections(topic, _) => drain(topic, BATCH, received, count),
        }
    }

    /// Returns the action that the node knows and the gate does not: the fault of the topic, of the last pose, of stamps,
    /// the hold that would open, or the movement that a set includes.
    fn hint(&self, answer: &Answer) -> Option<String> {
        let (pose, settings) = (&self.pose, self.settings);
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
            Reason::FrameMismatch => self.refused.clone().or_else(|| {
                self.gate
                    .frame()
                    .and_then(|frame| wrong_frame(frame, settings))
            }),
            Reason::PoseSetTooLarge => settings
                .movement()
                .map(|movement| format!("{} {movement}", words(reason, None))),
            _ => None,
        }
    }

    /// Publishes the messages that are due. Failed publications are not repeated: silence denies.
    fn publish(&mut self, answer: &Answer, now: Instant, is_last: bool) {
        let has_changed = answer.is_open != self.was_open || is_last;
        self.was_open = answer.is_open;
        let ms = |ms: u32| Duration::from_millis(u64::from(ms));
        let reports = self.has_report && is_due(self.sent.heartbeat, now, SHORTEST);
        // A cycle early rather than late.
        let period = ms(self.settings.heartbeat_ms - self.settings.cycle_ms + 1);
        if has_changed || reports || is_due(self.sent.heartbeat, now, period) {
            self.has_report = false;
            self.sent.heartbeat = Some(now);
            let report = self.gate.report();
            let message = self.heartbeat.next(
                answer,
                self.settings,
                self.gate.chosen(self.settings),
                report,
            );
            let _ = self.graph.permission.publish(message);
        }
        if has_changed
            || is_due(
                self.sent.permit,
                now,
                PERMIT_PERIOD - ms(self.settings.cycle_ms.min(99)),
            )
        {
            self.sent.permit = Some(now);
            let _ = self.graph.permit.publish(Bool {
                data: answer.is_open,
            });
        }
        if has_changed || is_due(self.sent.slow, now, SLOW_PERIOD) {
            self.sent.slow = Some(now);
            let frame = self.gate.frame();
            let refused = self.refused.clone();
            let refused =
                refused.or_else(|| frame.and_then(|frame| wrong_frame(frame, self.settings)));
            let others = [
                ("odometry", &self.odometry),
                ("camera info", &self.camera_info),
            ];
            let others = others.into_iter();
            let others = others.filter_map(|(name, received)| {
                Some(received.as_ref()?.status(name, answer.now, None))
            });
            let more = others.chain(self.gate.diagnostics(answer.now)).collect();
            let message = diagnostics(
                answer,
                self.settings,
                self.gate.chosen(self.settings),
                self.hint(answer).as_deref(),
                (&self.pose, refused),
                self.clock_steps,
                more,
            );
            let _ = self.graph.diagnostics.publish(message);
            if let Some(markers) = self.gate.markers(answer).filter(|_| self.settings.markers) {
                let _ = self.graph.markers.publish(markers);
            }
        }
    }

    fn serve(&mut self) {
        if let Some(servers) = &self.graph.lifecycle {
            let state = servers.serve(self.lifecycle);
            if state != self.lifecycle {
                self.lifecycle = state;
                let answer = self.now();
                self.publish(&answer, Instant::now(), false);
            }
        }
        self.graph.parameters.serve(&self.settings.parameters);
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

fn origin(info: &MessageInfo) -> Origin {
    Origin {
        publisher: info.publisher_gid().to_bytes16(),
        number: info.sequence_number(),
    }
}
