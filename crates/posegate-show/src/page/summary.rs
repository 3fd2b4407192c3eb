//! The first lines of a page: the number of served work tasks, the tags that they need, and the worst margin.

use super::contents::{Contents, ShownChain};
use super::figures::escaped;
use crate::doctor::examine;
use crate::draw::success_of;
use posegate_plan::{StepKind, crossing_notes, little_slack, margin_text};
use posegate_site::{Site, TaskKind};
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
                    report
                        .worst_margin()
                        .map_or_else(String::new, |(margin, _)| format!(
                            ", worst margin {}",
                            margin_text(margin)
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
    let class = match (good, warnings.is_empty() && !line.has_little_slack) {
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

/// The first line.
struct Line {
    text: String,
    /// `true` if all tasks are served.
    good: bool,
    /// `true` if the worst margin is hardly above 1.
    has_little_slack: bool,
}

/// Returns the line about the plans, with notes; an empty line without plans.
fn served(site: &Site, plans: &[ShownChain], works: &[&String]) -> (Line, Vec<String>) {
    let mut notes = Vec::new();
    if plans.is_empty() {
        let text = String::new();
        let line = Line {
            text,
            good: true,
            has_little_slack: false,
        };
        return (line, notes);
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
    let mut has_little_slack = false;
    let all = reports().filter_map(|(name, report)| Some((report.worst_margin()?, name)));
    if let Some(((margin, step), name)) = all.min_by_key(|((margin, _), _)| margin.q16()) {
        text += &format!(", worst margin {}, proven", margin_text(margin));
        has_little_slack = little_slack(margin).is_some();
        notes.push(format!(
            "the worst margin is that of step {} to {name}: a margin is how many times as large the uncertainty could be before the step is no longer certain{}",
            step + 1,
            little_slack(margin).map_or_else(String::new, |advice| format!("; {advice}"))
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
    let line = Line {
        text,
        good,
        has_little_slack,
    };
    (line, notes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate_plan::{Options, Plans};

    const PAPER: &str = include_str!("../../../../examples/sites/paper-chain.toml");

    /// Returns the summary of the paper's site with two more work tasks: `dock` with a plan, `bay` with a reason why it has
    /// none, or as many of them as `count`, and `yard` without a start.
    fn text_of(count: usize) -> String {
        let task = |name: &str| {
            format!(
                "[task.{name}]\nkind = \"work\"\ngoal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}\n\
                 success = {{ shape = \"box\", x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-4.0, 4.0] }}\n"
            )
        };
        let text = format!("{PAPER}\n{}{}", task("bay"), task("yard"));
        let site = Site::parse(&text, "site.toml").unwrap();
        let planned = Plans::of(&site).plan("back-to-dock", "dock", &Options::default());
        let report = planned.unwrap().unwrap().plan.unwrap().report();
        let shown = |name: &str, found| ShownChain {
            name: name.into(),
            found,
        };
        let mut plans = vec![
            shown("dock", Ok((report, String::new()))),
            shown("bay", Err("no chain arrives".into())),
        ];
        plans.truncate(count);
        let contents = Contents {
            plan: String::new(),
            tasks: Vec::new(),
            left_out: Vec::new(),
            chains: Vec::new(),
            plans,
        };
        summary(&site, &contents)
    }

    #[test]
    fn summary_states_served_and_not_served_and_unknown() {
        let text = text_of(2);
        assert!(
            text.starts_with(
                "<p id=\"summary\" class=\"bad\">1 of 2 work tasks served by 1 tag, worst margin 1.13, proven</p>"
            ),
            "{text}"
        );
        for note in [
            "<li>NOT served: bay: no chain arrives</li>",
            "<li>unknown whether a robot can reach yard: no start is given, as `from`</li>",
            "<li>unknown how far off 1 of 1 tags may be mounted: the site file states no tolerance</li>",
            "<li>0 of 4 success sets proven, as tables for a controller</li>",
        ] {
            assert!(text.contains(note), "{note}: {text}");
        }
        assert!(!text.contains("hardly larger errors"), "{text}");
        let served = text_of(1);
        assert!(
            served.contains(">1 of 1 work tasks served by 1 tag, ")
                && !served.contains("NOT served")
                && served.contains("<li>unknown whether a robot can reach bay, yard: "),
            "{served}"
        );
        // Without a plan nothing is served, and the line says what is proven.
        let none = text_of(0);
        assert!(none.contains(">0 of 4 success sets proven</p>"), "{none}");
    }
}
