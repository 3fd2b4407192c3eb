//! Pose-sets that a tracker carries along random paths, and robots that agree with all that it was told: with arcs, slip at its bound
//! and roundings that err to one side.

use crate::oracle::{
    Pose, PoseSet, Rng, cholesky, pose_from_deg, random_estimate, random_pose_set_near, to_goal,
    to_world,
};
use crate::singles::wide_or_thin;
use crate::trial::{Trial, scaled};
use posegate::contain::{Decision, decide};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::{Estimate, RadiusSquared, Trust, Uncertainty};
use posegate::track::{Increment, OdometryErrors, Tracker, TrackerSettings};
use std::f64::consts::{FRAC_PI_4, PI};

/// Robots of each permit.
const ROBOTS: usize = 24;
/// Equal parts of an increment in which a robot drives.
const PARTS: u32 = 16;
/// Times of increments: so long that a millisecond of a stamp is little.
const PERIOD_MS: u32 = 1_000;
/// A robot is outside if its slack is below this: the rounding of its path.
const OUTSIDE: f64 = -1e-6;

/// An odometry: speeds ahead, to the left and of the turn during each period, and its errors.
struct Path {
    twists: Vec<[f64; 3]>,
    errors: OdometryErrors,
}

impl Path {
    fn drawn(rng: &mut Rng) -> Self {
        let mut maybe = |most: f64| {
            if rng.chance(0.5) {
                0.0
            } else {
                rng.log_within(0.05, 1.0) * most
            }
        };
        let errors = OdometryErrors {
            slip: maybe(0.2),
            turn_slip: maybe(0.2),
            turn_slip_per_m: maybe(0.2),
            m_per_sqrt_m: 1e-5,
            ..OdometryErrors::NONE
        };
        if rng.chance(0.1) {
            // Many steps just below the middle of two units of 2^-8 um.
            let step = (rng.log_within(256.0, 76_800.0).round() + 0.4999) / 256e6;
            let count = 200 + rng.below(800);
            return Self {
                twists: vec![[step, 0.0, 0.0]; count],
                errors,
            };
        }
        let length = rng.log_within(0.003, 0.5);
        let twists = (0..1 + rng.below(8))
            .map(|_| {
                let way = rng.within(-PI, PI);
                let turn = rng.within(-0.999, 0.999) * FRAC_PI_4;
                [length * way.cos(), length * way.sin(), turn]
            })
            .collect();
        Self { twists, errors }
    }

    /// The pose at the end of the path as it is reported, from a start.
    fn end(&self, start: Pose) -> Pose {
        let arcs = self.twists.iter().map(|twist| arc(*twist));
        arcs.fold(start, to_world)
    }

    /// Returns the tracker's report for a fix, as a pose-set of the core.
    fn carried(&self, start: Pose, fix: &PoseSet, r2: f64) -> Option<posegate::set::PoseSet> {
        let fastest = self.twists.iter().fold([0.0f64; 2], |most, [x, y, turn]| {
            [most[0].max(x.hypot(*y)), most[1].max(turn.abs())]
        });
        let radius_squared = RadiusSquared::from_q16((r2 * 65536.0).ceil() as u32)?;
        let mut tracker = Tracker::<4>::new(TrackerSettings {
            errors: self.errors,
            bounds: MotionBounds::new(1.01 * fastest[0], 0.0, 1.01 * fastest[1])?,
            trust: Trust::FULL,
            radius_squared,
            maximum_gap_ms: PERIOD_MS,
            maximum_fix_age_ms: 1 << 30,
        })?;
        tracker
            .odometry(Increment::of(0.0, 0.0, 0.0, [0; 2])?)
            .ok()?;
        let [x_m, y_m, yaw_rad] = start;
        let spread = match fix {
            PoseSet::Gaussian { cov, .. } => Uncertainty::Gaussian(*cov),
            PoseSet::Bounded { translation, yaw } => Uncertainty::Bounded {
                translation_m: *translation,
                yaw_rad: *yaw,
            },
        };
        let report = Report {
            source: 0,
            frame: FrameId::of("map"),
            sequence: 1,
            stamp_ms: 0,
            belief: PoseEstimate::new(Estimate { x_m, y_m, yaw_rad }, spread),
        };
        tracker.fix(&report).ok()?;
        let mut now_ms = 0;
        for twist in &self.twists {
            let [x, y, turn] = arc(*twist);
            let span = [now_ms, now_ms + PERIOD_MS];
            tracker.odometry(Increment::of(x, y, turn, span)?).ok()?;
            now_ms += PERIOD_MS;
        }
        let tracked = tracker.tracked(now_ms).ok()?;
        let set = tracked.report.belief.pose_set(radius_squared, Trust::FULL);
        set.ok().map(|set| set.grown(tracked.beside))
    }

