//! Reports of an approach to a dock: good reports that earn a permit, and after each permit a different
//! fault.

use posegate::gate::{Restart, Settings, Source, site_digest};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, Heading, PoseEstimate, Report};
use posegate::set::{Aging, Trust, Uncertainty};

pub static TABLE: &[u8] = include_bytes!("../tables/dock.posegate");

static SOURCES: [Source; 2] = [Source {
    frame: FrameId::of("map"),
    trust: Trust::FULL,
    aging: Aging::NONE,
    motion: MotionBounds::STANDS_STILL,
}; 2];

/// Short times, so that a permit is earned again within three cycles. In silence the hold time ends the
/// permit before its estimate is too old.
pub static SETTINGS: Settings<'static> = Settings {
    task: "dock",
    site_digest: site_digest("edc7c40e3d20c10c9dbb252fe3b277bce6fdb9a2c440385d8355b24a3ed0be38")
        .expect("64 digits"),
    sources: &SOURCES,
    maximum_age_ms: 79,
    response_ms: PERIOD_MS,
    report_period_ms: 10,
    permit_hold_ms: 30,
    inhibit_hold_ms: 20,
    permits_in_a_row: 2,
    restart: Restart::Automatic,
    most_runs: 1_000,
    look_at: Some(7),
};

/// The controller's clock at start, milliseconds.
pub const START_MS: u32 = 1000;
const PERIOD_MS: u32 = 20;

/// A control cycle: its number, its time, its report.
pub struct Cycle {
    pub number: u32,
    pub now_ms: u32,
    pub report: Option<Report>,
}

/// The event of a cycle.
#[derive(Clone, Copy)]
enum CycleEvent {
    Good,
    /// A good report that is older than it should be by this many milliseconds.
    Late(u32),
    Nothing,
    At([f64; 3]),
    Covariance([f64; 3]),
    NotPositiveDefinite,
    Frame,
    UnknownSource,
    OtherSource,
    Gap,
    Stuck,
    StampBackwards,
    FromTheFuture,
}

use CycleEvent::{
    At, Covariance, Frame, FromTheFuture, Gap, Good, Late, NotPositiveDefinite, Nothing,
    OtherSource, StampBackwards, Stuck, UnknownSource,
};

/// The dock allows 8 cm, 6 cm and 4 degrees; a small set extends to 1.7 cm and 1 degree. Many of the sets
/// that are not inside are only slightly outside, so a small error lets them through.
const PLAN: [CycleEvent; 104] = [
    Good,
    Good,
    Good,
    Good, //
    At([0.3, 0.0, 0.0]),
    Good,
    Good, //
    At([0.066, 0.01, 0.0]),
    Good,
    Good, //
    At([-0.066, 0.0, 0.01]),
    Good,
    Good, //
    At([0.0, -0.046, 0.0]),
    Good,
    Good, //
    At([0.01, 0.046, 0.0]),
    Good,
    Good, //
    At([0.0, 0.0, 0.058]),
    Good,
    Good, //
    At([0.01, 0.01, -0.057]),
    Good,
    Good, //
    At([0.03, 0.0, -0.3]),
    Good,
    Good, //
    At([30.0, 0.0, 0.0]),
    Good,
    Good, //
    At([f64::NAN, 0.0, 0.0]),
    Good,
    Good, //
    Covariance([0.04, 0.04, 0.001]),
    Good,
    Good, //
    Covariance([6.1e-4, 2e-5, 2e-5]),
    Good,
    Good, //
    Covariance([2e-5, 2.4e-4, 2e-5]),
    Good,
    Good, //
    Covariance([2e-5, 2e-5, 4.6e-4]),
    Good,
    Good, //
    Covariance([2e-5, 2.6e-4, 4.2e-4]),
    Good,
    Good, //
    Covariance([0.0; 3]),
    Good,
    Good, //
    NotPositiveDefinite,
    Good,
    Good, //
    Frame,
    Good,
    Good, //
    UnknownSource,
    Good,
    Good, //
    OtherSource,
    // Now the usual source counts as a changed source.
    Good,
    Good,
    Good, //
    Gap,
    Good,
    Good, //
    Stuck,
    Good,
    Good, //
    StampBackwards,
    Good,
    Good, //
    FromTheFuture,
    Good,
    Good, //
    At([0.3, 0.0, 0.0]),
    At([0.066, 0.01, 0.0]),
    Good,
    At([0.0, -0.046, 0.0]),
    Good,
    Good, //
    Late(15),
    Late(34),
    Late(52),
    Good,
    Good, //
    // Longer than the hold time and the maximum age; then the same once more after a single report.
    Nothing,
    Nothing,
    Nothing,
    Nothing,
    Nothing,
    Nothing,
    Nothing,
    Nothing,
    Nothing, //
    Good,
    Nothing,
    Nothing,
    Nothing,
    Nothing,
    Nothing,
    Nothing,
];

pub static SCHEDULE: [Cycle; PLAN.len()] = schedule();

const SMALL: [f64; 3] = [2.5e-5, 2.5e-5, 2.7e-5];

const fn belief([x_m, y_m, yaw]: [f64; 3], [xx, yy, tt]: [f64; 3], xy: f64) -> PoseEstimate {
    PoseEstimate {
        x_m,
        y_m,
        heading: Heading::Radians(yaw),
        spread: Some(Uncertainty::Gaussian([
            [xx, xy, 0.0],
            [xy, yy, 0.0],
            [0.0, 0.0, tt],
        ])),
    }
}

/// Returns the plan with its times and numbers.
const fn schedule() -> [Cycle; PLAN.len()] {
    let mut cycles = [const {
        Cycle {
            number: 0,
            now_ms: 0,
            report: None,
        }
    }; PLAN.len()];
    let (mut now, mut last_sequence, mut last_stamp) = (START_MS, 0, 0);
    let mut k = 0;
    while k < PLAN.len() {
        now += PERIOD_MS;
        let (mut sequence, mut stamp) = (last_sequence + 1, now - 10);
        let (mut source, mut frame) = (0, FrameId::of("map"));
        // Near the goal, at a different place each time.
        let place = [
            0.001 * ((k * 7 % 31) as f64),
            -0.001 * ((k * 5 % 19) as f64),
            0.01,
        ];
        let mut says = belief(place, SMALL, 4e-6);
        // `true` if the gate evaluates the report's sequence and stamp, and stores them.
        let mut remembered = true;
        match PLAN[k] {
            Good | Nothing => {}
            Late(by) => stamp -= by,
            At(pose) => says = belief(pose, SMALL, 0.0),
            Covariance(diagonal) => says = belief([0.0, 0.01, 0.0], diagonal, 0.0),
            NotPositiveDefinite => says = belief([0.0, 0.01, 0.0], SMALL, 3e-5),
            Frame => (frame, remembered) = (FrameId::of("odom"), false),
            UnknownSource => (source, remembered) = (2, false),
            OtherSource => source = 1,
            Gap => sequence += 1,
            Stuck => sequence -= 1,
            StampBackwards => stamp = last_stamp - 1,
            FromTheFuture => stamp = now + 5,
        }
        let report = Report {
            source,
            frame,
            sequence,
            stamp_ms: stamp,
            belief: says,
        };
        let came = !matches!(PLAN[k], Nothing);
        cycles[k] = Cycle {
            number: k as u32,
            now_ms: now,
            report: if came { Some(report) } else { None },
        };
        if came && remembered {
            (last_sequence, last_stamp) = (sequence, stamp);
        }
        k += 1;
    }
    cycles
}
