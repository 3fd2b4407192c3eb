//! `posegate metrics`: compares an estimated trajectory with a reference.

use crate::arguments::{choice, numbers};
use crate::site_input::{Failure, Outcome, answer, print, print_json, site, task};
use posegate_files::files::{Files, Input};
use posegate_replay::metrics::{
    Align, AlignError, Errors, PairError, Pairs, Statistics, absolute, aligned, associated,
    correct_rate, in_set, relative,
};
use posegate_replay::trajectories::{Named, Poses, read};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Compares an estimated trajectory with a reference: ATE, RPE, Correct Rate
///
/// Both are files of TUM (timestamp tx ty tz qx qy qz qw), EuRoC (nanoseconds or decimal seconds, x, y, z, qw, qx, qy, qz) or KITTI (12 numbers; --times). A
/// time that is there twice is used once. Errors and statistics are those of evo.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate metrics truth.txt estimate.txt --align se3 --json\n  posegate metrics truth.txt estimate.txt --correct-rate 0.05,2 --site site.toml --task dock"
)]
pub struct Arguments {
    /// The reference; `-` for standard input
    reference: Input,
    /// The estimate; `-` for standard input
    estimate: Input,
    /// The times of KITTI trajectories: one in each line, seconds
    #[arg(long, value_name = "FILE")]
    times: Option<Input>,
    /// How the estimate is moved onto the reference before it is compared
    #[arg(long, value_parser = choice(ALIGNMENTS), default_value = "none")]
    align: Align,
    /// Largest time difference of two poses that are paired, seconds
    #[arg(long, default_value_t = 0.01, allow_negative_numbers = true)]
    max_diff: f64,
    /// Thresholds of a Correct Rate, metres and degrees; may be given several times
    #[arg(long, value_name = "M,DEG", value_parser = thresholds, allow_hyphen_values = true)]
    correct_rate: Vec<[f64; 2]>,
    /// A site file with the task; `-` for standard input
    #[arg(long, requires = "task")]
    site: Option<Input>,
    /// A task in whose success set the poses should be
    #[arg(long, requires = "site")]
    task: Option<String>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

const ALIGNMENTS: [(&str, Align); 4] = [
    ("none", Align::None),
    ("se3", Align::Se3),
    ("sim3", Align::Sim3),
    ("origin", Align::Origin),
];

/// The thresholds used in the literature: the default. Metres and degrees.
const THRESHOLDS: [[f64; 2]; 5] = [
    [0.02, 1.0],
    [0.05, 2.0],
    [0.05, 180.0],
    [1.0, 3.0],
    [0.3, 5.0],
];

/// The pairs of poses for which relative errors are computed.
const PAIRS: [(&str, Pairs); 4] = [
    ("delta_1_frame", Pairs::Frames(1)),
    ("delta_10_frames", Pairs::Frames(10)),
    ("delta_10_frames_all_pairs", Pairs::AllFrames(10)),
    ("delta_0.5_m", Pairs::Metres(0.5)),
];

fn thresholds(text: &str) -> Result<[f64; 2], &'static str> {
    let found = numbers(text, |number| number.is_finite() && number > 0.0);
    found.ok_or("expected metres and degrees above 0, like 0.05,2")
}

