//! The reference cases of an independent implementation, through the command line.
//!
//! Run by `ci.sh cases DIR` with the folder in `POSEGATE_CASES`; a missing folder fails.

use posegate_testkit::run::run as posegate;
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

fn cases(file: &str) -> Vec<Value> {
    let folder = std::env::var("POSEGATE_CASES")
        .expect("POSEGATE_CASES names the folder of the reference cases: run `./ci.sh cases DIR`");
    let path = Path::new(&folder).join(file);
    let text = std::fs::read_to_string(&path)
        .unwrap_or_else(|error| panic!("{}: {error}: run `./ci.sh cases DIR`", path.display()));
    let whole: Value = serde_json::from_str(&text).unwrap();
    let list = whole["cases"].as_array().unwrap().clone();
    assert!(!list.is_empty());
    list
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect()
}

fn deg(value: &Value) -> f64 {
    value.as_f64().unwrap().to_degrees()
}

/// Returns a site file of a case, with its set as the task `t`.
fn site(case: &Value, epsilon: f64, table: &str) -> String {
    let goal = numbers(&case["goal"]);
    let set = &case["set"];
    let mut site = String::new();
    let success = match set["type"].as_str().unwrap() {
        "box" => {
            let yaw = numbers(&set["yaw"]);
            format!(
                "{{ shape = \"box\", x = {}, y = {}, yaw_deg = [{:?}, {:?}] }}",
                set["x"],
                set["y"],
                yaw[0].to_degrees(),
                yaw[1].to_degrees()
            )
        }
        "footprint" => format!(
            "{{ shape = \"footprint\", footprint = {}, region = {} }}",
            set["footprint"], set["region"]
        ),
        "visibility" => {
            let camera = &set["camera"];
            let pose = |v: &Value| {
                let v = numbers(v);
                format!(
                    "{{ x = {:?}, y = {:?}, z = {:?}, roll_deg = {:?}, pitch_deg = {:?}, yaw_deg = {:?} }}",
                    v[0],
                    v[1],
                    v[2],
                    v[3].to_degrees(),
                    v[4].to_degrees(),
                    v[5].to_degrees()
                )
            };
            writeln!(
                site,
                "[camera.c]\nwidth_px = {}\nheight_px = {}\nfx = {}\nfy = {}\ncx = {}\ncy = {}\nmount = {}\n\
                 [tag.a]\nid = 1\nfamily = \"tag36h11\"\nsize = {}\npose = {}",
                camera["width_px"],
                camera["height_px"],
                camera["fx_px"],
                camera["fy_px"],
                camera["cx_px"],
                camera["cy_px"],
                pose(&set["mount"]),
                set["tag_size"],
                pose(&set["tag_in_world"]),
            )
            .unwrap();
            format!(
                "{{ shape = \"visibility\", camera = \"c\", tag = \"a\", d_max = {}, phi_max_deg = {:?}, psi_max_deg = {:?}, z_near = {} }}",
                set["d_max"],
                deg(&set["phi_max"]),
                deg(&set["psi_max"]).min(90.0),
                set["z_near"]
            )
        }
        other => panic!("a set of type {other}"),
    };
    writeln!(
        site,
        "[task.t]\nkind = \"work\"\ngoal = {{ x = {:?}, y = {:?}, yaw_deg = {:?} }}\nsuccess = {success}\n{table}\n\
         [confidence]\nepsilon = {epsilon:?}",
        goal[0],
        goal[1],
        goal[2].to_degrees()
    )
    .unwrap();
    site
}

fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_path_buf();
    (folder, path)
}

/// Returns a site file with a chain of one drive.
fn drive(case: &Value) -> String {
    let rows = |value: &Value| {
        let row = |row: &Value| format!("{:?}", numbers(row));
        let rows: Vec<_> = value.as_array().unwrap().iter().map(row).collect();
        format!("[{}]", rows.join(", "))
    };
    let path: Vec<String> = case["path"]
        .as_array()
        .unwrap()
        .iter()
        .map(|place| {
            let place = numbers(place);
            format!(
                "[{:?}, {:?}, {:?}]",
                place[0],
                place[1],
                place[2].to_degrees()
            )
        })
        .collect();
    let start = numbers(&case["path"][0]);
    let parameters = &case["parameters"];
    let gain = |name: &str| format!("{name} = {:?}", parameters[name].as_f64().unwrap());
    let (known, model) = if case["model"] == "gaussian" {
        (
            format!("covariance = {}, epsilon = 0.99", rows(&case["covariance"])),
            format!(
                "kind = \"gaussian\", {}",
                ["a1", "a2", "a3", "a4"].map(gain).join(", ")
            ),
        )
    } else {
        (
            format!(
                "bounded = {{ translation = {:?}, yaw_deg = {:?} }}",
                case["translation"].as_f64().unwrap(),
                deg(&case["yaw"])
            ),
            format!(
                "kind = \"bounded\", {}",
                ["k_turn", "k_drift", "k_slip"].map(gain).join(", ")
            ),
        )
    };
    format!(
        "[chain.c]\nstart = {{ x = {:?}, y = {:?}, yaw_deg = {:?}, {known} }}\n\
         steps = [{{ navigate = [{}], model = {{ {model} }} }}]\n",
        start[0],
        start[1],
        start[2].to_degrees(),
        path.join(", ")
    )
}