    /// Drives a robot from a pose of the fix's set, with errors at their bounds.
    fn driven(&self, start: Pose, slip: [f64; 2], side: f64) -> Pose {
        let mut pose = start;
        let OdometryErrors {
            slip: share,
            turn_slip,
            turn_slip_per_m,
            ..
        } = self.errors;
        let part = f64::from(PARTS).recip();
        for [ahead, left, turn] in &self.twists {
            let length = ahead.hypot(*left);
            let more = side * (turn_slip * turn.abs() + turn_slip_per_m * length);
            for _ in 0..PARTS {
                let true_arc = arc([ahead * part, left * part, (turn + more) * part]);
                pose = to_world(pose, true_arc);
                pose[0] += slip[0] * share * length * part;
                pose[1] += slip[1] * share * length * part;
            }
        }
        pose
    }
}

/// The movement of constant speeds for a unit of time.
fn arc([ahead, left, turn]: [f64; 3]) -> Pose {
    let (along, across) = if turn.abs() < 1e-9 {
        (1.0, 0.5 * turn)
    } else {
        (turn.sin() / turn, (1.0 - turn.cos()) / turn)
    };
    [
        ahead * along - left * across,
        ahead * across + left * along,
        turn,
    ]
}

/// A pose of a set's border.
fn of_border(rng: &mut Rng, mean: Pose, set: &PoseSet) -> Pose {
    let heading = [-1.0, 1.0, rng.within(-1.0, 1.0)][rng.below(3)];
    let (s, c) = rng.within(-PI, PI).sin_cos();
    let off = match set {
        PoseSet::Gaussian { cov, r2 } => {
            // The yaw first, so that its share is the first coordinate.
            let at = [2, 0, 1];
            let l = cholesky(&at.map(|i| at.map(|j| cov[i][j])));
            let rest = f64::sqrt(1.0 - heading * heading);
            let u = [heading, rest * c, rest * s];
            let row = |k: usize| (0..3).map(|j| l[k][j] * u[j]).sum::<f64>() * r2.sqrt();
            [row(1), row(2), row(0)]
        }
        PoseSet::Bounded { translation, yaw } => [translation * c, translation * s, heading * yaw],
    };
    [mean[0] + off[0], mean[1] + off[1], mean[2] + off[2]]
}

/// Decides on carried sets, each at the largest scale of its fix that is permitted.
pub fn robots(rng: &mut Rng, trial: &mut Trial<'_>, most: usize) {
    for _ in 0..most {
        let world = &trial.stage.world;
        let estimate = pose_from_deg(random_estimate(rng, world));
        let drawn = if rng.chance(0.15) {
            wide_or_thin(rng)
        } else {
            random_pose_set_near(rng, world, estimate).pose_set
        };
        let r2 = match &drawn {
            PoseSet::Gaussian { r2, .. } => *r2,
            PoseSet::Bounded { .. } => 11.4,
        };
        let path = Path::drawn(rng);
        // The start whose reported end is the estimate.
        let start = to_world(estimate, to_goal(path.end([0.0; 3]), [0.0; 3]));
        let permits = |scale: f64| {
            let set = path.carried(start, &scaled(&drawn, scale), r2);
            set.is_some_and(|set| decide(&trial.table, &set) == Decision::Inside)
        };
        trial.tally.cases += 1;
        let (mut low, mut high) = (0.0, 4.0);
        for _ in 0..12 {
            let middle = 0.5 * (low + high);
            if permits(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        if low == 0.0 {
            continue;
        }
        trial.tally.permits += 1;
        trial.tally.carried += 1;
        let fix = scaled(&drawn, low);
        for _ in 0..ROBOTS {
            let begins = of_border(rng, start, &fix);
            let (s, c) = rng.within(-PI, PI).sin_cos();
            let side = if rng.chance(0.5) { 1.0 } else { -1.0 };
            let pose = path.driven(begins, [c, s], side);
            let slack = trial.stage.world.slack(pose);
            if !(slack >= OUTSIDE) {
                trial.tally.false_permits += 1;
                if trial.tally.false_permits <= 3 {
                    eprintln!(
                        "FALSE PERMIT: a robot ends at {pose:?}, slack {slack:e}: {start:?} {fix:?} {:?} {:?} in {:?}",
                        path.twists, path.errors, trial.stage.success
                    );
                }
                break;
            }
        }
    }
}
