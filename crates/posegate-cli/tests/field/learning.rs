//! Models from recordings: `replay --csv` writes what `learn` reads, and `learn` reads recordings themselves.

use posegate_testkit::bags::{Bag, Pose};
use posegate_testkit::run::Case;
use serde_json::Value;

const SITE: &str = include_str!("../../../../examples/sites/dock.toml");

/// Returns a pseudorandom number from -1 to 1.
fn noise(number: u32) -> f64 {
    let mixed = number.wrapping_mul(2_654_435_761).rotate_left(13);
    let mixed = (mixed ^ (mixed >> 7)).wrapping_mul(0x85eb_ca6b);
    f64::from(mixed) / f64::from(u32::MAX) * 2.0 - 1.0
}

/// A bag with 400 estimates whose errors are up to 2 cm and 0.02 rad, and the true poses; the first 20 estimates are older than the truth.
fn drive() -> Vec<u8> {
    let mut bag = Bag::new(None, true);
    for k in 0..400u32 {
        let t_s = 1.0 + f64::from(k);
        let x = 0.001 * f64::from(k);
        let truth = Pose {
            t_s,
            x,
            ..Pose::AT_DOCK
        };
        if k >= 20 {
            bag.truth("/mocap", &truth);
        }
        let estimate = Pose {
            x: x + 0.02 * noise(3 * k),
            y: 0.02 * noise(3 * k + 1),
            yaw: 0.02 * noise(3 * k + 2),
            covariance: [1e-4, 1e-4, 1e-4],
            ..truth
        };
        bag.pose("/amcl_pose", &estimate);
    }
    bag.finish()
}

fn rows(text: &str) -> Vec<Vec<String>> {
    let row = |line: &str| line.split(',').map(Into::into).collect();
    text.lines().map(row).collect()
}

#[test]
fn table_of_a_replay_and_its_recording_give_one_model() {
    let bag = drive();
    let case = Case::new(&[("site.toml", SITE.as_bytes()), ("drive.mcap", &bag)]);
    let replay = "replay site.toml drive.mcap --task dock --topic /amcl_pose --truth /mocap --json --csv rows.csv";
    let ended = case.run(replay);
    let summary: Value = serde_json::from_str(&ended.out).expect("JSON");
    assert_eq!(summary["csv"]["rows"], 400);
    assert_eq!(summary["csv"]["left_out"], 0);
    let text = std::fs::read_to_string(case.path().join("rows.csv")).expect("the table");
    let rows = rows(&text);
    assert_eq!(rows.len(), 401);
    assert_eq!(
        rows[0].join(","),
        "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,true_x_m,true_y_m,true_yaw_rad"
    );
    // No truth was recorded for the first estimates.
    assert_eq!(rows[1][10..], ["", "", ""]);
    assert_eq!(rows[21][10], "0.02");
    assert_eq!(rows[21][0], "21.0");
    // The gate's reader takes the table, too.
    assert_eq!(
        case.run("contains site.toml --task dock --poses rows.csv")
            .code,
        0
    );

    let learn = "learn inflation --epsilon 0.8 --json -o";
    let of_table = case.run(&format!("{learn} table.toml rows.csv"));
    assert!(
        of_table.words().contains("20 rows have no true pose"),
        "{}",
        of_table.words()
    );
    let of_bag = case.run(&format!(
        "{learn} bag.toml drive.mcap --topic /amcl_pose --truth /mocap"
    ));
    assert!(of_bag.words().contains("20 of 400"), "{}", of_bag.words());
    let [of_table, of_bag] = [of_table, of_bag].map(|ended| ended.json(0));
    assert_eq!(of_bag["rows"], 380);
    assert_eq!(of_table, of_bag);
}

