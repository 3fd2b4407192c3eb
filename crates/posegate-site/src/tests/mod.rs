use super::{ErrorBound, Extent, Layout, SAMPLE, Site, SiteError, Step, TableSpec, TaskKind};
use posegate::shape::Shape;

mod blur;
mod cameras;
mod faults;
mod intrinsics;
mod rows;

const FILE: &str = "site.toml";

fn fault(text: &str) -> SiteError {
    match Site::parse(text, FILE) {
        Ok(_) => panic!("no fault in:\n{text}"),
        Err(error) => error,
    }
}

/// Returns the sample with the first `from` replaced.
fn sample_with(from: &str, to: &str) -> String {
    assert!(SAMPLE.contains(from), "the sample lacks {from:?}");
    SAMPLE.replacen(from, to, 1)
}

/// Returns the line and column, from 1, at which a text first occurs.
fn find(text: &str, wanted: &str) -> (usize, usize) {
    let Some((before, _)) = text.split_once(wanted) else {
        panic!("{wanted:?} is not in:\n{text}");
    };
    let column = 1 + before
        .rsplit('\n')
        .next()
        .unwrap_or_default()
        .chars()
        .count();
    (1 + before.matches('\n').count(), column)
}

#[test]
fn sample_parses() {
    let site = Site::parse(SAMPLE, FILE).expect("the sample is sound");
    assert_eq!(site.epsilon, 0.99);
    let names: Vec<_> = site.tasks.keys().map(String::as_str).collect();
    assert_eq!(names, ["dock", "park", "see-t7"]);

    let front = &site.cameras["front"];
    assert_eq!(
        (front.camera.width_px, front.camera.height_px),
        (640.0, 480.0)
    );
    assert_eq!(
        (front.camera.fx, front.camera.cy, front.mount.x),
        (615.0, 240.0, 0.25)
    );
    let t7 = &site.tags["t7"];
    assert_eq!(
        (t7.tag.id, t7.family.as_str(), t7.tag.size),
        (7, "tag36h11", 0.30)
    );
    assert_eq!(t7.tag.pose.yaw_deg, 180.0);

    let dock = site.task("dock").expect("dock");
    let table = TableSpec {
        extent: Extent {
            x: [-2.0, 2.0],
            y: [-2.0, 2.0],
            yaw_deg: [-20.0, 20.0],
        },
        step: Step {
            xy: 0.02,
            yaw_deg: 1.0,
        },
        layout: Layout::Facets,
    };
    assert_eq!(
        (dock.kind, dock.error_bound, dock.table),
        (TaskKind::Work, None, None)
    );
    assert_eq!(site.table_spec(dock), Some(&table));
    match &dock.success.shape {
        Shape::Box(set) => assert_eq!(set.y, [-0.06, 0.06]),
        other => panic!("{other:?}"),
    }

    let see = site.task("see-t7").expect("see-t7");
    let bound = ErrorBound {
        coverage: 1.0,
        translation: 0.05,
        yaw_deg: 2.0,
    };
    assert_eq!(
        (see.kind, see.error_bound),
        (TaskKind::Localization, Some(bound))
    );
    match &see.success.shape {
        Shape::Visibility(set) => {
            assert_eq!(
                (set.camera, set.mount, set.tag),
                (front.camera, front.mount, t7.tag)
            );
            assert_eq!((set.d_max, set.z_near), (5.5, Site::DEFAULT_Z_NEAR));
        }
        other => panic!("{other:?}"),
    }

    let park = site.task("park").expect("park");
    let spec = site.table_spec(park).expect("park has a table");
    assert_eq!(spec.extent.x, [-1.0, 1.0]);
    assert_eq!((spec.step, spec.layout), (table.step, table.layout));
    match &park.success.shape {
        Shape::Footprint(set) => assert_eq!(set.region()[2], [-2.5, -1.5]),
        other => panic!("{other:?}"),
    }
}

