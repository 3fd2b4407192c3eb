//! The gate of the core behind ROS messages, without DDS.
//!
//! [`PermitGate`] converts poses and odometry to reports, calls the gate in every control cycle, and keeps the last
//! report for telemetry. All decisions are made by [`posegate::gate::Gate`] and [`posegate::track::Tracker`].

use crate::clock::Now;
use crate::message::{AprilTagDetectionArray, CameraInfo, Odometry, PoseWithCovariance, Time};
use crate::poses::PoseReport;
use crate::settings::NodeSettings;
use crate::tags::{Look, Tags};
use posegate::gate::{Evidence, Gate, InvalidParameter, Reason, Settings, State, Step, Verdict};
use posegate::pose::Pose;
use posegate::report::{FrameId, Heading, PoseEstimate, Report, ros};
use posegate::set::{Growth, Inflation, Uncertainty};
use posegate::task::Risk;
use posegate::track::{Increment, Tracker, TrackerSettings};
use posegate_replay::{coordinates, remembers};

/// The number of increments of the odometry that are kept for late fixes: 2.5 s at 50 Hz.
const INCREMENTS: usize = 128;
/// Bytes of the table that are compared in a cycle.
const SCRUBBED: usize = 256;

/// The origin of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The identity of the publisher, new for each start of its program.
    pub publisher: [u8; 16],
    /// The publisher's count of its messages, as the middleware sends it.
    pub number: i64,
}

/// The answer of the node at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The moment.
    pub now: Now,
    /// `true` if the gate is open.
    pub is_open: bool,
    /// The state of the gate.
    pub state: State,
}

impl Answer {
    /// Returns the reason why the gate is closed; `None` if it is open.
    #[must_use]
    pub const fn reason(&self) -> Option<Reason> {
        match self.state {
            State::Permitted if self.is_open => None,
            State::Inhibited(reason) | State::Latched(reason) => Some(reason),
            _ => Some(Reason::Qualifying),
        }
    }
}

/// The last report, for telemetry.
#[derive(Clone, Debug)]
pub struct LastReport {
    /// The stamp of its message.
    pub stamp: Time,
    /// The frame of its numbers.
    pub frame: String,
    /// The estimate that was evaluated.
    pub estimate: PoseEstimate,
    /// The verdict on the estimate alone, with margin and worst pose.
    pub verdict: Verdict,
    /// The gate's answer: a denial may come from its memory.
    pub step: Result<(), Reason>,
}

/// What was evaluated of a message, and what the gate says of it.
type Evaluated = (PoseEstimate, Step, Verdict);

/// Returns a denial of a message, whatever the step's reason.
fn denied(estimate: PoseEstimate, step: Step, reason: Reason) -> Evaluated {
    let verdict = Err(reason);
    (estimate, Step { verdict, ..step }, Verdict::deny(reason))
}

/// A gate for ROS messages.
#[derive(Debug)]
pub struct PermitGate<'a> {
    gate: Gate<'a>,
    settings: &'a NodeSettings,
    poses: Order,
    tags: Option<Box<Tags>>,
    carried: Option<Box<Carried>>,
    last: Option<LastReport>,
}

impl<'a> PermitGate<'a> {
    /// Returns a closed gate. `is_sound` is the result of the self-test ([`posegate::gate::self_test`]), or what another gate says at a change of the
    /// table: a fault that it has latched ([`Gate::is_sound`]) stays latched. `gate` are the settings that [`NodeSettings::gate`] returns.
    ///
    /// # Errors
    /// [`InvalidParameter`] if a setting would disable a check.
    pub fn new(
        is_sound: Result<(), Reason>,
        table: &'a [u8],
        settings: &'a NodeSettings,
        gate: &'a Settings<'a>,
        now: Now,
    ) -> Result<Self, InvalidParameter> {
        Ok(Self {
            gate: Gate::after(is_sound, table, gate, now.ms())?,
            settings,
            poses: Order::default(),
            tags: settings
                .detector
                .clone()
                .map(|detector| Box::new(Tags::new(detector, settings.detection_topics.clone()))),
            carried: settings.tracker.and_then(Carried::new).map(Box::new),
            last: None,
        })
    }

