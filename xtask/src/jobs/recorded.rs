//! `recorded`: runs recorded estimates through the emulated controller and the host. Tests models learnt from recorded detections and
//! from a recorded filter on held-out rows.

mod moving;
mod robots;

use crate::arguments::Arguments;
use crate::files::tested;
use crate::jobs::test::{build_suite, passed, ran, suite};
use crate::need::{self, THUMBS};
use crate::shell::{Cmd, Result, cmd, program_at};
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
    robots::robots(&folder)?;
    moving::moving(&folder)
}

/// Returns the program of the fast suite.
fn posegate() -> Cmd {
    program_at(&tested("posegate"))
}

/// Prints what the gate, and the rules in use today, would have permitted. The estimates are AMCL's of the Nav2 recording, without a
/// truth, and those of a filter on real robots with a known truth.
fn rules(folder: &Path) -> Result {
    build_suite("--bin posegate").run()?;
    need::command("python3", "python3")?;
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
    Ok(())
}

/// Prints a replay's rules as JSON lines.
fn table(name: &str, replay: &str) -> Result {
    cmd("python3 tests/support/rules.py")
        .arg(name)
        .input(replay)
        .print()
}
