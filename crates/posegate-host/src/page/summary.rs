//! The first lines of a page: the number of served work tasks, the tags that they need, and the worst margin.

use super::contents::{Contents, ShownChain};
use super::figures::escaped;
use crate::doctor::examine;
use crate::draw::success_of;
use crate::log::factor;
use crate::plan::{ChainReport, StepKind, crossing_notes};
use crate::site::{Site, TaskKind};
use posegate::contain::Margin;
use std::collections::BTreeSet;

/// Returns the summary as HTML.
pub(super) fn summary(site: &Site, contents: &Contents) -> String {
    let works = site
        .tasks
        .iter()
        .filter(|(_, task)| task.kind == TaskKind::Work);
    let works: Vec<&String> = works.map(|(name, _)| name).collect();
    let (mut line, mut notes) = served(site, &contents.plans, &works);
    let without: Vec<&str> = works
        .iter()
        .filter(|name| !contents.plans.iter().any(|plan| plan.name == ***name))
        .map(|name| name.as_str())
        .collect();
    let tables = contents
        .tasks
        .iter()
        .filter(|task| task.table.is_ok())
        .count();
    let proven = format!("{tables} of {} success sets proven", site.tasks.len());
    let mut good = line.good;
    if line.text.is_empty() {
        line.text = proven;
        good = tables == site.tasks.len();
    } else {
        notes.push(format!("{proven}, as tables for a controller"));
    }
    let loose = site
        .tags
        .values()
        .filter(|tag| tag.tolerance.is_none())
        .count();
    if loose > 0 {
        notes.push(format!(
            "unknown how far off {loose} of {} tags may be mounted: the site file states no tolerance",
            site.tags.len()
        ));
    }
    if !without.is_empty() {
        notes.push(format!(
            "unknown whether a robot can reach {}: no start is given, as `from`",
            without.join(", ")
        ));
    }
    let mut failing = 0;
    for ShownChain { name, found } in &contents.chains {
        notes.push(match found {
            Ok((report, _)) => match report.first_failure() {
                None => format!(
                    "chain {name} succeeds{}",
                    worst(report).map_or_else(String::new, |(margin, _)| format!(
                        ", worst margin {}",
                        text(margin)
                    ))
                ),
                Some((step, _)) => {
                    failing += 1;
                    format!("chain {name} FAILS at step {}", step + 1)
                }
            },
            Err(why) => format!("chain {name} is not evaluated: {why}"),
        });
    }
    // The line is red, so it states the reason.
    match failing {
        0 => {}
        1 => line.text += ", 1 chain FAILS",
        more => line.text += &format!(", {more} chains FAIL"),
    }
    good &= failing == 0;
    // A proof is about the site file, so doubts about the file follow the claim.
    let warnings = examine(site).warnings;
    let class = match (good, warnings.is_empty()) {
        (true, true) => "good",
        (true, false) => "warned",
        (false, _) => "bad",
    };
    let warnings = warnings
        .iter()
        .map(|warning| format!("WARNING: {}: {}", warning.about, warning.message));
    notes.splice(0..0, warnings);
    let notes: Vec<String> = notes
        .iter()
        .map(|note| format!("<li>{}</li>", escaped(note)))
        .collect();
    format!(
        "<p id=\"summary\" class=\"{class}\">{}</p>\n<ul class=\"notes\">\n{}\n</ul>\n",
        escaped(&line.text),
        notes.join("\n")
    )
}

/// Below this margin, errors that are a little larger than stated break a plan.
const LITTLE_SLACK: f64 = 1.05;

/// The first line; `true` if all tasks are served.
struct Line {
    text: String,
    good: bool,
}

/// Returns the line about the plans, with notes; an empty line without plans.
fn served(site: &Site, plans: &[ShownChain], works: &[&String]) -> (Line, Vec<String>) {
    let mut notes = Vec::new();
    if plans.is_empty() {
        let text = String::new();
        return (Line { text, good: true }, notes);
    }
    let reports = || {
        let found = plans
            .iter()
            .filter_map(|plan| Some((plan, plan.found.as_ref().ok()?)));
        found.map(|(plan, (report, _))| (plan.name.as_str(), report))
    };
    let count = reports().count();
    let mut tags = BTreeSet::new();
    for (_, report) in reports() {
        let looks = report
            .steps
            .iter()
            .filter(|step| step.kind == StepKind::Localization);
        for name in looks.filter_map(|step| step.task.as_deref()) {
            let seen = success_of(site, name)
                .map(|set| set.tags())
                .unwrap_or_default();
            tags.extend(
                site.tags
                    .iter()
                    .filter(|(_, known)| seen.contains(&known.tag))
                    .map(|(name, _)| name),
            );
        }
    }
    // If all work is docking, the text says docks.
    let what = if works.iter().all(|name| name.contains("dock")) {
        "docks"
    } else {
        "work tasks"
    };
    let mut text = format!("{count} of {} {what} served", plans.len());
    if count > 0 {
        let number = match tags.len() {
            1 => "1 tag".to_owned(),
            other => format!("{other} tags"),
        };
        text += &format!(" by {number}");
    }
    let all = reports().filter_map(|(name, report)| Some((worst(report)?, name)));
    if let Some(((margin, step), name)) = all.min_by_key(|((margin, _), _)| margin.q16()) {
        text += &format!(", worst margin {}, proven", self::text(margin));
        notes.push(format!(
            "the worst margin is that of step {} to {name}: a margin is how many times as large the uncertainty could be before the step is no longer certain{}",
            step + 1,
            if factor(margin) < LITTLE_SLACK {
                ". This plan holds for hardly larger errors than stated: state them with slack, or let the tasks allow more"
            } else {
                ""
            }
        ));
    }
    let unused = site.tags.len() - tags.len();
    if unused > 0 && count > 0 {
        notes.push(format!(
            "these plans look at {} of the site's {} tags; the other {unused} may be spares for tags that are lost: leave them unless `posegate plan --survive-lost-tags 1` and your other tasks do without them",
            tags.len(),
            site.tags.len()
        ));
    }
    for (name, report) in reports() {
        let crossed = crossing_notes(report, site).into_iter();
        notes.extend(crossed.map(|note| format!("WARNING: the plan to {name}: {note}")));
    }
    for plan in plans {
        if let Err(why) = &plan.found {
            notes.push(format!("NOT served: {}: {why}", plan.name));
        }
    }
    let good = count == plans.len();
    (Line { text, good }, notes)
}

/// Returns the smallest margin of a chain with the number of its step, from 0.
pub(super) fn worst(report: &ChainReport) -> Option<(Margin, usize)> {
    let steps = report.steps.iter().enumerate();
    let margins = steps.filter_map(|(number, step)| Some((step.margin?, number)));
    margins.min_by_key(|(margin, _)| margin.q16())
}

/// Formats a margin with two decimals, rounded down: the printed value is proven.
pub(super) fn text(margin: Margin) -> String {
    format!("{:.2}", libm::floor(factor(margin) * 100.0) / 100.0)
}
