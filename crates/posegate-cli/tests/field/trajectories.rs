//! Trajectories of public data.

use posegate_testkit::bags::{Bag, Pose};
use posegate_testkit::run::Case;

const TUM: &str = "# \u{e9}t\u{e9}\n1.0 0 0 0 0 0 0 1\n1.5 0.5 0 0 0 0 0 1\n1.5 0.5001 0 0 0 0 0 1\n2.0 1 0 0 0 0 0 1\n";
const EUROC: &str = "#timestamp [ns],p_x [m],p_y,p_z,q_w,q_x,q_y,q_z,v_x\n1000000000,0,0,0,1,0,0,0,9\n1500000000,0.5,0,0,1,0,0,0,9\n2000000000,1,0,0,1,0,0,0,9\n";
const KITTI: &str = "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.5 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n";
const TIMES: &str = "1.0\n1.5e+00\n2.0\n";

/// In Latin-1, as an old editor writes comments.
fn latin_1(text: &str) -> Vec<u8> {
    text.chars().map(|letter| letter as u8).collect()
}

#[test]
fn public_trajectories_are_compared() {
    let case = Case::new(&[
        ("tum.txt", &latin_1(TUM)),
        ("data.csv", EUROC.as_bytes()),
        ("kitti.txt", KITTI.as_bytes()),
        ("times.txt", TIMES.as_bytes()),
    ]);
    for (files, duplicates) in [
        ("tum.txt data.csv", 1),
        ("data.csv tum.txt", 1),
        ("data.csv data.csv", 0),
        ("kitti.txt data.csv --times times.txt", 0),
        ("tum.txt kitti.txt --times times.txt", 1),
    ] {
        let found = case.run(&format!("metrics {files} --json")).json(0);
        assert_eq!(found["duplicates"], duplicates, "{files}");
        assert_eq!(found["pairs"], 3, "{files}");
        let most = found["ape"]["translation"]["max"]
            .as_f64()
            .expect("a number");
        assert!(most < 1e-9, "{files}: {most}");
    }
    let text = case.run("metrics tum.txt data.csv");
    assert!(
        text.out
            .contains("1 poses have the time of the pose before"),
        "{}",
        text.out
    );
    case.run("metrics kitti.txt data.csv")
        .is_refused_with(&["kitti.txt:1:1", "--times FILE"]);
    case.run("metrics kitti.txt data.csv --times data.csv")
        .is_refused_with(&["data.csv:2:1", "one time"]);
    let back = TUM.replace("2.0 1", "0.5 1");
    let case = Case::new(&[("tum.txt", back.as_bytes()), ("data.csv", EUROC.as_bytes())]);
    case.run("metrics tum.txt data.csv")
        .is_refused_with(&["tum.txt:5:1: the time 0.5 is before"]);
}

#[test]
fn public_trajectories_are_the_truth_and_the_recording() {
    let site = include_str!("../../../../examples/sites/dock.toml");
    let mut bag = Bag::new(None, true);
    for k in 0..11 {
        let t_s = 1.0 + 0.1 * f64::from(k);
        let x = t_s - 1.0;
        bag.pose(
            "/amcl_pose",
            &Pose {
                t_s,
                x,
                covariance: [1e-6; 3],
                ..Pose::AT_DOCK
            },
        );
    }
    let bag = bag.finish();
    let case = Case::new(&[
        ("site.toml", site.as_bytes()),
        ("drive.mcap", &bag),
        ("tum.txt", &latin_1(TUM)),
        ("data.csv", EUROC.as_bytes()),
        ("kitti.txt", KITTI.as_bytes()),
        ("times.txt", TIMES.as_bytes()),
    ]);
    let replay = "replay site.toml drive.mcap --task dock --topic /amcl_pose --json --truth-gap 1";
    for (truth, duplicates) in [
        ("tum.txt", 1),
        ("data.csv", 0),
        ("kitti.txt --times times.txt", 0),
    ] {
        let found = case.run(&format!("{replay} --truth {truth}")).json(0);
        assert_eq!(found["truth"]["estimates"], 11, "{truth}");
        assert_eq!(found["truth"]["duplicates"], duplicates, "{truth}");
        assert!(found["truth"]["rmse_m"].as_f64().expect("a number") < 1e-6);
    }
    let bounded = "--task dock --json --set bounded --translation 0.01 --yaw-deg 1";
    for log in ["data.csv", "kitti.txt --times times.txt"] {
        let found = case
            .run(&format!("replay site.toml {log} {bounded}"))
            .json(0);
        assert_eq!(found["rules"]["gate"]["permits"], 1, "{log}");
        assert_eq!(found["estimates"], 3);
    }
}

