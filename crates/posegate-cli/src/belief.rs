//! Arguments for the uncertainty of a pose, for the kind of pose-sets and for the cost of views.

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

/// The kind of the pose-sets of a recording's estimates.
#[derive(clap::Args)]
pub struct SetArgs {
    /// Kind of pose-set: Gaussian by each estimate's covariance, or bounded by the same bound for all estimates
    #[arg(long, value_enum, default_value = "gaussian")]
    set: Kind,
    /// Bounded sets: largest error of the position, metres
    #[arg(long, required_if_eq("set", "bounded"), allow_negative_numbers = true)]
    translation: Option<f64>,
    /// Bounded sets: largest error of the heading, degrees
    #[arg(long, required_if_eq("set", "bounded"), allow_negative_numbers = true)]
    yaw_deg: Option<f64>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Kind {
    Gaussian,
    Bounded,
}

impl SetArgs {
    /// Returns the bound of bounded pose-sets: metres, radians. `None` if the sets are Gaussian.
    pub fn bounded(&self) -> Option<[f64; 2]> {
        match self.set {
            Kind::Gaussian => None,
            Kind::Bounded => Some([
                self.translation.unwrap_or(f64::NAN),
                self.yaw_deg.unwrap_or(f64::NAN).to_radians(),
            ]),
        }
    }
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
    /// Returns the pose-set. `None` if the pose is known exactly: all standard deviations, or all numbers of the covariance, are zero.
    pub fn gaussian(&self, epsilon: f64, files: &Files) -> Result<Option<Gaussian>, Failure> {
        let sigmas = [self.sigma_x, self.sigma_y, self.sigma_yaw_deg];
        let (place, found) = if let Some(file) = &self.covariance_file {
            let (bytes, name) = files.read(file)?;
            let rows = covariance(bytes.as_slice(), &name).map_err(Failure::input)?;
            if rows == [[0.0; 3]; 3] {
                return Ok(None);
            }
            (format!("{name}: "), Gaussian::new(rows, epsilon))
        } else if let [Some(x), Some(y), Some(yaw_deg)] = sigmas {
            if sigmas == [Some(0.0); 3] {
                return Ok(None);
            }
            let sigmas = [x, y, yaw_deg.to_radians()];
            (String::new(), Gaussian::of_sigmas(sigmas, epsilon))
        } else {
            return Err(Failure::usage(
                "the uncertainty of the pose is missing".into(),
                "give --sigma-x, --sigma-y and --sigma-yaw-deg, or a --covariance-file",
            ));
        };
        found.map(Some).map_err(|error| {
            let help = match error {
                GaussianError::Sigma { .. } => {
                    "give standard deviations above 0, metres and degrees, or 0 for all three if the pose is known exactly"
                }
                GaussianError::Epsilon(_) => "write an epsilon such as --epsilon 0.99",
                GaussianError::Turns(_) => {
                    "a pose-set with such a large heading deviation is not Gaussian: give a smaller --sigma-yaw-deg"
                }
                _ => {
                    "give the covariance of x, y, yaw in m and rad, as a filter reports it, or only zeros for a pose that is known exactly"
                }
            };
            Failure::usage(format!("{place}{error}"), help)
        })
    }
}
