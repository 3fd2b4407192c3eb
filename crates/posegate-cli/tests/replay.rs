//! `posegate replay`: faults of a recording are counted, and its verdicts are those of `posegate gate`.

use posegate::shape::SuccessSet;
use posegate_site::Site;
use posegate_testkit::bags::{Bag, Compression, Pose};
use posegate_testkit::root;
use posegate_testkit::run::{Case, Ended, lines, run};
use serde_json::Value;

const SITE: &str = "examples/sites/dock.toml";

/// Runs a line in the repository's folder.
fn posegate(line: &str) -> Ended {
    run(&root(), line)
}

/// A folder with a bag in it.
struct Folder(Case);

impl Folder {
    fn of(bag: &[u8]) -> Self {
        Self(Case::new(&[("drive.mcap", bag)]))
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().into()
    }

    /// Replays the bag. Returns its rows and its summary.
    fn replay(&self, task: &str, options: &str) -> (Vec<Value>, Value) {
        let (drive, rows) = (self.path("drive.mcap"), self.path("rows.jsonl"));
        let line = format!("replay {SITE} {drive} --task {task} --json --rows {rows} {options}");
        let ended = posegate(&line);
        assert!(ended.code < 2, "{}", ended.err);
        (self.rows(), ended.lines().remove(0))
    }

    fn rows(&self) -> Vec<Value> {
        lines(&self.0.text("rows.jsonl"))
    }
}

/// Returns a drive into the dock: 100 poses at 20 Hz, the last ones well inside.
fn drive() -> Vec<Pose> {
    (0..100)
        .map(|k| {
            let away = f64::from(60 - k.min(60)) * 0.005;
            Pose {
                t_s: 10.0 + 0.05 * f64::from(k),
                x: -away,
                y: 0.1 * away,
                yaw: 0.02 * away,
                ..Pose::AT_DOCK
            }
        })
        .collect()
}

/// Each row has the verdict of `posegate gate`: all kinds of sets, ages and invalid numbers, on facets and in a view.
#[test]
fn verdicts_equal_those_of_the_gate() {
    for (task, table) in [
        ("dock", "examples/tables/dock.posegate"),
        ("see-t7", "examples/tables/see-t7.posegate"),
    ] {
        for set in ["", "--set bounded --translation 0.03 --yaw-deg 1.5"] {
            let estimates = "tests/data/estimates.csv";
            let gate = posegate(&format!(
                "gate {table} --estimates {estimates} --json {set}"
            ));
            let folder = Folder::of(b"");
            let rows = folder.path("rows.jsonl");
            posegate(&format!(
                "replay {SITE} {estimates} --task {task} --table {table} --rows {rows} {set}"
            ))
            .with(0);
            let (gate, rows) = (gate.lines(), folder.rows());
            assert!(gate.len() > 500 && gate.len() == rows.len());
            let permits = gate
                .iter()
                .filter(|line| line["verdict"] == "permit")
                .count();
            assert!(permits > 20 && permits < gate.len() - 20, "{permits}");
            for (gate, row) in gate.iter().zip(&rows) {
                for key in ["index", "verdict", "reason", "margin", "worst_pose"] {
                    assert_eq!(gate[key], row[key], "{task} {set}: {gate} {row}");
                }
            }
        }
    }
}

/// `--fast` takes the verdicts from the gate's own steps.
#[test]
fn fast_replay_gives_the_same_verdicts() {
    let estimates = "tests/data/estimates.csv";
    let folder = Folder::of(b"");
    for task in ["dock", "see-t7"] {
        let read = |fast: &str| {
            let rows = folder.path("rows.jsonl");
            posegate(&format!(
                "replay {SITE} {estimates} --task {task} --rows {rows} {fast}"
            ))
            .with(0);
            folder.rows()
        };
        let (slow, fast) = (read(""), read("--fast"));
        assert_eq!(slow.len(), fast.len());
        for (slow, fast) in slow.iter().zip(&fast) {
            for key in ["verdict", "reason", "permitted", "state", "gate_reason"] {
                assert_eq!(slow[key], fast[key], "{slow} {fast}");
            }
            assert!(fast["margin"].is_null());
        }
    }
}

