//! `posegate gate`: decides on recorded estimates with the code that runs on the controller.

use crate::arguments::numbers;
use crate::belief::SetArgs;
use crate::site_input::{Failure, Outcome, answer, print, print_json, progress};
use posegate::confidence::core_radius;
use posegate::gate::{Reason, Verdict};
use posegate::motion::MotionBounds;
use posegate::pose::Pose;
use posegate::recordings::Evaluator;
use posegate::set::{Growth, PoseSet, RadiusSquared};
use posegate::table::Table;
use posegate_files::files::{Files, Input};
use posegate_replay::{
    Columns, Row, clock_ms, coordinates, estimates, factor, factor_text, reports,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Decides on each estimate of a recording: permit, or deny with the reason
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate gate dock.posegate --estimates estimates.csv --json\n  posegate gate dock.posegate --estimates poses.csv --set bounded --translation 0.05 --yaw-deg 2\n\nIf the CSV has a column now_s (the time of use), an estimate older than --max-age-ms, or from the future, is denied as stale.\n\nRows of one t_s with a column hypothesis (0, 1, ...) are one report: it is permitted only if every one of them is inside.\n\nWith --max-speed, --max-yaw-rate and --horizon-ms every pose-set also holds all poses to which the robot can have moved."
)]
pub struct Arguments {
    /// The table
    table: Input,
    /// Estimates in the world frame (CSV); `-` for standard input
    #[arg(long)]
    estimates: Input,
    /// The site's [origin], which is subtracted from the estimates: metres
    #[arg(long, value_name = "X,Y", value_parser = origin, allow_hyphen_values = true)]
    origin: Option<[f64; 2]>,
    /// Confidence of the Gaussian pose-sets [default: the table's]
    #[arg(long)]
    epsilon: Option<f64>,
    #[command(flatten)]
    set: SetArgs,
    /// Grow each pose-set by a movement: the robot's largest speed, m/s
    #[arg(long, requires = "horizon_ms", value_name = "M_S")]
    max_speed: Option<f64>,
    /// Grow each pose-set by a movement: the robot's largest turn rate, degrees/s
    #[arg(long, requires = "horizon_ms", value_name = "DEG_S")]
    max_yaw_rate: Option<f64>,
    /// For how long the robot may move from the estimate on, milliseconds
    #[arg(long, value_name = "N")]
    horizon_ms: Option<u32>,
    /// Deny estimates older than this, in milliseconds
    #[arg(long, default_value_t = 200)]
    max_age_ms: u32,
    /// Print one line of JSON per estimate
    #[arg(long)]
    json: bool,
}

fn origin(text: &str) -> Result<[f64; 2], &'static str> {
    numbers(text, f64::is_finite).ok_or("expected two numbers in metres, like 448000,5412000")
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
    let radius = radius(&table, arguments.epsilon)?;
    let task_digest = posegate_files::printable::hex(&table.task_digest());
    let columns = match arguments.set.bounded() {
        None => Columns::Estimates,
        Some(_) => Columns::TimedPoses,
    };
    let (text, name) = files.read(&arguments.estimates)?;
    let mut rows = estimates(text.as_slice(), &name, columns).map_err(Failure::input)?;
    let [east, north] = arguments.origin.unwrap_or_default();
    for row in &mut rows {
        let pose = &mut row.estimate;
        (pose.x_m, pose.y_m) = (pose.x_m - east, pose.y_m - north);
    }
    if rows.is_empty() {
        return Err(Failure::usage(
            format!("{name} has a header and no estimates"),
            "give at least one row: an empty recording permits nothing",
        ));
    }
    let movement = movement(arguments)?;
    let reports = reports(&rows, &name).map_err(Failure::input)?;
    let bar = progress(rows.len() as u64, "judging");
    let mut reasons: BTreeMap<Reason, usize> = BTreeMap::new();
    for (index, report) in reports.iter().enumerate() {
        let decided = judge(&rows[report.clone()], |row| {
            judge_row(&gate, row, arguments, radius, movement)
        });
        bar.inc(report.len() as u64);
        if let Verdict::Deny { reason, .. } = decided.verdict {
            *reasons.entry(reason).or_default() += 1;
        }
        if arguments.json {
            let mut line = line(index, &decided, [east, north]);
            line["task_digest"] = json!(task_digest);
            print_json(&line)?;
        } else {
            print(&sentence(index, &decided, [east, north]))?;
        }
    }
    bar.finish_and_clear();
    let denied: usize = reasons.values().sum();
    if !arguments.json {
        print(&format_args!(
            "{} permitted, {denied} denied",
            reports.len() - denied
        ))?;
        for (reason, count) in &reasons {
            print(&format_args!("  {count} {reason}: {}", reason.action()))?;
        }
    }
    Ok(answer(denied == 0))
}

