//! The arguments of `posegate replay`.

use crate::door::Failure;
use posegate::set::CrossTerms;
use posegate::set::SplitWeight;
use posegate_host::files::{Input, Output};
use posegate_host::log::replay::{Clock, Thresholds};

/// Holds a recording against the gate: what it would have permitted, and whether that was right
///
/// The recording is CSV (the columns of `posegate gate`, with t_s; true_x_m, true_y_m, true_yaw_rad where the truth is
/// known), TUM, or MCAP with ROS 2 topics. It is read as a stream; what is wrong with it is counted and told.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate replay site.toml drive.mcap --task dock --topic /amcl_pose --cross-terms yaw-unknown --json\n  posegate replay site.toml estimates.csv --task dock --inflation 4 -o replay.svg --mcap verdicts.mcap\n\nRules that are shown beside the gate, and where their limits come from:\n  distance  position within --distance of the goal (Nav2: docking_threshold, 0.05 m)\n  sigma     deviations of x, y, yaw below --sigma and --sigma-yaw-deg (Nav2's docking threshold and undock_angular_tolerance)\n  ellipse   3-sigma error ellipse: long radius below --ellipse, to the side below --ellipse-lateral (Autoware's localization_error_monitor, 1.5 m and 0.3 m)\n  ate       everything where the recording's RMSE is below --ate, else nothing\n\nExit code 1: the gate permitted an estimate whose true pose was outside of the success set."
)]
pub struct Arguments {
    /// The site file
    pub site: Input,
    /// The recording; `-` for standard input
    pub log: Input,
    /// The task
    #[arg(long)]
    pub task: String,
    /// A topic with estimates (MCAP): PoseWithCovarianceStamped, Odometry, PoseStamped, or AprilTagDetectionArray; may be given several times
    #[arg(long)]
    pub topic: Vec<String>,
    /// The truth: a file in the TUM format or a CSV (t_s, x_m, y_m, yaw_rad), or a topic of the bag
    #[arg(long)]
    pub truth: Option<Input>,
    /// Longest time between two true poses that is interpolated, seconds
    #[arg(long, default_value_t = 0.2)]
    pub truth_gap: f64,
    /// A table of the task; without it one is made of the site, and proven
    #[arg(long, conflicts_with = "epsilon")]
    pub table: Option<Input>,
    /// Confidence of the Gaussian pose-sets [default: the site's]
    #[arg(long)]
    pub epsilon: Option<f64>,
    /// The covariances are multiplied by this, at least 1
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    pub inflation: f64,
    /// Which terms of their covariance the sources fill (AMCL: yaw-unknown)
    #[arg(long, value_enum, default_value = "filled")]
    pub cross_terms: Terms,
    /// What is about each estimate: its covariance, or a bound that is the same for all
    #[arg(long, value_enum, default_value = "gaussian")]
    pub set: Kind,
    /// Bounded sets: largest error of the position, metres
    #[arg(long, required_if_eq("set", "bounded"), allow_negative_numbers = true)]
    pub translation: Option<f64>,
    /// Bounded sets: largest error of the heading, degrees
    #[arg(long, required_if_eq("set", "bounded"), allow_negative_numbers = true)]
    pub yaw_deg: Option<f64>,
    /// The world frame's name; estimates in another are denied
    #[arg(long, default_value = "map")]
    pub frame: String,
    /// The gate's clock: recorded times (now_s, log times), stamps alone, or now_s where a CSV has it, log times unless nearly all are of another clock than the stamps
    #[arg(long, value_enum, default_value = "auto")]
    pub clock: ClockName,
    /// Only estimates stamped at this time or later, seconds
    #[arg(long, allow_negative_numbers = true)]
    pub from: Option<f64>,
    /// Only estimates stamped at this time or before, seconds
    #[arg(long, allow_negative_numbers = true)]
    pub to: Option<f64>,
    /// Oldest estimate that is used, milliseconds
    #[arg(long, default_value_t = 200)]
    pub max_age_ms: u32,
    /// Longest time from a step of the gate until the output has followed the next one, milliseconds; it counts to the age
    #[arg(long, default_value_t = 20)]
    pub response_ms: u32,
    /// How long the gate stays open without a further permit, milliseconds
    #[arg(long, default_value_t = 100)]
    pub permit_hold_ms: u32,
    /// How long the gate stays closed after a denial, milliseconds
    #[arg(long, default_value_t = 500)]
    pub inhibit_hold_ms: u32,
    /// So many permits in a row open the gate
    #[arg(long, default_value_t = 3)]
    pub permits_in_a_row: u16,
    /// The camera whose detections are read; needed where the site has several
    #[arg(long)]
    pub camera: Option<String>,
    /// Deviation of a corner's coordinates in the image, pixels
    #[arg(long, default_value_t = 0.3, allow_negative_numbers = true)]
    pub sigma_px: f64,
    /// Limit of the rule `distance`, metres
    #[arg(long, default_value_t = 0.05)]
    pub distance: f64,
    /// Limit of the rule `sigma`, metres
    #[arg(long, default_value_t = 0.05)]
    pub sigma: f64,
    /// Limit of the rule `sigma`, degrees [default: 0.05 rad]
    #[arg(long)]
    pub sigma_yaw_deg: Option<f64>,
    /// Limit of the rule `ellipse`, long radius, metres
    #[arg(long, default_value_t = 1.5)]
    pub ellipse: f64,
    /// Limit of the rule `ellipse`, to the side, metres
    #[arg(long, default_value_t = 0.3)]
    pub ellipse_lateral: f64,
    /// How many sigmas the ellipse has
    #[arg(long, default_value_t = 3.0)]
    pub ellipse_scale: f64,
    /// Limit of the rule `ate`, metres
    #[arg(long, default_value_t = 0.05)]
    pub ate: f64,
    /// Decide alone: no margins, no worst poses, no Stanford diagram
    #[arg(long)]
    pub fast: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Write a JSON line an estimate; `-` for standard output
    #[arg(long)]
    pub rows: Option<Output>,
    /// Write a picture (SVG): verdicts over time, and the Stanford diagram where the truth is known
    #[arg(short, long)]
    pub output: Option<Output>,
    /// Write verdicts as JSON channels (MCAP)
    #[arg(long)]
    pub mcap: Option<Output>,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    Gaussian,
    Bounded,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Terms {
    Filled,
    YawUnknown,
    AllUnknown,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ClockName {
    Auto,
    Logged,
    Stamps,
}

impl Arguments {
    /// Which terms the sources fill.
    pub fn terms(&self) -> CrossTerms {
        match self.cross_terms {
            Terms::Filled => CrossTerms::Filled,
            Terms::YawUnknown => CrossTerms::YawUnknown(SplitWeight::HALF),
            Terms::AllUnknown => CrossTerms::AllUnknown(SplitWeight::HALF),
        }
    }

    /// A bound about each estimate: metres, radians.
    pub fn bounded(&self) -> Option<[f64; 2]> {
        match self.set {
            Kind::Gaussian => None,
            Kind::Bounded => Some([
                self.translation.unwrap_or(f64::NAN),
                self.yaw_deg.unwrap_or(f64::NAN).to_radians(),
            ]),
        }
    }

    /// Limits that are none would permit nothing, or all, in silence.
    ///
    /// # Errors
    /// An option that is no number above 0.
    pub fn check(&self) -> Result<(), Failure> {
        for (name, value) in [
            ("--distance", Some(self.distance)),
            ("--sigma", Some(self.sigma)),
            ("--sigma-yaw-deg", self.sigma_yaw_deg),
            ("--ellipse", Some(self.ellipse)),
            ("--ellipse-lateral", Some(self.ellipse_lateral)),
            ("--ellipse-scale", Some(self.ellipse_scale)),
            ("--ate", Some(self.ate)),
        ] {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(Failure::usage(
                    format!("{name} {value} is no limit"),
                    "give a number above 0",
                ));
            }
        }
        for (name, value) in [("--from", self.from), ("--to", self.to)] {
            if value.is_some_and(f64::is_nan) {
                return Err(Failure::usage(
                    format!("{name} is no time"),
                    "give seconds, as in the stamps",
                ));
            }
        }
        Ok(())
    }

    /// The gate's clock; `told` is what the recording's format says of it.
    pub fn clock(&self, told: Option<Clock>) -> Option<Clock> {
        match self.clock {
            ClockName::Auto => told,
            ClockName::Logged => Some(Clock::Logged),
            ClockName::Stamps => Some(Clock::Stamps),
        }
    }

    /// The limits of the rules.
    pub fn thresholds(&self) -> Thresholds {
        Thresholds {
            distance_m: self.distance,
            sigma_m: self.sigma,
            sigma_yaw_rad: self.sigma_yaw_deg.map_or(0.05, f64::to_radians),
            ellipse_scale: self.ellipse_scale,
            ellipse_m: self.ellipse,
            ellipse_lateral_m: self.ellipse_lateral,
            ate_m: self.ate,
        }
    }
}
