//! `posegate chain`: evaluates a manual chain of the site file, step by step.

use crate::arguments::choice;
use crate::site_input::{Failure, Outcome, answer, print, print_json, relied_on};
use posegate::chain::StartAssumption;
use posegate_files::files::{Files, Input, Output};
use posegate_plan::{ChainReport, PlanError, StepKind, evaluate};
use posegate_replay::factor_text;
use posegate_show::draw::chain_picture;
use serde_json::json;

/// Evaluates a chain of the site file: each step's set against its task's success set
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate chain site.toml --name back-to-dock\n\nExit code 1 if a step fails. The steps after it are evaluated as if it had not failed."
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The chain's name
    #[arg(long)]
    name: String,
    /// Where the estimate is when a task begins: at the task's goal (as in the paper), or anywhere that the steps before
    /// may leave it
    #[arg(long, value_parser = choice(ASSUMPTIONS), default_value = "general")]
    assume: StartAssumption,
    /// Draw the hall with the route and the looks, then the chain step by step (SVG)
    #[arg(short, long)]
    output: Option<Output>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

const ASSUMPTIONS: [(&str, StartAssumption); 2] = [
    ("at-goal", StartAssumption::AtGoal),
    ("general", StartAssumption::General),
];

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let site = relied_on(files, &arguments.site)?;
    let chain = site.chain(&arguments.name).map_err(Failure::input)?;
    let report = evaluate(&site, &arguments.name, chain, arguments.assume)
        .map_err(|error| failure(&arguments.site, error))?;
    if let Some(path) = &arguments.output {
        let success = |name: &str| site.tasks.get(name).map(|task| &task.success);
        let picture = chain_picture(&arguments.name, &report, &success, Some(&site));
        files.write(path, picture.as_bytes())?;
    }
    if arguments.json {
        let mut line = report.to_json();
        line["chain"] = json!(arguments.name);
        print_json(&line)?;
    } else {
        for line in sentences(&report) {
            print(&line)?;
        }
    }
    Ok(answer(report.succeeds()))
}

/// Returns the failure for a chain that cannot be evaluated: bad input.
pub fn failure(site: &Input, error: PlanError) -> Failure {
    let help = match &error {
        PlanError::Table { .. } => {
            "see the task's success set; `posegate table build` gives the reason"
        }
        PlanError::Unbounded(_) => {
            "write task.NAME.table = { extent = {...} }: the poses that the table covers"
        }
        PlanError::Epsilon(_) => "write an epsilon such as 0.99",
        PlanError::BoundTooLarge { .. } => {
            "a localization must leave less error than it needs: see error_bound"
        }
        _ => "see [chain.NAME] in the site file",
    };
    Failure::usage(format!("{}: {error}", site.display()), help)
}

/// Describes a chain in words, one line per step.
pub fn sentences(report: &ChainReport) -> Vec<String> {
    let mut lines = Vec::new();
    for (index, step) in report.steps.iter().enumerate() {
        let name = match (&step.task, step.kind) {
            (Some(task), StepKind::Localization) => format!("look: {task}"),
            (Some(task), _) => format!("work: {task}"),
            (None, _) => "navigate".into(),
        };
        let [translation, yaw] = step.after.enclosing();
        let margin_text = match (step.failure, step.margin) {
            (None, Some(margin)) => format!(", inside with margin {}", factor_text(margin)),
            (Some(failure), Some(margin)) => {
                format!(", FAILS ({failure}), margin {}", factor_text(margin))
            }
            (Some(failure), None) => format!(", FAILS ({failure})"),
            (None, None) => String::new(),
        };
        lines.push(format!(
            "{}. {name}{margin_text}; then within {translation:.4} m, {:.3} deg of the estimate",
            index + 1,
            yaw.to_degrees()
        ));
    }
    lines.push(match report.first_failure() {
        None => format!("succeeds; risk at most {}", report.risk_text()),
        Some((index, _)) => format!("fails at step {}", index + 1),
    });
    lines
}
