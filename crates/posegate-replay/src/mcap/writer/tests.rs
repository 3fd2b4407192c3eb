use super::*;
use crate::mcap::chunk;
use crate::mcap::records::message;
use proptest::prelude::*;
use std::io::Cursor;

/// The test data: message types and topics, then messages by topic, time and number of bytes.
#[derive(Clone, Debug)]
struct Content {
    topics: usize,
    messages: Vec<(usize, u64, usize)>,
}

fn data(length: usize, time: u64) -> Vec<u8> {
    (0..length).map(|k| (k as u64 ^ time) as u8).collect()
}

fn written(content: &Content) -> Vec<u8> {
    let mut file = Writer::new(Vec::new(), "posegate").unwrap();
    for topic in 0..content.topics {
        let (name, topic) = (format!("type{topic}"), format!("/topic{topic}"));
        let schema = file.add_schema(&name, "jsonschema", b"{}").unwrap();
        file.add_channel(schema, &topic, "json").unwrap();
    }
    for (sequence, (topic, time, length)) in content.messages.iter().enumerate() {
        let head = Head {
            channel: *topic as u16 + 1,
            sequence: sequence as u32,
            time_ns: *time,
        };
        file.write(head, &data(*length, *time)).unwrap();
    }
    file.finish().unwrap()
}

/// Reads the messages of a file with this project's reader, which checks the checksum of each chunk. Also returns the
/// bytes of the chunks' records.
fn read(file: &[u8]) -> (Vec<(usize, u64, usize)>, Vec<usize>) {
    let (mut rest, mut messages, mut sizes) = (&file[MAGIC.len()..], vec![], vec![]);
    let mut budget = chunk::Budget::new();
    while let Some((opcode, body, others)) = chunk::next(rest) {
        rest = others;
        if opcode != op::CHUNK {
            continue;
        }
        let records = chunk::records(body, &mut budget).unwrap();
        sizes.push(records.len());
        let mut inner = &records[..];
        while let Some((opcode, body, others)) = chunk::next(inner) {
            inner = others;
            if opcode == op::MESSAGE {
                let message = message(body).unwrap();
                let topic = usize::from(message.channel_id) - 1;
                messages.push((topic, message.logged_ns, message.data.len()));
                assert_eq!(message.data, data(message.data.len(), message.logged_ns));
            }
        }
    }
    assert_eq!(rest, MAGIC);
    (messages, sizes)
}

fn content() -> impl Strategy<Value = Content> {
    (1usize..5).prop_flat_map(|topics| {
        // Large messages, so that some files have several chunks.
        let length = prop_oneof![9 => 0usize..300, 1 => 0usize..700_000];
        let message = (0..topics, any::<u64>(), length);
        let messages = prop::collection::vec(message, 0..40);
        messages.prop_map(move |messages| Content { topics, messages })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The crate `mcap` reads files of this writer in `crates/posegate-peers`.
    #[test]
    fn written_messages_are_read_back(content in content()) {
        prop_assert_eq!(read(&written(&content)).0, content.messages);
    }
}

#[test]
fn chunks_end_after_one_mebibyte() {
    let messages: Vec<_> = (0..30).map(|k| (k % 2, k as u64, 100_000)).collect();
    let content = Content {
        topics: 3,
        messages,
    };
    let (messages, sizes) = read(&written(&content));
    assert_eq!(messages.len(), 30);
    assert_eq!(sizes.len(), 3);
    assert!(sizes.iter().all(|size| *size < (1 << 20) + 101_000));
}

#[test]
fn full_output_is_an_error() {
    let mut writer = Writer::new(Cursor::new([0u8; 200]), "posegate").map_err(drop);
    let writer = writer.as_mut().unwrap();
    let channel = writer.add_channel(0, "/t", "json").unwrap();
    let head = Head {
        channel,
        sequence: 0,
        time_ns: 0,
    };
    let result = (0..3).try_for_each(|_| writer.write(head, &vec![0; CHUNK]));
    assert_eq!(result.unwrap_err().kind(), ErrorKind::WriteZero);
}