/// An intact bag in each compression, with an index and without: the gate opens near the dock and stays open.
#[test]
fn intact_bag_is_read_completely() {
    for compression in [None, Some(Compression::Lz4), Some(Compression::Zstd)] {
        for index in [true, false] {
            let mut bag = Bag::new(compression, index);
            for pose in drive() {
                bag.pose("/amcl_pose", &pose);
            }
            let folder = Folder::of(&bag.finish());
            let (rows, summary) = folder.replay("dock", "--topic /amcl_pose");
            assert_eq!(rows.len(), 100);
            assert_eq!(summary["recording"]["indexed"], index);
            assert!(summary["recording"]["damage"].is_null());
            assert_eq!(summary["clock"], "logged");
            for name in [
                "time_backwards",
                "duplicate_stamps",
                "pose_not_finite",
                "quaternion_not_unit",
                "other_frame",
            ] {
                assert_eq!(summary["findings"][name], 0, "{name}");
            }
            assert_eq!(rows[0]["reason"], "outside_table");
            assert_eq!(rows[99]["verdict"], "permit");
            let opened = rows
                .iter()
                .position(|row| row["permitted"] == true)
                .unwrap();
            let permitted = rows
                .iter()
                .position(|row| row["verdict"] == "permit")
                .unwrap();
            // 500 ms after the last denial, at 20 Hz, which is later than three consecutive permits.
            assert_eq!(opened - permitted, 9);
            assert!(rows.iter().skip(opened).all(|row| row["permitted"] == true));
            assert_eq!(summary["gate"]["openings"], 1);
            let open_s = summary["gate"]["open_s"].as_f64().unwrap();
            assert!(
                (open_s - 0.05 * (99 - opened) as f64).abs() < 1e-6,
                "{open_s}"
            );
            assert_eq!(summary["rules"]["gate"]["permits"], 100 - permitted);
            assert_eq!(summary["rules"]["interlock"]["permits"], 100 - opened);
        }
    }
}

/// A truncated bag is read up to the break, and the place of the break is reported.
#[test]
fn truncated_bag_is_read_up_to_the_break() {
    let mut bag = Bag::new(None, true);
    for pose in drive() {
        bag.pose("/amcl_pose", &pose);
    }
    let whole = bag.finish();
    let folder = Folder::of(&whole);
    let (all, _) = folder.replay("dock", "--topic /amcl_pose");
    for share in [0.3, 0.6, 0.8] {
        let cut = (whole.len() as f64 * share) as usize;
        let folder = Folder::of(&whole[..cut]);
        let (rows, summary) = folder.replay("dock", "--topic /amcl_pose");
        let expected = 100.0 * share;
        assert!(
            (rows.len() as f64 - expected).abs() < 15.0,
            "{} of {share}",
            rows.len()
        );
        assert_eq!(rows, all[..rows.len()]);
        let damage = summary["recording"]["damage"].as_str().unwrap();
        assert!(damage.contains(&format!("after {cut} bytes")), "{damage}");
        assert!(summary["recording"]["indexed"].is_null());
    }
    // A changed byte in a chunk: the checksum detects it.
    let mut damaged = whole.clone();
    let place = whole.len() / 2;
    damaged[place] ^= 1;
    let (rows, summary) = Folder::of(&damaged).replay("dock", "--topic /amcl_pose");
    assert!(!rows.is_empty());
    // Only the damaged chunk is skipped.
    assert_eq!(summary["recording"]["bad_chunks"], 1);
    let has = |line: &Value| rows.iter().any(|row| row["t_s"] == line["t_s"]);
    let out: Vec<&Value> = all.iter().filter(|line| !has(line)).collect();
    assert_eq!(out.len() + rows.len(), 100);
    assert!((5..15).contains(&out.len()), "{}", out.len());
    let (first, last) = (&out[0]["index"], &out[out.len() - 1]["index"]);
    let span = last.as_u64().unwrap() - first.as_u64().unwrap() + 1;
    assert_eq!(span, out.len() as u64, "one after the other");
    for row in &rows {
        let same = all.iter().find(|line| line["t_s"] == row["t_s"]).unwrap();
        assert_eq!(
            (&row["pose"], &row["margin"]),
            (&same["pose"], &same["margin"])
        );
    }
    assert!(
        summary["recording"]["damage"]
            .as_str()
            .is_some_and(|damage| damage.contains("CRC")),
        "{summary}"
    );
}

