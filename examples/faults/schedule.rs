//! Reports of an approach: good reports that earn a permit, and after each permit a different fault. The table is a dock's box, or the one that
//! `POSEGATE_FAULT_TABLE` names when the firmware is built: `footprint` or `union`.

use posegate::gate::{Restart, Settings, Source, task_digest};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, Heading, PoseEstimate, Report};
use posegate::set::{Aging, Trust, Uncertainty};

/// A task, and the reports about it.
struct Approach {
    table: &'static [u8],
    task: &'static str,
    task_digest: [u8; 32],
    /// A good report: metres, metres, radians. Places differ by some of `wander` metres.
    good: [f64; 3],
    wander: f64,
    /// Its covariance: xx, yy, yaw-yaw, xy.
    small: [f64; 4],
    /// Poses at which that covariance is outside. Many are only slightly outside, so a small error lets them through.
    outside: [[f64; 3]; 10],
    /// Diagonals of covariances that are too large at the good place.
    wide: [[f64; 3]; 5],
}

const APPROACH: Approach = match option_env!("POSEGATE_FAULT_TABLE") {
    None => DOCK,
    Some(name) => match name.as_bytes() {
        b"footprint" => FOOTPRINT,
        b"union" => UNION,
        _ => panic!("POSEGATE_FAULT_TABLE is footprint or union"),
    },
};

/// The dock allows 8 cm, 6 cm and 4 degrees; a small set extends to 1.7 cm and 1 degree.
const DOCK: Approach = Approach {
    table: include_bytes!("../tables/dock.posegate"),
    task: "dock",
    task_digest: task_digest("dd45d89b69c82c2f50ab8b974603f4c9f2ac254b3d9c7f82d2aa95c1b3de263c")
        .expect("64 digits"),
    good: [0.0, 0.0, 0.01],
    wander: 0.001,
    small: [2.5e-5, 2.5e-5, 2.7e-5, 4e-6],
    outside: [
        [0.3, 0.0, 0.0],
        [0.066, 0.01, 0.0],
        [-0.066, 0.0, 0.01],
        [0.0, -0.046, 0.0],
        [0.01, 0.046, 0.0],
        [0.0, 0.0, 0.058],
        [0.01, 0.01, -0.057],
        [0.03, 0.0, -0.3],
        [30.0, 0.0, 0.0],
        [f64::NAN, 0.0, 0.0],
    ],
    wide: [
        [0.04, 0.04, 0.001],
        [6.1e-4, 2e-5, 2e-5],
        [2e-5, 2.4e-4, 2e-5],
        [2e-5, 2e-5, 4.6e-4],
        [2e-5, 2.6e-4, 4.2e-4],
    ],
};

/// A robot that turns in a room of five walls: every facet is on a point that turns with it. Margins of what is outside are 0.9 to 0.97.
const FOOTPRINT: Approach = Approach {
    table: include_bytes!("../../tests/data/turning.posegate"),
    task: "turning",
    task_digest: task_digest("9db442beb0dc74389d3ac916422702ac5aaf82202ea294f107ec9bd8281bee94")
        .expect("64 digits"),
    good: [812.7062, -1203.4759, 2.7389],
    wander: 0.001,
    small: [0.002_922, 0.002_078, 0.01, 0.000_268],
    outside: [
        [812.1108, -1203.1486, 2.7389],
        [813.1688, -1203.7302, 2.7389],
        [812.3900, -1204.0511, 2.7389],
        [812.9614, -1203.0117, 2.7389],
        [812.1992, -1203.6232, 3.1123],
        [812.5249, -1202.8518, 2.2794],
        [812.8797, -1204.0730, 2.2993],
        [813.2690, -1203.3124, 3.1533],
        [812.1961, -1203.1955, 4.6792],
        [f64::NAN, 0.0, 0.0],
    ],
    wide: [
        [0.044_13, 0.031_38, 0.151],
        [0.055_06, 0.002_078, 0.01],
        [0.002_922, 0.060_57, 0.01],
        [0.046, 0.033, 0.16],
        [0.002_922, 0.038_85, 0.187],
    ],
};

