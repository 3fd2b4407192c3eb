//! Random pose-sets, three decisions on an estimate.

use crate::oracle::{
    Effort, PoseSet, Rng, pose_from_deg, random_estimate, random_pose_set, random_pose_set_near,
    scale_with, to_goal,
};
use crate::trial::{PriorKnowledge, SCALE_ERROR, Trial, core_set, scaled, size, yaw};
use posegate::contain::{decide_with_margin, examine};

/// One random set per this number has its margin compared with s*.
const RATIO_EVERY: usize = 20;

/// Decides on three pose-sets: a random one, the same scaled to the border of acceptance by the
/// table, and scaled to the border of the true set, from below and from above. Fewer if there is no such
/// border, or if `most` is less.
pub fn three(rng: &mut Rng, trial: &mut Trial<'_>, most: usize) {
    let world = &trial.stage.world;
    let estimate = pose_from_deg(random_estimate(rng, world));
    let random = if rng.chance(0.05) {
        wide_or_thin(rng)
    } else if rng.chance(0.1) {
        random_pose_set(rng).pose_set
    } else {
        random_pose_set_near(rng, world, estimate).pose_set
    };
    let margins = core_set(estimate, &random).map_or([0.0; 2], |set| {
        let [found, reported] = [
            examine(&trial.table, &set).margin,
            decide_with_margin(&trial.table, &set).1,
        ];
        [found, reported].map(|margin| f64::from(margin.q16()) / 65536.0)
    });
    let [margin, _] = margins;
    let exact = scale_with(world, estimate, &random, Effort::Full, SCALE_ERROR);
    // Both are lower bounds of s*.
    if margins.into_iter().any(|m| m > exact * (1.0 + SCALE_ERROR)) {
        trial.tally.false_margins += 1;
        if trial.tally.false_margins <= 3 {
            eprintln!(
                "FALSE MARGIN: {margins:?}, s* is {exact}: {estimate:?} {random:?} in {:?}",
                trial.stage.success
            );
        }
    }
    if rng.below(RATIO_EVERY) == 0 && exact > 0.0 && exact.is_finite() {
        trial.tally.ratios.push(margin / exact);
        let (mean, turn) = (to_goal(world.goal, estimate), world.goal[2]);
        let found = trial.voxels.as_ref().and_then(|voxels| {
            let escapes = |by: f64| voxels.escapes(&scaled(&random, by), mean, turn).is_some();
            cell_ratio(margin, escapes)
        });
        trial.tally.cell_ratios.extend(found);
    }
    let cell = trial.stage.cell;
    let mut scales = vec![(1.0, false)];
    for border in [margin, exact] {
        if border > 0.0 && border < 1e3 {
            // Close to the border on either side, by a millionth to a tenth.
            let off = rng.log_within(1e-7, 0.1);
            let by = border
                * if rng.chance(0.4) {
                    1.0 + off
                } else {
                    1.0 - off
                };
            scales.push((by, border * off * size(&random) <= cell));
        }
    }
    for (by, near) in scales.into_iter().take(most) {
        let set = scaled(&random, by);
        // 32 turns are the widest covariance.
        if yaw(&set) > 190.0 {
            continue;
        }
        let inside = by <= exact;
        trial.case(estimate, &set, PriorKnowledge { inside, near });
        if rng.chance(0.1) {
            trial.check_worst_pose(estimate, &set, exact / by);
        }
    }
}

/// Returns a set that turns by more than a radian, up to more than a turn, or whose axes differ by a factor of a thousand.
pub fn wide_or_thin(rng: &mut Rng) -> PoseSet {
    let length = rng.log_within(1e-4, 0.3);
    let yaw = rng.within(1.0, 7.0);
    let r2 = 11.4;
    let ratio = rng.log_within(1e-3, 1.0);
    let rho = if rng.chance(0.5) {
        0.0
    } else {
        rng.within(-0.95, 0.95)
    };
    match rng.below(3) {
        0 => PoseSet::Bounded {
            translation: length,
            yaw,
        },
        1 => {
            let [x, y, t] = [length, length * ratio, yaw].map(|v| v / f64::sqrt(r2));
            let xt = rho * x * t;
            PoseSet::Gaussian {
                cov: [[x * x, 0.0, xt], [0.0, y * y, 0.0], [xt, 0.0, t * t]],
                r2,
            }
        }
        _ => {
            let [x, y, t] = [length, length * 1e-3, 0.1 * ratio].map(|v| v / f64::sqrt(r2));
            let xy = rho * x * y;
            PoseSet::Gaussian {
                cov: [[x * x, xy, 0.0], [xy, y * y, 0.0], [0.0, 0.0, t * t]],
                r2,
            }
        }
    }
}

/// Returns the ratio of the margin to the largest scale at which no pose leaves the cells.
fn cell_ratio(margin: f64, escapes: impl Fn(f64) -> bool) -> Option<f64> {
    if margin == 0.0 || !escapes(2.0 * margin) {
        return None;
    }
    let (mut low, mut high) = (margin, 2.0 * margin);
    while high - low > 1e-4 * high {
        let middle = 0.5 * (low + high);
        if escapes(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(margin / high)
}
