//! The arguments of `posegate replay`.

use crate::arguments::{choice, numbers};
use crate::belief::SetArgs;
use crate::gate::motion;
use crate::recording::{Options, Reading};
use crate::site_input::Failure;
use posegate::motion::MotionBounds;
use posegate::set::{CrossTerms, Inflation, SplitWeight, Trust};
use posegate_files::files::{Input, Output};
use posegate_replay::replay::Clock;
use posegate_site::Site;

/// The largest number of true poses of a topic that are kept.
const MOST_TRUE: usize = 1 << 17;

/// Replays a recording through the gate: what the gate would have permitted, and which permits were
/// false
///
/// The recording is CSV (the columns of `posegate gate`, with t_s; true_x_m, true_y_m, true_yaw_rad if the truth is
/// known), a trajectory (TUM, EuRoC, KITTI), or a bag: MCAP, SQLite (.db3), ROS 1 (.bag), or a rosbag2 folder with its metadata.yaml, also
/// split and compressed. It is read as a stream; its faults are counted and reported.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate replay site.toml drive.mcap --task dock --topic /amcl_pose --cross-terms yaw-unknown --json\n  posegate replay site.toml estimates.csv --task dock --inflation 4 -o replay.svg --mcap verdicts.mcap\n\nRules that are compared with the gate, and the sources of their limits:\n  distance  position within 0.05 m of the goal (Nav2: docking_threshold)\n  sigma     deviations of x and y below 0.05 m, of yaw below 0.05 rad (Nav2's docking threshold and undock_angular_tolerance)\n  ellipse   3-sigma error ellipse: long radius below 1.5 m, lateral radius below 0.3 m (Autoware's localization_error_monitor)\n  ate       everything if the recording's RMSE is below 0.05 m, else nothing\n\nExit code 1: the gate permitted an estimate whose true pose was outside of the success set."
)]
pub struct Arguments {
    /// The site file
    pub site: Input,
    /// The recording: a file, or the folder of a ROS 2 bag; `-` for standard input
    pub log: Input,
    /// The task
    #[arg(long)]
    pub task: String,
    #[command(flatten)]
    pub recorded: Options,
    /// A table of the task; without this option a table is built from the site, and proven
    #[arg(long, conflicts_with = "epsilon")]
    pub table: Option<Input>,
    /// Confidence of the Gaussian pose-sets [default: the site's]
    #[arg(long)]
    pub epsilon: Option<f64>,
    /// Factor by which covariances are multiplied, at least 1
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    pub inflation: f64,
    /// A model of `posegate learn inflation`. Each covariance is multiplied by the factor for its time since the last fix (a
    /// column of a CSV). If that time is unknown or beyond the data, the largest factor is used
    #[arg(long, value_name = "MODEL", conflicts_with = "inflation")]
    pub inflation_model: Option<Input>,
    /// Which terms of their covariance the sources fill (AMCL: yaw-unknown)
    #[arg(long, value_parser = choice(TERMS), default_value = "filled")]
    pub cross_terms: CrossTerms,
    #[command(flatten)]
    pub set: SetArgs,
    /// The gate's clock. logged: recorded times (now_s, log times); stamps: stamps only; auto: now_s if a CSV has it,
    /// else log times, unless nearly all stamps are of another clock
    #[arg(long, value_enum, default_value = "auto")]
    pub clock: ClockName,
    /// Carry each fix forward along an odometry, as a controller would: a topic (nav_msgs/msg/Odometry, or /tf), or a file (CSV with t_s,
    /// x_m, y_m, yaw_rad, or TUM)
    #[arg(long, value_name = "TOPIC|FILE")]
    pub odom: Option<Input>,
    /// Deviations of the odometry: m per root of a metre, rad per root of a radian, rad per root of a metre
    #[arg(long, default_value = "0.02,0.05,0.02", value_name = "M,RAD,RAD")]
    pub odom_noise: String,
    /// Largest error of the odometry in any direction, as a share of each movement
    #[arg(long, default_value_t = 0.02, allow_negative_numbers = true)]
    pub odom_slip: f64,
    /// Longest time between two poses of the odometry, milliseconds
    #[arg(long, default_value_t = 200)]
    pub odom_gap_ms: u32,
    /// The oldest fix that is carried along the odometry, milliseconds
    #[arg(long, default_value_t = 5000)]
    pub fix_age_ms: u32,
    /// The robot's largest speed, m/s: each pose-set grows by all that it can drive until the permission ends
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "M_S",
        allow_negative_numbers = true
    )]
    pub max_speed: f64,
    /// The robot's largest turn rate, degrees/s
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "DEG_S",
        allow_negative_numbers = true
    )]
    pub max_yaw_rate: f64,
    /// Deny estimates older than this, in milliseconds
    #[arg(long, default_value_t = 200)]
    pub max_age_ms: u32,
    /// Longest time from a step of the gate until the output has followed the next step, milliseconds; it is added to the age
    #[arg(long, default_value_t = 20)]
    pub response_ms: u32,
    /// How long the gate stays open without a further permit, milliseconds
    #[arg(long, default_value_t = 100)]
    pub permit_hold_ms: u32,
    /// How long the gate stays closed after a denial, milliseconds
    #[arg(long, default_value_t = 500)]
    pub inhibit_hold_ms: u32,
    /// Number of consecutive permits that open the gate
    #[arg(long, default_value_t = 3)]
    pub permits_in_a_row: u16,
    /// The camera whose detections are read; required if the site has several
    #[arg(long)]
    pub camera: Option<String>,
    /// Only decide: no margins, no worst poses, no Stanford diagram
    #[arg(long)]
    pub fast: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Write one line of JSON per estimate; `-` for standard output
    #[arg(long)]
    pub rows: Option<Output>,
    /// Write the estimates in the world frame that have a covariance, with the true poses where they are known, as `posegate learn`
    /// reads them (CSV); `-` for standard output
    #[arg(long)]
    pub csv: Option<Output>,
    /// Write a picture (SVG): a map of the estimates; the gate, the interlock with its reasons and the rules in use today over time, and the Stanford diagram if the
    /// truth is known
    #[arg(short, long)]
    pub output: Option<Output>,
    /// Write verdicts as JSON channels (MCAP)
    #[arg(long)]
    pub mcap: Option<Output>,
}

