//! Simulates a robot that executes a plan: the true pose, observations, the errors of odometry and controller,
//! often at the limits that the site allows. Shares no code with the planner. Its inputs are the tasks and places
//! of the plan, and the sets and models of the site file.

use crate::planning_sites::Random;

/// x, y, yaw.
pub type Pose = [f64; 3];

/// The error model of driving.
#[derive(Clone, Copy, Debug)]
pub enum Model {
    /// k_turn, k_drift, k_slip.
    Bounded([f64; 3]),
    /// a1 to a4.
    Gaussian([f64; 4]),
}

/// A success set as the site file defines it.
#[derive(Clone, Debug)]
pub enum Set {
    Box {
        goal: Pose,
        x: f64,
        y: f64,
        yaw: f64,
    },
    Tag {
        /// x, y, z, yaw.
        pose: [f64; 4],
        size: f64,
    },
    /// A tag seen past walls that are higher than tag and camera, with bits of at least `bit_px` pixels.
    #[allow(dead_code)] // Only the covered site has walls.
    Past {
        /// x, y, z, yaw.
        pose: [f64; 4],
        size: f64,
        bit_px: f64,
        /// Convex outlines, counter-clockwise.
        walls: Vec<Vec<[f64; 2]>>,
    },
}

/// A step of the plan.
#[derive(Clone, Debug)]
pub enum Step {
    Look {
        set: Set,
        /// r_l: metres, radians.
        bound: [f64; 2],
        /// Probability that an observation is farther off than the bound.
        doubt: f64,
    },
    Drive {
        to: Pose,
    },
    Work {
        set: Set,
    },
}

/// The uncertainty at the start.
#[derive(Clone, Copy, Debug)]
pub enum Start {
    Bounded([f64; 2]),
    /// Standard deviations.
    Gaussian(Pose),
}

/// How a robot drives.
#[derive(Clone, Copy, Debug)]
pub struct Robot {
    pub model: Model,
    /// Largest distance of the estimate from the end of a drive: metres, radians.
    pub controller: [f64; 2],
}

