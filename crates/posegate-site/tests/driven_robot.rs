//! Promise P7 for a differential drive and an omnidirectional robot that are simulated for minutes, with times to a tenth of a millisecond.
//!
//! The simulation shares no derivation with the tracker: it never looks at a covariance, a path or a bound. Several true robots drive
//! what the odometry reports, each with errors that the settings allow, all against one wall: the pose at the fix on the border of
//! its ellipsoid, slip at its bound, noise of the wheels within the ellipsoid, true arcs, true times between whole milliseconds. The odometry is
//! rounded as drivers do: increments as floats, poses as in ROS, counts of two encoders; also with speeds whose rounding always errs to the same side.
//! Fixes come late. While the interlock is open, every true robot is inside, and so is every place that it can reach until the
//! permission ends.

use posegate::gate::{Gate, Reason, Restart, Settings, Source};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::{Aging, Estimate, RadiusSquared, Trust, Uncertainty};
use posegate::table::Table;
use posegate::track::{Increment, OdometryErrors, Tracker, TrackerSettings};
use posegate_site::Site;
use posegate_testkit::counts::{first_seed, is_deep};
use posegate_testkit::driven::{Found, driven};
use posegate_testkit::hall::{self, Believed, CORNERS, TO_WALL_M, WALLS};
use posegate_testkit::oracle::Rng;
use std::f64::consts::{PI, TAU};

/// A tool 3 m ahead and aside: where it is nearest to a wall, the circle of a wrong heading is farthest from its tangent.
const TOOL: [[f64; 2]; 3] = [[1.5, 2.6], [1.4, 2.6], [1.5, 2.5]];
/// A point, at every heading.
const POINT: [[f64; 2]; 1] = [[0.0, 0.0]];

/// Ticks of the simulation in a millisecond, and a tick in seconds.
const TICKS_PER_MS: u64 = 10;
const TICK_S: f64 = 1e-4;
/// The longest step of a true robot, ticks.
const LONGEST_STEP: u64 = 10;
/// True robots of each fix.
const ROBOTS: usize = 12;

/// How a driver reports what its wheels measured.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Driver {
    /// Increments as floats.
    Increments,
    /// Increments as floats, at speeds whose rounding to this unit (m) always errs ahead.
    Adverse { unit: f64 },
    /// Poses in the odometry's own frame, as in ROS, far from its origin.
    Poses,
    /// Whole counts of the left and the right wheel: metres in a count, metres between the wheels.
    Counts { count: f64, track: f64 },
}

/// A robot, its odometry, its source of fixes and its controller.
#[derive(Clone, Copy, Debug)]
struct Scene {
    is_omnidirectional: bool,
    /// The largest speed and turn rate of a command.
    speed: f64,
    rate: f64,
    driver: Driver,
    errors: OdometryErrors,
    /// Ticks between readings, and between control cycles.
    reading: u64,
    cycle: u64,
    fix_s: f64,
    oldest_fix_ms: u32,
    latency_ms: u32,
    /// The largest axes of a fix, metres and radians.
    sizes: [f64; 2],
    response_ms: u32,
    permit_hold_ms: u32,
    /// `true` if fixes have the times of readings.
    is_aligned: bool,
}

/// The sets of scenes, each about one cause.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cause {
    Mixed,
    Rounding,
    WideHeading,
    Arcs,
}

