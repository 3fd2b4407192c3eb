//! A learnt model records what its detections were taken with, and a site with another camera, mount or tag refuses it by name.

use crate::command::{Case, lines, run};
use crate::distribution::SQUARES;
use posegate_site::SAMPLE;
use serde_json::json;
use std::fmt::Write;

const LOOK: &str = "
[error_model.learnt]
file = \"m.toml\"

[task.look]
kind = \"localization\"
goal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }
success = { shape = \"visibility\", camera = \"front\", tag = \"t7\", d_max = 8.0, phi_max_deg = 25.0, psi_max_deg = 60.0, error_model = \"learnt\", r = { translation = 0.04, yaw_deg = 1.0 } }
";

fn folder() -> Case {
    let folder = Case::new(&[]);
    let header = "d_m,phi_deg,psi_deg,detected,err_translation_m,err_yaw_rad\n";
    let mut text = header.to_owned();
    for row in SQUARES.views(3000, 7, |_| true).rows {
        let [d, phi, psi] = row.at;
        match row.errors {
            Some([t, yaw]) => writeln!(text, "{d},{phi},{psi},1,{t},{yaw}").unwrap(),
            None => writeln!(text, "{d},{phi},{psi},0,,").unwrap(),
        }
    }
    folder.write("d.csv", &text);
    folder.write("site.toml", SAMPLE);
    folder
}

fn changed(key: &str, from: &str, to: &str) -> String {
    let changed = SAMPLE.replacen(from, to, 1);
    assert_ne!(changed, SAMPLE, "{key}: the sample has no {from}");
    changed + LOOK
}

#[test]
fn site_with_another_camera_or_tag_is_refused() {
    let folder = folder();
    let (out, _err) = folder.expect(
        0,
        "learn bounds d.csv --quantile 0.9 -o m.toml --camera front --site site.toml --json",
    );
    let taken = &lines(&out)[0]["taken_with"];
    assert_eq!(taken["camera"], "front", "{out}");
    assert_eq!(taken["family"], "tag36h11", "{out}");
    let number = |key: &str| taken[key].as_f64().unwrap();
    let (fx, size) = (number("fx"), number("tag_size"));
    // The same site, and one whose calibration differs as much as another calibration of the same camera.
    folder.write("here.toml", format!("{SAMPLE}{LOOK}"));
    let (_, _err) = folder.expect(0, "check here.toml");
    let key = |name: &str, value: f64| {
        let text = [format!("{name} = {value:?}"), format!("{name} = {value}")];
        let found = text.into_iter().find(|text| SAMPLE.contains(text));
        found.unwrap_or_else(|| panic!("{name} = {value}"))
    };
    for (name, from, factor, refused) in [
        ("fx", fx, 1.004, false),
        ("fx", fx, 1.02, true),
        ("size", size, 1.05, true),
    ] {
        let to = format!("{name} = {:?}", from * factor);
        folder.write("there.toml", changed(name, &key(name, from), &to));
        let (code, _, err) = run(&folder, "check there.toml");
        assert_eq!(code, if refused { 2 } else { 0 }, "{name} {factor}: {err}");
        assert_eq!(err.contains("was learnt with"), refused, "{err}");
        assert!(!refused || err.contains("there.toml"), "{err}");
    }
    // Larger tags are seen from farther away; the model is scaled if the site asks for it.
    let to = format!("size = {:?}", size * 1.5);
    let larger = changed("size", &key("size", size), &to);
    let scaled = format!(
        "file = \"m.toml\"\ntag_size = {:?}\nlean_deg = 0.0",
        size * 1.5
    );
    folder.write("there.toml", larger.replace("file = \"m.toml\"", &scaled));
    let (_, _err) = folder.expect(0, "check there.toml");
    let formula = "translation = [0, 0, 0, 0]\nyaw_deg = [0, 0, 0, 0]\ntag_size = 0.3";
    folder.write("there.toml", larger.replace("file = \"m.toml\"", formula));
    folder
        .run("check there.toml")
        .is_refused_with(&["is a formula and has a `tag_size`"]);
    let other = changed("family", "tag36h11", "tag25h9");
    folder.write("there.toml", &other);
    folder
        .run("check there.toml")
        .is_refused_with(&["tags of the family tag36h11, not tag25h9"]);
}

/// The errors are those of the robot's reference point, so a model is for one mount of the camera.
#[test]
fn site_with_another_mount_is_refused() {
    let folder = folder();
    let learn =
        "learn bounds d.csv --quantile 0.9 -o m.toml --camera front --site site.toml --json";
    let (out, _err) = folder.expect(0, learn);
    let mount =
        json!({"x": 0.25, "y": 0.0, "z": 0.5, "roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0});
    assert_eq!(lines(&out)[0]["taken_with"]["mount"], mount, "{out}");
    let from =
        "mount = { x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }";
    let tolerance = "\nmount_tolerance = { translation = 0.01, angle_deg = 1.0 }";
    // Room for the errors from the tolerance, which the bound of a look includes.
    let look = LOOK.replace(
        "translation = 0.04, yaw_deg = 1.0",
        "translation = 0.2, yaw_deg = 4.0",
    );
    assert_ne!(look, LOOK);
    let at = |x: f64, yaw: f64, tolerance: &str| {
        let numbers = format!("x = {x:?}, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0");
        let to = format!("mount = {{ {numbers}, yaw_deg = {yaw:?} }}{tolerance}");
        assert!(SAMPLE.contains(from));
        folder.write("there.toml", &(SAMPLE.replacen(from, &to, 1) + &look));
        let (code, _, err) = run(&folder, "check there.toml");
        (code, err)
    };
    for (x, yaw, tolerance, accepted) in [
        (0.25, 0.0, "", true),
        (0.25, 360.0, "", true),
        (0.2505, 0.0, "", false),
        (0.25, 0.05, "", false),
        (-0.25, 180.0, "", false),
        (0.26, 0.0, tolerance, true),
        (0.25, 1.0, tolerance, true),
        (0.262, 0.0, tolerance, false),
        (0.25, -1.1, tolerance, false),
    ] {
        let (code, err) = at(x, yaw, tolerance);
        assert_eq!(
            code,
            if accepted { 0 } else { 2 },
            "{x} {yaw} {tolerance}: {err}"
        );
        let named = "mounted at (0.25, 0, 0.5) m with roll 0, pitch 0, yaw 0 deg, not at";
        assert_eq!(err.contains(named), !accepted, "{x} {yaw}: {err}");
    }
    // Models without a mount are read as before, and their mount is not compared.
    let text = folder.text("m.toml");
    let start = text.find("[taken_with.mount]").unwrap();
    let end = start + text[start + 1..].find("\n[").unwrap() + 2;
    folder.write("m.toml", format!("{}{}", &text[..start], &text[end..]));
    let (code, err) = at(-0.25, 180.0, "");
    assert_eq!(code, 0, "{err}");
    // An impossible mount is refused.
    let impossible = text.replacen("\nx = 0.25", "\nx = nan", 1);
    assert_ne!(impossible, text);
    folder.write("m.toml", &impossible);
    let (code, err) = at(0.25, 0.0, "");
    assert!(
        code == 2 && err.contains("mount has finite numbers"),
        "{err}"
    );
}

#[test]
fn options_state_camera_and_tag_without_a_site() {
    let folder = folder();
    let (out, _err) = folder.expect(0, "learn bounds d.csv --quantile 0.9 -o m.toml --fx 1234.5 --tag-size 0.31 --family tag36h11 --json");
    let taken = &lines(&out)[0]["taken_with"];
    assert_eq!(taken["fx"], 1234.5);
    assert_eq!(taken["tag_size"], 0.31);
    folder.write("here.toml", format!("{SAMPLE}{LOOK}"));
    let (code, _, err) = run(&folder, "check here.toml");
    assert_eq!(code, 2);
    assert!(err.contains("fx 1234.5 px"), "{err}");
    // If nothing is stated, nothing is compared.
    let (out, _err) = folder.expect(0, "learn bounds d.csv --quantile 0.9 -o m.toml --json");
    assert!(lines(&out)[0]["taken_with"].is_null());
    // A model of tags of an unknown size is not scaled.
    let scaled = LOOK.replace("m.toml\"", "m.toml\"\ntag_size = 0.3");
    folder.write("there.toml", format!("{SAMPLE}{scaled}"));
    folder
        .run("check there.toml")
        .is_refused_with(&["does not record the size of its tags"]);
    assert_eq!(run(&folder, "check here.toml").0, 0);
    for (options, words) in [
        ("--camera front", "--site"),
        ("--camera side --site site.toml", "no camera `side`"),
        ("--fx -3", "above 0"),
        ("--fx nan", "above 0"),
        ("--fx 3 --tag-size 0", "above 0"),
        ("--fx 3 --camera front --site site.toml", "--camera"),
    ] {
        let line = format!("learn bounds d.csv --quantile 0.9 -o other.toml {options}");
        folder.run(&line).is_refused_with(&[words]);
        assert!(!folder.path().join("other.toml").exists());
    }
}