fn poses(path: &Input, files: &Files, times: Option<Named<'_>>) -> Result<Poses, Failure> {
    let (text, name) = files.read(path)?;
    read(&text, &name, times).map_err(Failure::input)
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let success = match (&arguments.site, &arguments.task) {
        (Some(file), Some(name)) => {
            let site = site(files, file)?;
            let mut success = task(&site, name)?.success.clone();
            // The trajectories have the map's numbers.
            let [east, north] = site.map_origin;
            (success.goal.x, success.goal.y) = (success.goal.x + east, success.goal.y + north);
            Some(success)
        }
        _ => None,
    };
    let times = arguments
        .times
        .as_ref()
        .map(|times| files.read(times))
        .transpose()?;
    let times = times
        .as_ref()
        .map(|(text, name)| (text.as_slice(), name.as_str()));
    let (reference, estimate) = (
        poses(&arguments.reference, files, times)?,
        poses(&arguments.estimate, files, times)?,
    );
    let duplicates = reference.duplicates + estimate.duplicates;
    let matched =
        associated(&reference.poses, &estimate.poses, arguments.max_diff).map_err(|error| {
            let help = match error {
                PairError::Difference(_) => "give seconds, like --max-diff 0.01",
                _ => "check that both have the same clock, or give a larger --max-diff",
            };
            Failure::usage(format!("{}: {error}", names(arguments)), help)
        })?;
    let matched = aligned(&matched, arguments.align).map_err(|error: AlignError| {
        let place = names(arguments);
        Failure::usage(
            format!("{place}: {error}"),
            "use --align origin or --align none",
        )
    })?;
    let absolute = absolute(&matched);
    let mut line = json!({"pairs": matched.estimate.len(), "duplicates": duplicates, "ape": statistics(&absolute)});
    for (name, pairs) in PAIRS {
        line["rpe"][name] = statistics(&relative(&matched, pairs));
    }
    let wanted = if arguments.correct_rate.is_empty() {
        THRESHOLDS.to_vec()
    } else {
        arguments.correct_rate.clone()
    };
    let rates = wanted.iter().map(|[translation, rotation]| {
        json!({
            "translation_below": translation,
            "rotation_below_deg": rotation,
            "rate": correct_rate(&absolute, *translation, *rotation),
        })
    });
    line["correct_rate"] = rates.collect();
    if let (Some(success), Some(name)) = (&success, &arguments.task) {
        let shares = in_set(&matched, success);
        line["task_rate"] = json!({
            "task": name,
            "errors_inside": shares.errors,
            "estimate_inside": shares.estimate,
            "reference_inside": shares.reference,
        });
    }
    if arguments.json {
        print_json(&line)?;
    } else {
        table(&line)?;
    }
    Ok(answer(true))
}

fn names(arguments: &Arguments) -> String {
    let (reference, estimate) = (arguments.reference.display(), arguments.estimate.display());
    format!("{reference}, {estimate}")
}

/// Returns the statistics of each part of the errors; null if there are no errors.
fn statistics(errors: &Errors) -> Value {
    let Some(parts) = errors.statistics() else {
        return Value::Null;
    };
    let part = |statistics: &Statistics| {
        let named: BTreeMap<_, _> = statistics.named().into_iter().collect();
        let mut all = json!(named);
        all["count"] = json!(statistics.count);
        all
    };
    let parts: BTreeMap<_, _> = parts.iter().map(|(name, of)| (*name, part(of))).collect();
    json!(parts)
}

/// Prints the result as text.
fn table(line: &Value) -> Result<(), Failure> {
    print(&format_args!("{} pairs of poses", line["pairs"]))?;
    if line["duplicates"] != json!(0) {
        print(&format_args!(
            "{} poses have the time of the pose before, and are left out",
            line["duplicates"]
        ))?;
    }
    print(&format_args!(
        "{:<44} {:>10} {:>10} {:>10} {:>10}",
        "", "rmse", "mean", "median", "max"
    ))?;
    let rpe = PAIRS.map(|(name, _)| (format!("RPE {name}"), &line["rpe"][name]));
    for (name, errors) in [("APE".to_string(), &line["ape"])].into_iter().chain(rpe) {
        if errors.is_null() {
            print(&format_args!("{name:<44} no pairs"))?;
            continue;
        }
        for (part, unit) in [("translation", "m"), ("rotation_deg", "deg")] {
            let get = |key: &str| errors[part][key].as_f64().unwrap_or(f64::NAN);
            print(&format_args!(
                "{:<44} {:>10.6} {:>10.6} {:>10.6} {:>10.6}",
                format!("{name}, {part} ({unit})"),
                get("rmse"),
                get("mean"),
                get("median"),
                get("max")
            ))?;
        }
    }
    for rate in line["correct_rate"].as_array().into_iter().flatten() {
        print(&format_args!(
            "below {} m and {} deg: {:.4} of the poses",
            rate["translation_below"],
            rate["rotation_below_deg"],
            rate["rate"].as_f64().unwrap_or(f64::NAN)
        ))?;
    }
    if let Some(task) = line.get("task_rate") {
        let get = |key: &str| task[key].as_f64().unwrap_or(f64::NAN);
        print(&format_args!(
            "in the success set of {}: {:.4} of the errors, {:.4} of the estimate, {:.4} of the reference",
            task["task"],
            get("errors_inside"),
            get("estimate_inside"),
            get("reference_inside")
        ))?;
    }
    Ok(())
}
