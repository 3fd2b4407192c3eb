use super::*;
use crate::report::FrameId;
use crate::set::{CrossTerms, Estimate, Inflation, PoseSet, SplitWeight};
use core::f64::consts::TAU;
use std::vec::Vec;

/// A small generator.
struct Random(u64);

impl Random {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        low + (self.0 >> 11) as f64 / (1u64 << 53) as f64 * (high - low)
    }

    fn normal(&mut self) -> f64 {
        let (u, v) = (self.within(1e-12, 1.0), self.within(0.0, TAU));
        (-2.0 * u.ln()).sqrt() * v.cos()
    }
}

const ERRORS: OdometryErrors = OdometryErrors {
    m_per_sqrt_m: 0.01,
    rad_per_sqrt_rad: 0.03,
    rad_per_sqrt_m: 0.02,
    m_per_sqrt_s: 0.001,
    rad_per_sqrt_s: 0.002,
    ..OdometryErrors::NONE
};

fn settings(errors: OdometryErrors) -> TrackerSettings {
    TrackerSettings {
        errors,
        bounds: MotionBounds::of_mm_mrad(2_000, 500, 3_000),
        trust: Trust::FULL,
        radius_squared: RadiusSquared::from_q16(743_499).unwrap(),
        maximum_gap_ms: 60,
        maximum_fix_age_ms: 5_000,
    }
}

/// Returns the product of a matrix of three rows with its transpose, rounded, and a little more on the diagonal, so that no direction has a variance
/// below zero.
pub(super) fn noise_of_rows([x, y, t]: [[f64; 3]; 3]) -> PathNoise {
    let dot = |u: [f64; 3], v: [f64; 3]| (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) as i64;
    PathNoise {
        xx: dot(x, x) + 3,
        xy: dot(x, y),
        yy: dot(y, y) + 3,
        xt: dot(x, t),
        yt: dot(y, t),
        tt: dot(t, t) + 3,
    }
}

pub(super) fn fix(pose: [f64; 3], covariance: [[f64; 3]; 3], stamp_ms: u32) -> Report {
    let [x_m, y_m, yaw_rad] = pose;
    Report {
        source: 3,
        frame: FrameId::of("map"),
        sequence: stamp_ms,
        stamp_ms,
        belief: PoseEstimate::new(
            Estimate { x_m, y_m, yaw_rad },
            Uncertainty::Gaussian(covariance),
        ),
    }
}

fn moved([x, y, yaw]: [f64; 3], [dx, dy, turn]: [f64; 3]) -> [f64; 3] {
    let (s, c) = yaw.sin_cos();
    [x + c * dx - s * dy, y + s * dx + c * dy, yaw + turn]
}

fn covariance_of(tracked: &Tracked) -> [[f64; 3]; 3] {
    match tracked.report.belief.spread {
        Some(Uncertainty::Gaussian(covariance)) => covariance,
        other => panic!("{other:?}"),
    }
}

fn mean_of(tracked: &Tracked) -> [f64; 3] {
    let belief = &tracked.report.belief;
    match belief.heading {
        Heading::Radians(yaw) => [belief.x_m, belief.y_m, yaw],
        other => panic!("{other:?}"),
    }
}

