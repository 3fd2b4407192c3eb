//! The records of an MCAP file that are read. Every length is compared with the existing bytes, so no memory is
//! reserved for missing ones.

use std::str;

/// The longest name of a topic, a schema or an encoding, bytes. ROS 2 allows 255.
pub(crate) const LONGEST_NAME: usize = 256;

/// The reason why a record cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum BadRecord {
    /// A length or a number extends beyond the record's end.
    #[error("a record ends before its {0}")]
    Short(&'static str),
    /// A name that is not UTF-8.
    #[error("the {0} of a record is not UTF-8")]
    NotText(&'static str),
    /// A name that is too long to be stored for each topic.
    #[error("the {0} of a record has more than {LONGEST_NAME} bytes")]
    Long(&'static str),
}

/// A message type.
pub(crate) struct Schema<'b> {
    pub id: u16,
    pub name: &'b str,
    pub encoding: &'b str,
    pub definition: &'b [u8],
}

/// A topic.
pub(crate) struct Channel<'b> {
    pub id: u16,
    pub schema_id: u16,
    pub topic: &'b str,
    pub message_encoding: &'b str,
}

/// A message; the rest of its record.
pub(crate) struct Message<'b> {
    pub channel_id: u16,
    pub logged_ns: u64,
    pub data: &'b [u8],
}

/// A chunk.
pub(crate) struct Chunk<'b> {
    /// The size that the header states; not checked.
    pub uncompressed_size: u64,
    /// CRC-32 of the uncompressed records; 0 if there is none.
    pub crc: u32,
    pub compression: &'b str,
    /// The compressed records.
    pub data: &'b [u8],
}

/// The unread fields of a record.
struct Fields<'b>(&'b [u8]);

impl<'b> Fields<'b> {
    fn bytes(&mut self, length: u64, what: &'static str) -> Result<&'b [u8], BadRecord> {
        let length = usize::try_from(length).map_err(|_| BadRecord::Short(what))?;
        let (taken, rest) = self
            .0
            .split_at_checked(length)
            .ok_or(BadRecord::Short(what))?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], BadRecord> {
        let (taken, rest) = self.0.split_first_chunk().ok_or(BadRecord::Short(what))?;
        self.0 = rest;
        Ok(*taken)
    }

    fn text(&mut self, what: &'static str) -> Result<&'b str, BadRecord> {
        let length = u32::from_le_bytes(self.array(what)?);
        let bytes = self.bytes(length.into(), what)?;
        if bytes.len() > LONGEST_NAME {
            return Err(BadRecord::Long(what));
        }
        str::from_utf8(bytes).map_err(|_| BadRecord::NotText(what))
    }
}

pub(crate) fn schema(body: &[u8]) -> Result<Schema<'_>, BadRecord> {
    let mut fields = Fields(body);
    let id = u16::from_le_bytes(fields.array("id")?);
    let name = fields.text("schema name")?;
    let encoding = fields.text("schema encoding")?;
    let length = u32::from_le_bytes(fields.array("schema definition")?);
    let definition = fields.bytes(length.into(), "schema definition")?;
    Ok(Schema {
        id,
        name,
        encoding,
        definition,
    })
}

pub(crate) fn channel(body: &[u8]) -> Result<Channel<'_>, BadRecord> {
    let mut fields = Fields(body);
    let id = u16::from_le_bytes(fields.array("id")?);
    let schema_id = u16::from_le_bytes(fields.array("schema id")?);
    let topic = fields.text("topic")?;
    let message_encoding = fields.text("message encoding")?;
    Ok(Channel {
        id,
        schema_id,
        topic,
        message_encoding,
    })
}

pub(crate) fn message(body: &[u8]) -> Result<Message<'_>, BadRecord> {
    let mut fields = Fields(body);
    let channel_id = u16::from_le_bytes(fields.array("channel id")?);
    fields.bytes(4, "sequence number")?;
    let logged_ns = u64::from_le_bytes(fields.array("log time")?);
    fields.bytes(8, "publish time")?;
    Ok(Message {
        channel_id,
        logged_ns,
        data: fields.0,
    })
}