    /// Returns the gate, for telemetry.
    #[must_use]
    pub const fn gate(&self) -> &Gate<'a> {
        &self.gate
    }

    /// Returns the last report.
    #[must_use]
    pub const fn last(&self) -> Option<&LastReport> {
        self.last.as_ref()
    }

    /// Returns the state of the tags, if detections are used.
    #[must_use]
    pub fn tags(&self) -> Option<&Tags> {
        self.tags.as_deref()
    }

    /// Processes a camera info; `None` if it could not be decoded.
    pub fn camera_info(&mut self, message: Option<&CameraInfo>) {
        match (&mut self.tags, message) {
            (Some(tags), Some(message)) => tags.camera_info(message),
            (Some(tags), None) => tags.camera_info_lost(),
            (None, _) => return,
        }
        // Poses from a camera that is now in doubt are not carried on.
        if self.tags.as_ref().is_some_and(|tags| !tags.has_camera()) {
            self.drop_fix();
        }
    }

    /// Processes the detections of an image. The gate permits only if every pose that fits them is inside.
    ///
    /// Detections without information on the pose are not a report: a permit then ends when its time is over.
    /// Detections that contradict the site end a permit, with the reasons of `posegate replay`.
    pub fn detections(
        &mut self,
        now: Now,
        message: &AprilTagDetectionArray,
        origin: Origin,
    ) -> Answer {
        let Some(tags) = &mut self.tags else {
            return self.tick(now);
        };
        let look = tags.look(message);
        let (now_ms, stamp, frame) = (now.ms(), message.header.stamp, &self.settings.frame);
        let (report, has_time) = self.report(now, stamp, frame, origin);
        let evaluated = match look {
            Look::Nothing => {
                self.poses.leave_out();
                return self.tick(now);
            }
            Look::Contradiction(reason) => self.refuse(now_ms, reason),
            Look::Poses(poses, is_ambiguous) => {
                let evaluated = match poses.as_slice() {
                    [pose] => {
                        let belief = *pose;
                        self.take_report(now_ms, &Report { belief, ..report }, has_time)
                    }
                    _ => self.take_several(now_ms, report, poses),
                };
                let (estimate, Step { verdict, .. }, _) = evaluated;
                // One of the poses is outside, whichever the gate names.
                match verdict.is_err_and(|reason| is_ambiguous && !remembers(reason)) {
                    true => {
                        let reason = Reason::TagPosesAmbiguous;
                        denied(estimate, self.gate.inhibit(now_ms, reason), reason)
                    }
                    false => evaluated,
                }
            }
        };
        self.answer(now, stamp, frame, evaluated)
    }

    /// Gives the gate the poses of which any may be the robot's: it permits only if all are inside.
    fn take_several(
        &mut self,
        now_ms: u32,
        mut report: Report,
        mut poses: Vec<PoseEstimate>,
    ) -> Evaluated {
        // A single pose can be carried, not one of several.
        if let Some(carried) = &mut self.carried {
            carried.tracker.drop_fix();
            // The gate's source has no inflation: the tracker applies it.
            for pose in &mut poses {
                *pose = inflated(pose, self.settings.trust.inflation);
            }
        }
        report.belief = poses.first().copied().unwrap_or(NO_POSE);
        let evidence = Evidence {
            report: &report,
            others: poses.get(1..).unwrap_or_default(),
            beside: Growth::NONE,
            elsewhere: Risk::NONE,
            since_fix_ms: None,
        };
        let step = self.gate.step_on(now_ms, &evidence);
        let (number, verdict) = self.gate.examine_on(&evidence);
        let about = poses.get(usize::from(number)).copied();
        (about.unwrap_or(report.belief), step, verdict)
    }

    /// Processes a pose. One that is refused ends every permit with the reason of the refusal.
    pub fn pose(&mut self, now: Now, message: &PoseReport, origin: Origin) -> Answer {
        let now_ms = now.ms();
        let (report, has_time) = self.report(now, message.stamp, &message.frame, origin);
        let evaluated = match &message.pose {
            Ok(belief) => {
                let belief = *belief;
                self.take_report(now_ms, &Report { belief, ..report }, has_time)
            }
            Err(refused) => self.refuse(now_ms, refused.reason()),
        };
        self.answer(now, message.stamp, &message.frame, evaluated)
    }

    /// Returns the report of a message, without its pose, and `true` if its stamp is a time. A stamp that is not on the
    /// gate's clock counts as older than every permitted one.
    fn report(&mut self, now: Now, stamp: Time, frame: &str, origin: Origin) -> (Report, bool) {
        let (sequence, has_changed) = self.poses.next(origin);
        if has_changed {
            // Two alternating publishers end every permit of each other.
            let _ = self.gate.inhibit(now.ms(), Reason::SourceChanged);
        }
        let known = now.stamp_ms(stamp);
        let stale = self.settings.gate().maximum_age_ms.wrapping_add(1);
        let report = Report {
            source: 0,
            frame: FrameId::of(frame),
            sequence,
            stamp_ms: known.unwrap_or(now.ms().wrapping_sub(stale)),
            belief: NO_POSE,
        };
        (report, known.is_some())
    }

    /// Keeps what was evaluated as the last report, and returns the answer.
    fn answer(&mut self, now: Now, stamp: Time, frame: &str, evaluated: Evaluated) -> Answer {
        let (estimate, step, verdict) = evaluated;
        self.last = Some(LastReport {
            stamp,
            frame: frame.to_owned(),
            estimate,
            verdict,
            step: step.verdict,
        });
        answer(now, step)
    }

    /// Ends a permit because of a message without a usable pose. It is left out of the sequence, and no earlier pose is
    /// carried on.
    fn refuse(&mut self, now_ms: u32, reason: Reason) -> Evaluated {
        self.poses.leave_out();
        self.drop_fix();
        denied(NO_POSE, self.gate.inhibit(now_ms, reason), reason)
    }

    /// From now on no earlier pose is carried.
    fn drop_fix(&mut self) {
        if let Some(carried) = &mut self.carried {
            carried.tracker.drop_fix();
        }
    }

    fn take_report(&mut self, now_ms: u32, report: &Report, has_time: bool) -> Evaluated {
        let estimate = report.belief;
        // A pose without a known time cannot be carried, because the odometry at that time is not known either. The
        // gate denies its stamp.
        if !has_time {
            self.drop_fix();
        }
        let Some(carried) = self.carried.as_mut().filter(|_| has_time) else {
            let step = self.gate.step(now_ms, report);
            return (estimate, step, self.gate.examine(report));
        };
        if let Err(reason) = carried.tracker.fix(report) {
            // The carried pose is unchanged.
            return denied(estimate, self.gate.tick(now_ms), reason);
        }
        match carried.tracker.tracked(now_ms) {
            Ok(tracked) => {
                let evidence = tracked.evidence();
                let step = self.gate.step_on(now_ms, &evidence);
                (estimate, step, self.gate.examine_on(&evidence).1)
            }
            Err(reason) => {
                let step = self.gate.inhibit(now_ms, reason);
                (estimate, step, Verdict::deny(reason))
            }
        }
    }

    /// Processes a pose of the odometry. Without a tracker it is ignored.
    pub fn odometry(&mut self, now: Now, message: &Odometry, origin: Origin) -> Answer {
        let Some(carried) = &mut self.carried else {
            return self.tick(now);
        };
        if let Err(reason) = carried.take(now, message, origin) {
            let step = self.gate.inhibit(now.ms(), reason);
            return answer(now, step);
        }
        self.tick(now)
    }

    /// Ends the path of the odometry: a message of it could not be decoded.
    pub fn odometry_lost(&mut self, now: Now) -> Answer {
        if let Some(carried) = &mut self.carried {
            carried.restart();
        }
        self.inhibit(now, Reason::OdometryGap)
    }

    /// Advances the time. Call it in every control cycle.
    pub fn tick(&mut self, now: Now) -> Answer {
        let now_ms = now.ms();
        let Some(carried) = &mut self.carried else {
            return answer(now, self.gate.tick(now_ms));
        };
        let step = match carried.tracker.tracked(now_ms) {
            Ok(tracked) => {
                let evidence = tracked.evidence();
                let step = self.gate.step_on(now_ms, &evidence);
                if let Some(last) = &mut self.last
                    && step.verdict != Err(Reason::Repeated)
                {
                    last.estimate = tracked.report.belief;
                    last.verdict = self.gate.examine_on(&evidence).1;
                    last.step = step.verdict;
                }
                step
            }
            // No fix yet.
            Err(Reason::Silent) => self.gate.tick(now_ms),
            Err(reason) => self.gate.inhibit(now_ms, reason),
        };
        answer(now, step)
    }

    /// Compares the next part of the table with its checksum from the start: the complete table every few seconds.
    pub fn scrub(&mut self) {
        let _ = self.gate.scrub(SCRUBBED);
    }

    /// Ends a permit for a cause outside of the gate.
    pub fn inhibit(&mut self, now: Now, reason: Reason) -> Answer {
        answer(now, self.gate.inhibit(now.ms(), reason))
    }

    /// Restarts the gate, closed. This manual action is the only exit from a latched fault.
    ///
    /// # Errors
    /// [`InvalidParameter`] if the settings have become invalid; the gate is then unchanged.
    pub fn reset(&mut self, now: Now) -> Result<(), InvalidParameter> {
        if let Some(carried) = &mut self.carried {
            carried.restart();
        }
        self.gate.reset(now.ms())
    }
}

