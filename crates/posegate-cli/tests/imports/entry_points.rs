//! Site files and `posegate import`: what they import, print and refuse.

use super::{OFFSET, TURN, bundle_file, field_file};
use posegate_site::Site;
use posegate_testkit::run::{Case, cases};

fn folder() -> Case {
    Case::new(&[
        ("field.json", field_file(OFFSET, TURN).as_bytes()),
        ("tags.yaml", bundle_file(OFFSET, TURN, 0.2).as_bytes()),
        ("docks.yaml", DOCKS.as_bytes()),
    ])
}

/// Reads the text as the site file of a folder.
fn site(folder: &Case, text: &str) -> Site {
    folder.write("site.toml", text);
    match Site::read(folder.path().join("site.toml")) {
        Ok(site) => site,
        Err(error) => panic!("{error}\n{text}"),
    }
}

const DOCKS: &str = "docks:
  dock-3: {type: charger, frame: map, pose: [1.0, 2.0, 1.5]}
  \"at the window\": {type: charger, pose: [-1.0, 0.5, -3.0]}
";

const IMPORTS: [(&str, &str); 3] = [
    (
        "field.json --format wpilib --size 0.1651 --family tag36h11 --pose x=4.25,y=-1.5,z=0.875,roll_deg=12,pitch_deg=-35,yaw_deg=110 --prefix w",
        "file = 'field.json'\nformat = 'wpilib'\nsize = 0.1651\nfamily = 'tag36h11'\nprefix = 'w'\n\
         pose = { x = 4.25, y = -1.5, z = 0.875, roll_deg = 12, pitch_deg = -35, yaw_deg = 110 }\n",
    ),
    (
        "tags.yaml#b --format apriltag_ros --convention apriltag --family tag36h11 --pose x=4,z=0.5,yaw_deg=180",
        "file = 'tags.yaml#b'\nformat = 'apriltag_ros'\nconvention = 'apriltag'\nfamily = 'tag36h11'\n\
         pose = { x = 4, y = 0, z = 0.5, roll_deg = 0, pitch_deg = 0, yaw_deg = 180 }\n",
    ),
    (
        "docks.yaml --format nav2_docks",
        "file = 'docks.yaml'\nformat = 'nav2_docks'\n",
    ),
];

/// The printed tables, pasted into the site or named in it, equal the import to the last bit.
#[test]
fn printed_tables_equal_the_import() {
    for (arguments, table) in IMPORTS {
        let folder = folder();
        let direct = site(&folder, &format!("[import.a]\n{table}"));
        assert_eq!(
            direct.tags.len() + direct.goals.len(),
            if table.contains("docks") { 2 } else { 1 }
        );

        let (printed, _) = folder.expect(0, &format!("import {arguments}"));
        let (message, _) = folder.expect(0, &format!("import {arguments} -o out.toml"));
        assert!(message.starts_with("wrote out.toml"), "{message}");
        assert_eq!(printed, folder.text("out.toml"));

        let named = site(
            &folder,
            "[import.a]\nfile = 'out.toml'\nformat = 'posegate'\n",
        );
        let pasted = site(&folder, &printed);
        for site in [&named, &pasted] {
            assert_eq!(
                (&site.tags, &site.goals),
                (&direct.tags, &direct.goals),
                "{table}"
            );
        }

        let json = folder.json(0, &format!("import {arguments} --json"));
        for (name, tag) in &direct.tags {
            let printed_tag = &json["tags"][0];
            assert_eq!(
                (&printed_tag["name"], &printed_tag["id"]),
                (&name.as_str().into(), &7.into())
            );
            assert_eq!(printed_tag["pose"]["pitch_deg"], tag.tag.pose.pitch_deg);
            assert_eq!(printed_tag["size"], tag.tag.size);
        }
        for (index, (name, goal)) in direct.goals.iter().enumerate() {
            let printed_goal = &json["goals"][index];
            assert_eq!(
                (&printed_goal["name"], &printed_goal["yaw_deg"]),
                (&name.as_str().into(), &goal.yaw_deg.into())
            );
        }
    }
}

