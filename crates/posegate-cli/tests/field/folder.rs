//! The right answers to a folder of files as people have them, by the number of each case. `ci.sh field DIR` names the folder in `POSEGATE_FIELD`.

use posegate_testkit::run::{Case, Ended};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Returns the case with this number, with its files in a folder of their own.
fn case(number: &str) -> Case {
    let folder = std::env::var("POSEGATE_FIELD")
        .expect("POSEGATE_FIELD names the folder of the cases: run `./ci.sh field DIR`");
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{folder}: {error}"));
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let is_wanted = |path: &PathBuf| {
        let name = path.file_name().map(|name| name.to_string_lossy());
        name.is_some_and(|name| name.starts_with(&format!("{number}-")))
    };
    let found = paths.filter(is_wanted).min();
    let found = found.unwrap_or_else(|| panic!("{folder} has no case {number}"));
    let files = std::fs::read_dir(&found).expect("the case");
    let files: Vec<(String, Vec<u8>)> = files
        .map(|file| file.expect("an entry").path())
        .filter(|path| path.is_file())
        .map(|path| (name_of(&path), std::fs::read(&path).expect("a file")))
        .collect();
    let borrowed: Vec<(&str, &[u8])> = files
        .iter()
        .map(|(name, bytes)| (name.as_str(), bytes.as_slice()))
        .collect();
    Case::new(&borrowed)
}

fn name_of(path: &Path) -> String {
    let name = path.file_name().expect("a name");
    name.to_string_lossy().into_owned()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

/// Decides on the estimates of a case with the table of a site.
fn gate(case: &Case, site: &str, arguments: &str, code: i32) -> Value {
    let built = case.run(&format!(
        "table build {site} --task dock -o {site}.posegate {arguments}"
    ));
    built.with(0);
    case.run(&format!(
        "gate {site}.posegate --estimates estimate.csv --json"
    ))
    .json(code)
}

fn import(number: &str, arguments: &str) -> (Value, Ended) {
    let case = case(number);
    let ended = case.run(&format!("import {arguments} --json"));
    (ended.json(0), ended)
}

#[test]
#[ignore = "needs a folder: ./ci.sh field DIR"]
fn worst_pose_is_outside_of_the_set() {
    let case = case("01");
    for layout in ["", "--layout grid"] {
        let verdict = gate(&case, "site.toml", layout, 1);
        let yaw = number(&verdict["worst_pose"][2]).to_degrees();
        assert!(yaw.abs() >= 4.0, "{verdict}");
    }
}

#[test]
#[ignore = "needs a folder: ./ci.sh field DIR"]
fn calibrations_are_read() {
    for number in ["02", "04", "09", "10"] {
        let checked = case(number).run("check site.toml");
        checked.with(0);
    }
    let checked = case("06").run("check site.toml --json").json(0);
    assert_eq!(
        checked["warnings"][0]["code"], "axis_off_centre",
        "{checked}"
    );
}

#[test]
#[ignore = "needs a folder: ./ci.sh field DIR"]
fn tags_and_docks_are_imported() {
    let (field, _) = import(
        "03",
        "field.json --format wpilib --size 0.1651 --family tag36h11",
    );
    let pose = &field["tags"][0]["pose"];
    let found = ["x", "y", "z", "yaw_deg"].map(|key| number(&pose[key]));
    for (found, right) in found.iter().zip([9.9, 2.0, 1.2, 180.0]) {
        assert!((found - right).abs() < 1e-9, "{pose}");
    }
    let (docks, _) = import("08", "params.yaml --format nav2_docks");
    let goal = &docks["goals"][0];
    // The file says that the robot docks backward.
    assert!(
        (number(&goal["yaw_deg"]) + 90.045_626).abs() < 1e-5,
        "{goal}"
    );
    let (docks, ended) = import("17", "docks.yaml --format nav2_docks");
    assert_eq!(docks["goals"][0]["yaw_deg"], 0.0);
    assert!(
        ended.words().contains("--dock-direction backward"),
        "{}",
        ended.words()
    );
    let backward = "docks.yaml --format nav2_docks --dock-direction backward";
    let (docks, _) = import("17", backward);
    assert_eq!(docks["goals"][0]["yaw_deg"], 180.0);
    let (map, _) = import("18", "map.fmap --format fmap");
    assert_eq!(map["tags"][0]["size"], 0.1651);
}

#[test]
#[ignore = "needs a folder: ./ci.sh field DIR"]
fn duplicate_time_is_counted() {
    let found = case("07")
        .run("metrics truth.txt estimate.txt --json")
        .json(0);
    assert_eq!(
        (&found["duplicates"], &found["pairs"]),
        (&1.into(), &3.into())
    );
}

#[test]
#[ignore = "needs a folder: ./ci.sh field DIR"]
fn far_origin_is_advised() {
    let case = case("13");
    case.run("check site.toml").is_refused_with(&["[origin]"]);
    let path = case.path().join("site.toml");
    let site = std::fs::read_to_string(&path).expect("the site");
    let origin = "[origin]\nx = 89571.0\ny = 43301.0\n";
    std::fs::write(&path, format!("{origin}{site}")).expect("the site");
    let checked = case.run("check site.toml");
    checked.with(0);
}

#[test]
#[ignore = "needs a folder: ./ci.sh field DIR"]
fn disc_denies_what_a_box_permits() {
    let case = case("16");
    assert_eq!(gate(&case, "site.toml", "", 1)["verdict"], "deny");
    assert_eq!(gate(&case, "box.toml", "", 0)["verdict"], "permit");
}
