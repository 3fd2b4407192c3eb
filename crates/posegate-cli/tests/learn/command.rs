//! The command line: `learn` and `predict`.

use crate::distribution::{Random, SQUARES};
pub use posegate_testkit::run::{Case, lines};
use std::fmt::Write;

/// Runs a line. Returns the exit code, stdout, and the words of stderr.
pub fn run(folder: &Case, line: &str) -> (i32, String, String) {
    let ended = folder.run(line);
    let words = ended.words();
    (ended.code, ended.out, words)
}

#[test]
fn learn_bounds_gives_a_model_that_predict_evaluates() {
    let folder = Case::new(&[]);
    let header = "d_m,phi_deg,psi_deg,detected,err_translation_m,err_yaw_rad\n";
    let mut text = header.to_owned();
    for row in SQUARES.views(1500, 7, |_| true).rows {
        let [d, phi, psi] = row.at;
        match row.errors {
            Some([t, yaw]) => writeln!(text, "{d},{phi},{psi},1,{t},-{yaw}").unwrap(),
            None => writeln!(text, "{d},{phi},{psi},0,,").unwrap(),
        }
    }
    folder.write("d.csv", &text);
    let (out, _err) = folder.expect(0, "learn bounds d.csv --quantile 0.9 -o m.toml --json");
    assert_eq!(lines(&out)[0]["views"], 1500);
    folder.write("at.csv", "psi_deg,d_m,phi_deg\n30,3,10\n30,9,10\n0,3,0\n");
    let (out, _err) = folder.expect(0, "predict m.toml --at at.csv --json");
    let rows = lines(&out);
    assert_eq!(rows.len(), 3);
    assert_eq!(
        (&rows[0]["index"], &rows[0]["accepted"]),
        (&0.into(), &true.into())
    );
    let ratio = rows[0]["translation"].as_f64().unwrap() / SQUARES.quantile([3.0, 10.0, 30.0], 0.9);
    assert!((0.8..1.6).contains(&ratio), "{ratio}");
    assert!(rows[0]["p_detect"].as_f64().unwrap() > 0.9);
    assert_eq!(rows[1]["accepted"], false);
    assert!(rows[1]["translation"].is_null() && rows[1]["p_detect"].is_null());

    // Errors have line and column, and nothing is written.
    for (row, place) in [
        ("nan,1,1,1,0.1,0.1", "bad.csv:1502:1"),
        ("1,1,1,2,0.1,0.1", "bad.csv:1502:4"),
        ("1,1,1,0,0.1,", "bad.csv:1502:5"),
        ("1,1,1", "bad.csv:1502:4"),
    ] {
        folder.write("bad.csv", format!("{text}{row}\n"));
        folder
            .run("learn bounds bad.csv --quantile 0.9 -o never.toml")
            .is_refused_with(&[place]);
    }
    // An unclosed quote hides no rows, and rows are never comments.
    for row in ["1,1,1,1,0.1,\"0.1", "#1,1,1,1,0.1,0.1"] {
        folder.write("bad.csv", format!("{text}{row}\n1,1,1,1,0.1,0.1\n"));
        folder
            .run("learn bounds bad.csv --quantile 0.9 -o never.toml")
            .is_refused_with(&["bad.csv:1502:"]);
    }
    let (code, out, _) = run(&folder, "learn bounds d.csv --quantile 0.9 -o - --json");
    assert!(code == 2 && out.is_empty());
    folder
        .run("learn bounds d.csv --quantile 1.5 -o never.toml")
        .is_refused_with(&["no share"]);
    folder
        .run("learn bounds d.csv --quantile 0.9999 -o never.toml")
        .is_refused_with(&["too few"]);
    assert!(!folder.path().join("never.toml").exists());
    folder.write("at.csv", "d_m,phi_deg,psi_deg\n1,2,x\n");
    folder
        .run("predict m.toml --at at.csv --json")
        .is_refused_with(&["at.csv:2:3"]);
    folder
        .run("predict d.csv --at at.csv --json")
        .is_refused_with(&["d.csv:1:"]);
}

