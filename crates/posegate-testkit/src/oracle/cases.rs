//! Reads the reference cases.

use super::{Camera, Pose, PoseSet, Set, World, chi2_quantile_3dof};
use serde_json::Value;
use std::path::PathBuf;

/// The variable that names the folder of the reference cases.
pub const FOLDER_VARIABLE: &str = "POSEGATE_CASES";

/// Returns the folder of the reference cases.
///
/// # Panics
/// If there is no such folder.
pub fn folder() -> PathBuf {
    let folder = std::env::var_os(FOLDER_VARIABLE).map(PathBuf::from);
    let folder = folder.unwrap_or_else(|| {
        panic!("{FOLDER_VARIABLE} names the folder of the reference cases: run `./ci.sh cases DIR`")
    });
    assert!(
        folder.is_dir(),
        "the reference cases are not at {}: set {FOLDER_VARIABLE} to their folder",
        folder.display()
    );
    folder
}

/// Returns the cases of one file of the folder, such as `containment.json`.
///
/// # Panics
/// If the file cannot be read or has no cases.
pub fn load(file: &str) -> Vec<Value> {
    let path = folder().join(file);
    let text = std::fs::read_to_string(&path)
        .unwrap_or_else(|e| panic!("{}: {e} ({FOLDER_VARIABLE})", path.display()));
    let whole: Value =
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let cases = list(&whole["cases"]).clone();
    assert!(!cases.is_empty(), "{}: no cases", path.display());
    cases
}

pub fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("not a number: {v}"))
}

pub fn list(v: &Value) -> &Vec<Value> {
    v.as_array().unwrap_or_else(|| panic!("not a list: {v}"))
}

pub fn text(v: &Value) -> &str {
    v.as_str().unwrap_or_else(|| panic!("not a text: {v}"))
}

/// Returns a list of exactly N numbers.
pub fn numbers<const N: usize>(v: &Value) -> [f64; N] {
    let all: Vec<f64> = list(v).iter().map(number).collect();
    all.try_into()
        .unwrap_or_else(|_| panic!("not {N} numbers: {v}"))
}

fn points(v: &Value) -> Vec<[f64; 2]> {
    list(v).iter().map(numbers).collect()
}

/// Returns a case's `set`.
pub fn set(v: &Value) -> Set {
    match text(&v["type"]) {
        "box" => Set::Box {
            x: numbers(&v["x"]),
            y: numbers(&v["y"]),
            yaw: numbers(&v["yaw"]),
        },
        "footprint" => Set::Footprint {
            footprint: points(&v["footprint"]),
            region: points(&v["region"]),
        },
        "visibility" => {
            let camera = &v["camera"];
            Set::Visibility {
                camera: Camera {
                    fx: number(&camera["fx_px"]),
                    fy: number(&camera["fy_px"]),
                    cx: number(&camera["cx_px"]),
                    cy: number(&camera["cy_px"]),
                    width: number(&camera["width_px"]),
                    height: number(&camera["height_px"]),
                },
                mount: numbers(&v["mount"]),
                tag_in_goal: numbers(&v["tag_in_goal"]),
                tag_size: number(&v["tag_size"]),
                d_max: number(&v["d_max"]),
                phi_max: number(&v["phi_max"]),
                psi_max: number(&v["psi_max"]),
                z_near: number(&v["z_near"]),
            }
        }
        other => panic!("no such set: {other}"),
    }
}

/// Returns a case's `goal` and `set`.
pub fn world(case: &Value) -> World {
    World {
        goal: numbers(&case["goal"]),
        set: set(&case["set"]),
    }
}

/// Returns a case's `estimate`.
pub fn estimate(case: &Value) -> Pose {
    numbers(&case["estimate"])
}

/// Returns a case's `pose_set`.
pub fn pose_set(v: &Value) -> PoseSet {
    match text(&v["type"]) {
        "gaussian" => {
            let rows = numbers_3x3(&v["covariance"]);
            PoseSet::Gaussian {
                cov: rows,
                r2: chi2_quantile_3dof(number(&v["epsilon"])),
            }
        }
        "bounded" => PoseSet::Bounded {
            translation: number(&v["translation"]),
            yaw: number(&v["yaw"]),
        },
        other => panic!("no such pose set: {other}"),
    }
}

fn numbers_3x3(v: &Value) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| numbers(&v[i]))
}
