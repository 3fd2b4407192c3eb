//! A controller that runs `examples/interrupt_gate.rs`, and the same gate on the host. Every telemetry message
//! of the controller is compared with the host gate's answer to the bytes that were sent.

use crate::dock::{good_belief, is_really_good};
use crate::firmware;
use crate::stepped::{At, Stepped, Stop};
use posegate::gate::{Evidence, Gate, Reason, Restart, Settings, Source, State};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::{Aging, Growth, Trust};
use posegate::table::Table;
use posegate::task::Risk;
use posegate::track::{Increment, OdometryErrors, Tracker, TrackerSettings};
use posegate::wire::{HypothesisCollector, Receiver, Telemetry, encode, increment_body};
use posegate::wire::{increment_from_body, report_body};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

pub const DOCK: &[u8] = include_bytes!("../../../examples/tables/dock.posegate");
const MAP: FrameId = FrameId::of("map");
/// The firmware's settings; the test `host_settings_equal_firmware_settings` compares them with its source.
pub const PERMIT_HOLD_MS: u32 = 100;
pub const MAXIMUM_AGE_MS: u32 = 200;
pub const RESPONSE_MS: u32 = WATCHDOG_MS + PERIOD_MS;
pub const INHIBIT_HOLD_MS: u32 = 200;
pub const PERMITS: usize = 3;
/// The gate's state after a late cycle.
pub const FORCED: State = State::Inhibited(Reason::InterlockFault);
/// Time between two cycles, and time without a cycle after which the watchdog interrupts.
pub const PERIOD_MS: u32 = 10;
pub const WATCHDOG_MS: u32 = 50;
const CLOCK_STARTS_AT: u32 = 0u32.wrapping_sub(10_000);
/// Largest number of bytes in flight: fewer than the controller's queue holds.
const WINDOW: u32 = 800;
/// Largest number of messages to wait for anything: about a minute of the board's time.
const PATIENCE: usize = 6_000;

/// The source whose reports are carried along odometry, and the robot's speeds: 0.1 m/s and 0.1 rad/s.
pub const CARRIED: u8 = 1;
const SPEEDS: MotionBounds = MotionBounds::of_mm_mrad(100, 0, 100);
static SOURCES: [Source; 2] = [
    Source {
        frame: MAP,
        trust: Trust::FULL,
        aging: Aging::NONE,
        motion: SPEEDS,
    },
    Source {
        frame: MAP,
        trust: Trust::FULL,
        aging: Aging::NONE,
        motion: SPEEDS,
    },
];

static FIRMWARE: LazyLock<PathBuf> = LazyLock::new(|| firmware::build("interrupt_gate"));

/// Starts a controller and runs it until its hold time is over.
pub fn start() -> Controller {
    Controller::start(&FIRMWARE)
}

/// Returns the firmware's tracker.
fn tracker() -> Tracker<64> {
    let settings = TrackerSettings {
        errors: OdometryErrors {
            m_per_sqrt_m: 0.005,
            rad_per_sqrt_rad: 0.02,
            rad_per_sqrt_m: 0.01,
            slip: 0.02,
            turn_slip: 0.02,
            ..OdometryErrors::NONE
        },
        bounds: SPEEDS,
        trust: Trust::FULL,
        radius_squared: Table::parse(DOCK).expect("a table").radius_squared(),
        maximum_gap_ms: 5 * PERIOD_MS,
        maximum_fix_age_ms: 1000,
    };
    Tracker::new(settings).expect("a valid tracker")
}

/// A random number generator with a seed (splitmix64, Steele, Lea and Flood 2014).
pub struct Chance(pub u64);

impl Chance {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a random number below a limit that is not zero.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }
}

/// Counts of a controller's actions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Messages in which the interlock was high.
    pub high: usize,
    /// Messages in which the interlock was high without three consecutive good reports before.
    pub wrongly: usize,
    /// Reports that the gate evaluated, and those that it permitted.
    pub weighed: usize,
    pub permitting: usize,
    /// How often the interlock opened.
    pub opened: usize,
}

