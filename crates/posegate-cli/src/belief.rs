//! Arguments for the uncertainty of a pose and for the cost of views.

use crate::site_input::Failure;
use posegate_files::files::{Files, Input};
use posegate_place::{Cost, Gaussian, GaussianError};
use posegate_replay::covariance;

/// The uncertainty of the pose: three standard deviations, or a covariance file.
#[derive(clap::Args)]
pub struct UncertaintyArgs {
    /// Standard deviation of x, metres
    #[arg(long, allow_negative_numbers = true)]
    sigma_x: Option<f64>,
    /// Standard deviation of y, metres
    #[arg(long, allow_negative_numbers = true)]
    sigma_y: Option<f64>,
    /// Standard deviation of the heading, degrees
    #[arg(long, allow_negative_numbers = true)]
    sigma_yaw_deg: Option<f64>,
    /// The covariance of x, y, yaw: a CSV of three rows, m and rad, world axes; `-` for standard input
    #[arg(long, conflicts_with_all = ["sigma_x", "sigma_y", "sigma_yaw_deg"])]
    covariance_file: Option<Input>,
}

/// The weights of the cost of a pose.
#[derive(clap::Args)]
pub struct Weights {
    /// Cost of a pose outside the success set
    #[arg(long, default_value_t = Cost::default().c_high, allow_negative_numbers = true)]
    c_high: f64,
    /// Cost per square metre of the distance to the tag
    #[arg(long, default_value_t = Cost::default().c1, allow_negative_numbers = true)]
    c1: f64,
    /// Cost per square radian of phi
    #[arg(long, default_value_t = Cost::default().c2, allow_negative_numbers = true)]
    c2: f64,
    /// Cost per square radian of psi
    #[arg(long, default_value_t = Cost::default().c3, allow_negative_numbers = true)]
    c3: f64,
}

impl Weights {
    pub fn cost(&self) -> Cost {
        Cost {
            c_high: self.c_high,
            c1: self.c1,
            c2: self.c2,
            c3: self.c3,
        }
    }
}

impl UncertaintyArgs {
    pub fn gaussian(&self, epsilon: f64, files: &Files) -> Result<Gaussian, Failure> {
        let refused = |place: &str, error: GaussianError| {
            let help = match error {
                GaussianError::Sigma { .. } => {
                    "give standard deviations above 0, metres and degrees; for a pose that is known exactly use `posegate place --exact`"
                }
                GaussianError::Epsilon(_) => "write an epsilon such as --epsilon 0.99",
                GaussianError::Turns(_) => {
                    "a pose-set with such a large heading deviation is not Gaussian: give a smaller --sigma-yaw-deg"
                }
                _ => "give the covariance of x, y, yaw in m and rad, as a filter reports it",
            };
            Failure::usage(format!("{place}{error}"), help)
        };
        if let Some(file) = &self.covariance_file {
            let (bytes, name) = files.read(file)?;
            let rows = covariance(bytes.as_slice(), &name).map_err(Failure::input)?;
            return Gaussian::new(rows, epsilon)
                .map_err(|error| refused(&format!("{name}: "), error));
        }
        let (Some(x), Some(y), Some(yaw_deg)) = (self.sigma_x, self.sigma_y, self.sigma_yaw_deg)
        else {
            return Err(Failure::usage(
                "the uncertainty of the pose is missing".into(),
                "give --sigma-x, --sigma-y and --sigma-yaw-deg, or a --covariance-file",
            ));
        };
        Gaussian::of_sigmas([x, y, yaw_deg.to_radians()], epsilon)
            .map_err(|error| refused("", error))
    }
}

impl UncertaintyArgs {
    /// Returns `true` if every standard deviation is given as zero: the pose is known exactly.
    pub fn is_exact(&self) -> bool {
        [self.sigma_x, self.sigma_y, self.sigma_yaw_deg] == [Some(0.0); 3]
    }
}
