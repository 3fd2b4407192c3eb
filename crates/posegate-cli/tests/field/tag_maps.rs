//! Maps of tags: field layouts of any year, and Limelight's.

use posegate_testkit::run::{Case, cases};
use serde_json::{Value, json};

fn layout(tags: &str, field: &str) -> String {
    format!(
        r#"{{"name": "a", "program": "frc", "{field}": {{"width": 6.0, "length": 12.0}},
 "{tags}": [{{"ID": 11, "pose": {{"rotation": {{"quaternion": {{"W": 0.5, "X": 0.0, "Y": 0.0, "Z": 0.8660254037844386}}}},
  "translation": {{"x": 3.5, "y": 5.9, "z": 0.8}}}}}}]}}"#
    )
}

fn import(text: &str, arguments: &str) -> Value {
    let case = Case::new(&[("map", text.as_bytes())]);
    case.run(&format!("import map --json {arguments}")).json(0)
}

#[test]
fn layouts_of_any_year_are_equal() {
    let arguments = "--format wpilib --size 0.2 --family tag36h11";
    let now = import(&layout("field-tags", "field-dimensions"), arguments);
    let tag = &now["tags"][0];
    assert_eq!((&tag["name"], &tag["id"]), (&json!("t11"), &json!(11)));
    assert_eq!(
        tag["pose"],
        json!({"x": 3.5, "y": 5.9, "z": 0.8, "roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 120.0})
    );
    assert_eq!(import(&layout("tags", "field"), arguments), now);
    let far = layout("field-tags", "field-dimensions").replace("3.5", "3500");
    let case = Case::new(&[("map", far.as_bytes())]);
    case.run(&format!("import map {arguments}"))
        .is_refused_with(&["map:3", "far outside the field of 12 m x 6 m"]);
}

#[test]
fn limelight_map_is_read_with_its_own_sizes() {
    let map = r#"{"type":"frc","fiducials":[{"family":"apriltag3_16h5_classic","id":4,"size":152.4,
        "transform":[0,-1,0,-2.5, 1,0,0,1.25, 0,0,1,0.6, 0,0,0,1],"unique":1}]}"#;
    let found = import(map, "--format fmap");
    let pose =
        json!({"x": -2.5, "y": 1.25, "z": 0.6, "roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 90.0});
    assert_eq!(
        found["tags"],
        json!([{"name": "t4", "id": 4, "family": "tag16h5", "size": 0.1524, "pose": pose}])
    );
    assert!(
        found["remarks"][0]
            .as_str()
            .expect("a remark")
            .contains("middle of the field")
    );
    // With WPILib's origin.
    let moved = import(map, "--format fmap --pose x=8,y=4");
    assert_eq!(moved["tags"][0]["pose"]["x"], 5.5);
    for (written, family) in [
        ("standard41h12", "tagStandard41h12"),
        ("apriltag3_circle49h12_classic", "tagCircle49h12"),
        ("tag36h11", "tag36h11"),
    ] {
        let named = map.replace("apriltag3_16h5_classic", written);
        assert_eq!(import(&named, "--format fmap")["tags"][0]["family"], family);
    }
    for [from, to, words] in cases(
        "
        apriltag3_16h5_classic => aruco_4x4 => `fiducials[0].family` is not a known family
        152.4 => 0.1524 => millimetres
        0,-1,0,-2.5 => 0,-2,0,-2.5 => has no rotation
        0,0,0,1] => 0,0,0,2] => last row
        0,0,0,1] => 0,0,0] => 16 numbers
        \"fiducials\" => \"tags\" => `fiducials` is missing
        ",
    ) {
        let case = Case::new(&[("map", map.replace(from, to).as_bytes())]);
        case.run("import map --format fmap")
            .is_refused_with(&["map:", words]);
    }
}

#[test]
fn layout_in_inches_is_a_remark() {
    let inches = layout("tags", "field")
        .replace("12.0", "651.0")
        .replace("6.0", "323.0")
        .replace("3.5", "600.0");
    let found = import(&inches, "--format wpilib --size 0.2 --family 36h11");
    let words = found["remarks"][0].as_str().expect("a remark");
    assert!(words.contains("`t11` is 600 m from the origin"), "{words}");
    // The name without its beginning is that of the known family.
    assert_eq!(found["tags"][0]["family"], "tag36h11");
}
