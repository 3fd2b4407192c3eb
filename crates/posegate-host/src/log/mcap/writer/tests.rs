use super::*;
use crate::log::mcap::chunk;
use crate::log::mcap::records::message;
use ::mcap::WriteOptions;
use ::mcap::records::MessageHeader;
use proptest::prelude::*;
use std::io::Cursor;

/// What is written: message types and topics, then messages by topic, time and number of bytes.
#[derive(Clone, Debug)]
struct Content {
    topics: usize,
    messages: Vec<(usize, u64, usize)>,
}

fn data(length: usize, time: u64) -> Vec<u8> {
    (0..length).map(|k| (k as u64 ^ time) as u8).collect()
}

/// The file by this module, and by the crate `mcap`.
fn both(content: &Content) -> [Vec<u8>; 2] {
    let mut own = Writer::new(Vec::new(), "posegate").unwrap();
    let mut other = WriteOptions::new()
        .library("posegate")
        .compression(None)
        .create(Cursor::new(Vec::new()))
        .unwrap();
    for topic in 0..content.topics {
        let (name, topic) = (format!("type{topic}"), format!("/topic{topic}"));
        let schema = own.add_schema(&name, "jsonschema", b"{}").unwrap();
        assert_eq!(
            schema,
            other.add_schema(&name, "jsonschema", b"{}").unwrap()
        );
        let channel = own.add_channel(schema, &topic, "json").unwrap();
        let metadata = BTreeMap::new();
        let others = other.add_channel(schema, &topic, "json", &metadata);
        assert_eq!(channel, others.unwrap());
    }
    for (sequence, (topic, time, length)) in content.messages.iter().enumerate() {
        let (channel, sequence, time) = (*topic as u16 + 1, sequence as u32, *time);
        let head = Head {
            channel,
            sequence,
            time_ns: time,
        };
        own.write(head, &data(*length, time)).unwrap();
        let header = MessageHeader {
            channel_id: channel,
            sequence,
            log_time: time,
            publish_time: time,
        };
        other
            .write_to_known_channel(&header, &data(*length, time))
            .unwrap();
    }
    other.finish().unwrap();
    [own.finish().unwrap(), other.into_inner().into_inner()]
}

fn content() -> impl Strategy<Value = Content> {
    (1usize..5).prop_flat_map(|topics| {
        // Large ones, so that some files have several chunks.
        let length = prop_oneof![9 => 0usize..300, 1 => 0usize..700_000];
        let message = (0..topics, any::<u64>(), length);
        let messages = prop::collection::vec(message, 0..40);
        messages.prop_map(move |messages| Content { topics, messages })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn files_are_those_of_the_crate_mcap(content in content()) {
        let [own, other] = both(&content);
        prop_assert!(own == other, "{} and {} bytes", own.len(), other.len());
    }
}

#[test]
fn chunks_end_behind_a_mebibyte() {
    let messages = (0..30).map(|k| (k % 2, k as u64, 100_000)).collect();
    let content = Content {
        topics: 3,
        messages,
    };
    let [own, other] = both(&content);
    assert!(own == other);
    let summary = ::mcap::Summary::read(&own).unwrap().unwrap();
    let sizes = summary.chunk_indexes.iter().map(|c| c.uncompressed_size);
    let sizes: Vec<u64> = sizes.collect();
    assert_eq!(sizes.len(), 3);
    assert!(sizes.iter().all(|size| *size < (1 << 20) + 101_000));
    assert_eq!(summary.stats.unwrap().message_count, 30);
}

/// The bag's reader takes the chunks back, with their checksums.
#[test]
fn own_chunks_are_read_back() {
    let content = Content {
        topics: 2,
        messages: vec![(0, 5, 10), (1, 3, 0), (0, u64::MAX, 1000)],
    };
    let [own, _] = both(&content);
    let (mut rest, mut messages) = (&own[MAGIC.len()..], Vec::new());
    let mut budget = chunk::Budget::new();
    while let Some((opcode, body, others)) = chunk::next(rest) {
        rest = others;
        if opcode != op::CHUNK {
            continue;
        }
        let records = chunk::records(body, &mut budget).unwrap();
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
    assert_eq!(messages, content.messages);
}

#[test]
fn an_output_that_is_full_is_an_error() {
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
