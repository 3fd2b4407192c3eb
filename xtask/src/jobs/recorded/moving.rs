//! Recordings of robots that drive: for how long the interlock is open, with each fix carried along the odometry and without.

use super::posegate;
use crate::files::{self, Scratch};
use crate::jobs::test::suite;
use crate::report::Report;
use crate::shell::Result;
use serde_json::{Value, json};
use std::path::Path;

/// AMCL's fixes come up to 0.7 s apart: a permit has to be held for that long if nothing carries them.
const HELD: &str = "--max-age-ms 900 --permit-hold-ms 800";
/// The largest speeds that the odometry of the recording shows: 0.500 m/s and 56.2 deg/s.
const DRIVES: &str = "--max-speed 0.5 --max-yaw-rate 60";
/// The robots of the arena: at most 0.086 m/s and 33 deg/s. Their odometry differs from the truth by a tenth of the path.
const ROBOTS: &str = "--max-speed 0.1 --max-yaw-rate 35 --fast";
const ODOMETRY: &str = "--odom-gap-ms 200 --fix-age-ms 20000 --odom-noise 0.05,0.2,0.1 --odom-slip 0.1 --max-age-ms 400 --permit-hold-ms 250";
/// Longest time between two poses of the odometry that is made of the filter's steps, seconds.
const STEP_S: f64 = 0.1;

/// What the interlock did in one or several replays.
#[derive(Clone, Copy, Debug, Default)]
struct Interlock {
    openings: u64,
    open_s: f64,
    estimates: u64,
    permits: u64,
    /// Steps of the gate with the interlock open and a known true pose, and those with the true pose outside; permits of estimates
    /// whose true pose is outside.
    with_truth: u64,
    outside: u64,
    false_permits: u64,
}

impl Interlock {
    fn of(replay: &str) -> Result<Self> {
        let all: Value = serde_json::from_str(replay)?;
        let (interlock, gate) = (&all["interlock"], &all["rules"]["gate"]);
        let count = |value: &Value| value.as_u64().unwrap_or(0);
        Ok(Self {
            openings: count(&interlock["openings"]),
            open_s: interlock["open_s"].as_f64().unwrap_or(0.0),
            estimates: count(&all["estimates"]),
            permits: count(&gate["permits"]),
            with_truth: count(&interlock["open_steps_with_truth"]),
            outside: count(&interlock["open_steps_outside"]),
            false_permits: count(&gate["false_permits"]),
        })
    }

    const fn plus(self, other: Self) -> Self {
        Self {
            openings: self.openings + other.openings,
            open_s: self.open_s + other.open_s,
            estimates: self.estimates + other.estimates,
            permits: self.permits + other.permits,
            with_truth: self.with_truth + other.with_truth,
            outside: self.outside + other.outside,
            false_permits: self.false_permits + other.false_permits,
        }
    }

    /// Prints a JSON line. What compares with the truth is `null` without a truth.
    fn print(&self, name: &str) {
        let truth = |value: u64| (self.with_truth > 0).then_some(value);
        println!(
            "{}",
            json!({
                "name": format!("{name}: interlock"),
                "value": (self.open_s * 10.0).round() / 10.0,
                "unit": "s open",
                "goal": null,
                "openings": self.openings,
                "permits": self.permits,
                "estimates": self.estimates,
                "false_permits": truth(self.false_permits),
                "open_steps": truth(self.with_truth),
                "open_steps_outside": truth(self.outside),
            })
        );
    }
}

/// Prints for how long the interlock is open on the recorded hall and in the robots' arena. Fails if it is ever open with the true pose
/// outside, if the odometry has no effect, or if it is open longer than with exact sets.
pub fn moving(folder: &Path) -> Result {
    let mut report = Report::default();
    hall(folder, &mut report)?;
    arena(folder, &mut report)?;
    report.finish()
}

