//! Promise P7 for a robot whose fixes are carried along its odometry ([`posegate::track`]). At every moment at which
//! the interlock is open, every possible pose of the robot, and every pose that it can reach until the permission
//! ends, is in the success set.
//!
//! The judge shares no code with the tracker or the gate. At each open moment it searches a history that agrees with
//! all reports and that ends as near to a wall as possible. A history has a true pose within the ellipsoid of the fix
//! and increments whose noise is within the same ellipsoid (all deviations together have at most the length of the
//! table's radius). Its slip is at its bound, in the worst direction in each increment. The judge drives that history
//! in plain floats, without any linearisation. Fixes come late, between two increments, before the odometry of their
//! time, or not at all.

use posegate::gate::{Gate, Reason, Restart, Settings, Source};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::{Aging, Estimate, RadiusSquared, Trust, Uncertainty};
use posegate::table::Table;
use posegate::track::{Increment, OdometryErrors, Tracker, TrackerSettings};
use posegate_testkit::counts::{first_seed, is_deep};
use posegate_testkit::driven::{Found, driven};
use posegate_testkit::hall::{self, Believed, CORNERS, TO_WALL_M, WALLS};
use posegate_testkit::oracle::Rng;

/// The largest axes of a fix's ellipsoid, metres and radians.
const SIZES: [f64; 2] = [0.05, 0.1];

/// A robot, its odometry, its source of fixes and its controller.
#[derive(Clone, Copy, Debug)]
struct Drive {
    speed: f64,
    rate: f64,
    errors: OdometryErrors,
    odometry_ms: u32,
    fix_ms: u32,
    latency_ms: u32,
    cycle_ms: u32,
    response_ms: u32,
    permit_hold_ms: u32,
    /// `true` if the controller evaluates the carried fix in every cycle, `false` if only after new data.
    evaluates_every_cycle: bool,
}

impl Drive {
    fn drawn(rng: &mut Rng) -> Self {
        let odometry_ms = 5 + rng.below(40) as u32;
        let cycle_ms = 1 + rng.below(8) as u32;
        let maybe = |rng: &mut Rng, most: f64| {
            if rng.chance(0.3) {
                0.0
            } else {
                rng.log_within(0.05, 1.0) * most
            }
        };
        Self {
            speed: rng.log_within(0.05, 1.2),
            rate: maybe(rng, 1.5),
            errors: OdometryErrors {
                m_per_sqrt_m: maybe(rng, 0.03),
                rad_per_sqrt_rad: maybe(rng, 0.06),
                rad_per_sqrt_m: maybe(rng, 0.06),
                m_per_sqrt_s: maybe(rng, 0.005),
                rad_per_sqrt_s: maybe(rng, 0.01),
                slip: maybe(rng, 0.15),
                turn_slip: maybe(rng, 0.2),
                turn_slip_per_m: maybe(rng, 0.1),
            },
            odometry_ms,
            fix_ms: 50 + rng.below(2_000) as u32,
            latency_ms: if rng.chance(0.3) {
                0
            } else {
                rng.below(600) as u32
            },
            cycle_ms,
            response_ms: cycle_ms + 1 + rng.below(5) as u32,
            // May end before the next odometry: then all of it is used.
            permit_hold_ms: 1 + rng.below(2 * odometry_ms as usize) as u32,
            evaluates_every_cycle: rng.chance(0.3),
        }
    }

    fn bounds(&self) -> MotionBounds {
        MotionBounds::new(self.speed, 0.0, self.rate).expect("bounds")
    }
}

/// An increment as it was read: metres ahead and to the left, radians; and its stamps, milliseconds.
#[derive(Clone, Copy, Debug)]
struct Read {
    by: [f64; 3],
    from_ms: u32,
    to_ms: u32,
}

/// A fix: its stamp, its arrival, and its set.
#[derive(Clone, Copy, Debug)]
struct Fix {
    stamp_ms: u32,
    comes_ms: u32,
    set: Believed,
}

