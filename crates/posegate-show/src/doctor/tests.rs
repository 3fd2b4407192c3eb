use super::{Findings, IMPOSSIBLE_ERROR, examine};
use posegate_site::Site;

const DOCK: &str = include_str!("../../../../examples/sites/dock.toml");
const BAY: &str = include_str!("../../../../examples/sites/loading-bay.toml");

fn site(text: &str) -> Site {
    Site::parse(text, "site.toml").unwrap()
}

/// Returns the findings for a site's text with replacements; each replaced text must exist.
fn changed(text: &str, changes: &[(&str, &str)]) -> Findings {
    let mut text = String::from(text);
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    examine(&site(&text))
}

fn codes(findings: &Findings) -> Vec<&'static str> {
    findings.warnings.iter().map(|w| w.code).collect()
}

#[test]
fn sound_sites_have_no_warnings() {
    for text in [DOCK, BAY, posegate_site::SAMPLE] {
        let findings = examine(&site(text));
        assert_eq!(findings.warnings, []);
        assert!(findings.tasks.iter().all(|t| t.at_goal.slack >= 0.0));
    }
    let bay = examine(&site(BAY));
    // Both tags are seen from the goals of both tasks; the task that looks at them has its own limits.
    for tag in &bay.tags {
        assert_eq!(tag.looks.len(), 2);
        assert_eq!(tag.faces_deg, [180.0, 0.0]);
        let own: Vec<bool> = tag.looks.iter().map(|look| look.own).collect();
        assert_eq!(own, [false, true]);
        assert!(tag.looks.iter().all(|look| look.least.slack >= 0.0));
    }
}

#[test]
fn tag_turned_by_half_a_turn_causes_a_warning() {
    let yaw = ("yaw_deg = 180.0 }", "yaw_deg = 0.0 }");
    let findings = changed(DOCK, &[yaw]);
    assert_eq!(codes(&findings), ["tag_faces_away", "set_empty"]);
    let [away, empty] = findings.warnings.as_slice() else {
        panic!();
    };
    assert!(
        away.message
            .contains("turned by 180 deg, front would see it")
    );
    assert!(empty.empties && empty.about == "task see-t7");
    assert!(empty.message.contains("`psi`"), "{}", empty.message);
    // The same without any table in the site: the part of the set behind the tag is not in the range of the search.
    let nowhere = [
        yaw,
        (
            "[table]\nextent = { x = [-2.0, 2.0], y = [-2.0, 2.0], yaw_deg = [-20.0, 20.0] }\nstep = { xy = 0.02, yaw_deg = 1.0 }\n",
            "",
        ),
    ];
    assert_eq!(
        codes(&changed(DOCK, &nowhere)),
        ["tag_faces_away", "set_empty"]
    );
}

