//! Recordings of rosbag2 and ROS 1 in every storage: the same drive gives the same summary.

use posegate_testkit::bags::{Bag, Pose};
use posegate_testkit::run::Case;
use posegate_testkit::storages::{ros1, sqlite, zstd};
use serde_json::Value;

const SITE: &str = include_str!("../../../../examples/sites/dock.toml");
const TOPIC: &str = "/amcl_pose";

/// A drive into the dock, and out of it again.
fn drive() -> Vec<Pose> {
    let pose = |k: u32| Pose {
        t_s: 10.0 + 0.1 * f64::from(k),
        x: -0.2 + 0.01 * f64::from(k),
        covariance: [1e-5, 1e-5, 1e-5],
        ..Pose::AT_DOCK
    };
    (0..40).map(pose).collect()
}

fn mcap(poses: &[Pose]) -> Vec<u8> {
    let mut bag = Bag::new(None, true);
    for pose in poses {
        bag.pose(TOPIC, pose);
    }
    bag.other("/camera", "sensor_msgs/msg/Image", 1);
    bag.finish()
}

fn metadata(files: &[&str]) -> String {
    let list: String = files.iter().map(|file| format!("    - {file}\n")).collect();
    format!(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  duration:\n    nanoseconds: 5\n  relative_file_paths:\n{list}  compression_format: zstd\n  compression_mode: FILE\n"
    )
}

/// Returns the summary of a replay, without what names the file.
fn replayed(case: &Case, log: &str) -> Value {
    let replay = format!("replay site.toml {log} --task dock --topic {TOPIC} --json");
    let mut summary = case.run(&replay).json(0);
    let recording = summary["recording"].take();
    assert_eq!(recording["damage"], Value::Null, "{log}");
    assert_eq!(recording["topics"][TOPIC], 40, "{log}: {recording}");
    assert_eq!(
        recording["skipped_topics"]["/camera"]["messages"], 1,
        "{log}: {recording}"
    );
    assert_eq!(recording["undecodable"], 0, "{log}: {recording}");
    summary
}

#[test]
fn every_storage_gives_the_same_summary() {
    let poses = drive();
    let (first, second) = poses.split_at(25);
    let plain = |bytes| bytes;
    let files: Vec<(&str, Vec<u8>)> = vec![
        ("site.toml", SITE.into()),
        ("a.mcap", mcap(&poses)),
        ("a.db3", sqlite(TOPIC, &poses, false, plain)),
        ("iron.db3", sqlite(TOPIC, &poses, true, plain)),
        (
            "messages.db3",
            sqlite(TOPIC, &poses, false, |bytes| zstd(&bytes)),
        ),
        ("none.bag", ros1(TOPIC, &poses, "none")),
        ("lz4.bag", ros1(TOPIC, &poses, "lz4")),
        ("bz2.bag", ros1(TOPIC, &poses, "bz2")),
        ("a.mcap.zstd", zstd(&mcap(&poses))),
        ("a.db3.zstd", zstd(&sqlite(TOPIC, &poses, false, plain))),
        ("single/a_0.mcap", mcap(&poses)),
        ("listed/metadata.yaml", metadata(&["b_0.db3"]).into()),
        ("listed/b_0.db3", sqlite(TOPIC, &poses, false, plain)),
        // Up to version 3 of the metadata: with the folder's name, which is another one now.
        ("older/metadata.yaml", metadata(&["drive/b_0.db3"]).into()),
        ("older/b_0.db3", sqlite(TOPIC, &poses, false, plain)),
        ("packed/metadata.yaml", metadata(&["b_0.db3.zstd"]).into()),
        (
            "packed/b_0.db3.zstd",
            zstd(&sqlite(TOPIC, &poses, false, plain)),
        ),
    ];
    let named: Vec<(&str, &[u8])> = files
        .iter()
        .map(|(name, bytes)| (*name, bytes.as_slice()))
        .collect();
    let case = Case::new(&named);
    let expected = replayed(&case, "a.mcap");
    assert_eq!(expected["estimates"], 40);
    assert!(
        expected["rules"]["gate"]["permits"]
            .as_u64()
            .expect("a count")
            > 5
    );
    for log in named
        .iter()
        .map(|(name, _)| *name)
        .filter(|name| name.contains(".bag") || name.starts_with("a.") || name.ends_with(".db3"))
    {
        assert_eq!(replayed(&case, log), expected, "{log}");
    }
    for log in [
        "single",
        "listed",
        "listed/metadata.yaml",
        "older",
        "packed/",
    ] {
        assert_eq!(replayed(&case, log), expected, "{log}");
    }
    // A split recording: only the second file has the picture.
    let split: Vec<(&str, Vec<u8>)> = vec![
        ("site.toml", SITE.into()),
        (
            "split/metadata.yaml",
            metadata(&["c_0.mcap", "c_1.db3"]).into(),
        ),
        ("split/c_0.mcap", {
            let mut bag = Bag::new(None, true);
            first.iter().for_each(|pose| bag.pose(TOPIC, pose));
            bag.finish()
        }),
        ("split/c_1.db3", sqlite(TOPIC, second, false, plain)),
    ];
    let named: Vec<(&str, &[u8])> = split
        .iter()
        .map(|(name, bytes)| (*name, bytes.as_slice()))
        .collect();
    assert_eq!(replayed(&Case::new(&named), "split"), expected);
}

