//! Random sets, pose sets and estimates. Every number is first rounded as a site file would write it
//! (1e-4 m, 1e-3 degrees), then converted to radians. So another program can get the same numbers.

use super::scale::{Effort, scale_with};
use super::sets::{signed_area, slack};
use super::written::{
    PoseSetDeg, SetDeg, degrees, heading, metres, pose_from_deg, pose_set_from_deg, set_from_deg,
};
use super::{Camera, Pose, PoseSet, World, cholesky, to_world};

/// SplitMix64.
#[derive(Clone, Debug)]
pub struct Rng(u64);

impl Rng {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns sixteen generators with different numbers. The parts of a long test that use them can run in parallel, with the same
    /// result for any number of threads.
    pub fn streams(seed: u64) -> [Self; 16] {
        core::array::from_fn(|stream| Self::new(seed.wrapping_add((stream as u64) << 40)))
    }

    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Returns a number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a number in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Returns a number in [low, high), uniform in the logarithm.
    pub fn log_within(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }

    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Returns a number in 0..n.
    pub fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n - 1)
    }
}

#[derive(Clone, Debug)]
pub struct RandomWorld {
    pub world: World,
    /// x, y in metres, yaw in degrees.
    pub goal_deg: Pose,
    pub set_deg: SetDeg,
}

#[derive(Clone, Debug)]
pub struct RandomPoseSet {
    pub pose_set: PoseSet,
    pub pose_set_deg: PoseSetDeg,
}

/// Returns a set of a random kind with a random goal. The goal pose is in the set.
pub fn random_world(rng: &mut Rng) -> RandomWorld {
    let kind = rng.below(3);
    loop {
        let yaw_deg = match rng.below(4) {
            0 => rng.within(-180.0, -177.0),
            1 => rng.within(177.0, 180.0),
            _ => rng.within(-180.0, 180.0),
        };
        let far = if rng.chance(0.1) { 100.0 } else { 10.0 };
        let goal_deg = [
            metres(rng.within(-far, far)),
            metres(rng.within(-far, far)),
            heading(yaw_deg),
        ];
        let set_deg = match kind {
            0 => random_box(rng),
            1 => random_footprint(rng),
            _ => random_tag(rng, goal_deg),
        };
        let goal = pose_from_deg(goal_deg);
        let set = set_from_deg(&set_deg, goal);
        if slack(&set, [0.0; 3]) > 0.005 {
            return RandomWorld {
                world: World { goal, set },
                goal_deg,
                set_deg,
            };
        }
    }
}

fn random_box(rng: &mut Rng) -> SetDeg {
    let mut interval = |low: f64, high: f64, round: fn(f64) -> f64| {
        let (width, share) = (rng.log_within(low, high), rng.within(0.1, 0.9));
        [round(-share * width), round((1.0 - share) * width)]
    };
    let x = interval(0.05, 1.0, metres);
    let y = interval(0.05, 1.0, metres);
    let mut yaw_deg = interval(2.0, 40.0, degrees);
    if rng.chance(0.15) {
        yaw_deg = [-180.0, 180.0];
    }
    SetDeg::Box { x, y, yaw_deg }
}

