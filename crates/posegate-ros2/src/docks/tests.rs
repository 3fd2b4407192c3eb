use super::*;
use crate::fixtures::{arguments, at, origin};
use crate::permission::Heartbeat;
use posegate::report::{Heading, PoseEstimate};
use posegate::set::Uncertainty;
use std::fs;
use std::path::PathBuf;

const TABLES: [(&str, &[u8]); 2] = [
    (
        "dock",
        include_bytes!("../../../../examples/tables/dock.posegate"),
    ),
    (
        "see-t7",
        include_bytes!("../../../../examples/tables/see-t7.posegate"),
    ),
];

/// Makes the folder of a built site, as a merge writes it.
fn built(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("posegate-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("tables")).unwrap();
    let files = TABLES.map(|(task, bytes)| {
        let path = format!("tables/{task}.posegate");
        fs::write(folder.join(&path), bytes).unwrap();
        let digest = Table::parse(bytes).unwrap().digest();
        let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        format!(
            r#"{{"path": "{path}", "bytes": {}, "sha256": "{digest}"}}"#,
            bytes.len()
        )
    });
    let text = format!(
        r#"{{"format": 1, "files": [{}, {{"path": "proofs/dock.json", "bytes": 1, "sha256": "00"}}]}}"#,
        files.join(", ")
    );
    fs::write(folder.join(MANIFEST), text).unwrap();
    folder
}

fn read_with(folder: &Path, more: &str) -> Result<Vec<Dock>, DocksError> {
    let line = format!(
        "{} {more} -p stands_still:=true -p cross_terms:=filled",
        folder.display()
    );
    read(&arguments(&line))
}

/// Gives good poses at the dock for 1.5 s. Returns the heartbeats.
fn drive(gate: &mut DockGate<'_>, docks: &[Dock], ms: &mut u32) -> Vec<(bool, String, String)> {
    let (given, mut heartbeat) = (&docks[0].settings, Heartbeat::start());
    let mut all = Vec::new();
    for _ in 0..15 {
        *ms += 100;
        let belief = PoseEstimate {
            x_m: 0.0,
            y_m: 0.0,
            heading: Heading::Radians(0.0),
            spread: Some(Uncertainty::Gaussian([
                [1e-4, 0.0, 0.0],
                [0.0, 1e-4, 0.0],
                [0.0, 0.0, 1e-5],
            ])),
        };
        let report = PoseReport {
            stamp: at(*ms).time(),
            frame: "map".into(),
            pose: Ok(belief),
        };
        let answer = gate.pose(at(*ms), &report, origin(i64::from(*ms / 100)));
        let message = heartbeat.next(&answer, given, gate.chosen(given), Vec::new());
        let status = &message.status[0];
        let value = |key| status.value(key).unwrap_or_default().to_owned();
        all.push((status.message == "permit", value("task"), value("table")));
    }
    all
}

#[test]
fn task_is_asked_for_by_name_and_a_change_closes_first() {
    let folder = built("docks");
    let docks = read_with(&folder, "--ros-args").unwrap();
    fs::remove_dir_all(&folder).unwrap();
    let gates: Vec<Settings<'_>> = docks.iter().map(|dock| dock.settings.gate()).collect();
    let mut gate = DockGate::new(&docks, &gates);
    let mut ms = 0;
    // None at first.
    let none = drive(&mut gate, &docks, &mut ms);
    assert!(
        none.iter()
            .all(|(permits, task, table)| !permits && task.is_empty() && table.is_empty())
    );
    assert!(
        gate.problem()
            .unwrap()
            .contains("publish its name on posegate_task; the tasks of the site are dock, see-t7")
    );
    gate.ask(at(ms), "dock");
    assert!(!Decider::tick(&mut gate, at(ms)).is_open);
    let dock = drive(&mut gate, &docks, &mut ms);
    assert_eq!(
        dock.last().unwrap(),
        &(true, "dock".into(), docks[0].settings.table())
    );
    assert!(!dock[0].0 && gate.problem().is_none());
    // The same name again changes nothing.
    gate.ask(at(ms), "dock");
    assert!(Decider::tick(&mut gate, at(ms)).is_open);
    // The other table is not used before the gate has closed, and earns its permits anew. Its set is elsewhere.
    gate.ask(at(ms), "see-t7");
    assert!(!Decider::tick(&mut gate, at(ms)).is_open);
    let other = drive(&mut gate, &docks, &mut ms);
    assert!(!other[0].0);
    assert!(
        other
            .iter()
            .all(|(_, task, table)| task == "see-t7" && *table == docks[1].settings.table())
    );
    // An unknown name denies with words, and its heartbeat names no table.
    gate.ask(at(ms), "dock");
    assert!(drive(&mut gate, &docks, &mut ms).last().unwrap().0);
    gate.ask(at(ms), "dokc");
    let answer = Decider::tick(&mut gate, at(ms));
    assert_eq!(
        (answer.is_open, answer.reason()),
        (false, Some(Reason::WrongTask))
    );
    assert!(
        gate.explain(&answer, gate.problem().as_deref())
            .contains("the task `dokc` that is asked for is not in the site")
    );
    assert!(
        drive(&mut gate, &docks, &mut ms)
            .iter()
            .all(|(permits, ..)| !permits)
    );
}

/// A fault that is latched does not end by asking for another task.
#[test]
fn latched_fault_outlives_a_change_of_the_task() {
    let folder = built("latched");
    let docks = read_with(&folder, "--ros-args -p restart:=on_reset").unwrap();
    fs::remove_dir_all(&folder).unwrap();
    let gates: Vec<Settings<'_>> = docks.iter().map(|dock| dock.settings.gate()).collect();
    let mut gate = DockGate::new(&docks, &gates);
    let mut ms = 0;
    gate.ask(at(ms), "dock");
    assert!(drive(&mut gate, &docks, &mut ms).last().unwrap().0);
    let _ = gate.inhibit(at(ms), Reason::NotContained);
    for name in ["see-t7", "", "dock"] {
        gate.ask(at(ms), name);
    }
    assert!(
        drive(&mut gate, &docks, &mut ms)
            .iter()
            .all(|(permits, ..)| !permits)
    );
    Decider::reset(&mut gate, at(ms)).unwrap();
    assert!(drive(&mut gate, &docks, &mut ms).last().unwrap().0);
}

#[test]
fn folders_that_are_not_a_built_site_are_refused() {
    let folder = built("refused");
    let refused = |more: &str| read_with(&folder, more).unwrap_err().to_string();
    assert!(
        refused("--task-digest 00 --ros-args").contains("--task-digest is given with a folder")
    );
    assert!(refused("--ros-args -p task:=dock").contains("the parameter `task`"));
    fs::write(folder.join("tables/dock.posegate"), TABLES[1].1).unwrap();
    assert!(refused("--ros-args").contains("is not the one that manifest.json lists"));
    fs::write(folder.join("tables/dock.posegate"), b"no table").unwrap();
    assert!(refused("--ros-args").contains("is not a table"));
    fs::remove_file(folder.join(MANIFEST)).unwrap();
    assert!(refused("--ros-args").contains("posegate site merge"));
    fs::remove_dir_all(&folder).unwrap();
}