/// A report that the gate evaluated: whether it was really good, its stamp, and the time of the evaluation.
#[derive(Clone, Copy)]
struct Past {
    good: bool,
    sequence: u32,
    stamp_ms: u32,
    weighed_ms: u32,
}

/// A message that the controller must find in the sent bytes.
enum Sent {
    Report(Report, Vec<PoseEstimate>),
    Odometry(Increment),
}

/// The emulated controller and the same gate on the host.
pub struct Controller {
    pub board: Stepped,
    pub tally: Tally,
    gate: Gate<'static>,
    receiver: Receiver,
    collector: HypothesisCollector,
    tracker: Tracker<64>,
    /// The last time that the controller reported before the current frame began.
    begun_ms: Option<u32>,
    /// The messages that the controller must find in the sent bytes, each with the last time reported before it.
    in_transit: VecDeque<(Sent, u32)>,
    /// Bytes to put on the line before the next cycle.
    to_send: Vec<u8>,
    sent: u32,
    /// This cycle came late: the gate closes before it evaluates anything.
    late: bool,
    past: VecDeque<Past>,
    last: Option<Telemetry>,
    /// `false` once bytes were lost: the host then does not know which bytes the controller has read.
    compared: bool,
    next_sequence: u32,
}

impl Controller {
    /// Starts a board and runs it until its hold time is over.
    fn start(elf: &Path) -> Self {
        let settings = Settings {
            task: "dock",
            task_digest: Table::parse(DOCK).expect("a table").task_digest(),
            sources: &SOURCES,
            maximum_age_ms: MAXIMUM_AGE_MS,
            response_ms: RESPONSE_MS,
            report_period_ms: 10,
            permit_hold_ms: PERMIT_HOLD_MS,
            inhibit_hold_ms: INHIBIT_HOLD_MS,
            permits_in_a_row: PERMITS as u16,
            restart: Restart::Automatic,
            most_runs: 1_000,
            look_at: Some(7),
        };
        let settings = Box::leak(Box::new(settings));
        let mut controller = Self {
            board: Stepped::start(elf),
            tally: Tally::default(),
            gate: Gate::new(DOCK, settings, CLOCK_STARTS_AT).expect("settings"),
            receiver: Receiver::new(),
            collector: HypothesisCollector::new(),
            tracker: tracker(),
            begun_ms: None,
            in_transit: VecDeque::new(),
            to_send: Vec::new(),
            sent: 0,
            late: false,
            past: VecDeque::new(),
            last: None,
            compared: true,
            next_sequence: 0,
        };
        assert_eq!(controller.board.run(&[]).at, At::Cycle);
        controller.until("the hold time is over", |telemetry| {
            telemetry.now_ms.wrapping_sub(CLOCK_STARTS_AT) > 300
        });
        controller
    }

    /// Returns the last message.
    pub fn last(&self) -> Telemetry {
        self.last.expect("a message has come")
    }

    /// Returns the number of bytes that the controller has not read yet.
    pub fn in_flight(&self) -> u32 {
        let line = self.last().line;
        self.sent.wrapping_sub(line.bytes).wrapping_sub(line.lost)
    }

    /// Puts bytes on the line, at most as many at a time as the controller can store.
    pub fn send(&mut self, bytes: &[u8]) {
        for part in bytes.chunks(200) {
            while self.in_flight() + part.len() as u32 > WINDOW {
                self.hear();
            }
            self.pour(part);
        }
    }

    /// Puts bytes on the line. They arrive before the next cycle.
    pub fn pour(&mut self, bytes: &[u8]) {
        self.to_send.extend(bytes);
        self.sent = self.sent.wrapping_add(bytes.len() as u32);
        let reported_ms = self
            .last
            .map_or(CLOCK_STARTS_AT, |telemetry| telemetry.now_ms);
        for byte in bytes {
            let begun_ms = *self.begun_ms.get_or_insert(reported_ms);
            if *byte == 0 {
                self.begun_ms = None;
            }
            let Some(Ok(body)) = self.receiver.push(*byte) else {
                continue;
            };
            let sent = match increment_from_body(&body) {
                Ok(increment) => Sent::Odometry(increment),
                Err(_) => match self.collector.take(&body) {
                    Ok(Some(evidence)) => Sent::Report(*evidence.report, evidence.others.to_vec()),
                    _ => continue,
                },
            };
            self.in_transit.push_back((sent, begun_ms));
        }
    }