impl Scene {
    fn drawn(rng: &mut Rng, cause: Cause, radius: f64) -> Self {
        let mut maybe = |most: f64| {
            if rng.chance(0.3) {
                0.0
            } else {
                rng.log_within(0.05, 1.0) * most
            }
        };
        let mut errors = OdometryErrors {
            m_per_sqrt_m: maybe(0.03),
            rad_per_sqrt_rad: maybe(0.06),
            rad_per_sqrt_m: maybe(0.06),
            m_per_sqrt_s: maybe(0.005),
            rad_per_sqrt_s: maybe(0.01),
            slip: maybe(0.15),
            turn_slip: maybe(0.2),
            turn_slip_per_m: maybe(0.1),
        };
        let (mut speed, mut rate) = (rng.log_within(0.05, 1.2), rng.log_within(0.05, 1.5));
        let mut reading = rng.log_within(10.0, 400.0) as u64;
        let mut driver = Driver::Increments;
        let mut sizes = [0.05, 0.1];
        let (mut fix_s, mut oldest_s) = (rng.within(0.1, 2.0), 2.5);
        let is_omnidirectional = rng.chance(0.5);
        match cause {
            Cause::Mixed => {
                if rng.chance(0.3) {
                    driver = Driver::Poses;
                } else if !is_omnidirectional && rng.chance(0.5) {
                    let (count, track) = (rng.log_within(2e-6, 2e-4), rng.within(0.2, 0.8));
                    driver = Driver::Counts { count, track };
                    // A count that is off at once is within the noise of the first reading, three times.
                    let root = radius * (reading as f64 * TICK_S).sqrt();
                    errors.m_per_sqrt_s = 3.0 * count / root;
                    errors.rad_per_sqrt_s = 3.0 * count / track / root;
                }
            }
            Cause::Rounding => {
                errors = OdometryErrors {
                    m_per_sqrt_m: 2e-5,
                    ..OdometryErrors::NONE
                };
                let unit = if rng.chance(0.5) { 1e-6 } else { 1e-6 / 256.0 };
                (driver, reading) = (Driver::Adverse { unit }, 10);
                (speed, rate) = (rng.within(0.05, 0.2), 0.0);
                (fix_s, oldest_s) = (rng.within(5.0, 50.0), 60.0);
                sizes = [0.002, 0.003];
            }
            Cause::WideHeading => {
                sizes = [0.02, 2.8];
                (speed, rate) = (rng.within(0.2, 0.6), 0.0);
                fix_s = 10.0;
                errors = OdometryErrors {
                    m_per_sqrt_m: 1e-4,
                    ..OdometryErrors::NONE
                };
            }
            Cause::Arcs => {
                errors = OdometryErrors {
                    m_per_sqrt_m: 1e-5,
                    slip: rng.within(0.05, 0.25),
                    ..OdometryErrors::NONE
                };
                // Slow turns, so that a millisecond of a stamp is little beside the length of the arcs.
                reading = 5_000 + rng.below(15_000) as u64;
                rate = FRACTION * TAU / 8.0 / (reading as f64 * TICK_S);
                (speed, fix_s) = (rng.within(0.2, 0.6), rng.within(5.0, 20.0));
                oldest_s = 30.0;
                sizes = [0.002, 0.003];
            }
        }
        let cycle = TICKS_PER_MS * (1 + rng.below(8) as u64) + rng.below(7) as u64;
        Self {
            is_omnidirectional,
            speed,
            rate,
            driver,
            errors,
            reading,
            cycle,
            fix_s,
            oldest_fix_ms: (oldest_s * 1e3) as u32,
            latency_ms: if rng.chance(0.3) || cause == Cause::WideHeading {
                0
            } else {
                rng.below(300) as u32
            },
            sizes,
            is_aligned: cause != Cause::Mixed || rng.chance(0.3),
            response_ms: (cycle / TICKS_PER_MS) as u32 + 2 + rng.below(5) as u32,
            // For one reading, or from one to the next.
            permit_hold_ms: if cause != Cause::WideHeading && rng.chance(0.3) {
                1
            } else {
                ((reading + cycle) / TICKS_PER_MS) as u32 + 2
            },
        }
    }

    fn bounds(&self) -> MotionBounds {
        let [speed, rate] = self.fastest();
        let bounds = match self.is_omnidirectional {
            true => MotionBounds::in_any_direction(speed, rate),
            false => MotionBounds::new(speed, 0.0, rate),
        };
        bounds.expect("bounds")
    }

    /// The largest true speeds: errors come on top of commands.
    fn fastest(&self) -> [f64; 2] {
        [1.5 * self.speed + 0.01, 1.5 * self.rate + 0.01]
    }

