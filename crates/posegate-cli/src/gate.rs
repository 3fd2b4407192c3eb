//! `posegate gate`: decides on recorded estimates with the code that runs on the controller.

use crate::door::{Failure, Outcome, answer, print, print_json, progress};
use posegate::confidence::core_radius;
use posegate::gate::{Reason, Verdict};
use posegate::recordings::Evaluator;
use posegate::set::{PoseSet, RadiusSquared};
use posegate::table::Table;
use posegate_host::files::{Files, Input};
use posegate_host::log::{Columns, Row, clock_ms, coordinates, estimates, factor, factor_text};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Decides on each estimate of a recording: permit, or deny with the reason
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate gate dock.posegate --estimates estimates.csv --json\n  posegate gate dock.posegate --estimates poses.csv --set bounded --translation 0.05 --yaw-deg 2\n\nIf the CSV has a column now_s (the time of use), an estimate older than --max-age-ms, or from the future, is denied as stale."
)]
pub struct Arguments {
    /// The table
    table: Input,
    /// Estimates in the world frame (CSV); `-` for standard input
    #[arg(long)]
    estimates: Input,
    /// Confidence of the Gaussian pose-sets [default: the table's]
    #[arg(long)]
    epsilon: Option<f64>,
    /// Kind of pose-set: Gaussian by each estimate's covariance, or bounded by the same bound for all estimates
    #[arg(long, value_enum, default_value = "gaussian")]
    set: Kind,
    /// Bounded sets: largest error of the position, metres
    #[arg(long, required_if_eq("set", "bounded"), allow_negative_numbers = true)]
    translation: Option<f64>,
    /// Bounded sets: largest error of the heading, degrees
    #[arg(long, required_if_eq("set", "bounded"), allow_negative_numbers = true)]
    yaw_deg: Option<f64>,
    /// Deny estimates older than this, in milliseconds
    #[arg(long, default_value_t = 200)]
    max_age_ms: u32,
    /// Print one line of JSON per estimate
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    Gaussian,
    Bounded,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let (bytes, name) = files.read(&arguments.table)?;
    let table = Table::parse(&bytes).map_err(|error| not_a_table(&name, error))?;
    let gate = Evaluator::new(&bytes, arguments.max_age_ms).map_err(|_| {
        Failure::usage(
            format!("--max-age-ms {} is not a valid age", arguments.max_age_ms),
            "give 1 to 2147483647 milliseconds; the check cannot be switched off",
        )
    })?;
    let radius = match arguments.epsilon {
        None => table.radius_squared(),
        Some(epsilon) => core_radius(epsilon).ok_or_else(|| {
            Failure::usage(
                format!("--epsilon {epsilon} is not a confidence that the gate accepts"),
                "give a probability of 0.2 or above and below 1, for example 0.99",
            )
        })?,
    };
    let columns = match arguments.set {
        Kind::Gaussian => Columns::Estimates,
        Kind::Bounded => Columns::TimedPoses,
    };
    let (text, name) = files.read(&arguments.estimates)?;
    let rows = estimates(text.as_slice(), &name, columns).map_err(Failure::input)?;
    if rows.is_empty() {
        return Err(Failure::usage(
            format!("{name} has a header and no estimates"),
            "give at least one row: an empty recording permits nothing",
        ));
    }
    let bar = progress(rows.len() as u64, "judging");
    let mut reasons: BTreeMap<Reason, usize> = BTreeMap::new();
    for (index, row) in rows.iter().enumerate() {
        let verdict = judge(&gate, row, arguments, radius);
        bar.inc(1);
        if let Verdict::Deny { reason, .. } = verdict {
            *reasons.entry(reason).or_default() += 1;
        }
        if arguments.json {
            print_json(&line(index, &verdict))?;
        } else {
            print(&sentence(index, &verdict))?;
        }
    }
    bar.finish_and_clear();
    let denied: usize = reasons.values().sum();
    if !arguments.json {
        print(&format_args!(
            "{} permitted, {denied} denied",
            rows.len() - denied
        ))?;
        for (reason, count) in &reasons {
            print(&format_args!("  {count} {reason}: {}", reason.action()))?;
        }
    }
    Ok(answer(denied == 0))
}

/// Returns the failure for bytes that are not a table: bad input.
pub fn not_a_table(name: &str, error: posegate::table::TableError) -> Failure {
    Failure::usage(
        format!("{name} is not a table that this version reads: {error:?}"),
        "build it again with `posegate table build`",
    )
}

fn judge(gate: &Evaluator<'_>, row: &Row, arguments: &Arguments, radius: RadiusSquared) -> Verdict {
    let set = match arguments.set {
        Kind::Gaussian => PoseSet::gaussian(row.estimate, row.covariance, radius),
        Kind::Bounded => PoseSet::bounded(
            row.estimate,
            arguments.translation.unwrap_or(f64::NAN),
            arguments.yaw_deg.unwrap_or(f64::NAN).to_radians(),
        ),
    };
    // Without a time of use the age is unknown. The estimate is then treated as made at the time of use.
    let times = match row.now_s {
        None => Some((0, 0)),
        Some(now) => clock_ms(now).zip(row.t_s.and_then(clock_ms)),
    };
    match times {
        Some((now, stamp)) => gate.evaluate(now, stamp, set),
        None => Verdict::deny(Reason::Stale),
    }
}

fn line(index: usize, verdict: &Verdict) -> Value {
    match verdict {
        Verdict::Permit { margin } => json!({
            "index": index, "verdict": "permit", "reason": null,
            "margin": factor(*margin), "worst_pose": null,
        }),
        Verdict::Deny {
            reason,
            margin,
            worst_pose,
        } => json!({
            "index": index, "verdict": "deny", "reason": reason.name(),
            "margin": margin.map(factor), "worst_pose": worst_pose.map(coordinates),
        }),
    }
}

fn sentence(index: usize, verdict: &Verdict) -> String {
    match verdict {
        Verdict::Permit { margin } => format!("{index:>6} permit  margin {}", factor_text(*margin)),
        Verdict::Deny {
            reason,
            margin,
            worst_pose,
        } => {
            let margin = margin.map_or(String::new(), |m| format!(", margin {}", factor_text(m)));
            let worst = worst_pose.map_or(String::new(), |pose| {
                let [x, y, yaw] = coordinates(pose);
                format!(
                    ", worst pose ({x:.3} m, {y:.3} m, {:.2} deg)",
                    yaw.to_degrees()
                )
            });
            format!("{index:>6} DENY    {reason}{margin}{worst}")
        }
    }
}