    /// Ends the comparison, because bytes may be lost from here on.
    pub fn compare_no_more(&mut self) {
        self.compared = false;
        self.in_transit.clear();
        self.past.clear();
    }

    /// Returns the next report of the sequence, stamped with the last time that the controller reported.
    pub fn next_report(&self) -> Report {
        Report {
            source: 0,
            frame: MAP,
            sequence: self.next_sequence,
            stamp_ms: self.last().now_ms,
            belief: good_belief(),
        }
    }

    /// Sends a report, and continues the sequence with its number.
    pub fn report(&mut self, report: &Report) {
        self.send(&encode(&report_body(report)));
        self.next_sequence = report.sequence.wrapping_add(1);
    }

    /// Continues the sequence after a report that was sent otherwise.
    pub fn skip(&mut self) {
        self.next_sequence = self.next_sequence.wrapping_add(1);
    }

    /// Sends a fix of the carried source.
    pub fn fix(&mut self, report: &Report) {
        assert_eq!(report.source, CARRIED);
        self.send(&encode(&report_body(report)));
    }

    /// Sends an increment of the odometry.
    pub fn odometry(&mut self, increment: &Increment) {
        self.send(&encode(&increment_body(increment)));
    }

    /// Gives the host's tracker the odometry and the fixes that are next. Returns the reason if one of them broke the path.
    fn follow(&mut self) -> Option<Reason> {
        loop {
            match self.in_transit.front() {
                Some((Sent::Odometry(_), _)) => {}
                Some((Sent::Report(report, _), _)) if report.source == CARRIED => {}
                _ => return None,
            }
            match self.in_transit.pop_front() {
                Some((Sent::Odometry(increment), _)) => {
                    if let Err(reason) = self.tracker.odometry(increment) {
                        return Some(reason);
                    }
                }
                Some((Sent::Report(fix, others), reported_ms)) => {
                    // Tests send no fix whose stamp is between the last report's time and its own arrival.
                    let is_future = reported_ms.wrapping_sub(fix.stamp_ms) >= 1 << 31;
                    if is_future || !others.is_empty() {
                        self.tracker.drop_fix();
                    } else {
                        let _ = self.tracker.fix(&fix);
                    }
                }
                None => {}
            }
        }
    }

    /// Returns the next report that is evaluated at its arrival.
    fn next_sent(&mut self) -> (Report, Vec<PoseEstimate>, u32) {
        let broken = self.follow();
        assert_eq!(broken, None);
        match self.in_transit.pop_front() {
            Some((Sent::Report(report, others), reported_ms)) => (report, others, reported_ms),
            _ => panic!("no report was sent"),
        }
    }

    /// Runs a cycle with the bytes that are on the line, up to the next stop.
    pub fn run_cycle(&mut self) -> Stop {
        assert_eq!(self.board.stop().at, At::Cycle);
        self.board.run(&std::mem::take(&mut self.to_send))
    }

    /// Runs a cycle that begins `late_ms` after its timer's interrupt. If the watchdog is broken, its interrupt has no
    /// effect. Returns the time from the stop before the cycle to the watchdog's interrupt, in milliseconds of the
    /// board.
    pub fn run_late_cycle(&mut self, late_ms: u32, watchdog_is_broken: bool) -> u32 {
        let start = self.board.stop();
        assert_eq!(start.at, At::Cycle);
        let bytes = std::mem::take(&mut self.to_send);
        let bites = self.board.run_late(&bytes, late_ms);
        assert_eq!(bites.at, At::Watchdog);
        let after = if watchdog_is_broken {
            self.board.run_without_handler()
        } else {
            self.board.run(&[])
        };
        assert_eq!(after.at, At::Cycle);
        self.late = true;
        bites.now_ms.wrapping_sub(start.now_ms)
    }