/// Sets grow along paths as in the reference, for both models and both modes. The path is driven exactly from the
/// start.
#[test]
#[ignore = "run by ci.sh cases DIR"]
fn navigation() {
    let mut kinds = [0, 0];
    for case in cases("navigation.json") {
        let name = &case["name"];
        let (_keep, folder) = folder();
        std::fs::write(folder.join("site.toml"), drive(&case)).unwrap();
        let tolerance = |expected: f64| {
            case["tolerance"]["absolute"].as_f64().unwrap()
                + case["tolerance"]["relative"].as_f64().unwrap() * expected.abs()
        };
        for assume in ["at-goal", "general"] {
            let command = format!("chain site.toml --name c --assume {assume}");
            let line = posegate(&folder, &format!("{command} --json")).json(0);
            assert_eq!(line["success"], true, "{name}");
            let step = &line["steps"][0];
            assert_eq!(step["type"], "navigation");
            let close = |got: &Value, expected: &Value, what: &str| {
                let (got, expected) = (got.as_f64().unwrap(), expected.as_f64().unwrap());
                assert!(
                    (got - expected).abs() <= tolerance(expected),
                    "{name} {what}: {got}, expected {expected}"
                );
            };
            let expected = &case["expected"];
            if case["model"] == "gaussian" {
                for row in 0..3 {
                    for column in 0..3 {
                        close(
                            &step["covariance"][row][column],
                            &expected["covariance"][row][column],
                            "covariance",
                        );
                    }
                }
                kinds[0] += 1;
            } else {
                close(
                    &step["translation"],
                    &expected["translation"],
                    "translation",
                );
                close(&step["yaw_rad"], &expected["yaw"], "yaw");
                kinds[1] += 1;
            }
        }
    }
    assert!(kinds.iter().all(|count| *count > 0), "{kinds:?}");
    println!("navigation: {kinds:?} growths");
}

#[test]
#[ignore = "run by ci.sh cases DIR"]
fn membership() {
    for case in cases("membership.json") {
        let name = &case["name"];
        let (_keep, folder) = folder();
        std::fs::write(folder.join("site.toml"), site(&case, 0.99, "")).unwrap();
        let mut csv = String::from("x_m,y_m,yaw_rad\n");
        for pose in case["poses"].as_array().unwrap() {
            let pose = numbers(pose);
            writeln!(csv, "{:?},{:?},{:?}", pose[0], pose[1], pose[2]).unwrap();
        }
        std::fs::write(folder.join("poses.csv"), csv).unwrap();
        let line = "contains site.toml --task t --poses poses.csv --json";
        let answers = posegate(&folder, line).with(0).lines();
        let expected = &case["expected"];
        let inside = expected["inside"].as_array().unwrap();
        assert_eq!(answers.len(), inside.len(), "{name}");
        let tolerance = |key: &str| case["tolerance"][key].as_f64().unwrap();
        for (index, (answer, inside)) in answers.iter().zip(inside).enumerate() {
            assert_eq!(&answer["inside"], inside, "{name} pose {index}: {answer}");
            if expected.get("d").is_none() {
                continue;
            }
            let close = |got: f64, key: &str| {
                let want = expected[key][index].as_f64().unwrap();
                assert!(
                    (got - want).abs() <= tolerance(key),
                    "{name} pose {index} {key}: {got} {want}"
                );
            };
            close(answer["d"].as_f64().unwrap(), "d");
            close(answer["phi_deg"].as_f64().unwrap().to_radians(), "phi");
            close(answer["psi_deg"].as_f64().unwrap().to_radians(), "psi");
            for corner in 0..4 {
                for axis in 0..2 {
                    let got = &answer["corners_px"][corner][axis];
                    let want = &expected["corners_px"][index][corner][axis];
                    match (got.as_f64(), want.as_f64()) {
                        (Some(got), Some(want)) => {
                            let limit = tolerance("corners_px").max(1e-9 * want.abs());
                            assert!((got - want).abs() <= limit, "{name} {index}: {got} {want}");
                        }
                        (None, None) => {}
                        _ => panic!("{name} pose {index} corner {corner}: {got} for {want}"),
                    }
                }
            }
        }
    }
}