#[test]
fn digest_is_that_of_the_bytes() {
    // SHA-256 of the empty message, from FIPS 180-4's test vectors.
    let digest = Site::parse("", FILE).expect("an empty site").digest;
    let hex: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(
        hex,
        "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    );
}

/// Controllers compare the digest of their task: it changes with what decides on the task, and with nothing else.
#[test]
fn task_digest_changes_with_the_task_alone() {
    const DOCK: &str = include_str!("../../../../examples/sites/dock.toml");
    let digests = |text: &str| {
        let site = Site::parse(text, FILE).expect("sound");
        ["dock", "see-t7"].map(|task| site.task_digest(site.task(task).expect("a task")))
    };
    let [dock, see] = digests(DOCK);
    assert_ne!(dock, see);
    let changed = |from: &str, to: &str, which: [bool; 2]| {
        assert!(DOCK.contains(from), "{from}");
        let [now_dock, now_see] = digests(&DOCK.replacen(from, to, 1));
        assert_eq!([now_dock != dock, now_see != see], which, "{from} to {to}");
    };
    // A comment, a name, how the table is made, an unused tag, another number of the same value.
    changed("# A charging dock", "# The charging dock", [false, false]);
    changed(
        "[tag.t7]",
        "[tag.other]\nid = 8\nfamily = \"tag36h11\"\nsize = 0.3\npose = { x = 9.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }\n\n[tag.t7]",
        [false, false],
    );
    changed("xy = 0.005", "xy = 0.004", [false, false]);
    changed("x = [-0.1, 0.1]", "x = [-0.2, 0.1]", [false, false]);
    changed(
        "kind = \"work\"",
        "kind = \"work\"\nexpected = { translation = 0.02, yaw_deg = 1.0 }",
        [false, false],
    );
    changed("x = [-0.08, 0.08]", "x = [-0.080, 8e-2]", [false, false]);
    // The bound of the observation's error is not in the table: it decides nothing there.
    changed("translation = 0.05", "translation = 0.06", [false, false]);
    // One task's set and goal; the camera and the tag of one.
    changed("x = [-0.08, 0.08]", "x = [-0.08, 0.07]", [true, false]);
    changed("goal = { x = 0.0", "goal = { x = 0.1", [true, false]);
    changed("d_max = 5.5", "d_max = 5.4", [false, true]);
    changed("fx = 615.0", "fx = 616.0", [false, true]);
    changed("mount = { x = 0.25", "mount = { x = 0.26", [false, true]);
    changed("pose = { x = 4.0", "pose = { x = 4.1", [false, true]);
    changed(
        "yaw_deg = 180.0 }",
        "yaw_deg = 180.0 }\ntolerance = { translation = 0.01, yaw_deg = 0.5 }",
        [false, true],
    );
    // The confidence of all.
    changed("epsilon = 0.99", "epsilon = 0.999", [true, true]);
}

#[test]
fn defaults_and_parts_of_tables() {
    let site = Site::parse("", FILE).expect("an empty site");
    assert_eq!((site.table, site.epsilon), (None, Site::DEFAULT_EPSILON));
    let text = "[task.a]
kind = 'work'
goal = { x = 0, y = 0x10, yaw_deg = 1_0 }
success = { shape = 'box', x = [0, 0], y = [-1, 1], yaw_deg = [170, 530] }
[task.a.table]
extent = { x = [0, 1], y = [0, 1], yaw_deg = [170, 190] }
layout = 'facets'
[table]
step = { xy = 1, yaw_deg = 2 }
[chain.c]
start = { x = 0, y = 0, yaw_deg = 0, bounded = { translation = 0, yaw_deg = 0 } }
";
    let site = Site::parse(text, FILE).expect("sound");
    assert_eq!(site.table, None);
    let task = site.task("a").expect("a");
    assert_eq!(
        (task.success.goal.y, task.success.goal.yaw_deg),
        (16.0, 10.0)
    );
    let spec = site.table_spec(task).expect("complete");
    assert_eq!((spec.step.xy, spec.layout), (1.0, Layout::Facets));
    for (name, layout) in [
        ("grid", Layout::Grid),
        ("auto", Layout::Facets),
        ("both", Layout::Facets),
    ] {
        let site = Site::parse(&text.replace("facets", name), FILE).expect("sound");
        assert_eq!(site.tasks["a"].table.map(|spec| spec.layout), Some(layout));
    }
    let raw = sample_with("fx = 615.0 ", "image = \"rect\"\nfx = 615.0 ");
    assert!(Site::parse(&raw, FILE).is_ok());

    let near = sample_with("psi_max_deg = 50.0", "psi_max_deg = 50.0, z_near = 0.1")
        .replace("epsilon = 0.99", "epsilon = 0.9");
    let site = Site::parse(&near, FILE).expect("sound");
    assert_eq!(site.epsilon, 0.9);
    match &site.tasks["see-t7"].success.shape {
        Shape::Visibility(set) => assert_eq!(set.z_near, 0.1),
        other => panic!("{other:?}"),
    }
}

#[test]
fn toml_errors_point_at_the_fault() {
    let rows = [
        ("[camera.front\n", 1, 14, "unclosed table"),
        ("a = 1\na = 2\n", 2, 1, "duplicate key"),
        ("# \u{e9}\u{e9}\n\u{feff}", 2, 1, "not valid TOML"),
        ("\u{feff}a\n", 1, 2, "key with no value"),
        ("[task.a]\r\nkind = work\r\n", 2, 8, "must be quoted"),
        ("x = [1,\n", 1, 8, "unclosed array"),
    ];
    for (text, line, column, message) in rows {
        let error = fault(text);
        let place = error.at.expect("a place");
        assert_eq!(
            (place.line, place.column),
            (line, column),
            "{text:?}: {error}"
        );
        assert!(error.message.contains(message), "{text:?}: {error}");
        assert!(
            error.expected.is_some() && error.help.is_some(),
            "{text:?}: {error}"
        );
    }
}

#[test]
fn columns_count_characters() {
    let error = fault("tag = { \"\u{fc}\u{fc}\" = { idd = 1 } }");
    let place = error.at.expect("a place");
    assert_eq!(
        (place.line, place.column, place.offset, place.len),
        (1, 18, 19, 3)
    );
}

#[test]
fn errors_print_on_one_line() {
    let text = "[camera.front]\nfx = 0\n";
    assert_eq!(
        fault(text).to_string(),
        "site.toml:1:1: `width_px` is missing from `camera.front`; expected a whole number of \
         pixels, from 1 to 100000; help: add `width_px = 640`"
    );
}

/// A missing extent is chosen so that it holds the set, within the expected pose-set.
#[test]
fn missing_extent_is_chosen() {
    let site = |success: &str, rest: &str| {
        let text = format!(
            "[task.a]\nkind = 'work'\ngoal = {{ x = 3, y = 0, yaw_deg = 90 }}\nsuccess = {success}\n{rest}"
        );
        let site = Site::parse(&text, FILE).expect("sound");
        site.chosen_table(&site.tasks["a"])
    };
    let near = |a: [f64; 2], b: [f64; 2]| (0..2).all(|i| (a[i] - b[i]).abs() < 0.011);
    let small = "{ shape = 'box', x = [-0.08, 0.08], y = [-0.06, 0.3], yaw_deg = [170, 190] }";
    let spec = site(small, "table = { layout = 'grid' }").expect("bounded");
    assert!(near(spec.extent.x, [-0.08, 0.08]) && near(spec.extent.y, [-0.06, 0.3]));
    assert!((spec.extent.yaw_deg[0] - 170.0).abs() < 0.11);
    assert_eq!((spec.layout, spec.step), (Layout::Grid, Site::DEFAULT_STEP));
    // An obstacle alone is unbounded.
    let clear = "{ shape = 'clear', footprint = [[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]], \
                 obstacle = [[1.0, 0.2], [0.6, 0.2], [0.6, -0.2], [1.0, -0.2]] }";
    assert_eq!(site(clear, ""), None);
    let expected = "expected = { translation = 0.5, yaw_deg = 5 }";
    let spec = site(clear, expected).expect("expected about the goal");
    assert!(near(spec.extent.y, [-1.0, 1.0]) && near(spec.extent.yaw_deg, [-10.0, 10.0]));
    assert!(near(spec.extent.x, [-1.0, 1.0]));
    // A union's extent holds all of its parts.
    let any = "{ any = [{ shape = 'box', x = [0, 1], y = [0, 1], yaw_deg = [-5, 5] }, \
               { shape = 'box', x = [3, 4], y = [0, 1], yaw_deg = [-5, 15] }] }";
    let spec = site(any, "").expect("bounded");
    assert!(near(spec.extent.x, [0.0, 4.0]) && near(spec.extent.yaw_deg, [-5.0, 15.0]));
}

#[test]
fn error_of_an_unknown_task_states_its_name() {
    let site = Site::parse(SAMPLE, FILE).expect("the sample is sound");
    let error = site.task("dokc").expect_err("no such task");
    assert_eq!(error.similar.as_deref(), Some("dock"));
    assert_eq!(
        error.to_string(),
        "the site has no task `dokc`; did you mean `dock`?"
    );
    let error = site.task("charge").expect_err("no such task");
    assert_eq!(
        error.to_string(),
        "the site has no task `charge`; it has `dock`, `park`, `see-t7`"
    );
    let empty = Site::parse("", FILE).expect("an empty site");
    assert!(
        empty
            .task("a")
            .expect_err("no tasks")
            .to_string()
            .contains("none")
    );
}

#[test]
fn files_are_read() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("site.toml");
    let error = Site::read(&path).expect_err("no such file");
    assert!(error.at.is_none() && error.to_string().contains("cannot be read"));

    std::fs::write(&path, SAMPLE).expect("written");
    assert_eq!(Site::read(&path), Site::parse(SAMPLE, "other name"));

    std::fs::write(&path, b"# \xc3\xa9\n# \xff\n").expect("written");
    let error = Site::read(&path).expect_err("no UTF-8");
    let place = error.at.expect("a place");
    assert_eq!((place.line, place.column), (2, 3));
    assert!(error.message.contains("UTF-8"));
}
