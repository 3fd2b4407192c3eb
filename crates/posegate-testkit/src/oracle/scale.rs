//! The least slack over a scaled pose set, and the scale s* at which it reaches 0.

use super::search::{Lowest, Slices, Tolerance, lower};
use super::sets::{World, constraints};
use super::{Pose, PoseSet, to_goal, to_world, turn, wrap};
use std::f64::consts::PI;

/// The accuracy of the search. The returned value is always attained at the returned pose; the true least
/// slack is lower by at most the tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// To 2e-5, or 1e-3 of the value: tens of microseconds at most.
    Fast,
    /// To 1e-10, or 1e-8 of the value.
    Full,
}

impl Effort {
    fn tolerance(self) -> Tolerance {
        match self {
            Self::Fast => Tolerance {
                absolute: 2e-5,
                relative: 1e-3,
            },
            Self::Full => Tolerance {
                absolute: 1e-10,
                relative: 1e-8,
            },
        }
    }
}

/// The pose set scaled by `scale`, in the goal frame.
fn slices(goal: Pose, estimate: Pose, pose_set: &PoseSet, scale: f64) -> Slices {
    let at = to_goal(goal, estimate);
    match *pose_set {
        PoseSet::Bounded { translation, yaw } => Slices {
            at,
            lean: [0.0; 2],
            shape: [[1.0, 0.0], [0.0, 1.0]],
            radius: scale * translation,
            round: false,
            reach: (scale * yaw).min(PI),
            half: 1.0,
        },
        PoseSet::Gaussian { ref cov, r2 } => {
            let variance = cov[2][2];
            let share = |c: f64| if variance > 0.0 { c / variance } else { 0.0 };
            let lean = [share(cov[0][2]), share(cov[1][2])];
            // The conditional covariance of x, y at a given yaw, then its Cholesky factor.
            let xx = cov[0][0] - lean[0] * cov[0][2];
            let xy = cov[0][1] - lean[0] * cov[1][2];
            let yy = cov[1][1] - lean[1] * cov[1][2];
            let a = xx.max(0.0).sqrt();
            let b = if a > 0.0 { xy / a } else { 0.0 };
            let d = (yy - b * b).max(0.0).sqrt();
            let [c0, c1] = [[a, b], [0.0, d]].map(|column| turn(-goal[2], column));
            let radius = scale * r2.sqrt();
            let reach = radius * variance.sqrt();
            Slices {
                at,
                lean: turn(-goal[2], lean),
                shape: [[c0[0], c1[0]], [c0[1], c1[1]]],
                radius,
                round: true,
                reach,
                // The yaw error is a real number, also beyond half a turn.
                half: 0.5 * PI,
            }
        }
    }
}

/// Returns the least slack over `pose_set` scaled by `scale`, and a world pose (yaw not wrapped) that has it.
pub fn min_slack_over(
    world: &World,
    estimate: Pose,
    pose_set: &PoseSet,
    scale: f64,
    effort: Effort,
) -> (f64, Pose) {
    least(world, estimate, pose_set, scale, effort, f64::INFINITY)
}

/// Returns the least slack and its pose if some pose of `pose_set` scaled by `scale` has a slack below
/// `level`. For a set above the level this is much cheaper than the least slack, because only poses near
/// the level are evaluated.
pub fn below(
    world: &World,
    estimate: Pose,
    pose_set: &PoseSet,
    scale: f64,
    level: f64,
) -> Option<(f64, Pose)> {
    let found = least(world, estimate, pose_set, scale, Effort::Full, level);
    (found.0 < level).then_some(found)
}

/// Returns the least slack if it is below `level`; else `level`.
fn least(
    world: &World,
    estimate: Pose,
    pose_set: &PoseSet,
    scale: f64,
    effort: Effort,
    level: f64,
) -> (f64, Pose) {
    let slices = slices(world.goal, estimate, pose_set, scale);
    let (all, arc) = constraints(&world.set);
    let mut best = Lowest {
        value: level,
        pose: slices.at,
    };
    if let Some(arc) = arc {
        // The yaw of the pose set that is farthest from the arc's middle.
        let off = wrap(slices.at[2] - arc.mid);
        let most = slices.reach.min(PI);
        let step = most.min(PI - off.abs()).copysign(off);
        let value = arc.half - (off.abs() + step.abs());
        if value < best.value {
            best.value = value;
            best.pose = [
                slices.at[0] + slices.lean[0] * step,
                slices.at[1] + slices.lean[1] * step,
                slices.at[2] + step,
            ];
        }
    }
    // The constraint with the least slack at the estimate is first, so that it prunes the others.
    let mut order: Vec<_> = all.iter().map(|c| (c.value(slices.at), c)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (_, c) in order {
        lower(c, &slices, effort.tolerance(), &mut best);
    }
    (best.value, to_world(world.goal, best.pose))
}

/// Returns s*: the largest factor by which `pose_set` can be scaled and still lie in the set; 0 if the
/// estimate is outside, infinite if the pose set never leaves.
pub fn scale(world: &World, estimate: Pose, pose_set: &PoseSet) -> f64 {
    scale_with(world, estimate, pose_set, Effort::Full, 1e-10)
}

/// As [`scale`], with a chosen effort and relative accuracy.
pub fn scale_with(
    world: &World,
    estimate: Pose,
    pose_set: &PoseSet,
    effort: Effort,
    relative: f64,
) -> f64 {
    let least = |s: f64| min_slack_over(world, estimate, pose_set, s, effort).0;
    let at_estimate = world.slack(estimate);
    if at_estimate < 0.0 {
        return 0.0;
    }
    let (mut low, mut f_low) = (0.0, at_estimate);
    let (mut high, mut f_high) = (1.0, least(1.0));
    while f_high >= 0.0 {
        if high > 1e9 {
            return f64::INFINITY;
        }
        (low, f_low) = (high, f_high);
        high *= 2.0;
        f_high = least(high);
    }
    // Illinois' method, with a halving step whenever three rounds have not shrunk the bracket to half.
    let mut wide = high - low;
    let mut last_low = None;
    for round in 1..400 {
        if high - low <= relative * high {
            break;
        }
        let mut s = low + (high - low) * f_low / (f_low - f_high);
        if round % 3 == 0 {
            if high - low > 0.5 * wide {
                s = 0.5 * (low + high);
            }
            wide = high - low;
        }
        // Keeps a step inside the bracket, so that both ends converge.
        let edge = 0.25 * relative * high;
        s = s.clamp((low + edge).min(high), (high - edge).max(low));
        let f = least(s);
        if f >= 0.0 {
            (low, f_low) = (s, f);
            if last_low == Some(true) {
                f_high *= 0.5;
            }
        } else {
            (high, f_high) = (s, f);
            if last_low == Some(false) {
                f_low *= 0.5;
            }
        }
        last_low = Some(f >= 0.0);
    }
    0.5 * (low + high)
}