    /// Returns `true` if the interlock is high, by the board's register at the present stop.
    pub fn interlock_is_high(&self) -> bool {
        self.board.stop().interlock_is_high()
    }

    /// Returns the next message, after comparing it with the host's gate.
    pub fn hear(&mut self) -> Telemetry {
        let body = loop {
            match self.board.next_frame() {
                Some(body) => break body,
                None => assert_eq!(self.run_cycle().at, At::Cycle, "the watchdog has come"),
            }
        };
        let telemetry =
            Telemetry::from_body(&body).unwrap_or_else(|| panic!("no telemetry: {body:?}"));
        if let Some(last) = self.last {
            assert_eq!(
                telemetry.number,
                last.number.wrapping_add(1),
                "a message is missing"
            );
            let cycles = telemetry.cycle.wrapping_sub(last.cycle);
            assert!(cycles <= 1, "{cycles} cycles without a message");
            assert!(
                cycles == 1 || telemetry.now_ms == last.now_ms,
                "{telemetry:?}"
            );
            let passed = telemetry.now_ms.wrapping_sub(last.now_ms);
            assert!(
                passed < 1 << 31,
                "the clock went backwards: {last:?} {telemetry:?}"
            );
        }
        assert_eq!(
            telemetry.permitted,
            telemetry.state == State::Permitted,
            "{telemetry:?}"
        );
        assert_eq!(
            telemetry.permitted, telemetry.interlock_high,
            "{telemetry:?}"
        );
        assert_eq!(telemetry.fault, None, "{telemetry:?}");
        if self.compared {
            self.compare(&telemetry);
        }
        let was_open = self.last.is_some_and(|last| last.permitted);
        self.tally.opened += usize::from(telemetry.permitted && !was_open);
        self.last = Some(telemetry);
        telemetry
    }

    fn compare(&mut self, telemetry: &Telemetry) {
        assert_eq!(telemetry.line.lost, 0, "{telemetry:?}");
        let before = self.last.map_or(0, |last| last.line.left_aside);
        for _ in before..telemetry.line.left_aside {
            self.next_sent();
        }
        let expected = match telemetry.weighed {
            None if std::mem::take(&mut self.late) => {
                self.gate.inhibit(telemetry.now_ms, Reason::InterlockFault)
            }
            None => match self.follow() {
                Some(reason) => self.gate.inhibit(telemetry.now_ms, reason),
                None => self.gate.tick(telemetry.now_ms),
            },
            Some(weighed) if weighed.source == CARRIED => {
                assert_eq!(self.follow(), None);
                let tracked = self
                    .tracker
                    .tracked(telemetry.now_ms)
                    .expect("a carried fix");
                assert_eq!(
                    (weighed.sequence, weighed.stamp_ms),
                    (tracked.report.sequence, tracked.report.stamp_ms)
                );
                let step = self.gate.step_on(telemetry.now_ms, &tracked.evidence());
                assert_eq!(weighed.verdict, step.verdict, "{telemetry:?} {tracked:?}");
                self.tally.weighed += 1;
                self.tally.permitting += usize::from(weighed.verdict.is_ok());
                self.remember(&tracked.report, telemetry.now_ms);
                step
            }
            Some(weighed) => {
                let (mut sent, others, reported_ms) = self.next_sent();
                assert_eq!(
                    (weighed.source, weighed.sequence),
                    (sent.source, sent.sequence)
                );
                // The controller uses a stamp as it is, or, if it is later than the first byte (by less than half
                // the clock's range), as one from the future. Each byte arrives between its sending and its
                // evaluation.
                if weighed.stamp_ms != sent.stamp_ms {
                    assert_eq!(
                        weighed.stamp_ms,
                        telemetry.now_ms.wrapping_add(1),
                        "{telemetry:?}"
                    );
                    let later = sent.stamp_ms.wrapping_sub(reported_ms);
                    let under_way = telemetry.now_ms.wrapping_sub(reported_ms);
                    let range = 1..=(1 << 31) + under_way;
                    assert!(range.contains(&later), "{telemetry:?} {sent:?}");
                    sent.stamp_ms = weighed.stamp_ms;
                }
                let evidence = Evidence {
                    report: &sent,
                    others: &others,
                    beside: Growth::NONE,
                    since_fix_ms: None,
                    elsewhere: Risk::NONE,
                };
                let step = self.gate.step_on(telemetry.now_ms, &evidence);
                assert_eq!(weighed.verdict, step.verdict, "{telemetry:?} {sent:?}");
                self.tally.weighed += 1;
                self.tally.permitting += usize::from(weighed.verdict.is_ok());
                self.remember(&sent, telemetry.now_ms);
                step
            }
        };
        assert_eq!(
            (telemetry.state, telemetry.permitted),
            (expected.state, expected.permission.is_permit()),
            "{telemetry:?}"
        );
        if telemetry.interlock_high {
            self.tally.high += 1;
            let rightly = self.may_be_open(telemetry.now_ms);
            self.tally.wrongly += usize::from(!rightly);
        }
    }

