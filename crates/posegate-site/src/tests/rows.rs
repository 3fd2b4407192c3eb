//! Rows of candidates along walls.

use super::{FILE, Site, fault, sample_with};

const WALLS: &str = "[wall.north]\nfrom = [6.0, 3.0]\nto = [0.0, 3.0]\nz = [0.0, 2.5]\nkeep_out = [{ along = [1.0, 1.6], z = [0.0, 2.1] }]\n[wall.rack]\ncorners = [[2.0, 1.0], [4.0, 1.0], [4.0, 2.0], [2.0, 2.0]]\nz = [0.0, 2.0]\n";

fn with(row: &str) -> String {
    sample_with("[task.dock]\n", &format!("{WALLS}{row}[task.dock]\n"))
}

const ROW: &str = "[candidates.n]\nwall = \"north\"\nevery = 1.5\nz = [1.0, 1.4]\nid = 40\nfamily = \"tag36h11\"\nsize = 0.2\ncost = 2.0\n";

/// Each candidate has the tolerance of its row: without it a cover is not valid for a tag that is mounted by hand.
#[test]
fn candidates_have_the_tolerance_of_their_row() {
    let row = ROW.to_owned() + "tolerance = { translation = 0.01, yaw_deg = 0.5 }\n";
    let site = Site::parse(&with(&row), FILE).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(site.candidates.len(), 8);
    for (name, made) in &site.candidates {
        let tolerance = made.tag.tolerance;
        assert_eq!(
            (tolerance.translation, tolerance.turn_deg),
            (0.01, 0.5),
            "{name}"
        );
    }
}

#[test]
fn rows_are_on_the_side_of_the_goals() {
    let site = Site::parse(&with(ROW), FILE).unwrap_or_else(|error| panic!("{error}"));
    // Four places on 6 m, centred: 0.75, 2.25, 3.75 and 5.25 m. Goals are south of the wall; a tag of 0.25 m at 0.75 m
    // does not reach the keep-out.
    let found: Vec<_> = site
        .candidates
        .iter()
        .map(|(name, made)| {
            let pose = made.tag.tag.pose;
            assert_eq!(
                (pose.y, pose.yaw_deg, made.cost),
                (3.0, -90.0, 2.0),
                "{name}"
            );
            (name.as_str(), pose.x, pose.z, made.id.unwrap())
        })
        .collect();
    let expected = [
        ("n-1", 5.25, 1.0, 40),
        ("n-2", 5.25, 1.4, 41),
        ("n-3", 3.75, 1.0, 42),
        ("n-4", 3.75, 1.4, 43),
        ("n-5", 2.25, 1.0, 44),
        ("n-6", 2.25, 1.4, 45),
        ("n-7", 0.75, 1.0, 46),
        ("n-8", 0.75, 1.4, 47),
    ];
    assert_eq!(found.len(), expected.len());
    for ((name, x, z, id), expected) in found.into_iter().zip(expected) {
        assert_eq!((name, z, id), (expected.0, expected.2, expected.3));
        assert!((x - expected.1).abs() < 1e-12, "{name}: {x}");
    }
    // A keep-out at these places, measured from the other end of the wall.
    for (from, to, kept_out) in [
        ("x", "x", 0.75),
        (
            "from = [6.0, 3.0]\nto = [0.0, 3.0]",
            "from = [0.0, 3.0]\nto = [6.0, 3.0]",
            5.25,
        ),
    ] {
        let text = with(ROW).replace(from, to);
        let text = text.replace("along = [1.0, 1.6]", "along = [4.7, 5.2]");
        let site = Site::parse(&text, FILE).unwrap();
        assert_eq!(site.candidates.len(), 6, "{to}");
        assert!(
            site.candidates
                .values()
                .all(|made| made.tag.tag.pose.x != kept_out)
        );
    }
}

#[test]
fn rows_are_on_the_faces_of_blocks_that_goals_see() {
    let row = ROW.replace("north", "rack").replace("1.5", "0.5");
    let site = Site::parse(&with(&row), FILE).unwrap();
    // All goals are at the origin: it is in front of the rack's faces to the west and to the south.
    let mut faces: Vec<f64> = site
        .candidates
        .values()
        .map(|made| made.tag.tag.pose.yaw_deg.abs())
        .collect();
    faces.sort_by(f64::total_cmp);
    faces.dedup();
    assert_eq!(faces, [90.0, 180.0]);
    for made in site.candidates.values() {
        let pose = made.tag.tag.pose;
        assert!(pose.x == 2.0 || pose.y == 1.0, "{pose:?}");
    }
    // 1.75 m of 2 m, and 0.75 m of 1 m, are free: four and two places.
    assert_eq!(site.candidates.len(), 2 * (4 + 2));
}

#[test]
fn errors_in_rows_state_the_fault() {
    for (from, to, message, help) in [
        (
            "\"north\"",
            "\"noth\"",
            "there is no wall `noth`",
            "did you mean `north`?",
        ),
        (
            "every = 1.5",
            "every = 0.0",
            "`candidates.n.every` is 0.0",
            "every = 1.5",
        ),
        (
            "every = 1.5",
            "every = 1e-9",
            "at most 1000 are allowed",
            "",
        ),
        (
            "z = [1.0, 1.4]",
            "z = []",
            "has no height",
            "z = [1.0, 1.4]",
        ),
        (
            "z = [1.0, 1.4]",
            "z = [2.4]",
            "at z = 2.4 the tag",
            "heights from 0.125 to 2.375",
        ),
        (
            "z = [1.0, 1.4]\n",
            "",
            "`z` is missing",
            "add `z = [1.0, 1.4]`",
        ),
        ("size = 0.2", "size = 300", "is lower than the tag", ""),
        (
            "id = 40",
            "id = 7",
            "the number 7 of tag `t7`",
            "leave out `id`",
        ),
        (
            "every",
            "evry",
            "unknown key `evry`",
            "did you mean `every`?",
        ),
    ] {
        let text = with(&ROW.replace(from, to));
        assert_ne!(text, with(ROW), "{from}");
        let fault = fault(&text);
        assert!(fault.message.contains(message), "{fault}");
        assert!(
            fault.help.as_deref().unwrap_or("").contains(help),
            "{fault}"
        );
    }
    let twice = format!(
        "{ROW}[candidate.n-1]\nfamily = \"tag36h11\"\nsize = 0.2\npose = {{ x = 1.0, y = 1.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }}\n"
    );
    assert!(
        fault(&with(&twice))
            .message
            .contains("two candidates have the name `n-1`")
    );
}
