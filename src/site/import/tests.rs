//! What is wrong with imported files, where it points and what it says; frames and names.

use std::string::{String, ToString};
use std::vec::Vec;
use std::{format, fs, vec};

use proptest::prelude::*;

use super::place::{Frame, Matrix, transposed};
use super::{Convention, Format, Import, ImportError, Imported};
use crate::shape::{Pose3Deg, PoseDeg, rotation};
use crate::site::{Site, SiteError};

const FIELD: &str = r#"{
  "tags": [
    { "ID": 3, "pose": { "translation": { "x": 4.0, "y": 1.5, "z": 0.5 },
      "rotation": { "quaternion": { "W": 0.0, "X": 0.0, "Y": 0.0, "Z": 1.0 } } } },
    { "ID": 12, "pose": { "translation": { "x": 0.25, "y": 2.5, "z": 1.25 },
      "rotation": { "quaternion": { "W": 1.0, "X": 0.0, "Y": 0.0, "Z": 0.0 } } } }
  ],
  "field": { "length": 16.5, "width": 8.0 }
}
"#;

const BUNDLES: &str = "standalone_tags:
  - {id: 1, size: 0.08, name: desk}
  - {id: 9, size: 0.25}
tag_bundles:
  - name: dock
    layout:
      - {id: 10, size: 0.1, x: 0, y: 0, z: 0, qw: 1, qx: 0, qy: 0, qz: 0}
      - {id: 11, size: 0.15, x: 0.2, y: 0.1, z: 0.05}
  - layout:
      - {id: 20, size: 0.2}
";

