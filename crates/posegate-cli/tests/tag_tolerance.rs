//! The error bound of a look holds for all true places of tag and camera within their tolerances.
//!
//! `posegate_testkit::nature` displaces both to the ends of the tolerances, with the largest errors of the detector's error model. It
//! computes the robot's pose from the places in the site file. It shares no code with the crate. The error must not
//! exceed the bound at any pose of a success set S_l(r), nor in any look of a chain or a plan. The bound is not much
//! larger than the largest error that is found.

use posegate_learn::{BoundsSettings, Detections, ErrorModel, learn_bounds};
use posegate_place::{LearntCost, Task, ViewBound, ViewCost};
use posegate_site::Site;
use posegate_testkit::counts;
use posegate_testkit::nature::{Random, Vector, World};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::LazyLock;

/// Largest allowed ratio of the bound to the largest error that is found.
const TIGHT: f64 = 1.3;

/// Returns detections of a detector with errors of 1 cm and 0.1 degrees at 2 m.
fn detections() -> String {
    let mut text = String::from("d_m,phi_deg,psi_deg,detected,err_translation_m,err_yaw_rad\n");
    let mut random = Random(4);
    for _ in 0..8000 {
        let at = [
            random.within(0.4, 6.0),
            random.within(0.0, 40.0),
            random.within(0.0, 75.0),
        ];
        let sigma = 0.002 + 0.001 * at[0] * at[0];
        let errors = [
            random.within(0.0, 1.0) * sigma,
            random.within(0.0, 0.2) * sigma,
        ];
        let _ = writeln!(
            text,
            "{},{},{},1,{},{}",
            at[0], at[1], at[2], errors[0], errors[1]
        );
    }
    text
}

static MODEL: LazyLock<ErrorModel> = LazyLock::new(|| {
    let rows = Detections::read(detections().as_bytes(), "detections.csv").unwrap();
    let settings = BoundsSettings {
        quantile: 0.95,
        ..BoundsSettings::default()
    };
    learn_bounds(&rows, &settings).unwrap()
});

/// The coefficients of a bound in the site file, `c0 + c1 d^2 + c2 phi^2 + c3 psi^2`: metres, degrees.
const STATED: [[f64; 4]; 2] = [[0.004, 0.001, 0.01, 0.01], [0.05, 0.02, 0.2, 0.2]];

fn stated([d, phi, psi]: [f64; 3]) -> Option<(f64, f64)> {
    let bound = |c: [f64; 4]| c[0] + c[1] * d * d + c[2] * phi * phi + c[3] * psi * psi;
    Some((bound(STATED[0]), bound(STATED[1]).to_radians()))
}

fn learnt([d, phi, psi]: [f64; 3]) -> Option<(f64, f64)> {
    MODEL.bounds(d, phi, psi)
}

