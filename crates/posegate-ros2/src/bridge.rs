//! The bridge to a controller on a serial line. The gate on the controller decides; the bridge passes reports to it
//! and publishes its answers, without any permit of its own.

use crate::clock::Now;
use crate::decider::Decider;
use crate::diagnostics::explanation;
use crate::link::{Link, SOURCE};
use crate::message::{DiagnosticStatus, ERROR, KeyValue, OK, Time};
use crate::permission::{DENY, PERMIT};
use crate::permit_gate::{Answer, Order, Origin};
use crate::poses::PoseReport;
use crate::serial::{Port, SerialError};
use crate::settings::Serial;
use posegate::gate::{Reason, State};
use posegate::report::{FrameId, Report};
use posegate::wire::{ReportOutcome, encode, report_body};
use std::collections::VecDeque;
use std::hash::{BuildHasher, Hasher};
use std::time::{Duration, Instant};

/// The period at which the line is read. A controller sends a hundred messages a second.
const READ_PERIOD: Duration = Duration::from_millis(5);
/// The time for which the bridge denies after a clock was set. Stamps from before and after are not of one clock.
const HOLD: Duration = Duration::from_millis(500);
/// The number of reports whose verdict may still arrive.
const SENT: usize = 64;

/// The bridge to a controller.
#[derive(Debug)]
pub struct Bridge {
    port: Port,
    link: Link,
    limit: Duration,
    order: Order,
    /// The first sequence number of this run.
    first: u32,
    gaps: u32,
    held: Option<(Instant, Reason)>,
    sent: VecDeque<(u32, Time)>,
    outcome: Option<(ReportOutcome, Option<Time>)>,
    frame: Option<String>,
    passed: u64,
    dropped: u64,
}

impl Bridge {
    /// Opens the line to a controller.
    ///
    /// # Errors
    /// [`SerialError`]
    pub fn open(serial: &Serial) -> Result<Self, SerialError> {
        // A number that the controller has from an earlier run would be an answer to another report.
        let first = std::hash::RandomState::new().build_hasher().finish() as u32;
        Ok(Self {
            port: Port::open(&serial.path, serial.baud)?,
            link: Link::default(),
            limit: Duration::from_millis(u64::from(serial.link_timeout_ms)),
            order: Order::default(),
            first,
            gaps: 0,
            held: None,
            sent: VecDeque::new(),
            outcome: None,
            frame: None,
            passed: 0,
            dropped: 0,
        })
    }

    /// Reads the bytes that the controller sent.
    fn listen(&mut self) {
        let now = Instant::now();
        match self.port.read(now) {
            // Bytes that waited while this program did not run are not newer for that: the link bounds their age by a
            // round trip.
            Some(bytes) => self.link.take(&bytes, Instant::now()),
            None => self.link.close(),
        }
        self.port.flush(now);
        let outcome = self.link.last().and_then(|said| said.weighed);
        if let Some(outcome) = outcome.filter(|outcome| outcome.source == SOURCE) {
            let sent = self
                .sent
                .iter()
                .find(|(number, _)| *number == outcome.sequence);
            self.outcome = Some((outcome, sent.map(|(_, stamp)| *stamp)));
        }
    }

    fn answer(&self, now: Now) -> Answer {
        let moment = Instant::now();
        let held = self
            .held
            .filter(|(since, _)| moment.saturating_duration_since(*since) < HOLD);
        let is_open = held.is_none() && self.link.permits(moment, self.limit);
        let is_young = self.link.age(moment).is_some_and(|age| age < self.limit);
        let said = self.link.last().map(|said| said.state);
        let state = match (is_open, held, said) {
            (true, _, _) => State::Permitted,
            (_, Some((_, reason)), _) => State::Inhibited(reason),
            // The permission or the output contradicts the state.
            (_, _, Some(State::Permitted)) if is_young => State::Inhibited(Reason::InterlockFault),
            (_, _, Some(state)) if is_young => state,
            // The reason of a controller that sends telemetry but has not answered yet.
            (_, _, Some(State::Inhibited(reason) | State::Latched(reason)))
                if self.is_heard(moment) =>
            {
                State::Inhibited(reason)
            }
            _ => State::Inhibited(Reason::Silent),
        };
        Answer {
            now,
            is_open,
            state,
        }
    }

    /// Returns `true` if telemetry arrives.
    fn is_heard(&self, now: Instant) -> bool {
        self.link
            .silence(now)
            .is_some_and(|silence| silence < self.limit)
    }

    /// Returns the problem of the line as text; `None` if there is none.
    fn problem(&self, now: Instant) -> Option<String> {
        let path = self.port.path().display();
        if let Some(problem) = self.port.problem() {
            return Some(format!(
                "the serial line {path} is lost: {problem}; it is opened again once a second"
            ));
        }
        if !self.is_heard(now) {
            return Some(format!(
                "no telemetry arrives on {path}: check that the controller runs, sends version 2 of the messages, and has the speed of --baud"
            ));
        }
        if self.passed == 0 {
            return Some(format!(
                "no pose was passed to the controller on {path} yet"
            ));
        }
        let age = self.link.age(now);
        age.is_none_or(|age| age >= self.limit).then(|| {
            format!(
                "the controller on {path} does not answer reports in time: check that it receives, that its source {SOURCE} is meant for these poses, and link_timeout_ms"
            )
        })
    }
}

