//! `posegate cost`: the expected cost of seeing a task's tag.

use crate::door::{Failure, Outcome, answer, print, read, site, task};
use posegate::log::covariance;
use posegate::place::{
    Approximate, Cost, CostError, Gaussian, GaussianError, Quadrature, expected_cost,
};
use serde_json::{Map, Value, json};
use std::path::PathBuf;

/// The expected cost of seeing a task's tag from a Gaussian pose-set about its goal
///
/// A view costs c1 d^2 + c2 phi^2 + c3 psi^2 (m, rad), a pose outside the success set c_high. Each number comes with
/// an estimate of its numerical error.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate cost site.toml --task see-t7 --sigma-x 0.3 --sigma-y 0.3 --sigma-yaw-deg 1 --json\n  posegate cost site.toml --task see-t7 --covariance-file p.csv\n\nThe covariance file has three rows of three numbers without a header: x, y, yaw in m and rad, world axes."
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: PathBuf,
    /// The task
    #[arg(long)]
    task: String,
    #[command(flatten)]
    belief: Belief,
    /// Confidence of the pose-set [default: the site's]
    #[arg(long, allow_negative_numbers = true)]
    epsilon: Option<f64>,
    #[command(flatten)]
    weights: Weights,
    /// The numerical error to aim at, as a share of the integral
    #[arg(long, default_value_t = Quadrature::default().accuracy, allow_negative_numbers = true)]
    accuracy: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// How well the pose is known.
#[derive(clap::Args)]
struct Belief {
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
    covariance_file: Option<PathBuf>,
}

/// What poses cost.
#[derive(clap::Args)]
struct Weights {
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
    fn cost(&self) -> Cost {
        Cost {
            c_high: self.c_high,
            c1: self.c1,
            c2: self.c2,
            c3: self.c3,
        }
    }
}

impl Belief {
    fn gaussian(&self, epsilon: f64) -> Result<Gaussian, Failure> {
        let refused = |place: &str, error: GaussianError| {
            let help = match error {
                GaussianError::Sigma { .. } => {
                    "give standard deviations above 0, metres and degrees; `posegate place --exact` is the case without any"
                }
                GaussianError::Epsilon(_) => "write an epsilon such as --epsilon 0.99",
                GaussianError::Turns(_) => {
                    "a heading that unknown is no Gaussian pose-set: give a smaller --sigma-yaw-deg"
                }
                _ => "give the covariance of x, y, yaw in m and rad, as a filter reports it",
            };
            Failure::usage(format!("{place}{error}"), help)
        };
        if let Some(file) = &self.covariance_file {
            let (bytes, name) = read(file)?;
            let rows = covariance(bytes.as_slice(), &name).map_err(Failure::input)?;
            return Gaussian::new(rows, epsilon)
                .map_err(|error| refused(&format!("{name}: "), error));
        }
        let (Some(x), Some(y), Some(yaw_deg)) = (self.sigma_x, self.sigma_y, self.sigma_yaw_deg)
        else {
            return Err(Failure::usage(
                "it is not said how well the pose is known".into(),
                "give --sigma-x, --sigma-y and --sigma-yaw-deg, or a --covariance-file",
            ));
        };
        Gaussian::of_sigmas([x, y, yaw_deg.to_radians()], epsilon)
            .map_err(|error| refused("", error))
    }
}

pub fn run(arguments: &Arguments) -> Outcome {
    let site = site(&arguments.site)?;
    let task = task(&site, &arguments.task)?;
    let epsilon = arguments.epsilon.unwrap_or(site.epsilon);
    let belief = arguments.belief.gaussian(epsilon)?;
    let quadrature = Quadrature {
        accuracy: arguments.accuracy,
        ..Quadrature::default()
    };
    let cost = arguments.weights.cost();
    let found = expected_cost(&task.success, &belief, &cost, &quadrature).map_err(|error| {
        let place = format!("{}: task `{}`", arguments.site.display(), arguments.task);
        match error {
            CostError::NoView(_) => Failure::usage(
                format!("{place}: {error}"),
                "name a task whose success set has shape = \"visibility\" in it",
            ),
            _ => Failure::usage(error.to_string(), "see `posegate cost --help`"),
        }
    })?;
    let named = [
        ("integral", found.integral),
        ("mass", found.mass),
        ("mean", found.mean),
        ("outside_mass", found.outside_mass),
        ("p_miss", found.p_miss),
    ];
    if arguments.json {
        let mut line: Map<String, Value> = Map::new();
        for (name, Approximate { value, error }) in named {
            line.insert(name.into(), json!(value));
            line.insert(format!("{name}_error"), json!(error));
        }
        print(&Value::Object(line))?;
    } else {
        for (name, Approximate { value, error }) in named {
            print(&format_args!("{name:<12} {value:<24} +- {error:.1e}"))?;
        }
    }
    Ok(answer(true))
}