    /// A command for the time up to the next: speeds ahead and to the left, turn rate.
    fn command(&self, rng: &mut Rng, at: [f64; 3]) -> [f64; 3] {
        let mut speed = rng.within(0.4, 1.0) * self.speed;
        // Ahead or back, to a place near a wall, not beyond.
        let to_middle = -(at[0] * at[2].cos() + at[1] * at[2].sin());
        let is_far = at[0].abs().max(at[1].abs()) > TO_WALL_M - 0.35;
        let is_back = if is_far {
            to_middle < 0.0
        } else {
            rng.chance(0.3)
        };
        let rate = rng.within(0.3, 1.0) * self.rate * if rng.chance(0.5) { 1.0 } else { -1.0 };
        if let Driver::Adverse { unit } = self.driver {
            // What a reading adds is just below a half above a whole unit.
            let step = (speed * self.reading as f64 * TICK_S / unit).round();
            let step = if is_back { -step } else { step } + 0.4999;
            return [step * unit / (self.reading as f64 * TICK_S), 0.0, 0.0];
        }
        if is_back {
            speed = -speed;
        }
        if self.is_omnidirectional {
            let aside = rng.within(-0.7, 0.7);
            return [speed * f64::cos(aside), speed * f64::sin(aside), rate];
        }
        [speed, 0.0, rate]
    }
}

/// The share of an eighth of a turn that an increment turns at most here.
const FRACTION: f64 = 0.99;

/// The movement by constant speeds for a time, in the axes at its start: an arc.
fn arc([ahead, left, rate]: [f64; 3], seconds: f64) -> [f64; 3] {
    let turn = rate * seconds;
    let (along, across) = if turn.abs() < 1e-9 {
        (seconds, 0.5 * turn * seconds)
    } else {
        (turn.sin() / rate, (1.0 - turn.cos()) / rate)
    };
    [
        ahead * along - left * across,
        ahead * across + left * along,
        turn,
    ]
}

fn moved([x, y, yaw]: [f64; 3], [ahead, left, turn]: [f64; 3]) -> [f64; 3] {
    let (s, c) = yaw.sin_cos();
    [
        x + c * ahead - s * left,
        y + s * ahead + c * left,
        yaw + turn,
    ]
}

/// The driver's memory.
struct Reporter {
    driver: Driver,
    /// The odometry's pose, of which only differences are reported.
    pose: [f64; 3],
    /// Metres that each wheel has rolled.
    wheels: [f64; 2],
}

impl Reporter {
    /// Returns the reported movement of a reading.
    fn read(&mut self, twist: [f64; 3], seconds: f64) -> [f64; 3] {
        let by = arc(twist, seconds);
        match self.driver {
            Driver::Increments | Driver::Adverse { .. } => by,
            Driver::Poses => {
                let before = self.pose;
                self.pose = moved(before, by);
                let [dx, dy] = [self.pose[0] - before[0], self.pose[1] - before[1]];
                let (s, c) = before[2].sin_cos();
                let turn = self.pose[2] - before[2];
                self.pose[2] -= TAU * (self.pose[2] / TAU).round();
                [c * dx + s * dy, c * dy - s * dx, turn]
            }
            Driver::Counts { count, track } => {
                let counted = |rolled: f64| (rolled / count).floor() * count;
                let before = self.wheels.map(counted);
                let [ahead, _, rate] = twist;
                for (wheel, side) in self.wheels.iter_mut().zip([-1.0, 1.0]) {
                    *wheel += (ahead + side * 0.5 * track * rate) * seconds;
                }
                let after = self.wheels.map(counted);
                let [left, right] = [after[0] - before[0], after[1] - before[1]];
                let rolled = 0.5 * (left + right) / seconds;
                arc([rolled, 0.0, (right - left) / track / seconds], seconds)
            }
        }
    }
}

/// A true robot: it drives what the odometry reports, with errors of its own.
#[derive(Clone, Copy, Debug)]
struct Robot {
    pose: [f64; 3],
    /// The direction of its slip and of the noise of its place.
    wall: [f64; 2],
    /// The side of its turn's slip and noise.
    side: f64,
    /// The shares of the radius that the noise of its heading and of its place have, and the variances for which they last.
    noise: [f64; 2],
    lasts: [f64; 2],
    used: [f64; 2],
    /// Whether the noise is largest at first.
    is_early: bool,
}

