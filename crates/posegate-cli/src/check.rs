//! `posegate check`: validates a site file and builds nothing.

use crate::site_input::{Failure, Outcome, answer, print, print_json, site_and_text};
use posegate::bake::{BakeInput, check};
use posegate::shape::MinSlack;
use posegate_files::files::{Files, Input, OutputFolder};
use posegate_show::doctor::{Findings, Look, Warning, decision_costs, examine};
use posegate_show::draw::site_pictures;
use serde_json::{Value, json};

/// Checks a site file: everything is validated, nothing is built
///
/// Ends with warnings of likely mistakes in tags, candidates, cameras and tasks, with the line of the file. If the site has a `[controller]`, they name each task on whose table a step of the gate may take more cycles than
/// the controller has. Warnings do not change the exit code.
///
/// Cameras may name calibrations of ROS, OpenCV (YAML, XML), Kalibr, OKVIS, Basalt, VINS, ORB-SLAM, PhotonVision, or CameraInfo messages as text; [import.NAME] reads the formats of
/// `posegate import`.
///
/// --draw shows what the site file says: every tag and camera with its axes. A tag's x axis comes out of its face, and z is up;
/// a camera looks along its x axis. It also lists which camera sees which tag from which goal.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate check site.toml\n  posegate check site.toml --draw check-out"
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// Draw every tag and camera into this folder (SVG); it is created if it does not exist
    #[arg(long, value_name = "DIR")]
    draw: Option<OutputFolder>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let (site, text) = site_and_text(files, &arguments.site)?;
    for (name, task) in &site.tasks {
        if let Some(spec) = site.chosen_table(task) {
            let order = BakeInput {
                task: name,
                success: &task.success,
                spec,
                epsilon: site.epsilon,
            };
            check(&order).map_err(|error| Failure::table(&arguments.site, name, error))?;
        }
    }
    let tasks: Vec<_> = site
        .tasks
        .iter()
        .map(|(name, task)| {
            let shape = task.success.shape.name();
            (name, shape, site.chosen_table(task))
        })
        .collect();
    let findings = examine(&site);
    let mut warnings = findings.warnings.clone();
    let costs = decision_costs(&site);
    warnings.extend(costs.map_err(|(name, error)| Failure::table(&arguments.site, &name, error))?);
    let named = |(name, text): (String, String)| (name, text.into_bytes());
    let pictures: Option<Vec<_>> = arguments
        .draw
        .is_some()
        .then(|| site_pictures(&site).into_iter().map(named).collect());
    if let (Some(folder), Some(pictures)) = (&arguments.draw, &pictures) {
        files.write_into(folder, pictures)?;
    }
    if arguments.json {
        let tasks: Vec<_> = tasks
            .iter()
            .map(|(name, shape, spec)| json!({"task": name, "shape": shape, "table": spec.is_some()}))
            .collect();
        let cameras: Vec<_> = site.cameras.keys().collect();
        let tags: Vec<_> = site.tags.keys().collect();
        let goals: Vec<_> = site.goals.keys().collect();
        let warnings: Vec<Value> = warnings
            .iter()
            .map(|warning| fact(warning, &text))
            .collect();
        let candidates = site.candidates.len();
        let mut summary = json!({"valid": true, "candidates": candidates, "warnings": warnings, "cameras": cameras, "tags": tags, "goals": goals, "tasks": tasks, "epsilon": site.epsilon});
        if let Some(pictures) = pictures {
            let names = pictures.iter().map(|(name, _)| name);
            summary["pictures"] = names.cloned().collect();
        }
        print_json(&summary)?;
    } else {
        print(&format_args!(
            "{}: {} cameras, {} tags, {}{} tasks, epsilon {}",
            arguments.site.display(),
            site.cameras.len(),
            site.tags.len(),
            match site.candidates.len() {
                0 => String::new(),
                count => format!("{count} candidates, "),
            },
            site.tasks.len(),
            site.epsilon
        ))?;
        for (name, shape, spec) in tasks {
            let table = if spec.is_some() {
                ""
            } else {
                " (no table: its set has no bound; add `expected`, or an extent)"
            };
            print(&format_args!("  {name}: {shape}{table}"))?;
        }
        if let (Some(folder), Some(pictures)) = (&arguments.draw, &pictures) {
            print_views(&findings)?;
            print(&format_args!(
                "{} pictures in {}",
                pictures.len(),
                folder.display()
            ))?;
        }
        // The candidates of one row have one line and, often, one warning.
        let same_cause = |a: &Warning, b: &Warning| {
            (a.code, &a.message, a.line(&text)) == (b.code, &b.message, b.line(&text))
        };
        for group in warnings.chunk_by(same_cause) {
            let [warning, others @ ..] = group else {
                continue;
            };
            let more = match others.len() {
                0 => String::new(),
                count => format!(" and {count} more of this line"),
            };
            print(&format_args!(
                "WARNING {}:{}: {}{more} ({}): {}\n  {}",
                arguments.site.display(),
                warning.line(&text),
                warning.about,
                warning.code,
                warning.message,
                warning.help
            ))?;
        }
        if warnings.is_empty() {
            print(&"no warnings")?;
        }
    }
    Ok(answer(true))
}

fn fact(warning: &Warning, text: &str) -> Value {
    json!({
        "line": warning.line(text),
        "message": format!("{}: {}", warning.about, warning.message),
        "code": warning.code,
        "about": warning.about,
        "help": warning.help,
    })
}

/// Prints the directions of tags and cameras, and which camera sees which tag from which goal.
fn print_views(findings: &Findings) -> Result<(), Failure> {
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