/// The hall: AMCL under Nav2, without a truth.
fn hall(folder: &Path, report: &mut Report) -> Result {
    let replay = |options: &str| -> Result<Interlock> {
        let text = posegate()
            .words("replay examples/sites/turtlebot.toml")
            .arg(folder.join("nav2/nav2_turtlebot.mcap"))
            .words("--task hall --topic /amcl_pose --cross-terms yaw-unknown --json")
            .words(options)
            .read()?;
        Interlock::of(&text)
    };
    let mut found = Vec::new();
    for (name, options) in [
        ("stands still, settings as shipped", String::new()),
        ("stands still, permits held for 0.8 s", HELD.into()),
        ("drives, permits held for 0.8 s", format!("{DRIVES} {HELD}")),
        (
            "drives, fixes carried along /odom",
            format!("{DRIVES} --odom /odom"),
        ),
        (
            "drives, fixes carried along /tf",
            format!("{DRIVES} --odom /tf"),
        ),
    ] {
        let interlock = replay(&options)?;
        interlock.print(&format!("nav2, hall, {name}"));
        found.push(interlock);
    }
    let exact = suite("--test recorded_hall -- --ignored --nocapture")
        .env("POSEGATE_RECORDED", folder)
        .json()?;
    let exact_s = exact.lines().find_map(|line| {
        let line: Value = serde_json::from_str(line).ok()?;
        line["value"].as_f64()
    });
    let exact_s = exact_s.ok_or("the test `recorded_hall` printed no time")?;
    if let [_, _, held, odometry, transforms] = found.as_slice() {
        report.at_most(
            "nav2, hall, drives: time open over that with exact sets",
            odometry.open_s / exact_s,
            "ratio",
            1.0,
        );
        report.require(odometry.openings > 0, "openings of the recorded hall");
        report.require(
            odometry.open_s > held.open_s,
            "time open with the odometry, over that without",
        );
        report.require(
            (odometry.open_s - transforms.open_s).abs() < 0.1,
            "time open with /tf as with /odom",
        );
    }
    Ok(())
}

/// The arena: a filter on five robots, with the truth. A fix is an estimate with a landmark since the one before. The recording has no
/// odometry of its own: the filter's steps replace it, divided into equal parts. A step with a landmark in it also has that
/// landmark's correction; the fix at its end replaces it.
fn arena(folder: &Path, report: &mut Report) -> Result {
    let text = files::read(folder.join("mrclam/ekf_estimates.csv"))?;
    for inflation in ["1", "6"] {
        let [mut alone, mut carried] = [Interlock::default(); 2];
        for robot in 1..=5 {
            let drive = Drive::of(&text, robot).ok_or("ekf_estimates.csv has other columns")?;
            let scratch = Scratch::new()?;
            files::write(scratch.join("fixes.csv"), &drive.fixes)?;
            files::write(scratch.join("odometry.csv"), &drive.odometry)?;
            files::write(scratch.join("truth.csv"), &drive.truth)?;
            let replay = |options: &str| {
                posegate()
                    .words("replay examples/sites/turtlebot.toml")
                    .arg(scratch.join("fixes.csv"))
                    .words("--task bay --json --truth-gap 3.2 --truth")
                    .arg(scratch.join("truth.csv"))
                    .words(&format!("--inflation {inflation} {ROBOTS} {options}"))
            };
            // The exit code is 1 after a false permit; the line shows how many.
            let held = replay("--max-age-ms 1300 --permit-hold-ms 1200").outcome()?;
            alone = alone.plus(Interlock::of(&held.text)?);
            let odometry = replay(ODOMETRY).words("--odom");
            let odometry = odometry.arg(scratch.join("odometry.csv")).outcome()?;
            carried = carried.plus(Interlock::of(&odometry.text)?);
        }
        let name = format!("mrclam, bay, inflation {inflation}, drives");
        alone.print(&format!("{name}, permits held for 1.2 s"));
        carried.print(&format!("{name}, fixes carried along the odometry"));
        report.require(carried.outside == 0, format!("{name}: open outside"));
        report.require(
            carried.open_s > alone.open_s,
            format!("{name}: time open with the odometry, over that without"),
        );
    }
    Ok(())
}

