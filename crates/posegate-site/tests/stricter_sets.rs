//! The proof enforces each limit and each tolerance: a table made without it is not proven with it, and a table
//! made with it is proven without it.

use posegate::bake::{BakeInput, Extent, Layout, Step, TableSpec};
use posegate::shape::{Shape, SuccessSet};
use posegate::verify::{ExpectedTable, VerifyError, build, verify};
use posegate_site::Site;
use posegate_testkit::counts;

const SITE: &str = r#"
[camera.front]
width_px = 640
height_px = 480
fx = 615.0
fy = 615.0
cx = 320.0
cy = 240.0
mount = { x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }
# camera

[tag.t7]
id = 7
family = "tag36h11"
size = 0.30
pose = { x = 3.0, y = 0.0, z = 0.7, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }
# tag

[error_model.m]
translation = [0.005, 0.002, 0.01, 0.01]
yaw_deg = [0.1, 0.05, 0.2, 0.5]

[task.a]
kind = "work"
goal = { x = 0.5, y = -0.25, yaw_deg = 10.0 }
success = SET
# task
"#;

/// Returns the success set of a site with parts of the site replaced.
fn set(set: &str, replace: &[(&str, &str)]) -> SuccessSet {
    let mut text = SITE.replace("SET", set);
    for (from, to) in replace {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let site = Site::parse(&text, "site.toml").unwrap_or_else(|e| panic!("{e}"));
    site.tasks["a"].success.clone()
}

fn order(success: &SuccessSet, layout: Layout) -> BakeInput<'_> {
    BakeInput {
        task: "a",
        success,
        spec: TableSpec {
            extent: Extent {
                x: [-1.0, 1.0],
                y: [-1.0, 1.0],
                yaw_deg: [-15.0, 15.0],
            },
            step: Step {
                xy: 0.02,
                yaw_deg: 2.0,
            },
            layout,
        },
        epsilon: 0.99,
    }
}

fn proof(bytes: &[u8], success: &SuccessSet) -> Result<(), VerifyError> {
    let claim = ExpectedTable {
        task: "a",
        success,
        epsilon: 0.99,
    };
    verify(bytes, &claim, &|| ()).map(|_| ())
}

const BOX: &str = r#"{ shape = "box", x = [-0.5, 0.5], y = [-0.4, 0.4], yaw_deg = [-10, 10] }"#;
const PARKED: &str = r#"{ shape = "footprint", footprint = [[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]], region = [[1, 0.8], [-1, 0.8], [-1, -0.8], [1, -0.8]] }"#;
const CLEAR: &str = r#"{ shape = "clear", footprint = [[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]], obstacle = [[0.9, 0.4], [0.5, 0.4], [0.5, -0.4], [0.9, -0.4]] }"#;
const SEEN: &str = r#"{ shape = "visibility", camera = "front", tag = "t7", d_max = 2.6, phi_max_deg = 20, psi_max_deg = 20 }"#;
const PAST_A_WALL: &str = r#"{ shape = "visibility", camera = "front", tag = "t7", d_max = 4, phi_max_deg = 25, psi_max_deg = 50, d_min = 1.7 }"#;

