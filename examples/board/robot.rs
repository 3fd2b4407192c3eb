//! A simulated robot: the clock of its control cycles, the reports of its localization, and a console that shows when
//! the interlock changes. `examples/c/robot.c` does the same in C. A product has its own code instead.

use cortex_m_semihosting::debug::{self, EXIT_SUCCESS};
use cortex_m_semihosting::hprintln;
use posegate::gate::Step;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::Estimate;

const CYCLE_MS: u32 = 10;
const REPORT_MS: u32 = 50;
/// Age of an estimate when it arrives.
const AGE_MS: u32 = 10;
/// First there are no reports. Then the robot is at the dock, then next to it, then at the dock again; then the
/// reports end.
const FIRST_MS: u32 = 100;
const BESIDE_MS: core::ops::Range<u32> = 1_500..1_600;
const LAST_MS: u32 = 3_000;
const END_MS: u32 = 3_300;

/// The simulated robot.
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

    /// Returns the time of the clock that stamps the reports; nothing stops it.
    pub const fn now_ms(&self) -> u32 {
        self.now_ms
    }

    /// Waits for the next control cycle; returns `false` at the end of the script.
    pub const fn next_cycle(&mut self) -> bool {
        self.now_ms += CYCLE_MS;
        self.now_ms <= END_MS
    }

    /// Returns the report that has arrived since the last cycle, if any.
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

    /// Prints when the interlock changes, and why it closes.
    pub fn print_change(&mut self, step: &Step, is_high: bool) {
        if is_high != self.was_high {
            self.was_high = is_high;
            match step.verdict {
                Ok(()) if is_high => hprintln!("{} ms: open", self.now_ms),
                Ok(()) => hprintln!("{} ms: closed", self.now_ms),
                Err(reason) => hprintln!("{} ms: closed, {}", self.now_ms, reason.name()),
            }
        }
    }

    /// Ends the script.
    pub fn stop(&self) -> ! {
        hprintln!("{} reports", self.sequence);
        loop {
            debug::exit(EXIT_SUCCESS);
        }
    }
}
