//! The crate `mcap` reads files of `posegate replay --mcap`, and `posegate replay` reads files of the crate.

use mcap::records::MessageHeader;
use mcap::{MessageStream, WriteOptions};
use posegate_testkit::bags::{Bag, Compression, Pose};
use posegate_testkit::{program, root};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use std::process::{Command, Stdio};

/// Returns a recording of a drive to the dock: estimates and true poses.
fn drive(compression: Option<Compression>, count: u32) -> Vec<u8> {
    let mut bag = Bag::new(compression, true);
    for k in 0..count {
        let left = 1.0 - f64::from(k) / f64::from(count);
        let pose = Pose {
            t_s: 1.0 + 0.05 * f64::from(k),
            x: -0.2 * left,
            y: 0.05 * left,
            ..Pose::AT_DOCK
        };
        bag.pose("/amcl_pose", &pose);
        bag.truth("/mocap", &pose);
    }
    bag.finish()
}

/// Runs `posegate replay` in a folder on `drive.mcap` and returns its summary, without the fields about the file's layout.
fn replay(folder: &Path, bag: &[u8], more: &[&str]) -> Value {
    std::fs::write(folder.join("drive.mcap"), bag).unwrap();
    let output = Command::new(program())
        .arg("replay")
        .arg(root().join("examples/sites/dock.toml"))
        .args([
            "drive.mcap",
            "--task",
            "dock",
            "--topic",
            "/amcl_pose",
            "--truth",
            "/mocap",
            "--json",
        ])
        .args(more)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    // Exit code 1: a permit that is false by the true poses.
    assert!(matches!(output.status.code(), Some(0 | 1)), "{said}");
    let mut summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    let recording = summary["recording"].as_object_mut().unwrap();
    for key in ["bytes", "indexed"] {
        recording.remove(key).expect(key);
    }
    summary
}

/// Returns the messages of a file, rewritten by the crate.
fn rewritten(bag: &[u8], options: WriteOptions) -> Vec<u8> {
    let mut writer = options
        .profile("ros2")
        .compression(None)
        .create(Cursor::new(vec![]))
        .unwrap();
    for message in MessageStream::new(bag).unwrap() {
        let message = message.unwrap();
        let channel = &message.channel;
        let schema = channel.schema.as_ref().unwrap();
        let schema = writer
            .add_schema(&schema.name, &schema.encoding, &schema.data)
            .unwrap();
        let channel = writer.add_channel(
            schema,
            &channel.topic,
            &channel.message_encoding,
            &BTreeMap::new(),
        );
        let header = MessageHeader {
            channel_id: channel.unwrap(),
            sequence: message.sequence,
            log_time: message.log_time,
            publish_time: message.publish_time,
        };
        writer
            .write_to_known_channel(&header, &message.data)
            .unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn crate_and_testkit_files_give_equal_replays() {
    let folder = tempfile::tempdir().unwrap();
    let own = drive(None, 200);
    let expected = replay(folder.path(), &own, &[]);
    assert_eq!(expected["estimates"], 200);
    for compression in [Compression::Lz4, Compression::Zstd] {
        assert_eq!(
            replay(folder.path(), &drive(Some(compression), 200), &[]),
            expected
        );
    }
    let index = |yes| {
        WriteOptions::new()
            .emit_chunk_indexes(yes)
            .emit_message_indexes(yes)
            .emit_summary_records(yes)
            .emit_summary_offsets(yes)
    };
    for options in [
        WriteOptions::new(),
        index(true).chunk_size(Some(1000)),
        index(false).chunk_size(Some(4096)),
        WriteOptions::new().use_chunks(false),
    ] {
        let bag = rewritten(&own, options);
        assert!(bag != own);
        let found = replay(folder.path(), &bag, &[]);
        assert!(found == expected, "{}", found["recording"]);
    }
}

#[test]
fn replay_channels_are_read_by_mcap_crate() {
    let folder = tempfile::tempdir().unwrap();
    // More than a chunk of 1 MiB.
    let count = 4000;
    let more = ["--mcap", "out.mcap", "--rows", "rows.jsonl"];
    let summary = replay(folder.path(), &drive(None, count), &more);
    let rows = std::fs::read_to_string(folder.path().join("rows.jsonl")).unwrap();
    let rows: Vec<Value> = rows
        .lines()
        .map(|row| serde_json::from_str(row).unwrap())
        .collect();
    let bytes = std::fs::read(folder.path().join("out.mcap")).unwrap();
    let index = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert!(index.chunk_indexes.len() > 1);
    let mut counts = BTreeMap::<String, u64>::new();
    for message in MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert_eq!(message.channel.message_encoding, "json");
        assert_eq!(
            message.channel.schema.as_ref().unwrap().encoding,
            "jsonschema"
        );
        let value: Value = serde_json::from_slice(&message.data).unwrap();
        let read = counts.entry(message.channel.topic.clone()).or_default();
        match message.channel.topic.as_str() {
            "/posegate/verdict" => {
                let row = &rows[*read as usize];
                assert_eq!(value["margin"], row["margin"]);
                assert_eq!(value["permit"], u8::from(row["verdict"] == "permit"));
                let logged = row["t_s"].as_f64().unwrap() + row["age_s"].as_f64().unwrap();
                assert_eq!(message.log_time, (logged * 1e9).round() as u64);
            }
            "/posegate/summary" => assert_eq!(value["rules"], summary["rules"]),
            _ => {}
        }
        *read += 1;
    }
    let count = u64::from(count);
    assert_eq!(
        counts.values().copied().collect::<Vec<_>>(),
        [count, 1, count, count]
    );
    assert_eq!(index.stats.unwrap().message_count, 3 * count + 1);
}
