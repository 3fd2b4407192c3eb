//! A controller that runs `examples/interrupt_gate.rs`, and beside it the same gate on this machine:
//! every message of its telemetry is compared with what that gate says of the bytes that were sent.

use crate::dock::{good_belief, is_really_good};
use crate::firmware;
use crate::stepped::{At, Stepped, Stop};
use posegate::gate::{Gate, Reason, Restart, Settings, Source, State};
use posegate::report::{FrameId, Report};
use posegate::set::Trust;
use posegate::table::Table;
use posegate::wire::{Receiver, Telemetry, encode, report_body, report_from_body};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

pub const DOCK: &[u8] = include_bytes!("../../../examples/tables/dock.posegate");
const MAP: FrameId = FrameId::of("map");
/// What the firmware is set to; `the_settings_are_the_firmwares` holds it against the source.
pub const PERMIT_HOLD_MS: u32 = 100;
pub const MAXIMUM_AGE_MS: u32 = 200;
pub const RESPONSE_MS: u32 = WATCHDOG_MS + PERIOD_MS;
pub const INHIBIT_HOLD_MS: u32 = 200;
pub const PERMITS: usize = 3;
/// Where the gate stands after a cycle that came late.
pub const FORCED: State = State::Inhibited(Reason::InterlockFault);
/// What lies between two cycles, and after how long without one the watchdog comes.
pub const PERIOD_MS: u32 = 10;
pub const WATCHDOG_MS: u32 = 50;
const CLOCK_STARTS_AT: u32 = 0u32.wrapping_sub(10_000);
/// Bytes on their way at most: fewer than the controller's queue holds.
const WINDOW: u32 = 800;
/// Messages that anything takes at most; about a minute of the board's.
const PATIENCE: usize = 6_000;

static SOURCES: [Source; 1] = [Source {
    frame: MAP,
    trust: Trust::FULL,
}];

static FIRMWARE: LazyLock<PathBuf> = LazyLock::new(|| firmware::build("interrupt_gate"));

/// A controller after its hold time.
pub fn start() -> Controller {
    Controller::start(&FIRMWARE)
}

/// A numbered chance (splitmix64, Steele, Lea and Flood 2014).
pub struct Chance(pub u64);

impl Chance {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below a limit that is not zero.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }
}

/// What a controller has been seen to do.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Messages in which the interlock was high.
    pub high: usize,
    /// Messages in which it was, and three good reports in a row were not behind it.
    pub wrongly: usize,
    /// Reports that were weighed, and those that permitted.
    pub weighed: usize,
    pub permitting: usize,
    /// Times that it opened.
    pub opened: usize,
}

/// A report that was weighed: whether it was really good, its stamp, and when.
#[derive(Clone, Copy)]
struct Past {
    good: bool,
    sequence: u32,
    stamp_ms: u32,
    weighed_ms: u32,
}

/// The emulated controller and its double.
pub struct Controller {
    pub board: Stepped,
    pub tally: Tally,
    gate: Gate<'static>,
    receiver: Receiver,
    /// The controller's clock as it was told before the frame under way.
    begun_ms: Option<u32>,
    /// What the controller must find in the bytes that were sent, and its clock as it was told before.
    on_the_way: VecDeque<(Report, u32)>,
    /// Bytes for the line before the next cycle.
    to_send: Vec<u8>,
    sent: u32,
    /// This cycle came late: the gate closes before it looks at anything.
    late: bool,
    past: VecDeque<Past>,
    last: Option<Telemetry>,
    /// Off once bytes were lost: then this machine does not know what the controller has read.
    compared: bool,
    next_sequence: u32,
}