type Matrix = [[f64; 3]; 3];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    core::array::from_fn(|i| core::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed(a: &Matrix) -> Matrix {
    core::array::from_fn(|i| core::array::from_fn(|j| a[j][i]))
}

/// `e' P^-1 e`.
fn level(p: &Matrix, e: [f64; 3]) -> f64 {
    let matrix = nalgebra::Matrix3::from_fn(|i, j| p[i][j]);
    let error = nalgebra::Vector3::from(e);
    let solved = matrix.cholesky().unwrap().solve(&error);
    error.dot(&solved)
}

fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// Drives with fixes and odometry whose errors are as stated. The carried sets contain the truth as often as required, and are hardly
/// larger than those of an exact propagation in floats.
#[test]
fn carried_sets_contain_truth_and_are_nearly_exact() {
    let mut random = Random(5);
    let sigma = [0.02, 0.03, 0.015];
    let p: Matrix = core::array::from_fn(|i| {
        core::array::from_fn(|j| {
            let share = if i == j { 1.0 } else { 0.3 };
            sigma[i] * sigma[j] * share
        })
    });
    let root = nalgebra::Matrix3::from_fn(|i, j| p[i][j])
        .cholesky()
        .unwrap()
        .l();
    let (mut held, mut drives) = ([0u32; 3], 0u32);
    let mut ratios = Vec::new();
    for _ in 0..crate::test_iterations(3_000, 3) {
        drives += 1;
        let mut tracker = Tracker::<64>::new(settings(ERRORS)).unwrap();
        let start = [
            random.within(-5.0, 5.0),
            random.within(-5.0, 5.0),
            random.within(-3.0, 3.0),
        ];
        let error = root * nalgebra::Vector3::from_fn(|_, _| random.normal());
        let estimate: [f64; 3] = core::array::from_fn(|i| start[i] + error[i]);
        let (speed, rate) = (random.within(-0.5, 1.5), random.within(-1.5, 1.5));
        tracker
            .odometry(Increment::of(0.0, 0.0, 0.0, [980, 1_000]).unwrap())
            .unwrap();
        tracker.fix(&fix(estimate, p, 1_000)).unwrap();
        let (mut truth, mut mean, mut exact) = (start, estimate, p);
        for cycle in 1..=100u32 {
            let done = [speed * 0.02, 0.0, rate * 0.02];
            truth = moved(truth, done);
            let (way, turn) = (done[0].abs(), done[2].abs());
            let plane = 1e-4 * way + 1e-6 * 0.02;
            let heading = 9e-4 * turn + 4e-4 * way + 4e-6 * 0.02;
            let deviation = [plane.sqrt(), plane.sqrt(), heading.sqrt()];
            let read: [f64; 3] = core::array::from_fn(|i| done[i] + deviation[i] * random.normal());
            let increment = Increment::of(
                read[0],
                read[1],
                read[2],
                [980 + 20 * cycle, 1_000 + 20 * cycle],
            );
            tracker.odometry(increment.unwrap()).unwrap();
            let after = moved(mean, read);
            let g = [
                [1.0, 0.0, -(after[1] - mean[1])],
                [0.0, 1.0, after[0] - mean[0]],
                [0.0, 0.0, 1.0],
            ];
            exact = product(&product(&g, &exact), &transposed(&g));
            exact[0][0] += plane;
            exact[1][1] += plane;
            exact[2][2] += heading;
            mean = after;
            let place = [10, 40, 100].iter().position(|at| *at == cycle);
            let Some(place) = place else { continue };
            let tracked = tracker.tracked(1_000 + 20 * cycle).unwrap();
            let found = mean_of(&tracked);
            let apart: [f64; 3] = core::array::from_fn(|i| found[i] - mean[i]);
            assert!(
                apart[0].hypot(apart[1]) < 2e-5 && wrapped(apart[2]).abs() < 1e-7,
                "{apart:?}"
            );
            let carried = covariance_of(&tracked);
            let e = core::array::from_fn(|i| {
                let by = truth[i] - found[i];
                if i == 2 { wrapped(by) } else { by }
            });
            held[place] += u32::from(level(&carried, e) <= 11.3449);
            // The area of the plane's ellipse grown by the slip, and that of the exact ellipse.
            let area = |p: &Matrix, more: f64| {
                let det = p[0][0] * p[1][1] - p[0][1] * p[0][1];
                let middle = 0.5 * (p[0][0] + p[1][1]);
                let half = (middle * middle - det).max(0.0).sqrt();
                let axes = [middle + half, middle - half].map(|v| (11.3449 * v).sqrt() + more);
                axes[0] * axes[1]
            };
            let beside = f64::from(tracked.beside.translation_um()) * 1e-6;
            ratios.push(area(&carried, beside) / area(&exact, 0.0));
        }
    }
    ratios.sort_by(f64::total_cmp);
    let share = held.map(|held| f64::from(held) / f64::from(drives));
    let median = ratios[ratios.len() / 2];
    std::println!(
        "held {share:?}, area median {median:.3}, most {:.3}",
        ratios[ratios.len() - 1]
    );
    assert!(
        cfg!(miri) || share.iter().all(|share| *share >= 0.985),
        "{share:?}"
    );
    assert!(median <= 1.3, "{median}");
}

/// An odometry that slips by its bound in the worst direction: the truth is within the reported movement.
#[test]
fn slip_at_its_bound_is_reported_as_movement() {
    let mut random = Random(9);
    let slipping = OdometryErrors {
        slip: 0.05,
        turn_slip: 0.1,
        turn_slip_per_m: 0.02,
        ..OdometryErrors::NONE
    };
    for _ in 0..crate::test_iterations(2_000, 3) {
        let mut tracker = Tracker::<64>::new(settings(slipping)).unwrap();
        let start = [1.0, -2.0, random.within(-3.0, 3.0)];
        let tiny = [[1e-10, 0.0, 0.0], [0.0, 1e-10, 0.0], [0.0, 0.0, 1e-10]];
        tracker
            .odometry(Increment::of(0.0, 0.0, 0.0, [980, 1_000]).unwrap())
            .unwrap();
        tracker.fix(&fix(start, tiny, 1_000)).unwrap();
        let (speed, rate) = (random.within(0.1, 1.0), random.within(-1.0, 1.0));
        // One direction of the slip, and one side of the turn's, throughout.
        let (away, side) = (
            random.within(0.0, TAU),
            if random.within(0.0, 1.0) < 0.5 {
                -1.0
            } else {
                1.0
            },
        );
        let mut truth = start;
        for cycle in 1..=80u32 {
            let read = [speed * 0.02, 0.0, rate * 0.02];
            tracker
                .odometry(
                    Increment::of(
                        read[0],
                        read[1],
                        read[2],
                        [980 + 20 * cycle, 1_000 + 20 * cycle],
                    )
                    .unwrap(),
                )
                .unwrap();
            let slipped = 0.0499 * read[0];
            let turned = side * (0.0999 * read[2].abs() + 0.01999 * read[0]);
            let done = [
                read[0] + slipped * away.cos(),
                read[1] + slipped * away.sin(),
                read[2] + turned,
            ];
            truth = moved(truth, done);
            let tracked = tracker.tracked(1_000 + 20 * cycle).unwrap();
            let found = mean_of(&tracked);
            let length = (truth[0] - found[0]).hypot(truth[1] - found[1]);
            let turn = wrapped(truth[2] - found[2]).abs();
            let most = f64::from(tracked.beside.translation_um()) * 1e-6;
            assert!(length <= most, "{cycle}: {length} {most}");
            let most = f64::from(tracked.beside.yaw_q24()) / 16_777_216.0 * TAU;
            assert!(turn <= most, "{cycle}: {turn} {most}");
        }
    }
}

/// A fix that arrives 300 ms late gives the same result as in time. A fix between two increments lies between, with a larger bound.
#[test]
fn late_fix_is_carried_along_increments_since_its_stamp() {
    let p = [[1e-4, 0.0, 0.0], [0.0, 2e-4, 0.0], [0.0, 0.0, 1e-4]];
    let report = fix([0.5, 0.25, 1.0], p, 1_100);
    let way = |cycle: u32| {
        let side = f64::from(cycle % 7) * 0.0005;
        Increment::of(0.008, side, 0.01, [980 + 20 * cycle, 1_000 + 20 * cycle]).unwrap()
    };
    let (mut late, mut timely) = (
        Tracker::<64>::new(settings(ERRORS)).unwrap(),
        Tracker::<64>::new(settings(ERRORS)).unwrap(),
    );
    for cycle in 0..=20 {
        late.odometry(way(cycle)).unwrap();
        timely.odometry(way(cycle)).unwrap();
        if cycle == 5 {
            timely.fix(&report).unwrap();
        }
    }
    late.fix(&report).unwrap();
    assert_eq!(late.tracked(1_400), timely.tracked(1_400));
    let between = fix([0.5, 0.25, 1.0], p, 1_109);
    assert_eq!(late.fix(&between), Ok(()));
    let (part, whole) = (late.tracked(1_400).unwrap(), timely.tracked(1_400).unwrap());
    let apart = mean_of(&part)[0] - mean_of(&whole)[0];
    assert!((1e-4..0.008).contains(&apart.abs()), "{apart}");
    assert!(part.beside.translation_um() > whole.beside.translation_um() + 4_000);
}

/// A robot that drives a circle of half a metre for 3 s turns by 6.0 rad, which reads as -0.28 rad and 14 cm.
#[test]
fn increment_in_which_the_robot_may_turn_around_is_a_jump() {
    let tried = |errors: OdometryErrors, ms: u32| {
        let settings = TrackerSettings {
            bounds: MotionBounds::of_mm_mrad(1_000, 0, 2_000),
            maximum_gap_ms: 10_000,
            ..settings(errors)
        };
        let mut tracker = Tracker::<8>::new(settings).unwrap();
        let start = Increment::of(0.0, 0.0, 0.0, [0, 20]).unwrap();
        tracker.odometry(start).unwrap();
        tracker.odometry(Increment::of(0.141, 0.0, -0.283, [20, 20 + ms]).unwrap())
    };
    // 7/8 of a turn takes 2,748.9 ms; stamps are rounded to one.
    assert_eq!(tried(OdometryErrors::NONE, 2_747), Ok(()));
    assert_eq!(
        tried(OdometryErrors::NONE, 2_748),
        Err(Reason::OdometryJump)
    );
    assert_eq!(tried(ERRORS, 3_000), Err(Reason::OdometryJump));
    // The odometry reads more than the robot turns: by a tenth, by 0.2 rad per metre, by 16 times 0.01 rad per root of a second.
    let mut errors = OdometryErrors {
        turn_slip: 0.1,
        ..OdometryErrors::NONE
    };
    assert_eq!(tried(errors, 2_472), Ok(()));
    assert_eq!(tried(errors, 2_475), Err(Reason::OdometryJump));
    errors.turn_slip_per_m = 0.2;
    assert_eq!(tried(errors, 2_247), Ok(()));
    assert_eq!(tried(errors, 2_249), Err(Reason::OdometryJump));
    errors.rad_per_sqrt_s = 0.01;
    assert_eq!(tried(errors, 2_150), Ok(()));
    assert_eq!(tried(errors, 2_155), Err(Reason::OdometryJump));
}

/// The share of an arc is as long as the arc's, though its own turn is smaller.
#[test]
fn part_of_an_arc_has_its_share_of_the_length() {
    for turn in [0.0, 0.2, core::f64::consts::FRAC_PI_4 - 1e-6] {
        // A metre along the arc.
        let (ahead, left) = if turn == 0.0 {
            (1.0, 0.0)
        } else {
            (f64::sin(turn) / turn, (1.0 - f64::cos(turn)) / turn)
        };
        let step = Increment::of(ahead, left, turn, [0, 10]).unwrap().step;
        for after in 1..=10u32 {
            let found = f64::from(step.driven_part(Excess::NONE, [after, 10])[0]) / 256e6;
            let exact = f64::from(after) / 10.0;
            assert!(
                found >= exact && found <= exact * 1.08 + 1e-8,
                "{turn} {after}: {found}"
            );
        }
    }
}

#[test]
fn broken_path_has_its_reason() {
    let p = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]];
    let span = |span_ms: [u32; 2]| Increment::of(0.004, 0.0, 0.0, span_ms).unwrap();
    let ready = || {
        let mut tracker = Tracker::<8>::new(settings(ERRORS)).unwrap();
        // Near the wrap of the clock.
        for cycle in 0..20u32 {
            let ends = cycle.wrapping_mul(20).wrapping_sub(200);
            tracker
                .odometry(span([ends.wrapping_sub(20), ends]))
                .unwrap();
        }
        tracker
    };
    let newest = 180;
    let good = fix([0.0; 3], p, 150);
    let mut tracker = ready();
    assert_eq!(tracker.tracked(newest), Err(Reason::Silent));
    assert_eq!(
        tracker.fix(&fix([0.0; 3], p, 1)),
        Err(Reason::OdometryTooShort)
    );
    assert_eq!(tracker.fix(&good), Ok(()));
    assert!(tracker.tracked(newest + 60).is_ok());
    assert_eq!(tracker.tracked(newest + 61), Err(Reason::OdometryGap));
    assert_eq!(
        tracker.fix(&fix([0.0; 3], p, 149)),
        Err(Reason::TimeBackwards)
    );
    assert_eq!(tracker.fix(&good), Err(Reason::TimeBackwards));
    assert_eq!(
        tracker.fix(&fix([0.0; 3], p, newest + 61)),
        Err(Reason::TimeBackwards)
    );
    for (increment, reason) in [
        (span([newest - 20, newest]), Reason::OdometryBackwards),
        (span([newest, newest - 1]), Reason::OdometryBackwards),
        (span([newest, newest + 61]), Reason::OdometryGap),
        // The increment from 180 to 200 ms was lost.
        (span([newest + 20, newest + 40]), Reason::OdometryGap),
        (span([newest - 1, newest + 20]), Reason::OdometryGap),
        (
            Increment::of(0.05, 0.0, 0.0, [newest, newest + 20]).unwrap(),
            Reason::OdometryJump,
        ),
        (
            Increment::of(0.0, 0.0, 0.2, [newest, newest + 20]).unwrap(),
            Reason::OdometryJump,
        ),
    ] {
        let mut tracker = ready();
        tracker.fix(&good).unwrap();
        assert_eq!(tracker.odometry(increment), Err(reason));
        // The path is broken: the old fix is not used.
        assert_eq!(tracker.tracked(newest + 20), Err(Reason::Silent));
    }
    // A source that is stuck, another one, and another frame: nothing is carried any more.
    type Change = fn(&mut Report);
    let changes: [(Change, Reason); 3] = [
        (|fix| fix.sequence = 150, Reason::SequenceStuck),
        (|fix| fix.source += 1, Reason::SourceChanged),
        (|fix| fix.frame = FrameId::of("odom"), Reason::FrameMismatch),
    ];
    for (change, reason) in changes {
        let mut tracker = ready();
        tracker.fix(&good).unwrap();
        let mut next = fix([0.0; 3], p, 170);
        assert_eq!(tracker.fix(&next), Ok(()));
        next.stamp_ms = 180;
        next.sequence = 171;
        change(&mut next);
        if next.sequence == 150 {
            next.sequence = 170;
        }
        assert_eq!(tracker.fix(&next), Err(reason));
        assert_eq!(tracker.tracked(newest), Err(Reason::Silent));
    }
    // A fix grows old while the odometry continues.
    let mut tracker = ready();
    tracker.fix(&good).unwrap();
    let mut now = newest;
    while now < 5_130 {
        tracker.odometry(span([now, now + 50])).unwrap();
        now += 50;
    }
    assert!(tracker.tracked(5_150).is_ok());
    tracker.odometry(span([now, now + 1])).unwrap();
    assert_eq!(tracker.tracked(5_151), Err(Reason::Stale));
    // The fix is dropped, so that it does not seem new when the clock wraps.
    tracker.odometry(span([now + 1, now + 41])).unwrap();
    assert_eq!(tracker.tracked(now + 41), Err(Reason::Silent));
}