/// Reads a chunk. Padding may follow its records.
pub(crate) fn chunk(body: &[u8]) -> Result<Chunk<'_>, BadRecord> {
    let mut fields = Fields(body);
    fields.bytes(16, "times")?;
    let uncompressed_size = u64::from_le_bytes(fields.array("uncompressed size")?);
    let crc = u32::from_le_bytes(fields.array("checksum")?);
    let compression = fields.text("compression")?;
    let length = u64::from_le_bytes(fields.array("compressed size")?);
    let data = fields.bytes(length, "compressed records")?;
    Ok(Chunk {
        uncompressed_size,
        crc,
        compression,
        data,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Vec<u8> {
        let mut bytes = (text.len() as u32).to_le_bytes().to_vec();
        bytes.extend(text.as_bytes());
        bytes
    }

    fn chunk_bytes() -> Vec<u8> {
        [
            [0; 16].to_vec(),
            7u64.to_le_bytes().to_vec(),
            [0; 4].to_vec(),
            text("zstd"),
            3u64.to_le_bytes().to_vec(),
            b"abc".to_vec(),
        ]
        .concat()
    }

    /// Each topic stores the names of its schema: a name of 16 MiB with a hundred topics would take 1.6 GB.
    #[test]
    fn names_above_the_limit_are_refused() {
        for (length, is_name) in [(LONGEST_NAME, true), (LONGEST_NAME + 1, false)] {
            let mut body = Vec::from([1, 0]);
            body.extend((length as u32).to_le_bytes());
            body.resize(6 + length, b'a');
            body.extend([0; 8]);
            assert_eq!(schema(&body).is_ok(), is_name);
        }
    }

    #[test]
    fn truncated_records_are_refused_at_every_length() {
        let schema_bytes = [[1, 0].to_vec(), text("a/B"), text("ros2msg"), text("x")].concat();
        let channel_bytes = [[1, 0, 2, 0].to_vec(), text("/t"), text("cdr")].concat();
        assert_eq!(schema(&schema_bytes).map(|s| s.definition), Ok(&b"x"[..]));
        assert_eq!(channel(&channel_bytes).map(|c| c.topic), Ok("/t"));
        assert_eq!(message(&[5; 22]).map(|m| m.data.len()), Ok(0));
        let chunk_bytes = chunk_bytes();
        assert_eq!(chunk(&chunk_bytes).map(|c| c.data), Ok(&b"abc"[..]));
        for cut in 0..schema_bytes.len() {
            assert!(schema(&schema_bytes[..cut]).is_err(), "{cut}");
        }
        for cut in 0..channel_bytes.len() {
            assert!(channel(&channel_bytes[..cut]).is_err(), "{cut}");
        }
        for cut in 0..22 {
            assert!(message(&[5; 22][..cut]).is_err(), "{cut}");
        }
        for cut in 0..chunk_bytes.len() {
            assert!(chunk(&chunk_bytes[..cut]).is_err(), "{cut}");
        }
    }

    #[test]
    fn lengths_beyond_the_bytes_are_refused() {
        let mut bytes = chunk_bytes();
        let at = bytes.len() - 11;
        for length in [4, 1 << 31, 1 << 63, u64::MAX] {
            bytes[at..at + 8].copy_from_slice(&length.to_le_bytes());
            assert_eq!(
                chunk(&bytes).err(),
                Some(BadRecord::Short("compressed records"))
            );
        }
        let mut bytes = chunk_bytes();
        bytes[28..32].copy_from_slice(&u32::MAX.to_le_bytes());
        assert_eq!(chunk(&bytes).err(), Some(BadRecord::Short("compression")));
        assert_eq!(
            channel(&[0, 0, 0, 0, 1, 0, 0, 0, 0xff]).err(),
            Some(BadRecord::NotText("topic"))
        );
    }
}
