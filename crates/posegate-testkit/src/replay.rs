//! The vector file, and the replay of its decisions, by the same code on the host and on every core.
//!
//! # Bytes (little-endian)
//!
//! | field | type |
//! |---|---|
//! | magic `PGVECTOR` | 8 bytes |
//! | number of records | u32 |
//! | the records | |
//! | CRC-32C of all bytes before | u32 |
//!
//! and a record:
//!
//! | field | type |
//! |---|---|
//! | answer of [`Evaluator::permits`]: 0 permit, else the code of the reason; 0x80 added if a reply follows | u8 |
//! | length of the request | u8 |
//! | [`Request::body`], which names the table | |
//! | with 0x80: [`Reply::body`] of [`Request::evaluate`]: the same answer with margin and worst pose | 23 bytes |
#![allow(dead_code)] // Firmware includes this file by path, and uses a part.

use posegate::gate::Reason;
use posegate::recordings::Evaluator;
use posegate::table::checksum;
use posegate::wire::{Reply, Request};

/// The first eight bytes of a vector file.
pub const MAGIC: [u8; 8] = *b"PGVECTOR";
/// Bytes before the records.
pub const HEADER_LENGTH: usize = 12;
/// Added to an answer that a reply follows.
pub const WITH_REPLY: u8 = 0x80;
/// Bytes of a reply.
pub const REPLY_LENGTH: usize = 23;
/// Smallest number of decisions in a valid test.
pub const FEWEST: u32 = 10_000;
/// Maximum age of every gate.
pub const MAXIMUM_AGE_MS: u32 = 200;

/// Why bytes are not a vector file.
pub type Fault = &'static str;

/// A request and its expected decision.
#[derive(Clone, Debug)]
pub struct Record<'a> {
    /// The request.
    pub request: Request,
    /// 0 or the code of a reason.
    pub answer: u8,
    /// The body of the reply, if the record has one.
    pub reply: Option<&'a [u8]>,
}

impl Record<'_> {
    /// Returns `true` if the gates decide as the record states, to the last bit.
    pub fn holds(&self, gates: &[Evaluator<'_>]) -> bool {
        answer(&self.request, gates) == Some(self.answer)
            && self
                .reply
                .is_none_or(|expected| reply(&self.request, gates).body() == *expected)
    }
}

/// Returns the decision without margin. `None` if no gate has the number.
pub fn answer(request: &Request, gates: &[Evaluator<'_>]) -> Option<u8> {
    let gate = gates.get(usize::from(request.table))?;
    let decision = gate.permits(request.now_ms, request.stamp_ms, request.pose_set());
    Some(decision.map_or_else(Reason::code, |()| 0))
}

/// Returns the decision with margin and worst pose.
pub fn reply(request: &Request, gates: &[Evaluator<'_>]) -> Reply {
    Reply {
        sequence: request.sequence,
        verdict: request.evaluate(gates),
        interlock_high: false,
    }
}

/// The records of a vector file.
pub struct Records<'a> {
    rest: &'a [u8],
    left: u32,
}

impl<'a> Records<'a> {
    /// Checks a file's magic, length and checksum.
    pub fn of(file: &'a [u8]) -> Result<Self, Fault> {
        let (content, crc) = file.split_last_chunk().ok_or("too short")?;
        if checksum(content) != u32::from_le_bytes(*crc) {
            return Err("the checksum does not hold");
        }
        let (magic, rest) = content.split_first_chunk().ok_or("too short")?;
        let (count, rest) = rest.split_first_chunk().ok_or("too short")?;
        if *magic != MAGIC {
            return Err("no vector file");
        }
        Ok(Self {
            rest,
            left: u32::from_le_bytes(*count),
        })
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], Fault> {
        let cut = "a record is cut";
        let (part, rest) = self.rest.split_at_checked(length).ok_or(cut)?;
        self.rest = rest;
        Ok(part)
    }

    fn record(&mut self) -> Result<Record<'a>, Fault> {
        let head = self.take(2)?;
        let (code, length) = (head[0], head[1]);
        let body = self.take(usize::from(length))?;
        let with_reply = code & WITH_REPLY != 0;
        Ok(Record {
            request: Request::from_body(body).map_err(|_| "a record holds no request")?,
            answer: code & !WITH_REPLY,
            reply: with_reply.then(|| self.take(REPLY_LENGTH)).transpose()?,
        })
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = Result<Record<'a>, Fault>;

    fn next(&mut self) -> Option<Self::Item> {
        match self.left {
            0 if self.rest.is_empty() => None,
            0 => {
                self.rest = &[];
                Some(Err("bytes after the last record"))
            }
            _ => {
                self.left -= 1;
                Some(self.record())
            }
        }
    }
}

/// The result of replaying a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Decisions made.
    pub count: u32,
    /// Decisions that differ from the file.
    pub mismatches: u32,
    /// The number of the first mismatch.
    pub first_mismatch: Option<u32>,
}

impl Outcome {
    /// Returns `true` if there were enough decisions and no mismatch.
    pub const fn is_good(&self) -> bool {
        self.count >= FEWEST && self.mismatches == 0
    }
}

/// Repeats every decision of a file.
pub fn replay(file: &[u8], gates: &[Evaluator<'_>]) -> Result<Outcome, Fault> {
    let mut outcome = Outcome::default();
    for record in Records::of(file)? {
        if !record?.holds(gates) {
            outcome.mismatches += 1;
            outcome.first_mismatch.get_or_insert(outcome.count);
        }
        outcome.count += 1;
    }
    Ok(outcome)
}
