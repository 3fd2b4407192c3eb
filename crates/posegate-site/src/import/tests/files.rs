//! Faulty import files: positions and texts of the errors.

use super::{BUNDLES, DOCKS, FIELD, TABLES, WALL, bundle, docks, fault, wpilib};
use crate::import::{Format, Import};
use posegate::shape::Pose3Deg;

/// Rows of: text to replace => replacement => text at which the error points => part of its message =>
/// part of its help; `\n` is a new line, `\t` a tab, `-` nothing, `^` the file's start.
fn check(order: &Import, file: &str, rows: &[&str]) {
    for row in rows {
        let cells: Vec<String> = row
            .split(" => ")
            .map(|cell| if cell == "-" { "" } else { cell })
            .map(|cell| cell.replace("\\n", "\n").replace("\\t", "\t"))
            .collect();
        let [from, to, at, message, help] = cells.as_slice() else {
            panic!("{row}: {cells:?}");
        };
        assert!(file.contains(from.as_str()), "{row}");
        let text = file.replacen(from.as_str(), to, 1);
        let error = fault(order, &text);
        let place = error.at.expect("a place");
        let offset = if at == "^" {
            0
        } else {
            text.find(at.as_str()).expect("the place is in the text")
        };
        assert_eq!(place.offset, offset, "{row}: {error}");
        let line = 1 + text[..offset].matches('\n').count();
        assert_eq!(place.line, line, "{row}: {error}");
        assert!(error.message.contains(message.as_str()), "{row}: {error}");
        assert!(error.expected.is_some(), "{row}: {error}");
        let advice = error.help.as_deref().expect("help");
        assert!(advice.contains(help.as_str()), "{row}: {error}");
    }
}

#[test]
fn errors_in_field_layouts_point_at_the_fault() {
    let rows = [
        r#""Z": 1.0 => "Z": 0.9 => { "W": 0.0, "X": 0.0, "Y": 0.0, "Z": 0.9 => has length 0.9000 => W is the cosine"#,
        r#""Z": 1.0 => "Z": 0.0 => { "W": 0.0, "X": 0.0, "Y": 0.0, "Z": 0.0 => has length 0.0000 => all digits"#,
        r#""ID": 12 => "ID": 3 => 3, "pose": { "translation": { "x": 0.25 => tag 3 is there twice, first in line 3 => remove one"#,
        r#""ID": 12 => "id": 12 => { "id": 12 => `ID` is missing from `tags[1]`, which has `id`, `pose` => write it like { "ID": 7"#,
        r#""ID": 12 => "ID": 1.5 => 1.5, "pose" => `tags[1].ID` is 1.5 => write it like 7"#,
        r#""ID": 12 => "ID": -1 => -1, "pose" => `tags[1].ID` is -1 => 7"#,
        r#""x": 4.0 => "x": NaN => NaN => not valid JSON => no NaN"#,
        r#""x": 4.0 => "x": "4.0" => "4.0" => is a text in quotes => without quotes"#,
        r#""x": 4.0 => "x": 1e999 => 1e999 => `tags[0].pose.translation.x` is 1e999 => 4.25"#,
        r#""x": 4.0 => "x": null => null => `tags[0].pose.translation.x` is null => 4.25"#,
        r#""x": 4.0 => "x": 160.0 => 160.0 => far outside the field of 16.5 m x 8 m => to metres"#,
        r#""x": 4.0 => "x": 4.0, "x": 4.1 => 4.1 => x` is there twice => remove"#,
        r#""translation": { "x": 4.0, "y": 1.5, "z": 0.5 } => "translation": [4.0, 1.5, 0.5] => [4.0 => is a list => { "x": 4.0"#,
        r#", "Z": 1.0 => - => { "W": 0.0, "X": 0.0, "Y": 0.0 } => `Z` is missing from `tags[0].pose.rotation.quaternion` => { "W""#,
        r#""tags" => "fiducials" => { => `tags` is missing from the file, which has `fiducials`, `field` => WPILib"#,
        r#"} } } }\n  ], => } } } },\n  ], => ], => not valid JSON: expected value => none at the end"#,
        r#""length": 16.5 => "length": "54 ft" => "54 ft" => `field.length` is a text => 4.25"#,
    ];
    check(&wpilib(), FIELD, &rows);
    let none = fault(&wpilib(), "{\"tags\": []}");
    assert!(none.message.contains("no tag"), "{none}");
    let cut = fault(&wpilib(), &FIELD[..200]);
    assert!(cut.message.contains("EOF") && cut.at.is_some(), "{cut}");
}

