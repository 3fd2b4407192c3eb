//! The controller's answer about visibility agrees with the definition (`posegate::shape`), for every
//! pose and site that its integers may represent.
#![cfg(feature = "std")]

mod extremes;
#[path = "../../crates/posegate-testkit/src/looks.rs"]
mod looks;
mod scenes;

use posegate::shape::{Membership, Shape, SuccessSet, Visibility};
use posegate::sight::{
    ANGLE_ERROR_UM, FailedConstraint, LENGTH_ERROR_UM, Scene, Sighting, TagVisibility,
};
use posegate::table::Table;
use scenes::{Random, about, corners, rounded, scene};
use std::collections::BTreeMap;

const SCENES: usize = 3_000;
const POSES: usize = 50;

fn visibility(success: &SuccessSet) -> &Visibility {
    let Shape::Visibility(set) = &success.shape else {
        panic!("a visibility set");
    };
    set
}

/// Returns the constraint of a slack's name.
fn why(name: &str) -> FailedConstraint {
    match name {
        "d" => FailedConstraint::Distance,
        "depth" => FailedConstraint::Depth,
        "phi" => FailedConstraint::Phi,
        "psi" => FailedConstraint::Psi,
        _ => FailedConstraint::Image,
    }
}

/// Returns the largest distance from the border of a pose whose answer is unsure, metres, by the error budget.
fn band(set: &Visibility) -> f64 {
    let camera = set.camera;
    let lengths = 2.0 * LENGTH_ERROR_UM.max(ANGLE_ERROR_UM) as f64;
    // Twice the reach in 2^-14 px, over the length of a side's normal.
    let reach = 2.0 * (set.d_max + 2.0 * set.tag.size + 1e-4) * 1e6;
    (lengths + 2.0 * reach / 16_384.0 / camera.fx.min(camera.fy)) * 1e-6
}

/// Compares an answer with the truth at a pose that the integer pose represents. Returns `true` if the answer is sure.
fn agrees(answer: TagVisibility, truth: &Membership, set: &Visibility) -> bool {
    match answer {
        TagVisibility::Visible => assert!(truth.inside, "visible: {truth:?}\n{set:?}"),
        TagVisibility::NotVisible(reason) => {
            let slack = truth.slack.iter();
            let least = slack
                .filter(|(name, _)| why(name) == reason)
                .map(|(_, slack)| *slack)
                .fold(f64::INFINITY, f64::min);
            assert!(least < 0.0, "not visible, {reason:?}: {truth:?}\n{set:?}");
        }
        TagVisibility::Unsure => {
            let near = |(_, slack): &(_, f64)| slack.abs() <= band(set);
            assert!(truth.slack.iter().any(near), "unsure: {truth:?}\n{set:?}");
        }
    }
    answer != TagVisibility::Unsure
}

/// Computes for each quantity of a sighting the largest error as a share of its stated bound.
fn telemetry(
    sighting: &Sighting,
    pose: [f64; 3],
    truth: &Membership,
    set: &Visibility,
    worst: &mut [f64; 4],
) {
    let sight = truth.sight.as_ref().unwrap();
    let mut note = |index: usize, off: f64, bound: f64| {
        worst[index] = worst[index].max(off.abs() / bound);
    };
    let q30 = f64::from(1 << 30);
    if sighting.d_um == u32::MAX {
        assert!(sight.d > 110.0 && sighting.corners == [None; 4]);
        return;
    }
    note(
        0,
        f64::from(sighting.d_um) - sight.d * 1e6,
        LENGTH_ERROR_UM as f64,
    );
    let cosine = 11.0 / (sight.d * 1e6) + 2f64.powi(-28);
    note(
        1,
        f64::from(sighting.cos_phi_q30) / q30 - sight.phi.cos(),
        cosine,
    );
    note(
        2,
        f64::from(sighting.cos_psi_q30) / q30 - sight.psi.cos(),
        cosine,
    );
    let camera = set.camera;
    let corners = corners(set, pose);
    for ((found, place), [x, y, z]) in sighting.corners.iter().zip(sight.corners_px).zip(corners) {
        // A corner at the depth z_near may be reported or not.
        assert!(found.is_some() == place.is_some() || (z - set.z_near).abs() < 6e-6);
        let (Some(found), Some(place)) = (found, place) else {
            continue;
        };
        let mut side = |found: i32, definition: f64, focal: f64, centre: f64, across: f64| {
            let off = focal * across / z;
            // The definition, repeated here.
            assert!((centre + off - definition).abs() <= 1e-9 * (1.0 + off.abs()) / z);
            if off.abs() < 1e6_f64.min(127.9 * focal) && z > 1e-3 {
                let bound = 6e-6 * (focal + off.abs()) / z
                    + (1.0 + off.abs() / focal) * 2f64.powi(-14)
                    + 2f64.powi(-7);
                note(3, f64::from(found) / 256.0 - (centre + off), bound);
            }
        };
        side(found.u_q8, place[0], camera.fx, camera.cx, x);
        side(found.v_q8, place[1], camera.fy, camera.cy, y);
    }
}