const TERMS: [(&str, CrossTerms); 3] = [
    ("filled", CrossTerms::Filled),
    ("yaw-unknown", CrossTerms::YawUnknown(SplitWeight::HALF)),
    ("all-unknown", CrossTerms::AllUnknown(SplitWeight::HALF)),
];

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ClockName {
    Auto,
    Logged,
    Stamps,
}

impl Arguments {
    /// Returns the deviations of the odometry.
    pub fn odom_noise(&self) -> Result<[f64; 3], Failure> {
        numbers(&self.odom_noise, |_| true).ok_or_else(|| {
            Failure::usage(
                format!("--odom-noise {} is not three numbers", self.odom_noise),
                "give three deviations, for example --odom-noise 0.02,0.05,0.02",
            )
        })
    }

    /// Returns the trust in the sources, with this inflation.
    pub fn trust(&self, inflation: Inflation) -> Trust {
        Trust {
            inflation,
            cross_terms: self.cross_terms,
        }
    }

    /// Returns how the recording is read.
    pub fn reading<'a>(&'a self, site: &'a Site) -> Reading<'a> {
        let is_gaussian = self.set.bounded().is_none();
        Reading {
            log: &self.log,
            options: &self.recorded,
            topics: self.recorded.topic.clone(),
            camera: self.camera.as_deref(),
            site,
            is_gaussian,
            is_partial: is_gaussian && self.cross_terms != CrossTerms::Filled,
            most_true: MOST_TRUE,
        }
    }

    /// Returns the bounds of the robot's movement.
    pub fn motion(&self) -> Result<MotionBounds, Failure> {
        motion(self.max_speed, self.max_yaw_rate)
    }

    /// Returns the gate's clock; `defined` is the clock that the recording's format defines.
    pub fn clock(&self, defined: Option<Clock>) -> Option<Clock> {
        match self.clock {
            ClockName::Auto => defined,
            ClockName::Logged => Some(Clock::Logged),
            ClockName::Stamps => Some(Clock::Stamps),
        }
    }
}
