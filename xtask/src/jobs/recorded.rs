//! `recorded`: runs recorded estimates through the emulated controller and the host, and tests models learnt from recorded detections
//! and from a recorded filter on rows that they were not learnt from.

mod moving;

use crate::arguments::Arguments;
use crate::files::{self, Scratch, release};
use crate::jobs::docs::release_program;
use crate::jobs::test::{passed, ran, suite};
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Cmd, Result, cmd, program_at};
use serde_json::Value;
use std::path::Path;

const TIMES: &str = "--max-age-ms 3000 --permit-hold-ms 3000 --json";

pub fn recorded(given: &Arguments) -> Result {
    let folder = given.folder(0, "the folder of the recordings")?;
    need::targets(&THUMBS)?;
    need::qemu()?;
    let replayed = suite("--test uart_replay -- --ignored --nocapture recorded");
    ran(replayed.env("POSEGATE_RECORDED", &folder), 1)?;
    let learnt = suite("--test learn -- --ignored --nocapture --test-threads 1 recorded")
        .env("POSEGATE_RECORDED", &folder)
        .json()?;
    if passed(&learnt) == 0 {
        return Err("no test of learn is named *recorded*".into());
    }
    rules(&folder)?;
    moving::moving(&folder)
}

/// Returns the program as it is released.
fn release_posegate() -> Cmd {
    program_at(&release("posegate"))
}

/// Prints what the gate, and the rules that are in use today, would have permitted: for AMCL's estimates of the Nav2 recording, which
/// has no truth, and for those of a filter on real robots, whose truth is known. Fails if the gate permits falsely on the robots with
/// even numbers, with covariances inflated by the factor that `learn` finds on the others.
fn rules(folder: &Path) -> Result {
    release_program()?;
    need::command("python3", "python3")?;
    let posegate = release_posegate;
    for task in ["hall", "dock"] {
        let replay = posegate()
            .words("replay examples/sites/turtlebot.toml")
            .arg(folder.join("nav2/nav2_turtlebot.mcap"))
            .words(&format!(
                "--task {task} --topic /amcl_pose --cross-terms yaw-unknown {TIMES}"
            ))
            .read()?;
        table(&format!("nav2, {task}"), &replay)?;
    }
    let estimates = folder.join("mrclam/ekf_estimates.csv");
    let replay = |estimates: &Path, inflation: &str| -> Result<String> {
        let outcome = posegate()
            .words("replay examples/sites/turtlebot.toml")
            .arg(estimates)
            .words(&format!("--task bay --inflation {inflation} {TIMES}"))
            .outcome()?;
        // The exit code is 1 after a false permit; the table shows which.
        match outcome.code {
            0 | 1 => Ok(outcome.text),
            code => Err(format!("posegate replay failed with {code}").into()),
        }
    };
    for inflation in ["1", "6"] {
        table(
            &format!("mrclam, bay, inflation {inflation}"),
            &replay(&estimates, inflation)?,
        )?;
    }
    let half = Scratch::new()?;
    let text = files::read(&estimates)?;
    files::write(half.join("learn.csv"), of_robots(&text, 1))?;
    files::write(half.join("held.csv"), of_robots(&text, 0))?;
    // Three robots have 133 independent rows: enough for a confidence of 0.7.
    let learnt = posegate()
        .words("learn inflation")
        .arg(half.join("learn.csv"))
        .words("--epsilon 0.99 --confidence 0.7 --json -o")
        .arg(half.join("filter.toml"))
        .read()?;
    // In Python, because it prints the number with all of its digits.
    let inflation = cmd("python3 -c")
        .arg("import json, sys; print(json.load(sys.stdin)['overall']['inflation'])")
        .input(learnt)
        .read()?;
    let inflation = inflation.trim();
    let held = replay(&half.join("held.csv"), inflation)?;
    table(
        &format!("mrclam, bay, robots 2 and 4, inflation {inflation} learnt of 1, 3 and 5"),
        &held,
    )?;
    let held: Value = serde_json::from_str(&held)?;
    let gate = &held["rules"]["gate"];
    let mut report = Report::default();
    report.require(
        gate["false_permits"].as_u64() == Some(0),
        "false permits of the gate",
    );
    report.require(gate["permits"].as_u64() > Some(0), "permits of the gate");
    report.require(
        held["truth"]["coverage"].as_f64() >= Some(0.99),
        "truth in the pose-sets",
    );
    report.finish()
}

/// Prints a replay's rules as JSON lines.
fn table(name: &str, replay: &str) -> Result {
    cmd("python3 tests/support/rules.py")
        .arg(name)
        .input(replay)
        .print()
}

/// Returns the header and the rows of robots whose number, the first column, is this modulo 2.
fn of_robots(rows: &str, parity: u64) -> String {
    let mut kept = String::new();
    for (index, line) in rows.lines().enumerate() {
        let robot = line
            .split(',')
            .next()
            .and_then(|number| number.trim().parse::<u64>().ok());
        if index == 0 || robot.is_some_and(|number| number % 2 == parity) {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::of_robots;

    #[test]
    fn rows_are_chosen_by_the_robots_number() {
        let rows = "robot,x\n1,0.5\n2,0.6\n3,0.7\n";
        assert_eq!(of_robots(rows, 1), "robot,x\n1,0.5\n3,0.7\n");
        assert_eq!(of_robots(rows, 0), "robot,x\n2,0.6\n");
    }
}
