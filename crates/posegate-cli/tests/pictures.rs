//! `posegate draw` and `posegate check --draw`: the pictures in the pages are those that the program draws. A picture that
//! cannot be drawn is refused with advice.

use posegate_testkit::root;
use posegate_testkit::run::{Case, Ended, run};

const SITE: &str = "examples/sites/loading-bay.toml";

/// Runs a line in the repository's folder.
fn posegate(line: &str) -> Ended {
    run(&root(), line)
}

/// Builds the table of a task in a folder. Returns its path.
fn table(folder: &Case, task: &str) -> String {
    let table = path(folder, &format!("{task}.posegate"));
    posegate(&format!("table build {SITE} --task {task} -o {table}")).with(0);
    table
}

fn path(folder: &Case, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

#[test]
fn committed_pictures_equal_the_drawn_ones() {
    let folder = Case::new(&[]);
    let table = table(&folder, "enter-bay");
    for (name, arguments) in [
        (
            "enter-bay-sections.svg",
            format!("--task enter-bay --table {table}"),
        ),
        ("see-bay-plan.svg", "--task see-bay --kind plan".into()),
    ] {
        let picture = posegate(&format!("draw {SITE} -o - {arguments} --expected"));
        let picture = picture.with(0).out.into_bytes();
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
    let folder = Case::new(&[]);
    let site = "examples/sites/paper-chain.toml";
    let picture = path(&folder, "plan.svg");
    posegate(&format!(
        "plan {site} --from back-to-dock --to dock -o {picture}"
    ))
    .with(0);
    assert!(
        folder.read("plan.svg") == std::fs::read(root().join("docs/plan.svg")).unwrap(),
        "docs/plan.svg is not what the program draws: look at `./ci.sh figures DIR`, and copy it"
    );
}

#[test]
fn undrawable_picture_is_refused_with_advice() {
    let folder = Case::new(&[]);
    let table = table(&folder, "see-bay");
    let dock = "examples/sites/dock.toml";
    let none = "tests/data/estimates.csv";
    for (arguments, words) in [
        (
            format!("{SITE} --task enter-bay --table {table}"),
            "it is a table of the task `see-bay`",
        ),
        (
            format!("{dock} --task dock --table examples/tables/see-t7.posegate"),
            "it is a table of the task `see-t7`",
        ),
        (
            format!("{SITE} --task see-bay --table {none}"),
            "this version cannot read the table: ",
        ),
        (
            format!("{SITE} --task enter-bay --kind image"),
            "has no camera",
        ),
        (format!("{SITE} --task no-such --kind plan"), "no-such"),
        (format!("{dock} --task dock --expected"), "no `expected`"),
    ] {
        posegate(&format!("draw {arguments} -o -")).is_refused_with(&[words]);
    }
    // A table of this task from before its success set changed. A comment changes nothing.
    let text = std::fs::read_to_string(root().join(SITE)).unwrap();
    for (newer, code) in [
        (format!("# newer\n{text}"), 0),
        (text.replace("d_max = 4.8", "d_max = 4.7"), 2),
    ] {
        assert_ne!(newer, text);
        folder.write("newer.toml", newer);
        let file = path(&folder, "newer.toml");
        posegate(&format!("draw {file} --task see-bay --table {table} -o -")).with(code);
    }
}

#[test]
fn estimates_with_pose_sets_are_drawn() {
    let folder = Case::new(&[]);
    let header = "x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n";
    let good = "0.1,0.0,0.0,0.0004,0.0,0.0,0.0004,0.0,0.0001\n";
    let bad = "0.1,0.0,0.0,-1.0,0.0,0.0,0.0004,0.0,0.0001\n";
    let path = path(&folder, "estimates.csv");
    folder.write("estimates.csv", format!("{header}{good}{bad}{good}"));
    let draw = format!("draw {SITE} --task see-bay --estimates {path} -o -");
    let text = posegate(&draw).with(0).out;
    assert!(text.contains("2 of 2 pose-sets are inside"));
    assert!(text.contains("1 more estimates are not drawn"));
    folder.write("estimates.csv", format!("{header}{bad}"));
    posegate(&draw).with(2);
}

#[test]
fn check_draws_a_site_and_warns_of_a_turned_tag() {
    let folder = Case::new(&[]);
    let out = path(&folder, "out/side");
    let text = posegate(&format!("check {SITE} --draw {out}")).with(0).out;
    assert!(text.contains("no warnings"), "{text}");
    let seen = "see-bay by front: seen, slack +";
    assert!(text.contains(seen), "{text}");
    let plain = posegate(&format!("check {SITE}")).with(0).out;
    assert!(!plain.contains(seen), "{plain}");
    let mut files: Vec<String> = std::fs::read_dir(&out)
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
    folder.write(
        "turned.toml",
        dock.replace("yaw_deg = 180.0 }", "yaw_deg = 0.0 }"),
    );
    let line = format!("check {} --draw {out}", path(&folder, "turned.toml"));
    let text = posegate(&line).with(0).out;
    assert!(text.contains("tag t7 (tag_faces_away)"), "{text}");
    assert!(text.contains("not seen, slack"), "{text}");
    assert!(
        text.contains("task see-t7: its goal is NOT in its set"),
        "{text}"
    );

    let facts = posegate(&format!("{line} --json")).json(0);
    let codes: Vec<&str> = facts["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|warning| warning["code"].as_str().unwrap())
        .collect();
    assert_eq!(codes, ["tag_faces_away", "set_empty"]);
    assert_eq!(facts["pictures"].as_array().unwrap().len(), 3);
}