fn normal(random: &mut Random) -> f64 {
    let (u, v) = (random.unit().max(1e-300), random.unit());
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// Returns a random offset in a cylinder, on its border in half of all cases.
fn within(random: &mut Random, [radius, yaw]: [f64; 2]) -> Pose {
    let border = random.unit() < 0.5;
    let rho = if border {
        radius
    } else {
        radius * random.unit().sqrt()
    };
    let direction = random.between(0.0, std::f64::consts::TAU);
    let turn = if border {
        if random.unit() < 0.5 { yaw } else { -yaw }
    } else {
        random.between(-yaw, yaw)
    };
    // Kept inside by more than the rounding of floats.
    let inside = 1.0 - 1e-9;
    [
        inside * rho * direction.cos(),
        inside * rho * direction.sin(),
        inside * turn,
    ]
}

fn plus(a: Pose, b: Pose) -> Pose {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn wrapped(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

impl Set {
    /// Returns `true` if a pose is in the set.
    pub fn holds(&self, pose: Pose) -> bool {
        match self {
            Self::Box { goal, x, y, yaw } => {
                let (s, c) = goal[2].sin_cos();
                let (dx, dy) = (pose[0] - goal[0], pose[1] - goal[1]);
                (c * dx + s * dy).abs() <= *x
                    && (c * dy - s * dx).abs() <= *y
                    && wrapped(pose[2] - goal[2]).abs() <= *yaw
            }
            Self::Past {
                pose: tag,
                size,
                bit_px,
                walls,
            } => {
                let whole = Self::Tag {
                    pose: *tag,
                    size: *size,
                };
                let (s, c) = pose[2].sin_cos();
                let camera = [pose[0] + 0.25 * c, pose[1] + 0.25 * s, 0.5];
                let ray = [tag[0] - camera[0], tag[1] - camera[1], tag[2] - camera[2]];
                let square = ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2];
                let (ts, tc) = tag[3].sin_cos();
                // f b cos(psi) / d, with eight bits per edge.
                let wide = -615.0 * size / 8.0 * (ray[0] * tc + ray[1] * ts) / square;
                let seen = [-0.5, 0.5].iter().all(|across| {
                    let corner = [tag[0] - across * size * ts, tag[1] + across * size * tc];
                    let eye = [camera[0], camera[1]];
                    walls.iter().all(|wall| !crosses(eye, corner, wall))
                });
                whole.holds(pose) && wide >= *bit_px && seen
            }
            Self::Tag { pose: tag, size } => {
                // The camera of the sites: 0.25 m ahead, 0.5 m high, level; 640 x 480, f = 615.
                let (s, c) = pose[2].sin_cos();
                let camera = [pose[0] + 0.25 * c, pose[1] + 0.25 * s, 0.5];
                let ray = [tag[0] - camera[0], tag[1] - camera[1], tag[2] - camera[2]];
                let d = (ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]).sqrt();
                let ahead = ray[0] * c + ray[1] * s;
                let (ts, tc) = tag[3].sin_cos();
                let facing = -(ray[0] * tc + ray[1] * ts);
                let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
                let seen = corners.iter().all(|(across, up)| {
                    let corner = [
                        ray[0] - across * size * ts,
                        ray[1] + across * size * tc,
                        ray[2] + up * size,
                    ];
                    let z = corner[0] * c + corner[1] * s;
                    let left = corner[1] * c - corner[0] * s;
                    z >= 0.05
                        && (320.0 * z - 615.0 * left).abs() <= 1e9
                        && (615.0 * left).abs() <= 320.0 * z
                        && (615.0 * corner[2]).abs() <= 240.0 * z
                });
                seen && d <= 5.5
                    && ahead >= d * 25f64.to_radians().cos()
                    && facing >= d * 50f64.to_radians().cos()
            }
        }
    }
}

/// Returns `true` if a segment passes through the inside of a convex outline (by more than a micrometre).
fn crosses(from: [f64; 2], to: [f64; 2], outline: &[[f64; 2]]) -> bool {
    let (mut low, mut high) = (0.0f64, 1.0f64);
    for (number, a) in outline.iter().enumerate() {
        let b = outline[(number + 1) % outline.len()];
        let edge = (b[0] - a[0]).hypot(b[1] - a[1]);
        let inside = |p: [f64; 2]| {
            ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / edge - 1e-6
        };
        let (start, end) = (inside(from), inside(to));
        if start <= 0.0 && end <= 0.0 {
            return false;
        }
        let share = start / (start - end);
        if start < 0.0 {
            low = low.max(share);
        } else if end < 0.0 {
            high = high.min(share);
        }
    }
    low < high
}

/// Simulates one run. Returns the number of the step that fails, if one does.
pub fn run(
    random: &mut Random,
    start: Pose,
    known: Start,
    robot: &Robot,
    steps: &[Step],
) -> Option<usize> {
    let mut estimate = start;
    let error = match known {
        Start::Bounded(bound) => within(random, bound),
        Start::Gaussian(sigmas) => sigmas.map(|sigma| sigma * normal(random)),
    };
    let mut truth = plus(estimate, error);
    // Failures of looks may depend on each other, so one random number decides which look fails.
    let fate = random.unit();
    let mut spent = 0.0;
    for (number, step) in steps.iter().enumerate() {
        match step {
            Step::Work { set } => {
                if !set.holds(truth) {
                    return Some(number);
                }
            }
            Step::Look { set, bound, doubt } => {
                if !set.holds(truth) || (fate >= spent && fate < spent + doubt) {
                    return Some(number);
                }
                spent += doubt;
                estimate = plus(truth, within(random, *bound));
            }
            Step::Drive { to } => {
                (estimate, truth) = drive(random, estimate, truth, *to, robot);
            }
        }
    }
    None
}

/// Simulates a drive from the estimate to a place. Returns the estimate and the true pose after it.
fn drive(random: &mut Random, from: Pose, truth: Pose, to: Pose, robot: &Robot) -> (Pose, Pose) {
    // The controller stops near the place, and the odometry has measured the path that was driven.
    let to = plus(to, within(random, robot.controller));
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    let bearing = if length > 0.0 { dy.atan2(dx) } else { from[2] };
    let (rot1, rot2) = (wrapped(bearing - from[2]), wrapped(to[2] - bearing));
    let off = wrapped(truth[2] - from[2]);
    let arrived = match robot.model {
        Model::Bounded([k_turn, k_drift, k_slip]) => {
            let turning = rot1.abs() + rot2.abs();
            let most = k_turn * turning + k_drift * length;
            // The heading error exists from the beginning of the path, grows along it, or both.
            let more = if random.unit() < 0.5 {
                most
            } else {
                random.between(0.0, most)
            };
            let more = if random.unit() < 0.5 { more } else { -more };
            let early = if random.unit() < 0.5 {
                1.0
            } else {
                random.unit()
            };
            let mut at = [truth[0], truth[1]];
            let parts = 16;
            for part in 0..parts {
                let share = (f64::from(part) + 0.5) / f64::from(parts);
                let error = off + more * (early + (1.0 - early) * share);
                let (s, c) = (bearing + error).sin_cos();
                at[0] += c * length / f64::from(parts);
                at[1] += s * length / f64::from(parts);
            }
            let slip = within(random, [k_slip * length, 0.0]);
            [at[0] + slip[0], at[1] + slip[1], to[2] + off + more]
        }
        Model::Gaussian([a1, a2, a3, a4]) => {
            let noise = |random: &mut Random, variance: f64| variance.sqrt() * normal(random);
            let turn1 = rot1 + noise(random, a1 * rot1 * rot1 + a2 * length * length);
            let way = length
                + noise(
                    random,
                    a3 * length * length + a4 * (rot1 * rot1 + rot2 * rot2),
                );
            let turn2 = rot2 + noise(random, a1 * rot2 * rot2 + a2 * length * length);
            let (s, c) = (truth[2] + turn1).sin_cos();
            [
                truth[0] + way * c,
                truth[1] + way * s,
                truth[2] + turn1 + turn2,
            ]
        }
    };
    (to, arrived)
}

/// Returns a lower bound of the failure rate, from the failures in `runs` runs, at a confidence of 1 - 1e-6
/// (Clopper-Pearson, by bisection of the binomial's tail).
pub fn least_rate(failures: u64, runs: u64) -> f64 {
    if failures == 0 {
        return 0.0;
    }
    let ln_choose = |n: u64, k: u64| ln_factorial(n) - ln_factorial(k) - ln_factorial(n - k);
    let at_least = |p: f64| -> f64 {
        // P(X >= failures), as 1 minus the sum of the smaller counts.
        let below: f64 = (0..failures)
            .map(|k| {
                (ln_choose(runs, k) + k as f64 * p.ln() + (runs - k) as f64 * (-p).ln_1p()).exp()
            })
            .sum();
        1.0 - below
    };
    let (mut low, mut high) = (0.0, failures as f64 / runs as f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_least(middle) < 1e-6 {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

fn ln_factorial(n: u64) -> f64 {
    if n < 256 {
        return (2..=n).map(|k| (k as f64).ln()).sum();
    }
    let n = n as f64;
    n * n.ln() - n + 0.5 * (std::f64::consts::TAU * n).ln() + 1.0 / (12.0 * n)
}
