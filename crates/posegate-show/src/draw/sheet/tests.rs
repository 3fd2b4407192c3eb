use super::*;
use crate::draw::measure::text_width;
use posegate::shape::Pose3Deg;

fn mounted(name: &str, family: &str, id: u32, at: [f64; 4]) -> Mounted {
    let [x, y, z, yaw_deg] = at;
    Mounted {
        name: name.into(),
        family: family.into(),
        tag: Tag {
            id,
            size: 0.3,
            pose: Pose3Deg {
                x,
                y,
                z,
                roll_deg: 0.0,
                pitch_deg: 0.0,
                yaw_deg,
            },
        },
        reserve: None,
        left: None,
    }
}

fn wall(name: &str, corners: &[[f64; 2]], top: f64) -> Wall {
    Wall {
        name: name.into(),
        corners: corners.to_vec(),
        z: [0.0, top],
        keep_outs: vec![[[0.5, 1.5], [0.0, 2.0]]],
    }
}

fn of<'a>(tags: &'a [Mounted], walls: &'a [Wall]) -> MountingSheet<'a> {
    MountingSheet {
        title: "Mounting sheet",
        origin: "site file hall.toml, digest 0123",
        tags,
        walls,
    }
}

/// A text's box: left, top, right, bottom.
type TextBox = ([f64; 4], String);

/// Returns the boxes of all texts of a page, as wide as a wide font makes them.
fn boxes(page: &str) -> Vec<TextBox> {
    let attribute = |text: &str, name: &str| -> Option<String> {
        let (_, rest) = text.split_once(&format!(" {name}=\""))?;
        Some(rest.split_once('"')?.0.to_owned())
    };
    page.lines()
        .filter(|line| line.starts_with("<text"))
        .map(|line| {
            let number = |name: &str| attribute(line, name).unwrap().parse::<f64>().unwrap();
            let (x, y, size) = (number("x"), number("y"), number("font-size"));
            let (_, content) = line.split_once('>').unwrap();
            let content = content.strip_suffix("</text>").unwrap();
            let wide = text_width(content, size, line.contains("font-weight"));
            let left = match attribute(line, "text-anchor").as_deref() {
                Some("middle") => x - 0.5 * wide,
                Some("end") => x - wide,
                _ => x,
            };
            (
                [left, y - 0.8 * size, left + wide, y + 0.22 * size],
                content.to_owned(),
            )
        })
        .collect()
}

fn check(page: &str) {
    let boxes = boxes(page);
    assert!(boxes.len() > 10);
    for (index, (a, text)) in boxes.iter().enumerate() {
        assert!(
            a[0] >= 20.0 && a[1] >= 20.0 && a[2] <= PAGE[0] - 20.0 && a[3] <= PAGE[1] - 10.0,
            "`{text}` leaves the page: {a:?}"
        );
        for (b, other) in &boxes[index + 1..] {
            let apart = a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
            assert!(apart, "`{text}` {a:?} and `{other}` {b:?} overlap");
        }
    }
}

#[test]
fn texts_do_not_overlap() {
    let walls = [
        wall(
            "a wall with a name that is longer than any column of the sheet",
            &[[-100.0, 4.0], [150.0, 4.0]],
            2.5,
        ),
        wall("west", &[[0.0, 0.0], [0.0, -1.2]], 6.0),
    ];
    let mut tags = Vec::new();
    for (number, at) in [
        [1.5, 4.0, 0.6, -90.0],
        [-99.8, 4.0, 0.2, -90.0],
        [149.8, 4.0, 2.3, -90.0],
        [1.5, 4.0, 0.6, 90.0],
        [0.0, -0.2, 5.7, 0.0],
        [0.0, -1.0, 0.2, 180.0],
        [-1234.5, 2345.6, 0.05, -123.4],
        [0.0, 0.0, 3.0, 45.0],
    ]
    .into_iter()
    .enumerate()
    {
        let id = u32::try_from(number).unwrap();
        tags.push(mounted(&format!("north-{number}"), "tag36h11", id, at));
        let long = "the tag with a very long name that someone gave it";
        let mut tilted = mounted(long, "tagStandard52h13", 40_000 + id, at);
        tilted.tag.pose.roll_deg = -12.5;
        tilted.tag.pose.pitch_deg = 7.25;
        tilted.reserve = Some(Tolerance {
            translation: 0.012_345,
            turn_deg: 0.125,
        });
        tilted.left = Some(12.345);
        tags.push(tilted);
    }
    let pages = pages(&MountingSheet {
        title: "Mounting sheet of a hall with a long name, for everybody",
        origin: &"a long name of a site file ".repeat(9),
        tags: &tags,
        walls: &walls,
    });
    assert_eq!(pages.len(), 8);
    pages.iter().for_each(|page| check(page));
}