/// Each warning occurs, without others except its consequences.
#[test]
fn each_fault_causes_its_warning() {
    let seen = "x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0";
    let mount = "z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0";
    let second = "[task.dock]\n";
    let tag = |x: f64, yaw: f64| {
        std::format!(
            "[tag.t8]\nid = 8\nfamily = \"tag36h11\"\nsize = 0.30\npose = {{ x = {x}, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = {yaw} }}\n[task.dock]\n"
        )
    };
    let wall = |name: &str, corners: &str| {
        std::format!("[wall.{name}]\n{corners}\nz = [0.0, 2.0]\n[task.dock]\n")
    };
    let cases: [(&str, &str, &str, &[&str]); 12] = [
        (
            "size = 0.30",
            "size = 3.0",
            "tag_size",
            &["tag_below_floor", "goal_outside"],
        ),
        ("size = 0.30", "size = 0.019", "tag_size", &[]),
        (
            seen,
            "x = 4.0, y = 0.0, z = 0.1, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0",
            "tag_below_floor",
            &[],
        ),
        (
            seen,
            "x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 90.0, yaw_deg = 180.0",
            "tag_faces_up_or_down",
            &["set_empty"],
        ),
        (
            mount,
            "z = 0.5, roll_deg = 0.0, pitch_deg = 90.0, yaw_deg = 0.0",
            "camera_looks_up_or_down",
            &["set_empty"],
        ),
        // The angles of the optical frame.
        (
            mount,
            "z = 0.5, roll_deg = -90.0, pitch_deg = 0.0, yaw_deg = -90.0",
            "camera_on_its_side",
            &["set_empty"],
        ),
        (
            mount,
            "z = 0.5, roll_deg = 180.0, pitch_deg = 0.0, yaw_deg = 90.0",
            "camera_upside_down",
            &["goal_outside"],
        ),
        (
            mount,
            "z = -0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0",
            "camera_below_floor",
            &[],
        ),
        (second, &tag(3.8, 180.0), "tags_too_near", &[]),
        (
            second,
            &tag(3.5, 180.0).replace("id = 8", "id = 7"),
            "tags_alike",
            &[],
        ),
        (
            second,
            &wall(
                "rack",
                "corners = [[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]]",
            ),
            "goal_in_wall",
            &["goal_in_wall", "goal_outside"],
        ),
        (
            second,
            &wall(
                "cupboard",
                "corners = [[4.5, 0.5], [3.5, 0.5], [3.5, -0.5], [4.5, -0.5]]",
            ),
            "tag_in_block",
            &["set_empty", "tag_in_wall"],
        ),
    ];
    for (from, to, code, others) in cases {
        let findings = changed(DOCK, &[(from, to)]);
        let got = codes(&findings);
        assert!(got.contains(&code), "{code}: {got:?}");
        for other in &got {
            assert!(*other == code || others.contains(other), "{code}: {got:?}");
        }
        for other in others {
            assert!(got.contains(other), "{code} without {other}: {got:?}");
        }
    }
}

/// Tags mounted back to back, and a tag on the face of a block, cause no warning of a fault.
#[test]
fn valid_mounting_causes_no_warning() {
    let back = "[tag.t8]\nid = 8\nfamily = \"tag36h11\"\nsize = 0.30\npose = { x = 4.01, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }\n[task.dock]\n";
    let findings = changed(DOCK, &[("[task.dock]\n", back)]);
    assert_eq!(codes(&findings), ["tag_faces_away"]);
    assert_eq!(findings.warnings[0].about, "tag t8");
    let block = "[wall.cupboard]\ncorners = [[4.5, 0.5], [4.0, 0.5], [4.0, -0.5], [4.5, -0.5]]\nz = [0.0, 2.0]\n[task.dock]\n";
    assert_eq!(codes(&changed(DOCK, &[("[task.dock]\n", block)])), [""; 0]);
}

/// A tag that is mounted on a wall with a tolerance may be behind the wall: the set is empty.
#[test]
fn tolerance_into_a_wall_causes_a_warning() {
    let walls = (", walls = [\"rack\"]", "");
    let findings = changed(BAY, &[walls]);
    assert_eq!(
        codes(&findings),
        ["tag_in_wall", "tag_in_wall", "set_empty"]
    );
    assert!(findings.warnings[2].message.contains("never fulfilled"));
}

/// A stated error includes the survey's error: a warning is given if the tolerances alone exceed it.
#[test]
fn stated_error_below_that_of_the_tolerances_causes_a_warning() {
    let stated = "error_bound = { translation = 0.08";
    let smaller = "error_bound = { translation = 0.05";
    let findings = changed(BAY, &[(stated, smaller)]);
    assert_eq!(codes(&findings), ["error_bound_below_tolerance"]);
    let [found] = findings.warnings.as_slice() else {
        panic!();
    };
    assert_eq!(found.about, "task see-bay");
    // 0.010 + 2 sin(0.25 deg) (4.8 + 0.3) + 0.003 + 2 sin(0.1 deg) 0.54 + sin(0.2 deg) sin(20 deg) 5.2, plus a little
    // for a tag that is lower.
    assert!(
        found.message.contains("up to 0.066 m and 0.71 deg"),
        "{}",
        found.message
    );
    let yaw = (
        "yaw_deg = 2.0 }       # with",
        "yaw_deg = 0.6 }       # with",
    );
    // The error from the tolerances of yaw exceeds it at every place.
    assert_eq!(codes(&changed(BAY, &[yaw])), [IMPOSSIBLE_ERROR]);
    let survey = ("tolerance = { translation = 0.01, yaw_deg = 0.5 }", "");
    let mount = (
        "mount_tolerance = { translation = 0.003, angle_deg = 0.2 }",
        "",
    );
    assert_eq!(codes(&changed(BAY, &[yaw, survey, mount])), [""; 0]);
}

