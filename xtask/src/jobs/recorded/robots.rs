//! The recorded robots: factors that are learnt on some of them, applied to the others.

use super::{posegate, table};
use crate::files::{self, Scratch};
use crate::report::Report;
use crate::shell::Result;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// The required share of pose-sets that contain the truth, as in the site file.
const EPSILON: f64 = 0.99;
/// The default of `learn inflation --confidence`: the required share of new robots for which the factor is large
/// enough.
const CONFIDENCE: f64 = 0.8;
/// The number of robots from which a factor for a new one follows with this confidence.
const ENOUGH: usize = 4;
/// What the replays of the robots have in common.
const BAY: &str = "--task bay --max-age-ms 3000 --permit-hold-ms 3000 --json";

/// Replays each robot with the factor that `learn inflation` finds on all others at its default confidence, and prints the robots,
/// the worst first. Every split that leaves fewer than four robots to learn from must be refused. Fails if the gate permits falsely on any
/// robot, or if fewer robots are covered than stated.
pub fn robots(folder: &Path) -> Result {
    let estimates = files::read(folder.join("mrclam/ekf_estimates.csv"))?;
    let scratch = Scratch::new()?;
    let (all, held, model) = (
        scratch.join("learn.csv"),
        scratch.join("held.csv"),
        scratch.join("filter.toml"),
    );
    let robots = names(&estimates);
    let mut report = Report::default();
    let mut found = Vec::new();
    for left_out in subsets(&robots) {
        files::write(&all, rows_of(&estimates, |robot| !left_out.contains(robot)))?;
        let learnt = posegate()
            .words("learn inflation")
            .arg(&all)
            .words(&format!("--epsilon {EPSILON} --json -o"))
            .arg(&model)
            .outcome()?;
        if robots.len() - left_out.len() < ENOUGH {
            report.require(
                learnt.code == 2,
                format!("a refusal to learn without the robots {left_out:?}"),
            );
            continue;
        }
        let [robot] = left_out.as_slice() else {
            return Err(format!("a split that leaves out {left_out:?}").into());
        };
        let learnt: Value = serde_json::from_str(&learnt.text)?;
        let factor = largest(&learnt).ok_or("no factor in the answer of `learn inflation`")?;
        files::write(&held, rows_of(&estimates, |name| name == robot))?;
        let replay = posegate()
            .words("replay examples/sites/turtlebot.toml")
            .arg(&held)
            .words(&format!("{BAY} --inflation {factor}"))
            .outcome()?;
        let summary: Value = serde_json::from_str(&replay.text)?;
        let coverage = summary["truth"]["coverage"].as_f64().unwrap_or(0.0);
        found.push((coverage, robot.clone(), factor, replay.text));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (coverage, robot, factor, replay) in &found {
        let name = format!("mrclam, bay, robot {robot}, inflation {factor} learnt of the others");
        table(&name, replay)?;
        let summary: Value = serde_json::from_str(replay)?;
        let gate = &summary["rules"]["gate"];
        report.require(
            gate["false_permits"].as_u64() == Some(0),
            format!("no false permit of the gate on robot {robot}"),
        );
        report.require(
            gate["permits"].as_u64() > Some(0),
            format!("permits of the gate on robot {robot}"),
        );
        report.note(
            &format!("mrclam, robot {robot}: truth in the pose-sets, {EPSILON} stated"),
            coverage,
            "share",
        );
    }
    let covered = found.iter().filter(|found| found.0 >= EPSILON).count();
    report.at_least(
        "mrclam: new robots that are covered as stated",
        covered as f64,
        &format!("of {}", found.len()),
        CONFIDENCE * found.len() as f64,
    );
    report.finish()
}

/// Returns every set of robots that can be left out if several must remain to learn from, the small sets first. (One robot's factors
/// are for itself.)
fn subsets(robots: &[String]) -> Vec<Vec<String>> {
    let mut subsets: Vec<Vec<String>> = (1..(1usize << robots.len()) - 1)
        .map(|bits| {
            let is_in = |k: &usize| bits >> k & 1 == 1;
            let chosen = (0..robots.len()).filter(is_in);
            chosen.map(|k| robots[k].clone()).collect()
        })
        .collect();
    subsets.retain(|subset| subset.len() + 2 <= robots.len());
    subsets.sort_by_key(Vec::len);
    subsets
}

/// Returns the largest factor of a model: the number for the controller's `Source`.
fn largest(learnt: &Value) -> Option<f64> {
    let parts = learnt["conditions"].as_array()?;
    parts
        .iter()
        .chain([&learnt["overall"]])
        .map(|part| part["inflation"].as_f64())
        .try_fold(0.0, |most: f64, factor| Some(most.max(factor?)))
}

/// Returns the robots: the texts in the first column.
fn names(rows: &str) -> Vec<String> {
    let robots: BTreeSet<&str> = rows.lines().skip(1).map(robot_of).collect();
    robots.into_iter().map(ToOwned::to_owned).collect()
}

/// Returns the header and the rows of some robots.
fn rows_of(rows: &str, takes: impl Fn(&String) -> bool) -> String {
    let mut kept = String::new();
    for (index, line) in rows.lines().enumerate() {
        if index == 0 || takes(&robot_of(line).to_owned()) {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

fn robot_of(line: &str) -> &str {
    line.split(',').next().unwrap_or("").trim()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn rows_are_chosen_by_the_robot() {
        let rows = "robot,x\n1,0.5\n2,0.6\n3,0.7\n1,0.8\n";
        assert_eq!(names(rows), ["1", "2", "3"]);
        assert_eq!(
            rows_of(rows, |robot| robot != "2"),
            "robot,x\n1,0.5\n3,0.7\n1,0.8\n"
        );
        let all = subsets(&names(rows));
        assert_eq!(all, [["1"], ["2"], ["3"]]);
        assert_eq!(
            subsets(&["a", "b", "c", "d", "e"].map(String::from)).len(),
            5 + 10 + 10
        );
    }

    #[test]
    fn largest_factor_is_returned_and_missing_factors_give_none() {
        let of = |overall: Value, part: Value| {
            largest(
                &json!({"overall": {"inflation": overall}, "conditions": [{"inflation": 2.0}, {"inflation": part}]}),
            )
        };
        assert_eq!(of(json!(1.0), json!(3.5)), Some(3.5));
        assert_eq!(of(json!(4.0), json!(3.5)), Some(4.0));
        assert_eq!(of(json!(4.0), Value::Null), None);
    }
}