/// Every report is new to a gate if the odometry is new; a repeated report is the same.
#[test]
fn sequence_numbers_count_the_stamps() {
    let p = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]];
    let mut tracker = Tracker::<8>::new(settings(ERRORS)).unwrap();
    tracker
        .odometry(Increment::of(0.0, 0.0, 0.0, [0, 0]).unwrap())
        .unwrap();
    tracker.fix(&fix([0.0; 3], p, 0)).unwrap();
    let first = tracker.tracked(1).unwrap();
    assert_eq!(tracker.tracked(5), Ok(first));
    tracker
        .odometry(Increment::of(0.0, 0.0, 0.0, [0, 20]).unwrap())
        .unwrap();
    let second = tracker.tracked(21).unwrap();
    assert_eq!(second.report.sequence, first.report.sequence + 1);
    assert_eq!(second.report.stamp_ms, 20);
}

/// A bounded fix is carried separately from the noise of the path.
#[test]
fn a_bounded_fix_is_carried_as_a_cylinder() {
    let mut tracker = Tracker::<8>::new(settings(ERRORS)).unwrap();
    tracker
        .odometry(Increment::of(0.0, 0.0, 0.0, [0, 0]).unwrap())
        .unwrap();
    let mut report = fix([0.0; 3], [[0.0; 3]; 3], 0);
    report.belief.spread = Some(Uncertainty::Bounded {
        translation_m: 0.05,
        yaw_rad: 0.02,
    });
    tracker.fix(&report).unwrap();
    for cycle in 1..=50u32 {
        tracker
            .odometry(Increment::of(0.02, 0.0, 0.0, [20 * cycle - 20, 20 * cycle]).unwrap())
            .unwrap();
    }
    let tracked = tracker.tracked(1_000).unwrap();
    // 1 m ahead: 0.02 rad at the start are 2 cm there. What a robot of 2 m/s and 3 rad/s moves in a millisecond, by which stamps are
    // rounded, is 2 mm and 3 mrad.
    let beside = f64::from(tracked.beside.translation_um()) * 1e-6;
    assert!((0.075..0.08).contains(&beside), "{beside}");
    let set = tracked
        .report
        .belief
        .pose_set(RadiusSquared::from_q16(743_499).unwrap(), Trust::FULL);
    assert!(set.map(|set: PoseSet| set.grown(tracked.beside)).is_ok());
}