#[test]
fn goal_outside_of_its_set_causes_a_warning() {
    let success = "yaw_deg = 0.0 }\nsuccess = { shape = \"visibility\"";
    let turned = "yaw_deg = 35.0 }\nsuccess = { shape = \"visibility\"";
    let findings = changed(
        DOCK,
        &[
            (success, turned),
            ("yaw_deg = [-20.0, 20.0]", "yaw_deg = [-40.0, 40.0]"),
        ],
    );
    assert_eq!(codes(&findings), ["goal_outside"]);
    assert!(!findings.warnings[0].empties);
}

/// A set much smaller than its table's extent is found, even if its goal is not in the set.
#[test]
fn small_sets_are_found() {
    let small = "x = [0.7, 0.72], y = [-0.61, -0.6], yaw_deg = [3.0, 3.2]";
    let findings = changed(
        DOCK,
        &[
            (
                "x = [-0.08, 0.08], y = [-0.06, 0.06], yaw_deg = [-4.0, 4.0]",
                small,
            ),
            (
                "extent = { x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-5.0, 5.0] }",
                "extent = { x = [-2.0, 2.0], y = [-2.0, 2.0], yaw_deg = [-20.0, 20.0] }",
            ),
        ],
    );
    assert_eq!(codes(&findings), ["goal_outside"]);
}

/// A hall with a thin wall in the north and a rack in the south, and a candidate or tag.
fn hall(tag: &str) -> String {
    let walls = "[wall.north]\nfrom = [0.0, 2.0]\nto = [6.0, 2.0]\nz = [0.0, 2.5]\nkeep_out = [{ along = [4.0, 5.0], z = [0.0, 2.1] }]\n[wall.rack]\ncorners = [[0.0, -3.0], [6.0, -3.0], [6.0, -2.0], [0.0, -2.0]]\nz = [0.0, 2.5]\n";
    let dock = "[task.other]\nkind = \"work\"\ngoal = { x = 3.0, y = 1.0, yaw_deg = 90.0 }\nsuccess = { shape = \"box\", x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-4.0, 4.0] }\n[task.third]\nkind = \"work\"\ngoal = { x = 3.0, y = -1.0, yaw_deg = -90.0 }\nsuccess = { shape = \"box\", x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-4.0, 4.0] }\n";
    DOCK.replace("[task.dock]\n", &format!("{walls}{tag}{dock}[task.dock]\n"))
}