/// Replacements in the site: old and new text.
type Changes = Vec<(&'static str, String)>;

/// Each row makes a slack stricter that determines a border of the tables.
#[test]
fn each_limit_and_tolerance_is_enforced() {
    let tag = |t: f64, a: f64| {
        (
            "# tag",
            format!("tolerance = {{ translation = {t}, yaw_deg = {a} }}"),
        )
    };
    let mount = |t: f64, a: f64| {
        (
            "# camera",
            format!("mount_tolerance = {{ translation = {t}, angle_deg = {a} }}"),
        )
    };
    let intrinsics = |f: f64, c: f64| {
        (
            "# camera",
            format!("tolerance = {{ focal = {f}, centre_px = {c} }}"),
        )
    };
    let task = |t: f64, a: f64| {
        (
            "# task",
            format!("tolerance = {{ translation = {t}, yaw_deg = {a} }}"),
        )
    };
    let key = |k: &str| ("phi_max_deg = 2", format!("{k}, phi_max_deg = 2"));
    let wall = |z: &str| {
        (
            "[tag.t7]",
            format!("[wall.w]\nfrom = [2.2, 0.1]\nto = [2.2, 0.5]\nz = {z}\n\n[tag.t7]"),
        )
    };
    let blur = "blur = { yaw_rate_deg_s = 20, exposure_s = 0.02, px_max = 4.9 }";
    let rows: Vec<(&str, Changes, Changes)> = vec![
        (BOX, vec![], vec![task(0.01, 0.0)]),
        (BOX, vec![], vec![task(0.0, 1.0)]),
        (PARKED, vec![], vec![task(0.01, 0.0)]),
        (PARKED, vec![], vec![task(0.0, 1.0)]),
        (CLEAR, vec![], vec![task(0.01, 0.0)]),
        (CLEAR, vec![], vec![task(0.0, 1.0)]),
        (SEEN, vec![], vec![tag(0.01, 0.0)]),
        (SEEN, vec![], vec![tag(0.0, 1.0)]),
        (SEEN, vec![], vec![intrinsics(0.35, 0.0)]),
        (SEEN, vec![], vec![intrinsics(0.0, 100.0)]),
        (SEEN, vec![], vec![mount(0.01, 0.0)]),
        (SEEN, vec![], vec![mount(0.0, 1.0)]),
        (SEEN, vec![], vec![key("d_min = 1.9")]),
        (SEEN, vec![key("d_min = 1.9")], vec![key("d_min = 1.95")]),
        (SEEN, vec![], vec![key("psi_min_deg = 6")]),
        (
            SEEN,
            vec![key("psi_min_deg = 6")],
            vec![key("psi_min_deg = 7")],
        ),
        (
            SEEN,
            vec![key("psi_min_deg = 6")],
            vec![key("psi_min_deg = 6"), tag(0.0, 0.5)],
        ),
        (SEEN, vec![], vec![key("px_per_bit_min = 9.3")]),
        (
            SEEN,
            vec![key("px_per_bit_min = 9.3")],
            vec![key("px_per_bit_min = 9.5")],
        ),
        (SEEN, vec![], vec![key(blur)]),
        (SEEN, vec![], vec![key("border_px = 100")]),
        (
            SEEN,
            vec![],
            vec![key(
                "error_model = \"m\", r = { translation = 0.02, yaw_deg = 9 }",
            )],
        ),
        (
            SEEN,
            vec![],
            vec![key(
                "error_model = \"m\", r = { translation = 9, yaw_deg = 0.45 }",
            )],
        ),
        (PAST_A_WALL, vec![], vec![wall("[0.0, 2.0]")]),
        (
            PAST_A_WALL,
            vec![wall("[0.0, 0.5]")],
            vec![wall("[0.0, 0.55]")],
        ),
        (
            PAST_A_WALL,
            vec![wall("[0.0, 2.0]")],
            vec![wall("[0.0, 2.0]"), tag(0.02, 0.0)],
        ),
        (
            PAST_A_WALL,
            vec![wall("[0.0, 2.0]")],
            vec![wall("[0.0, 2.0]"), mount(0.02, 0.0)],
        ),
    ];
    fn refer<'a>(replace: &'a [(&'a str, String)]) -> Vec<(&'a str, &'a str)> {
        replace.iter().map(|(a, b)| (*a, b.as_str())).collect()
    }
    let (skipped, step) = counts::part(4);
    for (number, (text, lax, strict)) in rows.iter().enumerate().skip(skipped).step_by(step) {
        let (lax, strict) = (set(text, &refer(lax)), set(text, &refer(strict)));
        for layout in [Layout::Facets, Layout::Grid] {
            let made = |success: &SuccessSet| {
                build(&order(success, layout), &|| ())
                    .unwrap_or_else(|e| panic!("row {number}, {layout:?}: {e}"))
                    .0
            };
            let (lax_table, strict_table) = (made(&lax), made(&strict));
            for (bytes, success) in [(&lax_table, &lax), (&strict_table, &strict)] {
                assert_eq!(proof(bytes, success), Ok(()), "row {number}, {layout:?}");
            }
            // The sight record also contains the set's limits, so these tables have none.
            assert!(
                matches!(
                    (
                        proof(&without_sight(&lax, layout), &only_cells(&strict)),
                        layout
                    ),
                    (Err(VerifyError::Facet(_)), Layout::Facets)
                        | (Err(VerifyError::Cell(_)), Layout::Grid)
                ),
                "row {number}, {layout:?}: a table without it is proven"
            );
            let back = proof(&without_sight(&strict, layout), &only_cells(&lax));
            // Every pose is proven, and only then the digest is compared: it is that of the strict set.
            let of_strict = matches!(
                back,
                Err(VerifyError::Header {
                    field: "task digest",
                    ..
                })
            );
            assert!(of_strict, "row {number}, {layout:?}: {back:?}");
        }
    }
}

/// Returns the same set without a sight record: with a second alternative that contains no pose of the extent.
fn only_cells(success: &SuccessSet) -> SuccessSet {
    let far = Shape::Box(posegate::shape::BoxSet {
        x: [90.0, 91.0],
        y: [90.0, 91.0],
        yaw_deg: [0.0, 1.0],
    });
    let view = success.shape.visibility().copied().map(Shape::Visibility);
    let mut sets = vec![success.shape.clone(), far.clone()];
    // Two views have no record.
    sets.extend(view.map(|view| Shape::All(vec![view, far])));
    SuccessSet {
        goal: success.goal,
        shape: Shape::Any(sets),
    }
}

fn without_sight(success: &SuccessSet, layout: Layout) -> Vec<u8> {
    let success = only_cells(success);
    build(&order(&success, layout), &|| ()).expect("a table").0
}
