//! `posegate cost`: the expected cost of seeing a task's tag.

use crate::belief::{UncertaintyArgs, Weights};
use crate::site_input::{Failure, Outcome, answer, print, print_json, site, task};
use posegate_files::files::{Files, Input};
use posegate_place::{Approximate, CostError, ExpectedCost, Quadrature, expected_cost};
use serde_json::{Map, Value, json};

/// Computes the expected cost of seeing a task's tag from a Gaussian pose-set at the task's goal
///
/// A view costs c1 d^2 + c2 phi^2 + c3 psi^2 (m, rad), a pose outside the success set c_high. Each number comes with
/// an estimate of its numerical error. If every sigma (or every number of the covariance) is zero, the robot is at
/// its goal, and the cost is that of the goal.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate cost site.toml --task see-t7 --sigma-x 0.3 --sigma-y 0.3 --sigma-yaw-deg 1 --json\n  posegate cost site.toml --task see-t7 --covariance-file p.csv\n\nThe covariance file has three rows of three numbers without a header: x, y, yaw in m and rad, world axes."
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The task
    #[arg(long)]
    task: String,
    #[command(flatten)]
    belief: UncertaintyArgs,
    /// Confidence of the pose-set [default: the site's]
    #[arg(long, allow_negative_numbers = true)]
    epsilon: Option<f64>,
    #[command(flatten)]
    weights: Weights,
    /// Target for the numerical error, as a share of the integral
    #[arg(long, default_value_t = Quadrature::default().accuracy, allow_negative_numbers = true)]
    accuracy: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let site = site(files, &arguments.site)?;
    let task = task(&site, &arguments.task)?;
    let epsilon = arguments.epsilon.unwrap_or(site.epsilon);
    let belief = arguments.belief.gaussian(epsilon, files)?;
    let quadrature = Quadrature {
        accuracy: arguments.accuracy,
        ..Quadrature::default()
    };
    let cost = arguments.weights.cost();
    let found = match &belief {
        Some(belief) => expected_cost(&task.success, belief, &cost, &quadrature),
        None => ExpectedCost::at_goal(&task.success, &cost),
    };
    let found = found.map_err(|error| {
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
        print_json(&Value::Object(line))?;
    } else {
        print(&format_args!("cost of a view: {}", cost.definition()))?;
        for (name, Approximate { value, error }) in named {
            print(&format_args!("{name:<12} {value:<24} +- {error:.1e}"))?;
        }
    }
    Ok(answer(true))
}