#[test]
fn candidates_are_examined_as_tags() {
    let at = |kind: &str, x: f64, y: f64, yaw: f64| {
        format!(
            "[{kind}.c]\nid = 21\nfamily = \"tag36h11\"\nsize = 0.2\npose = {{ x = {x:?}, y = {y:?}, z = 0.6, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = {yaw:?} }}\n"
        )
    };
    let one = |x: f64, y: f64, yaw: f64| at("candidate", x, y, yaw);
    let cases: [(String, &[&str]); 10] = [
        (one(3.0, 2.0, -90.0), &[]),
        (one(3.0, -2.0, 90.0), &[]),
        // In front of the rack with its face towards it; within the rack; and behind the wall.
        (one(3.0, -2.0, -90.0), &["tag_faces_away", "tag_faces_wall"]),
        (one(3.0, 1.99, 90.0), &["tag_faces_away", "tag_faces_wall"]),
        (one(3.0, -2.5, 90.0), &["tag_in_block"]),
        (one(3.0, 2.5, -90.0), &["tag_behind_wall"]),
        (one(3.9, 2.0, -90.0), &["tag_in_keep_out"]),
        (
            one(3.0, 2.0, -90.0).replace("tag36h11", "tag36h1"),
            &["family_unknown"],
        ),
        (
            one(3.0, 2.0, -90.0).replace("0.2\n", "300\n"),
            &["tag_size", "tag_below_floor"],
        ),
        (one(4.0, 0.05, 180.0), &["candidate_on_tag"]),
    ];
    for (text, expected) in cases {
        let findings = examine(&site(&hall(&text)));
        let found = findings
            .warnings
            .iter()
            .filter(|w| w.about == "candidate c");
        let found: Vec<&str> = found.map(|w| w.code).collect();
        assert_eq!(found, expected, "{text}");
        assert_eq!(findings.candidates.len(), 1);
        if !expected.contains(&"candidate_on_tag") {
            let tag = text.replace("[candidate.", "[tag.");
            let findings = examine(&site(&hall(&tag)));
            let found = findings.warnings.iter().filter(|w| w.about == "tag c");
            let found: Vec<&str> = found.map(|w| w.code).collect();
            assert_eq!(found, expected, "{tag}");
        }
    }
    let text = hall(&one(3.0, 2.0, -90.0).replace("tag36h11", "tag36h1"));
    let findings = examine(&site(&text));
    let [found] = findings.warnings.as_slice() else {
        panic!("{:?}", findings.warnings);
    };
    assert!(
        found
            .message
            .contains("did you mean `tag36h10` or `tag36h11`?")
    );
    let line = text
        .lines()
        .position(|line| line.contains("tag36h1\""))
        .unwrap();
    assert_eq!(found.line(&text), line + 1);
}

/// The candidates of a row are sound, or the warning points to the row.
#[test]
fn rows_of_candidates_are_examined() {
    let row = "[candidates.row]\nwall = \"north\"\nevery = 1.0\nz = [0.6, 1.0]\nfamily = \"tag36h11\"\nsize = 0.2\n";
    let findings = examine(&site(&hall(row)));
    assert_eq!(codes(&findings), [""; 0]);
    assert_eq!(findings.candidates.len(), 10);
    let text = hall(&row.replace("36h11", "99h9"));
    let findings = examine(&site(&text));
    assert_eq!(codes(&findings), ["family_unknown"; 10]);
    let line = text
        .lines()
        .position(|line| line == "[candidates.row]")
        .unwrap();
    assert_eq!(findings.warnings[0].line(&text), line + 1);
}

/// All candidates of a row have the same tolerance: one warning names their looks, before any of them is a tag.
#[test]
fn looks_with_the_same_fault_share_a_warning() {
    let row = "[candidates.row]\nwall = \"north\"\nevery = 1.0\nz = [1.0]\nfamily = \"tag36h11\"\nsize = 0.2\ntolerance = { translation = 0.01, yaw_deg = 0.5 }\n";
    let planner = |r: f64| {
        format!(
            "[planner]\nlook = {{ camera = \"front\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0, walls = [\"rack\"] }}\nr = [[{r:?}, 1.0]]\n"
        )
    };
    let warnings = |r: f64| {
        let text = hall(&format!("{row}{}", planner(r)));
        let found = examine(&site(&text)).warnings;
        let about = |w: &super::Warning| (w.code, w.about.clone());
        found.iter().map(about).collect::<Vec<_>>()
    };
    assert_eq!(
        warnings(0.03),
        [(
            "error_bound_below_tolerance",
            "looks row-1, row-2, row-3, row-4, row-5 of the planner".to_owned()
        )]
    );
    assert_eq!(warnings(0.2), []);
}
