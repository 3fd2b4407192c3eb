//! `posegate plan`: finds the chain of looks and drives after which a work task is certain to succeed.

use crate::chain::{failure, sentences};
use crate::site_input::{Failure, Outcome, answer, print, print_json, relied_on, warn};
use posegate_files::files::{Files, Input, Output};
use posegate_plan::{
    Options, Plan, PlanError, PlanResult, Status, crossing_notes, little_slack, margin_text,
    plan_near,
};
use posegate_show::draw::{chain_picture, success_of};
use posegate_site::Site;
use std::collections::BTreeMap;

/// Finds the cheapest chain of looks and drives after which a work task is certain to succeed
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate plan site.toml --from back-to-dock --to dock\n\nThe growth of uncertainty during a drive is stated by [navigation] in the site file, or by the first drive of the chain that --from names. Exit code 1 if there is no such chain."
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The chain whose `start` the plan begins with [default: the task's `from`]
    #[arg(long)]
    from: Option<String>,
    /// The work task
    #[arg(long)]
    to: String,
    /// The largest accepted risk that the plan fails although no step reports a failure
    #[arg(long, default_value_t = 0.05)]
    most_risk: f64,
    /// Number of tags that may be missing or not detected: 0 or 1
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=1))]
    survive_lost_tags: u8,
    /// Largest number of labels that the search evaluates
    #[arg(long, default_value_t = 100_000)]
    limit: usize,
    /// Costs of drives: a CSV of `from,to,cost` with names of places (a look's name, `start`, the work task)
    #[arg(long)]
    costs: Option<Input>,
    /// Write the plan as rules for a controller's sequencer
    #[arg(long)]
    rules: Option<Output>,
    /// Draw the hall with the route and the looks, then the chain step by step (SVG)
    #[arg(short, long)]
    output: Option<Output>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    if !(arguments.most_risk >= 0.0 && arguments.most_risk <= 1.0) {
        return Err(Failure::usage(
            format!("--most-risk {} is not a probability", arguments.most_risk),
            "give a number from 0 to 1, like 0.05",
        ));
    }
    let site = relied_on(files, &arguments.site)?;
    let task = crate::site_input::task(&site, &arguments.to)?;
    let from = arguments.from.as_ref().or(task.from.as_ref());
    let from = from.ok_or_else(|| {
        Failure::usage(
            format!("task `{}` has no start", arguments.to),
            "add `from = \"CHAIN\"` to the task, or pass --from CHAIN",
        )
    })?;
    let chain = site.chain(from).map_err(Failure::input)?;
    let options = Options {
        most_risk: arguments.most_risk,
        survive_a_lost_tag: arguments.survive_lost_tags > 0,
        limit: arguments.limit,
        costs: costs(arguments, files)?,
        ..Options::default()
    };
    let failed = |error: PlanError| match error {
        PlanError::NoLooks(_) | PlanError::NoWork(_) | PlanError::Costs(_) => Failure::usage(
            format!("{}: {error}", arguments.site.display()),
            "see `posegate plan --help`",
        ),
        other => failure(&arguments.site, other),
    };
    let planned =
        plan_near(&site, Some(from), &chain.start, &arguments.to, &options).map_err(failed)?;
    if let (Some(path), Some(_)) = (&arguments.rules, &planned.plan) {
        let bytes = planned.rules(&site).ok_or_else(|| {
            Failure::usage(
                "the plan cannot be written as rules: a controller compares sets by the cylinder around them, and here an ellipsoid was proven (or there are too many rules)".into(),
                "write the start as `bounded`, or leave out --rules",
            )
        })?;
        files.write(path, &bytes)?;
    }
    if let (Some(path), Some(plan)) = (&arguments.output, &planned.plan) {
        let success = |name: &str| success_of(&site, name);
        let picture = chain_picture(&arguments.to, &plan.report(), &success, Some(&site));
        files.write(path, picture.as_bytes())?;
    }
    if arguments.json {
        print_json(&planned.to_json())?;
    } else if let Some(plan) = &planned.plan {
        print_plan(&site, &planned, plan)?;
    } else {
        print(&planned.why_not())?;
    }
    if let Some(plan) = &planned.plan {
        for note in crossing_notes(&plan.report(), &site) {
            warn(&note);
        }
    }
    Ok(answer(planned.plan.is_some()))
}

/// Prints the steps of a plan, its cost with the lower bound, little slack, and the plans for a lost tag.
fn print_plan(site: &Site, planned: &PlanResult, plan: &Plan) -> Result<(), Failure> {
    for line in sentences(&plan.report()) {
        print(&line)?;
    }
    print(&format_args!(
        "cost {:.3} ({} a metre, {} a look), {}; no chain at all costs less than {:.3} (gap {:.1} %)",
        plan.cost,
        site.planner.metre,
        site.planner.look_cost,
        match planned.status {
            Status::Optimal => "optimal among the chains of the library".to_owned(),
            _ => format!(
                "no chain of the library is cheaper than {:.3}",
                planned.bound.unwrap_or(0.0)
            ),
        },
        planned.bound_of_all,
        100.0 * planned.gap().unwrap_or(0.0)
    ))?;
    if let Some((margin, step)) = plan.report().worst_margin()
        && let Some(advice) = little_slack(margin)
    {
        print(&format_args!(
            "worst margin {} at step {}: {advice}",
            margin_text(margin),
            step + 1
        ))?;
    }
    for other in &planned.contingencies {
        let worst = other.plan.report().worst_margin();
        let worst = worst.filter(|(margin, _)| little_slack(*margin).is_some());
        print(&format_args!(
            "if tag {} is lost at step {}: {} more steps, cost {:.3} from there{}",
            other.tags.join(", "),
            other.step + 1,
            other.plan.steps.len(),
            other.plan.cost,
            worst.map_or_else(String::new, |(margin, _)| format!(
                ", worst margin {}: little slack",
                margin_text(margin)
            ))
        ))?;
    }
    Ok(())
}

/// Reads the user's costs of drives.
fn costs(arguments: &Arguments, files: &Files) -> Result<BTreeMap<(String, String), f64>, Failure> {
    let Some(path) = &arguments.costs else {
        return Ok(BTreeMap::new());
    };
    let (text, name) = files.read(path)?;
    posegate_plan::costs(text.as_slice(), &name).map_err(|error| {
        Failure::usage(
            error.to_string(),
            "the file has a header `from,to,cost` and one line per drive",
        )
    })
}
