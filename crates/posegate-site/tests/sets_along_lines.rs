//! Success sets along a line: the intervals of a walk agree with the membership of its points.

use posegate::shape::{LineClipper, LineSegment, PoseDeg, Scalar, SuccessSet};
use posegate_site::Site;

const SITE: &str = r#"
[camera.front]
width_px = 640
height_px = 480
fx = 415.0
fy = 410.0
cx = 322.0
cy = 236.0
mount = { x = 0.25, y = -0.05, z = 0.4, roll_deg = 2.0, pitch_deg = -9.0, yaw_deg = 5.0 }

[tag.t7]
id = 7
family = "tag36h11"
size = 0.30
pose = { x = 3.0, y = 0.1, z = 0.9, roll_deg = 1.0, pitch_deg = 3.0, yaw_deg = 170.0 }

[tag.t8]
id = 8
family = "tag36h11"
size = 0.20
pose = { x = 3.0, y = -0.9, z = 0.9, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 160.0 }

[wall.post]
corners = [[1.9, 0.2], [1.8, 0.2], [1.8, 0.1], [1.9, 0.1]]
z = [0.0, 2.0]

[error_model.m]
translation = [0.005, 0.002, 0.01, 0.01]
yaw_deg = [0.1, 0.05, 0.2, 0.5]

[task.a]
kind = "work"
goal = { x = 0.5, y = -0.25, yaw_deg = 10.0 }
success = SET
"#;

/// A set of each kind, with the lens and the tolerance of its site.
const SETS: [(&str, &str, &str); 14] = [
    ("{ VIEW }", "", ""),
    (
        "{ VIEW }",
        "distortion = { model = \"plumb_bob\", coefficients = [-0.25, 0.07, 1e-3, -1e-3, 0.0] }\nimage = \"raw\"",
        "",
    ),
    (
        "{ VIEW }",
        "mount_tolerance = { translation = 0.01, angle_deg = 1.0 }",
        "tolerance = { translation = 0.02, yaw_deg = 2.0 }",
    ),
    ("{ VIEW, d_min = 1.5 }", "", ""),
    (
        "{ VIEW, psi_min_deg = 20.0 }",
        "",
        "tolerance = { translation = 0.02, yaw_deg = 2.0 }",
    ),
    ("{ VIEW, px_per_bit_min = 5.0 }", "", ""),
    ("{ VIEW, walls = [\"post\"] }", "", ""),
    (
        "{ VIEW, error_model = \"m\", r = { translation = 0.02, yaw_deg = 0.5 } }",
        "",
        "",
    ),
    (
        "{ all = [{ VIEW }, { shape = \"box\", x = [-1.0, 0.6], y = [-0.4, 0.9], yaw_deg = [-10.0, 12.0] }] }",
        "",
        "",
    ),
    ("{ any = [{ VIEW, d_min = 1.0 }, { VIEW8 }] }", "", ""),
    ("{ all = [{ VIEW }, { VIEW8 }] }", "", ""),
    (
        "{ shape = \"footprint\", footprint = [[0.4, 0.2], [-0.4, 0.2], [-0.4, -0.2], [0.4, -0.2]], region = [[1.5, 1.0], [-1.5, 1.0], [-1.0, -1.0], [1.5, -1.0]] }",
        "",
        "",
    ),
    // More pairs of corners and edges than are evaluated at a time.
    (
        "{ shape = \"footprint\", footprint = [[0.4, 0.1], [0.3, 0.2], [-0.3, 0.2], [-0.4, 0.1], [-0.4, -0.2], [0.4, -0.2]], region = [[1.5, 0.8], [1.2, 1.0], [-1.2, 1.0], [-1.5, 0.8], [-1.2, -0.8], [-1.0, -1.0], [1.5, -1.0]] }",
        "",
        "",
    ),
    (
        "{ shape = \"clear\", footprint = [[0.4, 0.2], [-0.4, 0.2], [-0.4, -0.2], [0.4, -0.2]], obstacle = [[1.7, 0.5], [0.9, 0.5], [1.2, -0.4]] }",
        "",
        "",
    ),
];

