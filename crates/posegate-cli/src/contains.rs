//! `posegate contains`: exact membership of poses.

use crate::site_input::{Failure, Outcome, answer, print, print_json, progress, site, task};
use posegate::shape::Sight;
use posegate_files::files::{Files, Input};
use posegate_replay::{Columns, estimates};
use serde_json::{Map, Value, json};

/// Reports for each pose whether it is in a task's success set
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate contains site.toml --task dock --poses poses.csv --json"
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The task
    #[arg(long)]
    task: String,
    /// Poses in the world frame: CSV with the columns x_m, y_m, yaw_rad; `-` for standard input
    #[arg(long)]
    poses: Input,
    /// Print one line of JSON per pose
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let site = site(files, &arguments.site)?;
    let task = task(&site, &arguments.task)?;
    let (bytes, name) = files.read(&arguments.poses)?;
    let rows = estimates(bytes.as_slice(), &name, Columns::Poses).map_err(Failure::input)?;
    let [east, north] = site.map_origin;
    let bar = progress(rows.len() as u64, "looking");
    for (index, row) in rows.iter().enumerate() {
        bar.inc(1);
        let pose = row.estimate;
        let [x, y] = [pose.x_m - east, pose.y_m - north];
        let membership = task.success.membership([x, y, pose.yaw_rad]);
        if arguments.json {
            let slack: Map<String, Value> = membership
                .slack
                .iter()
                .map(|(name, value)| ((*name).into(), json!(value)))
                .collect();
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
    let corners: Vec<Value> = sight
        .corners_px
        .iter()
        .map(|corner| corner.map_or(json!([null, null]), |uv| json!(uv)))
        .collect();
    line["d"] = json!(sight.d);
    line["phi_deg"] = json!(sight.phi.to_degrees());
    line["psi_deg"] = json!(sight.psi.to_degrees());
    line["corners_px"] = json!(corners);
    line["visible"] = json!(visible);
}
