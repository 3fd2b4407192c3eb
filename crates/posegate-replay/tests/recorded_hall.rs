//! The time for which an interlock with the exact sets would have been open on the recorded hall; `./ci.sh recorded
//! DIR` prints it with the time of the gate. In plain floats: the covariance is propagated exactly, the fix is
//! carried from its exact stamp, and slip and motion are a disc. The hall is a box along the world's axes, so the sum
//! of ellipsoid and disc is inside exactly if its extents are.

use posegate::report::Heading;
use posegate::set::Uncertainty;
use posegate_replay::recording::{Bag, Item, Recording, Role, Wanted};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// The task `hall` of `examples/sites/turtlebot.toml`: the goal, and the box about it (m, m, rad).
const GOAL: [f64; 2] = [11.5, 9.0];
const BOX: [f64; 3] = [8.0, 3.5, 120.0 / 180.0 * std::f64::consts::PI];
/// The quantile of 0.99 with 3 degrees of freedom.
const RADIUS_SQUARED: f64 = 11.344_866_730_144_37;
/// The settings of `posegate replay`: its defaults, and the speeds that the job gives.
const SPEED: f64 = 0.5;
const RATE: f64 = 60.0 / 180.0 * std::f64::consts::PI;
const HOLD_S: f64 = 0.1;
const RESPONSE_S: f64 = 0.02;
const INHIBIT_S: f64 = 0.5;
const IN_A_ROW: u32 = 3;
const GAP_S: f64 = 0.2;
const NOISE: [f64; 3] = [0.02, 0.05, 0.02];
const SLIP: f64 = 0.02;

/// A pose (m, m, rad) with its time, seconds.
type Timed = (f64, [f64; 3]);
type Matrix = [[f64; 3]; 3];

struct Fix {
    t_s: f64,
    mean: [f64; 3],
    covariance: Matrix,
}

fn read(path: &Path) -> (Vec<Fix>, Vec<Timed>) {
    let topics = [
        ("/amcl_pose", Role::Estimates(0)),
        ("/odom", Role::Odometry),
    ];
    let topics = topics.map(|(topic, role)| Wanted {
        topic: topic.into(),
        role,
    });
    let file = File::open(path).expect("the recording");
    let mut bag = Bag::new(BufReader::new(file), "nav2", &topics);
    let (mut fixes, mut odometry) = (Vec::new(), Vec::new());
    while let Some(item) = bag.next().expect("a bag") {
        match item {
            Item::Truth(pose) => odometry.push((pose.t_s, pose.level())),
            Item::Estimate(sample) => {
                let Heading::Quaternion([x, y, z, w]) = sample.belief.heading else {
                    panic!("a quaternion");
                };
                let Some(Uncertainty::Gaussian(covariance)) = sample.belief.spread else {
                    panic!("a covariance");
                };
                let yaw = f64::atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z);
                fixes.push(Fix {
                    t_s: sample.t_s,
                    mean: [sample.belief.x_m, sample.belief.y_m, yaw],
                    covariance,
                });
            }
            Item::Detections { .. } => {}
        }
    }
    (fixes, odometry)
}

fn wrapped(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round()
}

/// The movement from one pose to another, in the robot's axes at the first.
fn between(from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    let (s, c) = from[2].sin_cos();
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    [c * dx + s * dy, c * dy - s * dx, wrapped(to[2] - from[2])]
}

/// A fix that is carried.
#[derive(Clone)]
struct Carried {
    mean: [f64; 3],
    covariance: Matrix,
    length: f64,
    turned: f64,
}

impl Carried {
    fn of(fix: &Fix) -> Self {
        let [[xx, xy, _], [_, yy, _], [_, _, tt]] = fix.covariance;
        // AMCL gives no terms between position and heading: twice both parts is above every covariance with any such
        // terms.
        let covariance =
            [[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, tt]].map(|row| row.map(|v| 2.0 * v));
        Self {
            mean: fix.mean,
            covariance,
            length: 0.0,
            turned: 0.0,
        }
    }