fn set([text, camera, tag]: [&str; 3]) -> SuccessSet {
    let view = |tag: &str| {
        format!(
            "shape = \"visibility\", camera = \"front\", tag = \"{tag}\", d_max = 3.6, phi_max_deg = 28.0, psi_max_deg = 50.0"
        )
    };
    let text = text
        .replace("VIEW8", &view("t8"))
        .replace("VIEW", &view("t7"));
    let text = if text.contains("walls") || !text.contains("visib") {
        text
    } else {
        text.replace("psi_max_deg = 50.0", "psi_max_deg = 50.0, walls = []")
    };
    let site = SITE
        .replace("SET", &text)
        .replace(
            "yaw_deg = 5.0 }\n",
            &format!("yaw_deg = 5.0 }}\n{camera}\n"),
        )
        .replace(
            "yaw_deg = 170.0 }\n",
            &format!("yaw_deg = 170.0 }}\n{tag}\n"),
        );
    let site = Site::parse(&site, "site.toml").unwrap_or_else(|error| panic!("{error}"));
    site.tasks["a"].success.clone()
}

/// Returns a number in [0, 1) from a counter (splitmix64).
fn unit(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Every pose of a walk agrees with membership, except within 1e-9 of an end. Both sides of an end are
/// checked.
#[test]
fn walks_agree_with_membership() {
    let mut state = 7;
    for (index, (text, camera, tag)) in SETS.into_iter().enumerate() {
        let set = set([text, camera, tag]);
        let along = LineClipper::of(&set);
        let (mut ends, mut inside) = (0, 0);
        for _ in 0..400 {
            let mut within = |lo: f64, hi: f64| lo + (hi - lo) * unit(&mut state);
            let yaw = within(-0.5, 0.5);
            let angle = within(0.0, core::f64::consts::TAU);
            let stride = within(0.1, 2.0);
            let walk = LineSegment {
                from: [within(-1.5, 1.5), within(-1.5, 1.5)],
                way: [stride * libm::cos(angle), stride * libm::sin(angle)],
                length: within(1.0, 4.0),
            };
            let headed = along.at(yaw);
            let stretches = headed.stretches(&walk);
            // Views that are intersected together give the same intervals, bit for bit, with the same numbers.
            let (same, seen) = headed.stretches_and_seen(&walk);
            assert_eq!(same, stretches, "{text}");
            for view in 0..along.views() {
                let own = seen.iter().filter(|(of, _)| *of == view);
                let own: Vec<_> = own.map(|(_, interval)| *interval).collect();
                assert_eq!(own, headed.seen(view, &walk), "{text}: view {view}");
            }
            let mut places: Vec<f64> = (0..20).map(|_| within(0.0, walk.length)).collect();
            for stretch in &stretches {
                for end in [stretch.from, stretch.to] {
                    places.extend([end - 1e-8, end + 1e-8]);
                    ends += u32::from(end > 0.0 && end < walk.length);
                }
            }
            for t in places {
                let near = |end: f64| (t - end).abs() < 1e-9;
                if t < 0.0
                    || t > walk.length
                    || stretches.iter().any(|s| near(s.from) || near(s.to))
                {
                    continue;
                }
                let [x, y] = walk.at(t);
                let membership = set.membership(world(set.goal, [x, y, yaw]));
                let least = membership.slack.iter().map(|(_, slack)| *slack);
                let least = least.fold(f64::INFINITY, f64::min);
                let found = stretches.iter().any(|s| s.from <= t && t <= s.to);
                // Such a thin set may lie between two samples of a lens's border.
                assert!(
                    found == membership.inside || least.abs() < 1e-4 && index == 1,
                    "{text} at {x} {y} {yaw}: {found}, slack {least:e}, {stretches:?}, {t}"
                );
                inside += u32::from(found);
                if along.views() == 1 && membership.inside {
                    let sight = membership.sight.unwrap();
                    let [d, phi, psi] = headed.sight(0, &walk).at(t);
                    let off = [d - sight.d, phi - sight.phi, psi - sight.psi];
                    assert!(off.iter().all(|off| off.abs() < 1e-12), "{text}: {off:?}");
                }
            }
        }
        assert!(
            ends > 50 && inside > 300,
            "{text}: {ends} ends, {inside} inside"
        );
    }
}

fn world(goal: PoseDeg, [x, y, yaw]: [f64; 3]) -> [f64; 3] {
    let [c, s] = f64::cos_sin_deg(goal.yaw_deg);
    [
        goal.x + c * x - s * y,
        goal.y + s * x + c * y,
        yaw + goal.yaw_deg.to_radians(),
    ]
}

#[test]
fn yaw_arcs_end_at_their_headings() {
    let (text, ..) = SETS[8];
    let along = LineClipper::of(&set([text, "", ""]));
    let ends = along.ends_of_arcs();
    assert_eq!(ends, [-10f64, 12.0].map(f64::to_radians));
    assert_eq!(along.views(), 1);
    let standing = LineSegment {
        from: [-0.5, 0.0],
        way: [1.0, 0.0],
        length: 0.5,
    };
    assert!(along.at(ends[1] + 1e-9).stretches(&standing).is_empty());
    assert!(!along.at(ends[1] - 1e-9).stretches(&standing).is_empty());
}

/// Returns three numbers from -0.5 to 0.5 that look random.
fn shares(k: u32) -> [f64; 3] {
    let share = |base: u32| f64::from(k.wrapping_mul(base) >> 16 & 0xffff) / 65_536.0 - 0.5;
    [2_654_435_761, 2_246_822_519, 3_266_489_917].map(share)
}

/// At poses of every task of some sites, half of them near the goal, because sets may be small.
#[test]
fn least_slack_equals_the_least_of_membership() {
    let bay = include_str!("../../../examples/sites/loading-bay.toml");
    let lens = include_str!("../../../examples/sites/lens.toml");
    for text in [posegate_site::SAMPLE, bay, lens] {
        let site = posegate_site::Site::parse(text, "site.toml").unwrap();
        for (name, task) in &site.tasks {
            let evaluator = task.success.evaluator();
            let goal = task.success.goal;
            let mut inside = 0;
            for k in 0..2_000_u32 {
                let [x, y, yaw] = shares(k);
                let near = if k % 2 == 0 { 1.0 } else { 0.03 };
                let pose = [
                    goal.x + near * 6.0 * x,
                    goal.y + near * 4.0 * y,
                    goal.yaw_deg.to_radians() + near * 0.8 * yaw,
                ];
                let known = task.success.membership(pose);
                let slacks = known.slack.iter().map(|(_, slack)| *slack);
                let least = evaluator.least(pose);
                let expected = slacks.fold(f64::INFINITY, f64::min);
                assert_eq!(least.slack, expected, "{name}: {pose:?}");
                assert!(known.slack.contains(&(least.name, least.slack)), "{name}");
                assert_eq!(evaluator.holds(pose), known.inside, "{name}: {pose:?}");
                inside += u32::from(known.inside);
            }
            assert!(inside > 0, "{name}");
        }
    }
}

#[test]
fn view_evaluator_agrees_with_membership() {
    let site = posegate_site::Site::parse(posegate_site::SAMPLE, "site.toml").unwrap();
    let set = &site.task("see-t7").unwrap().success;
    let watch = set.evaluator();
    let mut both = [0; 2];
    for k in 0..20_000_u32 {
        let [x, y, yaw] = shares(k);
        let pose = [9.0 * x, 6.0 * y, 3.0 * yaw];
        let known = set.membership(pose);
        let near = known.slack.iter().any(|(_, slack)| slack.abs() < 1e-9);
        match watch.at(pose) {
            Some([d, phi, psi]) => {
                let sight = known.sight.unwrap();
                assert!(known.inside || near, "{pose:?}");
                let off = (d - sight.d).abs() + (phi - sight.phi).abs() + (psi - sight.psi).abs();
                assert!(off < 1e-12, "{pose:?}");
                both[0] += 1;
            }
            None => {
                assert!(!known.inside || near, "{pose:?}");
                both[1] += 1;
            }
        }
    }
    assert!(both.iter().all(|count| *count > 1_000), "{both:?}");
}