/// Each fault of a message is counted and denied for its own reason, and the message is in all counts.
#[test]
fn faulty_messages_are_counted_and_denied() {
    let near = Pose {
        t_s: 0.0,
        ..Pose::AT_DOCK
    };
    let at = |t_s: f64| Pose { t_s, ..near };
    let mut bag = Bag::new(Some(Compression::Zstd), true);
    let poses = [
        (at(1.0), None),
        (at(1.1), None),
        (at(1.1), Some("repeated stamp")),
        (at(1.05), Some("backwards")),
        (
            Pose {
                x: f64::NAN,
                ..at(1.3)
            },
            Some("estimate_not_finite"),
        ),
        (
            Pose {
                length: 1.01,
                ..at(1.4)
            },
            Some("orientation_invalid"),
        ),
        (
            Pose {
                frame: "odom",
                ..at(1.5)
            },
            Some("frame_mismatch"),
        ),
        (
            Pose {
                covariance: [0.0; 3],
                ..at(1.6)
            },
            Some("covariance_zero"),
        ),
        (at(1.7), None),
    ];
    for (pose, _) in &poses {
        bag.pose("/amcl_pose", pose);
    }
    bag.raw("/amcl_pose", 1.8, &[0, 1, 0, 0, 9, 9]);
    bag.big_endian("/amcl_pose", &at(1.9));
    bag.other("/map_updates", "map_msgs/msg/Update", 3);
    let folder = Folder::of(&bag.finish());
    let (rows, summary) = folder.replay("dock", "--topic /amcl_pose");
    assert_eq!(rows.len(), poses.len() + 1);
    for (row, (_, fault)) in rows.iter().zip(&poses) {
        match *fault {
            None => assert_eq!(row["verdict"], "permit", "{row}"),
            // Each estimate alone is good. The gate denies them because of earlier ones.
            Some("repeated stamp" | "backwards") => {
                assert_eq!(row["verdict"], "permit");
                assert_eq!(row["gate_reason"], "time_backwards", "{row}");
            }
            Some(reason) => assert_eq!(row["reason"], reason),
        }
    }
    assert_eq!(rows[9]["verdict"], "permit", "big endian");
    let findings = &summary["findings"];
    for (name, count) in [
        ("estimates", 10),
        ("duplicate_stamps", 1),
        ("time_backwards", 1),
        ("pose_not_finite", 1),
        ("quaternion_not_unit", 1),
        ("other_frame", 1),
        ("without_covariance", 0),
    ] {
        assert_eq!(findings[name], count, "{name}");
    }
    assert_eq!(findings["frames"]["odom"], 1);
    let recording = &summary["recording"];
    assert_eq!(recording["undecodable"], 1);
    assert_eq!(recording["topics"]["/amcl_pose"], 11);
    let skipped = &recording["skipped_topics"]["/map_updates"];
    assert_eq!(
        (&skipped["messages"], &skipped["why"]),
        (&3.into(), &"not_wanted".into())
    );
}

/// Requested topics that cannot be read are named with the reason, and nothing is written.
#[test]
fn unreadable_topic_is_named_with_the_reason() {
    let mut bag = Bag::new(None, true);
    bag.pose("/amcl_pose", &Pose::AT_DOCK);
    bag.other("/strange", "own_msgs/msg/Estimate", 2);
    bag.with_definition("/changed", "float64 x\n", 2);
    let folder = Folder::of(&bag.finish());
    let topics = "--topic /amcl_pose --topic /strange --topic /changed";
    let (rows, summary) = folder.replay("dock", topics);
    assert_eq!(rows.len(), 1);
    let skipped = &summary["recording"]["skipped_topics"];
    assert_eq!(skipped["/strange"]["why"], "unknown_schema");
    assert_eq!(skipped["/strange"]["messages"], 2);
    assert_eq!(skipped["/changed"]["why"], "other_fields");
    let before = folder.0.names().len();
    let [drive, out, rows, old] =
        ["drive.mcap", "o.mcap", "r", "old.db3"].map(|name| folder.path(name));
    for (topic, expected) in [
        ("--topic /strange", "unknown_schema"),
        ("--topic /changed", "other_fields"),
        ("--topic /nothing", "/amcl_pose"),
        ("", "/amcl_pose"),
    ] {
        let line = format!("replay {SITE} {drive} --task dock --mcap {out} --rows {rows} {topic}");
        posegate(&line).is_refused_with(&[expected]);
    }
    folder.0.write("old.db3", b"SQLite format 3\0 and more");
    for topic in ["", "--topic /amcl_pose"] {
        let line = format!("replay {SITE} {old} --task dock {topic}");
        posegate(&line).is_refused_with(&["not a database"]);
    }
    assert_eq!(folder.0.names().len(), before + 1);
}

