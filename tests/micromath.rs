//! `micromath` computes angles for telemetry, and cannot turn a denial into a permit: only one file of the core
//! names it, nothing that decides names that file, and wrong angles do not change answers.
#![cfg(feature = "std")]

#[path = "sight/scenes.rs"]
#[allow(dead_code)]
mod scenes;

use posegate::shape::Shape;
use posegate::sight::{Sighting, TagVisibility};
use scenes::{Random, about, rounded, scene};
use std::path::{Path, PathBuf};

const TELEMETRY: &str = "sight/telemetry.rs";

/// Returns every source file of the core by its path in `src`, and of the C boundary, without comments.
fn sources() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = sources_below(&root.join("src"), "");
    found.extend(sources_below(&root.join("crates/posegate-c/src"), "c/"));
    assert!(found.len() > 50);
    found
}

/// Returns the source files of a folder, with a prefix of their paths.
fn sources_below(root: &Path, before: &str) -> Vec<(String, String)> {
    let mut open: Vec<PathBuf> = vec![root.to_path_buf()];
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                let code = text
                    .lines()
                    .filter(|line| !line.trim_start().starts_with("//"))
                    .collect::<Vec<_>>()
                    .join("\n");
                let name = path.strip_prefix(root).unwrap().to_string_lossy();
                let name = format!("{before}{}", name.replace('\\', "/"));
                found.push((name, code));
            }
        }
    }
    found
}

/// Returns the faults of a file's code.
fn faults(name: &str, code: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let mut forbid = |word: &str, why: &str| {
        if code.contains(word) {
            faults.push(format!("{name} has `{word}`: {why}"));
        }
    };
    if name == TELEMETRY {
        // Telemetry takes a sighting by reference and returns a number: it makes no sighting, no answer and no set.
        for word in [
            "&mut",
            "TagVisibility",
            ".answer",
            "Scene",
            "-> Sighting",
            "-> Self",
            "static",
            "Cell",
            "crate::",
            "pub(",
        ] {
            forbid(word, "telemetry gives numbers only");
        }
        return faults;
    }
    forbid("micromath", "only the telemetry of `sight` may use it");
    forbid(
        "float_arithmetic, reason",
        "only telemetry reckons with floats",
    );
    let module = name.split(['/', '.']).next().unwrap();
    if name != "sight/mod.rs" {
        forbid("sight::telemetry", "only the module `sight` names it");
        if module == "sight" {
            forbid("telemetry", "only the head of the module names it");
        }
    }
    // Neither the module nor any deciding code reads an angle.
    let decides = [
        "num", "pose", "set", "report", "table", "contain", "sight", "gate", "wire", "c",
    ];
    if decides.contains(&module) {
        forbid("for_telemetry", "what decides reads no telemetry");
    }
    // Modules before the gate do not name the camera.
    if ["num", "pose", "set", "report", "table", "contain", "gate"].contains(&module) {
        forbid("crate::sight", "a permit depends on no sighting");
        forbid("Sighting", "a permit depends on no sighting");
    }
    faults
}

#[test]
fn micromath_is_named_in_one_file() {
    let sources = sources();
    let found: Vec<String> = sources
        .iter()
        .flat_map(|(name, code)| faults(name, code))
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
    let (_, telemetry) = sources.iter().find(|(name, _)| name == TELEMETRY).unwrap();
    assert!(telemetry.contains("use micromath::F32;"));
    // Its functions: two public ones that take a sighting, and a shared one.
    let heads: Vec<&str> = telemetry
        .lines()
        .filter(|line| line.contains("fn "))
        .map(str::trim)
        .collect();
    assert_eq!(
        heads,
        [
            "pub fn phi_rad_for_telemetry(&self) -> f32 {",
            "pub fn psi_rad_for_telemetry(&self) -> f32 {",
            "fn angle(cos_q30: i32) -> f32 {",
        ]
    );
}

#[test]
fn seeded_faults_are_detected() {
    for (name, code) in [
        ("contain/mod.rs", "use micromath::F32;"),
        ("gate/mod.rs", "use crate::sight::Scene;"),
        ("gate/mod.rs", "fn permits(&self, seen: Sighting)"),
        (
            "sight/scene.rs",
            "if sighting.phi_rad_for_telemetry() < 0.4 {",
        ),
        ("set/mod.rs", "sight::telemetry"),
        ("sight/telemetry.rs", "pub fn fix(seen: &mut Sighting) {"),
        ("sight/telemetry.rs", "fn seen() -> TagVisibility {"),
    ] {
        assert!(!faults(name, code).is_empty(), "{name}: {code}");
    }
}

