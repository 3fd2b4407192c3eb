//! `posegate family`: shows how S_l(r) grows with r.

use crate::site_input::{Failure, Outcome, answer, print, print_json, progress, site};
use posegate::bake::{self, BakeInput};
use posegate::verify::family;
use posegate_files::files::{Files, Input};
use serde_json::json;

/// Shows how the set from which a tag is seen well enough grows with the allowed error
///
/// Uses the first localization task that looks at the tag and has an `error_model`. The task's largest error is
/// replaced by each of the given errors.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate family site.toml --tag t7 --r 0.02,0.05,0.1")]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The tag's name
    #[arg(long)]
    tag: String,
    /// Allowed errors, metres
    #[arg(long, value_delimiter = ',', required = true)]
    r: Vec<f64>,
    /// The allowed error of the yaw, degrees [default: the task's own]
    #[arg(long)]
    yaw_deg: Option<f64>,
    /// Print one line of JSON per error
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let wrong = arguments.r.iter().chain(&arguments.yaw_deg);
    if let Some(wrong) = wrong.into_iter().find(|r| !(r.is_finite() && **r > 0.0)) {
        return Err(Failure::usage(
            format!("{wrong} is not a valid error"),
            "give metres (and degrees) above 0, like --r 0.02,0.05,0.1",
        ));
    }
    let site = site(files, &arguments.site)?;
    let id = site.tags.get(&arguments.tag).map(|tag| tag.tag.id);
    let looks = |task: &&posegate_site::Task| {
        let seen = task.success.shape.visibility();
        task.success.shape.error_limit().is_some() && seen.map(|view| view.tag.id) == id
    };
    let found = site
        .tasks
        .iter()
        .find(|(_, task)| id.is_some() && looks(task));
    let Some((name, task)) = found else {
        return Err(Failure::usage(
            format!(
                "{}: no task looks at a tag `{}` with an error model",
                arguments.site.display(),
                arguments.tag
            ),
            "give its success set an `error_model` and an `r`",
        ));
    };
    let own = task.success.shape.error_limit().map(|limit| limit.yaw_deg);
    let yaw_deg = arguments.yaw_deg.or(own).unwrap_or(360.0);
    let spec = site.chosen_table(task).ok_or_else(|| {
        Failure::usage(
            format!(
                "{}: no extent can be chosen for the task `{name}`",
                arguments.site.display()
            ),
            "add an extent in [table] or task.NAME.table",
        )
    })?;
    let order = BakeInput {
        task: name,
        success: &task.success,
        spec,
        epsilon: site.epsilon,
    };
    let refused = |error| Failure::table(&arguments.site, name, error);
    let slabs = u64::from(bake::check(&order).map_err(refused)?.slabs);
    let limits: Vec<(f64, f64)> = arguments.r.iter().map(|r| (*r, yaw_deg)).collect();
    let bar = progress(2 * slabs * limits.len() as u64, "building");
    let members = family(&order, &limits, &|| bar.inc(1));
    bar.finish_and_clear();
    let members = members.map_err(|error| Failure::build(&arguments.site, name, error))?;
    for member in members.unwrap_or_default() {
        if arguments.json {
            print_json(&json!({
                "task": name, "tag": arguments.tag, "r": {"translation": member.translation, "yaw_deg": member.yaw_deg},
                "volume_m2_rad": member.volume,
            }))?;
        } else {
            print(&format_args!(
                "r = {:.3} m, {:.2} deg: {:.4} m2 rad proven inside ({name})",
                member.translation, member.yaw_deg, member.volume
            ))?;
        }
    }
    Ok(answer(true))
}