/// False permits, false denials, coverage and NEES for a truth that is shifted so that the numbers are known. The truth
/// is a topic, a TUM file or columns of a CSV.
#[test]
fn false_permits_are_counted_with_a_truth() {
    let site = Site::read(root().join(SITE)).unwrap();
    let success: &SuccessSet = &site.task("dock").unwrap().success;
    let poses = drive();
    // 2 cm to the side: sigma is 1 cm, so e' P^-1 e = 4; after the 80th, 10 cm, outside of the box.
    let truth = |k: usize, pose: &Pose| {
        let side = if k < 80 { 0.02 } else { 0.10 };
        Pose {
            y: pose.y + side,
            ..*pose
        }
    };
    let mut bag = Bag::new(None, true);
    let (mut tum, mut csv) = (
        String::new(),
        String::from(
            "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,true_x_m,true_y_m,true_yaw_rad\n",
        ),
    );
    let mut inside = 0;
    for (k, pose) in poses.iter().enumerate() {
        let real = truth(k, pose);
        inside += u32::from(success.membership([real.x, real.y, real.yaw]).inside);
        bag.pose("/amcl_pose", pose);
        // The truth is logged later than the estimate.
        bag.truth(
            "/mocap",
            &Pose {
                logged_s: Some(pose.t_s + 0.02),
                ..real
            },
        );
        let (sin, cos) = (0.5 * real.yaw).sin_cos();
        tum += &format!("{} {} {} 0 0 0 {sin} {cos}\n", real.t_s, real.x, real.y);
        csv += &format!(
            "{},{},{},{},1e-4,0,0,1e-4,0,1e-4,{},{},{}\n",
            pose.t_s, pose.x, pose.y, pose.yaw, real.x, real.y, real.yaw
        );
    }
    let folder = Folder::of(&bag.finish());
    folder.0.write("truth.txt", tum);
    folder.0.write("drive.csv", csv);
    let with_truth = |truth: &str, more: &str| {
        folder.replay(
            "dock",
            &format!("--topic /amcl_pose --truth {truth} {more}"),
        )
    };
    let (rows, by_topic) = with_truth("/mocap", "--clock stamps");
    let (_, by_file) = with_truth(&folder.path("truth.txt"), "--clock stamps");
    let csv = folder.path("drive.csv");
    // A permit was false.
    let by_row = posegate(&format!("replay {SITE} {csv} --task dock --json")).json(1);
    for summary in [&by_topic, &by_file, &by_row] {
        let truth = &summary["truth"];
        assert_eq!(truth["estimates"], 100);
        assert_eq!(truth["in_success_set"], inside);
        assert_eq!(truth["in_pose_set"], 80);
        let nees = truth["nees"]["mean"].as_f64().unwrap();
        assert!(
            (nees - (80.0 * 4.0 + 20.0 * 100.0) / 100.0).abs() < 1e-6,
            "{nees}"
        );
        let rmse = truth["rmse_m"].as_f64().unwrap();
        assert!(
            (rmse - ((80.0 * 4e-4 + 20.0 * 1e-2) / 100.0_f64).sqrt()).abs() < 1e-9,
            "{rmse}"
        );
        let gate = &summary["rules"]["gate"];
        assert_eq!(gate["false_permits"], 20);
        assert_eq!(summary["rules"]["interlock"]["false_permits"], 20);
        assert_eq!(summary["rules"]["sigma"]["false_permits"], 100 - inside);
        // Every false permit is hazardous.
        let regions = &truth["stanford"]["regions"];
        assert!(
            regions["hazardously_misleading"].as_u64().unwrap() >= 20,
            "{regions}"
        );
        assert_eq!(truth["stanford"]["left_out"], 0);
        let all: u64 = regions
            .as_object()
            .unwrap()
            .values()
            .map(|v| v.as_u64().unwrap())
            .sum();
        assert_eq!(all, 100);
    }
    let denied_inside = rows
        .iter()
        .filter(|row| row["verdict"] == "deny" && row["in_success_set"] == true)
        .count();
    assert_eq!(by_topic["rules"]["gate"]["false_denials"], denied_inside);
    assert!(denied_inside > 0);
    // Inflated by 10, the sets of sigma 1 cm still contain 10 cm: r2 = 11.3 * 10 is above 100.
    let (_, grown) = with_truth("/mocap", "--inflation 10");
    assert_eq!(grown["truth"]["in_pose_set"], 100);
    assert_eq!(grown["rules"]["gate"]["false_permits"], 0);
}