impl Fix {
    /// Returns a fix of a robot that is somewhere about a pose.
    fn drawn(rng: &mut Rng, stamp_ms: u32, about: [f64; 3], drive: &Drive) -> Self {
        let mut set = Believed::drawn(rng, SIZES);
        let off = [0; 3].map(|_| rng.within(-0.5, 0.5));
        let row = |row: [f64; 3]| row.iter().zip(off).map(|(a, b)| a * b).sum::<f64>();
        set.mean = [
            about[0] + row(set.x),
            about[1] + row(set.y),
            about[2] + set.turn * off[0],
        ];
        Self {
            stamp_ms,
            comes_ms: stamp_ms + rng.below(drive.latency_ms as usize + 1) as u32,
            set,
        }
    }
}

/// One moment of a history: the increment, the part of it after the fix, and its deviations (place on each axis,
/// turn).
#[derive(Clone, Copy, Debug)]
struct Moment {
    by: [f64; 3],
    deviations: [f64; 2],
    slips: [f64; 2],
}

/// The reports to the tracker, up to the permitted one.
struct Evidence<'a> {
    fix: Fix,
    reads: &'a [Read],
    drive: &'a Drive,
    radius: f64,
}

impl Evidence<'_> {
    /// The increments since the fix. `part` is the share of the first increment that was driven after the fix, within
    /// the possible range.
    fn moments(&self, part: f64) -> Vec<Moment> {
        let errors = &self.drive.errors;
        let since = self
            .reads
            .iter()
            .filter(|read| read.to_ms > self.fix.stamp_ms);
        let moment = |read: &Read| {
            let passed = f64::from(read.to_ms - read.from_ms) * 1e-3;
            let before = f64::from(self.fix.stamp_ms.saturating_sub(read.from_ms)) * 1e-3;
            // Within the increment the robot may have driven unevenly, also back and forth: before and after the fix
            // as far as its speed allows, with the reported sum.
            let share = |length: f64, fastest: f64| {
                if before > 0.0 && length > 0.0 {
                    let [first, second] = [before, passed - before].map(|s| fastest * s / length);
                    let most = second.min(1.0 + first);
                    let least = (1.0 - first).max(-second);
                    least + part * (most - least).max(0.0)
                } else {
                    1.0
                }
            };
            let length = read.by[0].hypot(read.by[1]);
            let driven = share(length, self.drive.speed);
            let turned = share(read.by[2].abs(), self.drive.rate);
            let by = [
                driven * read.by[0],
                driven * read.by[1],
                turned * read.by[2],
            ];
            let (length, turn) = (by[0].hypot(by[1]), by[2].abs());
            let seconds = (passed - before).max(0.0);
            let square = |value: f64| value * value;
            let plane =
                square(errors.m_per_sqrt_m) * length + square(errors.m_per_sqrt_s) * seconds;
            let heading = square(errors.rad_per_sqrt_rad) * turn
                + square(errors.rad_per_sqrt_m) * length
                + square(errors.rad_per_sqrt_s) * seconds;
            // If only part of an increment counts, its noise is that of the share of its time.
            let noise = if before > 0.0 { 0.0 } else { self.radius };
            Moment {
                by,
                deviations: [noise * plane.sqrt(), noise * heading.sqrt()],
                slips: [
                    errors.slip * length,
                    errors.turn_slip * turn + errors.turn_slip_per_m * length,
                ],
            }
        };
        since.map(moment).collect()
    }

    /// The largest distance of a corner beyond a wall, metres; negative if it cannot reach the wall. The history that
    /// leads there is driven exactly.
    fn beyond(
        &self,
        (moments, places): (&[Moment], &[[f64; 3]]),
        [wall, corner]: [[f64; 2]; 2],
        ends_s: f64,
    ) -> f64 {
        let set = &self.fix.set;
        let pose = *places.last().expect("the fix is the first");
        let tip = |pose: [f64; 3]| {
            let (s, c) = pose[2].sin_cos();
            let [vx, vy] = corner;
            [pose[0] + c * vx - s * vy, pose[1] + s * vx + c * vy]
        };
        let end = tip(pose);
        // The movement of the corner towards the wall by a turn about a place, metres per radian.
        let lever = |at: [f64; 3]| wall[1] * (end[0] - at[0]) - wall[0] * (end[1] - at[1]);
        // The direction of all deviations together that moves the corner farthest.
        let along = |column: usize| wall[0] * set.x[column] + wall[1] * set.y[column];
        let first = [along(0) + lever(set.mean) * set.turn, along(1), along(2)];
        let mut square: f64 = first.iter().map(|v| v * v).sum();
        let mut slipped = 0.0;
        for (moment, place) in moments.iter().zip(&places[1..]) {
            let [plane, heading] = moment.deviations;
            let swing = lever(*place);
            square += plane * plane + (heading * swing).powi(2);
            slipped += moment.slips[0] + moment.slips[1] * swing.abs();
        }
        let length = square.sqrt().max(1e-12);
        let reach = self.drive.speed * ends_s;
        let swing = self.drive.rate * ends_s;
        // If the wall is out of reach, the exact history need not be driven.
        let linear = wall[0] * end[0] + wall[1] * end[1] + length + slipped + reach + 0.5 * swing;
        if linear < TO_WALL_M - 0.2 {
            return linear - TO_WALL_M;
        }
        let u = first.map(|v| v / length);
        let row = |row: [f64; 3]| row.iter().zip(u).map(|(a, b)| a * b).sum::<f64>();
        let mut pose = [
            set.mean[0] + row(set.x),
            set.mean[1] + row(set.y),
            set.mean[2] + set.turn * u[0],
        ];
        for (moment, place) in moments.iter().zip(&places[1..]) {
            let [plane, heading] = moment.deviations;
            let [slip, turn_slip] = moment.slips;
            let swing = lever(*place);
            let towards = plane * plane / length + slip;
            let turned = heading * heading * swing / length + turn_slip * swing.signum();
            pose = moved(pose, moment.by);
            pose = [
                pose[0] + wall[0] * towards,
                pose[1] + wall[1] * towards,
                pose[2] + turned,
            ];
        }
        // Until the permission ends it drives along its axis towards the wall, with any turn.
        let shares = [-1.0, -0.5, 0.0, 0.5, 1.0].into_iter();
        let ends = shares.map(|share| {
            let [x, y] = tip([pose[0], pose[1], pose[2] + share * swing]);
            wall[0] * x + wall[1] * y + hall::farthest(wall, reach, swing, [pose[2], share])
        });
        ends.fold(f64::NEG_INFINITY, f64::max) - TO_WALL_M
    }

    /// The largest distance of the robot beyond any wall at the end of the permission, metres.
    fn worst(&self, ends_s: f64) -> f64 {
        let mut worst = f64::NEG_INFINITY;
        for part in [0.0, 1.0] {
            let moments = self.moments(part);
            // The path as it was read.
            let mut places = vec![self.fix.set.mean];
            for moment in &moments {
                places.push(moved(places[places.len() - 1], moment.by));
            }
            for wall in WALLS {
                for corner in CORNERS {
                    let path = (moments.as_slice(), places.as_slice());
                    worst = worst.max(self.beyond(path, [wall, corner], ends_s));
                }
            }
        }
        worst
    }
}

