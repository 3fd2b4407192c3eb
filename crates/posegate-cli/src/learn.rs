//! `posegate learn`: learns error bounds and inflation factors, and tests outcomes against a claim.

use crate::site_input::{Failure, Outcome, answer, print, print_json, site, warn};
use posegate_files::files::{Files, Input, Output};
use posegate_learn::{
    BoundsSettings, Detection, Detections, ErrorModel, GroupReport, InflationModel,
    InflationReport, InflationSettings, LearnError, RunSource, Runs, ScoredEstimates, by_age_json,
    learn_bounds, learn_inflation, outcomes, test_outcomes,
};
use posegate_site::{Site, Task, TaskKind};
use serde_json::{Value, json};

mod check;
mod from_recording;
mod survey;
mod taken_with;

/// Learns models for the gate and the planner from recordings
#[derive(clap::Subcommand)]
pub enum Command {
    Bounds(Bounds),
    Inflation(Inflation),
    Outcomes(Outcomes),
    Check(check::Check),
    Survey(survey::Survey),
}

/// Learns error bounds of detections by distance and angles, and the share of views that are detected
///
/// Each of the two bounds (metres, radians) holds for the share Q of the detections of every accepted region.
/// The model has no bounds for other regions. Rows with NaN or a missing field are refused.
///
/// Rows are independent of each other unless the column `run` names what they have in common: one drive, one video, one
/// approach. Frames of a video depend on each other. Then whole runs go to one side of the split, and regions count their
/// independent rows. Without `run`, rows that follow each other at video rate by `t_s` are cut into runs at gaps.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate learn bounds detections.csv --quantile 0.95 -o tags.toml\n  posegate predict tags.toml --at places.csv --json\n  posegate learn bounds drive.mcap --site site.toml --camera front --detections /detections --truth /mocap --quantile 0.95 -o tags.toml\n\nColumns: d_m, phi_deg, psi_deg, detected, err_translation_m, err_yaw_rad (the errors empty where detected is 0); run for rows that depend on each other, such as the frames of one approach; second_err_translation_m, second_err_yaw_rad for the other pose that fits the image, if the gate takes both. In a site file: [error_model.NAME] file = \"tags.toml\"."
)]
pub struct Bounds {
    /// Views with the errors of their detections (CSV), or a bag with detections and truth; `-` for standard input
    detections: Input,
    /// The share of the detections for which each bound must hold
    #[arg(long, allow_negative_numbers = true)]
    quantile: f64,
    /// The model to write; `-` for standard output
    #[arg(short, long)]
    output: Output,
    /// The probability, over the data, with which a region's bounds hold for that share
    #[arg(long, default_value_t = BoundsSettings::default().confidence, allow_negative_numbers = true)]
    confidence: f64,
    /// The seed with which the rows are split
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    taken_with: taken_with::Arguments,
    #[command(flatten)]
    recorded: from_recording::FromRecording,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Learns the factor by which a source's covariance must grow so that its pose-sets contain the truth
///
/// There is one factor overall and one per condition: by the first column named since_..._s, or else by the covariance's
/// size. Rows that depend on each other in time count as fewer independent rows. A column `robot`, or else `run`, names
/// what differs as a whole: the factors then hold for a new robot with the stated confidence. Robots must be independent of
/// each other and of the new one.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate learn inflation estimates.csv --epsilon 0.95 -o filter.toml\n  posegate predict filter.toml --at estimates.csv --json\n  posegate learn inflation drive.mcap --topic /amcl_pose --truth /mocap --epsilon 0.95 -o filter.toml\n\nColumns: those of estimates, and true_x_m, true_y_m, true_yaw_rad; robot or run for estimates of several. Rows whose covariance is impossible are counted, named and left out."
)]
pub struct Inflation {
    /// Estimates with truth: CSV, or a bag; `-` for standard input
    estimates: Input,
    /// The probability with which a pose-set must contain the truth
    #[arg(long, allow_negative_numbers = true)]
    epsilon: f64,
    /// The model to write; `-` for standard output
    #[arg(short, long)]
    output: Output,
    /// The probability, over the data, with which a condition's factor is large enough. With several robots or runs:
    /// large enough for a new one
    #[arg(long, default_value_t = InflationSettings::default().confidence, allow_negative_numbers = true)]
    confidence: f64,
    /// Learn factors for the robots (or runs) in the data alone, not for a new one
    #[arg(long)]
    these_only: bool,
    /// The column that defines the conditions; `log_det` for the covariance's size
    #[arg(long)]
    condition: Option<String>,
    #[command(flatten)]
    rig: from_recording::Rig,
    #[command(flatten)]
    recorded: from_recording::FromRecording,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Tests whether the outcomes of permitted dockings contradict the claim that they succeed with probability epsilon
///
/// Exit code 1 if they do. The test may be run after every docking: its false alarms stay below alpha, whatever the results of
/// earlier dockings. `lower` and `upper` limit the probability of success with confidence 1 - alpha in all of these tests together
/// (a confidence sequence). This assumes that all dockings succeed with the same probability, independently of each other.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate learn outcomes outcomes.csv --epsilon 0.99 --json\n\nColumns: success (0 or 1); t_s if the rows are not in the order of time."
)]
pub struct Outcomes {
    /// Outcomes (CSV); `-` for standard input
    outcomes: Input,
    /// The claimed probability of success
    #[arg(long, allow_negative_numbers = true)]
    epsilon: f64,
    /// The probability with which a true claim is ever contradicted
    #[arg(long, default_value_t = 0.05, allow_negative_numbers = true)]
    alpha: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(command: &Command, files: &Files) -> Outcome {
    match command {
        Command::Bounds(arguments) => bounds(arguments, files),
        Command::Inflation(arguments) => inflation(arguments, files),
        Command::Outcomes(arguments) => test_claim(arguments, files),
        Command::Check(arguments) => check::run(arguments, files),
        Command::Survey(arguments) => survey::run(arguments, files),
    }
}

/// Returns the failure for an error of learning, with what to do about it.
pub fn refused(error: LearnError) -> Failure {
    match &error {
        LearnError::TooFew { .. } => Failure::usage(
            error.to_string(),
            "give more rows (of a longer recording or of more runs, if rows depend on each other), or ask for a smaller share or a smaller \
             --confidence",
        ),
        LearnError::TooFewGroups { found, rows, .. } => Failure::usage(
            error.to_string(),
            &format!(
                "record more of them, give --confidence {:.2} or less, or --these-only for factors of these {found} alone; a smaller \
                 --epsilon needs fewer than {rows} rows of each",
                (*found as f64 / (*found as f64 + 1.0) * 100.0).floor() / 100.0
            ),
        ),
        LearnError::TooFewRuns { .. } => Failure::usage(
            error.to_string(),
            "record more drives, or name shorter stretches of independent rows in the column `run`",
        ),
        LearnError::Share { name, .. } => {
            Failure::usage(error.to_string(), &format!("write it like --{name} 0.95"))
        }
        LearnError::Empty { .. } => Failure::usage(error.to_string(), "give at least one row"),
        LearnError::Nowhere { .. } => Failure::usage(
            error.to_string(),
            "give detections that fill a part of (d, phi, psi), or all at the same few distances and angles",
        ),
        LearnError::Unwritten(_) => Failure::internal(error.to_string()),
        _ => Failure::input(error),
    }
}

/// Returns an error if the model and the JSON would both go to standard output.
fn one_output(output: &Output, json: bool) -> Result<(), Failure> {
    if json && output.is_standard() {
        return Err(Failure::usage(
            "the model and JSON cannot both go to standard output".to_owned(),
            "name a file with -o, or leave out --json",
        ));
    }
    Ok(())
}

fn bounds(arguments: &Bounds, files: &Files) -> Outcome {
    one_output(&arguments.output, arguments.json)?;
    let rig = arguments.taken_with.rig();
    let (detections, name) =
        match from_recording::views(files, &arguments.detections, &arguments.recorded, rig)? {
            Some((table, name)) => (
                Detections::draw(table.as_slice(), &name, arguments.seed),
                name,
            ),
            None => {
                let opened = files.open(&arguments.detections)?;
                let drawn = Detections::draw(opened.reader, &opened.name, arguments.seed);
                (drawn, opened.name)
            }
        };
    let detections = detections.map_err(refused)?;
    let settings = BoundsSettings {
        quantile: arguments.quantile,
        confidence: arguments.confidence,
        seed: arguments.seed,
        taken_with: arguments.taken_with.described(files)?,
    };
    warn_of_cut_runs(&detections.runs, &name);
    let bar = indicatif::ProgressBar::new_spinner().with_message("fitting");
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    let model = learn_bounds(&detections, &settings).map_err(refused);
    bar.finish_and_clear();
    let model = model?;
    files.write(
        &arguments.output,
        model.write().map_err(refused)?.as_bytes(),
    )?;
    let too_wide = match arguments.taken_with.rig().0 {
        Some(input) => wider_than_sets(&model, &detections.rows, &site(files, input)?),
        None => Vec::new(),
    };
    for task in &too_wide {
        warn(&format_args!(
            "every bound is wider than the success set of the task `{task}`: with a pose-set of that size it is never permitted, not even at its goal"
        ));
    }
    if arguments.json {
        let mut report = model_json(&model);
        report["wider_than"] = json!(too_wide);
        print_json(&report)?;
    } else if !arguments.output.is_standard() {
        print_model(&model)?;
    }
    Ok(answer(true))
}

/// Returns the work tasks that no bound of a model permits: about the goal, a pose within the smallest bounds of all rows is outside of the
/// success set.
fn wider_than_sets(model: &ErrorModel, rows: &[Detection], site: &Site) -> Vec<String> {
    let bounds = rows.iter().filter_map(|row| model.bounds_deg(row.at));
    let smallest = bounds.reduce(|a, b| (a.0.min(b.0), a.1.min(b.1)));
    let Some((translation, yaw)) = smallest else {
        return Vec::new();
    };
    let fits = |task: &Task| {
        let goal = task.success.goal;
        (0..16).all(|step| {
            let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 16.0).sin_cos();
            [-yaw, 0.0, yaw].iter().all(|turn| {
                let [x, y] = [goal.x + translation * cos, goal.y + translation * sin];
                let pose = [x, y, goal.yaw_deg.to_radians() + turn];
                task.success.membership(pose).inside
            })
        })
    };
    let work = site
        .tasks
        .iter()
        .filter(|(_, task)| task.kind == TaskKind::Work);
    work.filter(|(_, task)| !fits(task))
        .map(|(name, _)| name.clone())
        .collect()
}