/// Only estimates with stamps in the range are evaluated; the others are counted.
#[test]
fn estimates_outside_the_time_range_are_counted() {
    let mut bag = Bag::new(None, true);
    for pose in drive() {
        bag.pose("/amcl_pose", &pose);
    }
    let folder = Folder::of(&bag.finish());
    let range = "--topic /amcl_pose --from 11 --to 12.001";
    let (rows, summary) = folder.replay("dock", range);
    assert_eq!(rows.len(), 21);
    assert_eq!(summary["recording"]["outside_time_range"], 79);
    assert_eq!(rows[0]["t_s"], 11.0);
}

/// Old estimates are stale by the recorded times, and count as fresh if only stamps are used.
#[test]
fn age_is_log_time_minus_stamp() {
    let mut bag = Bag::new(None, true);
    for (k, late) in [0.05, 0.15, 0.3, 0.05].into_iter().enumerate() {
        let t_s = 5.0 + k as f64;
        bag.pose(
            "/amcl_pose",
            &Pose {
                t_s,
                logged_s: Some(t_s + late),
                ..Pose::AT_DOCK
            },
        );
    }
    let folder = Folder::of(&bag.finish());
    let (rows, summary) = folder.replay("dock", "--topic /amcl_pose");
    let reasons: Vec<&Value> = rows.iter().map(|row| &row["reason"]).collect();
    assert_eq!(
        reasons,
        [&Value::Null, &Value::Null, &"stale".into(), &Value::Null]
    );
    let most = summary["ages_s"]["most"].as_f64().unwrap();
    assert!((most - 0.3).abs() < 1e-6, "{most}");
    let (rows, summary) = folder.replay("dock", "--topic /amcl_pose --clock stamps");
    assert!(rows.iter().all(|row| row["verdict"] == "permit"));
    assert!(summary["ages_s"].is_null());
}

/// The corners of t7 from 1.5 m give a pose near the true one, whose set the gate accepts. Also tests another tag and
/// no tag.
#[test]
fn detections_become_estimates() {
    let mut bag = Bag::new(Some(Compression::Lz4), true);
    let pose = [1.7, 0.7, -0.25];
    bag.look("/detections", 1.0, 7, pose);
    bag.look("/detections", 2.0, 99, pose);
    let folder = Folder::of(&bag.finish());
    let (rows, summary) = folder.replay("see-t7", "--topic /detections --sigma-px 0.1");
    assert_eq!(rows.len(), 1);
    for (found, real) in rows[0]["pose"].as_array().unwrap().iter().zip(pose) {
        assert!((found.as_f64().unwrap() - real).abs() < 1e-6, "{}", rows[0]);
    }
    assert_eq!(rows[0]["verdict"], "permit", "{}", rows[0]);
    assert_eq!(summary["looks"]["fixes"], 1);
    assert_eq!(summary["looks"]["unknown_tags"], 1);
    assert_eq!(summary["looks"]["no_known_tag"], 1);
}

/// Trajectories have no covariance: they are denied, or evaluated with a bound around each pose.
#[test]
fn tum_trajectory_is_replayed() {
    let folder = Folder::of(b"");
    let text = "# t x y z q\n1 0 0 0 0 0 0 1\n1.05 0 nan 0 0 0 0 1\n1.1 0 0 0 0 0 0 1.1\n1.15 0 0 0 0 0 0 1\n";
    folder.0.write("drive.mcap", text);
    let (rows, summary) = folder.replay("dock", "");
    assert_eq!(summary["findings"]["without_covariance"], 4);
    assert_eq!(summary["findings"]["pose_not_finite"], 1);
    assert_eq!(summary["findings"]["quaternion_not_unit"], 1);
    assert_eq!(rows[0]["reason"], "covariance_unknown");
    let (rows, _) = folder.replay("dock", "--set bounded --translation 0.02 --yaw-deg 1");
    let verdicts: Vec<&Value> = rows.iter().map(|row| &row["verdict"]).collect();
    assert_eq!(verdicts, ["permit", "deny", "deny", "permit"]);
    folder.0.write("drive.mcap", "1 0 0 0 0 0 0\n");
    let drive = folder.path("drive.mcap");
    posegate(&format!("replay {SITE} {drive} --task dock")).is_refused_with(&[":1:14: 7 numbers"]);
}

