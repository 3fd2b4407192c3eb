//! The true scale of a pose-set in a set of any form, by rays.

use super::{Pose, PoseSet, Rng, World, cholesky, wrap};

/// The slack of a pose in a set: at least 0 if the set contains it.
pub type Slack<'a> = &'a (dyn Fn(Pose) -> f64 + Sync);

/// Steps of a ray in which the first pose outside is searched.
const STEPS: usize = 96;
/// Rays in all directions, those of them that are improved, and steps of an improvement.
const RAYS: usize = 3_000;
const BEST: usize = 12;
const IMPROVEMENTS: usize = 60;

/// Returns the largest slack of a pose among the sets: at least 0 if one of them contains it.
pub fn union_slack(worlds: &[World], pose: Pose) -> f64 {
    let slacks = worlds.iter().map(|world| world.slack(pose));
    slacks.fold(f64::NEG_INFINITY, f64::max)
}

/// Returns the pose of a set's border in a direction (a unit vector), at a scale.
fn border(estimate: Pose, set: &PoseSet, direction: [f64; 3], scale: f64) -> Pose {
    let [a, b, c] = direction;
    let offset = match set {
        PoseSet::Gaussian { cov, r2 } => {
            let root = cholesky(cov);
            let by = scale * r2.sqrt();
            root.map(|row| by * (row[0] * a + row[1] * b + row[2] * c))
        }
        PoseSet::Bounded { translation, yaw } => {
            let size = a.hypot(b).max(c.abs());
            let by = scale / size;
            [by * a * translation, by * b * translation, by * c * yaw]
        }
    };
    [
        estimate[0] + offset[0],
        estimate[1] + offset[1],
        wrap(estimate[2] + offset[2]),
    ]
}

/// Returns the first scale, up to `most`, at which a set's border in a direction is outside.
fn exit(inside: Slack<'_>, estimate: Pose, set: &PoseSet, direction: [f64; 3], most: f64) -> f64 {
    let slack = |scale: f64| inside(border(estimate, set, direction, scale));
    let at = |step: usize| most * step as f64 / STEPS as f64;
    let Some(first) = (0..=STEPS).find(|step| slack(at(*step)) < 0.0) else {
        return most;
    };
    if first == 0 {
        return 0.0;
    }
    let (mut low, mut high) = (at(first - 1), at(first));
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if slack(middle) < 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// Returns an upper bound of the largest factor, up to `most`, by which a pose-set can be scaled and still lie inside. It is
/// close: the nearest poses outside are searched for along rays, and then by small steps around the best.
pub fn union_scale(
    inside: Slack<'_>,
    estimate: Pose,
    set: &PoseSet,
    most: f64,
    rng: &mut Rng,
) -> f64 {
    if inside(estimate) < 0.0 {
        return 0.0;
    }
    let unit = |v: [f64; 3]| {
        let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        v.map(|c| c / length)
    };
    // A Fibonacci lattice, rotated at random.
    let start = rng.unit();
    let mut rays: Vec<(f64, [f64; 3])> = (0..RAYS)
        .map(|i| {
            let z = 1.0 - 2.0 * (i as f64 + 0.5) / RAYS as f64;
            let angle = std::f64::consts::TAU * (start + i as f64 * 0.618_033_988_749_895);
            let ring = (1.0 - z * z).sqrt();
            let direction = [ring * angle.cos(), ring * angle.sin(), z];
            (exit(inside, estimate, set, direction, most), direction)
        })
        .collect();
    rays.sort_by(|a, b| a.0.total_cmp(&b.0));
    rays.truncate(BEST);
    let mut least = most;
    for (mut scale, mut direction) in rays {
        let mut step = 0.04;
        for _ in 0..IMPROVEMENTS {
            let moved = direction.map(|c| c + step * rng.within(-1.0, 1.0));
            let moved = unit(moved);
            let found = exit(inside, estimate, set, moved, (scale * 1.01).min(most));
            if found < scale {
                (scale, direction) = (found, moved);
            } else {
                step *= 0.9;
            }
        }
        least = least.min(scale);
    }
    least
}