const DOCKS: &str = "docks:
  home: {type: \"charger\", frame: map, pose: [1.0, 2.0, 1.5]}
  dock-3:
    type: conveyor
    pose: [-3.5, 0.25, -3.0]
    id: \"kitchen\"
";

const TABLES: &str = "[tag.wall]
id = 5
family = \"tag36h11\"
size = 0.2
pose = { x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }
tolerance = { translation = 0.01, yaw_deg = 0.5 }
[goal.home]
x = 1.0
y = 2.0
yaw_deg = 90.0
";

const WALL: Pose3Deg = Pose3Deg {
    x: 4.0,
    y: 0.5,
    z: 0.75,
    roll_deg: 0.0,
    pitch_deg: 0.0,
    yaw_deg: 180.0,
};

fn wpilib() -> Import {
    Import {
        size: Some(0.1651),
        family: Some("tag36h11".into()),
        ..Import::of(Format::Wpilib)
    }
}

fn bundle(part: &str) -> Import {
    Import {
        convention: Some(Convention::AprilTagRos),
        family: Some("tag36h11".into()),
        pose: Some(WALL),
        part: (!part.is_empty()).then(|| part.into()),
        ..Import::of(Format::AprilTagRos)
    }
}

fn docks() -> Import {
    Import::of(Format::Nav2Docks)
}

fn read(order: &Import, text: &str) -> Imported {
    match order.parse(text, "map") {
        Ok(imported) => imported,
        Err(error) => panic!("{error}\n{text}"),
    }
}

fn fault(order: &Import, text: &str) -> SiteError {
    match order.parse(text, "map") {
        Ok(_) => panic!("no fault in:\n{text}"),
        Err(ImportError::File(error)) => error,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn each_format_is_read() {
    let field = read(&wpilib(), FIELD);
    let names: Vec<_> = field.tags.keys().map(String::as_str).collect();
    assert_eq!(names, ["t12", "t3"]);
    let t3 = &field.tags["t3"];
    assert_eq!((t3.tag.id, t3.tag.size), (3, 0.1651));
    assert_eq!(
        (t3.family.as_str(), t3.tag.pose.yaw_deg),
        ("tag36h11", 180.0)
    );
    assert_eq!(read(&wpilib(), &format!("\u{feff}{FIELD}")), field);

    let dock = read(&bundle("dock"), BUNDLES);
    assert_eq!(dock.tags["t10"].tag.pose, WALL);
    // A viewer's right is -y where the face looks along -x.
    let second = dock.tags["t11"].tag;
    assert_eq!(second.size, 0.15);
    assert_eq!(
        (second.pose.x, second.pose.y, second.pose.z),
        (3.95, 0.3, 0.85)
    );
    assert_eq!(
        read(&bundle("bundle_1"), BUNDLES).tags["t20"].tag.pose,
        WALL
    );
    let desk = read(&bundle("desk"), BUNDLES);
    assert_eq!((desk.tags.len(), desk.tags["t1"].tag.size), (1, 0.08));
    assert_eq!(read(&bundle("tag_9"), BUNDLES).tags["t9"].tag.pose, WALL);

    let goals = read(&docks(), DOCKS).goals;
    assert_eq!(goals["home"].x, 1.0);
    assert!((goals["dock-3"].yaw_deg - (-3.0_f64).to_degrees()).abs() < 1e-9);

    let own = read(&Import::of(Format::Posegate), TABLES);
    assert_eq!(own.tags["wall"].tolerance.turn_deg, 0.5);
    assert_eq!(own.goals["home"].yaw_deg, 90.0);
    assert_eq!(own.to_toml().replace("\n\n", "\n"), TABLES);
}

#[test]
fn prefixes_stand_before_names() {
    let named = |format, text: &str, prefix: &str| {
        let order = Import {
            prefix: Some(prefix.into()),
            ..format
        };
        let imported = read(&order, text);
        let all = imported.tags.into_keys().chain(imported.goals.into_keys());
        all.collect::<Vec<String>>()
    };
    assert_eq!(named(wpilib(), FIELD, ""), ["12", "3"]);
    assert_eq!(named(docks(), DOCKS, "a-"), ["a-dock-3", "a-home"]);
    assert_eq!(
        named(Import::of(Format::Posegate), TABLES, "b"),
        ["bwall", "bhome"]
    );
}

/// Rows of: what to replace => by what => the text at which the error points => a part of its message => a
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
        let told = error.help.as_deref().expect("help");
        assert!(told.contains(help.as_str()), "{row}: {error}");
    }
}

#[test]
fn bad_field_layouts_point_at_the_place() {
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
fn bad_bundles_point_at_the_place() {
    let rows = [
        "z: 0.05 => z: 0.05, qw: 0.7, qz: 0.7 => {id: 11 => the quaternion of tag 11 (qw 0.7, qx 0, qy 0, qz 0.7) has length 0.9899 => all digits",
        "z: 0.05 => z: 0.05, qW: 0.7 => qW => unknown field `qW` => qw: 1",
        "z: 0.05 => z: .nan => .nan => z of tag 11 is NaN => measure",
        "z: 0.05 => z: 5cm => 5cm => not read => numbers plainly",
        "size: 0.15, => - => {id: 11 => `size` is missing => size: 0.1",
        "size: 0.15 => size: 150 => 150 => the size of tag 11 is 150 => 165 mm are 0.165",
        "size: 0.15 => size: -0.15 => -0.15 => the size of tag 11 is -0.15 => metres",
        "size: 0.15 => size: .nan => .nan => the size of tag 11 is NaN => metres",
        "id: 11 => id: 10 => 10, size: 0.15 => tag 10 is there twice, first in line 7 => remove one",
        "id: 11 => id: 1.5 => 1.5 => not read => ids as whole numbers",
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
fn bad_docks_point_at_the_place() {
    let rows = [
        "1.5] => 90] => 90] => the heading of dock `home` is 90 radians => 1.5708",
        "1.5] => .inf] => .inf => docks.home.pose[2] is inf => measure",
        ", 1.5] => ] => [1.0, 2.0] => docks.home.pose has 2 numbers => there is no z",
        ", 1.5] => , 0.0, 1.5] => [1.0 => docks.home.pose has 4 numbers => metres, metres, radians",
        "[1.0, 2.0, 1.5] => \"1 2 0\" => \"1 => not read => write",
        "frame: map => frame: odom => odom => the dock `home` is in the frame `odom` => the `pose` of the frame `odom`",
        "type: \"charger\",  => - => {frame => `docks.home.type` is missing => docks:",
        "    pose: [-3.5, 0.25, -3.0]\\n => - => type: conveyor => `docks.dock-3.pose` is missing => docks:",
        "docks: => dock: => ^ => the file has no `docks` => dock_database",
        "    type: conveyor => \\ttype: conveyor => \\t => indented by a tab => expand",
    ];
    check(&docks(), DOCKS, &rows);
    let twice = fault(&docks(), &DOCKS.replace("dock-3", "home"));
    assert!(
        twice.message.contains("duplicate") && twice.at.is_some_and(|at| at.line == 3),
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
fn bad_tables_point_at_the_place() {
    let rows = [
        "size = 0.2 => size = 0 => 0\\npose => `tag.wall.size` is 0 => size = 0.30",
        "yaw_deg = 90.0 => yaw = 1.57 => yaw = => unknown key `yaw` => in degrees",
        "[goal.home] => [task.home] => task => unknown key `task` => remove it",
        "[goal.home] => [goal.\"\"] => \"\" => is empty => choose",
        "id = 5 => id = seven => seven => not valid TOML => quotes",
        "x = 1.0 => x = nan => nan => no finite number => x = ",
    ];
    check(&Import::of(Format::Posegate), TABLES, &rows);
    let none = fault(&Import::of(Format::Posegate), "");
    assert!(none.message.contains("no tag and no goal"), "{none}");
}

/// Settings that are missing, that a format does not have, and values that cannot be.
#[test]
fn settings_are_said_once() {
    let pose = Some(WALL);
    let own = || Import::of(Format::Posegate);
    let rows = vec![
        (
            "size",
            Import {
                size: None,
                ..wpilib()
            },
            FIELD,
            "`size` is missing",
        ),
        (
            "size",
            Import {
                size: Some(165.1),
                ..wpilib()
            },
            FIELD,
            "size is 165.1",
        ),
        (
            "size",
            Import {
                size: Some(f64::NAN),
                ..wpilib()
            },
            FIELD,
            "size is NaN",
        ),
        (
            "family",
            Import {
                family: None,
                ..wpilib()
            },
            FIELD,
            "`family` is missing",
        ),
        (
            "convention",
            Import {
                convention: Some(Convention::AprilTag),
                ..wpilib()
            },
            FIELD,
            "has its own",
        ),
        (
            "convention",
            Import {
                convention: None,
                ..bundle("dock")
            },
            BUNDLES,
            "`convention` is missing",
        ),
        (
            "pose",
            Import {
                pose: None,
                ..bundle("dock")
            },
            BUNDLES,
            "`pose` is missing",
        ),
        (
            "size",
            Import {
                size: Some(0.1),
                ..bundle("dock")
            },
            BUNDLES,
            "says it itself",
        ),
        (
            "family",
            Import {
                family: Some("a".into()),
                ..docks()
            },
            DOCKS,
            "no tags",
        ),
        ("pose", Import { pose, ..docks() }, DOCKS, "off the floor"),
        ("pose", Import { pose, ..own() }, TABLES, "off the floor"),
        (
            "size",
            Import {
                size: Some(0.1),
                ..own()
            },
            TABLES,
            "says it itself",
        ),
        (
            "convention",
            Import {
                convention: Some(Convention::OpenCv),
                ..own()
            },
            TABLES,
            "has its own",
        ),
        (
            "convention",
            Import {
                convention: Some(Convention::OpenCv),
                ..docks()
            },
            DOCKS,
            "no tags",
        ),
    ];
    for (wanted, order, text, part) in rows {
        match order.parse(text, "map") {
            Err(ImportError::Setting {
                key,
                message,
                expected,
                ..
            }) => {
                assert_eq!(key, wanted, "{message}");
                assert!(message.contains(part), "{message}; {part}");
                assert!(!expected.is_empty());
            }
            other => panic!("{wanted}, {part}: {other:?}"),
        }
    }
    let same = Import {
        convention: Some(Convention::Wpilib),
        ..wpilib()
    };
    assert_eq!(read(&same, FIELD), read(&wpilib(), FIELD));
    // What a missing convention can be is all said.
    let open = Import {
        convention: None,
        ..bundle("dock")
    };
    let told = open.parse(BUNDLES, "map").expect_err("open").to_string();
    for name in Convention::NAMES {
        assert!(told.contains(&format!("\"{name}\"")), "{told}");
        assert_eq!(Convention::named(name).map(Convention::name), Some(name));
    }
    for name in Format::NAMES {
        assert_eq!(Format::named(name).map(Format::name), Some(name));
    }
}

/// A site beside `field.json`, `tags.yaml` and `docks.yaml`.
fn site(text: &str) -> Result<Site, SiteError> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name);
    for (name, text) in [
        ("field.json", FIELD),
        ("tags.yaml", BUNDLES),
        ("docks.yaml", DOCKS),
        ("site.toml", text),
    ] {
        fs::write(file(name), text).expect("written");
    }
    fs::write(file("latin.json"), b"\xff").expect("written");
    Site::read(file("site.toml"))
}

const IMPORT: &str = "[import.field]
file = 'field.json'
format = 'wpilib'
size = 0.1651
family = 'tag36h11'
[import.docks]
file = 'docks.yaml'
format = 'nav2_docks'
[goal.gate]
x = 0
y = 1
yaw_deg = 2
[task.a]
kind = 'work'
goal = 'dock-3'
success = { shape = 'box', x = [0, 0], y = [-1, 1], yaw_deg = [0, 1] }
";

#[test]
fn sites_import() {
    let read = |text: &str| match site(text) {
        Ok(site) => site,
        Err(error) => panic!("{error}"),
    };
    let site = read(IMPORT);
    assert_eq!(site.tags.len(), 2);
    assert_eq!(site.tags["t3"].tag.id, 3);
    assert_eq!(site.goals.len(), 3);
    assert_eq!(site.tasks["a"].success.goal, site.goals["dock-3"]);
    assert_eq!(
        site.goals["gate"],
        PoseDeg {
            x: 0.0,
            y: 1.0,
            yaw_deg: 2.0
        }
    );
    let surveyed = IMPORT.replace(
        "[import.docks]",
        "tolerance = { translation = 0.02, yaw_deg = 1 }\n[import.docks]",
    );
    assert_eq!(read(&surveyed).tags["t12"].tolerance.translation, 0.02);
    let bundle = "[import.dock]
file = 'tags.yaml#dock'
format = 'apriltag_ros'
convention = 'apriltag_ros'
family = 'tag36h11'
prefix = 'dock-'
pose = { x = 4.0, y = 0.5, z = 0.75, roll_deg = 0, pitch_deg = 0, yaw_deg = 180 }
";
    let site = read(&format!("{IMPORT}{bundle}"));
    assert_eq!(site.tags["dock-10"].tag.pose, WALL);
}

#[test]
fn bad_imports_point_at_the_place() {
    let rows = [
        (
            "format = 'wpilib'",
            "format = 'wpilb'",
            "'wpilb'",
            "is 'wpilb'",
            "did you mean \"wpilib\"?",
        ),
        (
            "format = 'wpilib'",
            "",
            "[import.field]",
            "`format` is missing",
            "add `format",
        ),
        (
            "format = 'wpilib'",
            "format = 'yaml'",
            "'yaml'",
            "is 'yaml'",
            "write it like",
        ),
        (
            "size = 0.1651",
            "",
            "[import.field]",
            "`size` is missing",
            "write `size = 0.30`",
        ),
        (
            "size = 0.1651",
            "size_mm = 165",
            "size_mm",
            "unknown key",
            "metres",
        ),
        (
            "size = 0.1651",
            "size = 165.1",
            "size = 165.1",
            "size is 165.1",
            "write `size",
        ),
        (
            "size = 0.1651",
            "size = nan",
            "nan",
            "no finite number",
            "size = 0.30",
        ),
        (
            "size = 0.1651",
            "size = 0.1651\nconvention = 'apriltg'",
            "'apriltg'",
            "is 'apriltg'",
            "did you mean \"apriltag\"?",
        ),
        (
            "size = 0.1651",
            "size = 0.1651\nconvention = 'apriltag'",
            "convention =",
            "has its own",
            "write `convention = \"wpilib\"`",
        ),
        (
            "file = 'field.json'",
            "file = 'fields.json'",
            "'fields.json'",
            "cannot be read",
            "relative",
        ),
        (
            "file = 'field.json'",
            "file = 'latin.json'",
            "'latin.json'",
            "not UTF-8",
            "UTF-8",
        ),
        (
            "file = 'docks.yaml'",
            "file = 'docks.yaml'\nsize = 1",
            "size = 1\nformat",
            "no meaning",
            "remove `size`",
        ),
        (
            "[goal.gate]",
            "[goal.home]",
            "[import.docks]",
            "brings a goal `home`",
            "`prefix`",
        ),
        (
            "[goal.gate]",
            "[tag.t3]\nid = 4\nfamily = 'a'\nsize = 1\npose = { x = 0, y = 0, z = 0, roll_deg = 0, pitch_deg = 0, yaw_deg = 0 }\n[goal.gate]",
            "[import.field]",
            "brings a tag `t3`",
            "`prefix`",
        ),
        (
            "file = 'docks.yaml'\nformat = 'nav2_docks'",
            "prefix = 't'\nfile = 'field.json'\nformat = 'wpilib'\nsize = 1\nfamily = 'a'",
            "prefix = 't'",
            "brings a tag `t12`",
            "change it",
        ),
        (
            "'dock-3'",
            "'dock-4'",
            "'dock-4'",
            "there is no goal `dock-4`",
            "did you mean `dock-3`?",
        ),
        (
            "'dock-3'",
            "'charger'",
            "'charger'",
            "there is no goal",
            "[goal.charger]",
        ),
        (
            "'dock-3'",
            "3",
            "3\nsuccess",
            "is a whole number",
            "goal = {",
        ),
        (
            "yaw_deg = 2",
            "",
            "[goal.gate]",
            "`yaw_deg` is missing",
            "add `yaw_deg",
        ),
    ];
    for (from, to, at, message, help) in rows {
        assert!(IMPORT.contains(from), "{from}");
        let text = IMPORT.replacen(from, to, 1);
        let error = match site(&text) {
            Ok(_) => panic!("no fault: {to}"),
            Err(error) => error,
        };
        let place = error.at.expect("a place");
        assert!(error.file.ends_with("site.toml"), "{to}: {error}");
        assert_eq!(Some(place.offset), text.find(at), "{to}: {error}");
        assert!(error.message.contains(message), "{to}: {error}");
        assert!(error.expected.is_some(), "{to}: {error}");
        let told = error.help.as_deref().expect("help");
        assert!(told.contains(help), "{to}: {error}");
    }
}

fn determinant([a, b, c]: Matrix) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[test]
fn every_frame_is_right_handed() {
    for name in Convention::NAMES {
        let axes = Convention::named(name).expect("known").axes();
        assert_eq!(determinant(axes), 1.0, "{name}");
        assert_eq!(determinant(transposed(axes)), 1.0, "{name}");
    }
}

proptest! {
    /// Angles that are read out of a turn are that turn, at every pitch.
    #[test]
    fn turns_are_their_angles(
        roll_deg in -180.0..180.0_f64,
        pitch_deg in prop_oneof![-90.0..90.0_f64, Just(90.0), Just(-90.0), 89.999_999..90.0_f64, -90.0..-89.999_999_999],
        yaw_deg in -180.0..180.0_f64,
    ) {
        let pose = Pose3Deg { x: 1.0, y: -2.0, z: 3.0, roll_deg, pitch_deg, yaw_deg };
        let told = Frame::of_pose(pose).pose();
        prop_assert_eq!([told.x, told.y, told.z], [1.0, -2.0, 3.0]);
        let turn = |pose: Pose3Deg| rotation::<f64>(pose.roll_deg, pose.pitch_deg, pose.yaw_deg);
        for (a, b) in turn(pose).as_flattened().iter().zip(turn(told).as_flattened()) {
            prop_assert!((a - b).abs() < 1e-10, "{:?} {:?}", pose, told);
        }
    }

    /// What is written is read back to the same bits, whatever it is called.
    #[test]
    fn tables_are_read_back(
        name in "[^\\p{Cc}]{1,8}",
        family in ".{1,8}",
        size in 1e-6..10.0_f64,
        at in prop::array::uniform3(-1e6..1e6_f64),
        turns in prop::array::uniform3(-180.0..180.0_f64),
    ) {
        let text = format!("[tag.a]\nid = 7\nfamily = 'a'\nsize = {size:?}\npose = {{ x = {:?}, y = {:?}, z = {:?}, \
                            roll_deg = {:?}, pitch_deg = {:?}, yaw_deg = {:?} }}\n[goal.a]\nx = {:?}\ny = 1e-300\nyaw_deg = 3\n",
                           at[0], at[1], at[2], turns[0], turns[1], turns[2], at[0]);
        let mut own = read(&Import::of(Format::Posegate), &text);
        let mut tag = own.tags.remove("a").expect("a");
        tag.family = family;
        own.tags.insert(name.clone(), tag);
        own.goals.insert(name, PoseDeg { x: turns[0], y: at[1], yaw_deg: turns[2] });
        prop_assert_eq!(read(&Import::of(Format::Posegate), &own.to_toml()), own);
    }
}