/// A report without a pose, which every gate denies.
const NO_POSE: PoseEstimate = PoseEstimate {
    x_m: f64::INFINITY,
    y_m: f64::INFINITY,
    heading: Heading::Radians(f64::INFINITY),
    spread: None,
};

/// Returns an estimate with its covariance inflated, rounded up.
fn inflated(pose: &PoseEstimate, inflation: Inflation) -> PoseEstimate {
    let factor = f64::from(inflation.q16()) / 65_536.0 * (1.0 + 1e-9);
    let spread = match pose.spread {
        Some(Uncertainty::Gaussian(rows)) => Some(Uncertainty::Gaussian(
            rows.map(|row| row.map(|entry| entry * factor)),
        )),
        // Corners give no other kind of uncertainty.
        _ => None,
    };
    PoseEstimate { spread, ..*pose }
}

fn answer(now: Now, step: Step) -> Answer {
    Answer {
        now,
        is_open: step.permission.opens_at(now.ms()) && step.state == State::Permitted,
        state: step.state,
    }
}

/// Returns the estimate of a message by the core's conversion.
#[must_use]
pub fn estimate(message: &PoseWithCovariance) -> PoseEstimate {
    PoseEstimate::from(&ros::PoseWithCovariance {
        position: message.pose.position,
        orientation: message.pose.orientation,
        covariance: message.covariance,
    })
}

