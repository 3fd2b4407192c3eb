//! A robot that is played: the clock of its control cycles, the reports of its localization, and a console that shows
//! when the interlock changes. `examples/c/robot.c` plays the same in C. A product has its own in this place.

use cortex_m_semihosting::debug::{self, EXIT_SUCCESS};
use cortex_m_semihosting::hprintln;
use posegate::gate::Step;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::Estimate;

const CYCLE_MS: u32 = 10;
const REPORT_MS: u32 = 50;
/// How old an estimate is when it comes.
const AGE_MS: u32 = 10;
/// At first there are no reports; then the robot stands at the dock; then beside it; at the dock again; then the
/// reports end.
const FIRST_MS: u32 = 100;
const BESIDE_MS: core::ops::Range<u32> = 1_500..1_600;
const LAST_MS: u32 = 3_000;
const END_MS: u32 = 3_300;

/// The robot.
pub struct Robot {
    now_ms: u32,
    sequence: u32,
    was_high: bool,
}

impl Robot {
    pub const fn new() -> Self {
        Self {
            now_ms: 0,
            sequence: 0,
            was_high: false,
        }
    }

    /// A clock that nothing stops, the one that reports are stamped by.
    pub const fn now_ms(&self) -> u32 {
        self.now_ms
    }

    /// Waits for the next control cycle; false at the end of the script.
    pub const fn waits_for_its_next_cycle(&mut self) -> bool {
        self.now_ms += CYCLE_MS;
        self.now_ms <= END_MS
    }

    /// The report that has come since the last cycle, if any.
    pub fn report(&mut self) -> Option<Report> {
        let now_ms = self.now_ms;
        if !((FIRST_MS..=LAST_MS).contains(&now_ms) && now_ms.is_multiple_of(REPORT_MS)) {
            return None;
        }
        let estimate = Estimate {
            x_m: if BESIDE_MS.contains(&now_ms) {
                0.07
            } else {
                0.01
            },
            y_m: 0.0,
            yaw_rad: 0.0,
        };
        let sequence = self.sequence;
        self.sequence += 1;
        Some(Report {
            source: 0,
            frame: FrameId::of("map"),
            sequence,
            stamp_ms: now_ms - AGE_MS,
            belief: PoseEstimate::diagonal(estimate, [1e-4; 3]),
        })
    }

    /// Tells when the interlock changes, and why it closes.
    pub fn tell(&mut self, step: &Step, is_high: bool) {
        if is_high != self.was_high {
            self.was_high = is_high;
            match step.verdict {
                Ok(()) if is_high => hprintln!("{} ms: open", self.now_ms),
                Ok(()) => hprintln!("{} ms: closed", self.now_ms),
                Err(reason) => hprintln!("{} ms: closed, {}", self.now_ms, reason.name()),
            }
        }
    }

    /// The end of the script.
    pub fn stop(&self) -> ! {
        hprintln!("{} reports", self.sequence);
        loop {
            debug::exit(EXIT_SUCCESS);
        }
    }
}