#[test]
fn replay_is_drawn() {
    let mut bag = Bag::new(None, true);
    for pose in drive() {
        bag.pose("/amcl_pose", &pose);
        bag.truth("/mocap", &pose);
    }
    let folder = Folder::of(&bag.finish());
    let (out, picture) = (folder.path("out.mcap"), folder.path("out.svg"));
    let options = format!("--topic /amcl_pose --truth /mocap --mcap {out} -o {picture}");
    let (_, summary) = folder.replay("dock", &options);
    let picture = folder.0.text("out.svg");
    let lanes = "estimates gate interlock reasons distance sigma ellipse margin Stanford";
    for name in lanes.split(' ') {
        assert!(picture.contains(&format!(">{name}")), "{name}");
    }
    // The map is first.
    let map = picture
        .find(">pose-sets on the floor")
        .map(|_| picture.find(">near the goal"));
    let map = map
        .flatten()
        .or_else(|| picture.find(">the estimates and the goal"));
    assert!(map < picture.find(">gate") && map.is_some());
    // Each reason has its seconds in the legend, and a colour that is also in its lane.
    let shut = summary["interlock"]["shut_s_by"].as_object().unwrap();
    assert!(shut.len() > 1, "{summary}");
    for (reason, seconds) in shut {
        let words = format!(">{reason}, {:.1} s<", seconds.as_f64().unwrap());
        let (before, _) = picture.split_once(&words).expect(&words);
        let (_, patch) = before.rsplit_once("<rect").unwrap();
        let colour = patch.split("fill=").nth(1).unwrap().split('/').next();
        assert!(picture.matches(colour.unwrap()).count() > 1, "{reason}");
    }
    assert_eq!(folder.0.names().len(), 4);
}

/// Estimates without a pose-set, or at no place on the floor, leave a picture whose numbers are all numbers.
#[test]
fn damaged_estimates_are_drawn() {
    let folder = Folder::of(b"");
    let (csv, picture) = (folder.path("damaged.csv"), folder.path("damaged.svg"));
    let header = "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n";
    let rows = "1,0,0,0,1e-6,0,0,1e-6,0,1e-6\n2,0,0,0,1e-6,nan,0,1e-6,0,1e-6\n3,0,0,0,1e308,1e308,0,1e308,0,1e308\n\
                4,1e300,0,0,1e-6,0,0,1e-6,0,1e-6\n5,nan,0,0,1e-6,0,0,1e-6,0,1e-6\n6,0,0,0,-1,0,0,-1,0,-1\n7,0,0,0,inf,0,0,1e-6,0,1e-6\n";
    folder.0.write("damaged.csv", header.to_owned() + rows);
    posegate(&format!("replay {SITE} {csv} --task dock -o {picture}")).with(0);
    let picture = folder.0.text("damaged.svg");
    assert!(picture.contains(">pose-sets on the floor"));
    assert!(!picture.contains("NaN") && !picture.contains("inf,"));
    // The place that is farthest away has no axis.
    assert!(!picture.contains("0000000000"));
}

/// `now_s` is used at any distance from the stamp, as in `posegate gate`.
#[test]
fn now_s_is_used_as_in_the_gate() {
    let folder = Folder::of(b"");
    let header = "t_s,now_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n";
    let set = "0,0,0,1e-6,0,0,1e-6,0,1e-6\n";
    for times in [
        &["0,4000", "10,10.5", "11,12", "12,12.1"][..],
        &["9,nan", "10,10.5", "11,11.1"],
        &["nan,1", "10,10.1"],
    ] {
        let lines_of = times.iter().map(|time| format!("{time},{set}"));
        let (csv, rows) = (folder.path("times.csv"), folder.path("rows.jsonl"));
        folder.0.write(
            "times.csv",
            header.to_string() + &lines_of.collect::<String>(),
        );
        let table = "examples/tables/dock.posegate";
        let gate = posegate(&format!("gate {table} --estimates {csv} --json")).lines();
        posegate(&format!(
            "replay {SITE} {csv} --task dock --table {table} --rows {rows}"
        ))
        .with(0);
        let rows = folder.rows();
        assert_eq!(gate.len(), rows.len());
        assert!(gate.iter().any(|line| line["reason"] == "stale"));
        assert!(gate.iter().any(|line| line["verdict"] == "permit"));
        for (gate, row) in gate.iter().zip(&rows) {
            assert_eq!(gate["reason"], row["reason"], "{times:?}: {gate} {row}");
        }
    }
}