/// Frames of approaches: named in `run`, or cut at gaps with a warning. One long video is refused.
#[test]
fn dependent_frames_count_as_fewer_rows() {
    let folder = Case::new(&[]);
    let detections = SQUARES.approaches(60, 0.9, 0.0, 4);
    let header = "d_m,phi_deg,psi_deg,detected,err_translation_m,err_yaw_rad";
    let rows = |more: &dyn Fn(usize) -> String| {
        let mut text = String::new();
        for (k, row) in detections.rows.iter().enumerate() {
            let [d, phi, psi] = row.at;
            let [t, yaw] = row.errors.unwrap();
            writeln!(text, "{d},{phi},{psi},1,{t},{yaw},{}", more(k)).unwrap();
        }
        text
    };
    let named = rows(&|k| format!("drive {}", k / 100));
    folder.write("named.csv", format!("{header},run\n{named}"));
    let timed = rows(&|k| format!("{:.2}", 0.1 * k as f64 + 5.0 * (k / 100) as f64));
    folder.write("timed.csv", format!("{header},t_s\n{timed}"));
    let video = rows(&|k| format!("{:.2}", 0.1 * k as f64));
    folder.write("video.csv", format!("{header},t_s\n{video}"));

    let learn = |file: &str| {
        run(
            &folder,
            &format!("learn bounds {file} --quantile 0.9 -o m.toml --json"),
        )
    };
    let (code, out, err) = learn("named.csv");
    assert!(code == 0 && err.is_empty(), "{err}");
    let report = &lines(&out)[0];
    assert_eq!(
        (&report["rows"], &report["runs"]),
        (&6000.into(), &60.into())
    );
    let independent = report["independent_rows"].as_u64().unwrap();
    assert!((200..2000).contains(&independent), "{independent}");
    let region = &report["regions"][0];
    assert!(region["independent_rows"].as_u64() < region["rows"].as_u64());

    let (code, out, err) = learn("timed.csv");
    assert!(code == 0 && err.contains("no column `run`"), "{err}");
    assert_eq!(lines(&out)[0]["runs"], 60);
    assert_eq!(lines(&out)[0]["independent_rows"], independent);

    std::fs::remove_file(folder.path().join("m.toml")).unwrap();
    let (code, _, err) = learn("video.csv");
    assert!(code == 2 && err.contains("1 runs"), "{err}");
    assert!(!folder.path().join("m.toml").exists());

    let unnamed = rows(&|k| if k == 7 { String::new() } else { "a".into() });
    folder.write("bad.csv", format!("{header},run\n{unnamed}"));
    let (code, _, err) = learn("bad.csv");
    assert!(code == 2 && err.contains("bad.csv:9:7"), "{err}");
}

#[test]
fn learn_inflation_gives_a_model_that_predict_evaluates() {
    let folder = Case::new(&[]);
    let mut random = Random(9);
    let mut text = "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,true_x_m,true_y_m,true_yaw_rad\n".to_owned();
    // Deviations of 2 cm and 0.02 rad, stated as half of them: a factor of 4.
    for t in 0..3000 {
        let [x, y, yaw] = [0; 3].map(|_| 0.02 * random.normal());
        let p = 1e-4 * (1.0 + 0.001 * random.even());
        writeln!(text, "{t},{x},{y},{yaw},{p},0,0,{p},0,{p},0,0,0").unwrap();
    }
    text.push_str("3000,0,0,0,1,2,0,1,0,1,0,0,0\n");
    folder.write("e.csv", &text);
    let (code, out, err) = run(
        &folder,
        "learn inflation e.csv --epsilon 0.95 -o m.toml --json",
    );
    assert!(code == 0 && err.contains("e.csv:3002"), "{err}");
    let report = &lines(&out)[0];
    assert_eq!(report["impossible_lines"][0], 3002);
    let factor = report["overall"]["inflation"].as_f64().unwrap();
    assert!((3.9..5.0).contains(&factor), "{factor}");
    let (code, out, _) = run(&folder, "predict m.toml --at e.csv --json");
    let rows = lines(&out);
    assert_eq!((code, rows.len()), (0, 3001));
    assert_eq!(rows[5]["accepted"], true);
    assert!(rows[5]["inflation"].as_f64().unwrap() >= 1.0);
    assert_eq!(rows[3000]["accepted"], false);
    folder.write("e.csv", text.replace("1,0.", "1,x."));
    let (code, _, err) = run(
        &folder,
        "learn inflation e.csv --epsilon 0.95 -o never.toml",
    );
    assert!(code == 2 && err.contains("e.csv:") && !folder.path().join("never.toml").exists());
}

#[test]
fn learn_outcomes_returns_1_if_the_claim_is_contradicted() {
    let folder = Case::new(&[]);
    let fleet = |bad: usize| {
        let rows = (0..1000).map(|k| if k % 1000 < bad { "0\n" } else { "1\n" });
        format!("success\n{}", rows.collect::<String>())
    };
    folder.write("good.csv", fleet(8));
    folder.write("bad.csv", fleet(40));
    let (code, out, err) = run(&folder, "learn outcomes bad.csv --epsilon 0.99 --json");
    let report = &lines(&out)[0];
    assert!(code == 1 && report["contradicted"] == true, "{out}{err}");
    assert!(report["upper"].as_f64().unwrap() < 0.99);
    // In another order: failures at regular distances.
    let mut mixed = "t_s,success\n".to_owned();
    for k in 0..1000u32 {
        writeln!(mixed, "{},{}", 1000 - k, u8::from(k % 125 != 0)).unwrap();
    }
    folder.write("good.csv", &mixed);
    let (code, out, err) = run(&folder, "learn outcomes good.csv --epsilon 0.99 --json");
    assert!(
        code == 0 && lines(&out)[0]["contradicted"] == false,
        "{out}{err}"
    );
    assert_eq!(lines(&out)[0]["successes"], 992);
    folder.write("bad.csv", "success\n1\nyes\n");
    folder
        .run("learn outcomes bad.csv --epsilon 0.99 --json")
        .is_refused_with(&["bad.csv:3:1"]);
}