fn moved([x, y, yaw]: [f64; 3], [ahead, left, turn]: [f64; 3]) -> [f64; 3] {
    let (s, c) = yaw.sin_cos();
    [
        x + c * ahead - s * left,
        y + s * ahead + c * left,
        yaw + turn,
    ]
}

/// Drives with a tracker whose odometry errors are `stated(drive)`.
fn drive(
    rng: &mut Rng,
    bytes: &[u8],
    stated: impl Fn(&Drive) -> OdometryErrors,
    found: &mut Found,
) {
    let table = Table::parse(bytes).expect("a table");
    let q16 = table.radius_squared().q16();
    let radius = (f64::from(q16) / 65_536.0).sqrt();
    let drive = Drive::drawn(rng);
    let sources = [Source {
        frame: FrameId::of("map"),
        trust: Trust::FULL,
        aging: Aging::NONE,
        motion: drive.bounds(),
    }];
    let settings = Settings {
        task: "hall",
        task_digest: table.task_digest(),
        sources: &sources,
        maximum_age_ms: 3 * drive.odometry_ms + drive.response_ms + 20,
        response_ms: drive.response_ms,
        report_period_ms: 1,
        permit_hold_ms: drive.permit_hold_ms,
        inhibit_hold_ms: 1,
        permits_in_a_row: 1 + rng.below(2) as u16,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: None,
    };
    let tracker = TrackerSettings {
        errors: stated(&drive),
        bounds: drive.bounds(),
        trust: Trust::FULL,
        radius_squared: RadiusSquared::from_q16(q16).expect("of a table"),
        maximum_gap_ms: 3 * drive.odometry_ms,
        maximum_fix_age_ms: 2_500,
    };
    let mut tracker = Tracker::<128>::new(tracker).expect("settings");
    // Near the wrap of the clock.
    let start = u32::MAX - rng.below(3_000) as u32;
    let mut gate = Gate::new(bytes, &settings, start).expect("settings");
    // The robot drives towards a wall by its odometry, from a place with some slack.
    let speed = rng.within(0.3, 0.95) * drive.speed;
    let rate = rng.within(-0.9, 0.9) * drive.rate;
    let towards = rng.within(-3.1, 3.1);
    let slack = rng.within(0.0, 2.0) * speed;
    let set = Believed::drawn(rng, SIZES);
    let Some(set) = set.placed(towards, slack, 0.0, 0.0) else {
        return;
    };
    let mut at = set.mean;
    let ahead = if f64::cos(at[2] - towards) < 0.0 {
        -speed
    } else {
        speed
    };
    let mut reads: Vec<Read> = Vec::new();
    let mut fixes: Vec<Fix> = Vec::new();
    let (mut now_ms, mut next_fix) = (0u32, 3 + rng.below(30) as u32);
    let mut newest_ms = 0;
    // A fix with the exact stamp of the next odometry.
    let mut with_next = false;
    let _ = tracker.odometry(Increment::of(0.0, 0.0, 0.0, [start; 2]).expect("no movement"));
    let mut current: Option<Fix> = None;
    // The newest permitted evidence: the fix, the number of increments, and the stamp.
    let mut permitted: Option<(Fix, usize, u32)> = None;
    let mut is_open = false;
    while now_ms < 3_500 {
        now_ms += 1 + rng.below(drive.cycle_ms as usize) as u32;
        // Between two readings the robot moves evenly.
        while next_fix <= now_ms {
            if rng.chance(0.3) {
                with_next = true;
            } else if rng.chance(0.85) {
                let seconds = f64::from(next_fix - newest_ms) * 1e-3;
                let then = moved(at, [ahead * seconds, 0.0, rate * seconds]);
                fixes.push(Fix::drawn(rng, next_fix, then, &drive));
            }
            next_fix += 1 + rng.below(2 * drive.fix_ms as usize) as u32;
        }
        let (mut step, mut is_news) = (None, drive.evaluates_every_cycle);
        if now_ms - newest_ms >= drive.odometry_ms && !rng.chance(0.05) {
            let seconds = f64::from(now_ms - newest_ms) * 1e-3;
            // In whole micrometres, as a controller reads it.
            let um = |metres: f64| (metres * 1e6).round() * 1e-6;
            let by = [um(ahead * seconds), 0.0, rate * seconds];
            let stamp = start.wrapping_add(now_ms);
            let span = [start.wrapping_add(newest_ms), stamp];
            let increment = Increment::of(by[0], by[1], by[2], span).expect("a short path");
            if let Err(reason) = tracker.odometry(increment) {
                step = Some(gate.inhibit(start.wrapping_add(now_ms), reason));
                current = None;
                reads.clear();
                permitted = None;
            } else {
                reads.push(Read {
                    by,
                    from_ms: newest_ms,
                    to_ms: now_ms,
                });
            }
            at = moved(at, by);
            newest_ms = now_ms;
            is_news = true;
            if std::mem::take(&mut with_next) {
                fixes.push(Fix::drawn(rng, now_ms, at, &drive));
            }
        }
        let due: Vec<Fix> = fixes.extract_if(.., |fix| fix.comes_ms <= now_ms).collect();
        for fix in due {
            let [x_m, y_m, yaw_rad] = fix.set.mean;
            let covariance = fix.set.covariance(radius * radius);
            let report = Report {
                source: 0,
                frame: FrameId::of("map"),
                sequence: fix.stamp_ms,
                stamp_ms: start.wrapping_add(fix.stamp_ms),
                belief: PoseEstimate::new(
                    Estimate { x_m, y_m, yaw_rad },
                    Uncertainty::Gaussian(covariance),
                ),
            };
            if tracker.fix(&report).is_ok() {
                found.late += u64::from(fix.stamp_ms < newest_ms);
                found.early += u64::from(fix.stamp_ms > newest_ms);
                current = Some(fix);
                is_news = true;
            }
        }
        let wrapped = start.wrapping_add(now_ms);
        let step = match (step, tracker.tracked(wrapped)) {
            (Some(step), _) => step,
            (None, Ok(_)) if !is_news => gate.tick(wrapped),
            (None, Ok(tracked)) => {
                let step = gate.step_on(wrapped, &tracked.evidence());
                if step.verdict.is_ok()
                    && let Some(fix) = current
                {
                    permitted = Some((fix, reads.len(), newest_ms.max(fix.stamp_ms)));
                }
                step
            }
            (None, Err(Reason::Silent)) => gate.tick(wrapped),
            (None, Err(reason)) => gate.inhibit(wrapped, reason),
        };
        let was_open = std::mem::replace(&mut is_open, step.permission.is_permit());
        if !is_open {
            continue;
        }
        found.openings += u64::from(!was_open);
        let (fix, count, stamp) = permitted.expect("an open gate has permitted a report");
        let evidence = Evidence {
            fix,
            reads: &reads[..count],
            drive: &drive,
            radius,
        };
        // Valid until the output has followed the next answer.
        let ends_s = f64::from(now_ms + drive.response_ms - stamp) * 1e-3;
        let beyond = evidence.worst(ends_s);
        if found.note(beyond) {
            eprintln!("{beyond} m beyond, {ends_s} s after the stamp: {drive:?} {fix:?}");
        }
    }
}

