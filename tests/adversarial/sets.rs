//! Pose-sets that are difficult for a table's arithmetic, each with an estimate.

use crate::oracle::{
    Pose, PoseSet, Rng, World, below, chi2_quantile_3dof, pose_from_deg, random_estimate,
    random_pose_set, to_goal, to_world,
};
use crate::oracle::{Set, turn};
use crate::trial::{scaled, size};
use std::f64::consts::TAU;

/// Returns an estimate and a pose-set of any size; bursts scale it.
pub fn hard_case(rng: &mut Rng, world: &World) -> (Pose, PoseSet) {
    let estimate = fine_estimate(rng, world);
    match rng.below(10) {
        0 | 1 => (estimate, random_pose_set(rng).pose_set),
        2..=4 => {
            let set = turning(rng);
            (estimate, fitted(world, estimate, set))
        }
        5 => {
            let set = needle(rng);
            (estimate, fitted(world, estimate, set))
        }
        6 => (estimate, needle(rng)),
        7 | 8 => tiny(rng, world, estimate),
        _ if turns_freely(&world.set) => (estimate, all_headings(rng)),
        _ => (estimate, disc(rng, [0.02, 0.5])),
    }
}

/// Returns an estimate that is not rounded to tenths of millimetres, as those of [`random_estimate`] are.
fn fine_estimate(rng: &mut Rng, world: &World) -> Pose {
    let [x, y, yaw] = pose_from_deg(random_estimate(rng, world));
    [
        x + rng.within(-5e-5, 5e-5),
        y + rng.within(-5e-5, 5e-5),
        yaw + rng.within(-1e-5, 1e-5),
    ]
}

/// Returns `true` if every heading is allowed and only the robot's centre is constrained.
fn turns_freely(set: &Set) -> bool {
    matches!(set, Set::Box { yaw, .. } if yaw[1] - yaw[0] > TAU - 1e-6)
}

fn radius_squared(rng: &mut Rng) -> f64 {
    chi2_quantile_3dof([0.9, 0.95, 0.99, 0.999][rng.below(4)])
}

fn disc(rng: &mut Rng, yaw: [f64; 2]) -> PoseSet {
    PoseSet::Bounded {
        translation: rng.log_within(1e-3, 0.5),
        yaw: rng.log_within(yaw[0], yaw[1]),
    }
}

/// Returns a set of up to every heading and more.
fn all_headings(rng: &mut Rng) -> PoseSet {
    let radius = radius_squared(rng);
    let yaw = rng.within(2.0, 8.0);
    if rng.chance(0.5) {
        return disc(rng, [2.0, 8.0]);
    }
    let (x, y) = (rng.log_within(1e-3, 0.3), rng.log_within(1e-3, 0.3));
    let lean = correlation(rng);
    gaussian([x, y, yaw / radius.sqrt()], lean, radius)
}

/// Returns a set that turns by 0.1 rad to half a turn, so that the product of its yaw and its offset matters.
fn turning(rng: &mut Rng) -> PoseSet {
    let yaw = if rng.chance(0.5) {
        [0.1, 0.49]
    } else {
        [0.49, 3.2]
    };
    if rng.chance(0.3) {
        return disc(rng, yaw);
    }
    let radius = radius_squared(rng);
    let yaw = rng.within(yaw[0], yaw[1]) / radius.sqrt();
    let (x, y) = (rng.log_within(1e-3, 0.3), rng.log_within(1e-3, 0.3));
    let lean = correlation(rng);
    gaussian([x, y, yaw], lean, radius)
}

/// Returns correlations with the yaw: 0.9 to 0.999 of either sign, or 0.
fn correlation(rng: &mut Rng) -> [f64; 2] {
    let lean = (1.0 - rng.log_within(1e-3, 0.1)) * if rng.chance(0.5) { 1.0 } else { -1.0 };
    let (s, c) = rng.within(0.0, TAU).sin_cos();
    match rng.below(4) {
        0 => [0.0; 2],
        1 => [lean, 0.0],
        2 => [0.0, lean],
        _ => [lean * c, lean * s],
    }
}