    fn moves(&mut self, by: [f64; 3]) {
        let (s, c) = self.mean[2].sin_cos();
        let way = [c * by[0] - s * by[1], s * by[0] + c * by[1]];
        let jacobian = [-way[1], way[0], 1.0];
        let p = self.covariance;
        let g = |i: usize, j: usize| {
            let lever = |k: usize| if k < 2 { jacobian[k] } else { 0.0 };
            p[i][j] + lever(i) * p[2][j] + lever(j) * p[i][2] + lever(i) * lever(j) * p[2][2]
        };
        self.covariance = std::array::from_fn(|i| std::array::from_fn(|j| g(i, j)));
        let (length, turn) = (by[0].hypot(by[1]), by[2].abs());
        let plane = NOISE[0] * NOISE[0] * length;
        self.covariance[0][0] += plane;
        self.covariance[1][1] += plane;
        self.covariance[2][2] += NOISE[1] * NOISE[1] * turn + NOISE[2] * NOISE[2] * length;
        self.mean = [
            self.mean[0] + way[0],
            self.mean[1] + way[1],
            self.mean[2] + by[2],
        ];
        self.length += length;
        self.turned += turn;
    }

    fn is_inside(&self) -> bool {
        let turn_slip = SLIP * self.turned;
        let seconds = HOLD_S + RESPONSE_S;
        let disc = SLIP * self.length + turn_slip * self.length + SPEED * seconds;
        let more = [disc, disc, turn_slip + RATE * seconds];
        let off = [
            self.mean[0] - GOAL[0],
            self.mean[1] - GOAL[1],
            wrapped(self.mean[2]),
        ];
        (0..3).all(|k| {
            let reach = (RADIUS_SQUARED * self.covariance[k][k]).sqrt() + more[k];
            off[k].abs() + reach <= BOX[k]
        })
    }
}

/// The gate's memory: permits in a row, and the time since a denial.
#[derive(Default)]
struct Memory {
    row: u32,
    since_s: f64,
    last_s: f64,
    is_open: bool,
    open_s: f64,
    openings: u32,
}

impl Memory {
    fn step(&mut self, now_s: f64, permitted: bool) {
        let passed = now_s - self.last_s;
        if self.is_open {
            self.open_s += passed.min(HOLD_S);
        }
        if passed > HOLD_S || !permitted {
            (self.row, self.is_open) = (0, false);
        }
        if permitted {
            if self.row == 0 {
                self.since_s = now_s;
            }
            self.row += 1;
            let opens = self.row >= IN_A_ROW && now_s - self.since_s >= INHIBIT_S;
            self.openings += u32::from(opens && !self.is_open);
            self.is_open |= opens;
        }
        self.last_s = now_s;
    }
}

#[test]
#[ignore = "needs the recordings: ./ci.sh recorded DIR"]
fn recorded_hall_with_exact_sets() {
    let folder = std::env::var("POSEGATE_RECORDED")
        .expect("POSEGATE_RECORDED names the folder of the recordings");
    let (fixes, odometry) = read(&Path::new(&folder).join("nav2/nav2_turtlebot.mcap"));
    assert!(fixes.len() > 100 && odometry.len() > 1_000);
    let mut memory = Memory::default();
    let mut carried: Option<Carried> = None;
    let mut fixes = fixes.iter().peekable();
    let first_s = fixes.peek().map_or(0.0, |fix| fix.t_s);
    let last_s = fixes.clone().last().map_or(0.0, |fix| fix.t_s);
    for pair in odometry.windows(2) {
        let [(before_s, before), (now_s, now)] = [pair[0], pair[1]];
        let by = between(before, now);
        if let Some(carried) = &mut carried {
            carried.moves(by);
        }
        if now_s - before_s > GAP_S {
            carried = None;
        }
        while let Some(fix) = fixes.next_if(|fix| fix.t_s <= now_s) {
            // The rest of the increment after the stamp.
            let share = ((now_s - fix.t_s) / (now_s - before_s)).clamp(0.0, 1.0);
            let mut new = Carried::of(fix);
            new.moves(by.map(|v| share * v));
            // A fix from before the start of the odometry is ignored.
            if fix.t_s >= before_s {
                carried = (now_s - before_s <= GAP_S).then_some(new);
            }
        }
        if (first_s..=last_s).contains(&now_s) {
            let permitted = carried.as_ref().is_some_and(Carried::is_inside);
            memory.step(now_s, permitted);
        }
    }
    println!(
        "{{\"name\": \"nav2, hall, oracle with exact sets and the odometry\", \"value\": {:.2}, \"unit\": \"s open\", \"openings\": {}, \"goal\": null}}",
        memory.open_s, memory.openings
    );
    assert!(memory.open_s > 0.0);
}