impl Robot {
    fn drawn(rng: &mut Rng, set: &Believed, scene: &Scene, radius: f64) -> Self {
        let wall = WALLS[rng.below(4)];
        let along = |column: usize| wall[0] * set.x[column] + wall[1] * set.y[column];
        // On the border: an error of the heading, and in the plane towards the wall.
        let u = [-1.0, 1.0, -0.7, 0.7, 0.0, rng.within(-1.0, 1.0)][rng.below(6)];
        let rest = f64::sqrt(1.0 - f64::powi(u, 2));
        let length = along(1).hypot(along(2)).max(1e-12);
        let share: f64 = [1.0, 0.8, 0.0][rng.below(3)];
        // Counts use the noise up.
        let (share, left) = match scene.driver {
            Driver::Counts { .. } => (0.8, 0.0),
            _ => (share, (1.0 - share * share).sqrt()),
        };
        let axes = [u, rest * along(1) / length, rest * along(2) / length].map(|v| v * share);
        let row = |row: [f64; 3]| row.iter().zip(axes).map(|(a, b)| a * b).sum::<f64>();
        let part = rng.within(0.0, 1.0);
        let lasts_s = rng.within(0.2, 3.0) * scene.fix_s;
        let e = &scene.errors;
        let square = |v: f64| v * v;
        Self {
            pose: [
                set.mean[0] + row(set.x),
                set.mean[1] + row(set.y),
                set.mean[2] + set.turn * axes[0],
            ],
            wall,
            side: if rng.chance(0.5) { 1.0 } else { -1.0 },
            noise: [part.sqrt(), (1.0 - part).sqrt()].map(|v| v * left * radius),
            lasts: [
                lasts_s
                    * (square(e.rad_per_sqrt_m) * scene.speed
                        + square(e.rad_per_sqrt_rad) * scene.rate
                        + square(e.rad_per_sqrt_s)),
                lasts_s * (square(e.m_per_sqrt_m) * scene.speed + square(e.m_per_sqrt_s)),
            ],
            used: [0.0; 2],
            is_early: rng.chance(0.5),
        }
    }

    /// Drives for a short time what is reported as a twist: along an arc, with errors that do not change meanwhile.
    fn drive(&mut self, [ahead, left, rate]: [f64; 3], errors: &OdometryErrors, seconds: f64) {
        let speed = ahead.hypot(left);
        let square = |v: f64| v * v;
        let variances = [
            square(errors.rad_per_sqrt_m) * speed
                + square(errors.rad_per_sqrt_rad) * rate.abs()
                + square(errors.rad_per_sqrt_s),
            square(errors.m_per_sqrt_m) * speed + square(errors.m_per_sqrt_s),
        ];
        let mut off = [0.0; 2];
        for k in 0..2 {
            let variance = variances[k] * seconds;
            if variance > 0.0 && self.used[k] + variance <= self.lasts[k] {
                // In the middle: the sum of squares is below their integral.
                let at = (self.used[k] + 0.5 * variance) / self.lasts[k];
                let weight = if self.is_early {
                    3f64.sqrt() * (1.0 - at)
                } else {
                    1.0
                };
                off[k] = self.noise[k] * weight * variance / self.lasts[k].sqrt();
                self.used[k] += variance;
            }
        }
        let velocity = |heading: f64| {
            let (s, c) = heading.sin_cos();
            [c * ahead - s * left, s * ahead + c * left]
        };
        // The share is of the longer of the true and the reported movement.
        let share = errors.slip;
        let slip_at = |heading: f64| {
            let [x, y] = velocity(heading);
            let towards = x * self.wall[0] + y * self.wall[1];
            let of_true = (share * share * towards
                + share * (square(share * towards) + (1.0 - share * share) * speed * speed).sqrt())
                / (1.0 - share * share);
            of_true.max(share * speed)
        };
        let slip = match share {
            0.0 => 0.0,
            _ => slip_at(self.pose[2]).min(slip_at(self.pose[2] + rate * seconds)),
        };
        // Along an arc, its chord.
        let chord = |turn: f64| 1.0 - square(turn) / 24.0;
        let [x, y] = velocity(self.pose[2] + 0.5 * rate * seconds);
        let driven = speed.max((x + slip * self.wall[0]).hypot(y + slip * self.wall[1]));
        let per_metre = errors.turn_slip_per_m * driven;
        let turned = if self.side * rate > 0.0 {
            (errors.turn_slip * rate.abs() + per_metre) / (1.0 - errors.turn_slip)
        } else {
            errors.turn_slip * rate.abs() + per_metre
        };
        let turn = (rate + self.side * turned) * seconds + self.side * off[0];
        let [x, y] = velocity(self.pose[2] + 0.5 * turn);
        let away = slip * seconds + off[1];
        self.pose = [
            self.pose[0] + x * seconds * chord(turn) + away * self.wall[0],
            self.pose[1] + y * seconds * chord(turn) + away * self.wall[1],
            self.pose[2] + turn,
        ];
    }
}

