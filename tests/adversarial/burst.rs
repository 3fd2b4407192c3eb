//! Bursts: many decisions about one base, close to the borders of the table and of the true set.
//!
//! The oracle's search is expensive. Therefore the true border of a base (an estimate with a pose-set) is
//! computed once. From it follows whether a changed case is inside: a smaller set of the same shape, or the
//! same set on the inner side of the place on a line where it first touches the border.

use crate::oracle::{Pose, PoseSet, Rng, below, level, scale};
use crate::sets::hard_case;
use crate::trial::{PriorKnowledge, SCALE_ERROR, Trial, scaled, size, yaw};

/// Number of bases to try before a burst is skipped.
const TRIES: usize = 12;

/// A pose-set with the scales at which it reaches the true border (scale 1) and the table's.
struct Base {
    estimate: Pose,
    set: PoseSet,
    own: f64,
}

/// Makes two bursts on one base, of at most `most` decisions. Makes none if no base is found.
pub fn bursts(rng: &mut Rng, trial: &mut Trial<'_>, most: usize) {
    let Some(base) = (0..TRIES).find_map(|_| base(rng, trial)) else {
        return;
    };
    trial.tally.bases += 1;
    let before = trial.tally.cases;
    let first = (20 + rng.below(60)).min(most);
    scale_burst(rng, trial, &base, first);
    trial.tally.bursts += 1;
    let second = (20 + rng.below(60)).min(most - first);
    if second > 0 && move_burst(rng, trial, &base, second) {
        trial.tally.bursts += 1;
    }
    trial.tally.burst_cases += trial.tally.cases - before;
}

fn base(rng: &mut Rng, trial: &Trial<'_>) -> Option<Base> {
    let world = &trial.stage.world;
    let (estimate, set) = hard_case(rng, world);
    // Cheap: an estimate off the table, or too close to its border.
    if !trial.permits(estimate, &scaled(&set, 1e-3)) {
        return None;
    }
    let exact = scale(world, estimate, &set);
    if !(exact > 1e-2 && exact < 1e3) {
        return None;
    }
    let set = scaled(&set, exact);
    // From 32 turns on it is not a pose-set.
    if yaw(&set) > 100.0 {
        return None;
    }
    let own = bisected([1e-3, 1.5], 1e-8, |scale| {
        trial.permits(estimate, &scaled(&set, scale))
    })?;
    Some(Base { estimate, set, own })
}

/// Returns the last value found to be accepted, between a value that should be accepted and one that should not.
fn bisected(
    [mut low, mut high]: [f64; 2],
    relative: f64,
    holds: impl Fn(f64) -> bool,
) -> Option<f64> {
    if !holds(low) {
        return None;
    }
    while high - low > relative * high {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}

/// Decides at scales near both borders.
fn scale_burst(rng: &mut Rng, trial: &mut Trial<'_>, base: &Base, count: usize) {
    let whole = size(&base.set);
    for _ in 0..count {
        let border = if rng.chance(0.7) { base.own } else { 1.0 };
        let off = rng.log_within(1e-7, 0.1);
        let by = border
            * if rng.chance(0.4) {
                1.0 + off
            } else {
                1.0 - off
            };
        // Moved by a micrometre and a unit of heading, so that the estimate is rounded differently.
        let mut estimate = base.estimate;
        if rng.chance(0.5) {
            let most = [1e-6, 1e-6, 2e-9];
            for (axis, most) in most.into_iter().enumerate() {
                estimate[axis] += rng.within(-most, most);
            }
        }
        let set = rounded_otherwise(rng, &scaled(&base.set, by));
        // The moved set lies in the base's set at a scale that is larger by that of the move.
        let moved = level(&base.set, base.estimate, estimate);
        let known = PriorKnowledge {
            inside: by + moved <= 1.0 + SCALE_ERROR,
            near: border * off * whole <= trial.stage.cell,
        };
        trial.case(estimate, &set, known);
    }
}

/// Returns the same set for the oracle: equal entries differ in their last bits, as in a filter.
fn rounded_otherwise(rng: &mut Rng, set: &PoseSet) -> PoseSet {
    let PoseSet::Gaussian { cov, r2 } = set else {
        return set.clone();
    };
    let cov = cov.map(|row| row.map(|v| v * (1.0 + rng.within(-4.0, 4.0) * f64::EPSILON)));
    PoseSet::Gaussian { cov, r2: *r2 }
}

/// Decides near the places where a smaller set, moved along a line, touches the borders. Returns `false` if it
/// never does.
fn move_burst(rng: &mut Rng, trial: &mut Trial<'_>, base: &Base, count: usize) -> bool {
    let world = &trial.stage.world;
    let set = scaled(&base.set, base.own * rng.log_within(0.1, 0.98));
    let (s, c) = rng.within(0.0, std::f64::consts::TAU).sin_cos();
    // A move that also turns has no single border: sets are convex only at a fixed heading.
    let turns = rng.chance(0.25);
    let rate = if turns { rng.within(-1.0, 1.0) } else { 0.0 };
    let at = |t: f64| {
        let [x, y, yaw] = base.estimate;
        [x + t * c, y + t * s, yaw + t * rate]
    };
    let holds = |t: f64| below(world, at(t), &set, 1.0, 0.0).is_none();
    let mut out = 1e-3;
    while out < 100.0 && holds(out) {
        out *= 2.0;
    }
    if out >= 100.0 {
        return false;
    }
    let Some(exact) = bisected([0.0, out], SCALE_ERROR, holds) else {
        return false;
    };
    let Some(own) = bisected([0.0, out], 1e-8, |t| trial.permits(at(t), &set)) else {
        return false;
    };
    let most = trial.stage.cell.min(0.1);
    for _ in 0..count {
        let border = if rng.chance(0.7) { own } else { exact };
        let off = rng.log_within(1e-7, most);
        let t = border + if rng.chance(0.4) { off } else { -off };
        let known = PriorKnowledge {
            inside: !turns && t >= 0.0 && t <= exact,
            near: true,
        };
        trial.case(at(t), &set, known);
    }
    true
}
