//! `posegate draw` and `posegate check --draw`: the pictures in the pages are those that the program draws. A picture that
//! cannot be drawn is refused with advice.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const SITE: &str = "examples/sites/loading-bay.toml";

fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// Runs the program in the repository's folder.
fn posegate(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_posegate"))
        .args(arguments)
        .current_dir(root())
        .output()
        .unwrap()
}

fn done(arguments: &[&str]) -> Vec<u8> {
    let output = posegate(arguments);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {words}");
    output.stdout
}

fn table(folder: &Path, task: &str) -> String {
    let table = folder.join(format!("{task}.posegate"));
    let table = table.to_str().unwrap().to_owned();
    done(&["table", "build", SITE, "--task", task, "-o", &table]);
    table
}

#[test]
fn committed_pictures_equal_the_drawn_ones() {
    let folder = tempfile::tempdir().unwrap();
    let table = table(folder.path(), "enter-bay");
    let sections = ["--task", "enter-bay", "--table", &table, "--expected"];
    let plan = ["--task", "see-bay", "--kind", "plan", "--expected"];
    for (name, arguments) in [
        ("enter-bay-sections.svg", sections.as_slice()),
        ("see-bay-plan.svg", plan.as_slice()),
    ] {
        let picture = done(&[&["draw", SITE, "-o", "-"], arguments].concat());
        let committed = std::fs::read(root().join("docs").join(name)).unwrap();
        assert!(
            picture == committed,
            "docs/{name} is not what the program draws: look at `./ci.sh figures DIR`, and copy it"
        );
        let page = std::fs::read_to_string(root().join("docs/host.md")).unwrap();
        assert!(page.contains(&format!("]({name})")), "{name}");
    }
}

#[test]
fn committed_plan_equals_the_drawn_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plan.svg");
    let site = "examples/sites/paper-chain.toml";
    let plan = ["plan", site, "--from", "back-to-dock", "--to", "dock", "-o"];
    done(&[plan.as_slice(), &[path.to_str().unwrap()]].concat());
    assert!(
        std::fs::read(&path).unwrap() == std::fs::read(root().join("docs/plan.svg")).unwrap(),
        "docs/plan.svg is not what the program draws: look at `./ci.sh figures DIR`, and copy it"
    );
}

#[test]
fn undrawable_picture_is_refused_with_advice() {
    let folder = tempfile::tempdir().unwrap();
    let table = table(folder.path(), "see-bay");
    let dock = "examples/sites/dock.toml";
    let none = "tests/data/estimates.csv";
    for (arguments, words) in [
        (
            ["draw", SITE, "--task", "enter-bay", "--table", &table],
            "it is a table of the task `see-bay`",
        ),
        (
            [
                "draw",
                dock,
                "--task",
                "dock",
                "--table",
                "examples/tables/see-t7.posegate",
            ],
            "it is a table of the task `see-t7`",
        ),
        (
            ["draw", SITE, "--task", "see-bay", "--table", none],
            "this version cannot read the table: ",
        ),
        (
            ["draw", SITE, "--task", "enter-bay", "--kind", "image"],
            "has no camera",
        ),
        (
            ["draw", SITE, "--task", "no-such", "--kind", "plan"],
            "no-such",
        ),
    ] {
        let output = posegate(&[arguments.as_slice(), &["-o", "-"]].concat());
        let error = String::from_utf8_lossy(&output.stderr).replace("\n  │ ", " ");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(error.contains(words), "{arguments:?}: {error}");
        assert!(output.stdout.is_empty());
    }
    let expected = posegate(&["draw", dock, "--task", "dock", "--expected", "-o", "-"]);
    assert_eq!(expected.status.code(), Some(2));
    let error = String::from_utf8_lossy(&expected.stderr).into_owned();
    assert!(error.contains("no `expected`"), "{error}");
    // A table of this task from before its success set changed. A comment changes nothing.
    let text = std::fs::read_to_string(root().join(SITE)).unwrap();
    for (newer, code) in [
        (format!("# newer\n{text}"), 0),
        (text.replace("d_max = 4.8", "d_max = 4.7"), 2),
    ] {
        assert_ne!(newer, text);
        let file = folder.path().join("newer.toml");
        std::fs::write(&file, newer).unwrap();
        let file = file.to_str().unwrap();
        let output = posegate(&[
            "draw", file, "--task", "see-bay", "--table", &table, "-o", "-",
        ]);
        assert_eq!(output.status.code(), Some(code));
    }
}

#[test]
fn estimates_with_pose_sets_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("estimates.csv");
    let header = "x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n";
    let good = "0.1,0.0,0.0,0.0004,0.0,0.0,0.0004,0.0,0.0001\n";
    let bad = "0.1,0.0,0.0,-1.0,0.0,0.0,0.0004,0.0,0.0001\n";
    let path = file.to_str().unwrap();
    std::fs::write(&file, format!("{header}{good}{bad}{good}")).unwrap();
    let draw = [
        "draw",
        SITE,
        "--task",
        "see-bay",
        "--estimates",
        path,
        "-o",
        "-",
    ];
    let text = String::from_utf8(done(&draw)).unwrap();
    assert!(text.contains("2 of 2 pose-sets are inside"));
    assert!(text.contains("1 more estimates are not drawn"));
    std::fs::write(&file, format!("{header}{bad}")).unwrap();
    assert_eq!(posegate(&draw).status.code(), Some(2));
}

#[test]
fn check_draws_a_site_and_warns_of_a_turned_tag() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out/side");
    let out = out.to_str().unwrap();
    let text = String::from_utf8(done(&["check", SITE, "--draw", out])).unwrap();
    assert!(text.contains("no warnings"), "{text}");
    let seen = "see-bay by front: seen, slack +";
    assert!(text.contains(seen), "{text}");
    let plain = String::from_utf8(done(&["check", SITE])).unwrap();
    assert!(!plain.contains(seen), "{plain}");
    let mut files: Vec<String> = std::fs::read_dir(out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(
        files,
        [
            "camera-front.svg",
            "site.svg",
            "tag-left.svg",
            "tag-right.svg"
        ]
    );

    let dock = std::fs::read_to_string(root().join("examples/sites/dock.toml")).unwrap();
    let turned = folder.path().join("turned.toml");
    std::fs::write(
        &turned,
        dock.replace("yaw_deg = 180.0 }", "yaw_deg = 0.0 }"),
    )
    .unwrap();
    let arguments = ["check", turned.to_str().unwrap(), "--draw", out];
    let text = String::from_utf8(done(&arguments)).unwrap();
    assert!(text.contains("tag t7 (tag_faces_away)"), "{text}");
    assert!(text.contains("not seen, slack"), "{text}");
    assert!(
        text.contains("task see-t7: its goal is NOT in its set"),
        "{text}"
    );

    let json = done(&[arguments.as_slice(), &["--json"]].concat());
    let facts: Value = serde_json::from_slice(&json).unwrap();
    let codes: Vec<&str> = facts["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|warning| warning["code"].as_str().unwrap())
        .collect();
    assert_eq!(codes, ["tag_faces_away", "set_empty"]);
    assert_eq!(facts["pictures"].as_array().unwrap().len(), 3);
}
