//! `posegate replay`: runs a recording through the gate, and through the rules that are in use today.

mod arguments;
mod inflation;
mod odometry;
mod outputs;
mod words;

pub use self::arguments::Arguments;

use self::inflation::Inflated;
use self::outputs::Outputs;
use self::words::{check_requested, check_topics, no_estimates, recording, sentences};
use crate::recording::{Recorded, failure};
use crate::site_input::{Failure, Outcome, answer, print_json, progress, site, task, warn};
use posegate::gate::{InvalidParameter, Restart, Settings, Source};
use posegate::set::CrossTerms;
use posegate::table::Table;
use posegate_files::files::{Files, Output};
use posegate_replay::recording::TagLocalizer;
use posegate_replay::replay::{PlayError, Replay, ReplayConfig, play};
use posegate_show::draw::replay_picture;
use posegate_site::{Site, Task};
use serde_json::{Value, json};
use std::collections::BTreeMap;

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    check_outputs(arguments)?;
    let site = site(files, &arguments.site)?;
    let chosen = task(&site, &arguments.task)?;
    let table = table(arguments, files, &site, chosen)?;
    arguments.recorded.check()?;
    let radius =
        Table::parse(&table).map_err(|error| super::gate::not_a_table("the table", error))?;
    let radius_squared = f64::from(radius.radius_squared().q16()) / 65536.0;
    let inflated = Inflated::of(arguments, files, radius.radius_squared())?;
    let reading = arguments.reading(&site);
    let mut input = Recorded::open(&reading, files, radius_squared, |text, name| {
        inflated.reads(text, name);
    })?;
    let odometry = odometry::odometry(arguments, files, &site)?;
    let trust = arguments.trust(inflated.factors.inflation);
    // A fix that is carried along an odometry has the trust applied already.
    let carried = odometry.is_some();
    let mut source = Source::new(
        &arguments.recorded.frame,
        1.0,
        CrossTerms::Filled,
        arguments.motion()?,
    )
    .map_err(parameter)?;
    if !carried {
        source.trust = trust;
        source.aging = inflated.factors.aging;
    }
    let sources = vec![source; arguments.recorded.topic.len().max(1)];
    let task_digest = digest(arguments, &site, chosen);
    let settings = settings(arguments, task_digest, &sources);
    let setup = ReplayConfig {
        table: &table,
        settings: &settings,
        success: &chosen.success,
        bounded: arguments.set.bounded(),
        world: &arguments.recorded.frame,
        clock: arguments.clock(input.clock),
        examined: !arguments.fast,
    };
    let mut replay = Replay::new(&setup, input.track.take()).map_err(parameter)?;
    if let Some(odometry) = odometry {
        let tracker = odometry::tracker(arguments, trust, radius.radius_squared())?;
        replay.carry_along(odometry, tracker).map_err(|_| {
            Failure::usage(
                "--odom-noise, --odom-slip, --odom-gap-ms or --fix-age-ms is out of range".into(),
                "give deviations and a share from 0 on, and at least 1 millisecond",
            )
        })?;
    }
    let mut outputs = Outputs::open(arguments, files)?;
    let bar = progress(input.length, "replaying");
    let played = play(
        &mut *input.recording,
        &mut input.part,
        &mut replay,
        &mut |row| outputs.row(row),
        &mut |bytes| bar.set_position(bytes),
    );
    bar.finish_and_clear();
    played.map_err(play_failure)?;
    let diagnostics = input.recording.diagnostics();
    let [permits, estimates] = replay.permits();
    if !arguments.recorded.topic.is_empty() {
        check_topics(arguments, diagnostics)?;
    }
    if estimates == 0 {
        return Err(no_estimates(arguments, diagnostics, input.part.outside));
    }
    check_requested(arguments, diagnostics, &replay)?;
    if let Some(damage) = &diagnostics.damage {
        warn(&format_args!(
            "{}: broken {damage}; the intact part was read",
            input.name
        ));
    }
    let mut summary = summary(arguments, &input, &inflated, &replay);
    if let Some([rows, left_out]) = outputs.table() {
        summary["csv"] = json!({"rows": rows, "left_out": left_out});
        if left_out > 0 {
            warn(&format_args!(
                "{left_out} of {estimates} estimates are not in the table: in another frame, without a covariance, or two poses fit"
            ));
        }
    }
    outputs.finish(&summary)?;
    if let Some(output) = &arguments.output {
        let title = format!(
            "{} against {}",
            name_of(arguments.log.as_path()),
            arguments.task
        );
        files.write(output, replay_picture(&title, &replay).as_bytes())?;
    }
    if arguments.json {
        print_json(&summary)?;
    } else if results_on_stdout(arguments) == 0 {
        sentences(arguments, &replay, &summary, [permits, estimates])?;
    }
    let [(_, verdicts), (_, permissions), ..] = replay.tallies();
    Ok(answer(
        verdicts.false_permits == 0
            && permissions.false_permits == 0
            && replay.open_moments().outside == 0,
    ))
}