/// The trust in the source is applied to a fix, of either kind, when it is carried.
#[test]
fn a_fix_is_carried_with_the_trust_in_its_source() {
    let covariance = [[4e-4, 1e-4, 0.0], [1e-4, 9e-4, 0.0], [0.0, 0.0, 1e-4]];
    let bounded = Uncertainty::Bounded {
        translation_m: 0.05,
        yaw_rad: 0.02,
    };
    let carried = |trust: Trust, spread: Uncertainty| {
        let given = TrackerSettings {
            trust,
            ..settings(OdometryErrors::NONE)
        };
        let mut tracker = Tracker::<8>::new(given).unwrap();
        let stands = Increment::of(0.0, 0.0, 0.0, [0, 0]).unwrap();
        tracker.odometry(stands).unwrap();
        let mut report = fix([0.0; 3], covariance, 0);
        report.belief.spread = Some(spread);
        tracker.fix(&report).unwrap();
        tracker.tracked(0).unwrap()
    };
    let given = Uncertainty::Gaussian(covariance);
    let inflated = Trust {
        inflation: Inflation::new(4.0).unwrap(),
        ..Trust::FULL
    };
    let found = covariance_of(&carried(inflated, given));
    for (row, known) in found.iter().zip(&covariance) {
        for (entry, known) in row.iter().zip(known) {
            assert!((entry - 4.0 * known).abs() < 1e-6, "{found:?}");
        }
    }
    // Without the cross terms the set is wider than the given covariance on each axis.
    let unknown = Trust {
        cross_terms: CrossTerms::YawUnknown(SplitWeight::HALF),
        ..Trust::FULL
    };
    let found = covariance_of(&carried(unknown, given));
    assert!(
        (0..3).all(|k| found[k][k] > 1.9 * covariance[k][k]),
        "{found:?}"
    );
    let [plain, wide] = [Trust::FULL, inflated].map(|trust| carried(trust, bounded).beside);
    // Twice the lengths have four times the covariance; a movement of a millisecond is in both.
    assert!(wide.translation_um() > plain.translation_um() + 49_000);
    assert!(wide.yaw_q24() > plain.yaw_q24() + 52_000);
}

