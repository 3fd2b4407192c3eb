//! The true scale of a pose-set in a set of any form, by rays.

use super::{Constraints, Pose, PoseSet, Rng, cholesky, wrap};

/// The slack of a pose in a set: at least 0 if the set contains it.
pub type Slack<'a> = &'a (dyn Fn(Pose) -> f64 + Sync);

/// Steps of a ray in which the first pose outside is searched.
const STEPS: usize = 96;
/// Rays in all directions, those of them that are improved, and steps of an improvement.
const RAYS: usize = 3_000;
const BEST: usize = 12;
const IMPROVEMENTS: usize = 60;

/// Returns the largest slack of a pose among sets of one goal frame: at least 0 if one of them contains it.
pub fn union_slack(sets: &[Constraints], pose: Pose) -> f64 {
    let slacks = sets.iter().map(|set| set.slack(pose));
    slacks.fold(f64::NEG_INFINITY, f64::max)
}

/// A set around an estimate, as offsets of its border.
struct Border<'a> {
    estimate: Pose,
    set: &'a PoseSet,
    /// Of a Gaussian set: the factor of its covariance times its radius.
    root: [[f64; 3]; 3],
}

impl<'a> Border<'a> {
    fn new(estimate: Pose, set: &'a PoseSet) -> Self {
        let root = match set {
            PoseSet::Gaussian { cov, r2 } => {
                let by = r2.sqrt();
                cholesky(cov).map(|row| row.map(|v| v * by))
            }
            PoseSet::Bounded { .. } => [[0.0; 3]; 3],
        };
        Self {
            estimate,
            set,
            root,
        }
    }

    /// Returns the offset from the estimate to the border in a direction (a unit vector), at a scale of 1.
    fn offset(&self, direction: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = direction;
        match self.set {
            PoseSet::Gaussian { .. } => self.root.map(|row| row[0] * a + row[1] * b + row[2] * c),
            PoseSet::Bounded { translation, yaw } => {
                let by = 1.0 / a.hypot(b).max(c.abs());
                [by * a * translation, by * b * translation, by * c * yaw]
            }
        }
    }

    /// Returns the first scale, up to `most`, at which the border in a direction is outside. Without a search beyond `enough`.
    fn exit(&self, inside: Slack<'_>, direction: [f64; 3], most: f64, enough: f64) -> f64 {
        let offset = self.offset(direction);
        let slack = |scale: f64| {
            let [x, y, yaw] = self.estimate;
            let [dx, dy, turned] = offset.map(|v| v * scale);
            inside([x + dx, y + dy, wrap(yaw + turned)])
        };
        let at = |step: usize| most * step as f64 / STEPS as f64;
        let mut steps = (0..=STEPS).take_while(|step| *step == 0 || at(step - 1) <= enough);
        let Some(first) = steps.find(|step| slack(at(*step)) < 0.0) else {
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
    let border = Border::new(estimate, set);
    // A Fibonacci lattice, rotated at random. Only the rays that leave the set first are searched to their end.
    let start = rng.unit();
    let mut rays: Vec<(f64, [f64; 3])> = Vec::new();
    for i in 0..RAYS {
        let z = 1.0 - 2.0 * (i as f64 + 0.5) / RAYS as f64;
        let angle = std::f64::consts::TAU * (start + i as f64 * 0.618_033_988_749_895);
        let ring = (1.0 - z * z).sqrt();
        let direction = [ring * angle.cos(), ring * angle.sin(), z];
        let enough = rays.get(BEST - 1).map_or(most, |worst| worst.0);
        let found = border.exit(inside, direction, most, enough);
        let place = rays.partition_point(|ray| ray.0 <= found);
        rays.insert(place, (found, direction));
        rays.truncate(BEST);
    }
    let mut least = most;
    for (mut scale, mut direction) in rays {
        let mut step = 0.04;
        for _ in 0..IMPROVEMENTS {
            let moved = direction.map(|c| c + step * rng.within(-1.0, 1.0));
            let moved = unit(moved);
            let limit = (scale * 1.01).min(most);
            let found = border.exit(inside, moved, limit, limit);
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