/// A fix on its way or in use, with the true robots that agree with it.
#[derive(Clone, Debug)]
struct Fix {
    tick: u64,
    arrives: u64,
    set: Believed,
    robots: Vec<Robot>,
    /// The tick of the newest reading, at which the robots are.
    newest: u64,
}

impl Fix {
    /// Drives the robots to a tick, as a twist is reported.
    fn drive_to(&mut self, now: u64, twist: [f64; 3], errors: &OdometryErrors) {
        while self.newest < now {
            let ticks = LONGEST_STEP.min(now - self.newest);
            self.newest += ticks;
            for robot in &mut self.robots {
                robot.drive(twist, errors, ticks as f64 * TICK_S);
            }
        }
    }
}

/// The largest distance of any corner of any robot beyond any wall, after a movement at the largest speeds for a time, or `least` if that is
/// larger: in any direction, or along the robot's axis.
fn beyond(poses: &[[f64; 3]], hall: &Hall, scene: &Scene, seconds: f64, least: f64) -> f64 {
    let [length, swing] = scene.fastest().map(|speed| speed * seconds);
    let mut most = least;
    for pose in poses {
        for share in [-1.0, -0.5, 0.0, 0.5, 1.0] {
            let (s, c) = (pose[2] + share * swing).sin_cos();
            for wall in WALLS {
                let ahead = |[vx, vy]: &[f64; 2]| {
                    let tip = [pose[0] + c * vx - s * vy, pose[1] + s * vx + c * vy];
                    wall[0] * tip[0] + wall[1] * tip[1] - hall.to_wall_m
                };
                let out = hall.corners.iter().map(ahead).fold(f64::MIN, f64::max);
                if out + length > most {
                    let driven = match scene.is_omnidirectional {
                        true => length,
                        false => hall::farthest(wall, length, swing, [pose[2], share]),
                    };
                    most = most.max(out + driven);
                }
            }
        }
    }
    most
}

/// A robot in a hall, and its table.
struct Hall {
    bytes: Vec<u8>,
    corners: &'static [[f64; 2]],
    to_wall_m: f64,
}

impl Hall {
    fn of(cause: Cause) -> Self {
        let (success, corners, to_wall_m): (_, &[_], _) = match cause {
            Cause::Mixed | Cause::Rounding => (hall::SUCCESS, &CORNERS, TO_WALL_M),
            Cause::WideHeading => (
                "{ shape = \"footprint\", footprint = [[1.5, 2.6], [1.4, 2.6], [1.5, 2.5]], region = [[8, 8], [-8, 8], [-8, -8], [8, -8]] }",
                &TOOL,
                8.0,
            ),
            Cause::Arcs => (
                "{ shape = \"box\", x = [-2.0, 2.0], y = [-2.0, 2.0], yaw_deg = [-180.0, 180.0] }",
                &POINT,
                TO_WALL_M,
            ),
        };
        let text = format!(
            "\n[task.hall]\nkind = \"work\"\ngoal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}\nsuccess = {success}\n"
        );
        let site = Site::parse(&text, "site.toml").expect("a site");
        Self {
            bytes: hall::facets(&site, "hall", to_wall_m + 1.0),
            corners,
            to_wall_m,
        }
    }
}