/// An imported tag is seen exactly like the same tag in the site file. A table that was made from an import is refused
/// after any change of the imported file, even of a space.
#[test]
fn table_of_imported_tags_covers_the_imported_files() {
    let folder = folder();
    let c = std::f64::consts::FRAC_1_SQRT_2;
    folder.write(
        "wall.json",
        field_file([4.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]),
    );
    // The lower left corner of the map is at (1, 2), its x axis is the world's y axis.
    folder.write(
        "turned.json",
        field_file([-2.0, -3.0, 0.5], [c, 0.0, 0.0, c]),
    );
    folder.write(
        "docks.yaml",
        "docks:\n  front: {type: charger, pose: [0.0, 0.0, 0.0]}\n",
    );
    let manual = posegate_site::SAMPLE;
    let begin = manual.find("[tag.t7]").unwrap();
    let end = begin + manual[begin..].find("\n\n").unwrap();
    let imported = |file: &str, pose: &str| {
        format!(
            "{}[import.wall]\nfile = '{file}'\nformat = 'wpilib'\nsize = 0.3\nfamily = 'tag36h11'\n{pose}\n\
             [import.docks]\nfile = 'docks.yaml'\nformat = 'nav2_docks'{}",
            &manual[..begin],
            &manual[end..]
        )
        .replace("goal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }", "goal = 'front'")
    };
    let wanted = Site::parse(manual, "by hand").unwrap();
    for (file, pose) in [
        ("wall.json", ""),
        (
            "turned.json",
            "pose = { x = 1, y = 2, z = 0, roll_deg = 0, pitch_deg = 0, yaw_deg = 90 }",
        ),
    ] {
        let site = site(&folder, &imported(file, pose));
        assert_eq!(site.tasks, wanted.tasks, "{file}");
        assert_ne!(site.digest, wanted.digest);
    }

    folder.write("site.toml", imported("wall.json", ""));
    folder.expect(0, "check site.toml");
    folder.expect(0, "table build site.toml --task see-t7 -o see.posegate");
    folder.expect(0, "table verify see.posegate site.toml");
    // A space in an imported file decides nothing; the pose of a dock and of a tag does.
    for (file, text, code) in [
        (
            "docks.yaml",
            "docks:\n  front: {type: charger, pose: [0.0, 0.0, 0.0]} \n",
            0,
        ),
        (
            "docks.yaml",
            "docks:\n  front: {type: charger, pose: [0.5, 0.0, 0.0]}\n",
            1,
        ),
        (
            "wall.json",
            &field_file([4.1, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]),
            1,
        ),
    ] {
        let before = folder.text(file);
        folder.write(file, text);
        let (out, _) = folder.expect(code, "table verify see.posegate site.toml");
        assert_eq!(out.contains("NOT proven"), code == 1, "{file}: {out}");
        folder.write(file, &before);
        folder.expect(0, "table verify see.posegate site.toml");
    }
}

/// The imports shown in the page of the host and in the sample are valid.
#[test]
fn documented_imports_are_valid() {
    let folder = folder();
    folder.write(
        "tags.yaml",
        bundle_file(OFFSET, TURN, 0.2).replace("name: b", "name: dock"),
    );
    let lines = posegate_site::SAMPLE.lines();
    let sample: Vec<&str> = lines.filter_map(|line| line.strip_prefix("#   ")).collect();
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/host.md"))
        .unwrap();
    let mut blocks = page
        .split("```toml\n")
        .skip(1)
        .filter_map(|rest| rest.split("```").next());
    let shown = blocks.find(|block| block.contains("[import.")).unwrap();
    for text in [sample.join("\n").as_str(), shown] {
        assert_eq!(site(&folder, text).tags.len(), 1, "{text}");
    }
}

