//! Recordings of rosbag2 and ROS 1 in every storage: the same drive gives the same summary.

use crate::run::Case;
use posegate_testkit::bags::{Bag, Pose, pose_definition, pose_message};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use serde_json::Value;
use std::io::Write;

const SITE: &str = include_str!("../../../../examples/sites/dock.toml");
const TOPIC: &str = "/amcl_pose";
const KIND: &str = "geometry_msgs/msg/PoseWithCovarianceStamped";

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

fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// A bag in SQLite. Humble's has no definitions; `pack` changes each message.
fn sqlite(poses: &[Pose], has_definitions: bool, pack: fn(Vec<u8>) -> Vec<u8>) -> Vec<u8> {
    let file = tempfile::NamedTempFile::new().expect("a file");
    let database = rusqlite::Connection::open(file.path()).expect("a database");
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
             CREATE INDEX timestamp_idx ON messages (timestamp ASC);",
        )
        .expect("tables");
    let topic = "INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')";
    database.execute(topic, (4, TOPIC, KIND)).expect("a topic");
    database
        .execute(topic, (7, "/camera", "sensor_msgs/msg/Image"))
        .expect("a topic");
    if has_definitions {
        database
            .execute_batch("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, encoded_message_definition TEXT, type_description_hash TEXT)")
            .expect("a table");
        let definition = "INSERT INTO message_definitions VALUES (1, ?1, 'ros2msg', ?2, '')";
        database
            .execute(definition, (KIND, pose_definition()))
            .expect("a definition");
    }
    let message = "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
    for pose in poses {
        let time = nanoseconds(pose.t_s + 0.01);
        database
            .execute(message, (4, time, pack(pose_message(pose))))
            .expect("a message");
    }
    database
        .execute(message, (7, nanoseconds(1.0), vec![0u8; 8]))
        .expect("a message");
    database.close().expect("a database");
    std::fs::read(file.path()).expect("bytes")
}

/// A bag of ROS 1 with one chunk.
fn ros1(poses: &[Pose], compression: &str) -> Vec<u8> {
    let part = |bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat();
    let field = |name: &str, value: &[u8]| part(&[name.as_bytes(), b"=", value].concat());
    let record = |fields: &[Vec<u8>], data: &[u8]| [part(&fields.concat()), part(data)].concat();
    let definition =
        pose_definition().replace("builtin_interfaces/Time stamp", "uint32 seq\ntime stamp");
    let mut records = Vec::new();
    for (id, topic, kind, definition) in [
        (
            0u32,
            TOPIC,
            "geometry_msgs/PoseWithCovarianceStamped",
            definition.as_str(),
        ),
        (1, "/camera", "sensor_msgs/Image", "uint8[] data\n"),
    ] {
        let head = [
            field("op", &[7]),
            field("conn", &id.to_le_bytes()),
            field("topic", topic.as_bytes()),
        ];
        let data = [
            field("topic", topic.as_bytes()),
            field("type", kind.as_bytes()),
            field("md5sum", b"0"),
            field("message_definition", definition.as_bytes()),
        ];
        records.extend(record(&head, &data.concat()));
    }
    let time = |seconds: f64| {
        let all = nanoseconds(seconds);
        let (whole, rest) = ((all / 1_000_000_000) as u32, (all % 1_000_000_000) as u32);
        [whole.to_le_bytes(), rest.to_le_bytes()].concat()
    };
    for (sequence, pose) in (0u32..).zip(poses) {
        let mut data = sequence.to_le_bytes().to_vec();
        data.extend(time(pose.t_s));
        data.extend(part(pose.frame.as_bytes()));
        let (sin, cos) = (0.5 * pose.yaw).sin_cos();
        let mut floats = vec![pose.x, pose.y, 0.0, 0.0, 0.0, sin, cos];
        let mut covariance = [0.0; 36];
        [covariance[0], covariance[7], covariance[35]] = pose.covariance;
        floats.extend(covariance);
        data.extend(floats.iter().flat_map(|float| float.to_le_bytes()));
        let head = [
            field("op", &[2]),
            field("conn", &0u32.to_le_bytes()),
            field("time", &time(pose.t_s + 0.01)),
        ];
        records.extend(record(&head, &data));
    }
    let head = [
        field("op", &[2]),
        field("conn", &1u32.to_le_bytes()),
        field("time", &time(1.0)),
    ];
    records.extend(record(&head, &[0; 4]));
    let size = (records.len() as u32).to_le_bytes();
    let data = match compression {
        "lz4" => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            encoder.write_all(&records).expect("lz4");
            encoder.finish().expect("lz4")
        }
        "bz2" => {
            let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::best());
            encoder.write_all(&records).expect("bzip2");
            encoder.finish().expect("bzip2")
        }
        _ => records,
    };
    let mut bytes = b"#ROSBAG V2.0\n".to_vec();
    let head = [
        field("op", &[3]),
        field("index_pos", &[0; 8]),
        field("conn_count", &[2, 0, 0, 0]),
        field("chunk_count", &[1, 0, 0, 0]),
    ];
    bytes.extend(record(&head, &[b' '; 4027]));
    let head = [
        field("op", &[5]),
        field("compression", compression.as_bytes()),
        field("size", &size),
    ];
    bytes.extend(record(&head, &data));
    bytes.extend(record(
        &[field("op", &[4]), field("ver", &[1, 0, 0, 0])],
        &[0; 12],
    ));
    bytes
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    compress_to_vec(bytes, CompressionLevel::Fastest)
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
        ("a.db3", sqlite(&poses, false, plain)),
        ("iron.db3", sqlite(&poses, true, plain)),
        ("messages.db3", sqlite(&poses, false, |bytes| zstd(&bytes))),
        ("none.bag", ros1(&poses, "none")),
        ("lz4.bag", ros1(&poses, "lz4")),
        ("bz2.bag", ros1(&poses, "bz2")),
        ("a.mcap.zstd", zstd(&mcap(&poses))),
        ("a.db3.zstd", zstd(&sqlite(&poses, false, plain))),
        ("single/a_0.mcap", mcap(&poses)),
        ("listed/metadata.yaml", metadata(&["b_0.db3"]).into()),
        ("listed/b_0.db3", sqlite(&poses, false, plain)),
        ("packed/metadata.yaml", metadata(&["b_0.db3.zstd"]).into()),
        ("packed/b_0.db3.zstd", zstd(&sqlite(&poses, false, plain))),
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
    for log in ["single", "listed", "packed/"] {
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
        ("split/c_1.db3", sqlite(second, false, plain)),
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
        ("a.db3", &sqlite(&poses, false, |bytes| bytes)),
        ("a.bag", &ros1(&poses, "none")),
    ]);
    for log in ["a.mcap", "a.db3", "a.bag"] {
        for wrong in ["/pose", "/pose --topic /amcl_pose"] {
            let output = std::process::Command::new(env!("CARGO_BIN_EXE_posegate"))
                .args(
                    format!("replay site.toml {log} --task dock --topic {wrong}")
                        .split_whitespace(),
                )
                .current_dir(case.path())
                .output()
                .expect("the program runs");
            assert_eq!(output.status.code(), Some(2));
            let text = String::from_utf8_lossy(&output.stderr);
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
    let good = sqlite(&poses, false, |bytes| bytes);
    let cut = ros1(&poses, "none");
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
        assert!(matches!(ended.code, Some(0 | 2)), "{}", ended.err);
        assert!(ended.err.contains(log), "{log}: {}", ended.err);
    }
}
