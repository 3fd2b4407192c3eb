//! Tasks from TOML.

use super::error::SiteError;
use super::names::{Names, named};
use super::reader::Node;
use super::table_keys::TableKeys;
use super::{TableOverrides, Task, TaskKind, keys, learnt, places, poses, success};
use posegate::shape::SuccessSet;

/// Reads a task.
pub(super) fn task(
    node: &Node<'_>,
    names: &Names<'_>,
    defaults: &TableKeys,
) -> Result<Task, SiteError> {
    let table = node.table(&[
        &keys::KIND,
        &keys::GOAL,
        &keys::SUCCESS,
        &keys::ERROR_BOUND,
        &keys::TABLE,
        &keys::TOLERANCE,
        &keys::EXPECTED,
        &keys::TASK_FROM,
    ])?;
    let kind = kind(&table.required(&keys::KIND)?)?;
    let goal = table.required(&keys::GOAL)?;
    let goal = if goal.is_text() {
        *named(&goal, "goal", names.goals)?
    } else {
        poses::less(poses::pose2(&goal)?, names.origin)
    };
    let set = table.required(&keys::SUCCESS)?;
    let mut shape = success::shape(&set, names)?;
    if let Some(node) = table.optional(&keys::TOLERANCE) {
        shape = shape.within(places::tolerance(&node)?);
        if shape.has_empty_box() {
            return Err(node
                .error("the tolerance leaves nothing of a box in the success set")
                .help("survey the goal better, or make the box larger"));
        }
    }
    let success = SuccessSet { goal, shape };
    if let Some(obstacle) = success.covered_by() {
        return Err(set
            .error(format!(
                "an obstacle covers the goal, which is {:.3} m inside of it",
                -obstacle
            ))
            .expected("obstacles that do not cover the goal: their corners are in the goal frame")
            .help("move the obstacle, or the goal"));
    }
    let error_bound = match kind {
        TaskKind::Work if table.has(keys::ERROR_BOUND.name) => {
            return Err(table
                .error_at_key(
                    keys::ERROR_BOUND.name,
                    format!("{} is a work task and has an `error_bound`", table.title()),
                )
                .expected("an `error_bound` in localization tasks only")
                .help("remove it, or write `kind = \"localization\"`"));
        }
        TaskKind::Work => None,
        TaskKind::Localization => Some(learnt::error_bound(&table, &set, names)?),
    };
    let from = match table.optional(&keys::TASK_FROM) {
        Some(node) if kind == TaskKind::Localization => {
            return Err(node
                .error(format!(
                    "{} is no work task and has a `from`",
                    table.title()
                ))
                .expected("a `from` in work tasks only")
                .help("remove it"));
        }
        Some(node) => Some(node.text()?.to_owned()),
        None => None,
    };
    let own_table = match table.optional(&keys::TABLE) {
        Some(node) => Some(TableKeys::read(&node)?.or(defaults)),
        None => None,
    };
    let said = own_table.unwrap_or(*defaults);
    let wish = TableOverrides {
        extent: said.extent,
        step: said.step,
        layout: said.layout,
        expected: match table.optional(&keys::EXPECTED) {
            Some(node) => Some(places::expected(&node)?),
            None => None,
        },
    };
    Ok(Task {
        kind,
        success,
        error_bound,
        from,
        table: own_table.and_then(TableKeys::complete),
        wish,
    })
}

fn kind(node: &Node<'_>) -> Result<TaskKind, SiteError> {
    match node.text()? {
        "work" => Ok(TaskKind::Work),
        "localization" => Ok(TaskKind::Localization),
        "navigation" => Err(node
            .error("navigation is not a kind of task")
            .help("write it as a `navigate` step of a [chain.NAME] table")),
        _ => Err(node.unknown_word(["work", "localization"])),
    }
}