#[test]
fn errors_in_bundles_point_at_the_fault() {
    let rows = [
        "z: 0.05 => z: 0.05, qw: 0.7, qz: 0.7 => {id: 11 => the quaternion of tag 11 (qw 0.7, qx 0, qy 0, qz 0.7) has length 0.9899 => all digits",
        "z: 0.05 => z: 0.05, qW: 0.7 => qW => unknown key `qW` => qw: 1",
        "z: 0.05 => z: .nan => .nan => z of tag 11 is NaN => measure",
        "z: 0.05 => z: 5cm => 5cm => found `5cm` => numbers plainly",
        "size: 0.15, => - => {id: 11 => `size` is missing => size: 0.1",
        "size: 0.15 => size: 150 => 150 => the size of tag 11 is 150 => 165 mm are 0.165",
        "size: 0.15 => size: -0.15 => -0.15 => the size of tag 11 is -0.15 => metres",
        "size: 0.15 => size: .nan => .nan => the size of tag 11 is NaN => metres",
        "id: 11 => id: 10 => 10, size: 0.15 => tag 10 is there twice, first in line 7 => remove one",
        "id: 11 => id: 1.5 => 1.5 => found `1.5` => ids as whole numbers",
        "      - {id: 11 => \\t- {id: 11 => \\t => indented by a tab => expand FILE",
        "- layout => - name: dock\\n    layout => ^ => has `dock` several times => rename",
        "name: dock => name: docks => ^ => no bundle and no tag `dock` => FILE#NAME",
        "tag_bundles => bundles => ^ => no bundle and no tag `dock` => FILE#NAME",
        "layout:\\n      - {id: 10, size: 0.1, x: 0, y: 0, z: 0, qw: 1, qx: 0, qy: 0, qz: 0}\\n      - {id: 11, size: 0.15, x: 0.2, y: 0.1, z: 0.05} => layout: [] => ^ => no tag => export",
    ];
    check(&bundle("dock"), BUNDLES, &rows);
    let error = fault(&bundle("dock"), &BUNDLES.replacen("    layout:\n", "", 1));
    assert!(
        error.at.is_some_and(|at| at.line > 4) && error.help.is_some(),
        "{error}"
    );
    let several = fault(&bundle(""), BUNDLES);
    assert!(
        several
            .message
            .contains("`dock`, `bundle_1`, `desk`, `tag_9`"),
        "{several}"
    );
    let params = "/**:\n  ros__parameters:\n    tag: {ids: [1]}\n";
    let error = fault(&bundle(""), params);
    assert!(error.message.contains("neither"), "{error}");
}

#[test]
fn errors_in_docks_point_at_the_fault() {
    let rows = [
        "1.5] => 90] => 90] => the heading of dock `home` is 90 radians => 1.5708",
        "1.5] => .inf] => .inf => docks.home.pose[2] is inf => measure",
        ", 1.5] => ] => [1.0, 2.0] => docks.home.pose has 2 numbers => there is no z",
        ", 1.5] => , 0.0, 1.5] => [1.0 => docks.home.pose has 4 numbers => metres, metres, radians",
        "[1.0, 2.0, 1.5] => \"1 2 0\" => \"1 => found `\"1 2 0\"` => write",
        "frame: map => frame: odom => odom => the dock `home` is in the frame `odom`, another one in `map` => --frame NAME",
        "type: \"charger\",  => - => {frame => `docks.home.type` is missing => docks:",
        "    pose: [-3.5, 0.25, -3.0]\\n => - => type: conveyor => `docks.dock-3.pose` is missing => docks:",
        "docks: => dock: => ^ => the file has no `docks` => dock_database",
        "    type: conveyor => \\ttype: conveyor => \\t => indented by a tab => expand",
    ];
    check(&docks(), DOCKS, &rows);
    let twice = fault(&docks(), &DOCKS.replace("dock-3", "home"));
    assert!(
        twice
            .message
            .contains("`home` is there twice, first in line 2")
            && twice.at.is_some_and(|at| at.line == 3),
        "{twice}"
    );
    let long = DOCKS.replace("dock-3", "the-dock-at-the-end-of-the-long-hall");
    assert!(fault(&docks(), &long).message.contains("longer than 32"));
    let placed = Import {
        pose: Some(Pose3Deg { z: 0.0, ..WALL }),
        ..docks()
    };
    let mixed = fault(&placed, &DOCKS.replace("frame: map", "frame: hall"));
    assert!(mixed.message.contains("another one in"), "{mixed}");
}

#[test]
fn errors_in_tables_point_at_the_fault() {
    let rows = [
        "size = 0.2 => size = 0 => 0\\npose => `tag.wall.size` is 0 => size = 0.30",
        "yaw_deg = 90.0 => yaw = 1.57 => yaw = => unknown key `yaw` => in degrees",
        "[goal.home] => [chain.home] => chain => unknown key `chain` => remove it",
        "[goal.home] => [goal.\"\"] => \"\" => is empty => choose",
        "id = 5 => id = seven => seven => not valid TOML => quotes",
        "x = 1.0 => x = nan => nan => not a finite number => x = ",
    ];
    check(&Import::of(Format::Posegate), TABLES, &rows);
    let none = fault(&Import::of(Format::Posegate), "");
    assert!(none.message.contains("no tag and no goal"), "{none}");
}