/// One strange stamp does not switch off freshness. If nearly all stamps are of another clock, that is reported.
#[test]
fn clock_is_chosen_by_the_majority_of_stamps() {
    let bag = |stamp: &dyn Fn(f64) -> f64| {
        let mut bag = Bag::new(None, true);
        for k in 0..50 {
            let logged_s = 9000.0 + 0.05 * f64::from(k);
            let pose = Pose {
                t_s: stamp(logged_s),
                logged_s: Some(logged_s),
                ..Pose::AT_DOCK
            };
            bag.pose("/amcl_pose", &pose);
        }
        Folder::of(&bag.finish())
    };
    let late = bag(&|logged_s| {
        if logged_s == 9000.0 {
            0.0
        } else {
            logged_s - 5.0
        }
    });
    let (rows, summary) = late.replay("dock", "--topic /amcl_pose");
    assert_eq!(summary["clock"], "logged");
    assert_eq!(summary["freshness"], "checked");
    assert!(rows.iter().all(|row| row["reason"] == "stale"));
    let other = bag(&|logged_s| logged_s - 8000.0);
    let (_, summary) = other.replay("dock", "--topic /amcl_pose");
    assert_eq!(summary["clock"], "stamps");
    let freshness = summary["freshness"].as_str().unwrap();
    assert!(freshness.starts_with("not checked"), "{freshness}");
    let drive = other.path("drive.mcap");
    let output = posegate(&format!(
        "replay {SITE} {drive} --task dock --topic /amcl_pose"
    ));
    assert!(output.out.contains(freshness), "{}", output.out);
}

/// A requested topic or truth that does not exist is an error.
#[test]
fn missing_truth_or_topic_is_refused() {
    let mut bag = Bag::new(None, true);
    for (k, pose) in drive().iter().enumerate() {
        bag.pose("/amcl_pose", pose);
        if k % 20 == 0 {
            bag.truth(
                "/rare",
                &Pose {
                    t_s: pose.t_s + 0.01,
                    ..*pose
                },
            );
        }
        bag.truth(
            "/lab",
            &Pose {
                frame: "lab",
                ..*pose
            },
        );
    }
    let folder = Folder::of(&bag.finish());
    let drive = folder.path("drive.mcap");
    for (options, expected) in [
        ("--truth /nothing", "/nothing: none of 100 estimates"),
        ("--truth /rare", "5 true poses, at"),
        ("--truth /lab", "100 of another frame"),
        ("--truth /amcl_pose", "a topic of estimates too"),
        ("--topic /none", "no topic /none"),
        ("--from nan", "--from"),
    ] {
        let line = format!("replay {SITE} {drive} --task dock --topic /amcl_pose {options}");
        posegate(&line).is_refused_with(&[expected]);
    }
    let (_, summary) = folder.replay("dock", "--topic /amcl_pose");
    assert_eq!(summary["truth"]["estimates"], 0);
    assert_eq!(summary["truth"]["without"], 100);
}

/// True poses that are in another frame, not unit or tilted are refused and counted. An estimate in another frame has
/// no error.
#[test]
fn true_pose_in_another_frame_or_tilted_is_rejected() {
    let mut bag = Bag::new(None, true);
    for (k, pose) in drive().iter().enumerate() {
        let estimate = Pose {
            frame: if k == 50 { "odom" } else { "map" },
            x: if k == 50 { 70.0 } else { pose.x },
            logged_s: (k == 60).then_some(pose.t_s + 3.0),
            ..*pose
        };
        bag.pose("/amcl_pose", &estimate);
        let real = Pose {
            logged_s: None,
            ..*pose
        };
        bag.truth(
            "/mocap",
            &match k {
                10 => Pose {
                    frame: "lab",
                    ..real
                },
                20 => Pose {
                    length: 0.0,
                    ..real
                },
                30 => Pose { roll: 0.2, ..real },
                _ => real,
            },
        );
    }
    let folder = Folder::of(&bag.finish());
    let options = "--topic /amcl_pose --truth /mocap --truth-gap 0.06";
    let (rows, summary) = folder.replay("dock", options);
    assert_eq!(rows[60]["reason"], "stale");
    let truth = &summary["truth"];
    for (name, count) in [
        ("estimates", 96),
        ("without", 4),
        ("of_other_frame", 1),
        ("poses", 97),
        ("poses_of_other_frame", 1),
        ("poses_not_unit", 1),
        ("poses_tilted", 1),
        // The set of a stale estimate is counted.
        ("pose_sets", 96),
        ("lost", 0),
    ] {
        assert_eq!(truth[name], count, "{name}: {truth}");
    }
    assert!(truth["rmse_m"].as_f64().unwrap() < 1e-9, "{truth}");
}

