//! MCAP files, <https://mcap.dev/spec>: reads the records of a recording, writes the channels of a replay.
//!
//! Entry points: [`records`] and [`chunk`] parse records, [`Writer`] writes a file. Every length is compared with the
//! existing bytes before memory is reserved for it.

pub(super) use self::writer::{Head, Writer};

pub(super) mod chunk;
pub(super) mod records;
pub(super) mod unpack;
mod writer;

/// First and last bytes of a file.
pub(super) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// Bytes of a record before its body: the opcode and the length of the body.
pub(super) const HEAD: usize = 9;

/// First byte of a record.
pub(super) mod op {
    pub(crate) const HEADER: u8 = 0x01;
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const SCHEMA: u8 = 0x03;
    pub(crate) const CHANNEL: u8 = 0x04;
    pub(crate) const MESSAGE: u8 = 0x05;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const MESSAGE_INDEX: u8 = 0x07;
    pub(crate) const CHUNK_INDEX: u8 = 0x08;
    pub(crate) const STATISTICS: u8 = 0x0b;
    pub(crate) const SUMMARY_OFFSET: u8 = 0x0e;
    pub(crate) const DATA_END: u8 = 0x0f;
}

/// CRC-32 of chunks and sections. The table of 16 KiB keeps it faster than decompression.
static CRC_32: crc::Crc<u32, crc::Table<16>> =
    crc::Crc::<u32, crc::Table<16>>::new(&crc::CRC_32_ISO_HDLC);