/// Returns how many of the results that are files go to standard output.
fn results_on_stdout(arguments: &Arguments) -> usize {
    let outputs = [&arguments.rows, &arguments.csv, &arguments.output]
        .into_iter()
        .flatten();
    outputs.filter(|output| output.is_standard()).count()
}

/// Refuses more than one result on standard output.
fn check_outputs(arguments: &Arguments) -> Result<(), Failure> {
    if results_on_stdout(arguments) + usize::from(arguments.json) > 1
        || arguments.mcap.as_ref().is_some_and(Output::is_standard)
    {
        return Err(Failure::usage(
            "standard output cannot hold more than one result, and no MCAP".into(),
            "write the others to files",
        ));
    }
    Ok(())
}

/// Returns the settings of the gate.
fn settings<'a>(
    arguments: &'a Arguments,
    task_digest: [u8; 32],
    sources: &'a [Source],
) -> Settings<'a> {
    Settings {
        task: &arguments.task,
        task_digest,
        sources,
        maximum_age_ms: arguments.max_age_ms,
        response_ms: arguments.response_ms,
        report_period_ms: 1,
        permit_hold_ms: arguments.permit_hold_ms,
        inhibit_hold_ms: arguments.inhibit_hold_ms,
        permits_in_a_row: arguments.permits_in_a_row,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: None,
    }
}

/// Returns the results as JSON.
fn summary(
    arguments: &Arguments,
    input: &Recorded,
    inflated: &Inflated,
    replay: &Replay<'_>,
) -> Value {
    let mut summary = replay.summary();
    summary["task"] = json!(arguments.task);
    if arguments.inflation_model.is_some() {
        summary["inflation"] = inflated.to_json();
    }
    summary["recording"] = recording(arguments, input);
    summary["child_frames"] = json!(input.recording.diagnostics().child_frames);
    summary["body_frames"] = input.body_frames();
    summary["truth"]["duplicates"] = json!(input.duplicates);
    if let Some(looks) = &input.part.looks
        && has_detections(input)
    {
        let counts: BTreeMap<_, _> = looks.counts().into_iter().collect();
        summary["looks"] = json!(counts);
        summary["looks"]["frame"] = json!(looks.frame());
    }
    summary
}

fn name_of(path: &std::path::Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

pub(super) fn parameter(error: InvalidParameter) -> Failure {
    let help = match error {
        InvalidParameter::Inflation => "give --inflation 1 to 4096",
        InvalidParameter::Frame => "name the world frame: --frame map",
        InvalidParameter::Sources => "give at most 256 topics",
        InvalidParameter::PermitsInARow => "give --permits-in-a-row 1 or more",
        _ => "give 1 to 2147483647 milliseconds; no check can be switched off",
    };
    Failure::usage(format!("a setting of the gate is invalid: {error}"), help)
}

/// Returns the digest of the task, with the confidence of this replay.
fn digest(arguments: &Arguments, site: &Site, task: &Task) -> [u8; 32] {
    task.success
        .digest(arguments.epsilon.unwrap_or(site.epsilon))
}

/// Returns the given table, or builds and proves one from the site.
fn table(
    arguments: &Arguments,
    files: &Files,
    site: &Site,
    task: &Task,
) -> Result<Vec<u8>, Failure> {
    if let Some(path) = &arguments.table {
        let (bytes, name) = files.read(path)?;
        let table = Table::parse(&bytes).map_err(|error| super::gate::not_a_table(&name, error))?;
        if table.task() != arguments.task || table.task_digest() != digest(arguments, site, task) {
            return Err(Failure::usage(
                format!(
                    "{name} is not a table of this task with the goal, set and confidence of the site file"
                ),
                "build it again with `posegate table build`, or leave --table out",
            ));
        }
        return Ok(bytes);
    }
    let epsilon = arguments.epsilon.unwrap_or(site.epsilon);
    crate::table::built(site, &arguments.site, &arguments.task, epsilon)
}

fn play_failure(error: PlayError<Failure>) -> Failure {
    match error {
        PlayError::Recording(error) => failure(error),
        PlayError::NoCamera => Failure::usage(
            "detections need a camera: the site has none, or several".into(),
            "name it: --camera front",
        ),
        PlayError::Cameras([one, other]) => Failure::usage(
            format!("detections in the frames `{one}` and `{other}`, which belong to two cameras"),
            "give the topic of one camera, and name it: --camera front",
        ),
        PlayError::Taker(failure) => failure,
    }
}

/// Returns `true` if the recording had detections of tags.
fn has_detections(input: &Recorded) -> bool {
    let counts = input.part.looks.as_ref().map(TagLocalizer::counts);
    counts.is_some_and(|counts| counts.iter().any(|(_, count)| *count > 0))
}
