//! `posegate doctor`: draws what a site's cameras see, and reports likely mistakes.

use crate::site_input::{Failure, Outcome, answer, print, print_json, site};
use posegate_files::files::{Files, Input, OutputFolder};
use posegate_show::doctor::{Findings, Look, TagFinding, Warning, examine};
use posegate_show::draw::{MinSlack, site_pictures};
use serde_json::{Value, json};

/// Draws every tag and camera with its axes, lists which camera sees which tag, and warns of likely mistakes
///
/// A tag's x axis comes out of its face, and z is up; a camera looks along its x axis. The pictures show both
/// as the site file has them. Exit code 1 if a task's success set is empty.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate doctor site.toml -o doctor-out")]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The folder for the pictures; it is created if it does not exist
    #[arg(short, long)]
    output: OutputFolder,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let site = site(files, &arguments.site)?;
    let findings = examine(&site);
    let pictures = site_pictures(&site);
    let named = |(name, text): (String, String)| (name, text.into_bytes());
    let written: Vec<_> = pictures.into_iter().map(named).collect();
    let folder = &arguments.output;
    files.write_into(folder, &written)?;
    if arguments.json {
        let names: Vec<&String> = written.iter().map(|(name, _)| name).collect();
        let mut facts = facts(&findings);
        facts["pictures"] = json!(names);
        print_json(&facts)?;
    } else {
        print_findings(&findings)?;
        print(&format_args!(
            "{} pictures in {}",
            written.len(),
            folder.display()
        ))?;
    }
    let empty = findings.warnings.iter().any(|warning| warning.empties);
    Ok(answer(!empty))
}

fn print_findings(findings: &Findings) -> Result<(), Failure> {
    let wide = |names: &mut dyn Iterator<Item = usize>| names.max().unwrap_or(0);
    let names = wide(&mut findings.tags.iter().map(|tag| tag.name.chars().count())).max(4);
    print(&format_args!(
        "{:names$}  {:>5}  {:>9}  {:>7}  {:>8}  seen from the goal of",
        "tag", "id", "faces deg", "up deg", "height m"
    ))?;
    for tag in &findings.tags {
        let [faces, up] = tag.faces_deg;
        print(&format_args!(
            "{:names$}  {:>5}  {faces:>9.1}  {up:>7.1}  {:>8.3}  {}",
            tag.name,
            tag.tag.id,
            tag.tag.pose.z,
            tag.looks.first().map_or("no task".into(), look)
        ))?;
        for other in tag.looks.iter().skip(1) {
            print(&format_args!("{:1$}  {2}", "", names + 37, look(other)))?;
        }
    }
    if !findings.candidates.is_empty() {
        print(&format_args!("{} candidates", findings.candidates.len()))?;
    }
    for camera in &findings.cameras {
        let [looks, up] = camera.looks_deg;
        print(&format_args!(
            "camera {}: looks to {looks:.1} deg of the robot, {up:.1} deg up, {:.3} m high",
            camera.name, camera.mount.z
        ))?;
    }
    for task in &findings.tasks {
        let inside = if task.at_goal.slack >= 0.0 {
            "in its set"
        } else {
            "NOT in its set"
        };
        print(&format_args!(
            "task {}: its goal is {inside}, least slack {}",
            task.name,
            slack(&task.at_goal)
        ))?;
    }
    for warning in &findings.warnings {
        print(&format_args!(
            "WARNING {} ({}): {}\n  {}",
            warning.about, warning.code, warning.message, warning.help
        ))?;
    }
    if findings.warnings.is_empty() {
        print(&"no warnings")?;
    }
    Ok(())
}

fn look(look: &Look) -> String {
    let seen = if look.least.slack >= 0.0 {
        "seen"
    } else {
        "not seen"
    };
    format!(
        "{} by {}: {seen}, slack {}",
        look.task,
        look.camera,
        slack(&look.least)
    )
}

fn slack(least: &MinSlack) -> String {
    if least.slack.is_finite() {
        format!("{:+.3} ({})", least.slack, least.name)
    } else {
        format!("({})", least.name)
    }
}

fn facts(findings: &Findings) -> Value {
    let tags: Vec<Value> = findings.tags.iter().map(tag).collect();
    let candidates: Vec<Value> = findings.candidates.iter().map(tag).collect();
    let cameras: Vec<Value> = findings
        .cameras
        .iter()
        .map(|camera| {
            json!({
                "name": camera.name, "looks_deg": camera.looks_deg[0], "up_deg": camera.looks_deg[1],
                "height": camera.mount.z,
            })
        })
        .collect();
    let tasks: Vec<Value> = findings
        .tasks
        .iter()
        .map(|task| {
            let mut value = of_least(&task.at_goal);
            value["name"] = json!(task.name);
            value["goal_inside"] = json!(task.at_goal.slack >= 0.0);
            value["empty"] = json!(task.deepest.least.slack < 0.0);
            value["deepest"] = json!(task.deepest.pose);
            value
        })
        .collect();
    let warnings: Vec<Value> = findings.warnings.iter().map(warning).collect();
    json!({"tags": tags, "candidates": candidates, "cameras": cameras, "tasks": tasks, "warnings": warnings})
}

fn tag(tag: &TagFinding) -> Value {
    let looks: Vec<Value> = tag
        .looks
        .iter()
        .map(|look| {
            let mut value = of_least(&look.least);
            value["task"] = json!(look.task);
            value["camera"] = json!(look.camera);
            value["own"] = json!(look.own);
            value["seen"] = json!(look.least.slack >= 0.0);
            value
        })
        .collect();
    json!({
        "name": tag.name, "id": tag.tag.id, "size": tag.tag.size, "faces_deg": tag.faces_deg[0],
        "up_deg": tag.faces_deg[1], "height": tag.tag.pose.z, "looks": looks,
    })
}

/// `slack` is null if the constraint is never satisfied.
fn of_least(least: &MinSlack) -> Value {
    json!({"slack": least.slack, "constraint": least.name})
}

fn warning(warning: &Warning) -> Value {
    json!({
        "code": warning.code, "about": warning.about, "message": warning.message, "help": warning.help,
        "empties": warning.empties,
    })
}
