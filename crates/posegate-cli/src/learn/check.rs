//! `posegate learn check`: tests whether a learnt model still holds on new data.

use super::{from_recording, refused, warn_of_cut_runs};
use crate::site_input::{Failure, Outcome, answer, print, print_json, warn};
use posegate_files::files::{Files, Input};
use posegate_learn::{
    BoundCheck, Change, CheckReport, CheckSettings, Detections, Model, RegionCheck, check_bounds,
};
use serde_json::{Value, json};

/// Tests whether a learnt error model still holds on new detections
///
/// Exit code 1 if the model is contradicted. The test may be run after every detection. The probability that it ever
/// contradicts a valid model is at most 1 - confidence. It reports the contradicted region, after how many rows, and since
/// which row. It also reports the kind of the change: `scale` (noise, blur, light), `offset` (a displaced tag or camera) or
/// `calibration` (image centre, focal length, a turned camera or tag). Rows of one `run` are one observation. Without the
/// column `run`, rows are independent of each other, in the order of `t_s` or of the file.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate learn check tags.toml today.csv --json\n\nColumns: those of `learn bounds`."
)]
pub struct Check {
    /// The model that `posegate learn bounds` wrote
    model: Input,
    /// New views with the errors of their detections: CSV, or a bag; `-` for standard input
    detections: Input,
    /// The probability with which a model that holds is never contradicted
    #[arg(long, default_value_t = CheckSettings::default().confidence, allow_negative_numbers = true)]
    confidence: f64,
    #[command(flatten)]
    rig: from_recording::Rig,
    #[command(flatten)]
    recorded: from_recording::FromRecording,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Check, files: &Files) -> Outcome {
    let (text, name) = files.read_text(&arguments.model)?;
    let Model::Bounds(model) = Model::parse(&text, &name).map_err(refused)? else {
        return Err(Failure::usage(
            format!("{name}: not a model of bounds"),
            "give a model that `posegate learn bounds` wrote; learn the factors of a filter again with `posegate learn inflation`",
        ));
    };
    let from = &arguments.detections;
    let rig = arguments.rig.borrowed();
    let (bytes, name) = match from_recording::views(files, from, &arguments.recorded, rig)? {
        Some(table) => table,
        None => files.read(from)?,
    };
    let detections = Detections::read(&bytes, &name).map_err(refused)?;
    warn_of_cut_runs(&detections.runs, &name);
    let is_same = model.is_of(&detections.sha256);
    if is_same {
        warn(&format_args!(
            "{name}: the model was learnt from these data, so the check says nothing: give data that were recorded later"
        ));
    }
    let settings = CheckSettings {
        confidence: arguments.confidence,
    };
    let found = check_bounds(&model, &detections, &settings).map_err(refused)?;
    if arguments.json {
        let mut report = report_json(&found, arguments.confidence);
        report["same_data"] = json!(is_same);
        print_json(&report)?;
    } else {
        print_report(&found, model.quantile())?;
    }
    Ok(answer(found.after_rows.is_none()))
}

fn verdict(contradicted: bool) -> &'static str {
    if contradicted {
        "contradicted"
    } else {
        "holds"
    }
}

fn report_json(found: &CheckReport, confidence: f64) -> Value {
    let bound = |bound: &BoundCheck| {
        json!({
            "held": bound.held, "e_value": bound.e_value,
            "after_rows": bound.after_rows, "since_row": bound.since_row,
        })
    };
    let region = |region: &RegionCheck| {
        let [d, phi, psi] = region.ends;
        json!({
            "d_m": d, "phi_deg": phi, "psi_deg": psi, "rows": region.rows,
            "verdict": verdict(after(region).is_some()), "after_rows": after(region), "since_row": since(region),
            "looks_like": region.looks_like.map(Change::name),
            "translation": bound(&region.translation), "yaw": bound(&region.yaw),
        })
    };
    let detection = &found.detection;
    json!({
        "verdict": verdict(found.after_rows.is_some()), "after_rows": found.after_rows, "confidence": confidence,
        "rows": found.rows, "independent_rows": found.bets, "without_bounds": found.without_bounds,
        "looks_like": found.overall.looks_like.map(Change::name),
        "since_row": found.after_rows.and_then(|_| since(&found.overall)),
        "overall": region(&found.overall),
        "regions": found.regions.iter().map(region).collect::<Vec<_>>(),
        "detection": {
            "verdict": verdict(detection.after_rows.is_some()), "after_rows": detection.after_rows,
            "views": detection.views, "detected": detection.detected, "expected": detection.expected,
            "e_value": detection.e_value,
        },
    })
}

/// Returns the number of rows after which a region was contradicted.
fn after(region: &RegionCheck) -> Option<u64> {
    let each = [region.translation.after_rows, region.yaw.after_rows];
    each.into_iter().flatten().min()
}

/// Returns the row of the change, by the bound with the larger bet.
fn since(region: &RegionCheck) -> Option<u64> {
    let stronger = if region.yaw.e_value > region.translation.e_value {
        &region.yaw
    } else {
        &region.translation
    };
    stronger.since_row
}

fn print_report(found: &CheckReport, quantile: f64) -> Result<(), Failure> {
    match found.after_rows {
        None => print(&format_args!(
            "holds: {} rows do not contradict the model",
            found.rows
        ))?,
        Some(after) => print(&format_args!(
            "contradicted after {after} of {} rows",
            found.rows
        ))?,
    }
    let place = |region: &RegionCheck| {
        let [d, phi, psi] = region.ends;
        format!(
            "d {}..{} m, phi {}..{} deg, psi {}..{} deg",
            d[0], d[1], phi[0], phi[1], psi[0], psi[1]
        )
    };
    let all = core::iter::once(("overall".to_owned(), &found.overall));
    let regions = found.regions.iter().map(|region| (place(region), region));
    for (what, region) in all.chain(regions) {
        let state = match (after(region), region.looks_like) {
            (Some(after), Some(change)) => format!(
                ": contradicted after row {after}, since row {}; looks like {}",
                since(region).unwrap_or(1),
                words(change)
            ),
            (None, Some(change)) => format!("; looks like {}", words(change)),
            _ => String::new(),
        };
        print(&format_args!(
            "{what}: {} detections, held {:.1} % (position) and {:.1} % (yaw) of at least {:.1} %{state}",
            region.rows,
            100.0 * region.translation.held,
            100.0 * region.yaw.held,
            100.0 * quantile
        ))?;
    }
    let detection = &found.detection;
    if detection.views > 0 {
        let state = match detection.after_rows {
            Some(after) => format!(": contradicted after row {after}"),
            None => String::new(),
        };
        print(&format_args!(
            "{} of {} views detected, {:.1} % expected{state}",
            detection.detected,
            detection.views,
            100.0 * detection.expected
        ))?;
    }
    Ok(())
}

fn words(change: Change) -> &'static str {
    match change {
        Change::Scale => {
            "scale: all errors are larger by a common factor (noise, blur, light, another tag size)"
        }
        Change::Offset => {
            "offset: the position's error is the same everywhere (a tag or the camera is displaced)"
        }
        Change::Calibration => {
            "calibration: the image centre or the focal length is off, or the camera or a tag is turned"
        }
        _ => "another change",
    }
}