/// A robot that passes the corner of an L: several pieces contain a good report's set together, none of them alone. Margins as above.
const UNION: Approach = Approach {
    table: include_bytes!("../../tests/data/corner.posegate"),
    task: "corner",
    task_digest: task_digest("bba9dd8354d2d19303bafddd8f35dce1396ab8d03d7943bb18cccf139bc442de")
        .expect("64 digits"),
    good: [-1250.6480, 939.9763, -1.281_07],
    wander: 0.000_2,
    small: [0.000_706, 0.002_294, 2.7e-5, 0.001_213],
    outside: [
        [-1250.5331, 939.5909, -1.2811],
        [-1250.6821, 940.0909, -1.2811],
        [-1250.0792, 940.1459, -1.2811],
        [-1250.7628, 939.9421, -1.2811],
        [-1250.2141, 939.7417, -0.9323],
        [-1250.8859, 939.5364, -1.6347],
        [-1250.3391, 940.5476, -1.7403],
        [-1250.7167, 940.0135, -1.2258],
        [-1250.5344, 939.5953, 0.0443],
        [f64::NAN, 0.0, 0.0],
    ],
    wide: [
        [0.000_929_1, 0.003_019, 3.553e-5],
        [0.000_947, 0.002_294, 2.7e-5],
        [0.000_706, 0.029_65, 2.7e-5],
        [0.000_706, 0.002_294, 0.003_006],
        [0.000_706, 0.029_64, 0.000_348_9],
    ],
};

pub static TABLE: &[u8] = APPROACH.table;

static SOURCES: [Source; 2] = [Source {
    frame: FrameId::of("map"),
    trust: Trust::FULL,
    aging: Aging::NONE,
    motion: MotionBounds::STANDS_STILL,
}; 2];

/// Short times, so that a permit is earned again within three cycles. In silence the hold time ends the
/// permit before its estimate is too old.
pub static SETTINGS: Settings<'static> = Settings {
    task: APPROACH.task,
    task_digest: APPROACH.task_digest,
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
    /// At one of the poses that are outside.
    At(usize),
    /// With one of the covariances that are too large.
    Covariance(usize),
    CovarianceOfZeros,
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
    At, Covariance, CovarianceOfZeros, Frame, FromTheFuture, Gap, Good, Late, NotPositiveDefinite,
    Nothing, OtherSource, StampBackwards, Stuck, UnknownSource,
};

const PLAN: [CycleEvent; 104] = [
    Good,
    Good,
    Good,
    Good, //
    At(0),
    Good,
    Good, //
    At(1),
    Good,
    Good, //
    At(2),
    Good,
    Good, //
    At(3),
    Good,
    Good, //
    At(4),
    Good,
    Good, //
    At(5),
    Good,
    Good, //
    At(6),
    Good,
    Good, //
    At(7),
    Good,
    Good, //
    At(8),
    Good,
    Good, //
    At(9),
    Good,
    Good, //
    Covariance(0),
    Good,
    Good, //
    Covariance(1),
    Good,
    Good, //
    Covariance(2),
    Good,
    Good, //
    Covariance(3),
    Good,
    Good, //
    Covariance(4),
    Good,
    Good, //
    CovarianceOfZeros,
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
    At(0),
    At(1),
    Good,
    At(3),
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
        let [x, y, yaw] = APPROACH.good;
        let [xx, yy, tt, xy] = APPROACH.small;
        let small = [xx, yy, tt];
        // At a different place each time.
        let place = [
            x + APPROACH.wander * ((k * 7 % 31) as f64),
            y - APPROACH.wander * ((k * 5 % 19) as f64),
            yaw,
        ];
        let mut says = belief(place, small, xy);
        // `true` if the gate evaluates the report's sequence and stamp, and stores them.
        let mut remembered = true;
        match PLAN[k] {
            Good | Nothing => {}
            Late(by) => stamp -= by,
            At(number) => says = belief(APPROACH.outside[number], small, xy),
            Covariance(number) => says = belief(APPROACH.good, APPROACH.wide[number], 0.0),
            CovarianceOfZeros => says = belief(APPROACH.good, [0.0; 3], 0.0),
            NotPositiveDefinite => says = belief(APPROACH.good, small, 1.2 * (xx + yy)),
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