/// Returns a convex polygon around the origin, counter-clockwise, of random points on an ellipse.
fn random_polygon(rng: &mut Rng, half_x: f64, half_y: f64) -> Vec<[f64; 2]> {
    loop {
        let n = 3 + rng.below(5);
        let mut angles: Vec<f64> = (0..n).map(|_| rng.within(0.0, 360.0)).collect();
        angles.sort_by(f64::total_cmp);
        let polygon: Vec<[f64; 2]> = angles
            .iter()
            .map(|a| a.to_radians().sin_cos())
            .map(|(s, c)| [metres(half_x * c), metres(half_y * s)])
            .collect();
        let corner = |i: usize| {
            let [a, b, c] = [0, 1, 2].map(|k| polygon[(i + k) % n]);
            (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
        };
        let ellipse = std::f64::consts::PI * half_x * half_y;
        if signed_area(&polygon) > 0.3 * ellipse && (0..n).all(|i| corner(i) > 1e-3 * ellipse) {
            return polygon;
        }
    }
}

fn rectangle(half_x: f64, half_y: f64) -> Vec<[f64; 2]> {
    let (x, y) = (metres(half_x), metres(half_y));
    vec![[-x, -y], [x, -y], [x, y], [-x, y]]
}

fn random_footprint(rng: &mut Rng) -> SetDeg {
    let (x, y) = (rng.within(0.15, 2.5), rng.within(0.15, 1.0));
    let (wider, longer) = (rng.log_within(1.03, 3.0), rng.log_within(1.03, 3.0));
    let footprint = if rng.chance(0.5) {
        rectangle(x, y)
    } else {
        random_polygon(rng, x, y)
    };
    let region = if rng.chance(0.5) {
        rectangle(x * longer, y * wider)
    } else {
        random_polygon(rng, 1.3 * x * longer, 1.3 * y * wider)
    };
    SetDeg::Footprint { footprint, region }
}

fn random_tag(rng: &mut Rng, goal_deg: Pose) -> SetDeg {
    let (width, height) = [(640.0, 480.0), (848.0, 480.0), (1280.0, 720.0)][rng.below(3)];
    let fx = (width * rng.within(0.45, 1.1)).round();
    let camera = Camera {
        fx,
        fy: (fx * rng.within(0.98, 1.02)).round(),
        cx: (width * rng.within(0.45, 0.55)).round(),
        cy: (height * rng.within(0.45, 0.55)).round(),
        width,
        height,
    };
    let level = rng.chance(0.4);
    let mut angle = |most: f64| degrees(if level { 0.0 } else { rng.within(-most, most) });
    let (roll, pitch, mount_yaw) = (angle(10.0), angle(20.0), angle(40.0));
    let tilt = if rng.chance(0.2) { 15.0 } else { 0.0 };
    let mount_deg = [
        metres(rng.within(-0.2, 0.4)),
        metres(rng.within(-0.2, 0.2)),
        metres(rng.within(0.1, 1.2)),
        roll,
        pitch,
        mount_yaw,
    ];
    let distance = rng.log_within(0.4, 5.0);
    let bearing = (mount_yaw + rng.within(-20.0, 20.0)).to_radians();
    let dip = (pitch + rng.within(-15.0, 15.0)).to_radians();
    let facing = bearing.to_degrees() + 180.0 + rng.within(-40.0, 40.0);
    let flat = distance * dip.cos();
    let in_goal = [
        mount_deg[0] + flat * bearing.cos(),
        mount_deg[1] + flat * bearing.sin(),
        facing.to_radians(),
    ];
    let [x, y, yaw] = to_world(pose_from_deg(goal_deg), in_goal);
    let tag_in_world_deg = [
        metres(x),
        metres(y),
        metres(mount_deg[2] - distance * dip.sin()),
        degrees(rng.within(-tilt, tilt)),
        degrees(rng.within(-tilt, tilt)),
        heading(super::wrap(yaw).to_degrees()),
    ];
    let wide_open = rng.chance(0.15);
    SetDeg::Visibility {
        camera,
        mount_deg,
        tag_in_world_deg,
        tag_size: metres(rng.log_within(0.04, 0.4)),
        d_max: metres(distance * rng.within(1.02, 2.5)),
        phi_max_deg: degrees(if wide_open {
            90.0
        } else {
            rng.within(10.0, 60.0)
        }),
        psi_max_deg: degrees(if wide_open {
            90.0
        } else {
            rng.within(20.0, 80.0)
        }),
        z_near: 0.05,
    }
}

/// Returns an estimate (world pose, yaw in degrees) near the set's middle, or just inside or outside its border.
pub fn random_estimate(rng: &mut Rng, world: &World) -> Pose {
    let turn_per_metre = rng.log_within(0.05, 5.0);
    let direction = [
        rng.within(-1.0, 1.0),
        rng.within(-1.0, 1.0),
        rng.within(-1.0, 1.0) * turn_per_metre,
    ];
    let at = |step: f64| direction.map(|d| d * step);
    let (mut low, mut high) = (0.0, 20.0);
    for _ in 0..40 {
        let mid = 0.5 * (low + high);
        if slack(&world.set, at(mid)) >= 0.0 {
            low = mid;
        } else {
            high = mid;
        }
    }
    let share = match rng.below(10) {
        0..=4 => rng.within(0.0, 0.5),
        5..=7 => rng.within(0.5, 1.0),
        8 => 1.0 - rng.log_within(1e-4, 0.1),
        _ => 1.0 + rng.log_within(1e-4, 0.1),
    };
    let [x, y, yaw] = to_world(world.goal, at(low * share));
    [metres(x), metres(y), heading(super::wrap(yaw).to_degrees())]
}

/// Returns a pose set of random kind and size: sigmas of 1 mm to 0.5 m and 0.05 to 10 degrees.
pub fn random_pose_set(rng: &mut Rng) -> RandomPoseSet {
    let pose_set_deg = if rng.chance(0.4) {
        PoseSetDeg::Bounded {
            translation: metres(rng.log_within(0.001, 1.0)),
            yaw_deg: degrees(rng.log_within(0.05, 20.0)),
        }
    } else {
        PoseSetDeg::Gaussian {
            sigma_deg: [
                metres(rng.log_within(0.001, 0.5)),
                metres(rng.log_within(0.001, 0.5)),
                degrees(rng.log_within(0.05, 10.0)),
            ],
            correlation: random_correlation(rng),
            epsilon: [0.9, 0.95, 0.99, 0.999][rng.below(4)],
        }
    };
    RandomPoseSet {
        pose_set: pose_set_from_deg(&pose_set_deg),
        pose_set_deg,
    }
}

/// Returns three correlations up to 0.95 each, of a matrix that is clearly positive definite.
fn random_correlation(rng: &mut Rng) -> [f64; 3] {
    if rng.chance(0.25) {
        return [0.0; 3];
    }
    loop {
        let c = [0; 3].map(|_| (rng.within(-0.95, 0.95) * 1e3).round() / 1e3);
        let l = cholesky(&[[1.0, c[0], c[1]], [c[0], 1.0, c[2]], [c[1], c[2], 1.0]]);
        if (1..3).all(|i| l[i][i] > 0.05) {
            return c;
        }
    }
}

/// As [`random_pose_set`], resized so that its s* is about 1 (0.4 to 2.5) if the size limits allow.
pub fn random_pose_set_near(rng: &mut Rng, world: &World, estimate: Pose) -> RandomPoseSet {
    let drawn = random_pose_set(rng);
    let s = scale_with(world, estimate, &drawn.pose_set, Effort::Fast, 1e-3);
    let factor = s * rng.log_within(0.4, 2.5);
    if s <= 0.0 || !factor.is_finite() {
        return drawn;
    }
    let length = |v: f64, most: f64| metres((v * factor).clamp(0.001, most));
    let angle = |v: f64, most: f64| degrees((v * factor).clamp(0.05, most));
    let pose_set_deg = match drawn.pose_set_deg {
        PoseSetDeg::Bounded {
            translation,
            yaw_deg,
        } => PoseSetDeg::Bounded {
            translation: length(translation, 1.0),
            yaw_deg: angle(yaw_deg, 20.0),
        },
        PoseSetDeg::Gaussian {
            sigma_deg: [x, y, yaw],
            correlation,
            epsilon,
        } => PoseSetDeg::Gaussian {
            sigma_deg: [length(x, 0.5), length(y, 0.5), angle(yaw, 10.0)],
            correlation,
            epsilon,
        },
    };
    RandomPoseSet {
        pose_set: pose_set_from_deg(&pose_set_deg),
        pose_set_deg,
    }
}
