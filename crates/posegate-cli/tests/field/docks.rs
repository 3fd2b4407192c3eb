//! Docks of Nav2: databases, and the parameters of the docking server.

use posegate_testkit::run::{Case, cases};
use serde_json::{Value, json};

const DATABASE: &str = "docks:\n  a: {type: t, frame: map, pose: [1.0, 2.0, 1.0]}\n";
const PARAMETERS: &str = "/**:
  docking_server:
    ros__parameters:
      dock_plugins: [\"charger\", \"shelf\"]
      charger:
        plugin: \"opennav_docking::SimpleChargingDock\"
        docking_threshold: 0.03
        staging_x_offset: -0.5
        staging_yaw_offset: 3.14159265358979
        use_external_detection_pose: true
        external_detection_translation_x: -0.18
        dock_direction: \"backward\"
      shelf.plugin: \"opennav_docking::SimpleNonChargingDock\"
      docks: [\"home\", \"01\"]
      home:
        type: \"charger\"
        frame: map
        pose: [2.0, 1.0, 0.0]
      \"01\": {type: shelf, frame: map, pose: [0.5, 0.25, -1.5], id: 007}
";

fn import(text: &str, arguments: &str) -> Value {
    let case = Case::new(&[("d.yaml", text.as_bytes())]);
    case.run(&format!(
        "import d.yaml --format nav2_docks --json {arguments}"
    ))
    .json(0)
}

fn refused(text: &str, arguments: &str, words: &[&str]) {
    let case = Case::new(&[("d.yaml", text.as_bytes())]);
    case.run(&format!("import d.yaml --format nav2_docks {arguments}"))
        .is_refused_with(words);
}

fn has_remark(imported: &Value, words: &str) -> bool {
    let remarks = imported["remarks"].as_array().expect("remarks");
    remarks
        .iter()
        .any(|remark| remark.as_str().expect("a text").contains(words))
}

#[test]
fn direction_is_asked_for_and_turns_the_heading() {
    let degrees = 1f64.to_degrees();
    let near = |imported: &Value, yaw_deg: f64| {
        let found = imported["goals"][0]["yaw_deg"].as_f64().expect("a heading");
        assert!((found - yaw_deg).abs() < 1e-6, "{found} {yaw_deg}");
    };
    let unsaid = import(DATABASE, "");
    near(&unsaid, degrees);
    assert!(has_remark(&unsaid, "--dock-direction backward"), "{unsaid}");
    let backward = import(DATABASE, "--dock-direction backward");
    near(&backward, degrees - 180.0);
    let forward = import(DATABASE, "--dock-direction forward");
    near(&forward, degrees);
    for said in [backward, forward] {
        assert_eq!(said["remarks"], json!([]));
    }
    // On paper too.
    let case = Case::new(&[("d.yaml", DATABASE.as_bytes())]);
    let ended = case.run("import d.yaml --format nav2_docks");
    assert!(
        ended.out.contains("# Remark: ") && ended.words().contains("--dock-direction"),
        "{}",
        ended.out
    );
}

#[test]
fn parameters_give_goals_tasks_and_remarks() {
    let found = import(PARAMETERS, "");
    assert_eq!(
        found["goals"],
        json!([
            {"name": "01", "x": 0.5, "y": 0.25, "yaw_deg": -85.943669270},
            {"name": "home", "x": 2.0, "y": 1.0, "yaw_deg": 180.0},
        ])
    );
    assert_eq!(
        found["tasks"],
        json!([{"name": "home", "goal": "home", "radius": 0.03}])
    );
    for words in [
        "`home` backward",
        "staging pose of `home` is x = 1.5, y = 1, yaw_deg = 180",
        "offset of (-0.18 m, 0 m)",
        "enters `01`",
    ] {
        assert!(has_remark(&found, words), "{words}: {found:#}");
    }
    refused(
        PARAMETERS,
        "--dock-direction forward",
        &["d.yaml:12", "backward, and the import says forward"],
    );
    // The tables are those of a site.
    let case = Case::new(&[("d.yaml", PARAMETERS.as_bytes())]);
    let written = case.run("import d.yaml --format nav2_docks -o site.toml");
    written.with(0);
    let built = case.run("table build site.toml --task home -o home.posegate");
    built.with(0);
    // The server's old key, with dots, and the namespace of a robot.
    let old = "robot1:\n  docking_server:\n    ros__parameters:\n      dock_backwards: true\n      docks: [x]\n      x.pose: [1.0, 0.0, 0.0]\n";
    let old = import(old, "");
    assert_eq!(
        old["goals"],
        json!([{"name": "x", "x": 1.0, "y": 0.0, "yaw_deg": 180.0}])
    );
}

#[test]
fn docks_of_several_frames_are_read_one_frame_at_a_time() {
    let two = "docks:\n  a: {type: t, frame: map, pose: [1, 2, 0]}\n  b: {type: t, frame: /hall2/map, pose: [3, 4, 0]}\n  c: {type: t, pose: [5, 6, 0]}\n";
    refused(two, "", &["--frame NAME", "hall2/map", "map"]);
    let names = |imported: &Value| -> Vec<String> {
        let goals = imported["goals"].as_array().expect("goals");
        goals
            .iter()
            .map(|goal| goal["name"].as_str().expect("a name").into())
            .collect()
    };
    let found = import(two, "--frame map");
    assert_eq!(names(&found), ["a", "c"]);
    assert!(has_remark(&found, "1 docks of other frames are not read"));
    let found = import(two, "--frame hall2/map");
    assert_eq!(names(&found), ["b"]);
    assert!(has_remark(
        &found,
        "`hall2/map` of the docks is taken as the site's world"
    ));
    refused(
        two,
        "--frame odom",
        &["no dock is in the frame `odom`", "hall2/map"],
    );
    let odom = "docks:\n  a: {type: t, frame: odom, pose: [1, 2, 0]}\n";
    refused(odom, "", &["the frame `odom`", "--frame odom"]);
    assert_eq!(names(&import(odom, "--frame odom")), ["a"]);
    let namespaced = "docks:\n  a: {type: t, frame: robot1/map, pose: [1, 2, 0]}\n";
    assert!(has_remark(&import(namespaced, ""), "`robot1/map`"));
}

/// Old versions of Nav2 use the server's key, new ones the plugin's.
#[test]
fn directions_that_differ_are_refused() {
    let with = |value: &str| {
        PARAMETERS.replace(
            "      dock_plugins",
            &format!("      dock_backwards: {value}\n      dock_plugins"),
        )
    };
    refused(
        &with("false"),
        "",
        &[
            "d.yaml:4",
            "dock_backwards says forward",
            "remove dock_backwards",
        ],
    );
    let heading = |text: &str| import(text, "")["goals"][1]["yaw_deg"].clone();
    assert_eq!(heading(&with("true")), 180.0);
    // In any case, as Nav2 reads it.
    assert_eq!(
        heading(&PARAMETERS.replace("\"backward\"", "BACKWARD")),
        180.0
    );
}

#[test]
fn faults_of_parameters_are_named() {
    for [from, to, words] in cases(
        "
        docking_threshold: 0.03 => docking_threshold: 0 => docking_threshold is 0
        \"backward\" => \"back\" => the dock direction is `back`
        pose: [2.0, 1.0, 0.0] => pose: [2.0, 1.0] => home.pose has 2 numbers
        docks: [\"home\", \"01\"] => docks: [\"homes\"] => `homes.pose` is missing
        docks: [\"home\", \"01\"] => dock_database: docks.yaml => no `docks`
        ",
    ) {
        let changed = PARAMETERS.replace(from, to);
        assert_ne!(changed, PARAMETERS, "{from}");
        refused(&changed, "", &["d.yaml", words]);
    }
}

/// Other units are not seen in a file, but their numbers are unlikely.
#[test]
fn unlikely_numbers_are_remarks() {
    let turned = import(&DATABASE.replace("2.0, 1.0]", "2.0, 5.0]"), "");
    assert!(has_remark(&turned, "5 radians, -73.5 degrees"), "{turned}");
    let far = import(&DATABASE.replace("1.0, 2.0", "1000.0, 2000.0"), "");
    assert!(has_remark(&far, "`a` is 2236 m from the origin"), "{far}");
    refused(
        &PARAMETERS.replace("threshold: 0.03", "threshold: 30"),
        "",
        &["d.yaml:7", "docking_threshold is 30", "for 50 mm"],
    );
    refused(
        &DATABASE.replace("docks:\n", ""),
        "",
        &["the file has no `docks`", "write `docks:` above"],
    );
}