#[test]
fn missing_topic_names_the_topics_one_a_line() {
    let poses = drive();
    let case = Case::new(&[
        ("site.toml", SITE.as_bytes()),
        ("a.mcap", &mcap(&poses)),
        ("a.db3", &sqlite(TOPIC, &poses, false, |bytes| bytes)),
        ("a.bag", &ros1(TOPIC, &poses, "none")),
    ]);
    for log in ["a.mcap", "a.db3", "a.bag"] {
        for wrong in ["/pose", "/pose --topic /amcl_pose"] {
            let line = format!("replay site.toml {log} --task dock --topic {wrong}");
            let text = case.run(&line).with(2).err;
            for topic in ["/amcl_pose (", "/camera ("] {
                let found = text.lines().filter(|line| line.contains(topic)).count();
                assert_eq!(found, 1, "{text}");
            }
            assert!(
                text.contains("has no topic /pose") && !text.contains("\\n"),
                "{text}"
            );
        }
        let wanted = case.run(&format!("replay site.toml {log} --task dock"));
        wanted.is_refused_with(&["has topics:", "/amcl_pose (", "--topic /amcl_pose"]);
    }
}

#[test]
fn faults_of_bags_are_named() {
    let poses = drive();
    let good = sqlite(TOPIC, &poses, false, |bytes| bytes);
    let cut = ros1(TOPIC, &poses, "none");
    let other = tempfile::NamedTempFile::new().expect("a file");
    let database = rusqlite::Connection::open(other.path()).expect("a database");
    database
        .execute_batch("CREATE TABLE t(x); CREATE VIEW messages AS SELECT 1 AS topic_id, 1 AS timestamp, x'00' AS data; CREATE TABLE topics(id INTEGER)")
        .expect("tables");
    database.close().expect("a database");
    let case = Case::new(&[
        ("site.toml", SITE.as_bytes()),
        ("cut.db3", &good[..good.len() / 2]),
        ("other.db3", &std::fs::read(other.path()).expect("bytes")),
        ("cut.bag", &cut[..cut.len() - 700]),
        ("empty/x.txt", b""),
        ("two/a.mcap", b""),
        ("two/b.mcap", b""),
        (
            "out/metadata.yaml",
            metadata(&["../../etc/passwd"]).as_bytes(),
        ),
        ("gone/metadata.yaml", metadata(&["gone_0.db3"]).as_bytes()),
        ("bad/metadata.yaml", b"rosbag2_bagfile_information: 3\n"),
    ]);
    let refused = |log: &str, words: &[&str]| {
        let replay = format!("replay site.toml {log} --task dock --topic {TOPIC}");
        case.run(&replay).is_refused_with(words);
    };
    refused(
        "other.db3",
        &["other.db3: SQLite without the table `messages`"],
    );
    refused(
        "empty",
        &["the folder empty has no recording", "metadata.yaml"],
    );
    refused("two", &["2 recordings and no metadata.yaml"]);
    refused("out", &["not in the folder"]);
    refused("gone", &["gone_0.db3"]);
    refused("bad", &["bad/metadata.yaml:1"]);
    for log in ["cut.bag", "cut.db3"] {
        let ended = case.run(&format!(
            "replay site.toml {log} --task dock --topic {TOPIC}"
        ));
        assert!(matches!(ended.code, 0 | 2), "{}", ended.words());
        assert!(ended.words().contains(log), "{log}: {}", ended.words());
    }
}