/// Warns of rows at video rate without names of runs, which are cut into runs.
fn warn_of_cut_runs(runs: &Runs, file: &str) {
    if let RunSource::Gaps { step_s, gap_s } = runs.source {
        warn(&format_args!(
            "{file}: no column `run`, and rows follow each other within {step_s:.3} s: such rows depend on each other. They are cut into {} runs \
             at gaps in `t_s` of more than {gap_s} s. Name the drive, video or approach of each row in a column `run`",
            runs.count().unwrap_or(0)
        ));
    }
}

fn model_json(model: &ErrorModel) -> Value {
    let (views, detections, flip_share) = model.counts();
    let regions = model.regions().map(|region| {
        let [d, phi, psi] = region.ends;
        json!({"d_m": d, "phi_deg": phi, "psi_deg": psi, "detections": region.detections, "rows": region.detections, "independent_rows": region.independent, "rank": region.rank})
    });
    let refused = model.refused().map(|cell| {
        let [d, phi, psi] = cell.ends;
        json!({"d_m": d, "phi_deg": phi, "psi_deg": psi, "detections": cell.detections, "why": cell.why})
    });
    let [d, phi, psi] = model.reach();
    let (rows, independent) = model.independent();
    json!({
        "taken_with": model.taken_with(),
        "rows": rows, "independent_rows": independent, "runs": model.runs(), "drawn_of": model.drawn_of(), "of_better_pose": model.is_of_better_pose(),
        "quantile": model.quantile(), "views": views, "detections": detections, "flip_share": flip_share,
        "reach": {"d_m": d, "phi_deg": phi, "psi_deg": psi},
        "regions": regions.collect::<Vec<_>>(), "refused": refused.collect::<Vec<_>>(),
    })
}