/// The sequence numbers of a topic: incremented by one for each message of one publisher, by more if messages were
/// lost.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Order {
    last: Option<Origin>,
    sequence: u32,
}

impl Order {
    /// Returns the sequence number of the next message, and `true` if its publisher has changed.
    pub(crate) fn next(&mut self, origin: Origin) -> (u32, bool) {
        let last = self.last.replace(origin);
        let is_same = last.is_none_or(|last| last.publisher == origin.publisher);
        let steps = match last {
            Some(last) if is_same => origin.number.wrapping_sub(last.number),
            _ => 1,
        };
        // Zero means that a number is repeated. Every other number that is not the next one is a gap.
        let steps = if (0..=1).contains(&steps) {
            steps as u32
        } else {
            2
        };
        self.sequence = self.sequence.wrapping_add(steps);
        (self.sequence, !is_same)
    }

    /// Omits the last message, which was not a report. A message that was lost before it is still a gap.
    pub(crate) fn leave_out(&mut self) {
        self.sequence = self.sequence.wrapping_sub(1);
    }
}

/// A tracker, and the pose of the odometry from which the next increment is measured.
#[derive(Debug)]
struct Carried {
    tracker: Tracker<INCREMENTS>,
    settings: TrackerSettings,
    before: Option<(Pose, [FrameId; 2], u32, Time)>,
    order: Order,
}