/// The files of one robot's drive, as CSV.
#[derive(Debug, PartialEq)]
struct Drive {
    fixes: String,
    odometry: String,
    truth: String,
}

impl Drive {
    /// Takes the rows of a robot. `None` if a column is missing or a number is missing.
    fn of(text: &str, robot: u32) -> Option<Self> {
        let mut lines = text.lines();
        let header = lines.next()?;
        let names: Vec<&str> = header.split(',').collect();
        let column = |name: &str| names.iter().position(|known| *known == name);
        let of =
            |names: [&str; 4]| -> Option<Vec<usize>> { names.into_iter().map(column).collect() };
        let pose = of(["t_s", "x_m", "y_m", "yaw_rad"])?;
        let truth = of(["t_s", "true_x_m", "true_y_m", "true_yaw_rad"])?;
        let (number, since) = (column("robot")?, column("since_landmark_s")?);
        let poses = "t_s,x_m,y_m,yaw_rad\n";
        let mut drive = Self {
            fixes: format!("{header}\n"),
            odometry: poses.into(),
            truth: poses.into(),
        };
        let mut before: Option<[f64; 4]> = None;
        for line in lines {
            let fields: Vec<&str> = line.split(',').collect();
            let value = |at: usize| fields.get(at)?.parse::<f64>().ok();
            if value(number)? != f64::from(robot) {
                continue;
            }
            let all = |places: &[usize]| -> Option<[f64; 4]> {
                let values: Option<Vec<f64>> = places.iter().map(|at| value(*at)).collect();
                values?.try_into().ok()
            };
            let now = all(&pose)?;
            if before
                .is_none_or(|before| value(since).is_some_and(|s| s < now[0] - before[0] - 1e-6))
            {
                drive.fixes += &format!("{line}\n");
            }
            let [t, x, y, yaw] = all(&truth)?;
            drive.truth += &format!("{t},{x},{y},{yaw}\n");
            if let Some(before) = before {
                drive.steps(before, now);
            }
            before = Some(now);
        }
        Some(drive)
    }

    /// Adds the poses from one row up to the next, in equal parts.
    fn steps(&mut self, from: [f64; 4], to: [f64; 4]) {
        let tau = std::f64::consts::TAU;
        let mut by = [0, 1, 2, 3].map(|k| to[k] - from[k]);
        by[3] -= tau * (by[3] / tau).round();
        let count = (by[0] / STEP_S).ceil().max(1.0);
        for k in 0..count as u32 {
            let share = f64::from(k) / count;
            let [t, x, y, yaw] = [0, 1, 2, 3].map(|k| from[k] + share * by[k]);
            self.odometry += &format!("{t:.4},{x:.6},{y:.6},{yaw:.6}\n");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Drive;

    #[test]
    fn drive_has_fixes_at_landmarks_and_odometry_in_equal_parts() {
        let text = "robot,t_s,x_m,y_m,yaw_rad,true_x_m,true_y_m,true_yaw_rad,since_landmark_s\n\
                    1,1.0,0,0,3.1,0,0,3,0.5\n2,1.0,9,9,9,9,9,9,0\n1,1.2,0.1,0,-3.1,0.2,0,-3,0.7\n1,1.25,0.1,0,-3.1,0.2,0,-3,0.01\n";
        let drive = Drive::of(text, 1).unwrap();
        let fixes: Vec<&str> = drive.fixes.lines().skip(1).map(|line| &line[..6]).collect();
        assert_eq!(fixes, ["1,1.0,", "1,1.25"]);
        let lines: Vec<&str> = drive.odometry.lines().collect();
        assert_eq!(lines.len(), 4);
        // Through half a turn, not back through zero.
        assert!(
            lines[2].starts_with("1.1000,0.050000,0.000000,3.14"),
            "{lines:?}"
        );
        assert_eq!(drive.truth.lines().nth(2), Some("1.2,0.2,0,-3"));
        assert_eq!(Drive::of("robot,t_s\n1,2\n", 1), None);
    }
}