/// Simulates one scene.
fn simulate(rng: &mut Rng, cause: Cause, hall: &Hall, found: &mut Found) {
    let bytes = &hall.bytes;
    let table = Table::parse(bytes).expect("a table");
    let q16 = table.radius_squared().q16();
    let radius = (f64::from(q16) / 65_536.0).sqrt();
    let scene = Scene::drawn(rng, cause, radius);
    let sources = [Source {
        frame: FrameId::of("map"),
        trust: Trust::FULL,
        aging: Aging::NONE,
        motion: scene.bounds(),
    }];
    let reading_ms = (scene.reading / TICKS_PER_MS) as u32 + 1;
    let settings = Settings {
        task: "hall",
        task_digest: table.task_digest(),
        sources: &sources,
        maximum_age_ms: 3 * reading_ms + scene.response_ms + 20,
        response_ms: scene.response_ms,
        report_period_ms: 1,
        permit_hold_ms: scene.permit_hold_ms,
        inhibit_hold_ms: 1,
        permits_in_a_row: 1,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: None,
    };
    let mut tracker = Tracker::<512>::new(TrackerSettings {
        errors: scene.errors,
        bounds: scene.bounds(),
        trust: Trust::FULL,
        radius_squared: RadiusSquared::from_q16(q16).expect("of a table"),
        maximum_gap_ms: 3 * reading_ms,
        maximum_fix_age_ms: scene.oldest_fix_ms,
    })
    .expect("settings");
    // Near the wrap of the clock; ticks begin between two milliseconds.
    let start = u32::MAX - rng.below(3_000) as u32;
    let first = rng.below(10) as u64;
    let clock = |tick: u64| start.wrapping_add((tick / TICKS_PER_MS) as u32);
    let mut gate = Gate::new(bytes, &settings, clock(first)).expect("settings");
    let mut reporter = Reporter {
        driver: scene.driver,
        pose: [rng.within(-300.0, 300.0), rng.within(-300.0, 300.0), 0.0],
        wheels: [0.0; 2],
    };
    // A robot that drives little starts near a wall.
    let off = if cause == Cause::Arcs { 1.9 } else { 1.0 };
    let mut at = [
        rng.within(-off, off),
        rng.within(-off, off),
        rng.within(-PI, PI),
    ];
    if cause == Cause::WideHeading {
        // Away from a wall that the tool nearly reaches.
        let wall = WALLS[rng.below(4)];
        let way = hall.to_wall_m - 3.0 - rng.within(0.0, 1.5);
        let heading = wall[1].atan2(wall[0]) - rng.within(3.2, 3.8);
        at = [way * wall[0], way * wall[1], heading];
    }
    let mut twist = scene.command(rng, at);
    let (mut now, mut read_at) = (first, first);
    let still = Increment::of(0.0, 0.0, 0.0, [clock(first); 2]).expect("no movement");
    let _ = tracker.odometry(still);
    let lasts_s = match cause {
        Cause::WideHeading => 2.6,
        _ => scene.fix_s * rng.within(3.0, 40.0),
    };
    let ends = first + (lasts_s.min(120.0) / TICK_S) as u64;
    let mut next_fix = first + rng.below(200) as u64;
    let mut next_cycle = first + 1;
    let (mut coming, mut current): (Option<Fix>, Option<Fix>) = (None, None);
    let mut permitted: Option<(Vec<[f64; 3]>, u64)> = None;
    let (mut sequence, mut is_open, mut is_broken) = (0, false, None);
    while now < ends {
        now += 1;
        if now - read_at >= scene.reading {
            let seconds = (now - read_at) as f64 * TICK_S;
            at = moved(at, arc(twist, seconds));
            let by = reporter.read(twist, seconds);
            let span = [clock(read_at), clock(now)];
            let increment = Increment::of(by[0], by[1], by[2], span).expect("a short path");
            if let Err(reason) = tracker.odometry(increment) {
                is_broken = Some(reason);
                (coming, current) = (None, None);
            }
            read_at = now;
            for fix in coming.iter_mut().chain(current.as_mut()) {
                fix.drive_to(now, twist, &scene.errors);
            }
            let seconds = scene.reading as f64 * TICK_S;
            // A wrong heading on a straight path needs no other command.
            let is_free = cause == Cause::WideHeading;
            let is_off = at[0].abs().max(at[1].abs()) > TO_WALL_M + 0.3;
            if !is_free && (is_off || rng.chance((seconds * 1.5).min(0.5))) {
                twist = scene.command(rng, at);
            }
        }
        let is_due = now >= next_fix && (now == read_at || !scene.is_aligned);
        if is_due && coming.is_none() {
            let mut set = Believed::drawn(rng, scene.sizes);
            if cause == Cause::WideHeading {
                set.turn = rng.within(2.0, scene.sizes[1]);
            }
            // The pose that the odometry's path passes is one of the set.
            let at = moved(at, arc(twist, (now - read_at) as f64 * TICK_S));
            let off = [0; 3].map(|_| rng.within(-0.5, 0.5));
            let row = |row: [f64; 3]| row.iter().zip(off).map(|(a, b)| a * b).sum::<f64>();
            set.mean = [
                at[0] + row(set.x),
                at[1] + row(set.y),
                at[2]
                    + set.turn
                        * off[0]
                        * if cause == Cause::WideHeading {
                            0.0
                        } else {
                            1.0
                        },
            ];
            let robots: Vec<Robot> = (0..ROBOTS)
                .map(|_| Robot::drawn(rng, &set, &scene, radius))
                .collect();
            coming = Some(Fix {
                tick: now,
                arrives: now
                    + TICKS_PER_MS * u64::from(rng.below(scene.latency_ms as usize + 1) as u32),
                set,
                robots,
                newest: now,
            });
            next_fix = now + (scene.fix_s * rng.within(0.3, 1.7) / TICK_S) as u64;
        }
        if now < next_cycle {
            continue;
        }
        next_cycle = now + scene.cycle;
        if let Some(fix) = coming.take_if(|fix| fix.arrives <= now) {
            let [x_m, y_m, yaw_rad] = fix.set.mean;
            sequence += 1;
            let report = Report {
                source: 0,
                frame: FrameId::of("map"),
                sequence,
                stamp_ms: clock(fix.tick),
                belief: PoseEstimate::new(
                    Estimate { x_m, y_m, yaw_rad },
                    Uncertainty::Gaussian(fix.set.covariance(radius * radius)),
                ),
            };
            if tracker.fix(&report).is_ok() {
                found.late += u64::from(fix.tick < read_at);
                current = Some(fix);
            }
        }
        let step = match (is_broken.take(), tracker.tracked(clock(now))) {
            (Some(reason), _) => gate.inhibit(clock(now), reason),
            (None, Ok(tracked)) => {
                let step = gate.step_on(clock(now), &tracked.evidence());
                if step.verdict.is_ok()
                    && let Some(fix) = &current
                {
                    let poses = fix.robots.iter().map(|robot| robot.pose).collect();
                    permitted = Some((poses, fix.newest));
                }
                step
            }
            (None, Err(Reason::Silent)) => gate.tick(clock(now)),
            (None, Err(reason)) => gate.inhibit(clock(now), reason),
        };
        let was_open = std::mem::replace(&mut is_open, step.permission.is_permit());
        if !is_open {
            continue;
        }
        found.openings += u64::from(!was_open);
        let (poses, stamp) = permitted.as_ref().expect("an open gate has permitted");
        // Valid until the output has followed the next answer.
        let seconds = (now - stamp) as f64 * TICK_S + f64::from(scene.response_ms) * 1e-3;
        let least = (found.least_um as f64 * -1e-6).min(0.0);
        let beyond = beyond(poses, hall, &scene, seconds, least);
        if found.note(beyond) {
            eprintln!(
                "{cause:?}: {beyond} m beyond after {} s: {scene:?}",
                (now - first) as f64 * TICK_S
            );
        }
    }
}