#[test]
fn recording_without_its_topic_or_truth_is_refused_with_advice() {
    let bag = drive();
    let case = Case::new(&[("drive.mcap", &bag), ("t.csv", b"t_s\n1\n")]);
    let learn = "learn inflation --epsilon 0.8 -o m.toml drive.mcap";
    case.run(&format!("{learn} --truth /mocap"))
        .is_refused_with(&["/amcl_pose (geometry_msgs", "--topic"]);
    case.run(&format!("{learn} --topic /amcl_pose"))
        .is_refused_with(&["errors need the true poses", "--truth /mocap"]);
    case.run(&format!("{learn} --topic /pose --truth /mocap"))
        .is_refused_with(&["/pose", "/amcl_pose (geometry_msgs"]);
    case.run(&format!("{learn} --topic /amcl_pose --truth /nothing"))
        .is_refused_with(&["no true pose"]);
    case.run("learn inflation --epsilon 0.8 -o m.toml t.csv --topic /amcl_pose --truth /mocap")
        .is_refused_with(&["t.csv is not a bag"]);
    assert!(!case.path().join("m.toml").exists());
}

/// Looks of a robot at three places in front of the tag, 3 of 4 of them detected.
fn looks() -> Vec<u8> {
    let mut bag = Bag::new(None, true);
    for k in 0..600u32 {
        let t_s = 1.0 + 3.0 * f64::from(k);
        let pose = [[0.0, 0.1, 0.02], [1.0, 0.5, 0.1], [1.5, -0.4, -0.1]][k as usize % 3];
        bag.truth(
            "/mocap",
            &Pose {
                t_s,
                x: pose[0],
                y: pose[1],
                yaw: pose[2],
                ..Pose::AT_DOCK
            },
        );
        // The number of another tag: this one is missed.
        let id = if k % 4 == 0 { 99 } else { 7 };
        let seen = [0, 1, 2].map(|axis| pose[axis] + 0.003 * noise(7 * k + 3 + axis as u32));
        bag.look("/detections", t_s, id, seen);
    }
    bag.finish()
}

#[test]
fn bounds_are_learnt_from_detections_and_truth() {
    let bag = looks();
    let case = Case::new(&[("site.toml", SITE.as_bytes()), ("looks.mcap", &bag)]);
    let recorded =
        "looks.mcap --site site.toml --camera front --detections /detections --truth /mocap";
    let learnt = case
        .run(&format!(
            "learn bounds {recorded} --quantile 0.8 --json -o m.toml"
        ))
        .json(0);
    assert_eq!(learnt["views"], 600, "{learnt:#}");
    assert_eq!(learnt["detections"], 450);
    assert_eq!(learnt["taken_with"]["fx"], 615.0);
    let regions = learnt["regions"].as_array().expect("regions");
    assert!(!regions.is_empty());
    // Errors of the poses that were drawn, not of the fits: up to 3 mm on each axis.
    let model = std::fs::read_to_string(case.path().join("m.toml")).expect("the model");
    assert!(model.contains("kind = \"bounds\""), "{model}");
    assert_eq!(learnt["wider_than"], serde_json::json!([]));
    let tight = SITE.replace("x = [-0.08, 0.08]", "x = [-0.001, 0.001]");
    assert_ne!(tight, SITE);
    std::fs::write(case.path().join("tight.toml"), tight).expect("the site");
    let of_tight = recorded.replace("site.toml", "tight.toml");
    let tight = case.run(&format!(
        "learn bounds {of_tight} --quantile 0.8 --json -o t.toml"
    ));
    assert!(
        tight
            .words()
            .contains("wider than the success set of the task `dock`"),
        "{}",
        tight.words()
    );
    assert_eq!(tight.json(0)["wider_than"], serde_json::json!(["dock"]));
    let check = case.run(&format!("learn check m.toml {recorded} --json"));
    assert!(
        check
            .words()
            .contains("the model was learnt from these data"),
        "{}",
        check.words()
    );
    let check = check.json(0);
    assert_eq!(check["verdict"], "holds", "{check:#}");
    assert_eq!(check["same_data"], true);
}
