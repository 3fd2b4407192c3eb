//! A recording with its truth, its frames and its camera, for `replay` and `learn`.

mod bag;
mod input;

pub use self::bag::{body, failure, open};
pub use self::input::{Recorded, topics};

use crate::site_input::Failure;
use posegate_files::files::Input;
use posegate_replay::recording::FrameNames;
use posegate_site::Site;

/// Which parts of a recording are read.
#[derive(clap::Args)]
pub struct Options {
    /// A topic with estimates (of a bag): PoseWithCovarianceStamped, Odometry, PoseStamped, AprilTagDetectionArray, or TFMessage (map to odom
    /// composed with odom to the robot; it has no covariance: --set bounded); may be repeated
    #[arg(long)]
    pub topic: Vec<String>,
    /// The truth: a file of TUM, EuRoC or KITTI (--times), a CSV (t_s, x_m, y_m, yaw_rad), or a topic of the bag
    #[arg(long)]
    pub truth: Option<Input>,
    /// The times of a KITTI trajectory, as the truth or as the recording: one in each line, seconds
    #[arg(long, value_name = "FILE")]
    pub times: Option<Input>,
    /// Longest time between two true poses across which the truth is interpolated, seconds
    #[arg(long, default_value_t = 0.2)]
    pub truth_gap: f64,
    /// The world frame's name; estimates in another frame are denied
    #[arg(long, default_value = "map")]
    pub frame: String,
    /// The odometry's frame in /tf
    #[arg(long, default_value = "odom")]
    pub odom_frame: String,
    /// The robot's frame in /tf [default: base_link or base_footprint, whichever is the child of the odometry's frame]
    #[arg(long)]
    pub base_frame: Option<String>,
    /// The frame whose poses are recorded, if it is not the robot's base; may be repeated. At its place in the site ([frame.NAME]) or in the
    /// bag's /tf_static, else it counts as the base. Also for types without a child frame: the pose of a camera
    #[arg(long, value_name = "NAME")]
    pub child_frame: Vec<String>,
    /// Use only estimates stamped at this time or later, seconds
    #[arg(long, allow_negative_numbers = true)]
    pub from: Option<f64>,
    /// Use only estimates stamped at this time or earlier, seconds
    #[arg(long, allow_negative_numbers = true)]
    pub to: Option<f64>,
    /// Standard deviation of a corner's coordinates in the image, pixels
    #[arg(long, default_value_t = 0.3, allow_negative_numbers = true)]
    pub sigma_px: f64,
}

/// A recording and how it is read.
pub struct Reading<'a> {
    pub log: &'a Input,
    pub options: &'a Options,
    /// The topics of estimates and of detections.
    pub topics: Vec<String>,
    /// The name of the camera whose detections are read.
    pub camera: Option<&'a str>,
    pub site: &'a Site,
    /// `true` if the covariances are read.
    pub is_gaussian: bool,
    /// `true` if the covariances lack cross terms.
    pub is_partial: bool,
    /// The largest number of true poses of a topic that are kept.
    pub most_true: usize,
}

impl Options {
    /// Returns the frames of which poses are composed.
    pub fn frames(&self) -> FrameNames {
        FrameNames {
            world: self.frame.clone(),
            odometry: self.odom_frame.clone(),
            base: self.base_frame.clone(),
        }
    }

    /// Checks the range of time.
    ///
    /// # Errors
    /// A time is NaN.
    pub fn check(&self) -> Result<(), Failure> {
        for (name, value) in [("--from", self.from), ("--to", self.to)] {
            if value.is_some_and(f64::is_nan) {
                return Err(Failure::usage(
                    format!("{name} is not a time"),
                    "give seconds, as in the stamps",
                ));
            }
        }
        Ok(())
    }
}
