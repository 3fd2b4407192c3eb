//! Small bags in other storages than MCAP: SQLite of rosbag2, and ROS 1. Each has a topic of poses, and a picture in `/camera`.

use crate::bags::{Pose, pose_definition, pose_message};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use std::io::Write;

const KIND: &str = "geometry_msgs/msg/PoseWithCovarianceStamped";

fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// A bag in SQLite. Humble's has no definitions; `pack` changes each message.
pub fn sqlite(
    topic: &str,
    poses: &[Pose],
    has_definitions: bool,
    pack: fn(Vec<u8>) -> Vec<u8>,
) -> Vec<u8> {
    let file = tempfile::NamedTempFile::new().expect("a file");
    let database = rusqlite::Connection::open(file.path()).expect("a database");
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
             CREATE INDEX timestamp_idx ON messages (timestamp ASC);",
        )
        .expect("tables");
    let row = "INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')";
    database.execute(row, (4, topic, KIND)).expect("a topic");
    database
        .execute(row, (7, "/camera", "sensor_msgs/msg/Image"))
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
pub fn ros1(topic: &str, poses: &[Pose], compression: &str) -> Vec<u8> {
    let part = |bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat();
    let field = |name: &str, value: &[u8]| part(&[name.as_bytes(), b"=", value].concat());
    let record = |fields: &[Vec<u8>], data: &[u8]| [part(&fields.concat()), part(data)].concat();
    let definition =
        pose_definition().replace("builtin_interfaces/Time stamp", "uint32 seq\ntime stamp");
    let mut records = Vec::new();
    for (id, name, kind, definition) in [
        (
            0u32,
            topic,
            "geometry_msgs/PoseWithCovarianceStamped",
            definition.as_str(),
        ),
        (1, "/camera", "sensor_msgs/Image", "uint8[] data\n"),
    ] {
        let head = [
            field("op", &[7]),
            field("conn", &id.to_le_bytes()),
            field("topic", name.as_bytes()),
        ];
        let data = [
            field("topic", name.as_bytes()),
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

pub fn zstd(bytes: &[u8]) -> Vec<u8> {
    compress_to_vec(bytes, CompressionLevel::Fastest)
}
