//! `posegate predict`: evaluates a learnt model.

use crate::learn::refused;
use crate::site_input::{Outcome, answer, print, print_json, warn};
use posegate_files::files::{Files, Input};
use posegate_learn::{ErrorModel, InflationModel, Model, conditions, places};
use serde_json::{Value, json};

/// Evaluates a learnt model at places or for estimates
///
/// A model of bounds gives the two bounds and the share of views that are detected. A model of inflation gives the factor
/// of each estimate's covariance. The bounds are those of the detector alone. The error from the tolerances of a site's tag
/// and camera is added when the site's success sets use the model. `accepted` is false if the model has too few data for
/// the place, or none.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate predict tags.toml --at places.csv --json\n\nColumns: d_m, phi_deg, psi_deg; or those of estimates, with the column that the model's conditions go by. Without that column each row gets the largest factor."
)]
pub struct Arguments {
    /// The model that `posegate learn` wrote
    model: Input,
    /// Places or estimates (CSV); `-` for standard input
    #[arg(long)]
    at: Input,
    /// Print one line of JSON per row
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let (text, name) = files.read_text(&arguments.model)?;
    let model = Model::parse(&text, &name).map_err(refused)?;
    let (bytes, name) = files.read(&arguments.at)?;
    let lines: Vec<Value> = match &model {
        Model::Bounds(model) => {
            let places = places(&bytes, &name).map_err(refused)?;
            if model.is_of_better_pose() {
                warn(
                    &"the bounds hold for the better one of a detector's two poses: a gate must take both as hypotheses",
                );
            }
            places.iter().map(|at| bounds(model, *at)).collect()
        }
        Model::Inflation(model) => {
            let rows = conditions(&bytes, &name, model.condition()).map_err(refused)?;
            rows.iter().map(|row| inflation(model, *row)).collect()
        }
        _ => Vec::new(),
    };
    for (index, mut line) in lines.into_iter().enumerate() {
        if arguments.json {
            line["index"] = json!(index);
            print_json(&line)?;
        } else {
            print(&format_args!("{index:>6} {}", sentence(&line)))?;
        }
    }
    Ok(answer(true))
}

fn bounds(model: &ErrorModel, at: [f64; 3]) -> Value {
    let bounds = model.bounds_deg(at);
    let detected = model.detectability_deg(at);
    json!({
        "index": 0, "accepted": bounds.is_some(),
        "translation": bounds.map(|b| b.0), "yaw_rad": bounds.map(|b| b.1),
        "p_detect": detected.map(|d| d.share), "p_detect_cell_limits": detected.map(|d| d.limits),
    })
}

fn inflation(model: &InflationModel, condition: Option<f64>) -> Value {
    let factor = model.inflation(condition);
    json!({"index": 0, "accepted": factor.is_some(), "inflation": factor})
}

fn sentence(line: &Value) -> String {
    let number = |key: &str| line[key].as_f64();
    if let (Some(translation), Some(yaw)) = (number("translation"), number("yaw_rad")) {
        let detected = number("p_detect").map_or(String::new(), |p| format!(", detected {p:.3}"));
        return format!("{translation:.4} m, {:.3} deg{detected}", yaw.to_degrees());
    }
    match number("inflation") {
        Some(factor) => format!("covariance times {factor:.4}"),
        None => "no answer: too few data".into(),
    }
}
