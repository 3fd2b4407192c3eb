//! A double-precision oracle for the tests: success sets, pose sets and the scale s* of a pose set in a
//! success set, written from the conventions. It uses no code of the crate under test.
//!
//! Units are metres and radians; fields that end in `_deg` hold degrees. A pose is `[x, y, yaw]`.
#![allow(dead_code, unused_imports)]

pub mod cases;
pub mod random;
pub mod scale;
pub mod search;
pub mod sets;
pub mod union;
pub mod written;

pub use random::{
    RandomPoseSet, RandomWorld, Rng, random_estimate, random_pose_set, random_pose_set_near,
    random_world,
};
pub use scale::{Effort, below, min_slack_over, scale, scale_with};
pub use sets::{Camera, Constraints, Set, Sight, World, inside, sight, slack};
pub use union::{Slack, union_scale, union_slack};
pub use written::{PoseSetDeg, SetDeg, pose_from_deg, pose_set_from_deg, set_from_deg};

use std::f64::consts::{PI, TAU};

/// `[x, y, yaw]`.
pub type Pose = [f64; 3];

/// An epsilon-pose-set around an estimate, in world axes.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseSet {
    /// `{ e' cov^-1 e <= r2 }`.
    Gaussian { cov: [[f64; 3]; 3], r2: f64 },
    /// `{ |(ex, ey)| <= translation, |eyaw| <= yaw }`.
    Bounded { translation: f64, yaw: f64 },
}

/// Wraps an angle to [-pi, pi).
pub fn wrap(angle: f64) -> f64 {
    let a = angle - TAU * (angle / TAU).round();
    if a >= PI {
        a - TAU
    } else if a < -PI {
        a + TAU
    } else {
        a
    }
}

/// Returns `R(angle) v`.
pub fn turn(angle: f64, v: [f64; 2]) -> [f64; 2] {
    let (s, c) = angle.sin_cos();
    [c * v[0] - s * v[1], s * v[0] + c * v[1]]
}

/// Returns `T_w_g^-1 p`: a world pose in the goal frame (yaw is not wrapped).
pub fn to_goal(goal: Pose, p: Pose) -> Pose {
    let [x, y] = turn(-goal[2], [p[0] - goal[0], p[1] - goal[1]]);
    [x, y, p[2] - goal[2]]
}

/// Returns `T_w_g q`: a goal-frame pose in the world frame (yaw is not wrapped).
pub fn to_world(goal: Pose, q: Pose) -> Pose {
    let [x, y] = turn(goal[2], [q[0], q[1]]);
    [goal[0] + x, goal[1] + y, goal[2] + q[2]]
}

/// Returns the factor by which `pose_set` must be scaled for `pose` to lie on its border: at most 1 inside. The yaw error is a real number of
/// which the pose is the wrap: the least over all turns.
pub fn level(pose_set: &PoseSet, estimate: Pose, pose: Pose) -> f64 {
    let [x, y] = [pose[0] - estimate[0], pose[1] - estimate[1]];
    let apart = pose[2] - estimate[2];
    match pose_set {
        PoseSet::Bounded { translation, yaw } => {
            (x.hypot(y) / translation).max(wrap(apart).abs() / yaw)
        }
        PoseSet::Gaussian { cov, r2 } => {
            // Forward substitution with the Cholesky factor: |L^-1 e|. The turn that is nearest to the likeliest yaw error has the least.
            let l = cholesky(cov);
            let z0 = x / l[0][0];
            let z1 = (y - l[1][0] * z0) / l[1][1];
            let z2 = wrap(apart - l[2][0] * z0 - l[2][1] * z1) / l[2][2];
            ((z0 * z0 + z1 * z1 + z2 * z2) / r2).sqrt()
        }
    }
}

/// Returns the lower Cholesky factor of a positive definite 3x3 matrix (NaN for other matrices).
pub fn cholesky(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut l = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let rest = m[i][j] - sum;
            l[i][j] = if i == j { rest.sqrt() } else { rest / l[j][j] };
        }
    }
    l
}

/// Returns the chi-square quantile with 3 degrees of freedom: the r2 at which the probability is `epsilon`.
pub fn chi2_quantile_3dof(epsilon: f64) -> f64 {
    assert!(epsilon > 0.0 && epsilon < 1.0, "epsilon must lie in (0, 1)");
    // The smaller tail is used, so that neither end loses digits.
    let above = epsilon > 0.5;
    let excess = |r2: f64| {
        if above {
            (1.0 - epsilon) - upper_tail(r2 / 2.0)
        } else {
            lower_tail(r2 / 2.0) - epsilon
        }
    };
    let (mut low, mut high) = (0.0, 200.0);
    let mut r2: f64 = 2.366;
    for _ in 0..200 {
        let f = excess(r2);
        if f > 0.0 {
            high = r2;
        } else {
            low = r2;
        }
        let density = (r2 / TAU).sqrt() * (-r2 / 2.0).exp();
        let newton = r2 - f / density;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - r2).abs() <= 1e-15 * r2 {
            return next;
        }
        r2 = next;
    }
    r2
}

/// Returns `z^1.5 e^-z`.
fn gamma_front(z: f64) -> f64 {
    z * z.sqrt() * (-z).exp()
}

/// Returns the regularised lower incomplete gamma function P(3/2, z), by its series (all terms positive).
fn lower_tail(z: f64) -> f64 {
    let (mut term, mut sum, mut a) = (1.0, 1.0, 1.5);
    while term > 1e-17 * sum {
        a += 1.0;
        term *= z / a;
        sum += term;
    }
    // Gamma(5/2) = 3 sqrt(pi) / 4.
    gamma_front(z) * sum / (0.75 * PI.sqrt())
}

/// Returns Q(3/2, z) = 1 - P(3/2, z), by Lentz's continued fraction where that converges.
fn upper_tail(z: f64) -> f64 {
    if z < 2.5 {
        return 1.0 - lower_tail(z);
    }
    let mut b = z - 0.5;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut h = d;
    for i in 1..500 {
        let i = f64::from(i);
        let an = -i * (i - 1.5);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        h *= c * d;
        if (c * d - 1.0).abs() < 1e-16 {
            break;
        }
    }
    // Gamma(3/2) = sqrt(pi) / 2.
    gamma_front(z) * h / (0.5 * PI.sqrt())
}