/// With w first the heading would be read as a roll.
#[test]
fn truth_in_another_order_of_the_quaternion_is_refused() {
    let site = include_str!("../../../../examples/sites/dock.toml");
    let mut bag = Bag::new(None, true);
    bag.pose("/amcl_pose", &Pose::AT_DOCK);
    let case = Case::new(&[
        ("site.toml", site.as_bytes()),
        ("drive.mcap", &bag.finish()),
        ("truth.txt", b"1 0 0 0 0.8 0 0 0.6\n2 0 0 0 1 0 0 0\n"),
        ("drive.mcap.gz", b"\x1f\x8b\x08\x00"),
        ("echo.yaml", b"header:\n  stamp:\n    sec: 5\n"),
    ]);
    case.run("replay site.toml drive.mcap --task dock --topic /amcl_pose --truth truth.txt")
        .is_refused_with(&["2 of 2 poses are tilted", "qx qy qz qw"]);
    case.run("replay site.toml drive.mcap.gz --task dock --topic /amcl_pose")
        .is_refused_with(&["packed by gzip", "unpack it"]);
    case.run("replay site.toml echo.yaml --task dock")
        .is_refused_with(&["the text of `ros2 topic echo`", "ros2 bag record"]);
}

/// OKVIS has EuRoC's columns with w last, ORB-SLAM3 has TUM's with nanoseconds.
#[test]
fn relatives_of_the_formats_are_read() {
    let at = 1_403_636_579_000_000_000u64;
    let rows = |row: &dyn Fn(u64, f64) -> String| -> String {
        (0..3u32)
            .map(|k| row(at + 100_000_000 * u64::from(k), 0.1 * f64::from(k)))
            .collect()
    };
    let tum = rows(&|t, x| {
        format!(
            "{}.{:09} {x} 2 0 0 0 0.6 0.8\n",
            t / 1_000_000_000,
            t % 1_000_000_000
        )
    });
    let orb = rows(&|t, x| format!("{t}.000000 {x} 2 0 0 0 0.6 0.8\n"));
    let header =
        "timestamp, p_WS_W_x, p_WS_W_y, p_WS_W_z, q_WS_x, q_WS_y, q_WS_z, q_WS_w, v_WS_W_x\n";
    let okvis = rows(&|t, x| format!("{t}, {x}, 2, 0, 0, 0, 0.6, 0.8, 9\n"));
    let okvis = format!("{header}{okvis}");
    let noted = format!("#{okvis}");
    let case = Case::new(&[
        ("tum.txt", tum.as_bytes()),
        ("orb.txt", orb.as_bytes()),
        ("okvis.csv", okvis.as_bytes()),
        ("noted.csv", noted.as_bytes()),
        ("one.txt", tum.lines().next().expect("a line").as_bytes()),
    ]);
    for file in ["orb.txt", "okvis.csv", "noted.csv"] {
        let found = case.run(&format!("metrics tum.txt {file} --json")).json(0);
        assert_eq!(found["pairs"], 3, "{file}");
        for part in ["translation", "rotation_deg"] {
            let most = found["ape"][part]["max"].as_f64().expect("a number");
            assert!(most < 1e-6, "{file}: {part} {most}");
        }
    }
    // One pose each has an error, and no relative one.
    let found = case.run("metrics one.txt one.txt --json").json(0);
    assert_eq!(found["pairs"], 1);
    assert!(found["rpe"]["delta_1_frame"].is_null(), "{found}");
    case.run("metrics tum.txt one.txt")
        .is_refused_with(&["1 pair of poses only"]);
}

#[test]
fn commas_and_headers_of_other_files_are_named() {
    let case = Case::new(&[
        ("good.txt", TUM.as_bytes()),
        ("commas.csv", b"1.5,0,0,0,0,0,0,1\n"),
        ("names.txt", b"time x y z qx qy qz qw\n1.5 0 0 0 0 0 0 1\n"),
    ]);
    case.run("metrics good.txt commas.csv").is_refused_with(&[
        "commas.csv:1:1: seconds, commas, and no header",
        "#timestamp [s],x,y,z,qw,qx,qy,qz",
    ]);
    case.run("metrics good.txt names.txt")
        .is_refused_with(&["names.txt:1:1: `time`", "a header begins with #"]);
}
