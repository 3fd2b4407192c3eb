//! `posegate learn survey`: finds docks and tags that are not where the site file places them.

use super::refused;
use crate::site_input::{Outcome, answer, print, print_json, site};
use posegate_files::files::{Files, Input};
use posegate_learn::{OffsetReport, Surveyed, SurveyedSite, looks, survey};
use serde_json::{Value, json};

/// Finds docks and tags that are not where the site file places them, from logs of dockings
///
/// Each row is a look at a tag: the robot's pose at contact with the dock, computed from the surveyed place of the tag. (Earlier
/// looks are carried along the odometry.) Exit code 1 if something must be surveyed again. If everything is in its place, that
/// happens with a probability of at most 1 - confidence. It assumes that dockings (`run`) are independent of each other, and
/// that neither the camera nor the contact has a bias. A turned camera makes every dock seem off.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate learn survey site.toml dockings.csv --json\n\nColumns: run (the docking at its dock), dock (the name of its task), tag, x_m, y_m, yaw_rad (world frame)."
)]
pub struct Survey {
    /// The site file
    site: Input,
    /// Looks at contact (CSV); `-` for standard input
    dockings: Input,
    /// The probability with which nothing is reported if everything is in its place
    #[arg(long, default_value_t = 0.99, allow_negative_numbers = true)]
    confidence: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Survey, files: &Files) -> Outcome {
    let site = site(files, &arguments.site)?;
    let docks = site.tasks.iter().map(|(name, task)| {
        let goal = task.success.goal;
        (name.clone(), [goal.x, goal.y, goal.yaw_deg.to_radians()])
    });
    let tags = site.tags.iter().map(|(name, tag)| {
        let pose = tag.tag.pose;
        (name.clone(), [pose.x, pose.y])
    });
    let surveyed = SurveyedSite {
        docks: docks.collect(),
        tags: tags.collect(),
    };
    let (bytes, name) = files.read(&arguments.dockings)?;
    let rows = looks(&bytes, &name, &surveyed).map_err(refused)?;
    let found = survey(&rows, &surveyed, arguments.confidence).map_err(refused)?;
    if arguments.json {
        let of = |kind| {
            let reports = found.iter().filter(move |report| report.kind == kind);
            reports.map(report_json).collect::<Vec<_>>()
        };
        let again = found.iter().filter(|report| report.stale).map(sentence);
        print_json(&json!({
            "rows": rows.len(), "confidence": arguments.confidence,
            "docks": of(Surveyed::Dock), "tags": of(Surveyed::Tag), "resurvey": again.collect::<Vec<_>>(),
        }))?;
    } else {
        print_reports(&found)?;
    }
    Ok(answer(!found.iter().any(|report| report.stale)))
}

fn report_json(report: &OffsetReport) -> Value {
    let pose = |pose: Option<[f64; 3]>| {
        pose.map(|[x, y, yaw]| json!({"x_m": x, "y_m": y, "yaw_deg": yaw.to_degrees()}))
    };
    let or = report.or.iter().map(|(kind, name)| named(*kind, name));
    json!({
        "name": report.name, "dockings": report.dockings, "offset": pose(report.offset), "region": pose(report.region),
        "significance": report.significance, "resurvey": report.stale, "or": or.collect::<Vec<_>>(),
    })
}

fn named(kind: Surveyed, name: &str) -> String {
    match kind {
        Surveyed::Dock => name.to_owned(),
        Surveyed::Tag => format!("tag {name}"),
    }
}

/// Returns what to survey again: `re-survey dock-3: 3.6 deg, 2.5 cm off`.
fn sentence(report: &OffsetReport) -> String {
    let [x, y, yaw] = report.offset.unwrap_or_default();
    let or: String = report
        .or
        .iter()
        .map(|(kind, name)| format!(" or {}", named(*kind, name)))
        .collect();
    format!(
        "re-survey {}{or}: {:.1} deg, {:.1} cm off",
        named(report.kind, &report.name),
        yaw.to_degrees().abs(),
        100.0 * x.hypot(y)
    )
}

fn print_reports(found: &[OffsetReport]) -> Result<(), crate::site_input::Failure> {
    for report in found {
        let name = named(report.kind, &report.name);
        let (Some(offset), Some(region)) = (report.offset, report.region) else {
            let why = match report.offset {
                None => "too few, 5 are needed",
                Some(_) => "not tested: x, y and yaw do not scatter, each by itself",
            };
            print(&format_args!(
                "{name:<20} {:>5} dockings: {why}",
                report.dockings
            ))?;
            continue;
        };
        print(&format_args!(
            "{name:<20} {:>5} dockings: x {:+.4} +- {:.4} m, y {:+.4} +- {:.4} m, yaw {:+.2} +- {:.2} deg",
            report.dockings,
            offset[0],
            region[0],
            offset[1],
            region[1],
            offset[2].to_degrees(),
            region[2].to_degrees()
        ))?;
    }
    let mut stale = found.iter().filter(|report| report.stale).peekable();
    if stale.peek().is_none() {
        return print(&"no offset is significant: nothing to survey again");
    }
    for report in stale {
        print(&sentence(report))?;
    }
    Ok(())
}
