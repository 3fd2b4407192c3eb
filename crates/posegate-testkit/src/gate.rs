//! A gate of the dock with its settings, and reports for it.

use posegate::gate::{Gate, Restart, Settings, Source};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::{Aging, Estimate, Trust};
use posegate::table::Table;

pub const DOCK: &[u8] = include_bytes!("../../../examples/tables/dock.posegate");

pub const SOURCE: Source = Source {
    frame: FrameId::of("map"),
    trust: Trust::FULL,
    aging: Aging::NONE,
    motion: MotionBounds::STANDS_STILL,
};
pub static SOURCES: [Source; 2] = [SOURCE; 2];

pub const MAXIMUM_AGE_MS: u32 = 200;
/// A permission ends this long after the step that gave it.
pub const RESPONSE_MS: u32 = 30;
/// Age of the oldest estimate that is permitted.
pub const OLDEST_MS: u32 = MAXIMUM_AGE_MS - RESPONSE_MS;
pub const PERMIT_HOLD_MS: u32 = 100;
pub const INHIBIT_HOLD_MS: u32 = 50;
pub const PERMITS: u16 = 3;

pub fn settings() -> Settings<'static> {
    Settings {
        task: "dock",
        task_digest: Table::parse(DOCK).unwrap().task_digest(),
        sources: &SOURCES,
        maximum_age_ms: MAXIMUM_AGE_MS,
        response_ms: RESPONSE_MS,
        report_period_ms: 1,
        permit_hold_ms: PERMIT_HOLD_MS,
        inhibit_hold_ms: INHIBIT_HOLD_MS,
        permits_in_a_row: PERMITS,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: Some(7),
    }
}

/// Returns an estimate with standard deviations of 5 mm and 0.3 degrees; the dock allows 8 cm, 6 cm and 4 degrees.
pub fn belief(x_m: f64) -> PoseEstimate {
    let estimate = Estimate {
        x_m,
        y_m: 0.0,
        yaw_rad: 0.0,
    };
    PoseEstimate::diagonal(estimate, [2.5e-5, 2.5e-5, 2.7e-5])
}

/// Returns a report that is permitted.
pub fn report(sequence: u32, stamp_ms: u32) -> Report {
    Report {
        source: 0,
        frame: FrameId::of("map"),
        sequence,
        stamp_ms,
        belief: belief(0.0),
    }
}

/// Returns a gate opened by reports 0 to 9, which arrive every 20 ms after `start`, with the last sequence number
/// and the time.
pub fn permitted<'a>(
    table: &'a [u8],
    settings: &'a Settings<'a>,
    start: u32,
) -> (Gate<'a>, u32, u32) {
    let mut gate = Gate::new(table, settings, start).unwrap();
    let mut now = start;
    for sequence in 0..10 {
        now = now.wrapping_add(20);
        let step = gate.step(now, &report(sequence, now));
        // Closed until enough consecutive permits and the end of the hold time.
        let open = sequence + 1 >= u32::from(PERMITS) && now.wrapping_sub(start) >= INHIBIT_HOLD_MS;
        assert_eq!(step.permission.is_permit(), open, "{sequence}: {step:?}");
        assert_eq!(step.verdict, Ok(()));
    }
    (gate, 9, now)
}
