//! The study as text and numbers: its chain, `numbers.json`, and the summary on the terminal.
//!
//! ```no_run
//! use posegate_show::draw::report::summary;
//! use posegate_show::draw::study::CaseStudy;
//!
//! let study = CaseStudy::run(&|| ())?;
//! print!("{}", summary(&study)?);
//! # Ok::<(), posegate_show::draw::study::StudyError>(())
//! ```

use super::placement::Column;
use super::study::{Answer, CaseStudy, DOCK, PoseSetSpec, SEE, StudyError};
use posegate::gate::Verdict;
use serde_json::{Value, json};
use std::fmt::Write;

/// A step of the paper's argument: an answer and its meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The answer.
    pub answer: Answer,
    /// The success set's name in the paper.
    pub set_name: &'static str,
    /// The consequence of this verdict.
    pub meaning: &'static str,
    /// `true` if the answer is the one that the argument needs.
    pub as_argued: bool,
}

/// Returns the paper's argument for a localization task before docking. The pose-set 1 m / 2° is
/// too large for S_w, but small enough for S_l. The pose-set after S_l's task is small enough for
/// S_w.
///
/// As in the paper, every task starts with the estimate at its goal.
///
/// # Errors
/// As [`CaseStudy::ask`].
pub fn chain(study: &CaseStudy) -> Result<[Step; 3], StudyError> {
    let step = |task, set_name, known, argued: bool, meanings: [&'static str; 2]| {
        let answer = study.ask(task, known)?;
        let [held, failed] = meanings;
        Ok::<_, StudyError>(Step {
            set_name,
            meaning: if answer.holds() { held } else { failed },
            as_argued: answer.holds() == argued,
            answer,
        })
    };
    Ok([
        step(
            DOCK,
            "S_w",
            PoseSetSpec::ONE_METRE,
            false,
            [
                "docking needs no localization",
                "docking is not guaranteed: localize first",
            ],
        )?,
        step(
            SEE,
            "S_l",
            PoseSetSpec::ONE_METRE,
            true,
            [
                "the tag is seen from every such pose",
                "the tag may be missed",
            ],
        )?,
        step(
            DOCK,
            "S_w",
            PoseSetSpec::FIVE_CENTIMETRES,
            true,
            [
                "so docking succeeds after the localization",
                "so docking may fail after the localization",
            ],
        )?,
    ])
}

fn containment(answer: &Answer, epsilon: f64) -> Value {
    json!({
        "task": answer.task,
        "pose_set": match answer.known {
            PoseSetSpec::Bounded { translation, yaw_deg } => json!({
                "type": "bounded",
                "translation": translation,
                "yaw_deg": yaw_deg,
            }),
            PoseSetSpec::Gaussian { sigma, sigma_yaw_deg } => json!({
                "type": "gaussian",
                "sigma_x": sigma,
                "sigma_y": sigma,
                "sigma_yaw_deg": sigma_yaw_deg,
                "epsilon": epsilon,
            }),
        },
        "verdict": if answer.holds() { "permit" } else { "deny" },
        "reason": match answer.verdict {
            Verdict::Permit { .. } => None,
            Verdict::Deny { reason, .. } => Some(reason.name()),
        },
        "margin": answer.margin(),
        "worst_pose": answer.worst_pose(),
    })
}

/// Returns the text of `numbers.json`: every table, every answer, the chain.
///
/// The seconds in it are measured and differ from run to run; everything else is the same.
///
/// # Errors
/// As [`CaseStudy::ask`].
pub fn numbers(study: &CaseStudy) -> Result<String, StudyError> {
    let mut tables = Vec::new();
    for proven in &study.tables {
        let cells = *study.table(&proven.task)?.cells();
        tables.push(json!({
            "task": proven.task,
            "bytes": proven.bytes.len(),
            "layout": "facets",
            // Columns, rows, slabs.
            "cells": [cells.columns, cells.rows, cells.slabs],
            "proven_cells": proven.proof.cells,
            "proven_runs": proven.proof.runs,
            "proven_corners": proven.proof.corners,
            "bake_s": proven.bake_s,
            "prove_s": proven.prove_s,
        }));
    }
    let answers = study.answers.iter();
    let containments = answers.map(|answer| containment(answer, study.site.epsilon));
    let chain = chain(study)?;
    let numbers = json!({
        "tool_version": env!("CARGO_PKG_VERSION"),
        "epsilon": study.site.epsilon,
        "tables": tables,
        "containments": containments.collect::<Vec<_>>(),
        "chain": {
            "assumption": "as in the paper, every task starts with the estimate at its goal",
            "steps": chain.iter().map(Step::to_string).collect::<Vec<_>>(),
            "holds": chain.iter().all(|step| step.as_argued),
        },
        // Fig. 4.
        "placements": study.places.iter().map(placement).collect::<Vec<_>>(),
    });
    Ok(format!("{numbers:#}\n"))
}

/// A place of Fig. 4.
fn placement(column: &Column) -> Value {
    let mut value = column.placed.to_json();
    value["case"] = json!(column.heading);
    value
}

/// `1 m / 2° is not inside S_w (dock), margin 0.059: docking is not guaranteed: localize first`.
impl core::fmt::Display for Step {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let not = if self.answer.holds() { "" } else { "not " };
        write!(
            f,
            "{} is {not}inside {} ({}), margin {}: {}",
            self.answer.known,
            self.set_name,
            self.answer.task,
            self.answer.margin_text(),
            self.meaning
        )
    }
}

/// Returns the study's summary for a terminal: tables, answers, chain.
///
/// # Errors
/// As [`CaseStudy::ask`].
pub fn summary(study: &CaseStudy) -> Result<String, StudyError> {
    let mut text = String::from("Tables, proven on their bytes\n");
    // Writing to a string cannot fail.
    for table in &study.tables {
        let _ = writeln!(
            text,
            "  {:<8} {:>6} bytes of facets, {:>5} corners; baked in {:.0} ms, proven in {:.0} ms",
            table.task,
            table.bytes.len(),
            table.proof.corners,
            table.bake_s * 1e3,
            table.prove_s * 1e3,
        );
    }
    text.push_str("Which pose-sets about the goal are inside the task's success set\n");
    for answer in &study.answers {
        let holds = answer.holds_text();
        let _ = writeln!(
            text,
            "  {:<8} {:<17} {holds:<10}  margin {}",
            answer.task,
            answer.known.to_string(),
            answer.margin_text(),
        );
    }
    text.push_str("What follows, with the estimate at the goal as in the paper\n");
    for (index, step) in chain(study)?.iter().enumerate() {
        let _ = writeln!(text, "  {}. {step}", index + 1);
    }
    Ok(text)
}
