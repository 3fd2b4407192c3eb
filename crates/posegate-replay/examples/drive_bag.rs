//! Writes a synthetic recording of a robot that drives to its dock, as a ROS 2 bag (MCAP) with `/amcl_pose`, `/odom`
//! and the true pose in `/truth`, for a first try of `posegate replay`. Also writes the estimates as CSV, for
//! `posegate learn`.
//!
//! ```sh
//! cargo run --release -p posegate-replay --example drive_bag -- drive.mcap drive.csv
//! posegate replay site.toml drive.mcap --task dock --topic /amcl_pose --truth /truth --cross-terms yaw-unknown
//! ```

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::process::ExitCode;

#[allow(dead_code)]
use posegate_testkit::bags;

/// Number of estimates, ten per second.
const COUNT: u32 = 2_000;
/// Poses of the odometry per estimate.
const ODOMETRY: u32 = 3;

fn main() -> ExitCode {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let [bag, csv] = given.as_slice() else {
        eprintln!("usage: drive_bag FILE.mcap FILE.csv");
        return ExitCode::from(2);
    };
    let drive = drive();
    let files = [(bag, as_bag(&drive)), (csv, as_csv(&drive).into_bytes())];
    for (path, bytes) in files {
        if let Err(error) = std::fs::write(path, bytes) {
            eprintln!("{path}: {error}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// The true pose of the robot, and its filter's estimate.
struct Moment {
    t_s: f64,
    truth: [f64; 3],
    estimate: [f64; 3],
    sigma: [f64; 3],
}

/// Returns the true pose at a part of the drive, from 0 to 1: from 2 m before the goal (at the origin) to the goal.
fn truth(part: f64) -> [f64; 3] {
    let far = 2.0 * (1.0 - part);
    [-far, 0.05 * far, -0.02 * far]
}

/// Drives from 2 m before the goal (at the origin) to the goal. The filter's deviations decrease near the goal, and its errors
/// are somewhat larger than it states.
fn drive() -> Vec<Moment> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let normal = Normal::new(0.0, 1.2).expect("a normal distribution");
    (0..COUNT)
        .map(|k| {
            let part = f64::from(k) / f64::from(COUNT - 1);
            let far = 2.0 * (1.0 - part);
            let truth = truth(part);
            let sigma = [0.008 + 0.05 * far, 0.006 + 0.04 * far, 0.005 + 0.02 * far];
            let estimate =
                [0, 1, 2].map(|axis| truth[axis] + sigma[axis] * normal.sample(&mut random));
            Moment {
                t_s: 0.1 * f64::from(k),
                truth,
                estimate,
                sigma,
            }
        })
        .collect()
}

/// Returns the odometry: the true movement, with a deviation of 1 cm per root of a metre, in a frame of its own.
fn odometry() -> Vec<bags::Pose> {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let normal = Normal::new(0.0, 0.01).expect("a normal distribution");
    let mut at = [5.0, 3.0, 1.0];
    let mut before = truth(0.0);
    let count = ODOMETRY * (COUNT - 1);
    let poses = (0..=count).map(|k| {
        let now = truth(f64::from(k) / f64::from(count));
        let (sin, cos) = before[2].sin_cos();
        let (dx, dy) = (now[0] - before[0], now[1] - before[1]);
        let root = dx.hypot(dy).sqrt();
        let mut off = |size: f64| size * root * normal.sample(&mut random);
        let by = [
            cos * dx + sin * dy + off(1.0),
            cos * dy - sin * dx + off(1.0),
            now[2] - before[2] + off(1.0),
        ];
        let (sin, cos) = f64::sin_cos(at[2]);
        at = [
            at[0] + cos * by[0] - sin * by[1],
            at[1] + sin * by[0] + cos * by[1],
            at[2] + by[2],
        ];
        before = now;
        bags::Pose {
            t_s: 0.1 * f64::from(k) / f64::from(ODOMETRY),
            frame: "odom",
            x: at[0],
            y: at[1],
            yaw: at[2],
            ..bags::Pose::AT_DOCK
        }
    });
    poses.collect()
}

fn as_bag(drive: &[Moment]) -> Vec<u8> {
    let mut bag = bags::Bag::new(Some(bags::Compression::Zstd), true);
    for pose in odometry() {
        bag.odometry("/odom", &pose);
    }
    for moment in drive {
        let pose = |[x, y, yaw]: [f64; 3]| bags::Pose {
            t_s: moment.t_s,
            x,
            y,
            yaw,
            covariance: moment.sigma.map(|sigma| sigma * sigma),
            ..bags::Pose::AT_DOCK
        };
        bag.truth("/truth", &pose(moment.truth));
        bag.pose("/amcl_pose", &pose(moment.estimate));
    }
    bag.finish()
}

fn as_csv(drive: &[Moment]) -> String {
    let mut text = String::from(
        "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,true_x_m,true_y_m,true_yaw_rad\n",
    );
    for moment in drive {
        let ([x, y, yaw], [tx, ty, tyaw]) = (moment.estimate, moment.truth);
        let [xx, yy, aa] = moment.sigma.map(|sigma| sigma * sigma);
        text += &format!(
            "{},{x},{y},{yaw},{xx},0,0,{yy},0,{aa},{tx},{ty},{tyaw}\n",
            moment.t_s
        );
    }
    text
}