/// Site files and `posegate import` both refuse bad input, with the file, the line and what to do. Nothing is written.
#[test]
fn bad_input_is_refused_by_site_files_and_the_command() {
    let of = |format: &str| match format {
        "wpilib" => IMPORTS[0],
        "bundle" => IMPORTS[1],
        _ => IMPORTS[2],
    };
    let rows = "
        wpilib => field.json => \"W\": 0.8 => \"W\": 0.9 => field.json:1: => a unit quaternion
        wpilib => field.json => \"x\": 0.35 => \"x\": NaN => field.json:1: => JSON has no NaN
        wpilib => field.json => }]} => }] => field.json: => not valid JSON
        wpilib => field.json => }]} => }, {\"ID\": 7, \"pose\": {\"translation\": {\"x\": 0, \"y\": 0, \"z\": 0}, \"rotation\": {\"quaternion\": {\"W\": 1, \"X\": 0, \"Y\": 0, \"Z\": 0}}}}]} => field.json:1: => tag 7 is there twice
        bundle => tags.yaml => qw: 0.8 => qw: 0.1 => tags.yaml:4: => the quaternion of tag 7
        bundle => tags.yaml =>   - { => \t- { => tags.yaml:4:1 => indented by a tab
        bundle => tags.yaml => x: 0.35 => x: .nan => tags.yaml:4: => x of tag 7 is NaN
        bundle => tags.yaml => size: 0.2,  =>  => tags.yaml:4: => `size` is missing
        bundle => tags.yaml => size: 0.2 => size: 200 => tags.yaml:4: => 165 mm are 0.165
        bundle => tags.yaml => name: b => name: c => tags.yaml:1:1 => no bundle and no tag `b`
        docks => docks.yaml => frame: map => frame: odom => docks.yaml:2: => in the frame `odom`
        docks => docks.yaml => , 1.5] => , 90] => docks.yaml:2: => 90 degrees are 1.5708
        docks => docks.yaml => , 1.5] => ] => docks.yaml:2: => has 2 numbers";
    for [format, file, from, to, place, expected] in cases(rows) {
        let (arguments, table) = of(format);
        let folder = folder();
        let text = folder.text(file);
        assert!(text.contains(from), "{from}");
        folder.write(file, text.replacen(from, to, 1));
        folder.write("site.toml", format!("[import.a]\n{table}"));
        let before = folder.names();
        for line in [
            format!("import {arguments} -o out.toml"),
            "check site.toml".into(),
        ] {
            folder.run(&line).is_refused_with(&[place, expected]);
        }
        assert_eq!(folder.names(), before);
    }
    let settings = "
        wpilib =>  --size 0.1651 =>  => `size` is missing
        wpilib => --size 0.1651 => --size nan => the tags' size is NaN
        wpilib => --size 0.1651 => --size 165.1 => in metres
        wpilib =>  --family tag36h11 =>  => `family` is missing
        wpilib => wpilib => wpilib --convention opencv => has its own
        wpilib => wpilib => frc => possible values: wpilib
        wpilib => x=4.25 => x=4.25,x=4 => twice
        wpilib => x=4.25 => u=4.25 => is not a part of
        wpilib => x=4.25 => x=inf => not a finite number
        wpilib => field.json => other.json => check the path
        bundle =>  --convention apriltag =>  => \"apriltag\" (AprilTag 3's library: x right, y down, z into the tag)
        bundle => --convention apriltag => --convention april => apriltag
        bundle =>  --pose x=4,z=0.5,yaw_deg=180 =>  => `pose` is missing
        docks => nav2_docks => nav2_docks --size 1 => docks are no tags";
    for [format, from, to, expected] in cases(settings) {
        let (arguments, _) = of(format);
        let folder = folder();
        let before = folder.names();
        assert!(arguments.contains(from), "{from}");
        let arguments = arguments.replacen(from, to, 1);
        let line = format!("import {arguments} -o out.toml");
        folder.run(&line).is_refused_with(&[expected]);
        assert_eq!(folder.names(), before);
    }
}
