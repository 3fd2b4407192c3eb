//! The `[import.NAME]` tables of sites.

use std::fs;

use super::{BUNDLES, DOCKS, FIELD, WALL};
use crate::{Site, SiteError};
use posegate::shape::PoseDeg;

/// A site in one folder with `field.json`, `tags.yaml` and `docks.yaml`.
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
fn imports_add_tags_and_goals() {
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
fn errors_in_imports_point_at_the_fault() {
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
            "not a finite number",
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
        let advice = error.help.as_deref().expect("help");
        assert!(advice.contains(help), "{to}: {error}");
    }
}