/// A stamp far in the future delays only the truth of its own row.
#[test]
fn stamp_far_ahead_does_not_take_the_truth_of_other_rows() {
    let mut bag = Bag::new(Some(Compression::Lz4), true);
    for k in 0..150_000 {
        let t_s = 10.0 + 0.0005 * f64::from(k);
        let pose = Pose {
            t_s,
            logged_s: Some(t_s + 0.001),
            ..Pose::AT_DOCK
        };
        if k % 1000 == 0 {
            let t_s = if k == 3000 { 2_147_483_600.0 } else { t_s };
            bag.pose("/amcl_pose", &Pose { t_s, ..pose });
        }
        bag.truth("/mocap", &pose);
    }
    let folder = Folder::of(&bag.finish());
    let (rows, summary) = folder.replay("dock", "--topic /amcl_pose --truth /mocap --fast");
    assert_eq!(rows.len(), 150);
    assert_eq!(summary["truth"]["estimates"], 149, "{}", summary["truth"]);
    assert_eq!(summary["truth"]["without"], 1);
}

/// Detections of two cameras are refused.
#[test]
fn detections_of_two_cameras_are_refused() {
    let mut bag = Bag::new(None, true);
    let pose = [1.7, 0.7, -0.25];
    bag.look("/detections", 1.0, 7, pose);
    let one = Folder::of(&bag.finish());
    let (_, summary) = one.replay("see-t7", "--topic /detections --sigma-px 0.1");
    assert_eq!(summary["looks"]["frame"], "camera");
    let mut bag = Bag::new(None, true);
    bag.look("/detections", 1.0, 7, pose);
    bag.look_in("rear_camera", "/detections", 2.0, 7, pose);
    let two = Folder::of(&bag.finish());
    let drive = two.path("drive.mcap");
    let output = posegate(&format!(
        "replay {SITE} {drive} --task see-t7 --topic /detections"
    ));
    output.is_refused_with(&["rear_camera"]);
}

/// The age is 0 for equal times of the present date, because nanoseconds are not rounded before the conversion to milliseconds.
#[test]
fn age_is_zero_when_stamp_equals_log_time() {
    let mut bag = Bag::new(None, true);
    for k in 0..500 {
        let nanoseconds = 1_700_000_000_000_000_000 + k * 33_000_000;
        bag.pose_at("/amcl_pose", nanoseconds, &Pose::AT_DOCK);
    }
    let folder = Folder::of(&bag.finish());
    let (rows, summary) = folder.replay("dock", "--topic /amcl_pose");
    assert_eq!(summary["clock"], "logged");
    for row in &rows {
        assert_eq!(row["verdict"], "permit", "{row}");
        assert_eq!(row["age_s"], 0.0, "{row}");
    }
}

/// A bound around each estimate changes the gate's sets, not the input of other rules. Rules do not evaluate estimates
/// that lack what they need.
#[test]
fn rules_use_the_recorded_estimate() {
    let mut bag = Bag::new(None, true);
    for pose in drive() {
        bag.pose("/amcl_pose", &pose);
    }
    let folder = Folder::of(&bag.finish());
    let bounded = "--set bounded --translation 0.02 --yaw-deg 1";
    let (_, plain) = folder.replay("dock", "--topic /amcl_pose");
    let (_, with_bound) = folder.replay("dock", &format!("--topic /amcl_pose {bounded}"));
    for rule in ["distance", "sigma", "ellipse"] {
        assert_eq!(plain["rules"][rule], with_bound["rules"][rule], "{rule}");
    }
    assert_eq!(plain["rules"]["sigma"]["permits"], 100);
    assert!(plain["rules"]["ate"].is_null(), "no truth");
    folder.0.write("drive.mcap", "1 0 0 0 0 0 0 1\n");
    let (rows, summary) = folder.replay("dock", bounded);
    assert_eq!(rows[0]["distance"], true);
    for rule in ["sigma", "ellipse"] {
        assert!(rows[0][rule].is_null() && summary["rules"][rule].is_null());
    }
}