/// Random cameras, tags and poses, without a search.
#[test]
fn random_sightings_match_definition() {
    let mut random = Random(1);
    let mut answers: BTreeMap<String, usize> = BTreeMap::new();
    let mut worst = [0.0; 4];
    let (mut made, mut poses, mut unsure) = (0, 0, 0);
    while made < SCENES {
        let (success, scene, nominal) = scene(&mut random);
        let set = visibility(&success);
        made += 1;
        let d = set.d_max.min(20.0);
        for index in 0..POSES {
            let pose = if index == 0 {
                nominal
            } else {
                about(&mut random, nominal, d)
            };
            let truth = success.membership(pose);
            let sighting = scene.look(&rounded(pose));
            assert_eq!(sighting.tag, set.tag.id);
            let sure = agrees(sighting.answer, &truth, set);
            telemetry(&sighting, pose, &truth, set, &mut worst);
            poses += 1;
            unsure += usize::from(!sure);
            *answers.entry(format!("{:?}", sighting.answer)).or_default() += 1;
        }
    }
    println!("{made} scenes, {poses} poses: {answers:?}");
    println!("share of the bound: d, cos phi, cos psi, corners {worst:?}");
    let share = unsure as f64 / poses as f64;
    println!(
        "{{\"name\": \"sight: unsure of random poses\", \"value\": {share:e}, \"unit\": \"share\", \"goal\": 0.001}}"
    );
    assert!(poses >= 100_000 && share < 1e-3, "{poses} {share}");
    // Every answer occurs, and none rarely.
    for answer in [
        "Visible",
        "NotVisible(Distance)",
        "NotVisible(Depth)",
        "NotVisible(Image)",
        "NotVisible(Phi)",
        "NotVisible(Psi)",
    ] {
        assert!(answers.get(answer).copied().unwrap_or(0) > 500, "{answer}");
    }
    // The bounds hold, and they are not needlessly large.
    assert!(worst.iter().all(|share| *share <= 1.0), "{worst:?}");
    assert!(worst.iter().all(|share| *share > 0.15), "{worst:?}");
}

/// Poses on the border, found by a search, and some micrometres around it.
#[test]
fn answers_at_the_border_match_definition() {
    let mut random = Random(2);
    let (mut tried, mut unsure) = (0, 0);
    let mut borders: BTreeMap<String, usize> = BTreeMap::new();
    let mut sure_within = [0usize; 2];
    for _ in 0..5_000 {
        let (success, scene, nominal) = scene(&mut random);
        let set = visibility(&success);
        if !success.membership(nominal).inside {
            continue;
        }
        for _ in 0..10 {
            let Some(border) = border(&success, nominal, &mut random) else {
                continue;
            };
            let slack = success.membership(border).slack;
            let nearest = slack.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
            *borders.entry(nearest.to_string()).or_default() += 1;
            for _ in 0..6 {
                let reach = if random.one_in(2) { 8e-6 } else { 80e-6 };
                let pose = [
                    border[0] + random.within(-reach, reach),
                    border[1] + random.within(-reach, reach),
                    border[2],
                ];
                let truth = success.membership(pose);
                let answer = scene.look(&rounded(pose)).answer;
                tried += 1;
                if agrees(answer, &truth, set) {
                    sure_within[usize::from(truth.inside)] += 1;
                } else {
                    unsure += 1;
                }
            }
        }
    }
    assert!(tried > 50_000);
    println!("{tried} at the border: {unsure} unsure, sure and outside, inside: {sure_within:?}");
    println!("borders: {borders:?}");
    for border in [
        "d",
        "depth",
        "phi",
        "psi",
        "image_left",
        "image_right",
        "image_top",
        "image_bottom",
    ] {
        assert!(borders.get(border).copied().unwrap_or(0) > 50, "{border}");
    }
    assert!(sure_within.iter().all(|count| *count > tried / 20));
    assert!(unsure > tried / 20);
}

/// Returns a pose of the border on a random line through a pose inside, to 1e-9 m and rad.
fn border(success: &SuccessSet, inside: [f64; 3], random: &mut Random) -> Option<[f64; 3]> {
    let d = visibility(success).d_max;
    let to = about(random, inside, d);
    let at = |t: f64| [0, 1, 2].map(|axis| inside[axis] + t * (to[axis] - inside[axis]));
    if success.membership(to).inside {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    while (high - low) * (d + 1.0) > 1e-10 {
        let middle = 0.5 * (low + high);
        if success.membership(at(middle)).inside {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(at(low))
}

/// Digests every bit of the sightings from four thousand poses, so that any change of a rounding is detected. The
/// emulated cores make the same digest (`examples/count_instructions.rs`).
#[test]
fn sighting_digest_is_unchanged() {
    let path = "examples/tables/see-t7.posegate";
    let bytes = std::fs::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap();
    let scene = Scene::of(&Table::parse(&bytes).unwrap()).unwrap();
    let mut poses = looks::Looks::new();
    let (mut digest, mut visible) = (0, 0);
    for _ in 0..looks::LOOKS {
        let sighting = scene.look(&poses.pose());
        visible += usize::from(sighting.answer == TagVisibility::Visible);
        digest = looks::added(digest, &sighting);
    }
    assert!(visible > 200, "{visible}");
    assert_eq!(digest, looks::SEE_T7, "{digest:#x}");
}