/// Returns the squared radius of a confidence, or that of the table.
pub fn radius(table: &Table<'_>, epsilon: Option<f64>) -> Result<RadiusSquared, Failure> {
    let Some(epsilon) = epsilon else {
        return Ok(table.radius_squared());
    };
    core_radius(epsilon).ok_or_else(|| {
        Failure::usage(
            format!("--epsilon {epsilon} is not a confidence that the gate accepts"),
            "give a probability of 0.2 or above and below 1, for example 0.99",
        )
    })
}

/// Returns the failure for bytes that are not a table: bad input.
pub fn not_a_table(name: &str, error: posegate::table::TableError) -> Failure {
    Failure::usage(
        format!("{name} is not a table that this version reads: {error}"),
        "build it again with `posegate table build`",
    )
}

/// Returns the movement by which pose-sets grow.
fn movement(arguments: &Arguments) -> Result<Growth, Failure> {
    let Some(horizon_ms) = arguments.horizon_ms else {
        return Ok(Growth::NONE);
    };
    if arguments.max_speed.is_none() && arguments.max_yaw_rate.is_none() {
        return Err(Failure::usage(
            "--horizon-ms has no effect without a speed".to_string(),
            "give --max-speed (m/s) and --max-yaw-rate (degrees/s) of the robot",
        ));
    }
    let (speed, rate) = (
        arguments.max_speed.unwrap_or(0.0),
        arguments.max_yaw_rate.unwrap_or(0.0),
    );
    Ok(motion(speed, rate)?.within(horizon_ms))
}

/// Returns the bounds of a robot's movement: m/s, degrees/s.
pub fn motion(speed: f64, rate: f64) -> Result<MotionBounds, Failure> {
    MotionBounds::in_any_direction(speed, rate.to_radians()).ok_or_else(|| {
        Failure::usage(
            format!("--max-speed {speed} --max-yaw-rate {rate} are not speeds of a robot"),
            "give numbers from 0 to 1000 m/s and from 0 to 1400 degrees/s",
        )
    })
}

/// The verdict on a report, and the number of the hypothesis that it is about if there are several.
struct Decided {
    verdict: Verdict,
    hypothesis: Option<u64>,
}

/// Returns the first denial of a report's hypotheses, else the permit of least margin.
fn judge(rows: &[Row], verdict: impl Fn(&Row) -> Verdict) -> Decided {
    let decided = rows.iter().map(|row| Decided {
        verdict: verdict(row),
        hypothesis: row.hypothesis,
    });
    // `None` is less than any margin, and the first of equal ones is taken.
    let least = decided.min_by_key(|decided| match decided.verdict {
        Verdict::Permit { margin } => Some(margin.q16()),
        Verdict::Deny { .. } => None,
    });
    // Reports are never empty.
    least.unwrap_or(Decided {
        verdict: Verdict::deny(Reason::CovarianceUnknown),
        hypothesis: None,
    })
}

fn judge_row(
    gate: &Evaluator<'_>,
    row: &Row,
    arguments: &Arguments,
    radius: RadiusSquared,
    movement: Growth,
) -> Verdict {
    let set = match arguments.set.bounded() {
        None => PoseSet::gaussian(row.estimate, row.covariance, radius),
        Some([translation, yaw]) => PoseSet::bounded(row.estimate, translation, yaw),
    };
    let set = set.map(|set| set.grown(movement));
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

/// Returns a pose in the map's numbers: m, m, rad.
fn in_map(pose: Pose, [east, north]: [f64; 2]) -> [f64; 3] {
    let [x, y, yaw] = coordinates(pose);
    [x + east, y + north, yaw]
}

fn line(index: usize, decided: &Decided, origin: [f64; 2]) -> Value {
    let mut line = match &decided.verdict {
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
            "margin": margin.map(factor), "worst_pose": worst_pose.map(|pose| in_map(pose, origin)),
        }),
    };
    if let Some(hypothesis) = decided.hypothesis {
        line["hypothesis"] = json!(hypothesis);
    }
    line
}

fn sentence(index: usize, decided: &Decided, origin: [f64; 2]) -> String {
    let about = decided
        .hypothesis
        .map_or(String::new(), |number| format!(", hypothesis {number}"));
    match &decided.verdict {
        Verdict::Permit { margin } => {
            format!("{index:>6} permit  margin {}{about}", factor_text(*margin))
        }
        Verdict::Deny {
            reason,
            margin,
            worst_pose,
        } => {
            let margin = margin.map_or(String::new(), |m| format!(", margin {}", factor_text(m)));
            let worst = worst_pose.map_or(String::new(), |pose| {
                let [x, y, yaw] = in_map(pose, origin);
                format!(
                    ", worst pose ({x:.3} m, {y:.3} m, {:.2} deg)",
                    yaw.to_degrees()
                )
            });
            format!("{index:>6} DENY    {reason}{about}{margin}{worst}")
        }
    }
}