/// Returns a site file with one camera, one tag and a look at it within `r`, followed by `more`.
fn text(world: &World, model: &str, r: [f64; 2], more: &str) -> String {
    let pose = |[[x, y, z], [roll, pitch, yaw]]: [Vector; 2]| {
        format!(
            "{{ x = {x:?}, y = {y:?}, z = {z:?}, roll_deg = {roll:?}, pitch_deg = {pitch:?}, yaw_deg = {yaw:?} }}"
        )
    };
    let model_table = match model {
        "learnt" => "file = \"model.toml\"".to_owned(),
        _ => format!("translation = {:?}\nyaw_deg = {:?}", STATED[0], STATED[1]),
    };
    let off = |[metres, degrees]: [f64; 2], key: &str, turn: &str| {
        if metres > 0.0 || degrees > 0.0 {
            format!("{key} = {{ translation = {metres:?}, {turn} = {degrees:?} }}")
        } else {
            String::new()
        }
    };
    format!(
        "[camera.front]
width_px = 1280
height_px = 960
fx = 700.0
fy = 700.0
cx = 640.0
cy = 480.0
mount = {mount}
{mount_off}

[tag.t7]
id = 7
family = \"tag36h11\"
size = 0.15
pose = {tag}
{tag_off}

[error_model.m]
{model_table}

[task.look]
kind = \"localization\"
goal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}
success = {{ shape = \"visibility\", camera = \"front\", tag = \"t7\", d_max = 6.0, phi_max_deg = 35.0, psi_max_deg = 70.0, error_model = \"m\", r = {{ translation = {:?}, yaw_deg = {:?} }} }}
error_bound = {{ translation = {:?}, yaw_deg = {:?} }}

{more}
[confidence]
epsilon = 0.99
",
        r[0],
        r[1],
        r[0],
        r[1],
        mount = pose(world.mount),
        tag = pose(world.tag),
        mount_off = off(world.mount_off, "mount_tolerance", "angle_deg"),
        tag_off = off(world.tag_off, "tolerance", "yaw_deg"),
    )
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.toml"), MODEL.write().unwrap()).unwrap();
    folder
}

fn site(folder: &Path, text: &str) -> Result<Site, String> {
    let path = folder.join("site.toml");
    std::fs::write(&path, text).unwrap();
    Site::read(&path).map_err(|error| error.to_string())
}

/// Returns a pose of the robot whose camera sees the tag at about this distance and these angles (m, degrees).
fn looking_from(world: &World, d: f64, phi_deg: f64, psi_deg: f64) -> Vector {
    let [[tx, ty, tz], [_, _, tag_yaw]] = world.tag;
    let [[mx, my, mz], [_, _, mount_yaw]] = world.mount;
    let level = (d * d - (tz - mz).powi(2)).max(0.01).sqrt();
    let out = (tag_yaw + psi_deg).to_radians();
    let camera = [tx + level * out.cos(), ty + level * out.sin()];
    let yaw = out + core::f64::consts::PI + (phi_deg - mount_yaw).to_radians();
    [
        camera[0] - (mx * yaw.cos() - my * yaw.sin()),
        camera[1] - (mx * yaw.sin() + my * yaw.cos()),
        yaw.sin().atan2(yaw.cos()),
    ]
}

fn random_world(random: &mut Random) -> World {
    let off = |random: &mut Random, metres: f64, degrees: f64| {
        [
            random.one_of(&[0.0, 1.0, 1.0]) * random.within(0.0, metres),
            random.one_of(&[0.0, 1.0, 1.0]) * random.within(0.0, degrees),
        ]
    };
    let z = random.within(0.2, 1.2);
    let any = random.within(-180.0, 180.0);
    World {
        tag: [
            [
                random.within(-2.0, 4.0),
                random.within(-2.0, 2.0),
                z + random.within(-0.3, 0.3),
            ],
            [
                random.within(-10.0, 10.0),
                random.within(-10.0, 10.0),
                random.within(-180.0, 180.0),
            ],
        ],
        mount: [
            [random.within(-0.5, 0.5), random.within(-0.4, 0.4), z],
            [
                random.within(-5.0, 5.0),
                random.within(-10.0, 10.0),
                random.one_of(&[0.0, 90.0, -90.0, 180.0, any]),
            ],
        ],
        tag_off: off(random, 0.04, 3.0),
        mount_off: off(random, 0.02, 2.0),
    }
}

/// The error is at most r at every pose of S_l(r), for stated and learnt error models.
#[test]
fn error_is_within_r_at_every_pose_of_the_success_set() {
    let folder = folder();
    let mut random = Random(1 + counts::first_seed());
    let (mut sets, mut inside, mut refused) = (0, 0, 0);
    let count = counts::cases(200);
    let samples = if counts::is_deep() { 400 } else { 100 };
    for number in 0..count {
        let world = random_world(&mut random);
        let (model, detector): (_, fn([f64; 3]) -> _) = if number % 2 == 0 {
            ("learnt", learnt)
        } else {
            ("stated", stated)
        };
        let r = [random.within(0.05, 0.35), random.within(1.5, 7.0)];
        let site = match site(folder.path(), &text(&world, model, r, "")) {
            Ok(site) => site,
            Err(error) => {
                assert!(error.contains("nowhere in the set"), "{error}");
                refused += 1;
                continue;
            }
        };
        let task = site.task("look").unwrap();
        sets += 1;
        for _ in 0..samples {
            let pose = looking_from(
                &world,
                random.within(0.5, 6.0),
                random.within(-35.0, 35.0),
                random.within(-70.0, 70.0),
            );
            if !task.success.membership(pose).inside {
                continue;
            }
            inside += 1;
            let worst = world
                .worst(pose, &detector, &mut random, 60)
                .unwrap_or_else(|why| panic!("{why}: {world:?} at {pose:?}"));
            assert!(
                worst[0] <= r[0] + 1e-9 && worst[1].to_degrees() <= r[1] + 1e-7,
                "{number} ({model}): {:.4} m and {:.3} deg where {r:?} is promised: {world:?} at {pose:?}",
                worst[0],
                worst[1].to_degrees(),
            );
        }
    }
    println!("{sets} sets, {inside} poses inside, {refused} refused");
    assert!(
        2 * sets >= count && 16 * inside >= samples * count,
        "{sets} {inside} {refused}"
    );
}

/// At the border of S_l(r) the largest error that is found is not much less than r.
#[test]
fn success_set_is_tight() {
    let folder = folder();
    let mut random = Random(2);
    let wall = [[4.0, 0.0, 0.5], [0.0, 0.0, 180.0]];
    let looks = [
        // A camera that looks ahead, to the side, and back past the whole robot.
        (wall, [[0.25, 0.0, 0.5], [0.0, 0.0, 0.0]]),
        (wall, [[0.1, 0.3, 0.4], [0.0, 0.0, 90.0]]),
        (wall, [[0.4, 0.0, 0.6], [0.0, 0.0, 180.0]]),
        (wall, [[0.0, 0.0, 0.5], [0.0, -5.0, 0.0]]),
        // A tag far above the camera, which looks up to it.
        (
            [[4.0, 0.0, 2.4], [0.0, 45.0, 180.0]],
            [[0.2, 0.0, 0.4], [0.0, -45.0, 0.0]],
        ),
    ];
    let offs = [
        ([0.03, 2.0], [0.0, 0.0]),
        ([0.0, 0.0], [0.02, 3.0]),
        ([0.02, 1.5], [0.01, 1.0]),
        ([0.0, 3.0], [0.0, 0.0]),
    ];
    let tried = if counts::is_deep() { 5 } else { 1 };
    for (tag, mount) in looks.into_iter().take(tried) {
        for (tag_off, mount_off) in offs {
            let world = World {
                tag,
                mount,
                tag_off,
                mount_off,
            };
            for (model, detector) in [
                ("stated", stated as fn([f64; 3]) -> _),
                ("learnt", learnt as fn([f64; 3]) -> _),
            ] {
                // The largest error at 3 m.
                let at = looking_from(&world, 3.0, 0.0, 0.0);
                let r = world.worst(at, &detector, &mut random, 0).unwrap()[0];
                let site = site(folder.path(), &text(&world, model, [r, 30.0], ""))
                    .unwrap_or_else(|error| panic!("{error}: {world:?}"));
                let task = site.task("look").unwrap();
                let mut found: f64 = 0.0;
                for _ in 0..500 {
                    let pose = looking_from(
                        &world,
                        random.within(1.0, 6.0),
                        random.within(-10.0, 10.0),
                        random.within(-20.0, 20.0),
                    );
                    if task.success.membership(pose).inside {
                        let worst = world.worst(pose, &detector, &mut random, 0).unwrap();
                        found = found.max(worst[0]);
                    }
                }
                assert!(
                    found * TIGHT >= r && found <= r + 1e-9,
                    "{model}: {r} m are promised, {found} m is the worst: {world:?}"
                );
            }
        }
    }
}

/// If a search for a tag's place moves the tag and increases its tolerance, still no error exceeds r.
#[test]
fn error_is_within_r_after_the_tag_is_moved() {
    let folder = folder();
    let mut random = Random(6);
    let mut inside = 0;
    for (model, detector) in [
        ("stated", stated as fn([f64; 3]) -> _),
        ("learnt", learnt as fn([f64; 3]) -> _),
    ] {
        let exact = two_metres([0.0, 0.0], [0.004, 0.3]);
        let r = [0.12, 2.5];
        let site = site(folder.path(), &text(&exact, model, r, "")).unwrap();
        let set = &site.task("look").unwrap().success;
        for ([x, y, z, yaw], off) in [
            ([3.0, 0.5, 0.5, 150.0], [0.02, 1.5]),
            ([4.0, 0.0, 1.4, 180.0], [0.0, 2.0]),
            ([4.0, 0.0, 0.5, 180.0], [0.05, 0.3]),
            ([4.0, 0.0, 0.5, 180.0], [0.0, 4.0]),
        ] {
            let moved = set.with_views_of(&site.tags["t7"].tag, |view| {
                view.tag.pose.x = x;
                view.tag.pose.y = y;
                view.tag.pose.z = z;
                view.tag.pose.yaw_deg = yaw;
                view.tag_tolerance.translation = off[0];
                view.tag_tolerance.turn_deg = off[1];
            });
            let world = World {
                tag: [[x, y, z], [0.0, 0.0, yaw]],
                tag_off: off,
                ..exact
            };
            for _ in 0..400 {
                let pose = looking_from(
                    &world,
                    random.within(0.8, 6.0),
                    random.within(-25.0, 25.0),
                    random.within(-60.0, 60.0),
                );
                if moved.membership(pose).inside {
                    inside += 1;
                    let worst = world.worst(pose, &detector, &mut random, 0).unwrap();
                    assert!(
                        worst[0] <= r[0] + 1e-9 && worst[1].to_degrees() <= r[1] + 1e-7,
                        "{model}: {worst:?} where {r:?} is promised: {world:?} at {pose:?}"
                    );
                }
            }
        }
    }
    assert!(inside > 400, "{inside}");
}

/// The cost of a view in a search for a tag's place is the bound plus the error from the tolerances.
#[test]
fn cost_of_a_view_includes_the_tolerances() {
    let folder = folder();
    let mut random = Random(7);
    for (tag_off, mount_off) in [
        ([0.0, 0.0], [0.0, 0.0]),
        ([0.03, 2.0], [0.0, 0.0]),
        ([0.0, 0.0], [0.02, 1.0]),
        ([0.01, 0.5], [0.005, 0.3]),
    ] {
        let world = two_metres(tag_off, mount_off);
        let site = site(folder.path(), &text(&world, "learnt", [0.5, 20.0], "")).unwrap();
        let task = Task {
            set: site.task("look").unwrap().success.clone(),
            tag: site.tags["t7"].tag,
            wall: None,
            reserve: site.tags["t7"].tolerance,
        };
        let cost = LearntCost::new(ViewBound::Learnt(&MODEL), 1e6, &task);
        for d in [1.0, 2.0, 3.5, 5.0] {
            let at = [d, 0.0, 0.05];
            let bounds = learnt(at);
            let pose = looking_from(&world, d, 0.0, 0.0);
            let worst = world.worst(pose, &|_| bounds, &mut random, 0).unwrap();
            let worst = 100.0 * worst[0] + worst[1].to_degrees();
            let stated_cost = cost.of_view(at);
            assert!(
                stated_cost >= worst - 1e-6 && stated_cost <= 1.1 * worst,
                "{stated_cost} {worst}: {world:?} from {d} m"
            );
        }
    }
}

fn run(folder: &Path, line: &str) -> (i32, String, String) {
    let ended = posegate_testkit::run::run(folder, line);
    (ended.code, ended.out, ended.err)
}

const CHAIN: &str = "
[task.dock]
kind = \"work\"
goal = { x = 1.7, y = 0.0, yaw_deg = 0.0 }
success = { shape = \"box\", x = [-0.3, 0.3], y = [-0.3, 0.3], yaw_deg = [-20.0, 20.0] }

[chain.c]
start = { x = 1.5, y = 0.0, yaw_deg = 0.0, bounded = { translation = 0.2, yaw_deg = 3.0 } }
steps = [
    { task = \"look\" },
    { navigate = [[1.5, 0.0, 0.0], [1.7, 0.0, 0.0]] },
    { task = \"dock\" },
]

[chain.start]
start = { x = 1.7, y = 0.0, yaw_deg = 0.0, bounded = { translation = 0.4, yaw_deg = 3.0 } }

[navigation]
model = { kind = \"bounded\", k_turn = 0.001, k_drift = 0.001, k_slip = 0.002 }
";

fn two_metres(tag_off: [f64; 2], mount_off: [f64; 2]) -> World {
    World {
        tag: [[4.0, 0.0, 0.5], [0.0, 0.0, 180.0]],
        mount: [[0.25, 0.0, 0.5], [0.0, 0.0, 0.0]],
        tag_off,
        mount_off,
    }
}

/// Checks every look of a successful chain or plan, from poses where the robot may be: the largest error is within its
/// bound.
fn holds(world: &World, site: &Site, report: &Value, random: &mut Random) {
    let mut looks = 0;
    for step in report["steps"].as_array().unwrap() {
        if step["type"] != "localization" {
            continue;
        }
        looks += 1;
        let number = |value: &Value| value.as_f64().unwrap();
        let promised = [number(&step["translation"]), number(&step["yaw_rad"])];
        let spread = [
            number(&step["spread"]["translation"]),
            number(&step["spread"]["yaw_rad"]),
        ];
        // The task's set, or that of the planner's look with this name.
        let task = step["task"].as_str().unwrap();
        let set = match site.tasks.get(task) {
            Some(task) => &task.success,
            None => &site.planner.looks[task].success,
        };
        let mut tried = 0;
        for _ in 0..200 {
            let pose: Vector = core::array::from_fn(|i| {
                let by = if i == 2 { spread[1] } else { spread[0] };
                number(&step["pose"][i]) + random.within(-by, by)
            });
            if !set.membership(pose).inside {
                continue;
            }
            tried += 1;
            let worst = world.worst(pose, &learnt, random, 0).unwrap();
            assert!(
                worst[0] <= promised[0] + 1e-9 && worst[1] <= promised[1] + 1e-9,
                "{worst:?} where {promised:?} is promised, at {pose:?} of {world:?}"
            );
        }
        assert!(tried > 50, "{tried} poses of {task}");
    }
    assert!(looks > 0);
}

/// A tag that may be turned by 2 degrees and displaced by 3 cm, seen from 2.3 m. A look with errors within 5 cm and 1
/// degree for an exact survey is impossible with this one. A look with larger allowed errors stays within its bound.
#[test]
fn larger_tolerance_makes_a_small_error_impossible() {
    let folder = folder();
    let mut random = Random(3);
    let loose = ([0.03, 2.0], [0.0, 0.0]);
    let mounted = ([0.0, 0.0], [0.03, 2.0]);
    let exact = ([0.0, 0.0], [0.0, 0.0]);
    let line = "chain site.toml --name c --json";
    let tried = [
        (exact, [0.05, 1.0], true),
        (loose, [0.05, 1.0], false),
        (mounted, [0.05, 1.0], false),
        (loose, [0.16, 2.5], true),
        (mounted, [0.12, 2.5], true),
    ];
    for ((tag_off, mount_off), r, serves) in tried {
        let world = two_metres(tag_off, mount_off);
        let text = text(&world, "learnt", r, CHAIN);
        std::fs::write(folder.path().join("site.toml"), &text).unwrap();
        let (code, out, err) = run(folder.path(), line);
        assert_eq!(
            code == 0,
            serves,
            "{tag_off:?} {mount_off:?} {r:?}\n{out}\n{err}"
        );
        if serves {
            let report: Value = serde_json::from_str(&out).unwrap();
            assert_eq!(report["success"], true);
            let site = site(folder.path(), &text).unwrap();
            holds(&world, &site, &report, &mut random);
        } else {
            // The cause is named.
            assert!(code == 2 && err.contains("toleranc"), "{out}\n{err}");
        }
    }
}

/// The planner generates looks only of tags with a small enough tolerance.
#[test]
fn planner_looks_only_at_tags_with_a_good_survey() {
    let folder = folder();
    let mut random = Random(5);
    let planner = format!(
        "{CHAIN}
[planner]
look = {{ camera = \"front\", d_max = 6.0, phi_max_deg = 35.0, psi_max_deg = 70.0, error_model = \"m\" }}
r = [[0.04, 1.0], [0.16, 3.0]]
"
    );
    let line = "plan site.toml --from start --to dock --most-risk 0.2 --json";
    let plan = |tag_off: [f64; 2], mount_off: [f64; 2], planner: &str| {
        let world = two_metres(tag_off, mount_off);
        let all = text(&world, "learnt", [0.3, 6.0], planner);
        // Only the planner's looks.
        let (before, after) = all.split_once("[task.look]").unwrap();
        let (_, after) = after.split_once("[task.dock]").unwrap();
        let (chain, rest) = after.split_once("[chain.c]").unwrap();
        let (_, rest) = rest.split_once("[chain.start]").unwrap();
        let text = format!("{before}[task.dock]{chain}[chain.start]{rest}");
        std::fs::write(folder.path().join("site.toml"), &text).unwrap();
        let (code, out, err) = run(folder.path(), line);
        (world, text, code, out, err)
    };
    for off in [[0.0, 0.0], [0.03, 2.0]] {
        for mount_off in [[0.0, 0.0], [0.01, 0.4]] {
            let (world, text, code, out, err) = plan(off, mount_off, &planner);
            assert_eq!(code, 0, "{off:?} {mount_off:?}\n{out}\n{err}");
            let report: Value = serde_json::from_str(&out).unwrap();
            let site = site(folder.path(), &text).unwrap();
            holds(&world, &site, &report, &mut random);
            // A look with the small error exists only if the survey is exact.
            assert_eq!(
                site.planner.looks.contains_key("t7@0.04"),
                off == [0.0, 0.0]
            );
            assert!(site.planner.looks.contains_key("t7@0.16"));
        }
    }
    // A tag whose tolerance exceeds every error is an error of the file.
    let (_, _, code, out, err) = plan(
        [0.03, 2.0],
        [0.0, 0.0],
        &planner.replace(", [0.16, 3.0]", ""),
    );
    assert!(
        code == 2 && err.contains("t7") && err.contains("toleranc"),
        "{out}\n{err}"
    );
}