fn print_model(model: &ErrorModel) -> Result<(), Failure> {
    let (views, detections, flip_share) = model.counts();
    let [d, phi, psi] = model.reach();
    print(&format_args!(
        "{detections} detections of {views} views; {:.2} % of those with psi of 10 deg or more are flips",
        100.0 * flip_share
    ))?;
    if model.is_of_better_pose() {
        print(
            &"the bounds hold for the better one of both poses of a tag: a gate must take both, and a permit needs both",
        )?;
    }
    if let Some(rows) = model.drawn_of() {
        print(&format_args!(
            "the {views} views were drawn at random from {rows} rows; the guarantees are those for the drawn ones"
        ))?;
    }
    if let Some(runs) = model.runs() {
        let (rows, independent) = model.independent();
        print(&format_args!(
            "{rows} rows of {runs} runs count as {independent} independent rows"
        ))?;
    }
    print(&format_args!(
        "bounds for {} % of the detections, {} regions, within d {}..{} m, phi {}..{} deg, psi {}..{} deg",
        100.0 * model.quantile(),
        model.regions().count(),
        d[0],
        d[1],
        phi[0],
        phi[1],
        psi[0],
        psi[1]
    ))?;
    for cell in model.refused() {
        let [d, phi, psi] = cell.ends;
        print(&format_args!(
            "refused: d {}..{} m, phi {}..{} deg, psi {}..{} deg: {} ({} detections)",
            d[0], d[1], phi[0], phi[1], psi[0], psi[1], cell.why, cell.detections
        ))?;
    }
    Ok(())
}

