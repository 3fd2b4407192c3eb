//! `posegate check`: validates a site file and builds nothing.

use crate::site_input::{Failure, Outcome, answer, print, print_json, site_and_text};
use posegate::bake::{BakeInput, check};
use posegate_files::files::{Files, Input};
use posegate_show::doctor::{Warning, decision_costs, examine};
use serde_json::{Value, json};

/// Checks a site file: everything is validated, nothing is built
///
/// Ends with the warnings of `posegate doctor`: likely mistakes in tags, candidates, cameras and tasks, with the line of
/// the file. If the site has a `[controller]`, they name each task on whose table a step of the gate may take more cycles than
/// the controller has. Warnings do not change the exit code.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate check site.toml")]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
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
    let mut warnings = examine(&site).warnings;
    let costs = decision_costs(&site);
    warnings.extend(costs.map_err(|(name, error)| Failure::table(&arguments.site, &name, error))?);
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
        let summary = json!({"valid": true, "candidates": candidates, "warnings": warnings, "cameras": cameras, "tags": tags, "goals": goals, "tasks": tasks, "epsilon": site.epsilon});
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