/// Searches a cause for a number of openings, in the deep job and in the fast suite: nothing is outside, and robots come near to the walls.
fn holds(cause: Cause, [deep, fast]: [u64; 2], near_um: i64) {
    let openings = if is_deep() { deep } else { fast };
    let hall = Hall::of(cause);
    let found = driven(openings, first_seed(), |rng, found| {
        simulate(rng, cause, &hall, found);
    });
    assert_eq!(found.outside, 0, "{found:?}");
    assert!(found.moments > found.openings, "{found:?}");
    assert!(found.late > 0 || cause == Cause::Arcs, "{found:?}");
    assert!(found.least_um < near_um, "{found:?}");
}

// A million openings in all.

#[test]
fn simulated_robots_are_inside_while_interlock_is_open() {
    holds(Cause::Mixed, [900_000, 1_500], 20_000);
}

#[test]
fn rounding_at_a_thousand_increments_a_second_is_counted() {
    holds(Cause::Rounding, [80_000, 100], 5_000);
}

#[test]
fn fix_with_wide_heading_is_carried_with_its_curvature() {
    holds(Cause::WideHeading, [10_000, 100], 300_000);
}

#[test]
fn slip_along_wide_arcs_is_that_of_their_length() {
    holds(Cause::Arcs, [10_000, 100], 100_000);
}