fn inflation(arguments: &Inflation, files: &Files) -> Outcome {
    one_output(&arguments.output, arguments.json)?;
    let from = &arguments.estimates;
    let rig = arguments.rig.borrowed();
    let (bytes, name) = match from_recording::estimates(
        files,
        from,
        &arguments.recorded,
        rig,
        arguments.epsilon,
    )? {
        Some(table) => table,
        None => files.read(from)?,
    };
    let estimates =
        ScoredEstimates::read(&bytes, &name, arguments.condition.as_deref()).map_err(refused)?;
    let settings = InflationSettings {
        epsilon: arguments.epsilon,
        confidence: arguments.confidence,
        new_group: !arguments.these_only,
    };
    let model = learn_inflation(&estimates, &settings).map_err(refused)?;
    files.write(
        &arguments.output,
        model.write().map_err(refused)?.as_bytes(),
    )?;
    if estimates.without_truth > 0 {
        warn(&format_args!(
            "{name}: {} rows have no true pose and are left out",
            estimates.without_truth
        ));
    }
    if !estimates.timed {
        let overall = model.overall();
        let dependent = if overall.independent_rows * 2 < overall.rows {
            format!(
                ". They look dependent: {} rows count as {} independent ones",
                overall.rows, overall.independent_rows
            )
        } else {
            String::new()
        };
        warn(&format_args!(
            "{name}: no column `t_s`: rows are taken to follow each other in the file's order{dependent}"
        ));
    }
    if let Some(first) = estimates.impossible.first() {
        warn(&format_args!(
            "{name}:{first}: an impossible covariance; {} such rows are left out",
            estimates.impossible.len()
        ));
    }
    if arguments.json {
        print_json(&factors(&model, &estimates.impossible))?;
    } else if !arguments.output.is_standard() {
        for (what, part) in parts(&model) {
            print(&format_args!(
                "{what:<24} {:>7} rows (as {:>6} independent ones), held {:>6.2} %: inflation {:.3} ({:.3} to {:.3})",
                part.rows,
                part.independent_rows,
                100.0 * part.held,
                part.inflation,
                part.low,
                part.inflation
            ))?;
        }
        groups(&model)?;
        source(&model)?;
    }
    Ok(answer(true))
}

fn groups(model: &InflationModel) -> Result<(), Failure> {
    for group in model.groups() {
        let left_out = match group.left_out_coverage {
            Some(share) => format!("{:.2} %", 100.0 * share),
            None => "too few others".to_owned(),
        };
        print(&format_args!(
            "{:<24} {:>7} rows, inflated sets held {:.2} %; with the factors of the others {left_out}",
            group.name,
            group.rows,
            100.0 * group.coverage
        ))?;
    }
    match model.new_group() {
        Some(column) => print(&format_args!(
            "the factors hold for a new {column} with confidence {}",
            model.confidence()
        )),
        None if model.groups().is_empty() => {
            print(&"the factors hold for the robot of these rows, not for another one")
        }
        None => print(&"the factors hold for these alone, not for a new one"),
    }
}

