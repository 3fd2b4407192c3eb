//! Imports: formats, names, settings, frames.

use proptest::prelude::*;

use super::place::{Frame, Matrix, transposed};
use super::{Convention, Format, Import, ImportError, Imported};
use crate::SiteError;
use posegate::shape::{Pose3Deg, PoseDeg, rotation};

mod files;
mod sites;

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
    // If the face looks along -x, a viewer's right is -y.
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
fn prefix_comes_before_the_name() {
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

/// Missing settings, settings that a format does not have, and invalid values.
#[test]
fn missing_and_superfluous_settings_are_errors() {
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
    // The message lists every possible convention.
    let open = Import {
        convention: None,
        ..bundle("dock")
    };
    let message = open.parse(BUNDLES, "map").expect_err("open").to_string();
    for name in Convention::NAMES {
        assert!(message.contains(&format!("\"{name}\"")), "{message}");
        assert_eq!(Convention::named(name).map(Convention::name), Some(name));
    }
    for name in Format::NAMES {
        assert_eq!(Format::named(name).map(Format::name), Some(name));
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
    /// Angles computed from a rotation give the same rotation, at every pitch.
    #[test]
    fn angles_of_a_rotation_give_the_same_rotation(
        roll_deg in -180.0..180.0_f64,
        pitch_deg in prop_oneof![-90.0..90.0_f64, Just(90.0), Just(-90.0), 89.999_999..90.0_f64, -90.0..-89.999_999_999],
        yaw_deg in -180.0..180.0_f64,
    ) {
        let pose = Pose3Deg { x: 1.0, y: -2.0, z: 3.0, roll_deg, pitch_deg, yaw_deg };
        let restored = Frame::of_pose(pose).pose();
        prop_assert_eq!([restored.x, restored.y, restored.z], [1.0, -2.0, 3.0]);
        let turn = |pose: Pose3Deg| rotation::<f64>(pose.roll_deg, pose.pitch_deg, pose.yaw_deg);
        for (a, b) in turn(pose).as_flattened().iter().zip(turn(restored).as_flattened()) {
            prop_assert!((a - b).abs() < 1e-10, "{:?} {:?}", pose, restored);
        }
    }

    /// Written tables are read back to the same bits, for any names.
    #[test]
    fn written_tables_are_read_back_bit_by_bit(
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