/// Returns the set of standard deviations and of correlations of x and y with the yaw (sum of squares at most 1).
fn gaussian([sx, sy, syaw]: Pose, [xt, yt]: [f64; 2], r2: f64) -> PoseSet {
    let (cxt, cyt) = (xt * sx * syaw, yt * sy * syaw);
    // The covariance of x and y by way of the yaw; the rest of each is independent.
    let cxy = xt * yt * sx * sy;
    PoseSet::Gaussian {
        cov: [
            [sx * sx, cxy, cxt],
            [cxy, sy * sy, cyt],
            [cxt, cyt, syaw * syaw],
        ],
        r2,
    }
}

/// Returns a set that is long in one direction of (x, y, yaw), and a twentieth to a thirtieth of that in the others: a
/// correlation of up to 0.999.
fn needle(rng: &mut Rng) -> PoseSet {
    let (length, yaw) = (rng.log_within(0.005, 0.5), rng.within(0.03, 0.45));
    let thin = rng.log_within(0.03, 0.3);
    let [c, s] = turn(rng.within(0.0, TAU), [1.0, 0.0]);
    // Columns of a factor: one along, two across.
    let columns = [
        [length * c, length * s, yaw],
        [-length * s * thin, length * c * thin, 0.0],
        [
            0.7 * length * c * thin,
            0.7 * length * s * thin,
            -0.7 * yaw * thin,
        ],
    ];
    let r2 = radius_squared(rng);
    let mut cov = [[0.0; 3]; 3];
    for column in columns {
        for (row, a) in cov.iter_mut().zip(column) {
            for (entry, b) in row.iter_mut().zip(column) {
                *entry += a * b / r2;
            }
        }
    }
    PoseSet::Gaussian { cov, r2 }
}

/// Returns a set of millimetres, with an estimate about as far inside the border.
fn tiny(rng: &mut Rng, world: &World, from: Pose) -> (Pose, PoseSet) {
    let translation = rng.log_within(2e-4, 3e-3);
    let yaw = rng.log_within(1e-4, 2e-3);
    let set = if rng.chance(0.6) {
        PoseSet::Bounded { translation, yaw }
    } else {
        let r2 = radius_squared(rng);
        let other = translation * rng.log_within(0.2, 1.0);
        let lean = correlation(rng);
        let size = [translation, other, yaw].map(|v| v / r2.sqrt());
        gaussian(size, lean, r2)
    };
    // Outwards from the goal through the estimate, or in any direction if the estimate is at the goal.
    let mut along = to_goal(world.goal, from);
    if along[0].hypot(along[1]) < 1e-3 {
        along[0] += 1e-2;
    }
    let at = |t: f64| to_world(world.goal, along.map(|v| v * t));
    let (mut inside, mut outside) = (0.0, 1.0);
    while world.inside(at(outside)) && outside < 1e3 {
        outside *= 2.0;
    }
    while outside - inside > 1e-9 * outside {
        let middle = 0.5 * (inside + outside);
        if world.inside(at(middle)) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    let back = size(&set) * rng.log_within(1.0, 5.0) / along[0].hypot(along[1]);
    (at((inside - back).max(0.0)), set)
}

/// Returns the set with its extent in the plane resized so that it just fits. The yaw is kept, because scaling both
/// would leave little of a large yaw. Returns the smallest set if even that does not fit.
fn fitted(world: &World, estimate: Pose, set: PoseSet) -> PoseSet {
    let fits = |by: f64| below(world, estimate, &planar_scaled(&set, by), 1.0, 0.0).is_none();
    let (mut small, mut large) = (0.01f64, 20.0f64);
    if !fits(small) {
        return planar_scaled(&set, small);
    }
    for _ in 0..10 {
        let middle = (small * large).sqrt();
        if fits(middle) {
            small = middle;
        } else {
            large = middle;
        }
    }
    planar_scaled(&set, small)
}

/// Returns a set with its extent in the plane scaled.
fn planar_scaled(set: &PoseSet, by: f64) -> PoseSet {
    match scaled(set, 1.0) {
        PoseSet::Bounded { translation, yaw } => PoseSet::Bounded {
            translation: translation * by,
            yaw,
        },
        PoseSet::Gaussian { mut cov, r2 } => {
            for (i, row) in cov.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry *= [by, by, 1.0][i] * [by, by, 1.0][j];
                }
            }
            PoseSet::Gaussian { cov, r2 }
        }
    }
}
