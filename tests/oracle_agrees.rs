//! The oracle agrees with the reference cases and with itself, and a wrong set is detected.
#![cfg(not(target_os = "none"))]

#[path = "../crates/posegate-testkit/src/oracle/mod.rs"]
mod oracle;

use oracle::cases::{estimate, list, load, number, numbers, pose_set, text, world};
use oracle::*;
use serde_json::Value;

/// Returns `true` if `found` is not within `tolerance` of `expected` (NaN never is).
fn off(found: f64, expected: f64, tolerance: f64) -> bool {
    let error = (found - expected).abs();
    error.is_nan() || error > tolerance
}

/// Returns where a world's membership differs from a case's.
fn membership_differs(case: &Value, world: &World) -> Vec<String> {
    let (expected, tolerance) = (&case["expected"], &case["tolerance"]);
    let mut out = Vec::new();
    for (i, pose) in list(&case["poses"]).iter().enumerate() {
        let pose: Pose = numbers(pose);
        let q = to_goal(world.goal, pose);
        let within = expected["inside"][i].as_bool().expect("inside");
        if inside(&world.set, q) != within || world.inside(pose) != within {
            out.push(format!("pose {i}: inside is not {within}"));
        }
        let Some(seen) = sight(&world.set, q) else {
            continue;
        };
        if seen.seen != within {
            out.push(format!("pose {i}: seen is not {within}"));
        }
        for (name, found) in [("d", seen.d), ("phi", seen.phi), ("psi", seen.psi)] {
            if off(found, number(&expected[name][i]), number(&tolerance[name])) {
                out.push(format!("pose {i}: {name} is {found}"));
            }
        }
        for (k, corner) in seen.corners_px.iter().enumerate() {
            let wanted = &expected["corners_px"][i][k];
            let most = number(&tolerance["corners_px"]);
            let wrong = match corner {
                None => !wanted[0].is_null(),
                Some(_) if wanted[0].is_null() => true,
                Some(px) => {
                    let wanted: [f64; 2] = numbers(wanted);
                    // Relative if a corner is far outside the picture.
                    (0..2).any(|j| off(px[j], wanted[j], most * wanted[j].abs().max(1.0)))
                }
            };
            if wrong {
                out.push(format!("pose {i}: corner {k} is {corner:?}"));
            }
        }
    }
    out
}

/// Returns how a world's s* differs from a case's, and the relative difference.
fn containment_differs(case: &Value, world: &World) -> (Vec<String>, f64) {
    let expected = &case["expected"];
    let wanted = expected["s_star"].as_f64().unwrap_or(f64::INFINITY);
    let (about, set) = (estimate(case), pose_set(&case["pose_set"]));
    let found = scale(world, about, &set);
    let mut out = Vec::new();
    let error = if found == wanted {
        0.0
    } else {
        (found - wanted).abs() / wanted
    };
    if off(error, 0.0, number(&case["tolerance"]["s_star_relative"])) {
        out.push(format!("s* is {found}, not {wanted}"));
    }
    let least = min_slack_over(world, about, &set, 1.0, Effort::Full).0;
    if let Some(contained) = expected["contained"].as_bool() {
        if contained != (found >= 1.0) {
            out.push(format!("contained is not {contained}: s* = {found}"));
        }
        if contained != (least >= 0.0) {
            out.push(format!("contained is not {contained}: slack {least}"));
        }
    }
    // The reference's touching pose lies on the border of both sets.
    let touching: Pose = numbers(&expected["touching_pose"]);
    if wanted > 0.0 && wanted.is_finite() {
        let slack = world.slack(touching);
        if off(slack, 0.0, 1e-7) {
            out.push(format!("slack {slack} at the touching pose"));
        }
        let level = level(&set, about, touching);
        if level.is_nan() || level > wanted * (1.0 + 1e-6) {
            out.push(format!("the touching pose is at {level}, not {wanted}"));
        }
    }
    (out, error)
}

/// Returns the same set with its goal moved by `by` along the world's axes, and turned by `by` radians.
fn moved(world: &World, by: f64) -> World {
    World {
        goal: world.goal.map(|v| v + by),
        set: world.set.clone(),
    }
}

#[test]
#[ignore = "run by ci.sh cases DIR"]
fn membership_matches_reference() {
    for case in load("membership.json") {
        let (name, world) = (text(&case["name"]), world(&case));
        let differs = membership_differs(&case, &world);
        assert!(differs.is_empty(), "{name}: {differs:#?}");
    }
}

#[test]
#[ignore = "run by ci.sh cases DIR"]
fn membership_detects_a_moved_set() {
    for case in load("membership.json") {
        let (name, world) = (text(&case["name"]), world(&case));
        let differs = membership_differs(&case, &moved(&world, 0.01));
        assert!(!differs.is_empty(), "{name}: a shift went unnoticed");
    }
}

#[test]
#[ignore = "run by ci.sh cases DIR"]
fn containment_matches_reference() {
    let mut worst: f64 = 0.0;
    for case in load("containment.json") {
        let (name, world) = (text(&case["name"]), world(&case));
        let (differs, error) = containment_differs(&case, &world);
        assert!(differs.is_empty(), "{name}: {differs:#?}");
        worst = worst.max(error);
    }
    println!("largest relative error of s*: {worst:.3e}");
    assert!(
        worst < 1e-6,
        "the cases are good to 1e-6, the oracle is off by {worst:e}"
    );
}

#[test]
#[ignore = "run by ci.sh cases DIR"]
fn containment_detects_a_moved_set() {
    for case in load("containment.json") {
        let (name, world) = (text(&case["name"]), world(&case));
        if number(&case["expected"]["s_star"]) == 0.0 {
            continue;
        }
        let (differs, _) = containment_differs(&case, &moved(&world, 0.001));
        assert!(!differs.is_empty(), "{name}: a shift went unnoticed");
    }
}