fn driven_with(
    openings: u64,
    seed: u64,
    stated: impl Fn(&Drive) -> OdometryErrors + Sync,
) -> Found {
    let bytes = hall::facets(&hall::site([0.0; 3]), "hall", 2.5);
    driven(openings, seed, |rng, found| {
        drive(rng, &bytes, &stated, found)
    })
}

#[test]
fn no_open_moment_of_a_tracked_robot_has_a_history_that_ends_outside() {
    let openings = if is_deep() { 1_000_000 } else { 12_000 };
    let found = driven_with(openings, first_seed(), |drive| drive.errors);
    assert_eq!(found.outside, 0, "{found:?}");
    assert!(found.moments > 5 * found.openings, "{found:?}");
    // Fixes come late and before the odometry of their time, and sets end near the walls.
    assert!(
        found.late > openings / 10 && found.early > openings / 100,
        "{found:?}"
    );
    assert!(found.least_um < 5_000, "{found:?}");
}

/// The judge detects a tracker with errors of no slip, of half of the slip, or of half of the noise.
#[test]
fn judge_detects_a_tracker_with_too_small_errors() {
    let no_slip = driven_with(6_000, 3, |drive| OdometryErrors {
        slip: 0.0,
        turn_slip: 0.0,
        turn_slip_per_m: 0.0,
        ..drive.errors
    });
    assert!(no_slip.outside > 20, "{no_slip:?}");
    let half = driven_with(6_000, 3, |drive| OdometryErrors {
        slip: 0.5 * drive.errors.slip,
        turn_slip: 0.5 * drive.errors.turn_slip,
        turn_slip_per_m: 0.5 * drive.errors.turn_slip_per_m,
        ..drive.errors
    });
    assert!(half.outside > 5, "{half:?}");
    let quiet = driven_with(6_000, 3, |drive| OdometryErrors {
        m_per_sqrt_m: 0.0,
        rad_per_sqrt_m: 0.0,
        ..drive.errors
    });
    assert!(quiet.outside > 5, "{quiet:?}");
}