#[test]
fn block_lists_the_values_to_measure_on_the_wall() {
    let walls = [wall("north", &[[-2.0, 4.0], [12.0, 4.0]], 2.5)];
    let mut tag = mounted("north-3", "tag36h11", 0, [4.5, 4.0, 0.6, -90.0]);
    tag.reserve = Some(Tolerance {
        translation: 0.01,
        turn_deg: 0.5,
    });
    tag.left = Some(45.0);
    let sheet = mounting_sheet(&of(&[tag.clone()], &walls));
    assert!(!sheet.contains('\u{2026}'), "a text is cut: {sheet}");
    for text in [
        "north, this face is 14.000 m long",
        "6.500 m from corner A, the left end",
        "at x \u{2212}2.000 m, y 4.000 m in the site's frame",
        "0.600 m above the floor",
        "flat on the wall, upright; its face looks to yaw \u{2212}90°",
        "it may be off by 10 mm and 0.5°",
        "page 1 of 1",
        "within the reserve",
        "site file hall.toml, digest 0123",
        ">m</text>",
        ">°</text>",
    ] {
        assert!(sheet.contains(text), "{text}: {sheet}");
    }
    // The image: 36 data bits, and those of another number differ.
    let other = Mounted {
        tag: Tag { id: 1, ..tag.tag },
        ..tag
    };
    let images = |sheet: &str| {
        let squares = sheet.lines().filter(|line| line.contains("#ffffff"));
        squares.map(str::to_owned).collect::<Vec<_>>()
    };
    let changed = mounting_sheet(&of(&[other], &walls));
    assert_ne!(images(&sheet), images(&changed));
}

/// The fields of a tag on a stand, and those of a tag that must be mounted exactly.
#[test]
fn block_states_what_is_unknown_and_what_is_exact() {
    let mut tag = mounted("pole-1", "tag36h11", 5, [-1.5, 2.0, 0.75, 45.0]);
    tag.tag.pose.pitch_deg = -10.0;
    let sheet = mounting_sheet(&of(&[tag.clone()], &[]));
    for text in [
        ">pole-1: tag36h11 id 5</text>",
        ">none: on a stand of its own</text>",
        ">x \u{2212}1.500 m, y 2.000 m in the site's frame</text>",
        ">0.750 m above the floor</text>",
        ">roll 0°, pitch \u{2212}10°; its face looks to yaw 45°</text>",
        ">size 300 mm over the border that is measured, 375 mm in all</text>",
        ">unknown: survey it after mounting</text>",
    ] {
        assert!(sheet.contains(text), "{text}: {sheet}");
    }
    assert!(!sheet.contains("beyond it") && !sheet.contains("corner A"));
    // Nobody can tick that an unknown reserve is kept.
    assert!(!sheet.contains("within the reserve"), "{sheet}");
    tag.reserve = Some(Tolerance::NONE);
    let sheet = mounting_sheet(&of(&[tag.clone()], &[]));
    assert!(sheet.contains(">mount it exactly: nothing is allowed for errors</text>"));
    // Rounded down: the installer may rely on it.
    tag.reserve = Some(Tolerance {
        translation: 0.0199,
        turn_deg: 0.5,
    });
    tag.left = Some(1.29);
    let sheet = mounting_sheet(&of(&[tag], &[]));
    assert!(
        sheet.contains(">it may be off by 19 mm and 0.5°</text>")
            && sheet.contains(">still seen if it is 12 mm and 1.2° more off,</text>"),
        "{sheet}"
    );
}

#[test]
fn pages_are_a4_and_each_has_two_blocks() {
    let tags: Vec<Mounted> = (0..5)
        .map(|id| mounted(&format!("t{id}"), "tag36h11", id, [1.0, 2.0, 0.5, 0.0]))
        .collect();
    let sheet = mounting_sheet(&of(&tags, &[]));
    assert_eq!(
        sheet
            .matches("width=\"794\" height=\"1123\" viewBox")
            .count(),
        3
    );
    assert!(sheet.contains("page 3 of 3") && sheet.contains("y=\"1147\""));
    let html = mounting_sheet_html(&of(&tags, &[]));
    assert!(html.contains("size: A4") && html.matches("<svg ").count() == 3);
}
