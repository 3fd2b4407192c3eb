//! `posegate contains`: exact membership of poses, and a box of poses that are in the set.

use crate::site_input::{Failure, Outcome, answer, print, print_json, progress, site, task, warn};
use posegate::shape::{Sight, SuccessSet};
use posegate_files::files::{Files, Input};
use posegate_replay::{Columns, estimates};
use posegate_site::inscribe::inscribed_box;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Reports for each pose whether it is in a task's success set, or finds a large box of poses that are
///
/// Programs that know boxes alone can use `--box`, a box of poses (x, y, yaw) about the goal that is proven inside the set: Nav2's goal checker
/// has the tolerances that are printed, and a site file has the shape. A box is smaller than the set. The tolerances are about where the robot truly
/// is: a checker compares the estimate, so subtract the estimate's largest error from them.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate contains site.toml --task dock --poses poses.csv --json\n  posegate contains site.toml --task see-t7 --box --yaw-deg 2\n\nWith --box exit code 1 if the goal is not in the set, or not at every heading within --yaw-deg."
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The task
    #[arg(long)]
    task: String,
    /// Poses in the world frame: CSV with the columns x_m, y_m, yaw_rad; `-` for standard input
    #[arg(long, required_unless_present = "box")]
    poses: Option<Input>,
    /// Find a box of poses about the goal
    #[arg(long = "box", id = "box", conflicts_with = "poses")]
    is_box: bool,
    /// The box has the headings up to this many degrees to both sides of the goal's [default: as many as make a large box]
    #[arg(long, requires = "box")]
    yaw_deg: Option<f64>,
    /// Print one line of JSON per pose, or of the box
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let site = site(files, &arguments.site)?;
    let task = task(&site, &arguments.task)?;
    let Some(poses) = &arguments.poses else {
        return in_a_box(arguments, &task.success);
    };
    let (bytes, name) = files.read(poses)?;
    let rows = estimates(bytes.as_slice(), &name, Columns::Poses).map_err(Failure::input)?;
    let [east, north] = site.map_origin;
    let bar = progress(rows.len() as u64, "looking");
    for (index, row) in rows.iter().enumerate() {
        bar.inc(1);
        let pose = row.estimate;
        let [x, y] = [pose.x_m - east, pose.y_m - north];
        let membership = task.success.membership([x, y, pose.yaw_rad]);
        if arguments.json {
            let slack: BTreeMap<_, _> = membership.slack.iter().copied().collect();
            let mut line = json!({"index": index, "inside": membership.inside, "slack": slack});
            if let Some(sight) = membership.sight {
                add_sight(&mut line, &sight, membership.inside);
            }
            print_json(&line)?;
        } else {
            let least = membership
                .slack
                .iter()
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .map_or(String::new(), |(name, value)| format!("{name} {value:+.6}"));
            let inside = if membership.inside {
                "inside "
            } else {
                "outside"
            };
            print(&format_args!("{index:>6} {inside} {least}"))?;
        }
    }
    bar.finish_and_clear();
    Ok(answer(true))
}

fn add_sight(line: &mut Value, sight: &Sight, visible: bool) {
    // NaN is null in JSON.
    let corners = sight
        .corners_px
        .map(|corner| corner.unwrap_or([f64::NAN; 2]));
    line["d"] = json!(sight.d);
    line["phi_deg"] = json!(sight.phi.to_degrees());
    line["psi_deg"] = json!(sight.psi.to_degrees());
    line["corners_px"] = json!(corners);
    line["visible"] = json!(visible);
}

/// Finds a large box about the goal that is proven inside the set.
fn in_a_box(arguments: &Arguments, success: &SuccessSet) -> Outcome {
    if let Some(yaw) = arguments.yaw_deg
        && !(0.0..=44.0).contains(&yaw)
    {
        return Err(Failure::usage(
            format!("--yaw-deg {yaw}: it must be from 0 to 44 degrees"),
            "give a number such as 2",
        ));
    }
    let found = inscribed_box(success, arguments.yaw_deg);
    if let Some(found) = found {
        let [xy, yaw] = found.tolerances();
        if arguments.json {
            print_json(&json!({
                "x": found.x, "y": found.y, "yaw_deg": found.yaw_deg,
                "nav2": { "xy_goal_tolerance": xy, "yaw_goal_tolerance": yaw, "stateful": false, "symmetric_yaw_tolerance": false },
            }))?;
        } else {
            let [x0, x1] = found.x;
            let [y0, y1] = found.y;
            let [w0, w1] = found.yaw_deg;
            print(&format_args!(
                "{{ shape = \"box\", x = [{x0:?}, {x1:?}], y = [{y0:?}, {y1:?}], yaw_deg = [{w0:?}, {w1:?}] }}"
            ))?;
            print(&"proven inside the success set, in the frame of the goal")?;
            // Rounded down: the printed tolerances are still inside.
            let below = |value: f64| (value * 1e4).floor() / 1e4;
            print(&format_args!(
                "Nav2: xy_goal_tolerance: {:.4}, yaw_goal_tolerance: {:.4}, each less the largest error of the estimate",
                below(xy),
                below(yaw)
            ))?;
            print(
                &"with Nav2's goal at the task's goal, stateful: false, and symmetric_yaw_tolerance: false if it has that key; otherwise the robot may leave the box again",
            )?;
        }
    } else {
        if arguments.json {
            print_json(&json!(null))?;
        }
        warn(&format_args!(
            "task `{}`: its goal is not proven to be in its success set{}: see `posegate check`",
            arguments.task,
            if arguments.yaw_deg.is_some() {
                " at every one of these headings"
            } else {
                ""
            }
        ));
    }
    Ok(answer(found.is_some()))
}