/// Prints the settings of the controller's source.
fn source(model: &InflationModel) -> Result<(), Failure> {
    let Some(by_age) = model.by_age() else {
        return print(&"no settings for a controller: a condition has no factor");
    };
    let own = f64::from(by_age.inflation.q16()) / 65_536.0;
    let ages: Vec<String> = by_age
        .steps()
        .map(|(until_ms, inflation)| {
            format!(", {inflation} up to {until_ms} ms since the last fix")
        })
        .collect();
    print(&format_args!(
        "on the controller: inflation {own:.6}{}",
        ages.concat()
    ))?;
    match young_age_warning(model) {
        Some(late) => print(&late),
        None => Ok(()),
    }
}

/// Returns a warning if a model by age has no smaller factors for young estimates.
pub fn young_age_warning(model: &InflationModel) -> Option<String> {
    let late = model.begins_late()?;
    Some(format!(
        "the data begin {late} s after a fix: only data from at most 0.064 s on give smaller factors by age"
    ))
}

fn parts(model: &InflationModel) -> Vec<(String, &InflationReport)> {
    let mut all = vec![("overall".to_owned(), model.overall())];
    for part in model.parts() {
        all.push((
            format!("{} {}..{}", model.condition(), part.from, part.to),
            part,
        ));
    }
    all
}

fn factors(model: &InflationModel, impossible: &[u64]) -> Value {
    let (rows, _) = model.counts();
    let of = |part: &InflationReport| {
        json!({
            "from": part.from, "to": part.to, "rows": part.rows, "independent_rows": part.independent_rows,
            "held": part.held, "needed": part.needed, "low": part.low,
            "inflation": if part.inflation == 0.0 { Value::Null } else { json!(part.inflation) },
        })
    };
    let group = |group: &GroupReport| {
        json!({
            "name": group.name, "rows": group.rows, "coverage": group.coverage,
            "left_out_coverage": group.left_out_coverage,
        })
    };
    json!({
        "epsilon": model.epsilon(), "rows": rows, "impossible": impossible.len(), "impossible_lines": impossible,
        "new_group": model.new_group(),
        "groups": model.groups().iter().map(group).collect::<Vec<_>>(),
        "condition": model.condition(), "overall": of(model.overall()),
        "source": model.by_age().map(|by_age| json!({
            "inflation": f64::from(by_age.inflation.q16()) / 65_536.0, "ages": by_age_json(&by_age),
        })),
        "conditions": model.parts().iter().map(of).collect::<Vec<_>>(),
    })
}

fn test_claim(arguments: &Outcomes, files: &Files) -> Outcome {
    let (bytes, name) = files.read(&arguments.outcomes)?;
    let fleet = outcomes(&bytes, &name).map_err(refused)?;
    let found = test_outcomes(&fleet, arguments.epsilon, arguments.alpha).map_err(refused)?;
    let contradicted = found.contradicted_at.is_some();
    if arguments.json {
        print_json(&json!({
            "count": found.count, "successes": found.successes, "epsilon": arguments.epsilon,
            "alpha": arguments.alpha, "lower": found.limits[0], "upper": found.limits[1],
            "e_value": found.e_value, "largest_e_value": found.largest_e_value,
            "contradicted": contradicted, "contradicted_at": found.contradicted_at,
        }))?;
    } else {
        print(&format_args!(
            "{} of {} succeeded: {:.4} to {:.4} with confidence {}, however often one looks",
            found.successes,
            found.count,
            found.limits[0],
            found.limits[1],
            1.0 - arguments.alpha
        ))?;
        match found.contradicted_at {
            Some(at) => print(&format_args!(
                "the claim of {} is contradicted after {at} dockings (e-value {:.3e})",
                arguments.epsilon, found.largest_e_value
            ))?,
            None => print(&format_args!(
                "the claim of {} is not contradicted (e-value {:.3})",
                arguments.epsilon, found.e_value
            ))?,
        }
    }
    Ok(answer(!contradicted))
}