impl Decider for Bridge {
    fn pose(&mut self, now: Now, message: &PoseReport, origin: Origin) -> Answer {
        self.listen();
        let (sequence, has_changed) = self.order.next(origin);
        if has_changed {
            // The next number is then not the one that the controller expects.
            self.gaps = self.gaps.wrapping_add(1);
        }
        self.frame = Some(message.frame.clone());
        let moment = Instant::now();
        let clock_ms = self.link.clock_ms(moment).filter(|_| self.is_heard(moment));
        // A stamp that is not on this machine's clock has no age. The age is read after the controller's clock: a
        // pause in between makes the estimate older, never younger.
        let aged = Now::read();
        let stamp_ms = aged.stamp_ms(message.stamp).zip(clock_ms);
        let sequence = self.first.wrapping_add(self.gaps).wrapping_add(sequence);
        // A report that is not passed on is missing in the sequence, which closes the gate.
        let belief = message.pose.as_ref().ok().copied();
        let known = stamp_ms.zip(belief);
        let is_passed = known.is_some_and(|((stamp_ms, clock_ms), belief)| {
            let age_ms = aged.ms().wrapping_sub(stamp_ms);
            let report = Report {
                source: SOURCE,
                frame: FrameId::of(&message.frame),
                sequence,
                stamp_ms: clock_ms.wrapping_sub(age_ms),
                belief,
            };
            self.port.write(&encode(&report_body(&report)), moment)
        });
        if is_passed {
            self.passed += 1;
            self.link.note_sent(sequence, moment);
            if self.sent.len() == SENT {
                self.sent.pop_front();
            }
            self.sent.push_back((sequence, message.stamp));
        } else {
            self.dropped += 1;
        }
        self.answer(now)
    }

    fn tick(&mut self, now: Now) -> Answer {
        self.listen();
        self.answer(now)
    }

    fn inhibit(&mut self, now: Now, reason: Reason) -> Answer {
        self.held = Some((Instant::now(), reason));
        // The monotonic clock stops while the machine is suspended: earlier telemetry has no known age any more.
        self.link.close();
        self.gaps = self.gaps.wrapping_add(1);
        self.answer(now)
    }

    fn reset(&mut self, _: Now) -> Result<String, String> {
        Err("the gate is on the controller, and is reset there: a fault that is latched needs a person at the robot".into())
    }

    fn report(&self) -> Vec<KeyValue> {
        let Some((outcome, stamp)) = &self.outcome else {
            return Vec::new();
        };
        let reason = outcome.verdict.err().map_or("", Reason::name);
        let stamp = stamp.map_or(String::new(), |stamp| {
            format!("{}.{:09}", stamp.sec, stamp.nanosec)
        });
        vec![
            KeyValue::new("report_stamp", stamp),
            KeyValue::new(
                "report_verdict",
                if reason.is_empty() { PERMIT } else { DENY },
            ),
            KeyValue::new("report_reason", reason),
            KeyValue::new("gate_reason", reason),
        ]
    }

    fn frame(&self) -> Option<&str> {
        self.frame.as_deref()
    }

    fn diagnostics(&self, _: Now) -> Vec<DiagnosticStatus> {
        let now = Instant::now();
        let problem = self.problem(now);
        let ms = |time: Option<Duration>| {
            time.map_or(String::new(), |time| time.as_millis().to_string())
        };
        let counts = self.link.counts();
        let mut values = vec![
            KeyValue::new("device", self.port.path().display()),
            KeyValue::new("silence_ms", ms(self.link.silence(now))),
            KeyValue::new("age_ms", ms(self.link.age(now))),
            KeyValue::new("reports_passed", self.passed),
            KeyValue::new("reports_dropped", self.dropped),
            KeyValue::new("telemetry", counts.telemetry),
            KeyValue::new("damaged", counts.damaged),
            KeyValue::new("foreign", counts.foreign),
            KeyValue::new("repeated", counts.repeated),
            KeyValue::new("lost", counts.lost),
            KeyValue::new("restarts", counts.restarts),
        ];
        if let Some(said) = self.link.last() {
            let reason = match said.state {
                State::Inhibited(reason) | State::Latched(reason) => reason.name(),
                _ => "",
            };
            values.extend([
                KeyValue::new("controller_number", said.number),
                KeyValue::new("controller_cycle", said.cycle),
                KeyValue::new("controller_now_ms", said.now_ms),
                KeyValue::new("controller_state", said.state.name()),
                KeyValue::new("controller_reason", reason),
                KeyValue::new("controller_permitted", said.permitted),
                KeyValue::new("controller_interlock_high", said.interlock_high),
                KeyValue::new(
                    "controller_fault",
                    said.fault.map_or(String::new(), |fault| fault.to_string()),
                ),
                KeyValue::new("controller_bytes", said.line.bytes),
                KeyValue::new("controller_bytes_lost", said.line.lost),
                KeyValue::new("controller_frames_refused", said.line.refused),
                KeyValue::new("controller_reports_skipped", said.line.left_aside),
            ]);
        }
        vec![DiagnosticStatus {
            level: if problem.is_some() { ERROR } else { OK },
            name: "posegate: controller".into(),
            message: problem.unwrap_or_else(|| "the controller answers".into()),
            hardware_id: self.port.path().display().to_string(),
            values,
        }]
    }

    fn explain(&self, answer: &Answer, hint: Option<&str>) -> String {
        let verdict = self.outcome.and_then(|(outcome, _)| outcome.verdict.err());
        match (answer.is_open, self.problem(Instant::now())) {
            (false, Some(problem)) => format!("deny: {problem}."),
            _ => explanation(answer, verdict, hint),
        }
    }

    fn patience(&self) -> Duration {
        READ_PERIOD
    }
}