fn with_cosines(phi: i32, psi: i32) -> Sighting {
    let (_, scene, pose) = scene(&mut Random(7));
    let mut sighting = scene.look(&rounded(pose));
    (sighting.cos_phi_q30, sighting.cos_psi_q30) = (phi, psi);
    sighting
}

/// The stated error: the angle of a cosine is correct to 3e-3 rad, for every value of an `i32`.
#[test]
fn angles_stay_within_stated_error() {
    let one = f64::from(1 << 30);
    let mut random = Random(8);
    let mut worst = 0.0f64;
    let ends = [0, 1, -1, 1 << 30, -(1 << 30), (1 << 30) - 1, 1 - (1 << 30)];
    let base = with_cosines(0, 0);
    for index in 0..200_000 {
        let [phi, psi] = [0, 1].map(|_| {
            ends.get(index)
                .copied()
                .unwrap_or_else(|| random.within(-one, one) as i32)
        });
        let mut sighting = base;
        (sighting.cos_phi_q30, sighting.cos_psi_q30) = (phi, psi);
        let computed = [
            sighting.phi_rad_for_telemetry(),
            sighting.psi_rad_for_telemetry(),
        ];
        for (computed, cos) in computed.into_iter().zip([phi, psi]) {
            let angle = (f64::from(cos) / one).acos();
            worst = worst.max((f64::from(computed) - angle).abs());
        }
    }
    println!("angles for telemetry are off by up to {worst} rad");
    assert!((2e-3..=3e-3).contains(&worst), "{worst}");
    for beyond in [i32::MIN, i32::MAX] {
        let angle = with_cosines(beyond, beyond).phi_rad_for_telemetry();
        assert!(
            (0.0..=core::f32::consts::PI + 3e-3).contains(&angle),
            "{angle}"
        );
    }
}

/// If telemetry disagrees with the definition, the answer agrees with the definition.
/// Telemetry does not change a sighting.
#[test]
fn wrong_angles_never_change_answers() {
    let mut random = Random(9);
    let (mut poses, mut misleading, mut permitting) = (0, 0, 0);
    while poses < 300_000 {
        let (success, scene, nominal) = scene(&mut random);
        let Shape::Visibility(set) = &success.shape else {
            unreachable!();
        };
        // Turned so that phi is near its limit, where a small error matters.
        let phi = success.membership(nominal).sight.unwrap().phi;
        let turn = set.phi_max_deg.to_radians() - phi;
        for _ in 0..20 {
            let mut pose = about(&mut random, nominal, 0.001);
            let side = if random.one_in(2) { 1.0 } else { -1.0 };
            pose[2] = nominal[2] + side * turn + random.within(-0.003, 0.003);
            let sighting = scene.look(&rounded(pose));
            let before = sighting;
            let computed = [
                sighting.phi_rad_for_telemetry(),
                sighting.psi_rad_for_telemetry(),
            ];
            assert_eq!((sighting, scene.look(&rounded(pose))), (before, before));
            let truth = success.membership(pose);
            let slack = |name| truth.slack.iter().find(|(of, _)| *of == name).unwrap().1;
            let limits = [set.phi_max_deg.min(90.0), set.psi_max_deg].map(f64::to_radians);
            for ((computed, limit), slack) in computed
                .into_iter()
                .zip(limits)
                .zip([slack("phi"), slack("psi")])
            {
                let says_inside = f64::from(computed) <= limit;
                if says_inside != (slack >= 0.0) {
                    misleading += 1;
                    permitting += usize::from(says_inside);
                }
            }
            match sighting.answer {
                TagVisibility::Visible => assert!(truth.inside),
                TagVisibility::NotVisible(_) => assert!(!truth.inside),
                TagVisibility::Unsure => (),
            }
            poses += 1;
        }
    }
    println!("{poses} poses: telemetry misleads of {misleading}, {permitting} of them outside");
    assert!(
        misleading > 1_000 && permitting > 400,
        "{misleading} {permitting}"
    );
}