/// There is no permit if the set is not contained, and no margin above the true scale. The worst pose is a
/// pose of the set. The answers are not needlessly strict.
#[test]
#[ignore = "run by ci.sh cases DIR"]
fn containment() {
    let mut ratios = Vec::new();
    let mut permits = 0;
    for case in cases("containment.json") {
        let name = case["name"].as_str().unwrap();
        let set = &case["set"];
        let (x, y, yaw, step) = match set["type"].as_str().unwrap() {
            "box" => {
                let yaw = numbers(&set["yaw"]);
                (
                    set["x"].to_string(),
                    set["y"].to_string(),
                    [yaw[0].to_degrees(), yaw[1].to_degrees()],
                    "{ xy = 0.002, yaw_deg = 0.25 }",
                )
            }
            "footprint" => (
                "[-1.5, 1.5]".into(),
                "[-1.5, 1.5]".into(),
                [-45.0, 45.0],
                "{ xy = 0.01, yaw_deg = 0.5 }",
            ),
            _ => (
                "[-4.0, 4.0]".into(),
                "[-4.0, 4.0]".into(),
                [-60.0, 60.0],
                "{ xy = 0.02, yaw_deg = 0.5 }",
            ),
        };
        let pose_set = &case["pose_set"];
        let epsilon = pose_set["epsilon"].as_f64().unwrap_or(0.99);
        let table = format!(
            "[task.t.table]\nextent = {{ x = {x}, y = {y}, yaw_deg = [{:?}, {:?}] }}\nstep = {step}",
            yaw[0], yaw[1]
        );
        let (_keep, folder) = folder();
        std::fs::write(folder.join("site.toml"), site(&case, epsilon, &table)).unwrap();
        posegate(&folder, "table build site.toml --task t -o t.posegate").with(0);
        let estimate = numbers(&case["estimate"]);
        let mut csv =
            String::from("x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n");
        let mut set = String::new();
        write!(csv, "{:?},{:?},{:?}", estimate[0], estimate[1], estimate[2]).unwrap();
        if pose_set["type"] == "gaussian" {
            for (row, column) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
                write!(csv, ",{}", pose_set["covariance"][row][column]).unwrap();
            }
        } else {
            csv.push_str(",0,0,0,0,0,0");
            let yaw_deg = deg(&pose_set["yaw"]);
            let translation = &pose_set["translation"];
            set = format!("--set bounded --translation {translation} --yaw-deg {yaw_deg:?}");
        }
        csv.push('\n');
        std::fs::write(folder.join("e.csv"), csv).unwrap();
        let gate = format!("gate t.posegate --estimates e.csv --json {set}");
        let output = posegate(&folder, &gate);
        let answer = &output.lines()[0];
        let truth = case["expected"]["s_star"].as_f64().unwrap_or(f64::INFINITY);
        let permit = answer["verdict"] == "permit";
        assert_eq!(output.code, i32::from(!permit), "{name}");
        if case["expected"]["contained"] == false {
            assert!(!permit, "{name}: FALSE PERMIT: {answer}");
        }
        permits += usize::from(permit);
        let margin = answer["margin"].as_f64().unwrap();
        assert_eq!(margin >= 1.0, permit, "{name}: {answer}");
        assert!(
            margin <= truth * (1.0 + 2e-4),
            "{name}: margin {margin} above {truth}"
        );
        if truth > 0.0 && truth.is_finite() {
            ratios.push(margin / truth);
            eprintln!(
                "{name}: margin {margin:.4} of {truth:.4} = {:.3}",
                margin / truth
            );
        }
        // A set that is not proven inside, though it is nearly inside, may have no pose that is outside.
        let is_named = !answer["worst_pose"].is_null();
        assert!(permit || is_named || truth > 0.95, "{name}: {answer}");
        if !permit && is_named {
            let worst = numbers(&answer["worst_pose"]);
            assert!(
                level(pose_set, &estimate, &worst) <= 1.0,
                "{name}: {answer} is no pose of the set"
            );
        }
    }
    ratios.sort_by(f64::total_cmp);
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!(
        "{} scales, mean ratio {mean:.4}, least {:.4}, {permits} permits",
        ratios.len(),
        ratios[0]
    );
    assert!(
        permits >= 15 && mean >= 0.93,
        "needlessly strict: {permits} permits, mean ratio {mean}"
    );
}