impl Carried {
    fn new(settings: TrackerSettings) -> Option<Self> {
        Some(Self {
            tracker: Tracker::new(settings)?,
            settings,
            before: None,
            order: Order::default(),
        })
    }

    /// Forgets the path and the fix.
    fn restart(&mut self) {
        if let Some(tracker) = Tracker::new(self.settings) {
            self.tracker = tracker;
        }
        self.before = None;
    }

    /// Processes a pose of the odometry. After an error the path is broken: a new one starts, and waits for a newer
    /// fix.
    fn take(&mut self, now: Now, message: &Odometry, origin: Origin) -> Result<(), Reason> {
        let taken = self.try_take(now, message, origin);
        if taken.is_err() {
            self.restart();
        }
        taken
    }

    fn try_take(&mut self, now: Now, message: &Odometry, origin: Origin) -> Result<(), Reason> {
        let (_, has_changed) = self.order.next(origin);
        // Increments are movements of one point of the robot: a pose of another point does not continue the path.
        let frames =
            [&message.header.frame_id, &message.child_frame_id].map(|name| FrameId::of(name));
        if has_changed || self.before.is_some_and(|(_, before, ..)| before != frames) {
            return Err(Reason::OdometryJump);
        }
        let stamp_ms = now
            .stamp_ms(message.header.stamp)
            .ok_or(Reason::OdometryGap)?;
        let stamp = message.header.stamp;
        if self.before.is_some_and(|(.., before_ms, before)| {
            before_ms == stamp_ms && before.nanosec < stamp.nanosec
        }) {
            // A later pose of the same millisecond: the next increment contains its movement.
            return Ok(());
        }
        let pose = estimate(&message.pose).mean()?;
        let (from, _, begins_ms, _) = self.before.unwrap_or((pose, frames, stamp_ms, stamp));
        let increment = increment(from, pose, [begins_ms, stamp_ms]).ok_or(Reason::OdometryJump)?;
        self.before = Some((pose, frames, stamp_ms, stamp));
        self.tracker.odometry(increment)
    }
}

/// Returns the movement between two poses, in the robot's axes at its start.
fn increment(from: Pose, to: Pose, span_ms: [u32; 2]) -> Option<Increment> {
    let [.., yaw] = coordinates(from);
    let um = |from: i32, to: i32| f64::from(to) - f64::from(from);
    let (dx, dy) = (um(from.x_um, to.x_um), um(from.y_um, to.y_um));
    let (sin, cos) = (libm::sin(yaw), libm::cos(yaw));
    // The unit of an increment; a length that is too large stays too large.
    let q8 = |um: f64| libm::round(um * 256.0) as i32;
    let turn = to.yaw.0.wrapping_sub(from.yaw.0) as i32;
    Increment::new(
        q8(cos * dx + sin * dy),
        q8(cos * dy - sin * dx),
        turn,
        span_ms,
    )
}

#[cfg(test)]
mod tests;