impl Controller {
    /// A board, after its hold time.
    fn start(elf: &Path) -> Self {
        let settings = Settings {
            task: "dock",
            site_digest: Table::parse(DOCK).expect("a table").site_digest(),
            sources: &SOURCES,
            maximum_age_ms: MAXIMUM_AGE_MS,
            response_ms: RESPONSE_MS,
            permit_hold_ms: PERMIT_HOLD_MS,
            inhibit_hold_ms: INHIBIT_HOLD_MS,
            permits_in_a_row: PERMITS as u16,
            restart: Restart::Automatic,
            look_at: Some(7),
        };
        let settings = Box::leak(Box::new(settings));
        let mut controller = Self {
            board: Stepped::start(elf),
            tally: Tally::default(),
            gate: Gate::new(DOCK, settings, CLOCK_STARTS_AT).expect("settings"),
            receiver: Receiver::new(),
            begun_ms: None,
            on_the_way: VecDeque::new(),
            to_send: Vec::new(),
            sent: 0,
            late: false,
            past: VecDeque::new(),
            last: None,
            compared: true,
            next_sequence: 0,
        };
        assert_eq!(controller.board.run(&[]).at, At::Cycle);
        controller.until("the hold time is over", |told| {
            told.now_ms.wrapping_sub(CLOCK_STARTS_AT) > 300
        });
        controller
    }

    /// The last message.
    pub fn last(&self) -> Telemetry {
        self.last.expect("a message has come")
    }

    /// Bytes that have not been taken up yet.
    pub fn in_flight(&self) -> u32 {
        let line = self.last().line;
        self.sent.wrapping_sub(line.bytes).wrapping_sub(line.lost)
    }

    /// Puts bytes on the line, no more at a time than the controller can keep.
    pub fn send(&mut self, bytes: &[u8]) {
        for part in bytes.chunks(200) {
            while self.in_flight() + part.len() as u32 > WINDOW {
                self.hear();
            }
            self.pour(part);
        }
    }

    /// Puts bytes on the line: they come before the next cycle.
    pub fn pour(&mut self, bytes: &[u8]) {
        self.to_send.extend(bytes);
        self.sent = self.sent.wrapping_add(bytes.len() as u32);
        let told_ms = self.last.map_or(CLOCK_STARTS_AT, |told| told.now_ms);
        for byte in bytes {
            let begun_ms = *self.begun_ms.get_or_insert(told_ms);
            if *byte == 0 {
                self.begun_ms = None;
            }
            if let Some(Ok(body)) = self.receiver.push(*byte)
                && let Ok(report) = report_from_body(&body)
            {
                self.on_the_way.push_back((report, begun_ms));
            }
        }
    }

    /// Gives up the comparison: bytes may be lost from here on.
    pub fn compare_no_more(&mut self) {
        self.compared = false;
        self.on_the_way.clear();
        self.past.clear();
    }

    /// The next report in its sequence, stamped by the controller's clock as it was last told.
    pub fn next_report(&self) -> Report {
        Report {
            source: 0,
            frame: MAP,
            sequence: self.next_sequence,
            stamp_ms: self.last().now_ms,
            belief: good_belief(),
        }
    }

    /// Sends a report; the next one follows on it.
    pub fn report(&mut self, report: &Report) {
        self.send(&encode(&report_body(report)));
        self.next_sequence = report.sequence.wrapping_add(1);
    }

    /// Runs a cycle, with the bytes that are on the line; to the stop after it.
    pub fn run_cycle(&mut self) -> Stop {
        assert_eq!(self.board.stop().at, At::Cycle);
        self.board.run(&std::mem::take(&mut self.to_send))
    }

    /// Runs a cycle that begins so much later than its timer's interrupt came. Where the watchdog is broken, its
    /// interrupt comes to nothing. The milliseconds that the interlock was high meanwhile, by the board's clock.
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

    /// Whether the interlock is high, as the board's own register says where it stands now.
    pub fn interlock_is_high(&self) -> bool {
        self.board.stop().interlock_is_high()
    }

    /// The next message, held against what this machine's gate says.
    pub fn hear(&mut self) -> Telemetry {
        let body = loop {
            match self.board.next_frame() {
                Some(body) => break body,
                None => assert_eq!(self.run_cycle().at, At::Cycle, "the watchdog has come"),
            }
        };
        let told = Telemetry::from_body(&body).unwrap_or_else(|| panic!("no telemetry: {body:?}"));
        if let Some(last) = self.last {
            assert_eq!(
                told.number,
                last.number.wrapping_add(1),
                "a message is missing"
            );
            let cycles = told.cycle.wrapping_sub(last.cycle);
            assert!(cycles <= 1, "{cycles} cycles without a message");
            assert!(cycles == 1 || told.now_ms == last.now_ms, "{told:?}");
            let passed = told.now_ms.wrapping_sub(last.now_ms);
            assert!(
                passed < 1 << 31,
                "the clock went backwards: {last:?} {told:?}"
            );
        }
        assert_eq!(told.permitted, told.state == State::Permitted, "{told:?}");
        assert_eq!(told.permitted, told.interlock_high, "{told:?}");
        assert_eq!(told.fault, None, "{told:?}");
        if self.compared {
            self.compare(&told);
        }
        let was_open = self.last.is_some_and(|last| last.permitted);
        self.tally.opened += usize::from(told.permitted && !was_open);
        self.last = Some(told);
        told
    }