/// Returns the scale of the pose-set at which a pose lies on its border: 1 on the set's own border.
fn level(pose_set: &Value, estimate: &[f64], pose: &[f64]) -> f64 {
    let turn = std::f64::consts::TAU;
    let yaw = pose[2] - estimate[2];
    let e = [
        pose[0] - estimate[0],
        pose[1] - estimate[1],
        yaw - turn * (yaw / turn).round(),
    ];
    if pose_set["type"] == "bounded" {
        let translation = pose_set["translation"].as_f64().unwrap();
        let yaw = pose_set["yaw"].as_f64().unwrap();
        return (e[0].hypot(e[1]) / translation).max(e[2].abs() / yaw);
    }
    let p = nalgebra::Matrix3::from_fn(|i, j| pose_set["covariance"][i][j].as_f64().unwrap());
    let e = nalgebra::Vector3::from_column_slice(&e);
    let square = (e.transpose() * p.try_inverse().unwrap() * e)[0];
    let r2 = posegate::confidence::radius_squared(pose_set["epsilon"].as_f64().unwrap()).unwrap();
    (square / r2).sqrt()
}

#[test]
#[ignore = "run by ci.sh cases DIR"]
fn chi_square() {
    for case in cases("chi2.json") {
        let epsilon = case["epsilon"].as_f64().unwrap();
        let want = case["expected"]["r2"].as_f64().unwrap();
        let got = posegate::confidence::radius_squared(epsilon).unwrap();
        let tolerance = case["tolerance"]["relative"].as_f64().unwrap();
        assert!(
            (got / want - 1.0).abs() <= tolerance,
            "{epsilon}: {got} {want}"
        );
        let core = posegate::confidence::core_radius(epsilon).unwrap();
        assert!(
            f64::from(core.q16()) / 65536.0 >= want,
            "{epsilon}: rounded down"
        );
    }
}

/// Eq. 12 within the reference's tolerance; the mass outside also within the reference's error.
#[test]
#[ignore = "run by ci.sh cases DIR"]
fn expected_cost() {
    let mut worst = [0.0f64; 2];
    for case in cases("expected_cost.json") {
        let name = case["name"].as_str().unwrap();
        let pose_set = &case["pose_set"];
        let (_keep, folder) = folder();
        std::fs::write(folder.join("site.toml"), site(&case, 0.5, "")).unwrap();
        let rows = pose_set["covariance"].as_array().unwrap().iter();
        let rows = rows.map(|row| {
            numbers(row)
                .iter()
                .map(|v| format!("{v:?}"))
                .collect::<Vec<_>>()
                .join(",")
        });
        std::fs::write(folder.join("p.csv"), rows.collect::<Vec<_>>().join("\n")).unwrap();
        let epsilon = pose_set["epsilon"].to_string();
        let weight = |key: &str| case["cost"][key].to_string();
        let weights = ["c_high", "c1", "c2", "c3"].map(weight);
        let run = |belief: &str| {
            let [c_high, c1, c2, c3] = &weights;
            let weights = format!("--c-high {c_high} --c1 {c1} --c2 {c2} --c3 {c3}");
            let line =
                format!("cost site.toml --task t --epsilon {epsilon} {weights} --json {belief}");
            posegate(&folder, &line).json(0)
        };
        let start = std::time::Instant::now();
        let answer = run("--covariance-file p.csv");
        let seconds = start.elapsed().as_secs_f64();
        let get = |key: &str| answer[key].as_f64().unwrap();
        let want = |key: &str| case["expected"][key].as_f64().unwrap();
        let tolerance = case["tolerance"]["relative"].as_f64().unwrap();
        for key in ["integral", "mass", "mean"] {
            let off = (get(key) / want(key) - 1.0).abs();
            assert!(off <= tolerance, "{name} {key}: {} {}", get(key), want(key));
        }
        // The error of the reference's mean is that of its misses.
        let own = &case["quadrature_error"];
        let off = (get("integral") - want("integral")).abs();
        let sigmas = off
            / own["integral"]
                .as_f64()
                .unwrap()
                .max(1e-8 * want("integral"));
        assert!(
            sigmas <= 5.0,
            "{name}: {sigmas} of the reference's own errors: {answer}"
        );
        let outside = (get("outside_mass") - want("outside_mass")).abs();
        assert!(
            outside <= tolerance * want("outside_mass"),
            "{name}: {answer}"
        );
        assert!(
            (get("p_miss") - get("outside_mass") / get("mass")).abs() <= 1e-15,
            "{name}"
        );
        assert!(
            get("integral_error") <= 1e-6 * get("integral"),
            "{name}: {answer}"
        );
        worst = [worst[0].max(off / want("integral")), worst[1].max(sigmas)];
        eprintln!(
            "{name}: {} of {}, {sigmas:.2} sigma, {seconds:.3} s",
            get("integral"),
            want("integral")
        );
        // The same by standard deviations, if there are no correlations.
        let p = &pose_set["covariance"];
        let entry = |i: usize, j: usize| p[i][j].as_f64().unwrap();
        if [(0, 1), (0, 2), (1, 2)]
            .iter()
            .all(|(i, j)| entry(*i, *j) == 0.0)
        {
            let sigma = |axis: usize| format!("{:?}", entry(axis, axis).sqrt());
            let yaw_deg = format!("{:?}", entry(2, 2).sqrt().to_degrees());
            let [x, y] = [0, 1].map(sigma);
            let again = run(&format!(
                "--sigma-x {x} --sigma-y {y} --sigma-yaw-deg {yaw_deg}"
            ));
            let ratio = again["integral"].as_f64().unwrap() / get("integral");
            assert!((ratio - 1.0).abs() < 1e-7, "{name}: {ratio}");
        }
    }
    println!(
        "worst: {:.1e} of the integral, {:.2} of the reference's own error",
        worst[0], worst[1]
    );
}