    /// Records an evaluated report. A repeated report is ignored.
    fn remember(&mut self, report: &Report, weighed_ms: u32) {
        let (sequence, stamp_ms) = (report.sequence, report.stamp_ms);
        let again = |past: &Past| (past.sequence, past.stamp_ms) == (sequence, stamp_ms);
        if self.past.back().is_some_and(again) {
            return;
        }
        self.past.push_back(Past {
            good: is_really_good(report),
            sequence,
            stamp_ms,
            weighed_ms,
        });
        if self.past.len() > PERMITS {
            self.past.pop_front();
        }
    }

    /// Returns `true` if the last three reports were good, consecutive and fresh, and the last of them is recent.
    fn may_be_open(&self, now_ms: u32) -> bool {
        let fresh = |past: &Past| past.weighed_ms.wrapping_sub(past.stamp_ms) <= MAXIMUM_AGE_MS;
        let follows = self
            .past
            .iter()
            .zip(self.past.iter().skip(1))
            .all(|(a, b)| {
                let later = b.stamp_ms.wrapping_sub(a.stamp_ms);
                b.sequence.wrapping_sub(a.sequence) == 1 && (1..1 << 31).contains(&later)
            });
        let recent = self.past.back().is_some_and(|past| {
            now_ms.wrapping_sub(past.weighed_ms) <= PERMIT_HOLD_MS
                && now_ms.wrapping_sub(past.stamp_ms) <= MAXIMUM_AGE_MS
        });
        self.past.len() == PERMITS
            && self.past.iter().all(|past| past.good && fresh(past))
            && follows
            && recent
    }

    /// Reads messages until the condition `so` is met.
    ///
    /// # Panics
    /// If the condition is not met within a minute of the board's time.
    pub fn until(&mut self, what: &str, so: impl Fn(&Telemetry) -> bool) -> Telemetry {
        for _ in 0..PATIENCE {
            let telemetry = self.hear();
            if so(&telemetry) {
                return telemetry;
            }
        }
        panic!("not within {PATIENCE} messages: {what}; {:?}", self.last)
    }

    /// Reads messages until the controller has read every sent byte and has reported it.
    pub fn until_quiet(&mut self) {
        while self.in_flight() > 0 {
            self.hear();
        }
        let cycle = self.last().cycle;
        self.until("two cycles more", |telemetry| {
            telemetry.cycle.wrapping_sub(cycle) > 1
        });
    }

    /// Sends good reports, one per cycle, until the condition `so` is met.
    ///
    /// # Panics
    /// If the condition is not met within a minute of the board's time.
    pub fn good_until(&mut self, what: &str, so: impl Fn(&Telemetry) -> bool) -> Telemetry {
        for _ in 0..PATIENCE {
            let cycle = self.last().cycle;
            self.report(&self.next_report());
            let telemetry = self.until("the next cycle", |telemetry| telemetry.cycle != cycle);
            if so(&telemetry) {
                return telemetry;
            }
        }
        panic!("not within {PATIENCE} reports: {what}; {:?}", self.last)
    }

    /// Sends good reports until the interlock is open.
    pub fn open(&mut self) -> Telemetry {
        self.good_until("open", |telemetry| telemetry.permitted)
    }
}
