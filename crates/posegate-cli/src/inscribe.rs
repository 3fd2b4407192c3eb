//! `posegate inscribe`: a box inside a success set.

use crate::site_input::{Failure, Outcome, answer, print, print_json, site, task, warn};
use posegate_files::files::{Files, Input};
use posegate_site::inscribe::inscribed_box;
use serde_json::json;

/// Finds a large box of poses (x, y, yaw) about the goal that is proven inside a task's success set
///
/// Programs that know boxes alone can use it: Nav2's goal checker has the tolerances that are printed, and a site file has the
/// shape. A box is smaller than the set. The tolerances are about where the robot truly is: a checker compares the estimate, so
/// subtract the estimate's largest error from them.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate inscribe site.toml --task see-t7\n  posegate inscribe site.toml --task see-t7 --yaw-deg 2 --json\n\nExit code 1 if the goal is not in the set, or not at every heading within --yaw-deg."
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The task
    #[arg(long)]
    task: String,
    /// The box has the headings up to this many degrees to both sides of the goal's [default: as many as make a large box]
    #[arg(long)]
    yaw_deg: Option<f64>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    if let Some(yaw) = arguments.yaw_deg
        && !(0.0..=44.0).contains(&yaw)
    {
        return Err(Failure::usage(
            format!("--yaw-deg {yaw}: it must be from 0 to 44 degrees"),
            "give a number such as 2",
        ));
    }
    let site = site(files, &arguments.site)?;
    let task = task(&site, &arguments.task)?;
    let found = inscribed_box(&task.success, arguments.yaw_deg);
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
            "task `{}`: its goal is not proven to be in its success set{}: see `posegate doctor`",
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