#[test]
#[ignore = "run by ci.sh cases DIR"]
fn chi2() {
    for case in load("chi2.json") {
        let epsilon = number(&case["epsilon"]);
        let wanted = number(&case["expected"]["r2"]);
        let found = chi2_quantile_3dof(epsilon);
        assert!(
            !off(found, wanted, 1e-12 * wanted),
            "epsilon {epsilon}: {found}, not {wanted}"
        );
    }
}

/// Returns a roughly uniform random pose of the pose set scaled by `scale`, often on its border.
fn random_pose_in(rng: &mut Rng, set: &PoseSet, estimate: Pose, scale: f64) -> Pose {
    let ball = loop {
        let v = [0; 3].map(|_| rng.within(-1.0, 1.0));
        let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        if length <= 1.0 && length > 0.0 {
            break if rng.chance(0.7) {
                v.map(|c| c / length)
            } else {
                v
            };
        }
    };
    let e = match set {
        PoseSet::Gaussian { cov, r2 } => {
            let l = cholesky(cov);
            let r = scale * r2.sqrt();
            l.map(|row| r * row.iter().zip(ball).map(|(a, b)| a * b).sum::<f64>())
        }
        PoseSet::Bounded { translation, yaw } => {
            let (r, b) = (translation * rng.unit().sqrt(), rng.within(0.0, 7.0));
            let r = if rng.chance(0.7) { *translation } else { r };
            [
                scale * r * b.cos(),
                scale * r * b.sin(),
                (scale * yaw).min(std::f64::consts::PI) * rng.within(-1.0, 1.0),
            ]
        }
    };
    [estimate[0] + e[0], estimate[1] + e[1], estimate[2] + e[2]]
}

#[test]
fn no_sampled_pose_is_below_the_least_slack() {
    let mut rng = Rng::new(7);
    let (mut contained, mut not) = (0, 0);
    for round in 0..600 {
        let world = random_world(&mut rng).world;
        let about = pose_from_deg(random_estimate(&mut rng, &world));
        let set = if round % 2 == 0 {
            random_pose_set_near(&mut rng, &world, about).pose_set
        } else {
            random_pose_set(&mut rng).pose_set
        };
        let s = rng.log_within(0.3, 3.0);
        let (least, pose) = min_slack_over(&world, about, &set, s, Effort::Full);
        let what = || format!("round {round}: {world:?} {about:?} {set:?} scale {s}");
        // The pose returned has the slack returned and is in the pose set.
        assert!(
            !off(world.slack(pose), least, 1e-9 * (1.0 + least.abs())),
            "{}",
            what()
        );
        assert!(level(&set, about, pose) <= s * (1.0 + 1e-6), "{}", what());
        let (fast, pose) = min_slack_over(&world, about, &set, s, Effort::Fast);
        assert!(level(&set, about, pose) <= s * (1.0 + 1e-6), "{}", what());
        let tolerance = 2e-5 + 1e-3 * fast.abs();
        assert!(fast >= least - 1e-9 * (1.0 + least.abs()), "{}", what());
        assert!(fast <= least + tolerance, "{fast} {least} {}", what());
        for _ in 0..1000 {
            let pose = random_pose_in(&mut rng, &set, about, s);
            if level(&set, about, pose) > s {
                continue;
            }
            let tolerance = 1e-9 + 2e-8 * least.abs();
            assert!(
                world.slack(pose) >= least - tolerance,
                "{pose:?} {}",
                what()
            );
        }
        let star = scale(&world, about, &set);
        if least.abs() > 1e-8 {
            assert_eq!(least >= 0.0, star >= s, "s* {star} {least} {}", what());
        }
        if least >= 0.0 {
            contained += 1;
        } else {
            not += 1;
        }
    }
    assert!(contained > 100 && not > 100, "{contained} {not}");
}

/// Includes tilted tags and rolled mounts, which the reference cases do not have.
#[test]
fn sight_and_slack_agree() {
    let mut rng = Rng::new(23);
    let (mut seen, mut not) = (0, 0);
    for _ in 0..3000 {
        let world = random_world(&mut rng).world;
        for _ in 0..20 {
            let spread = rng.log_within(0.01, 1.0);
            let q = [0; 3].map(|_| spread * rng.within(-1.0, 1.0));
            let slack = slack(&world.set, q);
            let Some(sight) = sight(&world.set, q) else {
                break;
            };
            if slack.abs() > 1e-9 {
                assert_eq!(
                    sight.seen,
                    slack >= 0.0,
                    "{q:?} {slack} {sight:?} {world:?}"
                );
            }
            seen += usize::from(sight.seen);
            not += usize::from(!sight.seen);
        }
    }
    assert!(seen > 3000 && not > 3000, "{seen} {not}");
}

#[test]
fn scale_is_exact_at_its_extremes() {
    let free = World {
        goal: [1.0, 2.0, 3.0],
        set: Set::Box {
            x: [-0.1, 0.1],
            y: [-0.1, 0.1],
            yaw: [-3.2, 3.2],
        },
    };
    let turns = PoseSet::Bounded {
        translation: 0.0,
        yaw: 1.0,
    };
    assert_eq!(scale(&free, free.goal, &turns), f64::INFINITY);
    assert_eq!(scale(&free, [1.2, 2.0, 3.0], &turns), 0.0);
    let shifts = PoseSet::Bounded {
        translation: 0.05,
        yaw: 1.0,
    };
    assert!(!off(scale(&free, free.goal, &shifts), 2.0, 1e-9));
}