/// At a thousand increments a second, 64 entries reach back far enough for a fix that is 120 ms old; at a hundred, none are kept as one.
#[test]
fn short_increments_are_kept_as_one() {
    for (period_ms, reach_ms) in [
        (1, 64 * 8),
        (2, 64 * 8),
        (3, 64 * 6),
        (5, 64 * 5),
        (10, 64 * 10),
    ] {
        let mut tracker = Tracker::<64>::new(settings(ERRORS)).unwrap();
        let metres = 3e-4 * f64::from(period_ms);
        for k in 0..2_000u32 {
            let span = [k, k + 1].map(|k| k.wrapping_mul(period_ms).wrapping_sub(100));
            // It drives to and fro, too.
            let ahead = if k % 5 == 4 { -metres } else { metres };
            tracker
                .odometry(Increment::of(ahead, 0.0, 1e-3, span).unwrap())
                .unwrap();
        }
        let now = (2_000 * period_ms).wrapping_sub(100);
        assert!(
            tracker.reach_ms().abs_diff(reach_ms) <= 8,
            "{period_ms}: {}",
            tracker.reach_ms()
        );
        let covariance = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-8]];
        tracker
            .fix(&fix([0.0; 3], covariance, now.wrapping_sub(120)))
            .unwrap();
        let (late, mut live) = (tracker.fix.unwrap().way, Way::new(&tracker.noise));
        let kept = 120 / period_ms;
        for k in 2_000 - kept..2_000 {
            let ahead = if k % 5 == 4 { -metres } else { metres };
            let step = Increment::of(ahead, 0.0, 1e-3, [k * period_ms, (k + 1) * period_ms])
                .unwrap()
                .step;
            live.add(&step, step.driven(Excess::NONE), period_ms, &tracker.noise);
        }
        // The noise is that of all that was driven, to and fro.
        let [late_noise, live_noise] = [&late, &live].map(Way::noise_of_path);
        assert!(
            late_noise.xx >= live_noise.xx && late_noise.tt >= live_noise.tt,
            "{period_ms}"
        );
        let apart = [0, 1].map(|k| late.place_q8()[k].abs_diff(live.place_q8()[k]));
        assert!(
            apart
                .iter()
                .all(|off| *off <= u64::from(period_ms.max(8)) * 256 * 300),
            "{apart:?}"
        );
    }
}

/// A noise beyond all that is carried, also one of which sums overflow, is refused in whatever direction the robot stands.
#[test]
fn noise_beyond_its_range_is_refused() {
    let covariance = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-8]];
    let sizes = [0, 1 << 40, 1 << 58, 1 << 62, i64::MAX - 1, i64::MAX];
    let start = Carriable::of(&covariance, Trust::FULL).unwrap();
    for (xx, yy) in sizes.iter().flat_map(|xx| sizes.map(|yy| (*xx, yy))) {
        for xy in sizes.iter().flat_map(|size| [*size, -size]) {
            if xx.max(yy).max(xy.abs()) < 1 << 58 {
                continue;
            }
            let noise = PathNoise {
                xx,
                yy,
                xy,
                tt: 1,
                ..PathNoise::default()
            };
            for heading in (0..64).map(|k| BinaryAngle(k << 26)) {
                let noise = turned(&noise, heading.cos_sin_q30());
                let found = set::carried(&start, [0, 0], &noise);
                assert!(found.is_err(), "{xx} {yy} {xy} {heading:?}: {found:?}");
            }
        }
    }
}