/// Compares every number of every metric with `evo`.
#[test]
#[ignore = "run by ci.sh cases DIR"]
fn metrics() {
    let root = std::env::var("POSEGATE_CASES").unwrap();
    let (mut worst, mut count) = (0.0f64, 0);
    for case in cases("metrics.json") {
        let name = case["name"].as_str().unwrap();
        let text = |key: &str| case[key].as_str().unwrap().to_string();
        let max_diff = case["max_diff_s"].to_string();
        let (reference, estimate, align) = (text("reference"), text("estimate"), text("align"));
        let thresholds: String = case["expected"]["correct_rate"]
            .as_array()
            .unwrap()
            .iter()
            .map(|rate| {
                format!(
                    " --correct-rate {},{}",
                    rate["translation_below"], rate["rotation_below_deg"]
                )
            })
            .collect();
        let line = format!(
            "metrics {reference} {estimate} --align {align} --max-diff {max_diff} --json{thresholds}"
        );
        let answer = posegate(Path::new(&root), &line).json(0);
        let tolerance = case["tolerance"]["absolute"].as_f64().unwrap();
        compare(
            name,
            &answer,
            &case["expected"],
            tolerance,
            &mut worst,
            &mut count,
        );
    }
    println!("{count} numbers, at most {worst:.1e} off (relative, or absolute below 1)");
    assert!(worst < 1e-9, "evo's numbers to 1e-9");
}

/// Checks that every number of `want` is in `got` at the same place.
fn compare(
    place: &str,
    got: &Value,
    want: &Value,
    tolerance: f64,
    worst: &mut f64,
    count: &mut u32,
) {
    if let Some(want) = want.as_f64() {
        let got = got.as_f64().unwrap_or_else(|| panic!("{place}: {got}"));
        let off = (got - want).abs();
        assert!(off <= tolerance, "{place}: {got} {want}");
        *worst = worst.max(off / want.abs().max(1.0));
        *count += 1;
    } else if let Some(all) = want.as_object() {
        for (key, want) in all {
            compare(
                &format!("{place}.{key}"),
                &got[key],
                want,
                tolerance,
                worst,
                count,
            );
        }
    } else if let Some(all) = want.as_array() {
        assert_eq!(got.as_array().map(Vec::len), Some(all.len()), "{place}");
        for (index, want) in all.iter().enumerate() {
            compare(
                &format!("{place}.{index}"),
                &got[index],
                want,
                tolerance,
                worst,
                count,
            );
        }
    } else {
        assert_eq!(got, want, "{place}");
    }
}