    fn compare(&mut self, told: &Telemetry) {
        assert_eq!(told.line.lost, 0, "{told:?}");
        let before = self.last.map_or(0, |last| last.line.left_aside);
        for _ in before..told.line.left_aside {
            self.on_the_way
                .pop_front()
                .expect("a report to leave aside");
        }
        let expected = match told.weighed {
            None if std::mem::take(&mut self.late) => {
                self.gate.inhibit(told.now_ms, Reason::InterlockFault)
            }
            None => self.gate.tick(told.now_ms),
            Some(weighed) => {
                let (mut sent, told_ms) = self.on_the_way.pop_front().expect("a report was sent");
                assert_eq!(
                    (weighed.source, weighed.sequence),
                    (sent.source, sent.sequence)
                );
                // The controller takes a stamp as it is, or, where it is later than the first byte, for
                // one from the future: less than half the clock's range later. No byte arrives before it
                // was sent, nor after it was weighed.
                if weighed.stamp_ms != sent.stamp_ms {
                    assert_eq!(weighed.stamp_ms, told.now_ms.wrapping_add(1), "{told:?}");
                    let later = sent.stamp_ms.wrapping_sub(told_ms);
                    let under_way = told.now_ms.wrapping_sub(told_ms);
                    let range = 1..=(1 << 31) + under_way;
                    assert!(range.contains(&later), "{told:?} {sent:?}");
                    sent.stamp_ms = weighed.stamp_ms;
                }
                let step = self.gate.step(told.now_ms, &sent);
                assert_eq!(weighed.verdict, step.verdict, "{told:?} {sent:?}");
                self.tally.weighed += 1;
                self.tally.permitting += usize::from(weighed.verdict.is_ok());
                self.remember(&sent, told.now_ms);
                step
            }
        };
        assert_eq!(
            (told.state, told.permitted),
            (expected.state, expected.permission.is_permit()),
            "{told:?}"
        );
        if told.interlock_high {
            self.tally.high += 1;
            let rightly = self.may_be_open(told.now_ms);
            self.tally.wrongly += usize::from(!rightly);
        }
    }

    /// The same report again counts for nothing.
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

    /// Whether the last three reports were good, consecutive and fresh, and the last of them is recent.
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

    /// Listens until something is so.
    ///
    /// # Panics
    /// Where it is not so for a minute of the board's.
    pub fn until(&mut self, what: &str, so: impl Fn(&Telemetry) -> bool) -> Telemetry {
        for _ in 0..PATIENCE {
            let told = self.hear();
            if so(&told) {
                return told;
            }
        }
        panic!("not within {PATIENCE} messages: {what}; {:?}", self.last)
    }

    /// Listens until every byte that was sent has been taken up, and has been told of.
    pub fn until_quiet(&mut self) {
        while self.in_flight() > 0 {
            self.hear();
        }
        let cycle = self.last().cycle;
        self.until("two cycles more", |told| told.cycle.wrapping_sub(cycle) > 1);
    }

    /// Sends good reports, one a cycle, until something is so.
    ///
    /// # Panics
    /// Where it is not so for a minute.
    pub fn good_until(&mut self, what: &str, so: impl Fn(&Telemetry) -> bool) -> Telemetry {
        for _ in 0..PATIENCE {
            let cycle = self.last().cycle;
            self.report(&self.next_report());
            let told = self.until("the next cycle", |told| told.cycle != cycle);
            if so(&told) {
                return told;
            }
        }
        panic!("not within {PATIENCE} reports: {what}; {:?}", self.last)
    }

    /// Sends good reports until the interlock is open.
    pub fn open(&mut self) -> Telemetry {
        self.good_until("open", |told| told.permitted)
    }
}
